"""Where the machine is linear: without contact, and with the stop bonded.

Routes: the closed form (K - w^2 M + i w C) X = F written out here, the linear analysis, and the
same nonlinear solvers that serve the rest.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import brentq

import flipflow as ff
from flipflow.continuation.branch import Branch
from judge import GAP, close, relative_amplitude

pytestmark = pytest.mark.numerical
FREE = {40.0: 1.001225259e-3, 60.0: 2.281714696e-3, 80.0: 5.681819427e-3}
BONDED_120 = 2.083974467e-3
METHODS = (ff.PiecewiseExact(), ff.HarmonicBalance(3))


def receptance_amplitude(screen: ff.FlipFlowScreen, omega: float, stop: float = 0.0) -> float:
    """|x1 - xf| without contact (stop 0) or with the stop bonded (stop 1)."""
    k = screen.shear_stiffness + stop * screen.stop_stiffness
    c = screen.shear_damping + stop * screen.stop_damping
    k1, c1 = screen.isolation_stiffness, screen.isolation_damping
    M = np.diag([screen.main_mass, screen.floating_mass])
    K = np.array([[k1 + k, -k], [-k, k]])
    C = np.array([[c1 + c, -c], [-c, c]])
    force = np.array([screen.eccentric_moment * omega**2, 0.0])
    return float(abs(GAP @ np.linalg.solve(K - omega**2 * M + 1j * omega * C, force)))


@pytest.mark.parametrize("omega", FREE)
def test_linear_amplitude_by_linear_analysis(screen, omega: float) -> None:
    """Closed form; 1e-9 of the value, for ten digits are given."""
    from flipflow.dynamics.linear_response import linear_response  # noqa: PLC0415

    linear = linear_response(ff.load("ffs0827-linear"), np.array([omega]))
    close("linear analysis", linear.amplitude("relative"), [FREE[omega]], rel=1e-9)
    close("written out here", receptance_amplitude(screen, omega), FREE[omega], rel=1e-9)


@pytest.mark.parametrize("method", METHODS, ids=["exact", "balance"])
@pytest.mark.parametrize("omega", FREE)
def test_linear_amplitude_by_the_solvers(screen, response, omega: float, method) -> None:
    """Below contact, and without any stop, both solvers meet the closed form to 1e-9."""
    expected = receptance_amplitude(screen, omega)
    close("closed form", expected, FREE[omega], rel=1e-9)
    close("with stop, not reached", relative_amplitude(response(method), omega), expected, rel=1e-9)
    alone = ff.frequency_response(ff.load("ffs0827-linear"), (30.0, 90.0), method)
    close("machine without stop", relative_amplitude(alone, omega), expected, rel=1e-9)


@pytest.mark.parametrize("method", METHODS, ids=["exact", "balance"])
def test_no_clearance_is_the_bonded_machine(
    screen, response: Callable[..., Branch], method
) -> None:
    """e = 0 at 120 rad/s against the closed form with k2 + k3, c2 + c3; 1e-9."""
    got = relative_amplitude(response(method, clearance=0.0), 120.0)
    close("e = 0", got, BONDED_120, rel=1e-9)
    close("closed form", receptance_amplitude(screen, 120.0, stop=1.0), BONDED_120, rel=1e-9)


def test_a_vanishing_clearance_tends_to_it(screen) -> None:
    """Contact at e = 1 nm differs from e = 0 by the share e takes of the stroke, 1e-6."""
    small = ff.frequency_response(screen.replace(clearance=1e-9), (110.0, 130.0))
    close("e = 1 nm", relative_amplitude(small, 120.0), BONDED_120, rel=2e-6)


@pytest.mark.parametrize(
    ("stop", "expected"), [(0.0, (22.493898, 108.807505)), (1.0, (22.625997, 216.344494))]
)
def test_natural_frequencies(screen, stop: float, expected: tuple[float, float]) -> None:
    """Undamped, free and bonded, against the eigenvalue problem written out here.

    1e-8 between the two routes, and half of the last digit of the reference values, which have
    eight or nine.
    """
    from flipflow.dynamics.linear_response import linear_response  # noqa: PLC0415

    k = screen.shear_stiffness + stop * screen.stop_stiffness
    k1 = screen.isolation_stiffness
    K = np.array([[k1 + k, -k], [-k, k]])
    M = np.diag([screen.main_mass, screen.floating_mass])
    closed = np.sqrt(scipy.linalg.eigvalsh(K, M))
    machine = screen.replace(clearance=0.0) if stop else ff.load("ffs0827-linear")
    found = linear_response(machine, np.array([100.0])).natural_frequencies
    close("natural frequencies, two routes", found, closed, rel=1e-8)
    close("natural frequencies", found, expected, rel=1e-8, abs=5e-7)


@pytest.mark.parametrize("method", [*METHODS, ff.HarmonicBalance(15)], ids=["exact", "H3", "H15"])
def test_contact_begins_and_ends(screen, response, method) -> None:
    """Where the contact-free amplitude passes e, to 1e-6 rad/s."""

    def beyond(omega: float) -> float:
        return receptance_amplitude(screen, omega) - screen.clearance

    points = response(method).special_points
    begin = [point.omega for point in points if point.kind == "contact begin"]
    end = [point.omega for point in points if point.kind == "contact end"]
    close("contact begins", begin, [81.0637405], abs=1e-6)
    close("contact ends", end, [223.3384546], abs=1e-6)
    close("begins, closed form", begin[0], brentq(beyond, 60.0, 100.0, xtol=1e-11), abs=1e-6)
    close("ends, closed form", end[0], brentq(beyond, 150.0, 240.0, xtol=1e-11), abs=1e-6)


@pytest.mark.parametrize("clearance", [4.0e-3, 4.54e-3])
def test_contact_never_ends_at_small_gaps(screen, response, clearance: float) -> None:
    """For e <= m0r/m1 = 4.550 mm the contact never ends.

    Far above all resonances the amplitude tends to m0r/m1 from above; 5 % more gap lets it end.
    """
    limit = screen.eccentric_moment / screen.main_mass
    close("m0r/m1", limit, 4.550e-3, abs=5e-7)
    for method in METHODS:
        assert not response(method, (5.0, 2000.0), clearance=clearance).points_of("contact end")
        wider = response(method, (5.0, 2000.0), clearance=1.05 * limit)
        assert len(wider.points_of("contact end")) == 1
