"""Loads of single parts, what they do in the heat, and the weight, each by another formula."""

from __future__ import annotations

import dataclasses
import io
import math
import re
from importlib import resources

import numpy as np
import pytest
from rich.console import Console
from scipy.optimize import bisect, brentq

import flipflow as ff
from flipflow.io.check import check_project
from flipflow.model.fields import FIELD
from flipflow.model.numerals import digits
from flipflow.report import summary
from flipflow.report.html import html
from flipflow.report.numbers import bounds, percent
from flipflow.studies.quantity_values import MOTION_VALUES, ContactFree, Working
from judge import close

pytestmark = pytest.mark.numerical
RPM = 30.0 / math.pi
OMEGA = 850.0 / RPM
PERIOD = 2.0 * math.pi / OMEGA
T = np.linspace(0.0, PERIOD, 200_001)
FULL = {"rotating_mass": 42.0, "bearing_rating": 355e3, "shear_conductance": 2.0}


def working(screen: ff.FlipFlowScreen, omega: float = OMEGA) -> Working:
    branch = ff.frequency_response(screen, (0.97 * omega, 1.03 * omega))
    return Working(screen, branch.orbits_at(omega)[0])


@pytest.fixture(scope="module")
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827").replace(**FULL)


@pytest.fixture(scope="module")
def found(screen) -> Working:
    return working(screen)


def test_one_shear_spring_of_a_textbook_screen() -> None:
    """Without a stop the motion is that of two springs in series, solved here by Cramer's rule."""
    screen = ff.load("ffs0827-linear").replace(**FULL)
    w = OMEGA
    z1 = screen.isolation_stiffness + 1j * w * screen.isolation_damping
    z2 = screen.shear_stiffness + 1j * w * screen.shear_damping
    a, b, d = z1 + z2 - w**2 * screen.main_mass, -z2, z2 - w**2 * screen.floating_mass
    force = screen.eccentric_moment * w**2
    X2 = force * (d + b) / (a * d - b * b)
    found = working(screen)
    power = 0.5 * screen.shear_damping * w**2 * abs(X2) ** 2 / 12.0
    close("force", found.value("shear_piece_force"), abs(z2 * X2) / 12.0, rel=1e-5)
    close("power", found.value("shear_piece_power"), power, rel=1e-9)
    close("warmer", found.value("shear_temperature_rise"), power / 2.0, rel=1e-9)
    close("strain", found.value("shear_strain"), abs(X2) / 0.05, rel=1e-9)
    assert found.value("stop_approach_speed") == 0.0


def test_one_shear_spring_with_stops(screen, found) -> None:
    """By sums over the turn instead of quadrature piece by piece."""
    x2, v2 = found.orbit.displacement("relative", T), found.orbit.velocity("relative", T)
    force = np.abs(screen.shear_stiffness * x2 + screen.shear_damping * v2).max() / 12.0
    close("force", found.value("shear_piece_force"), force, rel=1e-5)
    power = screen.shear_damping * np.mean(v2[:-1] ** 2) / 12.0
    close("power", found.value("shear_piece_power"), power, rel=1e-6)


@pytest.mark.parametrize("name", [
    "shear_piece_force", "shear_piece_power", "shear_temperature_rise", "stop_approach_speed",
    "bearing_load", "bearing_life",
])  # fmt: skip
def test_many_machines_in_closed_form_are_one_machine_solved(name) -> None:
    """What a sensitivity evaluates for arrays of screens without stop."""
    screen = ff.load("ffs0827-linear").replace(**FULL)
    fields = {one: np.asarray(getattr(screen, one), float) for one in FIELD}
    arrays = ContactFree(fields, np.array([OMEGA]))
    got = MOTION_VALUES[name](arrays)
    close(name, np.ravel(got), [working(screen).value(name)], rel=1e-5)


def test_one_stop_meets_its_partner_as_fast_as_the_gap_closes(found) -> None:
    orbit, gap = found.orbit, 6e-3

    def beyond(t: float) -> float:
        return float(orbit.displacement("relative", [t])[0]) - gap

    x2 = orbit.displacement("relative", T)
    k = int(np.flatnonzero((x2[:-1] < gap) & (x2[1:] >= gap))[0])
    closes, h = brentq(beyond, T[k], T[k + 1], xtol=1e-15), 1e-7
    speed = (beyond(closes) - beyond(closes - h)) / h
    close("approach speed", found.value("stop_approach_speed"), speed, rel=1e-5)
    close("force", found.value("stop_piece_force"), found.value("stop_force") / 4.0, rel=1e-12)


