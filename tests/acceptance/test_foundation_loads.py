"""What goes into the ground, against hand calculation, Newton's law and an own integration."""

from __future__ import annotations

import dataclasses
import io
import json
import math
from importlib import resources

import numpy as np
import pytest
from rich.console import Console
from scipy.integrate import solve_ivp

import flipflow as ff
from flipflow.io.results import document_of
from flipflow.report import summary
from flipflow.report.blocks import Table
from flipflow.report.foundation import foundation_page
from flipflow.report.html import html
from judge import close

pytestmark = pytest.mark.numerical
G, ANGLE = 9.80665, math.radians(15.0)
OMEGA = 850.0 * math.pi / 30.0
SENSES = [("with-flow", 1.0), ("counter-flow", -1.0)]
T = np.linspace(0.0, 2.0 * math.pi / OMEGA, 200_001)
TURN = np.exp(1j * OMEGA * T)


@pytest.fixture(scope="module")
def linear() -> ff.FlipFlowScreen:
    """A symmetric screen that touches no stop, so that its motion is a textbook's."""
    return ff.load("ffs0827-linear")


def motion(screen: ff.FlipFlowScreen, omega: float = OMEGA):
    return ff.frequency_response(screen, (0.97 * omega, 1.03 * omega)).orbits_at(omega)[0]


def by_hand(screen: ff.FlipFlowScreen, omega: float, sense: float) -> tuple[complex, complex]:
    """Complex forces of all isolation springs on the foundation: up the slope, and upwards."""
    w = omega
    k1, c1, k2, c2 = (
        screen.isolation_stiffness, screen.isolation_damping,
        screen.shear_stiffness, screen.shear_damping,
    )  # fmt: skip
    z1, z2 = k1 + 1j * w * c1, k2 + 1j * w * c2
    m1, m2, force = screen.main_mass, screen.floating_mass, screen.eccentric_moment * w**2
    # m2 xf'' = z2 (x1 - xf): the floating frame as an added dynamic mass on the main frame.
    carried = -(w**2) * m2 * z2 / (z2 - w**2 * m2)
    X1 = force / (z1 - w**2 * m1 + carried)
    zn = screen.normal_stiffness + 1j * w * screen.normal_damping
    Y = sense * -1j * force / (zn - w**2 * (m1 + m2))
    return z1 * X1, zn * Y


@pytest.mark.parametrize(("rotation", "sense"), SENSES)
def test_each_support_of_a_symmetric_screen_by_hand(linear, rotation, sense) -> None:
    screen = linear.replace(rotation=rotation)
    loads = ff.foundation_loads({"empty": motion(screen)})
    assert loads.supports == ("S1", "S2", "S3", "S4")
    case = loads.cases[0]
    weight = (916.0 + 310.0) * G
    each = loads.of_support(case.static)
    close("weight on each", each.vertical, weight / 4.0, rel=1e-12)
    close("along", each.along, -weight / 4.0 * math.sin(ANGLE), rel=1e-12)
    close("normal", each.normal, weight / 4.0 * math.cos(ANGLE), rel=1e-12)
    assert each.horizontal == 0.0

    along, up = by_hand(screen, OMEGA, sense)
    # Turned by the deck's angle: x points up the slope, y away from it; the foundation is below.
    horizontal = along * math.cos(ANGLE) - up * math.sin(ANGLE)
    down = -(along * math.sin(ANGLE) + up * math.cos(ANGLE))
    expected = np.array([abs(along), abs(up), abs(horizontal), abs(down)]) / 4.0
    running = loads.of_support(case.running)
    got = [running.along, running.normal, running.horizontal, running.vertical]
    close("running, each support", got, expected, rel=1e-5)
    first, second, third = case.orders
    amplitude, phase = loads.of_support(first.amplitude), first.phase
    got = [amplitude.along, amplitude.normal, amplitude.horizontal, amplitude.vertical]
    close("order 1", got, expected, rel=1e-9)
    got = np.exp(1j * np.array([phase.along, phase.normal, phase.horizontal, phase.vertical]))
    forces = np.array([along, -up, horizontal, down])
    close("phases", got, forces / np.abs(forces), abs=1e-9)
    for none in (second, third):
        assert none.amplitude.along < 1e-9 * abs(along)
        assert none.amplitude.normal == 0.0
    least = loads.of_support(case.least)
    close("least normal", least.normal, weight / 4 * math.cos(ANGLE) - abs(up) / 4, rel=1e-5)
    close("least vertical", least.vertical, (weight - abs(down)) / 4.0, rel=1e-5)


