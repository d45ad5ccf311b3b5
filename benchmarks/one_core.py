"""Benchmarks run on one core: threads are limited before the libraries start."""

import os
import sys

LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")


def stay_on_one_core():
    """Start this program again with one thread a library, unless it was started so."""
    limits = {f"{library}_NUM_THREADS": "1" for library in LIBRARIES}
    if any(os.environ.get(name) != count for name, count in limits.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | limits)  # noqa: S606
