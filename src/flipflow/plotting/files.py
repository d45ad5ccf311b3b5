"""What is rendered as a file, in the format that the name's ending tells."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar

from flipflow.errors import InputError
from flipflow.model.arguments import checked_path
from flipflow.results.store import write_file


class Written(ABC):
    """Base of what can be written to a file; ``_FORMATS`` are the endings that it takes."""

    _FORMATS: ClassVar[tuple[str, ...]]

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the picture to a file, in the format that the file's ending names.

        Parameters
        ----------
        path
            ``.html`` is one page that opens offline, interactive where it is a figure; ``.svg``,
            ``.pdf`` and, of a figure, ``.png`` are for print.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            For another ending.
        StoreError
            When the file cannot be written.
        MissingExtra
            When matplotlib, or typst for PDF and PNG, is needed and not installed.
        """
        target = checked_path("path", path)
        ending = target.suffix.lower()
        if ending not in self._FORMATS:
            remedy = f"give a name that ends in {', '.join(self._FORMATS)}"
            raise InputError("path", str(path), remedy)
        write_file(target, self._rendered(ending))
        return target

    @abstractmethod
    def _rendered(self, ending: str) -> bytes: ...