def test_the_sense_of_rotation_changes_the_horizontal_load(linear) -> None:
    """The components across and along stay, what they make together does not."""
    one, other = (
        ff.foundation_loads({"": motion(linear.replace(rotation=r))}).cases[0].running
        for r, _ in SENSES
    )
    close("along", one.along, other.along, rel=1e-12)
    close("normal", one.normal, other.normal, rel=1e-12)
    assert abs(one.horizontal / other.horizontal - 1.0) > 0.05
    assert abs(one.vertical / other.vertical - 1.0) > 0.01


@pytest.mark.parametrize(("rotation", "sense"), SENSES)
@pytest.mark.parametrize("measured", ["standing", "drawn"])
def test_all_supports_together_carry_what_newton_says(rotation, sense, measured) -> None:
    """The sum of the supports is the exciter's force less mass times acceleration, stops or not."""
    screen = ff.load("ffs0827").replace(rotation=rotation, clearance_measured=measured)
    orbit = motion(screen)
    loads = ff.foundation_loads({"empty": orbit})
    m0r, m1, m2 = screen.eccentric_moment, screen.main_mass, screen.floating_mass
    inertia = m1 * orbit.acceleration("main", T) + m2 * orbit.acceleration("floating", T)
    along = m0r * OMEGA**2 * np.cos(OMEGA * T) - inertia
    _, up = by_hand(screen, OMEGA, sense)
    across = (up * TURN).real
    c, s = math.cos(ANGLE), math.sin(ANGLE)
    series = {
        "along": along, "normal": -across,
        "horizontal": c * along - s * across, "vertical": -s * along - c * across,
    }  # fmt: skip
    whole, each = loads.cases[0].running, loads.of_support(loads.cases[0].running)
    for name, values in series.items():
        close(name, getattr(whole, name), np.abs(values).max(), rel=2e-5)
        close(f"sum, {name}", 4.0 * getattr(each, name), getattr(whole, name), rel=1e-14)
    close("length", whole.total, np.hypot(along, across).max(), rel=2e-5)
    weight = (m1 + m2) * G
    least = loads.cases[0].least
    close("least", least.vertical, (weight + series["vertical"]).min(), rel=2e-5)
    # Orders by a sum over the turn: the trapezoidal rule on a periodic function.
    for one in loads.cases[0].orders:
        wave = np.exp(-1j * one.order * OMEGA * T[:-1])
        for name, values in series.items():
            expected = 2.0 * np.mean(values[:-1] * wave)
            got = getattr(one.amplitude, name) * np.exp(1j * getattr(one.phase, name))
            close(f"order {one.order:g}, {name}", got, expected, abs=0.02)


def test_a_load_case_adds_its_weight(linear) -> None:
    orbit = motion(linear.loaded(ff.Load(main_mass=40.0, floating_mass=60.0)))
    static = ff.foundation_loads({"full": orbit}).cases[0].static
    close("weight", static.total, (916.0 + 310.0 + 100.0) * G, rel=1e-12)


def test_a_motion_of_two_turns_has_halves_of_orders() -> None:
    screen = ff.load("ffs0827").replace(clearance_measured="drawn")
    found = ff.periodic_orbits(screen, 780.0 * math.pi / 30.0, max_periods=2)
    double = next(orbit for orbit in found if orbit.periods == 2)
    case = ff.foundation_loads({"empty": double}).cases[0]
    assert [one.order for one in case.orders] == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert case.orders[0].amplitude.along > 1e-3 * case.orders[1].amplitude.along