@pytest.mark.parametrize("rotation", ["with-flow", "counter-flow"])
def test_bearings_carry_what_moves_the_rotating_mass(screen, rotation) -> None:
    """Newton for the centre of the rotating mass, its acceleration by differences of its place."""
    turned = screen.replace(rotation=rotation)
    found = working(turned)
    sense = 1.0 if rotation == "with-flow" else -1.0
    eccentricity = turned.eccentric_moment / 42.0
    h = T[1] - T[0]

    # The closed turn goes on with its beginning.
    def rate_of_rate(place):
        wrapped = np.concatenate([place[-2:-1], place, place[1:2]])
        return np.diff(wrapped, 2) / h**2

    x = found.orbit.displacement("main", T) + eccentricity * np.cos(OMEGA * T)
    y = found.normal.displacement(T) + sense * eccentricity * np.sin(OMEGA * T)
    force = 42.0 * np.hypot(rate_of_rate(x), rate_of_rate(y)).max() / 2.0
    load = found.value("bearing_load")
    close("load", load, force, rel=1e-4)
    assert load != pytest.approx(turned.eccentric_moment * OMEGA**2 / 2.0, rel=1e-3)
    hours = 1e6 / (60.0 * 850.0) * (355e3 / (1.2 * load)) ** (10.0 / 3.0)
    close("life", found.value("bearing_life") / 3600.0, hours, rel=1e-9)


def test_factor_and_exponent_of_the_bearings_are_fields(found, screen) -> None:
    balls = Working(screen.replace(bearing_load_factor=1.5, bearing_life_exponent=3.0), found.orbit)
    hours = 1e6 / (60.0 * 850.0) * (355e3 / (1.5 * found.value("bearing_load"))) ** 3
    close("life", balls.value("bearing_life") / 3600.0, hours, rel=1e-9)
    bare = Working(screen.replace(rotating_mass=None), found.orbit)
    assert bare.value("bearing_load") is None
    assert bare.value("bearing_force") == pytest.approx(33025.0 / 2.0, rel=1e-4)


def bundled(**changes: str) -> str:
    """The bundled file with lines replaced."""
    text = (resources.files("flipflow.io") / "machines" / "ffs0827.toml").read_text()
    for old, new in changes.values():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


AIR = ('temperature = "50 degC"', 'temperature = "20 degC"\ntemperature_of = "air"')


@pytest.fixture(scope="module")
def warm(tmp_path_factory):
    """The bundled machine whose hot case is one of warm air."""
    file = tmp_path_factory.mktemp("warm") / "warm.toml"
    file.write_text(bundled(air=AIR))
    return ff.assess(ff.load_project(file))


def test_rubber_is_as_warm_as_its_own_work_keeps_it(warm) -> None:
    """The fixed point by bisection, each motion solved for with the stiffness at its heat."""
    screen = ff.load("ffs0827")
    table = np.array(screen.temperature_factor)

    def warmer(rubber: float) -> float:
        factor = np.interp(rubber, *table.T)
        own = screen.replace(shear_stiffness=factor * screen.shear_stiffness)
        orbit = ff.frequency_response(own, (40.0, 100.0)).orbit_from_below(OMEGA)
        v2 = orbit.velocity("relative", T)
        power = screen.shear_damping * np.mean(v2[:-1] ** 2) / 12.0
        return power / screen.shear_conductance

    rubber = bisect(lambda x: 20.0 + warmer(x) - x, 20.0, 50.0, xtol=1e-3)
    case = next(one for one in warm.cases if one.name == "hot")
    close("rubber", case.load.temperature, rubber, abs=0.02)
    close("warmer", case.values["shear_temperature_rise"], rubber - 20.0, abs=0.02)
    page = html(warm)
    assert f"20.0 degC is the air&#39;s temperature; the rubber settles at {rubber:.1f}" in page


def test_a_temperature_of_the_rubber_stays_what_it_is(analysed) -> None:
    found = analysed("ffs0827")
    hot = next(one for one in found.cases if one.name == "hot")
    assert hot.load.temperature == 50.0
    assert "50.0 degC is the rubber&#39;s temperature" in html(found)


@pytest.mark.parametrize(
    ("conductance", "words"),
    [(None, "for want of shear_springs.conductance"), (0.5, "warmer than the springs' table")],
)
def test_air_without_an_answer_is_said(conductance, words) -> None:
    project = ff.load_project("ffs0827")
    air = ff.Load(name="air", temperature=20.0, temperature_of="air")
    part = dataclasses.replace(
        project, load_cases=(air,), screen=project.screen.replace(shear_conductance=conductance)
    )
    assert any(words in note for note in ff.assess(part).notes)


def test_stops_have_a_temperature_factor_and_a_scatter(tmp_path) -> None:
    table = '[["0 degC", 1.2], ["60 degC", 0.9]]'
    file = tmp_path / "stops.toml"
    file.write_text(bundled(
        table=('law = "paper"', f'temperature_factor = {table}\nlaw = "paper"'),
        case=('temperature = "50 degC"',
              'temperature = "50 degC"\nstop_stiffness_factor = 1.1\nstop_damping_factor = 1.3'),
    ))  # fmt: skip
    project = ff.load_project(file)
    hot = project.screen.loaded(project.load_cases[-1])
    close("k3", hot.stop_stiffness, 8100e3 * 1.1 * (1.2 - 0.3 * 50.0 / 60.0), rel=1e-12)
    close("c3", hot.stop_damping, 2605.0 * 1.3, rel=1e-12)
    close("k2", hot.shear_stiffness, 2700e3 * 0.85, rel=1e-12)
    cold = ff.Load(temperature=-5.0)
    with pytest.raises(ff.InputError, match="stops' table, 0 to 60 degC"):
        project.screen.loaded(cold)
    with pytest.raises(ff.InputError, match="temperature_of"):
        ff.Load(temperature_of="water")


