"""Folds of other machines, and where folds are born, against reference values.

Routes: shooting, harmonic balance, and the scalar two-event problem of ``tests/reference``, which
tells where the reference values come from.
"""

from __future__ import annotations

import numpy as np
import pytest

import flipflow as ff
from conftest import LIGHT_DAMPING
from judge import close
from reference import integrate, two_event

pytestmark = pytest.mark.numerical
VARIANTS = {
    "e = 8 mm": ({"clearance": 8e-3}, (198.64747, 164.12941), (198.67, 164.08)),
    "m0r x0.7": ({"eccentric_moment": 0.7 * 4.16825}, (196.69246, 157.87730), (196.72, 157.84)),
    "k2 x1.3": ({"shear_stiffness": 1.3 * 2.7e6}, (216.60646, 215.13238), (216.61, 215.13)),
}
CUSPS = {
    "stop_stiffness": (5.8231e6, 185.618, (5.83e6, 5.84e6, 5.86e6, 5.88e6)),
    "clearance": (5.3021e-3, 210.416, (5.31e-3, 5.32e-3, 5.34e-3, 5.36e-3)),
}


def by_scalar_problem(screen: ff.FlipFlowScreen, branch) -> list[float]:
    """The same folds from f = f_s = 0, started from rounded guesses."""
    return [
        two_event.fold(screen, round(fold.orbit.contact_share(), 3), round(fold.omega, 2))[1]
        for fold in branch.folds
    ]


def fold_pair(branch, where: str) -> list[float]:
    """The two folds of a branch near the cusp; they come and go together."""
    found = [fold.omega for fold in branch.folds]
    assert len(found) == 2, f"{where}: folds {found}, expected two; notes {branch.notes}"
    return found


def test_light_damping(screen, response) -> None:
    """Folds to 1e-4 rad/s, exact by two routes and by H = 3; the peak to 1e-2 mm."""
    exact = response(**LIGHT_DAMPING)
    folds = [fold.omega for fold in exact.folds]
    close("folds, exact", folds, (214.08570, 200.08830), abs=1e-4)
    scalar = by_scalar_problem(screen.replace(**LIGHT_DAMPING), exact)
    close("folds, scalar problem", scalar, (214.08570, 200.08830), abs=1e-4)
    series = response(ff.HarmonicBalance(3), **LIGHT_DAMPING)
    close("folds, H = 3", [f.omega for f in series.folds], (214.0861, 200.0973), abs=1e-4)
    largest = exact.peak("relative").amplitude("relative") * 1e3
    close("largest amplitude, mm", largest, 165.78, abs=1e-2)
    high = response(ff.HarmonicBalance(31), **LIGHT_DAMPING).peak("relative")
    close("largest amplitude by H = 31, mm", high.amplitude("relative") * 1e3, 165.78, abs=1e-2)


@pytest.mark.parametrize("variant", VARIANTS)
def test_folds_of_variants(screen, response, variant: str) -> None:
    """Exact folds to 1e-4 by two routes; by H = 3 to 5e-2, for two decimals are given."""
    changes, folds, third_order = VARIANTS[variant]
    exact = response(**changes)
    close("folds, exact", [fold.omega for fold in exact.folds], folds, abs=1e-4)
    close(
        "folds, scalar problem",
        by_scalar_problem(screen.replace(**changes), exact),
        folds,
        abs=1e-4,
    )
    series = response(ff.HarmonicBalance(3), **changes)
    close("folds, H = 3", [fold.omega for fold in series.folds], third_order, abs=5e-2)


@pytest.mark.parametrize("method", [None, ff.HarmonicBalance(9)], ids=["exact", "H9"])
@pytest.mark.parametrize(
    "changes",
    [{"stop_stiffness": k} for k in (5.4e6, 4.0e6, 2.7e6, 1.0e6)]
    + [{"clearance": e} for e in (4e-3, 3e-3, 2e-3)],
    ids=str,
)
def test_no_folds(response, method, changes: dict[str, float]) -> None:
    """No folds for k3 <= 2 k2 = 5.4 MN/m, nor for e <= 4 mm."""
    branch = response(method, **changes)
    assert branch.status.complete
    assert branch.folds == (), f"folds at {[fold.omega for fold in branch.folds]}, expected none"