@pytest.mark.parametrize(("rotation", "sense"), SENSES)
def test_start_and_stop_against_an_own_integration(linear, rotation, sense) -> None:
    """DOP853 on both directions under a given speed: peaks within 0.1 %, speeds within 1 %."""
    screen = linear.replace(rotation=rotation)
    top, seconds = 90.0, 6.0
    up = ff.start_up(screen, ff.SpeedProfile((0.0, seconds), (0.0, top)), angle=0.0)
    loads = ff.foundation_loads({}, {"start": up})
    run = loads.runs[0]

    rate = top / seconds
    m1, m2, m0r = screen.main_mass, screen.floating_mass, screen.eccentric_moment
    k1, c1 = screen.isolation_stiffness, screen.isolation_damping
    k2, c2 = screen.shear_stiffness, screen.shear_damping
    kn, cn = screen.normal_stiffness, screen.normal_damping

    def slope(t, s):
        x1, xf, y, v1, vf, vy = s
        w, angle = rate * t, 0.5 * rate * t * t
        between = k2 * (x1 - xf) + c2 * (v1 - vf)
        fx = m0r * (w * w * math.cos(angle) + rate * math.sin(angle))
        fy = sense * m0r * (w * w * math.sin(angle) - rate * math.cos(angle))
        return [
            v1, vf, vy, (fx - k1 * x1 - c1 * v1 - between) / m1, between / m2,
            (fy - kn * y - cn * vy) / (m1 + m2),
        ]  # fmt: skip

    t = np.linspace(0.0, seconds, 60_001)
    s = solve_ivp(slope, (0.0, seconds), np.zeros(6), "DOP853", t, rtol=1e-10, atol=1e-12).y
    fx, fy = k1 * s[0] + c1 * s[3], kn * s[2] + cn * s[5]
    c, d = math.cos(ANGLE), math.sin(ANGLE)
    series = {"along": fx, "normal": -fy, "horizontal": c * fx - d * fy,
              "vertical": -d * fx - c * fy}  # fmt: skip
    for name, values in series.items():
        close(name, getattr(run.peaks, name), np.abs(values).max(), rel=1e-3)
        speed = rate * t[np.abs(values).argmax()]
        close(f"speed of {name}", getattr(run.at, name), speed, rel=1e-2)
    size = np.hypot(fx, fy)
    close("total", run.peaks.total, size.max(), rel=1e-3)
    weight = (m1 + m2) * G
    close("least", run.least.vertical, (weight + series["vertical"]).min(), rel=1e-3)
    ways = {"main": s[0], "floating": s[1]}
    for frame, x in ways.items():
        for name, values in {
            "along": x, "normal": s[2], "horizontal": c * x - d * s[2],
            "vertical": -d * x - c * s[2],
        }.items():  # fmt: skip
            got = getattr(run.travel[frame], name)
            close(f"travel, {frame}, {name}", got, np.abs(values).max(), rel=1e-3)
    low, high = run.excited
    inside = size[(rate * t >= low) & (rate * t <= high)]
    assert inside.max() == size.max()
    beyond = size[(rate * t < 0.98 * low) | (rate * t > 1.02 * high)]
    assert beyond.max() < math.sqrt(0.5) * size.max()


def test_a_spring_that_lifts_off_is_named(linear) -> None:
    """Stiff springs normal to the surface put their resonance at working speed."""
    stiff = linear.replace(normal_stiffness=1226.0 * OMEGA**2)
    loads = ff.foundation_loads({"stiff": motion(stiff), "soft": motion(linear)})
    _, up = by_hand(stiff, OMEGA, 1.0)
    assert abs(up) > 1226.0 * G * math.cos(ANGLE)
    assert loads.lifting == ("stiff",)
    assert "a spring lifts off in stiff" in loads.sentence
    close("least", loads.cases[0].least.normal, 1226.0 * G * math.cos(ANGLE) - abs(up), rel=1e-4)


def test_what_is_missing_is_said_and_left_out(linear) -> None:
    bare = linear.replace(
        deck_angle=None, normal_stiffness=None, supports=None, isolation_pieces=None
    )
    loads = ff.foundation_loads({"empty": motion(bare)})
    running = loads.cases[0].running
    assert running.along > 0.0
    assert (running.normal, running.horizontal, running.vertical) == (None, None, None)
    assert loads.supports == ()
    assert "all supports together" in loads.sentence
    assert "lift-off is not checked" in loads.sentence
    told = " ".join(loads.notes)
    for word in (
        "normal_stiffness",
        "deck_angle",
        "isolation.supports",
        "Lateral",
        "not calculated",
    ):
        assert word in told


@pytest.mark.parametrize("supports", [2, 4, 5, 6, 8])
def test_weight_on_each_support_balances_about_the_centre_of_gravity(linear, supports) -> None:
    """Forces and moments of a rigid body; it tilts on its springs, so the shares lie on a line."""
    screen = linear.replace(supports=supports, load_centre=0.58)
    loads = ff.foundation_loads({"empty": motion(screen)})
    case = loads.cases[0]
    forces = np.array([loads.static_on(one, case).vertical for one in loads.supports])
    close("sum", forces.sum(), 1226.0 * G, rel=1e-12)
    columns = np.arange(supports) // 2
    if supports > 2:
        place = columns / columns.max()
        close("moment", forces @ (place - 0.58), 0.0, abs=1e-9 * 1226.0 * G)
        line = np.polyfit(place, forces, 1)
        close("line", forces, np.polyval(line, place), rel=1e-12)
    if supports == 4:
        close("lever", forces / (1226.0 * G), [0.21, 0.21, 0.29, 0.29], rel=1e-12)
        _, up = by_hand(screen, OMEGA, 1.0)
        lightest = 0.21 * 1226.0 * G * math.cos(ANGLE) - abs(up) / 4.0
        close("least", loads.of_support(case.least).normal, lightest, rel=1e-5)
    with pytest.raises(ff.InputError, match="support"):
        loads.static_on("S99", case)


