"""A load case of warm air is the same machine to every command: its rubber heats itself.

What every command is held against is the fixed point T = T_air + P2(T) / (n G) by bisection, each
motion solved for with the stiffness that the springs' table gives at T.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np
import pytest
from scipy.optimize import bisect

import flipflow as ff
from flipflow.batch.reasons import UNSETTLED
from flipflow.batch.side_by_side import processors
from flipflow.cli.options import WARMING, in_case
from flipflow.io.check import check_project
from flipflow.io.machine_text import machine_text
from flipflow.model.screen import WarmedLoad, as_cool_as_air
from flipflow.report.blocks import Values
from flipflow.report.html import html
from flipflow.report.registry import blocks_of
from flipflow.studies import design_map, rubber_temperature, study_values
from flipflow.studies.candidates import Space
from flipflow.studies.rubber_temperature import settled, warmed_load
from judge import close

pytestmark = [pytest.mark.numerical, pytest.mark.usefixtures("analysed_once")]
RPM = 30.0 / math.pi
OMEGA = 850.0 / RPM
FASTER = 870.0 / RPM
AIR = ff.Load(name="air", temperature=20.0, temperature_of="air", floating_mass=10.0)
QUANTITIES = ("relative_amplitude", "stop_force", "shear_temperature_rise")
# On the way of each command from its machine to what it writes.
COMMANDS = {
    "orbits": ("--max-periods", "1"),
    "simulate": ("--periods", "30"),
    "basins": ("--cells", "3"),
    "startup": ("--duration", "3 s"),
    "sensitivity": ("--vary", "clearance=5.4 mm..6.6 mm", "--n", "4"),
}


@pytest.fixture(scope="module")
def project() -> ff.Project:
    """The bundled machine in warm air, with material on it that shifts the gaps."""
    return dataclasses.replace(ff.load_project("ffs0827"), load_cases=(AIR,))


@pytest.fixture
def file(project, tmp_path) -> str:
    path = tmp_path / "warm.toml"
    path.write_text(machine_text(project, {}))
    return str(path)


def at_rubber(screen: ff.FlipFlowScreen, rubber: float) -> ff.FlipFlowScreen:
    """The screen under the load with the rubber at a temperature; the table ends, it does not."""
    degrees = [row[0] for row in screen.temperature_factor]
    held = min(max(rubber, degrees[0]), degrees[-1])
    return screen.loaded(dataclasses.replace(AIR, temperature=held, temperature_of="rubber"))


def motion(screen: ff.FlipFlowScreen, omega: float) -> ff.Orbit:
    return ff.frequency_response(screen, (40.0, 105.0)).orbit_from_below(omega)


@cache
def by_bisection(screen: ff.FlipFlowScreen, omega: float = OMEGA) -> tuple[float, ff.Orbit]:
    """Temperature of the rubber and the motion at it."""

    def warmer(rubber: float) -> float:
        one = at_rubber(screen, rubber)
        v = motion(one, omega).velocity("relative", np.linspace(0.0, 2.0 * np.pi / omega, 20_001))
        power = one.shear_damping * np.mean(v[:-1] ** 2)
        return power / (screen.shear_pieces * screen.shear_conductance)

    rubber = bisect(lambda x: 20.0 + warmer(x) - x, 20.0, 150.0, xtol=1e-6)
    return rubber, motion(at_rubber(screen, rubber), omega)


def itself(screen: ff.FlipFlowScreen) -> dict[str, np.ndarray]:
    """What a study varies whose first machine is the screen."""
    return {"main_mass": screen.main_mass * np.array([1.0, 1.01])}


def values_of(orbit: ff.Orbit, rubber: float) -> list[float]:
    """The quantities of a study by the motion."""
    return [orbit.amplitude("relative"), orbit.stop_force_peak(), rubber - 20.0]


def test_analyze_and_study_find_the_same_rubber(project, analysed) -> None:
    rubber, orbit = by_bisection(project.screen)
    expected = values_of(orbit, rubber)
    case = analysed(project).cases[0]
    close("analyze", [case.values[name] for name in QUANTITIES], expected, rel=1e-5)
    found = ff.study(
        project.screen, itself(project.screen), QUANTITIES,
        omega=OMEGA, load_cases=project.load_cases,
    )  # fmt: skip
    studied = [found.values[name][0, 0, 0] for name in QUANTITIES]
    close("study", studied, expected, rel=1e-5)
    close("nominal", [found.nominal[name][0, 0] for name in QUANTITIES], expected, rel=1e-5)
    assert any("as warm as its own work keeps it" in note for note in found.notes)


def numbers_called(document: object, name: str) -> Iterator[float]:
    """Numbers of a document under a name, at any depth."""
    if isinstance(document, dict):
        for key, value in document.items():
            if key == name and isinstance(value, float):
                yield value
            yield from numbers_called(value, name)
    elif isinstance(document, list):
        for value in document:
            yield from numbers_called(value, name)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_for_a_case_takes_the_same_rubber(command, project, file, tmp_path, name) -> None:
    """At the speed that is asked for, and stderr says how warm it is."""
    rubber, orbit = by_bisection(project.screen, FASTER)
    words = (*COMMANDS[name], "--case", "air", "--speed", "870 rpm", "--json", "found.json")
    code, _, err = command(name, file, *words, "-o", tmp_path / "out")
    assert code == 0, err
    assert f"Note: Case air: the rubber settles at {rubber:.3g} degC at 870 rpm." in err
    assert ("all variants is as warm" in err) == (name == "sensitivity")
    document = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    if name == "simulate":
        stiffness = document["system"]["K"][1][1]
    else:
        stiffness = next(numbers_called(document, "shear_stiffness"))
    close("stiffness", stiffness, at_rubber(project.screen, rubber).shear_stiffness, rel=1e-5)
    if name == "orbits":
        found = document["orbits"][0]["amplitude"]["relative"]
        close("amplitude", found, orbit.amplitude("relative"), rel=1e-5)


def test_a_sweep_takes_the_rubber_of_the_working_speed(command, project, file, tmp_path) -> None:
    _, orbit = by_bisection(project.screen)
    words = ("--case", "air", "--speeds", "845 rpm", "850 rpm", "--steps", "2", "--json", "up.json")
    code, _, err = command("sweep", file, *words)
    assert code == 0, err
    assert "at 850 rpm." in err
    up = json.loads((tmp_path / "up.json").read_text(encoding="utf-8"))["up"]
    close("amplitude", up["amplitude"]["relative"][-1], orbit.amplitude("relative"), rel=1e-3)


@pytest.fixture(autouse=True)
def _here(monkeypatch, tmp_path) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_case_of_air_needs_a_speed(command, project, tmp_path) -> None:
    path = tmp_path / "slow.toml"
    path.write_text(machine_text(dataclasses.replace(project, speed=None), {}))
    for words in (
        ("sweep", path, "--speeds", "700 rpm", "800 rpm", "--steps", "2"),
        ("startup", path, "--profile", "0 s: 0 rpm, 5 s: 850 rpm"),
    ):
        code, _, err = command(*words, "--case", "air")
        assert code == 2
        assert "operation.speed" in err
        assert "--speed" not in err
    ranking = ("sensitivity", path, "--quantity", "omega_cs", "--vary", "clearance=5 mm..6 mm")
    code, _, err = command(*ranking, "--n", "2", "--case", "air")
    assert code == 2
    assert "or --speed '850 rpm'" in err
    code, _, err = command(*ranking, "--n", "2", "--case", "air", "--speed", "850 rpm")
    assert code == 0, err
    assert "at 850 rpm." in err
    code, _, err = command(*ranking, "--speed", "850 rpm")
    assert code == 2
    assert "belongs to the whole response" in err


@pytest.mark.parametrize(
    "words",
    [
        ("sweep", "--speeds", "800 rpm", "700 rpm"),
        ("sweep", "--speeds", "700 rpm", "800 rpm", "--rate", "fast"),
        ("startup", "--duration", "3 kg"),
        ("startup", "--profile", "0 s: 0 rpm, 5 s: 850 rpm", "--inertia", "1 kg m^2"),
        ("simulate", "--impulse", "hard"),
        ("sensitivity", "--vary", "gap=5 mm..6 mm"),
        ("sensitivity", "--vary", "clearance=5 mm..6 mm", "--quantity", "size"),
    ],
)
def test_options_are_read_before_the_rubber_is_warmed(command, file, monkeypatch, words) -> None:
    monkeypatch.setattr(rubber_temperature, "warmed_load", lambda *_: pytest.fail("warmed"))
    name, *others = words
    code, _, _ = command(name, file, "--case", "air", *others)
    assert code == 2


def test_a_note_on_the_rubber_writes_speeds_without_an_exponent(
    project, monkeypatch, capsys
) -> None:
    monkeypatch.setattr(
        rubber_temperature,
        "warmed_load",
        lambda _, load, __: WarmedLoad(as_cool_as_air(load), 31.0),
    )
    in_case(project, "air", "10000 rpm")
    assert "settles at 31 degC at 10000 rpm." in capsys.readouterr().err


def test_check_shows_progress_while_the_rubber_is_warmed(command, file, monkeypatch) -> None:
    told = []

    @contextmanager
    def bar(begin: str) -> Iterator[None]:
        told.append(begin)
        with monkeypatch.context() as patch:
            patch.setattr(rubber_temperature, "warmed_load", within)
            yield

    def within(*args: object) -> WarmedLoad:
        told.append("warmed")
        return warmed_load(*args)

    monkeypatch.setattr("flipflow.cli.check.progress", bar)
    assert command("check", file)[0] == 0
    assert told == [WARMING, "warmed"]


def test_every_machine_of_a_study_is_as_warm_as_its_own_work_keeps_it(project) -> None:
    """At every speed; machines with and without data of their own of springs and heat."""
    screen = project.screen
    columns = {
        "clearance": np.array([5.5e-3, 6.5e-3]), "shear_stiffness": np.array([2.6e6, 2.8e6]),
        "shear_conductance": np.array([1.6, 2.6]),
    }  # fmt: skip
    speeds = [OMEGA, FASTER]
    found = ff.study(
        screen, columns, QUANTITIES, omega=speeds, load_cases=[AIR], sampling="list",
    )  # fmt: skip
    for k in range(2):
        own = screen.replace(**{name: float(column[k]) for name, column in columns.items()})
        for f, omega in enumerate(speeds):
            rubber, orbit = by_bisection(own, omega)
            got = [found.values[name][k, 0, f] for name in QUANTITIES]
            close(f"machine {k} at {omega}", got, values_of(orbit, rubber), rel=1e-5)


def test_stops_of_variants_alone_are_as_warm_as_their_rubber(project) -> None:
    """Fault: by the temperature of the machine without stops, 20 % off in the force."""
    screen = project.screen.replace(
        stop_temperature_factor=((-10.0, 1.5), (50.0, 0.5)), shear_conductance=4.0
    )
    gaps = {"clearance": np.array([5.5e-3, 6.5e-3])}
    nominal, bare = (
        ff.study(one, gaps, "stop_force", omega=OMEGA, load_cases=[AIR]).values["stop_force"]
        for one in (screen, screen.replace(clearance=math.inf))
    )
    close("force", bare, nominal, rel=1e-5)


def test_derivatives_hold_what_a_parameter_does_to_the_rubber(project) -> None:
    """Against differences between studies; with the temperature held some are off by half."""
    names = ["clearance", "shear_stiffness", "shear_damping", "shear_conductance", "floating_mass"]

    def at(screen: ff.FlipFlowScreen, asked: tuple[str, ...] = ()) -> ff.Study:
        own = itself(screen)
        return ff.study(screen, own, QUANTITIES, omega=OMEGA, load_cases=[AIR], derivatives=asked)

    found = at(project.screen, tuple(names)).derivatives
    for j, name in enumerate(names):
        value = getattr(project.screen, name)
        step = 2e-4 * value
        high, low = (at(project.screen.replace(**{name: value + s})) for s in (step, -step))
        for one in QUANTITIES:
            slope = (high.values[one] - low.values[one]) / (2.0 * step)
            close(f"{one} by {name}", found[one][0, 0, 0, j], slope[0, 0, 0], rel=2e-3)


def test_a_jump_speed_under_warm_air_needs_the_one_speed(project, analysed) -> None:
    own = itself(project.screen)

    def asked(omega: object) -> ff.Study:
        return ff.study(project.screen, own, "omega_ub", omega=omega, load_cases=[AIR])

    folds = analysed(project).cases[0].branch.folds
    close("jump", asked(OMEGA).values["omega_ub"][0, 0], max(one.omega for one in folds), rel=1e-5)
    for omega in (None, [OMEGA, FASTER]):
        with pytest.raises(ff.InputError, match=r"temperature_of of case air.*at one speed"):
            asked(omega)


@pytest.mark.parametrize(
    "call",
    [
        lambda screen: screen.loaded(AIR),
        lambda screen: ff.operating_region(screen, load_cases=[AIR]),
        lambda screen: ff.loading(screen, AIR),
        lambda _: ff.LoadStep(1.0, AIR),
    ],
)
def test_what_knows_no_speed_refuses_the_airs_temperature(project, call) -> None:
    with pytest.raises(ff.InputError, match=r"temperature_of = 'air'.*give the rubber's"):
        call(project.screen)


def test_air_outside_the_table_is_refused_as_before(project) -> None:
    hot = dataclasses.replace(AIR, temperature=99.0)
    with pytest.raises(ff.InputError, match="within the springs' table"):
        ff.study(
            project.screen, {"clearance": (5e-3, 6e-3)}, "stop_force", omega=OMEGA, load_cases=[hot]
        )


def test_without_conductance_a_study_says_that_the_rubber_is_as_warm_as_the_air(project) -> None:
    bare = project.screen.replace(shear_conductance=None)
    own = itself(bare)
    found = ff.study(bare, own, "relative_amplitude", omega=OMEGA, load_cases=[AIR])
    expected = motion(at_rubber(bare, 20.0), OMEGA).amplitude("relative")
    close("as the air", found.values["relative_amplitude"][0, 0, 0], expected, rel=1e-8)
    assert any("for want of shear_springs.conductance" in note for note in found.notes)


def test_a_temperature_that_nothing_keeps_is_no_value(project, monkeypatch) -> None:
    """A rise that falls at 60 degC from 50 to 10 K settles at none: the air has 20 degC."""

    def torn(rubber: np.ndarray, left: np.ndarray) -> np.ndarray:
        assert rubber.size == left.size
        return np.where(rubber < 60.0, 50.0, 10.0)

    assert np.isnan(settled(np.array([20.0, 20.0]), torn)).all()
    monkeypatch.setattr(study_values, "settled", lambda air, _: np.full(air.size, np.nan))
    own = itself(project.screen)
    found = ff.study(project.screen, own, "stop_force", omega=OMEGA, load_cases=[AIR])
    assert np.isnan(found.values["stop_force"]).all()
    assert (found.reason == UNSETTLED).all()
    assert "temperature" in next(iter(found.reasons))


def duty(project: ff.Project, **changes: object) -> ff.Duty:
    given = {
        "project": project, "target": 7e-3, "tolerance": 1e-3, "speed": (OMEGA, FASTER),
        "free": {"clearance": (4e-3, 9e-3)}, "load_cases": (ff.Load(name="empty"), AIR),
        "limits": ff.Limits(stop_force=60e3, jump_margin=0.02),
    }  # fmt: skip
    return ff.Duty(**{**given, **changes})


def test_a_candidate_of_a_design_is_judged_with_its_own_rubber(project) -> None:
    """Amplitude and worst stop force of two candidates, at all three speeds of the duty."""
    space = Space(duty(project))
    u = np.array([[0.2], [0.6]])
    judged = space.judge(u, margins=space.duty.loads)
    for k in range(2):
        screen = space.machine(u[k])
        found = [by_bisection(screen, float(omega))[1] for omega in space.duty.speeds]
        warm = [orbit.amplitude("relative") for orbit in found]
        close(f"candidate {k}", judged.amplitude[k, 3:], warm, rel=1e-5)
        force = max(orbit.stop_force_peak() for orbit in found)
        close(f"force {k}", judged.worst["stop_force"][k], force, rel=1e-5)


def test_margins_of_a_candidate_are_those_of_its_own_rubber(project) -> None:
    """What is asked of motions at many speeds finds what it finds of the screen that is so warm."""
    screen, omega = project.screen, np.array([OMEGA, FASTER])
    columns = {"clearance": np.array([4e-3, 6e-3])}
    many = study_values.jump_distance_loaded(screen, columns, AIR, omega, 0.2, processors())
    alone = study_values.one_motion_loaded(screen, columns, AIR, omega, processors())
    for k, clearance in enumerate(columns["clearance"].tolist()):
        own = screen.replace(clearance=clearance)
        for f, speed in enumerate(omega.tolist()):
            rubber = dataclasses.replace(
                AIR, temperature=by_bisection(own, speed)[0], temperature_of="rubber"
            )
            one, at = {"clearance": np.array([clearance])}, np.array([speed])
            args = (own, one, rubber, at)
            close("jump", many[k, f], study_values.jump_distance_loaded(*args, 0.2, 1)[0, 0])
            assert alone[k, f] == study_values.one_motion_loaded(*args, 1)[0, 0]


def test_margins_of_rubber_that_does_not_settle_are_none(project, monkeypatch) -> None:
    monkeypatch.setattr(study_values, "settled", lambda air, _: np.full(air.size, np.nan))
    given = project.screen, {"clearance": np.array([6e-3, 7e-3])}, AIR, np.array([OMEGA])
    assert np.isnan(study_values.jump_distance_loaded(*given, 0.2, 1)).all()
    assert not study_values.one_motion_loaded(*given, 1).any()


def test_temperatures_of_a_duty_are_those_of_the_rubber(project) -> None:
    """Fault: combined with a case of warm air they counted as the air's."""
    loads = duty(project, temperatures=(0.0, 40.0)).loads
    assert {load.temperature_of for load in loads} == {"rubber"}


