"""``flipflow startup``: does the drive carry the machine through its resonance, and how hard."""

from __future__ import annotations

from dataclasses import replace
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
    Speed,
    in_case,
    marked,
    speed_of,
    title_of,
)
from flipflow.cli.output import DOES_NOT_START, print_list, printable
from flipflow.cli.progress import progress
from flipflow.errors import InputError
from flipflow.model.constants import RPM
from flipflow.model.numerals import digits

if TYPE_CHECKING:
    from rich.console import Console

    from flipflow.model.drive import Drive, SpeedProfile
    from flipflow.model.monitor import Monitor
    from flipflow.model.project import Project
    from flipflow.transient.run_up import RunUp

POWER = ("motor", "friction", "dampers")
LONGEST = 3600.0  # s
WORDS = {
    "main_amplitude": ("main frame, amplitude", 1e3, "mm"),
    "relative_amplitude": ("relative, amplitude", 1e3, "mm"),
    "shear_strain": ("shear strain", 1e2, "%"),
    "foundation_force": ("force on the foundation", 1e-3, "kN"),
    "stop_force": ("force on the stops of a side", 1e-3, "kN"),
}


def startup(
    file: File,
    speed: Speed = None,
    motor_power: Annotated[
        str | None,
        typer.Option("--motor-power", metavar="POWER", help="Rated power: '5.5 kW'."),
    ] = None,
    inertia: Annotated[
        str | None,
        typer.Option("--inertia", metavar="J", help="Inertia at the shaft: '0.9 kg m^2'."),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            "--profile", metavar="POINTS", help="Speed over time: '0 s: 0 rpm, 20 s: 850 rpm'."
        ),
    ] = None,
    duration: Annotated[
        str | None,
        typer.Option("--duration", metavar="TIME", help="Longest time, for each run: '120 s'."),
    ] = None,
    case: Case = None,
    output: Output = None,
    json: Json = None,
    force: Force = False,
) -> None:
    """Start a machine, let it coast down: reached or captured.

    Shows the greatest amplitudes and forces on the way, and the speeds at which they occur. The
    start is the worst one from hanging and from every angle at which friction holds the shaft. Ends
    with code 5 where it fails on a drive of which nothing is assumed.
    """
    from flipflow.io.project import load_project  # noqa: PLC0415  keeps --help quick

    project = load_project(file, force=force)
    if profile is not None:
        given = {"--speed": speed, "--motor-power": motor_power, "--inertia": inertia}
        _refuse_beside_profile(given | {"--duration": duration})
    else:
        project = replace(project, speed=speed_of(project, speed))
    drive = _drive(project, motor_power, inertia, profile)
    seconds = None if duration is None else _seconds(duration)
    project = in_case(project, case, remedy=IN_FILE)
    with Destination(output, json, [file]) as target:
        start, coast = _calculated(project, drive, seconds)
        title = title_of(project, case)
        runs = {"start": start} | ({} if coast is None else {"coast_down": coast})
        if output is not None:
            _figures(runs, target, marked(project, case))
        if json is not None:
            from flipflow.io.command_results import Startup  # noqa: PLC0415

            target.result(Startup(title, start, coast))
        target.finish(lambda out: _show(title, start, coast, out))
    if _fails_as_given(start):
        raise typer.Exit(DOES_NOT_START)


def _fails_as_given(start: RunUp) -> bool:
    """Whether a start fails that rests on no assumed value."""
    from flipflow.model.drive import Drive  # noqa: PLC0415  keeps --help quick
    from flipflow.studies.start_and_blows import FAILED  # noqa: PLC0415

    drive = start.drive
    return isinstance(drive, Drive) and not drive.assumed_fields and start.outcome in FAILED


def _refuse_beside_profile(given: dict[str, str | None]) -> None:
    for option, written in given.items():
        if written is not None:
            remedy = "--profile lays the speed down, leave one of them out"
            raise InputError(option, written, remedy)


def _seconds(written: str) -> float:
    from flipflow.io.units import parse_quantity  # noqa: PLC0415  keeps --help quick

    seconds = parse_quantity(written, "s", field="--duration", example="120 s")
    if not 0.0 < seconds <= LONGEST:
        raise InputError("--duration", written, f"give a time above 0 s and up to {LONGEST:.0f} s")
    return seconds


