"""Derivatives of many machines in one call: those of each motion alone."""

import dataclasses

import numpy as np
import pytest

import flipflow as ff
from flipflow.batch.lane_columns import lane_columns
from flipflow.batch.lane_path import CONVERGED
from flipflow.batch.reasons import FOUND
from flipflow.batch.slope_readings import SlopesAsked
from flipflow.batch.solutions import nothing_asked, solve_lanes, solve_slopes
from flipflow.batch.variants import batches
from flipflow.model.parameters import with_values
from flipflow.model.quantities import quantities_for, quantity_named
from flipflow.studies.lane_values import lane_values, on_lanes, slope_key, with_own
from flipflow.studies.quantity_values import MOTION_VALUES

pytestmark = [pytest.mark.numerical, pytest.mark.usefixtures("slopes_once")]
FIELDS = (
    "main_mass", "floating_mass", "shear_stiffness", "shear_damping", "stop_stiffness",
    "stop_damping", "clearance", "eccentric_moment", "isolation_stiffness", "isolation_damping",
)  # fmt: skip
SPAN = (5.0, 260.0)
LAWS = ("paper", "compression-only", "undamped-rebound", "elasto-gap")


def drawn(machine, names, rows, seed, width=0.1):
    rng = np.random.default_rng(seed)
    return {
        name: float(getattr(machine, name)) * rng.uniform(1.0 - width, 1.0 + width, rows)
        for name in names
    }


def read(machine, columns, quantities, omega, names):
    return lane_values(
        machine, columns, quantities, np.atleast_1d(omega), SPAN, "from-below", names=names
    )


def same(found, wanted, rtol, unit=1.0, floor=1e-16):
    """Equal but for rounding of the largest derivative, for changes ``unit`` of the parameters."""
    size = np.abs((unit * wanted)[np.isfinite(wanted)]).max(initial=0.0)
    np.testing.assert_allclose(unit * found, unit * wanted, rtol=rtol, atol=1e-10 * size + floor)


def told(orbit, quantity, names):
    """Derivatives of a motion alone; NaN where it has another one to each side."""
    try:
        return np.asarray(orbit.sensitivity(quantity, list(names)))
    except ff.IncompleteError:
        return np.full(len(names), np.nan)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("gap", [None, 4e-3])
def test_every_quantity_of_a_screen(screen, law, gap):
    machine = screen.replace(stop_law=law, clearance_minus=gap)
    names = (*FIELDS, "normal_stiffness", *(["clearance_minus"] if gap else []))
    asked = [quantity_named(name, machine) for name in MOTION_VALUES]
    asked = [one for one in asked if on_lanes(machine, one)]
    columns = drawn(machine, FIELDS, 2, seed=7)
    found, why = read(machine, columns, asked, [80.0, 150.0], names)
    assert (why == FOUND).all()
    for row in range(2):
        alone = machine.replace(**{name: float(column[row]) for name, column in columns.items()})
        unit = np.array([getattr(alone, name) for name in names])
        branch = ff.frequency_response(alone, omega=SPAN)
        for k, omega in enumerate((80.0, 150.0)):
            orbit = branch.orbit_from_below(omega)
            for one in asked:
                wanted = told(orbit, one.name, names)
                same(found[slope_key(one.name)][row, k], wanted, rtol=1e-7, unit=unit)


def solved(machine, columns, omega, names):
    """Motions and their derivatives, those of multipliers among them."""
    system, P = machine.system(), len(names)
    (batch,), _ = batches(machine, columns)
    changes = lane_columns(machine, columns, batch, names)
    asked = nothing_asked(system.size, omega.size)
    found, _ = solve_lanes(batch, omega, asked)
    none = np.zeros((1, omega.size, 0, P), complex)
    wanted = SlopesAsked(
        linear=np.zeros((1, 0, 3, system.size, P)), along=none, across=none, means=False,
        contacts=True, multipliers=True, even=changes.keeps_mirror,
        corner=np.zeros(len(system.springs), np.int64),
    )  # fmt: skip
    return found, solve_slopes(batch, changes.solved, omega, asked, wanted, found)


