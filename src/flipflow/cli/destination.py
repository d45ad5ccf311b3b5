"""Where a command writes its files: seen to before anything is computed, said at the end."""

from __future__ import annotations

import contextlib
import os
import sys
import textwrap
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from flipflow.cli.outcome import OUTCOME, STOPPED
from flipflow.cli.output import COLUMNS, JSON, OUTPUT, TERMINAL, console
from flipflow.errors import Cancelled, InputError, StoreError
from flipflow.results.stage import Stage
from flipflow.results.store import (
    checked_place,
    json_text,
    prepare_folder,
    refuse_input,
    write_file,
)
from flipflow.signals import undisturbed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rich.console import Console

    from flipflow.plotting.figure import Figure

# Endings of figures and tables.
OF_FOLDER = {".csv", ".html", ".nc", ".pdf", ".svg", ".toml", ".xlsx"}


class Destination:
    """A folder for figures and data, and a file or the terminal for a JSON document.

    Entered as a ``with`` block before anything is computed, it refuses what cannot be written. All
    that a command writes takes its place together, when :meth:`keep` is called; from then on Ctrl-C
    says what is written.

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
        self.folder, self.json, self._reads = folder, json, tuple(reads)
        self._quiet = quiet
        self._made: list[Path] = []
        self._stage = Stage(folder, OUTPUT)
        self._names: list[str] = []
        self._places: list[str] = []
        self._answer = ""
        self._kept = False

    def __enter__(self) -> Self:
        """See that all can be written, before the work that ends in this destination."""
        try:
            with undisturbed():
                self._prepare()
        except BaseException:
            self._remove_made()
            raise
        return self

    def _prepare(self) -> None:
        if self.folder is not None:
            above = (self.folder, *self.folder.parents)
            self._made = [one for one in above if not os.path.lexists(one)]
            prepare_folder(self.folder, OUTPUT)
        if self.json not in (None, TERMINAL):
            refuse_input(self.json, self._reads, JSON)
            checked_place(self.json, JSON)
            self._refuse_figure(self.json)

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Drop what is not kept."""
        with undisturbed():
            told = self._stage.told(str(error))
            self._stage.discard()
            if not self._kept:
                self._remove_made()
        if isinstance(error, StoreError) and told != str(error):
            raise StoreError(told) from None

    def _refuse_figure(self, json: str) -> None:
        """See that the document does not take the place of a figure or a table of the folder."""
        place = Path(os.path.realpath(json))
        beside = self.folder is not None and place.parent == Path(os.path.realpath(self.folder))
        if beside and place.suffix in OF_FOLDER:
            remedy = f"a file of {OUTPUT} may have this name, give it the ending .json"
            raise InputError(JSON, json, remedy)

    def _remove_made(self) -> None:
        """Remove the folders that were made for files that do not come."""
        for one in self._made:
            with contextlib.suppress(OSError):
                one.rmdir()

    @property
    def spoken(self) -> bool:
        """Whether the terminal is for words; else it is for JSON alone."""
        return self.json != TERMINAL and not self._quiet

    def picture(self, name: str, figure: Figure, subject: str = "") -> None:
        """Write a figure, which carries what it belongs to, into the folder."""
        replace(figure, subject=subject).write(self.path(name))
        self.wrote(name)

    def content(self, name: str, content: bytes | str) -> None:
        """Write a file into the folder; it is not told yet."""
        write_file(self.path(name), content, OUTPUT)

    def data(self, name: str, document: Mapping[str, object]) -> None:
        """Write a JSON document into the folder."""
        self.content(name, json_text(document))
        self.wrote(name)

    def document(self, document: Mapping[str, object]) -> None:
        """Write the JSON document where ``--json`` asks for it; in the terminal when kept."""
        if self.json is None:
            return
        text = json_text(document)
        if self.json == TERMINAL:
            self._answer = text
        else:
            self._stage.hold(self.json, text, JSON)
            self._places.append(self.json)

    def result(self, found: object, **more: object) -> None:
        """Write a result, and what else is said of it, where ``--json`` asks for it."""
        if self.json is not None:
            from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis

            self.document({**document_of(found), **more})

    def path(self, name: str) -> Path:
        """Where to write a file of the folder; a file that is read is refused."""
        place = Path(self.folder or "") / name
        refuse_input(place, self._reads, OUTPUT)
        checked_place(place, OUTPUT)
        return self._stage.aside / name

    def all_of(self, names: Iterable[str]) -> Path:
        """The folder that something else is to write these files into."""
        for name in names:
            self.path(name)
        return self._stage.aside

    def replaces(self, names: Iterable[str]) -> None:
        """Files of the folder that go when the new ones come: those of the set they replace."""
        for name in names:
            self.path(name)
        self._stage.drop(names)

    def keep(self) -> None:
        """Let all that is written take its place, at once; before the first word is said of it.

        Raises
        ------
        StoreError
            When that cannot be; then every file is as it was.
        """
        if not self._kept:
            self._stage.prepare()
            with undisturbed():
                self._stage.commit()
                self._kept = True
                OUTCOME.wrote(*self._where())
            sys.stdout.write(self._answer)

    def wrote(self, *names: str) -> None:
        """Note files of the folder that something else has written."""
        self._names += names

    def tell(self) -> None:
        """Say in the terminal what is written where; nothing where nothing is."""
        self.keep()
        for line in self._lines() if self.spoken else ():
            # A path stays on one line, so that it can be copied.
            console().print(line, soft_wrap=True)

    def finish(self, show: Callable[[Console], None]) -> None:
        """Keep what is written, show the result where the terminal is for words, tell the rest."""
        self.keep()
        if self.spoken:
            show(console())
        self.tell()

    def stopped(self) -> Cancelled:
        """The error that ends a command after Ctrl-C that has shown what was finished."""
        if self._where():
            return OUTCOME.error()
        return Cancelled(f"{STOPPED}; what was finished is shown.")

    def _where(self) -> list[str]:
        """Places that are written, or will be."""
        return [str(self.folder)] * bool(self._names) + self._places

    def _lines(self) -> Iterable[str]:
        if self._names:
            head, names = f"Written to {self.folder}:", ", ".join(self._names)
            if len(head) + 1 + len(names) <= COLUMNS:
                yield f"{head} {names}"
            else:
                yield head
                yield from textwrap.wrap(
                    names,
                    COLUMNS,
                    initial_indent="  ",
                    subsequent_indent="  ",
                    break_on_hyphens=False,
                )
        yield from (f"Written to {place}" for place in self._places)
