"""The kernels that take longest to compile, a part for each of two processes.

Two processes of pytest that come to need one at about the same time would each compile it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

from numba import config

import flipflow as ff
from flipflow.compiled.workers import compile_parts, work
from flipflow.studies import compile_ahead as package


def compile_ahead() -> None:
    """Compile them, unless they are in the cache already, or nothing is compiled."""
    if not config.DISABLE_JIT:
        compile_parts("kernels_ahead", PARTS, lambda _: None)


def _sampled() -> None:
    with warnings.catch_warnings(action="ignore"):
        _followed(ff.SampledHarmonicBalance(1, samples=16))


def _balance() -> None:
    _followed(ff.HarmonicBalance(1))


def _field() -> None:
    machine = _machine()
    orbit = ff.frequency_response(machine, (0.5, 0.51)).orbit(0)
    ff.continue_orbit(orbit, "springs[0].stiffness", (0.9, 1.1))


def _followed(method: ff.HarmonicBalance | ff.SampledHarmonicBalance) -> None:
    ff.frequency_response(_machine(), (0.5, 0.51), method)


def _machine() -> ff.MechanicalSystem:
    """One mass and one stop that it does not reach."""
    stop = ff.ClearanceSpring([1.0], 1.0, 0.1, 10.0)
    return ff.MechanicalSystem([[1.0]], [[0.1]], [[1.0]], [stop], ff.Unbalance([1.0]))


# Fields begin on an exact branch, whose kernel the first part has then compiled.
PARTS: dict[str, tuple[Callable[[], None], ...]] = {
    "exact and fields": (*package.PARTS["branches"], _field),
    "runs and series": (*package.PARTS["runs"], _sampled, _balance),
}

if __name__ == "__main__":
    work(PARTS)
