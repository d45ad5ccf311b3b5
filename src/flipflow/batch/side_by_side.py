"""Parts of a long work on threads, which end when nobody waits for them any more."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed

import numpy as np

from flipflow.compiled.arrays import Int

Work = Callable[[slice, Int], None]


def side_by_side(
    work: Work, count: int, size: int, threads: int, tell: Callable[[float], None] | None = None
) -> None:
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
    pool = ThreadPoolExecutor(threads)
    done = 0
    try:
        waiting = {
            pool.submit(work, part, stop): part.stop - part.start
            for part in (slice(k, min(k + size, count)) for k in range(0, count, size))
        }
        for future in as_completed(waiting):
            future.result()
            done += waiting[future]
            if tell is not None:
                tell(done / count)
    finally:
        stop[0] = 1
        pool.shutdown(cancel_futures=True)


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
