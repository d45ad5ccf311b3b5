"""Long kernels that Ctrl-C ends at once: the interpreter hears of a signal only between kernels."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import TypeVar

from flipflow.compiled.arrays import Int
from flipflow.signals import undisturbed

R = TypeVar("R")
BRIEF = 4096  # turns or points times N^2 up to which a kernel is called as it is
PATIENCE = 0.5  # s for which a kernel that is to stop is waited for, so that its scratch is free


def interruptible(run: Callable[[], R], *stops: Int, work: int = BRIEF + 1) -> R:
    """What ``run`` returns, which calls a kernel that may take long.

    Signals are answered in the main thread. There the kernel runs beside it, and what the answer
    to a signal raises ends the waiting. Starting a thread takes some 50 us.

    Parameters
    ----------
    run
        The call.
    work
        Turns or points times N^2: what takes little is called as it is.
    stops
        Flags (1,) at which the kernel looks now and then; they are set when nobody waits any more.
        A kernel that does not end within half a second goes on alone, and its outcome is lost.
    """
    if work <= BRIEF or threading.current_thread() is not threading.main_thread():
        return run()
    outcome: list[R] = []
    # In place of an event, within which an interrupt leaves a lock that nobody opens.
    ended: SimpleQueue[BaseException | None] = SimpleQueue()

    def beside() -> None:
        try:
            outcome.append(run())
        except BaseException as error:  # noqa: BLE001  it is raised where it is waited for
            ended.put(error)
        else:
            ended.put(None)

    thread = threading.Thread(target=beside, name="flipflow kernel", daemon=True)
    try:
        with undisturbed():
            thread.start()
        failure = ended.get()
    except BaseException:
        if thread.ident is None:  # nothing has begun that could be stopped
            raise
        for stop in stops:
            stop[0] = 1
        with suppress(Empty):
            ended.get(timeout=PATIENCE)
            for stop in stops:
                stop[0] = 0
        raise
    if failure is not None:
        raise failure
    return outcome[0]
