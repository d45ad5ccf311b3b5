"""Exact motions of FFS0827 against the reference values that tests/reference tells of.

Routes: shooting on the closed-form flow (the default method), the scalar two-event problem and
event-located DOP853 of ``tests/reference``, and harmonic balance of high order.
"""

from __future__ import annotations

import numpy as np
import pytest

import flipflow as ff
from judge import GAP, close, relative_amplitude, upper_orbit
from reference import integrate, two_event

pytestmark = pytest.mark.numerical
AMPLITUDES = {100.0: 7.888703398e-3, 120.0: 9.969835637e-3, 140.0: 12.878842732e-3}
AMPLITUDES_MM = {
    85.0: 6.488906, 90.0: 6.969572, 95.0: 7.427901, 110.0: 8.864270, 130.0: 11.277296,
    150.0: 14.906462, 170.0: 21.160284, 190.0: 33.162076, 198.0: 39.117403, 202.0: 39.833897,
}  # fmt: skip
MULTIPLIERS_120 = np.array([0.319490 + 0.745924j, -0.418910 + 0.417301j])
FOLDS = ((206.405559, 26.28591e-3), (198.649272, 8.427351e-3))


@pytest.mark.parametrize("omega", AMPLITUDES)
def test_exact_amplitude(screen, exact, response, omega: float) -> None:
    """1e-8 of the value by shooting and by DOP853 started on the motion's state.

    That the integrator comes back to the state after the turn shows that it is the motion;
    harmonic balance with 31 harmonics meets it within its stated error.
    """
    orbit = upper_orbit(exact, omega)
    turn = 2.0 * np.pi / omega
    path = integrate.flow(integrate.Machine.of(screen.system()), orbit.state, omega, 0.0, turn)
    close("shooting", orbit.amplitude("relative"), AMPLITUDES[omega], rel=1e-8)
    close("DOP853", integrate.amplitude(path, GAP, 0.0, turn), AMPLITUDES[omega], rel=1e-8)
    close("DOP853 after a turn", path.final, orbit.state, abs=1e-11)
    series = upper_orbit(response(ff.HarmonicBalance(31)), omega)
    close("H = 31", series.amplitude("relative"), AMPLITUDES[omega], abs=max(series.error, 1e-12))
    assert series.error < 1e-6, f"stated error of H = 31: {series.error}"


@pytest.mark.parametrize("omega", AMPLITUDES_MM)
def test_exact_amplitude_to_a_nanometre(exact, response, omega: float) -> None:
    """1e-6 mm; harmonic balance (31) within a micrometre, as its stated error says."""
    got = relative_amplitude(exact, omega) * 1e3
    close("shooting, mm", got, AMPLITUDES_MM[omega], abs=1e-6)
    series = upper_orbit(response(ff.HarmonicBalance(31)), omega)
    close("H = 31, mm", series.amplitude("relative") * 1e3, AMPLITUDES_MM[omega], abs=1e-3)


def test_folds(screen, exact, response) -> None:
    """1e-6 rad/s by shooting and by f = f_s = 0 of the two-event problem.

    The amplitudes are given to seven digits; half of the last one is allowed. Harmonic balance
    of order 31 comes within 1e-4 rad/s.
    """
    assert len(exact.folds) == 2
    by_balance = response(ff.HarmonicBalance(31)).folds
    for point, series, (omega, amplitude) in zip(exact.folds, by_balance, FOLDS, strict=True):
        share = point.orbit.contact_share()
        _, by_scalar = two_event.fold(screen, share, round(point.omega, 1))
        close("fold by shooting", point.omega, omega, abs=1e-6)
        close("fold by the scalar problem", by_scalar, omega, abs=1e-6)
        close("amplitude at the fold", point.amplitude("relative"), amplitude, rel=2e-7)
        close("fold by H = 31", series.omega, omega, abs=1e-4)


def test_largest_amplitude(exact, response) -> None:
    """1e-3 mm, by shooting and harmonic balance (31); the summit is flat: 0.01 rad/s."""
    for branch in (exact, response(ff.HarmonicBalance(31))):
        peak = branch.peak("relative")
        close("largest amplitude, mm", peak.amplitude("relative") * 1e3, 40.0311, abs=1e-3)
        close("where", peak.omega, 200.90, abs=1e-2)


def test_multipliers(screen, exact, response) -> None:
    """1e-5, by shooting and from differences of the DOP853 flow.

    Harmonic balance (31) takes them over its own contact times and comes within 1e-3.
    """
    orbit = upper_orbit(exact, 120.0)
    expected = np.concatenate([MULTIPLIERS_120, MULTIPLIERS_120.conj()])
    machine, turn = integrate.Machine.of(screen.system()), 2.0 * np.pi / 120.0
    h = 1e-7 * np.array([1.0, 1.0, 120.0, 120.0])
    columns = [
        (
            integrate.flow(machine, orbit.state + d, 120.0, 0.0, turn).final
            - integrate.flow(machine, orbit.state - d, 120.0, 0.0, turn).final
        )
        / (2.0 * d.max())
        for d in np.diag(h)
    ]
    close("shooting", _ordered(orbit.multipliers), _ordered(expected), abs=1e-5)
    differences = np.linalg.eigvals(np.array(columns).T)
    close("DOP853", _ordered(differences), _ordered(expected), abs=1e-5)
    series = upper_orbit(response(ff.HarmonicBalance(31)), 120.0)
    close("H = 31", _ordered(series.multipliers), _ordered(expected), abs=1e-3)


@pytest.mark.parametrize(
    "method", [ff.PiecewiseExact(), ff.HarmonicBalance(9)], ids=["exact", "H9"]
)
@pytest.mark.parametrize("omega", [60.0, 120.0, 195.0])
def test_doubling_gap_and_unbalance(screen, response, method, omega: float) -> None:
    """The equations are homogeneous in (e, m0r, x), so 1e-12: nothing but rounding."""
    doubled = response(
        method, clearance=2.0 * screen.clearance, eccentric_moment=2.0 * screen.eccentric_moment
    )
    one, two = upper_orbit(response(method), omega), upper_orbit(doubled, omega)
    for which in ("main", "floating", "relative"):
        size = one.amplitude(which)
        close(
            f"displacement of {which}", two.displacement(which) / size,
            2.0 * one.displacement(which) / size, abs=1e-12,
        )  # fmt: skip
    for first, second in zip(response(method).special_points, doubled.special_points, strict=True):
        assert first.kind == second.kind
        close(f"frequency of {first.kind}", second.omega, first.omega, rel=1e-12)


def _ordered(values: np.ndarray) -> np.ndarray:
    return np.array(sorted(values, key=lambda z: (round(z.real, 4), z.imag)))