def test_a_design_map_under_warm_air(project) -> None:
    """Steadiness at one pair: the warm machine's amplitude over the empty one's; progress each."""
    gaps, stops = [5.5e-3, 6.5e-3], [8e6, 10e6]
    told = []
    found = ff.design_map(
        project.screen, OMEGA, gaps, stops, load=AIR, monitor=lambda words, _: told.append(words)
    )
    assert sum("gap of" in words for words in told) == 4
    one = project.screen.replace(clearance=gaps[1], stop_stiffness=stops[0])
    share = by_bisection(one)[1].amplitude("relative") / motion(one, OMEGA).amplitude("relative")
    close("steadiness", found.steadiness[0, 1], share, rel=1e-5)
    assert any("as warm as its own work keeps it" in note for note in found.notes)
    assert found.notes[0] in ff.figure(found).caption


@pytest.mark.parametrize(
    ("changes", "degrees", "words"),
    [
        ({"temperature_factor": ()}, 20.0, "add shear_springs.temperature_factor"),
        ({}, -40.0, "within the springs' table"),
    ],
)
def test_air_of_which_the_table_says_nothing_is_refused_at_once(
    project, changes, degrees, words
) -> None:
    """Faults: a ValueError after a minute; taken without a word."""
    screen, load = project.screen.replace(**changes), dataclasses.replace(AIR, temperature=degrees)
    told = []
    with pytest.raises(ff.InputError, match=words):
        ff.design_map(
            screen, OMEGA, [5e-3, 6e-3], [8e6, 9e6], load=load,
            monitor=lambda words, _: told.append(words),
        )  # fmt: skip
    assert not told
    with pytest.raises(ff.InputError, match=words):
        warmed_load(screen, load, OMEGA)