@pytest.mark.parametrize("gap", [None, 4e-3])
def test_states_multipliers_and_shares_of_contact(screen, gap):
    machine = screen.replace(clearance_minus=gap)
    columns, omega = drawn(machine, FIELDS, 3, seed=8), np.array([120.0, 150.0])
    found, slopes = solved(machine, columns, omega, FIELDS)
    for row in range(3):
        alone = machine.replace(**{name: float(column[row]) for name, column in columns.items()})
        branch = ff.frequency_response(alone, omega=SPAN)
        for k, at in enumerate(omega):
            orbit = branch.orbit_from_below(at)
            same(slopes.state[row, k], orbit.sensitivity("state", list(FIELDS)), rtol=1e-8)
            share = orbit.sensitivity(("contact_share", 0), list(FIELDS))
            same(slopes.share[row, k, 0], share, rtol=1e-8)
            own = orbit.sensitivity("multipliers", list(FIELDS))
            for mu, slope in zip(found.multiplier[row, k], slopes.multiplier[row, k], strict=True):
                same(slope, own[np.abs(orbit.multipliers - mu).argmin()], rtol=1e-7)


def drawn_system(rng, omega):
    """One to three masses, one or two stops that they meet, each of any law, some without gap."""
    size, stops = int(rng.integers(1, 4)), int(rng.integers(1, 3))
    A = rng.normal(size=(size, size))
    M, K = np.diag(rng.uniform(0.5, 3.0, size)), A @ A.T + np.diag(rng.uniform(0.2, 2.0, size))
    C = 0.05 * K + 0.02 * M + (0.02 * rng.normal(size=(size, size)) if rng.random() < 0.3 else 0.0)
    force = rng.normal(size=size) * np.exp(1j * rng.uniform(0.0, 6.0, size))
    excitation = [ff.HarmonicForce(tuple(force))]
    if rng.random() < 0.4:
        excitation.append(ff.HarmonicForce(tuple(0.3 * force), order=int(rng.integers(2, 4))))
    free = np.abs(np.linalg.solve(K - omega**2 * M + 1j * omega * C, force))
    springs = []
    for _ in range(stops):
        direction, stiffness = rng.normal(size=size), float(10.0 ** rng.uniform(0.0, 2.0))
        gap = float(rng.uniform(0.3, 0.9) * np.abs(direction) @ free)
        other = float(rng.choice([gap, np.inf, rng.uniform(0.5, 1.5) * gap]))
        if rng.random() < 0.15:
            gap = other = 0.0
        damping = float(rng.uniform(0.01, 0.5) * np.sqrt(stiffness))
        law = str(rng.choice(LAWS))
        springs.append(
            ff.ClearanceSpring(tuple(direction), stiffness, damping, gap, other, law=law)
        )
    still = tuple(0.2 * free * rng.normal(size=size)) if rng.random() < 0.3 else None
    return ff.MechanicalSystem(M, C, K, tuple(springs), tuple(excitation), static_force=still)


def parameters_of(machine):
    """The force and numbers of all stops, gaps where there are any."""
    names = ["forcing"]
    for j, spring in enumerate(machine.springs):
        names += [f"springs[{j}].stiffness", f"springs[{j}].damping"]
        names += [f"springs[{j}].clearance"] if spring.clearance > 0.0 else []
    return names


@pytest.fixture(scope="module")
def compared():
    """Of each seed how many derivatives were compared, and whether a stop was touched."""
    return {}


