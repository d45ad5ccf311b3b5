"""One comparison for all acceptance tests: a failure prints both values.

The page of validation is made of what is compared here: where the environment names a file in
``FLIPFLOW_RECORD``, every comparison is a line of it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from flipflow.continuation.branch import Branch
from flipflow.periodic.orbit import Orbit

GAP = np.array([1.0, -1.0])


def close(
    what: str,
    got: ArrayLike,
    expected: ArrayLike,
    *,
    rel: float = 0.0,
    abs: float = 0.0,  # noqa: A002
) -> None:
    """Fail, printing both, where |got - expected| > abs + rel |expected|."""
    got, expected = np.asarray(got), np.asarray(expected)
    assert got.shape == expected.shape, f"{what}: shapes {got.shape} and {expected.shape}"
    off = np.abs(got - expected)
    if "FLIPFLOW_RECORD" in os.environ:
        _record(what, got, expected, off, abs + rel * np.abs(expected))
    worst = off.max(initial=0.0)
    good = bool(np.all(off <= abs + rel * np.abs(expected)))
    assert good, (
        f"{what}: got {got}, expected {expected}, off by {worst:.3g} (abs {abs}, rel {rel})"
    )


def _record(
    what: str, got: np.ndarray, expected: np.ndarray, off: np.ndarray, allowed: np.ndarray
) -> None:
    """The comparison, of many numbers the one that is nearest to what is allowed."""
    if not got.size:
        return
    near = np.argmax(off - allowed)
    one = {
        "test": os.environ["PYTEST_CURRENT_TEST"].rpartition(" ")[0],
        "what": what,
        "count": got.size,
        "got": str(got.flat[near]),
        "expected": str(expected.flat[near]),
        "off": float(off.flat[near]),
        "allowed": float(np.broadcast_to(allowed, off.shape).flat[near]),
    }
    with Path(os.environ["FLIPFLOW_RECORD"]).open("a", encoding="utf-8") as file:
        file.write(json.dumps(one) + "\n")


def kinds(branch: Branch) -> list[str]:
    """Kinds of the special points in branch order."""
    return [point.kind for point in branch.special_points]


def upper_orbit(branch: Branch, omega: float) -> Orbit:
    """The motion at omega that the branch reaches first, coming from low speed."""
    found = branch.orbits_at(omega)
    assert found, f"no motion on the branch at {omega} rad/s"
    return found[0]


def relative_amplitude(branch: Branch, omega: float) -> float:
    """Relative amplitude in m of that motion."""
    return upper_orbit(branch, omega).amplitude("relative")


def minmax(orbit: Orbit, which: str = "relative") -> tuple[float, float]:
    """Smallest and largest displacement, refined by a parabola through the samples."""
    y = orbit.displacement(which)[:-1]
    return -_top(-y), _top(y)


def _top(y: np.ndarray) -> float:
    k = int(y.argmax())
    a, b, c = y[k - 1], y[k], y[(k + 1) % y.size]
    return float(b - (c - a) ** 2 / (8.0 * (a - 2.0 * b + c)))