@pytest.mark.parametrize("known", [False, True])
def test_a_design_map_whose_rubber_is_not_known(project, monkeypatch, known) -> None:
    """As cool as the air for want of the conductance, and said; none where it does not settle."""
    screen = project.screen if known else project.screen.replace(shear_conductance=None)
    lost = WarmedLoad(as_cool_as_air(AIR), note="lost")
    monkeypatch.setattr(design_map, "warmed_load", lambda *_: lost)
    found = ff.design_map(screen, OMEGA, [6e-3, 6.1e-3], [9e6, 9.1e6], load=AIR)
    assert np.isnan(found.steadiness).all() == known
    assert any("for want of shear_springs.conductance" in one for one in found.notes) != known


def test_check_and_report_show_the_stiffness_at_work(command, project, file, analysed) -> None:
    """Faults: the factor of the air's temperature; 50 degC, the table's end, for the rubber's."""
    rubber, _ = by_bisection(project.screen)
    factor = project.screen.temperature_stiffness_factor(rubber)
    case = check_project(project).load_cases[0]
    close("factor", case.stiffness_factor, factor, rel=1e-5)
    close("rubber", case.rubber, rubber, rel=1e-5)
    _, out, _ = command("check", file)
    assert f"{rubber:.3g}, air 20" in out
    assert f"{factor:.4g}" in out
    page = html(analysed(project))
    assert f"air, rubber {rubber:.3g}" in page
    assert f'<td class="number">\n{factor:.4g}</td>' in page