@pytest.mark.parametrize("seed", range(30))
def test_machines_that_nobody_chose(seed, compared):
    rng = np.random.default_rng(seed)
    omega = float(rng.uniform(0.3, 3.0))
    machine = drawn_system(rng, omega)
    names = parameters_of(machine)
    asked = [one for one in quantities_for(machine).values() if on_lanes(machine, one)]
    found, why = lane_values(
        machine, {"forcing": np.array([1.0, 1.1])}, asked, np.array([omega]), (0.1, 4.0),
        "from-below", names=names,
    )  # fmt: skip
    size = next(one for one in asked if one.part == "amplitude")
    compared[seed] = 0
    for row in np.flatnonzero(why[:, 0] == FOUND):  # others reach no motion of one period
        alone = with_values(machine, {"forcing": (1.0, 1.1)[row]})
        value = found[size.name][row, 0]
        orbits = [one for one in ff.periodic_orbits(alone, omega=omega) if one.stable]
        orbit = min(orbits, key=lambda one: abs(one.amplitude(size.coordinate) - value))
        if orbit.amplitude(size.coordinate) != pytest.approx(value, rel=1e-7):
            continue  # a search may miss a motion
        factor = np.where(np.array(names) == "forcing", (1.0, 1.1)[row], 1.0)
        for one in asked:
            wanted = told(orbit, one.name, names)
            slope = found[slope_key(one.name)][row, 0]
            # A lane is read off at its last iterate, a Newton step of up to CONVERGED away.
            same(slope * factor, wanted, rtol=1e-6, floor=CONVERGED)
            compared[seed] += np.isfinite(wanted).sum() * bool(orbit.touches)


def multipliers_compared(seed):
    """How many multipliers of a drawn machine that touches a stop move as those of it alone."""
    rng = np.random.default_rng([seed, 1])
    omega = float(rng.uniform(0.3, 3.0))
    machine = drawn_system(rng, omega)
    names = parameters_of(machine)
    columns = with_own(machine, {"forcing": np.ones(1)}, names)
    found, slopes = solved(machine, columns, np.array([omega]), names)
    if found.reason[0, 0] != FOUND:
        return 0  # reaches no motion of one period
    compared, state = 0, found.state[0, 0]
    for orbit in ff.periodic_orbits(machine, omega=omega):
        if not np.allclose(orbit.state, state, rtol=0.0, atol=1e-7 * np.abs(state).max()):
            continue
        own = told(orbit, "multipliers", names)
        for mu, slope in zip(found.multiplier[0, 0], slopes.multiplier[0, 0], strict=True):
            place = np.abs(orbit.multipliers - mu).argmin()
            if np.isfinite(own[place]).all():
                size = np.abs(own).max()
                np.testing.assert_allclose(slope, own[place], rtol=0.0, atol=1e-9 * size)
                compared += bool(orbit.touches)
    return compared


def test_multipliers_of_machines_that_nobody_chose():
    assert sum(multipliers_compared(seed) for seed in range(16)) >= 30


def test_enough_of_them_touch_a_stop(compared):
    if len(compared) == 30:  # all have run in this process
        assert sum(count > 0 for count in compared.values()) >= 20


def test_what_has_another_derivative_to_each_side_has_none(screen):
    even = screen.replace(clearance_minus=screen.clearance)
    asked = [quantity_named(name, even) for name in ("relative_amplitude", "stop_force")]
    columns = {"stop_stiffness": np.array([screen.stop_stiffness])}
    found, _ = read(even, columns, asked, 150.0, ("stop_stiffness", "clearance_minus"))
    assert np.isfinite(found[slope_key("relative_amplitude")]).all()
    assert np.isnan(found[slope_key("stop_force")]).tolist() == [[[False, True]]]


def test_the_middle_of_an_even_motion_has_a_kink(screen):
    """The weight moves it to one side, and would to the other."""
    even = screen.replace(deck_angle=0.0, clearance_measured="drawn")
    names = ("deck_angle", "stop_stiffness")
    asked = [quantity_named("relative_offset", even)]
    columns = {"stop_stiffness": np.array([screen.stop_stiffness])}
    found, _ = read(even, columns, asked, 150.0, names)
    assert np.isnan(found["d_relative_offset"][0, 0]).tolist() == [True, False]
    orbit = ff.frequency_response(even, omega=SPAN).orbit_from_below(150.0)
    with pytest.raises(ff.IncompleteError, match="to each side"):
        orbit.sensitivity("relative_offset", ["deck_angle"])