def test_only_screens_have_a_foundation(linear) -> None:
    plain = motion(linear.system())
    for wrong in ({}, {"a": 1}, {"a": plain}):
        with pytest.raises(ff.InputError, match="motions"):
            ff.foundation_loads(wrong)
    with pytest.raises(ff.InputError, match="runs"):
        ff.foundation_loads({"a": motion(linear)}, {"b": 2})


@pytest.fixture(scope="module")
def assessment(analysed):
    return analysed("ffs0827")


def test_the_case_that_weighs_most_is_named_where_it_is_another(linear) -> None:
    full = linear.replace(floating_mass=1.1 * linear.floating_mass, eccentric_moment=1.0)
    loads = ff.foundation_loads({"empty": motion(linear), "full": motion(full)})
    assert "at rest (case full); running" in loads.sentence
    assert "(case empty)" in loads.sentence
    assert "at rest; running" in ff.foundation_loads({"full": motion(full)}).sentence


def test_what_decides_on_lift_off_stands_beside_it(assessment) -> None:
    """A run whose load normal to the surface exceeds the weight, and whose vertical does not."""
    (run, *_) = assessment.foundation.runs
    least = dataclasses.replace(run.least, normal=-4e3, vertical=2e3)
    loads = dataclasses.replace(
        assessment.foundation, runs=(dataclasses.replace(run, least=least),)
    )
    tables = [
        block
        for block in foundation_page(dataclasses.replace(assessment, foundation=loads))
        if isinstance(block, Table) and block.title.endswith("start and stop")
    ]
    (row,) = tables[0].rows
    heads = [column.title for column in tables[0].columns]
    shown = dict(zip(heads, (cell.text for cell in row), strict=True))
    assert shown["Spring"] == "lifts off"
    assert (shown["Least, vertical"], shown["Least, normal"]) == ("0.500", "-1.00")


def test_one_sentence_on_page_1_in_the_terminal_and_in_the_document(assessment) -> None:
    sentence = assessment.foundation.sentence
    document = document_of(assessment)
    assert document["ground"] == sentence
    assert json.loads(json.dumps(document))["foundation"]["each_support"].keys() == {
        "S1", "S2", "S3", "S4"
    }  # fmt: skip
    page_1 = html(assessment).split('<h2 class="page"')[0]
    assert sentence in page_1
    out = io.StringIO()
    summary(assessment, Console(file=out, width=80, highlight=False, markup=False))
    assert sentence in " ".join(out.getvalue().split())


def test_supports_of_the_document_add_up_to_the_whole(assessment) -> None:
    document = document_of(assessment)
    each = document["foundation"]["each_support"]
    for case in assessment.foundation.cases:
        whole = vars(case.running)
        for name, value in whole.items():
            parts = [one[case.name]["running"][name] for one in each.values()]
            close(name, sum(parts), value, rel=1e-12)
        weights = [one[case.name]["static"]["vertical"] for one in each.values()]
        close("weight", sum(weights), case.static.vertical, rel=1e-12)


def test_the_page_for_the_civil_engineer_names_supports_and_what_is_not_known(assessment) -> None:
    page = html(assessment).split("Loads on the foundation")[1]
    for word in ("S1", "S4", "assumed equal", "Lateral", "with-flow", "coast-down",
                 "horizontal", "Travel, for chutes"):  # fmt: skip
        assert word in page


def test_many_cases_keep_the_page_short(assessment) -> None:
    case = assessment.foundation.cases[0]
    cases = tuple(dataclasses.replace(case, name=f"case {k}") for k in range(30))
    many = dataclasses.replace(
        assessment, foundation=dataclasses.replace(assessment.foundation, cases=cases)
    )
    page = html(many).split("Loads on the foundation")[1]
    assert page.count('<td class="text">\ncase ') == 6
    assert "24 more load cases" in page


def test_loads_open_again(assessment, tmp_path) -> None:
    ff.save(assessment.foundation, tmp_path / "loads.json")
    assert ff.open_result(tmp_path / "loads.json") == assessment.foundation


def test_eight_springs_on_four_supports(tmp_path) -> None:
    text = (resources.files("flipflow.io") / "machines" / "ffs0827.toml").read_text()
    eight = text.replace("supports = 4", "supports = 4\npieces = 8").replace(
        'stiffness = "630 kN/m"', 'stiffness_each = "78.75 kN/m"', 1
    )
    file = tmp_path / "eight.toml"
    file.write_text(eight)
    screen = ff.load(file)
    assert (screen.supports, screen.isolation_pieces) == (4.0, 8.0)
    close("k1", screen.isolation_stiffness, 630e3, rel=1e-12)
    file.write_text(eight.replace("pieces = 8", "pieces = 6"))
    with pytest.raises(ff.InputError, match=r"isolation\.pieces = 6: give a multiple of the 4"):
        ff.load(file)
    with pytest.raises(ff.InputError, match="isolation_pieces"):
        screen.replace(supports=3)