@pytest.mark.parametrize("field", CUSPS)
def test_cusp_by_the_scalar_problem(screen, response, field: str) -> None:
    """f = f_s = f_ss = 0, solved from a machine beyond the cusp; 1e-3 of the value."""
    value, omega, beyond = CUSPS[field]
    folds = response(**{field: beyond[-1]}).folds
    share = float(np.mean([fold.orbit.contact_share() for fold in folds]))
    found = two_event.cusp(screen, field, beyond[-1], share, folds[0].omega)
    close(f"cusp in {field}", found[0], value, rel=1e-3)
    close("its frequency", found[1], omega, rel=1e-3)


@pytest.mark.parametrize("method", [None, ff.HarmonicBalance(21)], ids=["exact", "H21"])
@pytest.mark.parametrize("field", CUSPS)
def test_cusp_by_merging_folds(response, field: str, method) -> None:
    """Near a cusp the folds part as (p - p_c)^1.5, so gap^(2/3) is smooth in p.

    A parabola through four machines beyond the cusp is carried to gap 0; 1e-3 of the value.
    """
    value, omega, beyond = CUSPS[field]
    parameters = np.array(beyond) / value
    pairs = np.array([fold_pair(response(method, **{field: p}), f"{field} = {p}") for p in beyond])
    gap = np.abs(pairs[:, 0] - pairs[:, 1]) ** (2.0 / 3.0)
    merged = np.polyval(np.polyfit(gap, parameters, 2), 0.0)
    middle = np.polyval(np.polyfit(parameters, pairs.mean(axis=1), 2), merged)
    close(f"cusp in {field}", merged * value, value, rel=1e-3)
    close("its frequency", middle, omega, rel=1e-3)


def test_no_folds_on_the_near_side_of_the_cusps(response) -> None:
    """Two thousandths before the cusp there is none, as far beyond there are two."""
    for field, (value, _, _) in CUSPS.items():
        assert response(**{field: 0.998 * value}).folds == (), f"{field} before its cusp"
        fold_pair(response(**{field: 1.002 * value}), f"{field} beyond its cusp")


def test_a_small_pair_just_above_contact_is_real(screen, response) -> None:
    """The resonance has no folds at small gaps. At 1 mm there is another pair at 40 rad/s.

    Within 0.1 rad/s above contact three motions coexist. Both methods find the pair, and DOP853
    comes back to each of the three after ten turns (rounding grows by the multiplier 1.17).
    """
    exact = response(clearance=1e-3)
    folds = [fold.omega for fold in exact.folds]
    assert len(folds) == 2
    assert 39.9 < min(folds) < max(folds) < 40.1, folds
    series = response(ff.HarmonicBalance(21), clearance=1e-3)
    close("folds by H = 21", [fold.omega for fold in series.folds], folds, abs=1e-2)
    machine = integrate.Machine.of(screen.replace(clearance=1e-3).system())
    omega = sum(folds) / 2.0
    orbits = exact.orbits_at(omega)
    assert [orbit.stability for orbit in orbits] == ["stable", "unstable", "stable"]
    for orbit in orbits:
        end = integrate.flow(machine, orbit.state, omega, 0.0, 10.0 * orbit.period).final
        close("state after ten turns", end, orbit.state, abs=1e-9)


def test_the_fold_of_a_series_is_no_corner(screen):
    """The exact motion that stands for it has no multiplier at 1, and grazes nothing."""
    branch = ff.frequency_response(screen, (150.0, 215.0), ff.HarmonicBalance(3))
    fold = max(branch.folds, key=lambda one: one.omega)
    found = ff.continue_fold(fold, "clearance", (5.9e-3, 6.1e-3))
    assert found.complete
    assert found.notes == ()