@dataclasses.dataclass(frozen=True)
class TwoOrders:
    """x = cos theta - cos 2 theta without contact: two valleys are as low."""

    damping: float = 0.1

    def system(self):  # noqa: D102
        w = 0.7
        first = ff.HarmonicForce([1.0 - w**2 + 0.1j * w])
        second = ff.HarmonicForce([-(1.0 - 4.0 * w**2 + 0.2j * w)], order=2)
        return ff.MechanicalSystem(
            [[1.0]], [[self.damping]], [[1.0]],
            (ff.ClearanceSpring([1.0], 5.0, 0.1, 50.0, 50.0),), (first, second),
        )  # fmt: skip


def test_two_extremes_as_high_that_move_differently_have_none():
    machine = TwoOrders()
    asked = [quantities_for(machine)["amplitude[0]"]]
    found, why = lane_values(
        machine, {"damping": np.array([0.1])}, asked, np.array([0.7]), (0.1, 2.0), "from-below",
        names=("damping",),
    )  # fmt: skip
    assert why[0, 0] == FOUND
    assert np.isnan(found["d_amplitude[0]"][0, 0, 0])


def test_means_behind_a_heavily_damped_contact(screen):
    own = screen.replace(stop_damping=1e8)
    steps = own.clearance * (1.0 + 1e-3 * np.array([-2.0, -1.0, 0.0, 1.0, 2.0]))
    found = ff.study(
        own, {"clearance": steps}, "shear_piece_power", 150.0, sampling="list",
        derivatives=["clearance"],
    )  # fmt: skip
    v = found.values["shear_piece_power"][:, 0, 0]
    wanted = (v[0] - 8.0 * v[1] + 8.0 * v[3] - v[4]) / (12.0 * 1e-3 * own.clearance)
    slope = found.derivatives["shear_piece_power"][2, 0, 0, 0]
    assert slope == pytest.approx(wanted, rel=1e-6)
    orbit = ff.frequency_response(own, omega=SPAN).orbit_from_below(150.0)
    alone = orbit.sensitivity("shear_piece_power", ["clearance"])[0]
    assert alone == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("beside", [1.0, 1.0 - 2e-16, 1.0 + 2e-16, 1.0 - 1e-12])
def test_a_motion_that_grazes_has_none_under_a_law_with_a_corner(beside):
    def machine(law, gap):
        return ff.MechanicalSystem(
            [[1.0]], [[0.1]], [[1.0]],
            (ff.ClearanceSpring([1.0], 0.2, 0.05, gap, np.inf, law=law),),
            ff.HarmonicForce([0.5]),
        )  # fmt: skip

    free = abs(0.5 / complex(1.0 - 0.7**2, 0.1 * 0.7))
    for law, known in (("paper", True), ("compression-only", False)):
        grazing = machine(law, free * beside)
        asked = [one for one in quantities_for(grazing).values() if one.part == "amplitude"]
        rough = [quantity_named(name, grazing) for name in ("contact_share", "largest_multiplier")]
        asked += rough
        found, why = lane_values(
            grazing, {"forcing": np.ones(1)}, asked, np.array([0.7]), (0.1, 2.0), "from-below",
            names=("forcing",),
        )  # fmt: skip
        assert why[0, 0] == FOUND
        assert found[asked[0].name][0, 0] == pytest.approx(free, rel=1e-12)
        assert np.isfinite(found[slope_key(asked[0].name)][0, 0, 0]) == known
        assert all(np.isnan(found[slope_key(one.name)]).all() for one in rough)


