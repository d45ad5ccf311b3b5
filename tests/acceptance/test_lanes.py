"""Many machines in one compiled call: each lane is the motion that its machine alone reaches."""

from dataclasses import dataclass

import numpy as np
import pytest

import flipflow as ff
from flipflow.batch.reasons import FOUND, REFUSED, UNSTABLE
from flipflow.model.quantities import quantity_named
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.periodic.two_event import TwoEventProblem, new_two_event, two_event_states
from flipflow.studies.lane_values import lane_values
from flipflow.studies.quantity_values import MOTION_VALUES, Working
from judge import close

pytestmark = pytest.mark.numerical
FIELDS = (
    "main_mass", "floating_mass", "shear_stiffness", "shear_damping", "stop_stiffness",
    "stop_damping", "clearance", "eccentric_moment", "isolation_stiffness", "isolation_damping",
)  # fmt: skip
SPEEDS = np.array([70.0, 100.0, 130.0, 160.0, 190.0, 210.0])
SPAN = (5.0, 260.0)


def drawn(machine, names, rows, width, seed):
    """Values of fields about a machine's own, up to a factor exp(width), (rows,) each."""
    rng = np.random.default_rng(seed)
    return {
        name: float(getattr(machine, name)) * np.exp(width * rng.uniform(-1.0, 1.0, rows))
        for name in names
    }


def values(machine, columns, name, omega=SPEEDS, branch="from-below", threads=1):
    asked = (quantity_named(name, machine),)
    found, why = lane_values(machine, columns, asked, omega, SPAN, branch, threads)
    return found[name], why


def variant(machine, columns, row):
    return machine.replace(**{name: float(column[row]) for name, column in columns.items()})


@pytest.mark.parametrize("law", ["paper", "compression-only", "undamped-rebound", "elasto-gap"])
def test_a_lane_ends_on_what_a_machine_settles_on_that_is_brought_up_slowly(screen, law):
    machine = screen.replace(stop_law=law)
    columns = drawn(machine, FIELDS, 6, 0.6, seed=3)
    found, why = values(machine, columns, "relative_amplitude", np.array([100.0, 160.0, 200.0]))
    assert (why == FOUND).mean() > 0.9
    for row in range(6):
        alone = variant(machine, columns, row)
        up = ff.sweep(alone, omega=np.linspace(30.0, 200.0, 86)).amplitude("relative")
        for k, at in enumerate((35, 65, 85)):
            if why[row, k] == FOUND:
                assert found[row, k] == pytest.approx(up[at], rel=1e-6)


def test_unequal_gaps_and_a_stop_on_one_side(screen):
    for minus in (4e-3, np.inf):
        machine = screen.replace(clearance_minus=minus)
        columns = drawn(machine, FIELDS, 10, 0.3, seed=5)
        found, why = values(machine, columns, "relative_amplitude", np.array([90.0, 150.0]))
        assert (why == FOUND).mean() > 0.9
        for row in range(10):
            branch = ff.frequency_response(variant(machine, columns, row), omega=SPAN)
            for k, omega in enumerate((90.0, 150.0)):
                orbit = branch.orbit_from_below(omega)
                assert orbit.stable == (why[row, k] == FOUND)
                if orbit.stable:
                    assert found[row, k] == pytest.approx(orbit.amplitude("relative"), rel=1e-8)


@pytest.fixture(scope="module")
def six(screen):
    """Fields of six machines, and the motion of each alone at two speeds."""
    columns = drawn(screen, FIELDS, 6, 0.1, seed=1)
    motions = {}
    for row in range(6):
        alone = variant(screen, columns, row)
        branch = ff.frequency_response(alone, omega=SPAN)
        for k, speed in enumerate((80.0, 150.0)):
            motions[row, k] = Working(alone, branch.orbit_from_below(speed))
    return columns, motions


@pytest.mark.parametrize(
    "name",
    [name for name in MOTION_VALUES if name != "jump_margin"],
)
def test_every_quantity_is_that_of_the_motion_alone(screen, six, name):
    columns, motions = six
    found, why = values(screen, columns, name, np.array([80.0, 150.0]))
    assert (why == FOUND).all()
    for place, motion in motions.items():
        assert found[place] == pytest.approx(motion.value(name), rel=1e-8)


