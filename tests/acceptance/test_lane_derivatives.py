"""Derivatives of many machines in one call: those of each motion alone."""

import numpy as np
import pytest

import flipflow as ff
from flipflow.batch.lane_columns import lane_columns
from flipflow.batch.reasons import FOUND
from flipflow.batch.slope_readings import SlopesAsked
from flipflow.batch.solutions import nearby_motions, nothing_asked, solve_lanes, solve_slopes
from flipflow.batch.variants import batches
from flipflow.model.quantities import quantities_for, quantity_named
from flipflow.studies.lane_values import lane_values, on_lanes, slope_key
from flipflow.studies.quantity_values import MOTION_VALUES

pytestmark = pytest.mark.numerical
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


@pytest.mark.parametrize("gap", [None, 4e-3])
def test_states_multipliers_and_shares_of_contact(screen, gap):
    machine = screen.replace(clearance_minus=gap)
    columns, omega = drawn(machine, FIELDS, 3, seed=8), np.array([120.0, 150.0])
    (batch,), _ = batches(machine, columns)
    asked = nothing_asked(2, 2)
    system, changes = machine.system(), lane_columns(machine, columns, batch, FIELDS)
    found, _ = solve_lanes(batch, omega, asked, nearby_motions(system, system, omega))
    none = np.zeros((1, 2, 0, len(FIELDS)), complex)
    wanted = SlopesAsked(
        linear=np.zeros((1, 0, 3, 2, len(FIELDS))), along=none, across=none, means=False,
        multipliers=True, even=changes.keeps_mirror, corner=np.zeros(1, np.int64),
    )  # fmt: skip
    slopes = solve_slopes(batch, changes.solved, omega, asked, wanted, found)
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


def drawn_system(rng):
    """One to three masses, one or two stops of any law, some without gap or with a static force."""
    size, stops = int(rng.integers(1, 4)), int(rng.integers(1, 3))
    A = rng.normal(size=(size, size))
    M, K = np.diag(rng.uniform(0.5, 3.0, size)), A @ A.T + np.diag(rng.uniform(0.2, 2.0, size))
    cross = 0.02 * rng.normal(size=(size, size)) if rng.random() < 0.3 else 0.0
    springs = []
    law = str(rng.choice(LAWS))
    for _ in range(stops):
        gap, stiffness = float(rng.uniform(0.1, 1.0)), float(10.0 ** rng.uniform(0.0, 2.0))
        other = float(rng.choice([gap, np.inf, rng.uniform(0.1, 1.0)]))
        if rng.random() < 0.15:
            gap = other = 0.0
        damping = float(rng.uniform(0.01, 0.5) * np.sqrt(stiffness))
        direction = tuple(rng.normal(size=size))
        springs.append(ff.ClearanceSpring(direction, stiffness, damping, gap, other, law=law))
    force = rng.normal(size=size) * np.exp(1j * rng.uniform(0.0, 6.0, size))
    still = tuple(0.2 * rng.normal(size=size)) if rng.random() < 0.3 else None
    return ff.MechanicalSystem(
        M, 0.05 * K + 0.02 * M + cross, K, tuple(springs), ff.HarmonicForce(tuple(force)),
        static_force=still,
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(24))
def test_machines_that_nobody_chose(seed):
    rng = np.random.default_rng(seed)
    machine, omega = drawn_system(rng), float(rng.uniform(0.3, 3.0))
    names = ["forcing"]
    for j, spring in enumerate(machine.springs):
        names += [f"springs[{j}].stiffness", f"springs[{j}].damping"]
        names += [f"springs[{j}].clearance"] if spring.clearance > 0.0 else []
    asked = [one for one in quantities_for(machine).values() if on_lanes(machine, one)]
    found, why = lane_values(
        machine, {"forcing": np.array([1.0, 1.1])}, asked, np.array([omega]), (0.1, 4.0),
        "from-below", names=names,
    )  # fmt: skip
    if why[0, 0] != FOUND:
        return  # no motion of one period is reached from below
    size = next(one for one in asked if one.part == "amplitude")
    value = found[size.name][0, 0]
    orbits = [one for one in ff.periodic_orbits(machine, omega=omega) if one.stable]
    orbit = min(orbits, key=lambda one: abs(one.amplitude(size.coordinate) - value))
    assert orbit.amplitude(size.coordinate) == pytest.approx(value, rel=1e-7)
    for one in asked:
        same(found[slope_key(one.name)][0, 0], told(orbit, one.name, names), rtol=1e-6, floor=1e-12)


def test_what_has_another_derivative_to_each_side_has_none(screen):
    even = screen.replace(clearance_minus=screen.clearance)
    asked = [quantity_named(name, even) for name in ("relative_amplitude", "stop_force")]
    columns = {"stop_stiffness": np.array([screen.stop_stiffness])}
    found, _ = read(even, columns, asked, 150.0, ("stop_stiffness", "clearance_minus"))
    assert np.isfinite(found[slope_key("relative_amplitude")]).all()
    assert np.isnan(found[slope_key("stop_force")]).tolist() == [[[False, True]]]


def test_a_motion_that_grazes_has_none_under_a_law_with_a_corner():
    def machine(law, gap):
        return ff.MechanicalSystem(
            [[1.0]], [[0.1]], [[1.0]],
            (ff.ClearanceSpring([1.0], 0.2, 0.05, gap, np.inf, law=law),),
            ff.HarmonicForce([0.5]),
        )  # fmt: skip

    free = abs(0.5 / complex(1.0 - 0.7**2, 0.1 * 0.7))
    for law, known in (("paper", True), ("compression-only", False)):
        grazing = machine(law, free)
        asked = [one for one in quantities_for(grazing).values() if one.part == "amplitude"]
        found, why = lane_values(
            grazing, {"forcing": np.ones(1)}, asked, np.array([0.7]), (0.1, 2.0), "from-below",
            names=("forcing",),
        )  # fmt: skip
        assert why[0, 0] == FOUND
        assert found[asked[0].name][0, 0] == pytest.approx(free, rel=1e-12)
        assert np.isfinite(found[slope_key(asked[0].name)][0, 0, 0]) == known


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


@pytest.mark.parametrize(
    ("quantity", "names", "told"),
    [
        ("omega_lb", ["clearance"], "of a motion"),
        ("relative_amplitude", ["colour"], "colour"),
        ("relative_amplitude", "clearance", "in a list"),
        ("relative_amplitude", ["clearance", "clearance"], "twice"),
        ("relative_amplitude", ["clearance_minus"], "finite value"),
    ],
)
def test_what_cannot_be_differentiated_is_said(screen, quantity, names, told):
    with pytest.raises(ff.InputError, match=told):
        ff.study(screen, {"clearance": (5e-3, 7e-3)}, quantity, 150.0, derivatives=names)


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
