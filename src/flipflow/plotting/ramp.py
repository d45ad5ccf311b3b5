"""A gliding speed: amplitudes from swing to swing, laid over the branch of periodic motions."""

from __future__ import annotations

from flipflow.model.system import Coordinate
from flipflow.plotting.figure import Figure
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import coordinates, label, speed_axis, underlay
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
        traces += underlay(ramp.branch, chosen)
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