def test_small_multipliers_without_a_derivative_leave_the_largest_its_own():
    """They lie so close to zero, and to each other, that they count as one."""
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    stop = ff.ClearanceSpring([1.0, 0.0, 0.0], 5.0, 0.3, 0.3, np.inf)
    chain = ff.MechanicalSystem(np.eye(3), 0.5 * K, K, (stop,), ff.HarmonicForce([0.0, 0.0, 1.0]))
    name = "springs[0].stiffness"
    asked = quantity_named("largest_multiplier", chain)
    found, why = read(chain, {"forcing": np.array([1.0, 1.1])}, [asked], [0.1, 0.2], [name])
    assert (why == FOUND).all()
    for k, omega in enumerate((0.1, 0.2)):
        orbit = ff.frequency_response(chain, (0.05, 0.5)).orbit_from_below(omega)
        (own,) = orbit.sensitivity("largest_multiplier", [name])
        assert found[slope_key(asked.name)][0, k, 0] == pytest.approx(own, rel=1e-7)


@pytest.fixture(scope="module")
def loaded(screen):
    """A screen on an inclined deck, and three loads."""
    machine = screen.replace(deck_angle=0.3)
    loads = (
        ff.Load(name="empty"), ff.Load(name="full", floating_mass=120.0, main_mass=20.0),
        ff.Load(name="soft", stiffness_factor=0.9, damping_factor=1.2, floating_mass=40.0),
    )  # fmt: skip
    return machine, loads


@pytest.mark.parametrize("name", ["shear_stiffness", "floating_mass", "deck_angle", "clearance"])
def test_a_study_differentiates_under_every_load(loaded, name):
    machine, loads = loaded
    own = getattr(machine, name)
    steps = own * (1.0 + 1e-3 * np.array([-2.0, -1.0, 0.0, 1.0, 2.0]))
    quantities = ("relative_amplitude", "stop_force", "foundation_force", "shear_strain")
    found = ff.study(
        machine, {name: steps}, quantities, [80.0, 150.0], load_cases=loads, sampling="list",
        derivatives=[name],
    )  # fmt: skip
    assert found.parameters == (name,)
    for one in quantities:
        v, slope = found.values[one], found.derivatives[one]
        assert slope.shape == (5, 3, 2, 1)
        differences = (v[0] - 8.0 * v[1] + 8.0 * v[3] - v[4]) / (12.0 * 1e-3 * own)
        np.testing.assert_allclose(
            slope[2, :, :, 0], differences, rtol=2e-6, atol=1e-9 * np.abs(v[2]).max() / own
        )


def test_a_store_holds_derivatives_of_parameters_that_do_not_vary(screen, tmp_path):
    vary = {"clearance": np.linspace(5e-3, 7e-3, 70)}
    asked = {"derivatives": ["clearance", "stop_stiffness"]}
    kept = ff.study(
        screen, vary, "relative_amplitude", 150.0, store=tmp_path / "kept.zarr", **asked
    )
    opened = ff.open_study(tmp_path / "kept.zarr")
    plain = ff.study(screen, vary, "relative_amplitude", 150.0, threads=1, **asked)
    for one in (kept, opened):
        assert one.parameters == ("clearance", "stop_stiffness")
        np.testing.assert_array_equal(
            one.derivatives["relative_amplitude"], plain.derivatives["relative_amplitude"]
        )
    with pytest.raises(ff.StoreError, match="derivatives"):
        ff.study(screen, vary, "relative_amplitude", 150.0, store=tmp_path / "kept.zarr")
    table = opened.to_xarray()
    assert table["d_relative_amplitude"].dims == ("sample", "case", "omega", "parameter")
    assert table["d_relative_amplitude"].attrs["units"] == "m per parameter_unit"
    assert table["parameter_unit"].values.tolist() == ["m", "N/m"]
    ff.save(opened, tmp_path / "kept.csv")
    heads = (tmp_path / "kept.csv").read_text().splitlines()[0]
    assert "_clearance [m per m],d_" in heads
    assert "_stop_stiffness [m per N/m]" in heads
    with pytest.raises(ff.InputError, match=r"ff\.open_study opens it"):
        ff.open_result(tmp_path / "kept.zarr")