def test_a_lane_that_meets_no_stop_is_not_led_to_a_motion_nearby_that_does():
    """From its neighbour's motion the scalar problem finds one of 39.7 mm that stands alone."""
    screen = ff.load("ffs0827").replace(
        main_mass=234.63124976310314, floating_mass=201.2073112014225,
        eccentric_moment=0.957780936401668, isolation_stiffness=1192.2653025091504,
        isolation_damping=191.67410427173826, shear_stiffness=83831.1732169575,
        shear_damping=245.435507901628, stop_stiffness=1097490.2702883426,
        stop_damping=56.53040534939669, clearance=0.024566787188451296,
    )  # fmt: skip
    other = {
        "floating_mass": 187.52042440730116, "shear_stiffness": 78205.99084802427,
        "stop_stiffness": 1280077.0588340985, "clearance": 0.03046831878514744,
        "eccentric_moment": 0.8411377930584173, "shear_damping": 301.9760990129001,
        "stop_damping": 68.00318879056836,
    }  # fmt: skip
    columns = {name: np.array([getattr(screen, name), value]) for name, value in other.items()}
    speed = np.array([44.81634894528885])
    found, why = values(screen, columns, "relative_amplitude", speed)
    assert (why == FOUND).all()
    branch = ff.frequency_response(screen.replace(**other), (5.0, 60.0))
    alone = branch.orbit_from_below(float(speed[0])).amplitude("relative")
    assert found[1, 0] == pytest.approx(alone, rel=1e-8)


def test_upper_and_lower_motions_are_kept_apart(screen):
    columns = drawn(screen, FIELDS, 20, 0.05, seed=9)
    omega = np.array([195.0, 203.0])
    upper, _ = values(screen, columns, "relative_amplitude", omega, "upper")
    lower, _ = values(screen, columns, "relative_amplitude", omega, "lower")
    several = 0
    for row in range(20):
        branch = ff.frequency_response(variant(screen, columns, row), omega=SPAN)
        for k, speed in enumerate(omega):
            sizes = [o.amplitude("relative") for o in branch.orbits_at(speed) if o.stable]
            several += len(sizes) > 1
            assert upper[row, k] == pytest.approx(max(sizes), rel=1e-8)
            assert lower[row, k] == pytest.approx(min(sizes), rel=1e-8)
    assert several > 5


@pytest.mark.parametrize("law", ["paper", "compression-only", "undamped-rebound", "elasto-gap"])
def test_close_speeds_give_what_speeds_far_apart_do(screen, law):
    machine = screen.replace(stop_law=law)
    columns = drawn(machine, FIELDS, 8, 0.1, seed=4)
    close, far = np.linspace(100.0, 180.0, 161), np.linspace(100.0, 180.0, 9)
    for name in ("relative_amplitude", "stop_force"):
        along, why = values(machine, columns, name, close)
        apart, why_apart = values(machine, columns, name, far)
        both = (why[:, ::20] == FOUND) & (why_apart == FOUND)
        assert both.mean() > 0.9
        np.testing.assert_allclose(along[:, ::20][both], apart[both], rtol=1e-7)


def test_a_lane_that_fails_poisons_no_neighbour(screen):
    columns = drawn(screen, ("clearance", "shear_stiffness"), 30, 0.2, seed=2)
    clean, _ = values(screen, columns, "relative_amplitude")
    columns["shear_stiffness"][7] = -1.0
    columns["clearance"][19] = np.nan
    found, why = values(screen, columns, "relative_amplitude")
    struck = np.isin(np.arange(30), (7, 19))
    assert (why[struck] == REFUSED).all()
    assert np.isnan(found[struck]).all()
    np.testing.assert_array_equal(found[~struck], clean[~struck])


