"""The errors flipflow raises, each with the exit code of the command line."""

from __future__ import annotations

from typing import ClassVar


class FlipflowError(Exception):
    """Base of every error that flipflow raises on purpose."""

    exit_code: ClassVar[int] = 1


class InputError(FlipflowError, ValueError):
    """Bad input: one sentence that names the field, the value it got and the remedy.

    Parameters
    ----------
    field
        Name of the field as the user wrote it, for example ``"frames.main_mass"``.
    value
        What was given.
    remedy
        What is wrong with it and what would do, without a full stop.
    """

    exit_code = 2

    def __init__(self, field: str, value: object, remedy: str) -> None:
        self.field = field
        self.value = value
        self.remedy = remedy
        super().__init__(f"{field} = {_shown(value)}: {remedy}.")


class IncompleteError(FlipflowError):
    """A calculation ended before it was finished; what was found is kept in its result."""

    exit_code = 3


class StoreError(FlipflowError):
    """A file or store could not be read or written."""

    exit_code = 4


class Cancelled(FlipflowError):  # noqa: N818  the field's word, fixed by the public face
    """The user stopped a long calculation."""

    exit_code = 130


class MissingExtra(FlipflowError, ImportError):  # noqa: N818  fixed by the public face
    """An optional dependency is not installed; the sentence says which extra to install."""

    exit_code = 2


class SampledContactWarning(UserWarning):
    """A contact force was sampled at fixed times: the answer reproduces that method, no more."""


def _shown(value: object) -> str:
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
