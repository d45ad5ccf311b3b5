"""Harmonic balance of any order: its error, its folds, its convergence, and complete curves.

Judged by the exact motions, which test_verification_exact.py ties to an independent integration.
"""

from __future__ import annotations

import numpy as np
import pytest

import flipflow as ff
from conftest import LIGHT_DAMPING
from judge import close, kinds, relative_amplitude, upper_orbit

pytestmark = pytest.mark.numerical
THIRD_ORDER_PERCENT = {100.0: -0.58, 120.0: -0.13, 140.0: 0.22}
ORDERS = (1, 2, 3, 5, 9, 15, 21, 31)
MACHINES = {"nominal": {}, "light damping": LIGHT_DAMPING, "c3 = 0": {"stop_damping": 0.0}}
WHAT_BELONGS = ["contact begin", "fold", "fold", "contact end"]


@pytest.mark.parametrize("omega", THIRD_ORDER_PERCENT)
def test_third_order_against_exact(exact, response, omega: float) -> None:
    """The percentages are the method's own error; each within a tenth of itself."""
    series = relative_amplitude(response(ff.HarmonicBalance(3)), omega)
    percent = 100.0 * (series / relative_amplitude(exact, omega) - 1.0)
    close("H = 3 against exact, %", percent, THIRD_ORDER_PERCENT[omega], rel=0.1)


@pytest.mark.parametrize(("order", "folds"), [(3, (206.415, 198.661)), (1, (206.453, 198.002))])
def test_folds_of_low_order(response, order: int, folds: tuple[float, float]) -> None:
    """Reference values of the folds of the truncated equations, given to 1e-3: 2e-3 rad/s."""
    found = [fold.omega for fold in response(ff.HarmonicBalance(order)).folds]
    close(f"folds by H = {order}", found, folds, abs=2e-3)


@pytest.mark.parametrize("omega", [100.0, 120.0, 140.0])
def test_convergence_of_harmonics(exact, response, omega: float) -> None:
    """Order 2.5 +- 0.5 in L2, for x2'' jumps at the contact.

    A jump in the second derivative makes the series fall as h^-3 and its tail as H^-2.5. The error
    swings with the contact share, hence a fit over many orders.
    """
    t = np.linspace(0.0, 2.0 * np.pi / omega, 2001)[:-1]
    true = upper_orbit(exact, omega).displacement("relative", t)
    orders = np.arange(5, 62, 4)
    errors = [np.sqrt(np.mean((_motion(response, int(H), omega, t) - true) ** 2)) for H in orders]
    order = -np.polyfit(np.log(orders), np.log(errors), 1)[0]
    close("observed order in L2", order, 2.5, abs=0.5)


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("order", [*ORDERS, None])
def test_the_curve_completes_without_false_special_points(response, machine: str, order) -> None:
    """From 5 to 250 rad/s: contact begins, two folds, contact ends, and nothing else.

    These four belong at every order, also at the lowest: contact begins and ends where the
    linear amplitude passes the gap, which has one harmonic only; and the hardening that makes the
    two folds is in the first harmonic of the stop force (order 1 finds them within 0.7 rad/s of
    the exact ones). Even orders equal the odd ones below: a mirror-symmetric motion has no even
    harmonics. The exact branch (order None) has the same four.
    """
    method = None if order is None else ff.HarmonicBalance(order)
    branch = response(method, **MACHINES[machine])
    assert branch.status.complete, f"{branch.status.name}: {branch.status.value}"
    assert branch.notes == ()
    assert branch.omega[0] == 5.0
    assert branch.omega[-1] == 250.0
    found = [(p.kind, round(p.omega, 4)) for p in branch.special_points]
    assert kinds(branch) == WHAT_BELONGS, f"found {found}, expected {WHAT_BELONGS}"
    exact = response(**MACHINES[machine])
    close("folds", [f.omega for f in branch.folds], [f.omega for f in exact.folds], abs=0.7)
    assert np.abs(np.diff(branch.omega)).max() <= 245.0 / 300.0 * (1.0 + 1e-9)


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("order", [3, 9, 31, None])
def test_the_way_back_between_the_folds_is_unstable(response, machine: str, order) -> None:
    """Stability of every point: unstable exactly where omega runs backwards, no loophole."""
    branch = response(None if order is None else ff.HarmonicBalance(order), **MACHINES[machine])
    first, second = (fold.position for fold in branch.folds)
    index = np.arange(branch.omega.size)
    back = (index > first) & (index < second)
    clear = (np.abs(index - first) > 1.0) & (np.abs(index - second) > 1.0)
    assert set(branch.stability[back & clear]) == {"unstable"}
    assert set(branch.stability[~back & clear]) == {"stable"}


@pytest.mark.parametrize("order", [5, 9, 21])
@pytest.mark.parametrize("omega", [85.0, 100.0, 140.0, 190.0])
def test_stated_error_covers_the_true_one(exact, response, order: int, omega: float) -> None:
    """The estimate is the distance over the turn: within a factor of 3, both ways."""
    series, true = (
        upper_orbit(response(ff.HarmonicBalance(order)), omega),
        upper_orbit(exact, omega),
    )
    t = np.linspace(0.0, series.period, 4001)
    off = max(np.abs(series.displacement(k, t) - true.displacement(k, t)).max() for k in (0, 1))
    assert off / 3.0 <= series.error <= 3.0 * off, f"stated {series.error}, true {off}"


def _motion(response, order: int, omega: float, t: np.ndarray) -> np.ndarray:
    """x2 by harmonic balance: low orders from the branch, high ones over a short interval."""
    branch = response(ff.HarmonicBalance(order, points=20), (omega - 5.0, omega))
    return upper_orbit(branch, omega).displacement("relative", t)