def test_a_stop_without_gap_among_others_changes_no_bit_of_theirs(screen):
    columns = drawn(screen, ("clearance", "shear_damping"), 12, 0.2, seed=8)
    clean, _ = values(screen, columns, "relative_amplitude")
    columns["clearance"][5] = 0.0
    found, why = values(screen, columns, "relative_amplitude")
    others = np.arange(12) != 5
    np.testing.assert_array_equal(found[others], clean[others])
    bonded = variant(screen, columns, 5)
    assert (why[5] == FOUND).all()
    for k, omega in enumerate(SPEEDS):
        own = ff.frequency_response(bonded, omega=SPAN).orbit_from_below(omega)
        assert found[5, k] == pytest.approx(own.amplitude("relative"), rel=1e-8)


def test_a_stop_without_gap_has_its_force(screen):
    """Lanes hold it in their matrices, and one kind of machine stands beside another."""
    columns = {
        "clearance": np.array([0.0, 1e-3, 0.0, 6e-3]),
        "stop_damping": np.array([2e3, 2e3, 8e3, 2e3]),
    }
    found, why = values(screen, columns, "stop_force", np.array([120.0]))
    assert (why == FOUND).all()
    for row in range(4):
        alone = variant(screen, columns, row)
        orbit = ff.frequency_response(alone, (100.0, 120.0)).orbit_from_below(120.0)
        assert found[row, 0] == pytest.approx(Working(alone, orbit).value("stop_force"), rel=1e-8)


def test_a_field_that_is_zero_varies_too(screen):
    machine = screen.replace(stop_damping=0.0)
    columns = {"stop_damping": np.array([0.0, 1e3, 2e3])}
    found, why = values(machine, columns, "relative_amplitude", np.array([150.0]))
    assert (why == FOUND).all()
    for row, damping in enumerate(columns["stop_damping"]):
        branch = ff.frequency_response(screen.replace(stop_damping=float(damping)), omega=SPAN)
        own = branch.orbit_from_below(150.0).amplitude("relative")
        assert found[row, 0] == pytest.approx(own, rel=1e-8)


def test_neighbours_and_threads_change_no_bit(screen):
    columns = drawn(screen, FIELDS, 150, 0.3, seed=4)
    together, why = values(screen, columns, "relative_amplitude")
    on_two, _ = values(screen, columns, "relative_amplitude", threads=2)
    np.testing.assert_array_equal(together, on_two)
    part = {name: column[100:110] for name, column in columns.items()}
    some, why_some = values(screen, part, "relative_amplitude")
    np.testing.assert_array_equal(why[100:110], why_some)
    np.testing.assert_array_equal(together[100:110], some)


def test_where_symmetry_is_lost_the_lane_leans_and_where_the_period_doubles_it_says_so(screen):
    columns = drawn(screen, FIELDS, 100, 1.0, seed=11)
    found, why = values(screen, columns, "relative_amplitude")
    assert set(np.unique(why)) == {FOUND, UNSTABLE}
    assert np.isnan(found[why != FOUND]).all()
    leaning = 0
    for row in range(100):
        alone = variant(screen, columns, row)
        branch = ff.frequency_response(alone, omega=SPAN)
        for k in range(SPEEDS.size):
            if branch.orbit_from_below(SPEEDS[k]).stable or why[row, k] != FOUND:
                continue
            stable = [o for o in ff.periodic_orbits(alone, omega=SPEEDS[k]) if o.stable]
            sizes = np.array([orbit.amplitude("relative") for orbit in stable])
            assert np.abs(sizes / found[row, k] - 1.0).min() < 1e-8
            leaning += 1
    assert leaning > 3


@dataclass(frozen=True)
class Chain:
    """Three masses, two stops, one of them against the ground."""

    gap: float = 1.0
    stiffness: float = 6.0

    def system(self):  # noqa: D102
        K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
        stops = (
            ff.ClearanceSpring([1.0, -1.0, 0.0], self.stiffness, 0.2, self.gap),
            ff.ClearanceSpring([0.0, 0.0, 1.0], self.stiffness, 0.1, 2.0 * self.gap, np.inf),
        )
        return ff.MechanicalSystem(
            np.eye(3), 0.1 * K + 0.05 * np.eye(3), K, stops, ff.HarmonicForce([1.0, 0.0, 0.5])
        )