@pytest.mark.parametrize(
    ("quantity", "names", "told"),
    [
        ("omega_lb", ["clearance"], "ask an orbit or a fold"),
        ("relative_amplitude", ["colour"], "derivatives = 'colour'"),
        ("relative_amplitude", ["omega"], "derivatives = 'omega': choose one of 'main_mass'"),
        ("relative_amplitude", "clearance", "in a list"),
        ("relative_amplitude", ["clearance", "clearance"], "twice"),
        ("relative_amplitude", ["clearance_minus"], "finite value"),
    ],
)
def test_what_cannot_be_differentiated_is_said(screen, quantity, names, told):
    with pytest.raises(ff.InputError, match=told):
        ff.study(screen, {"clearance": (5e-3, 7e-3)}, quantity, 150.0, derivatives=names)


def test_names_that_arrays_of_a_study_have_are_refused():
    two = ff.MechanicalSystem(
        np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]],
        (ff.ClearanceSpring((1.0, -1.0), 20.0, 0.2, 0.2),), ff.HarmonicForce((1.0, 0.0)),
        coordinates={"x": (1.0, 0.0), "d_x": (0.0, 1.0)},
    )  # fmt: skip
    asked = ["x_amplitude", "d_x_amplitude"]
    ff.study(two, {"forcing": np.ones(2)}, asked, 1.2, sampling="list")
    with pytest.raises(ff.InputError, match="derivatives of x_amplitude are called"):
        ff.study(two, {"forcing": np.ones(2)}, asked, 1.2, sampling="list", derivatives=["forcing"])
    own = dataclasses.make_dataclass(
        "Own", [("parameter", float, 0.1)], frozen=True,
        namespace={"system": lambda self: TwoOrders(self.parameter).system()},
    )  # fmt: skip
    with pytest.raises(ff.InputError, match="name the field otherwise"):
        ff.study(own(), {"parameter": np.array([0.1, 0.2])}, "amplitude[0]", 0.7, sampling="list")


@dataclasses.dataclass(frozen=True)
class Kinked:
    """Its stiffness has a kink where ``turn`` is 1."""

    turn: float = 1.0
    mass: float = 1.3

    def system(self):  # noqa: D102
        return ff.MechanicalSystem(
            [[self.mass**3]], [[0.1]], [[1.0 + abs(self.turn - 1.0)]],
            (ff.ClearanceSpring((1.0,), 5.0, 0.3, 0.3),), ff.HarmonicForce((1.0,)),
        )  # fmt: skip


@pytest.mark.parametrize("turn", [1.0, 1.01])
def test_a_machine_has_no_derivative_at_a_kink_of_its_own_but_one_beside_it(turn):
    machine = Kinked(turn=turn)
    masses = np.array([1.2, 1.3])
    found = ff.study(
        machine, {"mass": masses}, "amplitude[0]", 0.9, sampling="list",
        derivatives=["turn", "mass"],
    )  # fmt: skip
    slopes = found.derivatives["amplitude[0]"][:, 0, 0]
    assert np.isfinite(slopes).all(axis=0).tolist() == [turn != 1.0, True]
    orbit = ff.frequency_response(machine, (0.2, 2.0)).orbit_from_below(0.9)
    if turn == 1.0:
        with pytest.raises(ff.InputError, match="kink"):
            orbit.sensitivity("amplitude[0]", ["turn"])
    else:
        np.testing.assert_allclose(
            slopes[1], orbit.sensitivity("amplitude[0]", ["turn", "mass"]), rtol=1e-8
        )


def test_a_study_file_names_what_quantities_are_differentiated_by(command, tmp_path):
    written = tmp_path / "study.toml"
    written.write_text(
        'format = 1\nmachine = "ffs0827"\n[vary]\nclearance = "+-5 %"\n[study]\n'
        'quantities = ["relative_amplitude"]\nspeed = "150 rad/s"\nsamples = 8\n'
        'derivatives = ["stops.clearance", "shear_stiffness"]\n'
    )
    code, _, err = command("study", written, "--store", tmp_path / "s.zarr", "-o", tmp_path / "r")
    assert code == 0, err
    found = ff.open_study(tmp_path / "s.zarr")
    assert found.parameters == ("clearance", "shear_stiffness")
    assert np.isfinite(found.derivatives["relative_amplitude"]).all()