def test_a_file_without_the_table_of_stops_leaves_them_alone() -> None:
    screen = ff.load("ffs0827")
    assert screen.loaded(ff.Load(temperature=50.0)).stop_stiffness == screen.stop_stiffness


def test_check_promises_what_analyze_prints(analysed) -> None:
    """Force and power of one shear spring: missing with the pieces, there with them."""
    project = ff.load_project("ffs0827")
    bare = dataclasses.replace(project, screen=project.screen.replace(shear_pieces=None))
    gaps = {gap.missing: gap.disables for gap in check_project(bare).missing}
    assert "force per shear spring, power per shear spring" in gaps["shear_springs.pieces"]
    page = html(analysed(project))
    parts = page.split("<h3>Parts</h3>")[1].split("</section>")[0]
    for words in ("Force per shear spring", "Power per shear spring", "Temperature rise",
                  "Approach speed", "Load per exciter bearing", "ISO 281",
                  "Minerals 2024, 14, 406, Eq. (1)"):  # fmt: skip
        assert words in parts
    assert "missing in the machine file" not in parts


def printed(assessment) -> str:
    out = io.StringIO()
    summary(assessment, Console(file=out, width=80, highlight=False, markup=False))
    return out.getvalue()


def test_the_weight_stands_in_report_and_terminal() -> None:
    """Row 34 of the trusted values as a reader finds them."""
    project = ff.load_project("ffs0827")
    drawn = dataclasses.replace(
        project, screen=project.screen.replace(clearance_measured="drawn"),
        load_cases=project.load_cases[:1],
    )  # fmt: skip
    assessment = ff.assess(drawn)
    row = "empty 0.29 5.71 6.29 764.8 807.6 9.67 4.42"
    assert row in re.sub(r" +", " ", printed(assessment))
    doubled = "one period gives way to one of two: 774.1 to 787.9 rpm (empty)"
    assert doubled in " ".join(printed(assessment).split())
    page = html(assessment)
    table = page.split("<h3>Weight and gaps</h3>")[1].split("</section>")[0]
    cells = re.findall(r"<td[^>]*>\s*([^<]*?)\s*</td>", table)
    assert " ".join(cells) == row
    assert doubled in page
    gaps = assessment.cases[0].gaps
    close("shift", gaps.shift, 310.0 * 9.80665 * math.sin(math.radians(15.0)) / 2.7e6, rel=1e-12)
    close("gaps", [gaps.plus, gaps.minus], [6e-3 - gaps.shift, 6e-3 + gaps.shift], rel=1e-12)


def test_weight_without_an_angle_is_said_not_to_be_considered() -> None:
    project = ff.load_project("ffs0827")
    level = dataclasses.replace(
        project, screen=project.screen.replace(deck_angle=None), load_cases=project.load_cases[:1]
    )
    assessment = ff.assess(level)
    for text in (printed(assessment), html(assessment)):
        assert "weight not considered" in " ".join(text.split())


def test_one_number_reads_alike_everywhere() -> None:
    assert digits(1207.3) == "1207"
    assert digits(999.6) == "1000"
    assert digits(12.345) == "12.3"
    assert bounds(-math.inf, 1.5e7, "kN", "N") == "at most 15000 kN"
    assert percent(math.inf) == "-"


def test_a_large_number_has_no_exponent_in_the_verdict() -> None:
    """A thousand machines in one: every mass, spring and damper, and so the power in kW."""
    project = ff.load_project("ffs0827")
    extensive = ("main_mass", "floating_mass", "eccentric_moment", *(
        f"{part}_{kind}" for part in ("isolation", "normal", "shear", "stop")
        for kind in ("stiffness", "damping")
    ))  # fmt: skip
    huge = {name: 1e3 * getattr(project.screen, name) for name in extensive}
    one = dataclasses.replace(
        project, screen=project.screen.replace(**huge), load_cases=project.load_cases[:1],
        limits=ff.Limits(dissipated_power=1e6),
    )  # fmt: skip
    assessment = ff.assess(one)
    assert "1138 kW of 1000 kW most" in assessment.verdict
    text = printed(assessment)
    assert "1138 kW" in text
    assert "e+0" not in text


def test_a_margin_to_a_jump_that_does_not_exist_has_no_number() -> None:
    """A stiff gap that is never touched: there is no jump to be near to."""
    project = ff.load_project("ffs0827")
    calm = dataclasses.replace(
        project, screen=project.screen.replace(eccentric_moment=0.05),
        load_cases=project.load_cases[:1], limits=ff.Limits(jump_margin=0.2),
    )  # fmt: skip
    assessment = ff.assess(calm)
    assert assessment.limits_table[-1].margin == math.inf
    text = printed(assessment)
    assert "no jump" in text
    assert "no end" not in text
