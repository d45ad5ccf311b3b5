"""Progress on stderr while a long command runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")
Monitor = Callable[[str, float], None]


def with_progress(run: Callable[[Monitor], Result]) -> Result:
    """Run with a bar on stderr, where that is a terminal; kernels are compiled ahead."""
    from rich.console import Console  # noqa: PLC0415  keeps --help quick
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn  # noqa: PLC0415

    from flipflow.methods.warm import compile_ahead  # noqa: PLC0415

    terminal = Console(stderr=True)
    progress = Progress(
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(bar_width=20),
        console=terminal, transient=True, disable=not terminal.is_terminal,
    )  # fmt: skip
    with progress:
        task = progress.add_task("starting", total=1.0)
        compile_ahead(
            lambda seconds: progress.update(
                task, description=f"compiling, once per version: {seconds:.0f} s"
            )
        )
        return run(
            lambda sentence, share: progress.update(task, description=sentence, completed=share)
        )