def _drive(
    project: Project, power: str | None, inertia: str | None, profile: str | None
) -> Drive | SpeedProfile | None:
    """The drive the options ask for: a profile, the file's with changes, or one to be assumed."""
    from flipflow.io.drive import parse_profile  # noqa: PLC0415  keeps --help quick
    from flipflow.io.values import read_number  # noqa: PLC0415
    from flipflow.model.drive import DRIVE_FIELDS, assumed_drive  # noqa: PLC0415

    if profile is not None:
        laid_down = parse_profile(profile, "--profile")
        if laid_down.duration > LONGEST:
            raise InputError("--profile", profile, f"let it last at most {LONGEST:.0f} s")
        return laid_down
    fields = {field.name: field for field in DRIVE_FIELDS}
    given = {
        name: read_number(text, fields[name], label=option)
        for name, text, option in (
            ("rated_power", power, "--motor-power"), ("inertia", inertia, "--inertia"),
        )
        if text is not None
    }  # fmt: skip
    drive = project.drive
    if drive is None or drive.motor is None:
        if not given:
            return None
        if "rated_power" not in given:
            raise InputError("--inertia", inertia, "give --motor-power with it")
        moment = project.screen.eccentric_moment
        working = speed_of(project, None)
        return assumed_drive(moment, working, given.pop("rated_power"), given)
    if "rated_power" in given:
        motor = replace(drive.motor, rated_power=given["rated_power"], breakdown_torque=None)
        drive = replace(drive, motor=motor)
    names = tuple(name for name in drive.assumed_fields if name not in given)
    inertia_now = given.get("inertia", drive.inertia)
    return replace(drive, inertia=inertia_now, assumed_fields=names)


def _calculated(
    project: Project, drive: Drive | SpeedProfile | None, seconds: float | None
) -> tuple[RunUp, RunUp | None]:
    """Start, and coast down where working speed is reached, with progress on stderr."""
    from flipflow.model.drive import Drive  # noqa: PLC0415
    from flipflow.transient.startup import coast_down  # noqa: PLC0415  keeps --help quick

    with progress("start; the first run of a version compiles") as tell:

        def during(stage: str) -> Monitor:
            return lambda sentence, share: tell(f"{stage}, {sentence}", share)

        start = _start(project, drive, seconds, during("start"))
        if start.outcome != "reached" or not isinstance(start.drive, Drive):
            return start, None
        begin = start.final_speed
        return start, coast_down(
            project.screen, begin, start.drive, duration=seconds, monitor=during("coast-down")
        )


def _start(
    project: Project, drive: Drive | SpeedProfile | None, seconds: float | None, monitor: Monitor
) -> RunUp:
    """The worst start from rest; the one start of a given speed over time."""
    from flipflow.model.drive import SpeedProfile  # noqa: PLC0415  keeps --help quick
    from flipflow.studies.held_angles import starts_from_rest  # noqa: PLC0415
    from flipflow.transient.chosen_drive import default_drive, fitted_drive  # noqa: PLC0415
    from flipflow.transient.startup import start_up  # noqa: PLC0415

    screen, speed = project.screen, project.speed
    if speed is None or isinstance(drive, SpeedProfile):
        return start_up(screen, drive, speed=speed, duration=seconds, monitor=monitor)
    fitted = default_drive(screen, speed) if drive is None else fitted_drive(screen, drive, speed)
    return starts_from_rest(screen, fitted, speed, seconds, monitor)[0]


def _figures(runs: dict[str, RunUp], target: Destination, subject: str) -> None:
    from flipflow.plotting.transient import run_up_figure  # noqa: PLC0415  keeps --help quick

    for name, run in runs.items():
        target.picture(f"{name}.html", run_up_figure(run), subject)


def _show(title: str, start: RunUp, coast: RunUp | None, out: Console) -> None:
    from flipflow.report.terminal import say  # noqa: PLC0415  keeps --help quick

    say(out, f"{printable(title)}: {start.verdict}.", "bold")
    _run(start, "On the way up", out)
    if start.power:
        scale, unit = (1e-3, "kW") if max(start.power.values()) >= 100.0 else (1.0, "W")
        shares = (f"{part} {digits(start.power[part] * scale)} {unit}" for part in POWER)
        say(out, f"Mean power at the end: {', '.join(shares)}")
    if coast is not None:
        out.print()
        say(out, f"Switched off, it {coast.verdict}.", "bold")
        _run(coast, "On the way down", out)
    notes = dict.fromkeys((*start.notes, *(coast.notes if coast is not None else ())))
    print_list(out, "Notes", notes)


def _run(run: RunUp, title: str, out: Console) -> None:
    """Peaks with the speeds at which they occur, and the time to pass the first resonance."""
    out.print(f"{title:<30}{'greatest':>12}{'at rpm':>10}{'at s':>9}")
    for key, peak in run.peaks.items():
        word, scale, unit = WORDS[key]
        if key == "stop_force" and peak.value == 0.0:
            out.print(f"  {word:<28}{'not reached':>12}")
            continue
        value = f"{digits(peak.value * scale)} {unit}"
        out.print(f"  {word:<28}{value:>12}{peak.omega * RPM:>10.0f}{peak.t:>9.2f}")
    first = f"w01 = {run.first_frequency * RPM:.0f} rpm"
    passed = f"passed in {run.passing:.2g} s" if run.passing is not None else "not passed"
    out.print(f"First natural frequency {first}: {passed}")
    if run.history.normal is None:
        out.print("Along the surface only: the force on the foundation is larger.")
