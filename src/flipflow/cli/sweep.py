"""``flipflow sweep``: what a machine settles to while its speed is changed in steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.destination import Destination
from flipflow.cli.options import (
    IN_FILE,
    Case,
    File,
    Force,
    Json,
    Output,
    in_case,
    marked,
    speeds_of,
    title_of,
    whole,
)
from flipflow.cli.output import printable
from flipflow.cli.progress import progress, stoppable
from flipflow.errors import InputError
from flipflow.model.constants import RPM
from flipflow.model.numerals import rpm

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.compiled.arrays import Real
    from flipflow.io.command_results import Sweeps
    from flipflow.model.project import Project
    from flipflow.plotting.figure import Figure
    from flipflow.studies.ramp import Ramp
    from flipflow.transient.sweep import Sweep

LONGEST_GLIDE = 600.0  # s
SEEN = {
    "periodic": "periodic, of more turns or settling later",
    "quasi-periodic": "quasi-periodic",
    "chaotic": "chaotic",
    "undecided": "undecided",
}


@dataclass(frozen=True)
class Passed:
    """Speeds rising, then falling, and glides: all of it, or what Ctrl-C left."""

    up: Sweep
    down: Sweep | None
    glides: tuple[Ramp, ...] = ()
    complete: bool = False
    no_glide: str = ""

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        """Those that were begun."""
        return (self.up,) if self.down is None else (self.up, self.down)

    def whole(self, glide: Ramp) -> bool:
        """Whether the speed of a glide came to where it should."""
        last = self.up.omega[-1 if glide.rate > 0.0 else 0]
        return math.isclose(glide.history.omega[-1], last, rel_tol=1e-6)


def sweep(
    file: File,
    speeds: Annotated[
        tuple[str, str],
        typer.Option("--speeds", metavar="LOW HIGH", help='From and to: "300 rpm" "40 Hz".'),
    ],
    steps: Annotated[int, whole("--steps", "N", 2, 20_000, "Speeds to settle at.")] = 100,
    rate: Annotated[
        str | None,
        typer.Option("--rate", metavar="RPM/S", help="Glide at this rate, too: how late it jumps."),
    ] = None,
    case: Case = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Raise the speed in steps, then lower it: amplitudes, jumps.

    At each speed the machine settles from where the one before ended.
    """
    from flipflow.io.project import load_project  # noqa: PLC0415  keeps --help quick

    ends = speeds_of(speeds)
    gliding = None if rate is None else _rate(rate, ends)
    project = in_case(load_project(file, force=force), case, remedy=IN_FILE)
    with Destination(output, json, [file]) as target:
        found = _passed(project, ends, steps, gliding)
        title = title_of(project, case)
        if json is not None:
            target.result(_sweeps(title, found))
        if output is not None:
            figure = _figure(project, found.sweeps, ends)
            target.picture("sweep.html", figure, marked(project, case))
        target.finish(lambda out: _show(title, found, steps, out))
        if not found.complete:
            raise target.stopped()


def _rate(written: str, ends: tuple[float, float]) -> float:
    """Rate in rad/s^2, such that a glide takes no longer than can be carried."""
    least = (ends[1] - ends[0]) * RPM / LONGEST_GLIDE
    try:
        rate = float(written)
    except ValueError:
        rate = math.nan
    if not least <= rate < math.inf:
        remedy = f"give a number of rpm per second, for these speeds at least {least:.2g}"
        raise InputError("--rate", written, remedy)
    return rate / RPM


def _passed(project: Project, ends: tuple[float, float], steps: int, rate: float | None) -> Passed:
    """Sweep up and down, then glide; Ctrl-C ends it and keeps what is finished."""
    up, down, stopped = _swept(project, ends, steps)
    if stopped:
        return Passed(up, down)
    try:
        glides = () if rate is None else _glides(project, ends, rate)
    except KeyboardInterrupt:
        return Passed(up, down)
    except InputError as error:
        return Passed(up, down, complete=True, no_glide=error.remedy)
    return Passed(up, down, glides, complete=True)


def _swept(
    project: Project, ends: tuple[float, float], steps: int
) -> tuple[Sweep, Sweep | None, bool]:
    """Speeds rising, then falling, and whether Ctrl-C has ended them."""
    import numpy as np  # noqa: PLC0415  keeps --help quick

    from flipflow.transient.sweep import sweep as settle  # noqa: PLC0415

    omega = np.linspace(*ends, steps)
    with (
        progress("sweeping; the first run of a version compiles") as tell,
        stoppable(tell, "settled") as told,
    ):
        up = settle(project.screen, omega, monitor=lambda s, share: told(s, 0.5 * share))
        if not up.complete:
            return up, None, True
        down = settle(
            project.screen, omega[::-1], initial=up.rows[-1].state,
            monitor=lambda s, share: told(s, 0.5 + 0.5 * share),
        )  # fmt: skip
        return up, down, told.asked


