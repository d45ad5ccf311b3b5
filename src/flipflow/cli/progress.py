"""Progress of long work on stderr."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Result = TypeVar("Result")
Tell = Callable[[str, float], None]


@contextmanager
def progress(begin: str) -> Iterator[Tell]:
    """A bar while the block runs; what it yields takes a sentence and the share done.

    Nothing is written where stderr is not a terminal.
    """
    from rich.console import Console  # noqa: PLC0415  keeps --help quick
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn  # noqa: PLC0415

    terminal = Console(stderr=True)
    bar = Progress(
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(bar_width=20),
        console=terminal, transient=True, disable=not terminal.is_terminal,
    )  # fmt: skip
    with bar:
        task = bar.add_task(begin, total=1.0)
        yield lambda sentence, share: bar.update(task, description=sentence, completed=share)


def with_progress(run: Callable[[Tell], Result]) -> Result:
    """Run with a bar, the kernels compiled ahead."""
    from flipflow.methods.warm import compile_ahead  # noqa: PLC0415  keeps --help quick

    with progress("starting") as tell:
        compile_ahead(lambda seconds: tell(f"compiling, once per version: {seconds:.0f} s", 0.0))
        return run(tell)