def test_any_machine_with_a_system_of_its_own():
    columns = {"gap": np.linspace(0.8, 1.2, 5), "stiffness": np.linspace(4.0, 8.0, 5)}
    omega = np.array([0.4, 1.5])
    found, why = values(Chain(), columns, "amplitude[0]", omega)
    assert (why == FOUND).mean() > 0.5
    for row in range(5):
        alone = Chain(float(columns["gap"][row]), float(columns["stiffness"][row]))
        up = ff.sweep(alone, omega=np.linspace(0.1, 1.5, 71)).amplitude(0)
        for k, at in enumerate((15, 70)):
            if why[row, k] == FOUND:
                assert found[row, k] == pytest.approx(up[at], rel=1e-6)


def test_a_jump_on_the_way_leads_where_it_leads_however_far_the_speed_ahead():
    """Folds at 0.43 rad/s leave the motion at 1.41 as it is; which one was found hung on phases."""
    stop = ff.ClearanceSpring([1.0], 107.646, 8.957, -0.623, np.inf, law="compression-only")
    second = ff.ClearanceSpring([1.0], 7.258, 2.548, 8.052, law="undamped-rebound")
    push = -1.03 * (0.8581 + 0.5135j), 1.03 * (-0.1172 + 0.5399j), 1.03 * (-0.0903 + 0.1786j)
    speeds = [0.3117, 1.4094]
    for phase in (0.0, 0.5, 1.0, 3.5, 4.0):
        first, third = (
            ff.HarmonicForce([push[k] * np.exp(1j * order * phase)], order)
            for k, order in enumerate((1, 3))
        )
        base = ff.MovingBase(push[2] * np.exp(2j * phase), [0.01675], [3.35e-4], 2)
        machine = ff.MechanicalSystem(
            [[0.6795]], [[0.04606]], [[0.7333]], (stop, second), (first, third, base),
            static_force=[-4.1207],
        )  # fmt: skip
        expected = ff.frequency_response(machine, (0.15, 1.4094)).orbit_from_below(1.4094)
        found = ff.study(machine, {"forcing": [1.0, 1.001]}, "amplitude[0]", speeds)
        close(f"at {phase}", found.values["amplitude[0]"][0, 0, 1], expected.amplitude(0), rel=1e-6)


@pytest.mark.parametrize(("law", "damping"), [("paper", 0.0), ("undamped-rebound", 332.2)])
def test_a_variant_is_on_its_own_motion_from_below_whatever_the_nominal_machine_does(law, damping):
    """With a smaller gap it is carried on beyond the resonance; the nominal machine has jumped."""
    nominal = ff.FlipFlowScreen(
        main_mass=98.5, floating_mass=19.82, eccentric_moment=0.18564, isolation_stiffness=19506.0,
        isolation_damping=617.8, shear_stiffness=22023.0, shear_damping=129.3,
        stop_stiffness=83062.0, stop_damping=damping, clearance=8.626e-3, stop_law=law,
    )  # fmt: skip
    gaps = np.array([5.5e-3, 6e-3, 6.5e-3, 7.5e-3, 8.626e-3])
    found = ff.study(nominal, {"clearance": gaps}, "relative_amplitude", 49.8652)
    alone = [
        ff.frequency_response(nominal.replace(clearance=gap), (5.0, 80.0)).orbit_from_below(49.8652)
        for gap in gaps.tolist()
    ]
    wanted = [orbit.amplitude("relative") for orbit in alone]
    assert max(wanted) > 2.0 * min(wanted)
    close("from below", found.values["relative_amplitude"][:, 0, 0], wanted, rel=1e-8)