def _glides(project: Project, ends: tuple[float, float], rate: float) -> tuple[Ramp, Ramp]:
    from flipflow.studies.ramp import ramp  # noqa: PLC0415  keeps --help quick

    with progress("gliding; the first run of a version compiles") as tell:
        up = ramp(project.screen, ends, rate, monitor=lambda s, share: tell(s, 0.5 * share))
        back = ends[::-1]
        down = ramp(project.screen, back, rate, monitor=lambda s, share: tell(s, 0.5 + 0.5 * share))
    return up, down


def _sweeps(title: str, found: Passed) -> Sweeps:
    from flipflow.io.command_results import Glide, Sweeps  # noqa: PLC0415  quick --help

    late = tuple(jump for glide in found.glides for jump in glide.jumps)
    glides = tuple(
        Glide(glide.rate, float(glide.history.omega[-1]), found.whole(glide))
        for glide in found.glides
    )
    return Sweeps(title, found.up, found.down, late, glides, found.complete)


def _show_glide(glide: Ramp, out: Console, *, whole: bool) -> None:
    from flipflow.report.terminal import say  # noqa: PLC0415  keeps --help quick

    word = "rising" if glide.rate > 0.0 else "falling"
    out.print(f"Speed {word} by {rpm(abs(glide.rate))} rpm/s:")
    for jump in glide.jumps:
        say(
            out,
            f"  jumps at {jump.omega * RPM:.5g} rpm, {jump.late * RPM:.3g} rpm beyond the speed "
            f"at which the motion ends or is stable no more ({jump.fold * RPM:.5g} rpm)",
        )
    if not glide.jumps:
        out.print("  no jump")
    if not whole:
        say(
            out,
            f"  ended at {rpm(glide.history.omega[-1])} rpm, for want of steps: give a "
            "greater --rate, or --speeds closer together",
        )


def _figure(project: Project, swept: tuple[Sweep, ...], ends: tuple[float, float]) -> Figure:
    from flipflow.continuation.frequency_response import frequency_response  # noqa: PLC0415
    from flipflow.plotting.sweep import sweep_figure  # noqa: PLC0415

    return sweep_figure(swept, frequency_response(project.screen, ends))


def _show(title: str, found: Passed, steps: int, out: Console) -> None:
    from flipflow.report.terminal import say  # noqa: PLC0415  keeps --help quick

    low, high = (rpm(end) for end in (min(found.up.omega), max(found.up.omega)))
    count = f"{found.up.omega.size}" + ("" if found.up.complete else f" of {steps}")
    say(out, f"{printable(title)}: {count} speeds from {low} to {high} rpm", "bold")
    for word, swept in zip(("rising", "falling"), found.sweeps, strict=False):
        _show_sweep(word, swept, steps, out)
    for glide in found.glides:
        _show_glide(glide, out, whole=found.whole(glide))
    if found.no_glide:
        say(out, f"Note: no glide: {found.no_glide}.", "yellow")


def _greatest(swept: Sweep, amplitude: Real) -> str:
    import numpy as np  # noqa: PLC0415  keeps --help quick

    known = np.flatnonzero(np.isfinite(amplitude))
    if not known.size:
        return "no turn could be carried to its end"
    top = known[amplitude[known].argmax()]
    speed = rpm(swept.omega[top])
    return f"greatest relative amplitude {amplitude[top]:.4g} mm at {speed} rpm"


def _show_sweep(word: str, swept: Sweep, steps: int, out: Console) -> None:
    from flipflow.report.terminal import say  # noqa: PLC0415  keeps --help quick

    amplitude = swept.amplitude("relative") * 1e3
    say(out, f"Speed {word}: {_greatest(swept, amplitude)}")
    for jump in swept.jumps:
        before, after = amplitude[jump.index - 1], amplitude[jump.index]
        say(
            out,
            f"  jumps between {jump.omega_before * RPM:.5g} and "
            f"{jump.omega_after * RPM:.5g} rpm, from {before:.4g} to {after:.4g} mm",
        )
    if not swept.jumps:
        out.print("  no jump")
    if not swept.complete:
        out.print(f"  stopped after {swept.omega.size} of {steps} speeds")
    lingering = int((~swept.settled).sum())
    if lingering:
        out.print(
            f"  {lingering} speeds without a periodic motion of up to {swept.max_periods} turns"
        )
        words = [word for word, row in zip(swept.words, swept.settled, strict=True) if not row]
        for seen in sorted(set(words)):
            out.print(f"    {words.count(seen)} {SEEN[seen]}")
    several = sorted({int(n) for n in swept.periods if n > 1})
    if several:
        out.print(f"  motions that repeat after {', '.join(map(str, several))} turns")
