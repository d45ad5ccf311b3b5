"""The predictor-corrector on curves known in closed form, and the Jacobians of its equations."""

from __future__ import annotations

import numpy as np
import pytest

from flipflow.compiled import status
from flipflow.continuation.field_loop import Equations, follow, follow_both_ways
from flipflow.continuation.field_path import FieldEquations, FoldEquations
from judge import close

pytestmark = pytest.mark.numerical


class Curve(Equations):
    """f(x, p) = 0 with its gradient; the steps are a tenth long."""

    def __init__(self, f, gradient, lower: float, upper: float) -> None:
        self.f, self.gradient, self.lower, self.upper = f, gradient, lower, upper

    def residual(self, w):  # noqa: D102
        return np.array([self.f(*w)]), np.array([self.gradient(*w)])

    def scale(self, w):  # noqa: ARG002, D102
        return np.full(2, 0.1)

    def signature(self):  # noqa: D102
        return 0

    def apart(self, w):  # noqa: ARG002, D102
        return np.inf


def circle(lower: float, upper: float) -> Curve:
    return Curve(lambda x, p: x * x + p * p - 1.0, lambda x, p: (2.0 * x, 2.0 * p), lower, upper)


def test_a_circle_is_closed_and_turns_twice() -> None:
    path = follow_both_ways(circle(-2.0, 2.0), np.array([1.0, 0.0]))
    points = np.array([point.w for point in path.points])
    assert path.code == status.CLOSED
    close("radius", np.hypot(*points.T), np.ones(len(points)), abs=1e-9)
    shares = np.array([point.tangent[-1] for point in path.points])
    assert np.count_nonzero(shares[1:] * shares[:-1] < 0.0) == 2


def test_an_arc_ends_exactly_on_its_bounds_both_ways() -> None:
    path = follow_both_ways(circle(-0.5, 0.7), np.array([1.0, 0.1]))
    assert path.code == status.FOLLOWED
    assert (path.points[0].w[-1], path.points[-1].w[-1]) == (-0.5, 0.7)
    middle = path.between(1, 0.3)
    assert middle is not None
    close("between two points", np.hypot(*middle.w), 1.0, abs=1e-14)


def test_a_path_stops_where_two_curves_cross() -> None:
    """x (p - x^2) = 0: the parabola meets the axis x = 0 at p = 0, where det [J; tangent] flips."""
    curve = Curve(lambda x, p: x * (p - x * x), lambda x, p: (p - 3.0 * x * x, x), -1.0, 1.0)
    curve.apart = lambda w: abs(2.0 * w[0])
    path = follow(curve, np.array([0.9, 0.81]), -1.0)
    assert path.crossed_end
    assert 0.0 < path.points[-1].w[0] < 0.05


@pytest.mark.parametrize("kind", [FieldEquations, FoldEquations])
def test_jacobians_by_differences_of_the_residual(screen, exact, kind) -> None:
    """At points off the solution; 1e-5 of each row's size."""
    orbit = exact.orbits_at(203.0)[0]
    equations = kind(
        lambda e: screen.replace(clearance=e).system(), (2e-3, 9e-3), 6e-3, 203.0,
        half_turn=True, turns=1,
    )  # fmt: skip
    extra = [203.0, 6e-3] if kind is FoldEquations else [6e-3]
    w = np.concatenate([1.01 * orbit.state, extra])
    _, J = equations.residual(w)
    columns = []
    for k, step in enumerate(1e-5 * np.abs(w)):
        move = np.eye(w.size)[k] * step
        columns.append(
            (equations.residual(w + move)[0] - equations.residual(w - move)[0]) / (2.0 * step)
        )
    expected = np.array(columns).T
    weight = np.abs(w) / np.abs(expected * np.abs(w)).max(axis=1, keepdims=True)
    close("Jacobian", J * weight, expected * weight, abs=1e-5)
