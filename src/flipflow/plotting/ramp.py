"""A gliding speed: amplitudes from swing to swing, laid over the branch of periodic motions."""

from __future__ import annotations

from flipflow.model.system import Coordinate
from flipflow.plotting.curves import Curve
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import coordinates, curve_traces, label, speed_axis
from flipflow.plotting.scales import MM, RPM
from flipflow.studies.ramp import Ramp


def ramp_figure(ramp: Ramp, which: Coordinate | None = None) -> Figure:
    """Amplitude of every swing over the speed at that moment.

    Parameters
    ----------
    ramp
        What :func:`flipflow.ramp` returns.
    which
        The coordinate; None: the relative motion of a screen, or the last one there is.
    """
    chosen = coordinates(ramp.branch.system, which)[-1]
    omega, size = ramp.amplitude(chosen)
    traces = [Trace("gliding speed", omega * RPM, size * MM, colour="main", bold=True)]
    if ramp.branch.omega.size:
        curve = Curve.of(ramp.branch, chosen)
        traces += curve_traces(
            "periodic motions", curve, curve.amplitude * MM, colour="relative", symbol=None,
            bold=False,
        )  # fmt: skip
    top = 1.08 * max(float(trace.y.max()) for trace in traces)
    lines = tuple(Line("x", jump.omega * RPM, "jumps", "jump", "dash") for jump in ramp.jumps)
    panel = Panel(
        speed_axis(ramp.history.omega), Axis(f"{label(chosen)} amplitude", "mm", (0.0, top)),
        tuple(traces), lines=lines,
    )  # fmt: skip
    caption = (
        f"Half the way from one turning point to the next while the speed glides at "
        f"{ramp.rate:.3g} rad/s^2. Dashed: motions that do not return after a disturbance."
    )
    return Figure("Motion at gliding speed", caption, (panel,), height=380)
