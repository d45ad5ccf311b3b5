"""``flipflow sweep``: what a machine settles to while its speed is changed in steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.options import RPM, File, Force, Json, Output, speeds_of
from flipflow.cli.progress import progress

if TYPE_CHECKING:
    import numpy as np
    from rich.console import Console

    from flipflow.analyses.ramp import Ramp
    from flipflow.figures.parts import Figure
    from flipflow.model.project import Project
    from flipflow.results.sweep import Sweep

MOST_STEPS = 20_000


def sweep(
    file: File,
    speeds: Annotated[
        tuple[str, str],
        typer.Option("--speeds", metavar="LOW HIGH", help='From and to: "300 rpm" "40 Hz".'),
    ],
    steps: Annotated[int, typer.Option("--steps", metavar="N", help="Speeds to settle at.")] = 100,
    rate: Annotated[
        float | None,
        typer.Option("--rate", metavar="RPM/S", help="Glide at this rate, too: how late it jumps."),
    ] = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Raise the speed step by step, then lower it again: settled amplitudes and jumps."""
    from flipflow.cli.output import console, write_json  # noqa: PLC0415  keeps --help quick
    from flipflow.io.files import prepare_folder  # noqa: PLC0415
    from flipflow.io.project import load_project  # noqa: PLC0415

    project = load_project(file, force=force)
    omega = _grid(speeds, steps)
    if output is not None:
        prepare_folder(output)
    up, down = _swept(project, omega)
    glides = () if rate is None else _glides(project, omega, rate)
    if json is not None:
        from flipflow.io.results import document_of  # noqa: PLC0415  loads every analysis

        both = {"up": document_of(up), "down": document_of(down)}
        late = [vars(jump) for glide in glides for jump in glide.jumps]
        document = {"schema": "flipflow/sweeps/1", "name": project.name, **both, "late": late}
        write_json(document, json)
    if output is not None:
        _figure(project, up, down).write(output / "sweep.html")
    if json != "-":
        out = console()
        _show(project, up, down, out)
        for glide in glides:
            _show_glide(glide, out)


def _grid(speeds: tuple[str, str], steps: int) -> np.ndarray:
    import numpy as np  # noqa: PLC0415  keeps --help quick

    from flipflow.errors import InputError  # noqa: PLC0415

    if not 2 <= steps <= MOST_STEPS:
        raise InputError("--steps", steps, f"give a whole number from 2 to {MOST_STEPS}")
    return np.linspace(*speeds_of(speeds), steps)


def _swept(project: Project, omega: np.ndarray) -> tuple[Sweep, Sweep]:
    from flipflow.analyses.sweep import sweep as settle  # noqa: PLC0415  keeps --help quick

    with progress("sweeping; the first run of a version compiles") as tell:
        up = settle(project.screen, omega, monitor=lambda s, share: tell(s, 0.5 * share))
        down = settle(
            project.screen, omega[::-1], initial=up.rows[-1].state,
            monitor=lambda s, share: tell(s, 0.5 + 0.5 * share),
        )  # fmt: skip
    return up, down


def _glides(project: Project, omega: np.ndarray, rate: float) -> tuple[Ramp, Ramp]:
    from flipflow.analyses.ramp import ramp  # noqa: PLC0415  keeps --help quick

    ends = float(omega[0]), float(omega[-1])
    with progress("gliding; the first run of a version compiles") as tell:
        up = ramp(project.screen, ends, rate / RPM, lambda s, share: tell(s, 0.5 * share))
        down = ramp(
            project.screen, ends[::-1], rate / RPM, lambda s, share: tell(s, 0.5 + 0.5 * share)
        )
    return up, down


def _show_glide(glide: Ramp, out: Console) -> None:
    word = "rising" if glide.rate > 0.0 else "falling"
    out.print(f"Speed {word} by {abs(glide.rate) * RPM:.4g} rpm/s:")
    for jump in glide.jumps:
        out.print(
            f"  jumps at {jump.omega * RPM:.5g} rpm, {jump.late * RPM:.3g} rpm beyond the speed "
            f"at which the motion ends ({jump.fold * RPM:.5g} rpm)"
        )
    if not glide.jumps:
        out.print("  no jump")


def _figure(project: Project, up: Sweep, down: Sweep) -> Figure:
    from flipflow.analyses.frequency_response import frequency_response  # noqa: PLC0415
    from flipflow.figures.sweep import sweep_figure  # noqa: PLC0415

    ends = float(up.omega[0]), float(up.omega[-1])
    return sweep_figure((up, down), frequency_response(project.screen, ends))


def _show(project: Project, up: Sweep, down: Sweep, out: Console) -> None:
    low, high = up.omega[0] * RPM, up.omega[-1] * RPM
    name = project.document.name or project.name
    out.print(f"{name}: {up.omega.size} speeds from {low:.4g} to {high:.4g} rpm", style="bold")
    for word, swept in (("rising", up), ("falling", down)):
        amplitude = swept.amplitude("relative") * 1e3
        top = int(amplitude.argmax())
        out.print(
            f"Speed {word}: greatest relative amplitude {amplitude[top]:.4g} mm at "
            f"{swept.omega[top] * RPM:.4g} rpm"
        )
        for jump in swept.jumps:
            before, after = amplitude[jump.index - 1], amplitude[jump.index]
            out.print(
                f"  jumps between {jump.omega_before * RPM:.5g} and "
                f"{jump.omega_after * RPM:.5g} rpm, from {before:.4g} to {after:.4g} mm"
            )
        if not swept.jumps:
            out.print("  no jump")
        lingering = int((~swept.settled).sum())
        if lingering:
            out.print(f"  {lingering} speeds without a periodic motion of up to 6 turns")
        several = sorted({int(n) for n in swept.periods if n > 1})
        if several:
            out.print(f"  motions that repeat after {', '.join(map(str, several))} turns")
