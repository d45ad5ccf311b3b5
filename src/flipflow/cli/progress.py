"""Progress of long work on stderr, and Ctrl-C that keeps what is finished."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from flipflow.errors import Cancelled
from flipflow.model.monitor import Monitor

Result = TypeVar("Result")


@contextmanager
def progress(begin: str) -> Iterator[Monitor]:
    """A bar while the block runs; what it yields takes a sentence and the share done.

    Nothing is written where stderr is not a terminal.
    """
    from rich.console import Console  # noqa: PLC0415  keeps --help quick
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn  # noqa: PLC0415

    terminal = Console(stderr=True)
    if not terminal.is_terminal:
        # rich before 14.3 ends even a bar that is switched off with an empty line.
        yield lambda _sentence, _share: None
        return
    bar = Progress(
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(bar_width=20),
        console=terminal, transient=True,
    )  # fmt: skip
    with bar:
        task = bar.add_task(begin, total=1.0)
        yield lambda sentence, share: bar.update(task, description=sentence, completed=share)


def with_progress(run: Callable[[Monitor], Result]) -> Result:
    """Run with a bar, the kernels compiled ahead."""
    with progress("starting") as tell:
        compile_first(tell)
        return run(tell)


def compile_first(tell: Monitor) -> None:
    """Compile the kernels of an analysis, once per version, and tell how long it has taken."""
    from flipflow.studies.compile_ahead import compile_ahead  # noqa: PLC0415  keeps --help quick

    compile_ahead(lambda seconds: tell(f"compiling, once per version: {seconds:.0f} s", 0.0))


class Stoppable:
    """A monitor that raises Cancelled after Ctrl-C in a stage that keeps what is finished.

    Parameters
    ----------
    tell
        Is told what this is told.
    stage
        First words of what is told in that stage.
    """

    def __init__(self, tell: Monitor, stage: str) -> None:
        self._tell, self._stage = tell, stage
        self._last, self.asked = "", False

    def __call__(self, sentence: str, share: float) -> None:
        """Pass it on, unless the user has asked for the end."""
        self._last = sentence
        if self.asked:
            raise Cancelled("stopped by the user")
        self._tell(sentence, share)

    def answer(self, _number: int, _frame: FrameType | None) -> None:
        """Answer Ctrl-C."""
        if not self._last.startswith(self._stage) or self.asked:
            raise KeyboardInterrupt
        self.asked = True


@contextmanager
def stoppable(tell: Monitor, stage: str) -> Iterator[Stoppable]:
    """A monitor for a stage that Ctrl-C ends so that what is finished is kept.

    ``asked`` says so afterwards, also where all was finished before the monitor was called again.
    In other stages, and at the second time, Ctrl-C ends the program at once.
    """
    told = Stoppable(tell, stage)
    before = signal.signal(signal.SIGINT, told.answer)
    try:
        yield told
    finally:
        signal.signal(signal.SIGINT, before)
