"""Parts of a long work on threads, which end when nobody waits for them any more."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from flipflow.batch.run_chunks import executor_or_threads, run_chunks
from flipflow.compiled.arrays import Int

Work = Callable[[slice, Int], None]
Tell = Callable[[float], None]  # called with the share of a work that is done


def within(tell: Tell, low: float, high: float) -> Tell:
    """What tells the share of a part of some work, from ``low`` to ``high`` of the whole."""
    return lambda share: tell(low + (high - low) * share)


def side_by_side(work: Work, count: int, size: int, threads: int, tell: Tell | None = None) -> None:
    """Do a work of ``count`` rows, ``size`` at a time, on some threads.

    Kernels leave the interpreter free: the thread that calls this one hears of Ctrl-C meanwhile.

    Parameters
    ----------
    work
        Called with the rows to do, and a flag (1,) that is set when nobody waits any more: a kernel
        or a loop that looks at it gives up.
    tell
        Called with the share of rows done; what it raises ends the work.
    """
    stop = np.zeros(1, np.int64)
    parts = [slice(k, min(k + size, count)) for k in range(0, count, size)]
    done = 0
    with executor_or_threads(None, threads) as pool:
        try:
            for k, _ in run_chunks(pool, work, ((k, (part, stop)) for k, part in enumerate(parts))):
                done += parts[k].stop - parts[k].start
                if tell is not None:
                    tell(done / count)
        finally:
            stop[0] = 1


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
