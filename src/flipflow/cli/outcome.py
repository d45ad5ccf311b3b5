"""What is true of the files of a command at every moment: the words in which Ctrl-C ends it."""

from __future__ import annotations

from collections.abc import Callable

from flipflow.errors import Cancelled

STOPPED, NOTHING = "Stopped by the user", "nothing is written"


class Outcome:
    """What a command has written. There is one for the process, as there is one Ctrl-C.

    Parameters
    ----------
    words
        Tells it, in the words that end a stopped command.
    """

    def __init__(self) -> None:
        self._places: list[str] = []
        self.words: Callable[[], str] = self._written

    def wrote(self, *places: str) -> None:
        """Note folders and files that are written whole."""
        if places:
            self._places += places
            self.words = self._written

    def error(self) -> Cancelled:
        """The error that ends a command that is stopped now."""
        return Cancelled(f"{STOPPED}; {self.words()}.")

    def clear(self) -> None:
        """Begin a command."""
        self._places, self.words = [], self._written

    def _written(self) -> str:
        places = " and ".join(dict.fromkeys(self._places))
        return f"what was finished is in {places}" if places else NOTHING


OUTCOME = Outcome()