def test_where_no_motion_of_one_turn_is_stable_a_lane_goes_on_slowly():
    """Let go at 1.14582 from the last motion it settles on .0354, to which nothing leads there."""
    stop = ff.ClearanceSpring([1.0], 13.92327692720007, 0.0, 0.07221739090366394, law="elasto-gap")
    base = ff.MovingBase(0.18844248372657238, [1.44227879], [0.07211394])
    machine = ff.MechanicalSystem([[6.95462496]], [[0.17959443]], [[1.44227879]], (stop,), base)
    expected = ff.frequency_response(machine, (0.1, 1.716)).orbit_from_below(1.14582)
    close("branch", expected.amplitude(0), 0.249514, rel=1e-5)
    for speeds in ([1.14582], [0.4125, 1.14582]):
        found = ff.study(machine, {"forcing": [1.0, 1.001]}, "amplitude[0]", speeds)
        close(f"{speeds}", found.values["amplitude[0]"][0, 0, -1], 0.249514, rel=1e-5)


def test_a_machine_that_always_touches_comes_from_below_to_a_single_speed():
    """From rest it settled into a motion of 0.0595 m beside that of 0.0234."""
    stops = (
        ff.ClearanceSpring([1.0, 0.0], 94.58, 8.193, -2.06, np.inf, law="undamped-rebound"),
        ff.ClearanceSpring([-1.0, 1.0], 288.4, 9.396, -0.0377, np.inf, law="undamped-rebound"),
        ff.ClearanceSpring([1.0, -1.0], 5.581, 0.8118, -0.0493, np.inf),
    )
    machine = ff.MechanicalSystem(
        np.diag([1.4225, 0.4188]), [[0.9565, -0.6724], [-0.6724, 0.6724]],
        [[3.739, -2.6285], [-2.6285, 2.6285]], stops, ff.HarmonicForce([-0.9924 - 0.1233j, 0.0]),
    )  # fmt: skip
    below = ff.frequency_response(machine, (0.23, 6.0)).orbit_from_below(5.48)
    found = ff.study(machine, {"forcing": [1.0, 1.001]}, "amplitude[0]", [5.48])
    close("at once", found.values["amplitude[0]"][0, 0, 0], below.amplitude(0), rel=1e-7)


@pytest.mark.parametrize("law", ["compression-only", "elasto-gap"])
def test_a_small_motion_far_from_zero_is_as_exact_as_one_about_it(law):
    K = np.array([[2.0, -1.0], [-1.0, 1.5]])
    static = np.array([1200.0, 0.0])
    gap = float(np.linalg.solve(K, static)[0])
    stop = ff.ClearanceSpring([1.0, 0.0], 100.0, 5.0, gap, np.inf, law=law)
    machine = ff.MechanicalSystem(
        np.diag([1.0, 0.7]), 0.05 * K, K, [stop], ff.HarmonicForce([0.0, 1e-3]), static_force=static
    )
    omega = np.array([0.5, 0.9, 2.2])
    found = ff.study(machine, {"forcing": np.array([0.9, 1.0])}, "amplitude[0]", omega)
    branch = ff.frequency_response(machine, (0.2, 3.0))
    own = [branch.orbit_from_below(at).amplitude(0) for at in omega]
    assert found.values["amplitude[0]"][1, 0] == pytest.approx(own, rel=1e-6)


def test_a_machine_that_rests_on_a_stop_is_brought_up_from_below():
    stops = [
        ff.ClearanceSpring([1.0], 1.0, 0.02, 0.5, np.inf, law="elasto-gap"),
        ff.ClearanceSpring([1.0], 10.0, 0.0, 1.35, 1.0),
    ]
    machine = ff.MechanicalSystem(
        [[1.0]], [[0.04]], [[1.0]], stops, ff.HarmonicForce([0.03]), static_force=[2.0]
    )
    branch = ff.frequency_response(machine, (0.3, 4.0))
    for omega in np.linspace(1.53, 1.79, 9):  # between the folds, each speed by itself
        found = ff.study(machine, {"forcing": np.array([0.99, 1.0])}, "amplitude[0]", omega)
        own = branch.orbit_from_below(omega).amplitude(0)
        assert found.values["amplitude[0]"][1, 0, 0] == pytest.approx(own, rel=1e-6)