def test_a_machine_whose_motion_is_not_known_is_checked_all_the_same(project) -> None:
    """Without any damping no motion settles, and the rubber is taken as cool as the air."""
    screen = project.screen.replace(
        isolation_damping=0.0, shear_damping=0.0, stop_damping=0.0, normal_damping=0.0
    )
    found = check_project(dataclasses.replace(project, screen=screen))
    assert found.load_cases[0].rubber is None
    assert found.load_cases[0].stiffness_factor == screen.temperature_stiffness_factor(20.0)
    assert any("temperature of the rubber was not found" in note for note in found.notes)


def test_rubber_beyond_the_table_has_one_temperature_everywhere(command, project, tmp_path) -> None:
    hot = dataclasses.replace(project, screen=project.screen.replace(shear_conductance=0.5))
    rubber, _ = by_bisection(hot.screen)
    assert rubber > 50.0
    path = tmp_path / "hot.toml"
    path.write_text(machine_text(hot, {}))
    _, out, _ = command("check", path)
    page = html(ff.assess(hot))
    assert f"{rubber:.3g}, air 20" in out
    for text in (" ".join(out.split()), page.replace("&#39;", "'")):
        assert f"the rubber, {rubber:.3g} degC, is warmer than the springs' table knows" in text
        assert "0.85" in text
    assert f"settles at {rubber:.3g} degC, its stiffness is that at 50.0 degC." in page
    assert f"air, rubber {rubber:.3g}" in page


def test_the_load_per_bearing_is_that_of_its_worst_case(analysed) -> None:
    """Fault: of the first case, since the unbalance's force is the same in all."""
    found = analysed("ffs0827")
    worst = max(found.cases, key=lambda case: case.values["bearing_load"])
    assert worst is not found.cases[0]
    values = [block for block in blocks_of(found) if isinstance(block, Values)]
    lines = {name: line for block in values for name, line in block.rows}
    assert lines["Exciter, bearings"].endswith(f"(case {worst.name})")
