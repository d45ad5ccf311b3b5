"""Amplitudes over changing speed, settled or gliding, laid over the branch of periodic motions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flipflow.continuation.branch import Branch
from flipflow.errors import InputError
from flipflow.model.system import Coordinate
from flipflow.plotting.figure import Figure
from flipflow.plotting.palette import case_colour
from flipflow.plotting.panels import Axis, Line, Panel, Trace
from flipflow.plotting.response import coordinates, label, speed_axis, underlay
from flipflow.plotting.scales import HZ, MM, RPM
from flipflow.studies.ramp import Ramp
from flipflow.transient.sweep import Sweep

BESIDE = 0.02  # share of the speeds shown beside the first and the last symbol
SYMBOLS = ("circle-open", "square-open", "cross", "diamond", "triangle")
NOT_SETTLED = {
    "periodic": "not settled, periodic",
    "quasi-periodic": "quasi-periodic",
    "chaotic": "chaotic",
    "undecided": "not settled",
}


def sweep_figure(
    sweeps: Sequence[Sweep], branch: Branch | None = None, which: Coordinate | None = None
) -> Figure:
    """Settled amplitudes over rpm, one set of symbols a sweep.

    Parameters
    ----------
    sweeps
        One or more, such as up and down.
    branch
        Periodic motions to lay them over.
    which
        The coordinate; the relative motion of a screen, or the first degree of freedom.

    Returns
    -------
    Figure
        One panel.
    """
    if not sweeps:
        raise InputError("sweeps", "none", "give at least one")
    chosen = coordinates(sweeps[0].system, which)[-1]
    traces: list[Trace] = []
    if branch is not None and branch.omega.size > 0:
        traces += underlay(branch, chosen)
    for k, sweep in enumerate(sweeps):
        traces += _swept(sweep, chosen, k + 1)
    drawn = np.concatenate([trace.y for trace in traces])
    top = drawn.max(initial=0.0, where=np.isfinite(drawn)) or 1.0
    omega = np.concatenate([sweep.omega for sweep in sweeps])
    beyond = BESIDE * (np.ptp(omega) or omega.max())
    ends = max(float(omega.min() - beyond), 0.0) * RPM, float(omega.max() + beyond) * RPM
    panel = Panel(
        speed_axis(omega, ends), Axis(f"{label(chosen)} amplitude", "mm", (0.0, 1.08 * float(top))),
        traces=tuple(traces),
    )  # fmt: skip
    caption = "Symbols: what the machine settles to, each speed reached from the one before."
    if branch is not None and branch.omega.size == 0:
        caption += f" No branch of periodic motions lies beneath. {branch.status.value}"
    elif branch is not None:
        caption += (
            " Solid: motions that return after a small disturbance; dashed: those that do not."
        )
    return Figure("Settled motion over speed", caption, (panel,), height=380)


def _swept(sweep: Sweep, which: Coordinate, k: int) -> Iterator[Trace]:
    """One cloud of points for each period met, and for each word of what has not settled."""
    way = "rising" if sweep.omega[-1] >= sweep.omega[0] else "falling"
    periods = sweep.periods
    amplitude = sweep.amplitude(which) * MM
    words = [
        NOT_SETTLED[word] if count == 0 else "" if count == 1 else f"{count} periods"
        for count, word in zip(periods.tolist(), sweep.words, strict=True)
    ]
    for count, word in sorted(set(zip(periods.tolist(), words, strict=True))):
        rows = np.array([one == word for one in words])
        omega = sweep.omega[rows]
        yield Trace(
            f"speed {way}" + (f", {word}" if word else ""), omega * RPM, amplitude[rows], "point",
            case_colour(k), symbol=SYMBOLS[(2 * (k - 1) + max(count - 1, 0)) % len(SYMBOLS)],
            x_also=(("Hz", omega * HZ), ("rad/s", omega)),
        )  # fmt: skip


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
    top = 1.08 * max((float(trace.y.max()) for trace in traces if trace.y.size), default=1.0)
    lines = tuple(Line("x", jump.omega * RPM, "jumps", "jump", "dash") for jump in ramp.jumps)
    panel = Panel(
        speed_axis(ramp.history.omega), Axis(f"{label(chosen)} amplitude", "mm", (0.0, top)),
        tuple(traces), lines=lines,
    )  # fmt: skip
    caption = (
        f"Half the way from peak to peak in one turn while the speed glides at "
        f"{ramp.rate:.3g} rad/s^2. Dashed: motions that do not return after a disturbance."
    )
    return Figure("Motion at gliding speed", caption, (panel,), height=380)