def test_the_only_motion_of_the_scalar_problem_has_no_other_beside_it():
    """Of screens with hard, hardly damped stops F passes through its poles between two samples."""
    rng, told = np.random.default_rng(77), 0
    states, shares = np.empty((8, 4)), np.empty(8)
    for number in range(300):
        screen, speed = hard_screen(rng)
        solver = ExactSolver(screen.system(), half_turn=True)
        for omega in (speed * rng.uniform(0.3, 1.6, 3)).tolist():
            share, _ = TwoEventProblem(solver.machine, solver.flow).only(omega)
            if np.isnan(share):
                continue
            told += 1
            touch = new_two_event(solver.machine)
            asked = solver.machine, solver.flow, touch, omega, 2000, states, shares
            for k in range(two_event_states(*asked)):
                r, _ = solver.residual(states[k], omega)
                repeats = np.abs(r).max() < 1e-7 * np.abs(states[k]).max()
                other = abs(shares[k] - share) > 1e-6
                assert not (repeats and other), f"screen {number} at {omega}: {shares[k]}"
    assert told > 400


def hard_screen(rng):
    """A screen with stops up to a hundred times as hard as its shear springs, and its speed."""
    main, speed = np.exp(rng.uniform(6.0, 8.5)), rng.uniform(60.0, 100.0)
    floating = main * rng.uniform(0.12, 0.6)
    total, reduced = main + floating, main * floating / (main + floating)
    isolation = total * rng.uniform(10.0, 25.0) ** 2
    shear = reduced * (rng.uniform(0.6, 1.5) * speed) ** 2
    stop = shear * 10.0 ** rng.uniform(0.0, 2.0)
    screen = ff.FlipFlowScreen(
        main_mass=main, floating_mass=floating, eccentric_moment=rng.uniform(1e-3, 6e-3) * total,
        isolation_stiffness=isolation,
        isolation_damping=0.1 * np.sqrt(isolation * total),
        shear_stiffness=shear,
        shear_damping=2.0 * 10.0 ** rng.uniform(-3.0, -1.0) * np.sqrt(shear * reduced),
        stop_stiffness=stop,
        stop_damping=2.0 * 10.0 ** rng.uniform(-3.0, 0.0) * np.sqrt(stop * reduced),
        clearance=10.0 ** rng.uniform(-3.5, -1.9),
    )  # fmt: skip
    return screen, speed


def test_two_motions_close_to_each_other_beside_a_motion_without_contact_are_seen():
    """A stop four hundred times as hard as the shear springs: D falls by decades on the way."""
    screen = ff.FlipFlowScreen(
        main_mass=2030.62267406446, floating_mass=652.8599114944125,
        eccentric_moment=2.7243591371577893, isolation_stiffness=1361427.5380569184,
        isolation_damping=6044.308967844074, shear_stiffness=7761829.187271713,
        shear_damping=583.512508981107, stop_stiffness=3077249436.842557,
        stop_damping=1674303.4615687293, clearance=0.007752872571855751,
    )  # fmt: skip
    omega = 152.989320707397
    found = ff.study(screen, {"clearance": [screen.clearance] * 2}, "relative_amplitude", omega)
    branch = ff.frequency_response(screen, (0.3 * omega, 1.001 * omega))
    wanted = branch.orbit_from_below(omega).amplitude("relative")
    close("from below", found.values["relative_amplitude"][0, 0, 0], wanted, rel=1e-8)


@pytest.mark.parametrize("share", [1e-6, 1e-5, 1e-3])
def test_just_below_its_fold_a_lane_has_not_jumped(screen, share):
    fold = ff.frequency_response(screen, SPAN).folds[0]
    orbit = ff.frequency_response(screen, SPAN).orbit_from_below((1.0 - share) * fold.omega)
    asked = {"clearance": [screen.clearance] * 2}
    found = ff.study(screen, asked, "relative_amplitude", orbit.omega, sampling="list")
    amplitude = found.values["relative_amplitude"][0, 0, 0]
    close("from below", amplitude, orbit.amplitude("relative"), rel=1e-6)
