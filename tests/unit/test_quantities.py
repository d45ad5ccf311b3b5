"""The table of quantities: declarations and formulas pair, and all readers of it agree."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.dynamics.contact_free import contact_free
from flipflow.io.check import check_project
from flipflow.model.fields import FIELD
from flipflow.model.limits import LIMIT_FIELDS, limit_bounds
from flipflow.model.quantities import QUANTITIES, quantities_of
from flipflow.studies.assessment import NOT_CHECKED, assess_case, limit_row
from flipflow.studies.feasible import case_window
from flipflow.studies.landmarks import RESPONSE_VALUES
from flipflow.studies.quantity_values import MOTION_VALUES, ContactFree, Working, beyond_rounding

pytestmark = pytest.mark.numerical
OMEGA = 80.0
OPTIONAL = tuple(sorted({name for one in QUANTITIES.values() for name in one.needs}))
# No limit needs the rest of them.
FOR_LIMITS = tuple(
    sorted({name for one in QUANTITIES.values() if one.limit is not None for name in one.needs})
)
LIMITS = ff.Limits(
    relative_amplitude=(1e-3, 8e-3), main_frame_acceleration=50.0, floating_frame_acceleration=90.0,
    speed=(60.0, 100.0), shear_strain=0.5, stop_force=1e5, foundation_force=1e4,
    dissipated_power=5e3, jump_margin=0.2,
)  # fmt: skip


@pytest.fixture(scope="module")
def project():
    """FFS0827 with every field that a quantity needs, and every limit."""
    own = ff.load_project("ffs0827")
    full = own.screen.replace(
        shear_height=0.05, deck_angle=0.3, stop_pieces=4, supports=4, bearings=2
    )
    return dataclasses.replace(own, screen=full, limits=LIMITS, speed=OMEGA)


@pytest.fixture(scope="module")
def branch(project):
    return ff.frequency_response(project.screen, (78.0, 82.0), ff.PiecewiseExact(points=8))


def without(screen, names):
    return screen.replace(**dict.fromkeys(names))


def subsets(names):
    return [
        chosen for size in range(len(names) + 1) for chosen in itertools.combinations(names, size)
    ]


def test_every_declared_quantity_has_a_formula_and_no_other():
    assert set(MOTION_VALUES) == {one.name for one in quantities_of("motion")}
    assert set(RESPONSE_VALUES) == {one.name for one in quantities_of("response")}
    assert [one.name for one in quantities_of("operation")] == ["speed"]


def test_what_a_quantity_needs_may_be_left_out_of_a_file():
    assert all(FIELD[name].default is None for name in OPTIONAL)


@pytest.mark.parametrize("lacking", OPTIONAL)
@pytest.mark.parametrize("kind", ["solved", "contact-free"])
def test_a_formula_reads_what_is_declared_and_nothing_else(project, branch, kind, lacking):
    """Without one field exactly those that declare it have no value."""
    screen = without(project.screen, [lacking])
    if kind == "solved":
        motions = Working(screen, branch.orbit_from_below(OMEGA))
    else:
        fields = {name: np.asarray(getattr(screen, name), float) for name in FIELD}
        motions = ContactFree(fields, np.array([OMEGA]))
    with np.errstate(invalid="ignore"):
        values = {name: formula(motions) for name, formula in MOTION_VALUES.items()}
    unknown = {name for name, value in values.items() if np.any(np.isnan(value))}
    assert unknown == {one.name for one in QUANTITIES.values() if lacking in one.needs}


@pytest.mark.parametrize(
    "lacking",
    [*subsets(FOR_LIMITS), *((name,) for name in OPTIONAL if name not in FOR_LIMITS), OPTIONAL],
    ids=" ".join,
)
def test_check_and_assessment_leave_out_the_same_limits(project, branch, lacking):
    part = dataclasses.replace(project, screen=without(project.screen, lacking))
    case = assess_case(part.screen, ff.Load(), branch, OMEGA)
    rows = [limit_row(part, (case,), limit.name) for limit in LIMIT_FIELDS]
    unjudged = {f"limits.{row.name}" for row in rows if row.state == NOT_CHECKED}
    gaps = {gap.disables for gap in check_project(part).missing}
    assert unjudged == {disabled for disabled in gaps if disabled.startswith("limits.")}


@pytest.mark.parametrize("lacking", subsets(("normal_damping", "normal_stiffness", "shear_height")))
def test_the_window_leaves_out_the_same_limits_as_check(project, branch, lacking):
    part = dataclasses.replace(project, screen=without(project.screen, lacking))
    window = case_window(part.screen, ff.Load(), branch, LIMITS, (79.0, 81.0))
    gaps = {gap.disables for gap in check_project(part).missing}
    unchecked = {f"limits.{name}" for name in window.unchecked}
    assert unchecked == {disabled for disabled in gaps if disabled.startswith("limits.")}


@pytest.mark.parametrize("lacking", ["normal_stiffness", "normal_damping"])
def test_check_lists_dissipated_power_where_the_normal_direction_is_unknown(project, lacking):
    part = dataclasses.replace(project, screen=without(project.screen, [lacking]))
    gaps = {gap.disables: gap.missing for gap in check_project(part).missing}
    assert gaps["limits.dissipated_power"] == f"isolation.{lacking}"
    words = next(gap.disables for gap in check_project(part).missing if "throw" in gap.disables)
    assert "dissipated power" in words


def test_what_only_stops_need_is_not_missed_without_stops(project):
    bare = without(project.screen, ["stop_pieces"]).replace(clearance=math.inf)
    limits = dataclasses.replace(LIMITS, stop_force=None, jump_margin=None)
    part = dataclasses.replace(project, screen=bare, limits=limits)
    assert check_project(part).missing == ()


def test_bounds_follow_the_direction_of_the_limit():
    assert limit_bounds(LIMITS, "speed") == (60.0, 100.0)
    assert limit_bounds(LIMITS, "jump_margin") == (0.2, math.inf)
    assert limit_bounds(LIMITS, "stop_force") == (-math.inf, 1e5)


@pytest.mark.parametrize("alike", [(), (0, 1), (0, 2), (1, 2)])
@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_the_contact_free_response_solves_its_equation(size, alike):
    """Many machines at many frequencies: the residual of every one is zero to the last digits.

    Machines may differ in all three matrices or in one of them alone.
    """
    rng = np.random.default_rng(size)
    parts = rng.normal(size=(3, 7, 1, size, size))
    M, C, K = parts @ np.swapaxes(parts, -1, -2) + size * np.eye(size)
    M, C, K = (one[0, 0] if k in alike else one for k, one in enumerate((M, C, K)))
    omega = np.linspace(0.3, 3.0, 11)
    force = rng.normal(size=(11, size)) + 1j * rng.normal(size=(11, size))
    X = contact_free(M, C, K, force, omega)
    assert X.shape == (7, 11, size)
    w = omega[:, None, None]
    Z = K - w**2 * M + 1j * w * C
    np.testing.assert_allclose(
        (Z @ X[..., None])[..., 0], np.broadcast_to(force, X.shape), rtol=1e-12
    )


def test_an_offset_that_rounding_leaves_is_none():
    found = beyond_rounding(np.array([1e-15, 1e-4, np.nan]), np.full(3, 5e-3))
    np.testing.assert_array_equal(found, [0.0, 1e-4, np.nan])


def test_a_force_on_one_mass_of_many_machines_is_its_receptance(project):
    """Vectors without axes of machine or frequency are taken for all of them."""
    system = project.screen.system()
    omega = np.array([40.0, OMEGA])
    X = contact_free(system.M, system.C, system.K, np.array([0.0, 1.0]), omega)
    for w, row in zip(omega, X, strict=True):
        Z = system.K - w**2 * system.M + 1j * w * system.C
        np.testing.assert_allclose(row, np.linalg.inv(Z)[:, 1], rtol=1e-12)
