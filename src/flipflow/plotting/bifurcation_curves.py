"""Curves of special points in the plane of two parameters."""

from __future__ import annotations

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.errors import InputError
from flipflow.plotting.branches import field_axis
from flipflow.plotting.curves import stable_beside
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour
from flipflow.plotting.panels import Axis, Panel, Trace
from flipflow.plotting.response import KIND_SYMBOLS, KIND_WORDS, UNSTABLE_FOLD
from flipflow.plotting.scales import RPM

DASHES = {"grazing": "dot", "period doubling": "dash", "symmetry breaking": "dash",
          "Neimark-Sacker": "dashdot"}  # fmt: skip
OMEGA = "omega"
WORDS = {"fold": "jump speed (fold)", "grazing": "contact begins (grazing)"}


def curves_figure(*curves: BifurcationCurve) -> Figure:
    """Curves of special points, and what stands on them, over two parameters of one machine.

    Raises
    ------
    InputError
        For a curve without points, and for curves over other parameters than the first's.
    """
    names = curves[0].parameters
    for curve in curves:
        if curve.parameters != names:
            over = " and ".join(names)
            raise InputError("result", curve.parameters, f"give curves over {over} alone")
        if not curve.orbits:
            raise InputError("result", "a curve without points", curve.status.value)
    every = np.concatenate([curve.values for curve in curves])
    (x_axis, x_scale), (y_axis, y_scale) = (
        _axis(name, every[:, k]) for k, name in enumerate(names)
    )
    traces, named = [], set[str]()
    for k, curve in enumerate(curves):
        name = _name_of(curve)
        traces.append(
            Trace(
                name, curve.values[:, 0] * x_scale, curve.values[:, 1] * y_scale, "stable",
                case_colour(k), bold=curve.kind == "fold", legend=name not in named,
                dash=DASHES.get(curve.kind, ""),
            )
        )  # fmt: skip
        named.add(name)
    points = [point for curve in curves for point in curve.special_points]
    for kind in dict.fromkeys(point.kind for point in points):
        at = np.array([point.values for point in points if point.kind == kind])
        traces.append(
            Trace(KIND_WORDS.get(kind, kind), at[:, 0] * x_scale, at[:, 1] * y_scale, "point",
                  "jump", symbol=KIND_SYMBOLS.get(kind, "square-open"))
        )  # fmt: skip
    caption = (
        "Each line is where the motion changes its character in the plane of both parameters; "
        "marks are where two such changes meet, or where a line turns back."
    )
    title = f"{' against '.join(name.replace('_', ' ') for name in names)}"
    return Figure(title, caption, (Panel(x_axis, y_axis, traces=tuple(traces)),), height=430)


def _name_of(curve: BifurcationCurve) -> str:
    """What the legend calls a curve; folds between unstable motions alone are no jumps."""
    if curve.kind == "fold" and all(stable_beside(orbit) is False for orbit in curve.orbits):
        return UNSTABLE_FOLD
    return WORDS.get(curve.kind, curve.kind)


def _axis(name: str, values: Real) -> tuple[Axis, float]:
    """Axis of a parameter over all of its values, and the factor from SI to its unit."""
    if name == OMEGA:
        return Axis("shaft speed", "rpm"), RPM
    return field_axis(name, values)
