"""Where a command writes its files: seen to before anything is computed, said at the end."""

from __future__ import annotations

import sys
import textwrap
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from flipflow.cli.output import COLUMNS, JSON, OUTPUT, TERMINAL, console
from flipflow.errors import Cancelled
from flipflow.results.store import (
    checked_place,
    json_text,
    prepare_folder,
    refuse_input,
    write_file,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from flipflow.plotting.figure import Figure

CLOCK = 0.05  # s by which the clock of files may be late
STOPPED, NOTHING = "Stopped by the user", "nothing is written"


class Destination:
    """A folder for figures and data, and a file or the terminal for a JSON document.

    Made before anything is computed, it refuses what cannot be written. In a ``with`` block
    Ctrl-C ends the command by a sentence that says what is written.

    Parameters
    ----------
    folder
        What ``--output`` names; None where nothing but the terminal is written to.
    json
        What ``--json`` names; ``-`` is the terminal, which then shows nothing else.
    reads
        Files that the command reads: they are not written to.
    quiet
        Whether nothing is said in the terminal.
    """

    def __init__(
        self, folder: Path | None, json: str | None, reads: Iterable[str] = (), *,
        quiet: bool = False,
    ) -> None:  # fmt: skip
        if folder is not None:
            prepare_folder(folder, OUTPUT)
        self.folder, self.json, self._reads = folder, json, tuple(reads)
        self._quiet = quiet
        if json not in (None, TERMINAL):
            refuse_input(json, self._reads, JSON)
            checked_place(json, JSON)
        self._begun = time.time()
        self._names: list[str] = []
        self._places: list[str] = []

    def __enter__(self) -> Self:
        """Begin the work that ends in this destination."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, _error: object, _trace: TracebackType | None
    ) -> None:
        """Turn Ctrl-C into the sentence that ends a stopped command."""
        if kind is not None and issubclass(kind, KeyboardInterrupt):
            raise self.stopped() from None

    @property
    def spoken(self) -> bool:
        """Whether the terminal is for words; else it is for JSON alone."""
        return self.json != TERMINAL and not self._quiet

    def picture(self, name: str, figure: Figure, subject: str = "") -> None:
        """Write a figure, which carries what it belongs to, into the folder."""
        replace(figure, subject=subject).write(self.path(name))
        self.wrote(name)

    def data(self, name: str, document: Mapping[str, object]) -> None:
        """Write a JSON document into the folder."""
        write_file(self.path(name), json_text(document), OUTPUT)
        self.wrote(name)

    def document(self, document: Mapping[str, object]) -> None:
        """Write the JSON document where ``--json`` asks for it."""
        if self.json is None:
            return
        text = json_text(document)
        if self.json == TERMINAL:
            sys.stdout.write(text)
        else:
            write_file(self.json, text, JSON)
            self._places.append(self.json)

    def path(self, name: str) -> Path:
        """Where a file of the folder stands; a file that is read is refused."""
        place = Path(self.folder or "") / name
        refuse_input(place, self._reads, OUTPUT)
        return place

    def all_of(self, names: Iterable[str]) -> Path:
        """The folder, for something else to write these files into."""
        for name in names:
            self.path(name)
        return Path(self.folder or "")

    def wrote(self, *names: str) -> None:
        """Note files of the folder that something else has written."""
        self._names += names

    def tell(self) -> None:
        """Say in the terminal what is written where; nothing where nothing is."""
        for line in self._lines() if self.spoken else ():
            # A path stays on one line, so that it can be copied.
            console().print(line, soft_wrap=True)

    def stopped(self, *, kept: bool = False) -> Cancelled:
        """The error that ends a command after Ctrl-C; ``kept``: what was finished is shown."""
        places = [str(self.folder)] * self._touched() + self._places
        if places:
            return Cancelled(f"{STOPPED}; what was finished is in {' and '.join(places)}.")
        return Cancelled(f"{STOPPED}; {'what was finished is shown' if kept else NOTHING}.")

    def _touched(self) -> bool:
        """Whether a file of the folder was written since the command began."""
        files = () if self.folder is None else self.folder.iterdir()
        return any(file.stat().st_mtime > self._begun - CLOCK for file in files)

    def _lines(self) -> Iterable[str]:
        if self._names:
            head, names = f"Written to {self.folder}:", ", ".join(self._names)
            if len(head) + 1 + len(names) <= COLUMNS:
                yield f"{head} {names}"
            else:
                yield head
                yield from textwrap.wrap(
                    names, COLUMNS, initial_indent="  ", subsequent_indent="  "
                )
        yield from (f"Written to {place}" for place in self._places)
