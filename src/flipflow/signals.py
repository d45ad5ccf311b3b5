"""Ctrl-C and SIGTERM that come where they must not be answered."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Answer signals after the block, which is short.

    What an answer raises in the middle of code that is not made for it leaves a lock that nobody
    opens (``concurrent.futures``), a coroutine that nobody awaits (zarr), or half of the files.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []

    def answer_late() -> None:
        for number in dict.fromkeys(came):
            signal.raise_signal(number)

    # Whatever an answer raises, all of them return; that to SIGTERM may be that to SIGINT, which is
    # therefore the last.
    with ExitStack() as after:
        after.callback(answer_late)
        for one in SIGNALS:
            answer = signal.getsignal(one)
            if answer is not None:  # what no Python code has set cannot be set again
                after.callback(signal.signal, one, answer)
                signal.signal(one, lambda number, _frame: came.append(number))
        yield
