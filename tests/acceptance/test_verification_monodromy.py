"""What happens to a disturbance and to energy over one turn.

Routes: the kernels' monodromy, its closed form assembled here from matrix exponentials and
saltations, differences of the independent flow, and the divergence of the flow.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

import flipflow as ff
from judge import close, upper_orbit
from reference import integrate

pytestmark = pytest.mark.numerical
SHARES = {100.0: 0.394690, 120.0: 0.536373, 140.0: 0.655145}
POWER_120 = {"input": 2415.4, "isolation": 117.1, "shear": 1740.1, "stop": 558.3}
TO_RELATIVE = np.kron(np.eye(2), [[1.0, 0.0], [1.0, -1.0]])


def state_matrix(screen: ff.FlipFlowScreen, engaged: bool) -> np.ndarray:
    """z' = A z of the open machine or with the stop engaged."""
    system = screen.system()
    outer = np.outer([1.0, -1.0], [1.0, -1.0])
    K = system.K + engaged * screen.stop_stiffness * outer
    C = system.C + engaged * screen.stop_damping * outer
    inverse = np.linalg.inv(system.M)
    return np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ K, -inverse @ C]])


def entry_saltation(screen: ff.FlipFlowScreen) -> np.ndarray:
    """S = I + (0, -c3 M^-1 d) (d, 0)^T in (x1, xf, x1', xf'), from (f+ - f-) n^T / (n^T f-)."""
    S = np.eye(4)
    S[2] += -screen.stop_damping / screen.main_mass * np.array([1.0, -1.0, 0.0, 0.0])
    S[3] += screen.stop_damping / screen.floating_mass * np.array([1.0, -1.0, 0.0, 0.0])
    return S


def assembled_monodromy(screen: ff.FlipFlowScreen, orbit) -> np.ndarray:
    """Product of exponentials and saltations over the contact times that the orbit tells."""
    turn = orbit.period
    entry, leave = entry_saltation(screen), np.linalg.inv(entry_saltation(screen))
    free, engaged = state_matrix(screen, engaged=False), state_matrix(screen, engaged=True)
    touches = [(i.start, i.end) for i in orbit.motion.contact_intervals()]
    changes = sorted(
        [(start % turn, entry) for start, _ in touches]
        + [(end % turn, leave) for _, end in touches],
        key=lambda change: change[0],
    )
    inside = changes[0][1] is leave
    M, t = np.eye(4), 0.0
    for when, jump in changes:
        M = jump @ scipy.linalg.expm((engaged if inside else free) * (when - t)) @ M
        inside, t = jump is entry, when
    return scipy.linalg.expm((engaged if inside else free) * (turn - t)) @ M


def test_saltation_entries(screen) -> None:
    """-c3/m1 and -c3 (1/m1 + 1/m2) = -11.247 in (x1, x2), at the exit with the other sign: 1e-9."""
    S = TO_RELATIVE @ entry_saltation(screen) @ np.linalg.inv(TO_RELATIVE)
    c3, m1, m2 = screen.stop_damping, screen.main_mass, screen.floating_mass
    close("x1' by x2", S[2, 1], -c3 / m1, rel=1e-9)
    close("x2' by x2", S[3, 1], -c3 * (1.0 / m1 + 1.0 / m2), rel=1e-9)
    close("x2' by x2, printed", S[3, 1], -11.247, abs=5e-4)
    close("exit is the inverse", np.linalg.inv(S)[2:, 1], -S[2:, 1], rel=1e-9)


@pytest.mark.parametrize("omega", [100.0, 120.0, 140.0, 202.0])
def test_saltation_in_the_monodromy(screen, exact, omega: float) -> None:
    """The kernels' matrix is the assembled one to 1e-9, with the jumps at contact in it.

    Without them it differs by percents: the test would notice.
    """
    orbit = upper_orbit(exact, omega)
    scale = np.array([1.0, 1.0, omega, omega])
    got = orbit.monodromy * scale / scale[:, None]
    assembled = assembled_monodromy(screen, orbit) * scale / scale[:, None]
    close("monodromy (displacements in m, velocities over omega)", got, assembled, abs=1e-9)
    without = assembled_monodromy(screen.replace(stop_damping=0.0), orbit) * scale / scale[:, None]
    assert np.abs(without - assembled).max() > 1e-3


@pytest.mark.parametrize(("side", "sign"), [("entry", 1.0), ("exit", -1.0)])
def test_saltation_by_differences(screen, exact, side: str, sign: float) -> None:
    """Differences of the DOP853 flow across one contact; 1e-6 is what differences give."""
    orbit = upper_orbit(exact, 120.0)
    touch = next(i for i in orbit.motion.contact_intervals() if i.side > 0)
    at = touch.start if side == "entry" else touch.end
    short = 1e-4
    before = np.concatenate([orbit.motion.derivative(at - short, k) for k in (0, 1)])
    machine = integrate.Machine.of(screen.system())
    flow = _differences(machine, before, 120.0, at - short, at + short, 1e-7)
    first, last = (state_matrix(screen, engaged=e == (side == "exit")) for e in (True, False))
    S = scipy.linalg.expm(-last * short) @ flow @ scipy.linalg.expm(-first * short)
    S = TO_RELATIVE @ S @ np.linalg.inv(TO_RELATIVE)
    c3, m1, m2 = screen.stop_damping, screen.main_mass, screen.floating_mass
    expected = -sign * c3 * np.array([1.0 / m1, 1.0 / m1 + 1.0 / m2])
    close(f"{side} by differences", S[2:, 1], expected, rel=1e-6)


@pytest.mark.parametrize("omega", SHARES)
def test_determinant(screen, exact, response, omega: float) -> None:
    """det M = exp(-T (c1/m1 + c2 v) - t_c c3 v), v = 1/m1 + 1/m2, to 1e-9; shares to six digits.

    The multipliers of a series are those of the exact motion one Newton step beside it, so that
    its determinant belongs to the exact contact share too, to the square of that step.
    """
    turn = 2.0 * np.pi / omega
    c1, c2, c3 = screen.isolation_damping, screen.shear_damping, screen.stop_damping
    v = 1.0 / screen.main_mass + 1.0 / screen.floating_mass
    orbit = upper_orbit(exact, omega)
    close("contact share", orbit.contact_share(), SHARES[omega], abs=5e-7)
    for method, motion, rel in (
        ("exact", orbit, 1e-9),
        ("H9", upper_orbit(response(ff.HarmonicBalance(9)), omega), 1e-6),
    ):
        contact = orbit.contact_share() * turn
        expected = np.exp(-turn * (c1 / screen.main_mass + c2 * v) - contact * c3 * v)
        close(f"determinant, {method}", np.linalg.det(motion.monodromy), expected, rel=rel)
        close(f"product of multipliers, {method}", np.prod(motion.multipliers), expected, rel=rel)


@pytest.mark.parametrize(("omega", "which"), [(100.0, 0), (140.0, 0), (202.0, 0), (202.0, 1)])
def test_monodromy_by_differences(screen, exact, omega: float, which: int) -> None:
    """1e-6 against central differences of the independent flow, stable or not.

    Velocities are measured in omega times metres, so that all entries are of one size.
    """
    orbit = exact.orbits_at(omega)[which]
    machine = integrate.Machine.of(screen.system())
    scale = np.array([1.0, 1.0, omega, omega])
    got = orbit.monodromy * scale / scale[:, None]
    M = _differences(machine, orbit.state, omega, 0.0, orbit.period, 1e-7)
    close("monodromy", got, M * scale / scale[:, None], abs=1e-6)


def test_energy_balance(screen, exact, response) -> None:
    """1e-4, and no finer than the tenth of a watt to which the reference values are given.

    The balance itself, and harmonic balance (31) against the exact motion, to 1e-4.
    """
    powers = _powers(screen, upper_orbit(exact, 120.0))
    _check_power(powers)
    series = _powers(screen, upper_orbit(response(ff.HarmonicBalance(31)), 120.0))
    for name, value in powers.items():
        close(f"{name} by H = 31, W", series[name], value, rel=1e-4)


def test_energy_balance_by_integration(screen, exact) -> None:
    """The same by Simpson's rule on every piece of the DOP853 trajectory."""
    orbit = upper_orbit(exact, 120.0)
    machine = integrate.Machine.of(screen.system())
    path = integrate.flow(machine, orbit.state, 120.0, 0.0, orbit.period)
    work = dict.fromkeys(POWER_120, 0.0)
    start = 0.0
    for end, piece, states in zip(path.ends, path.pieces, path.states, strict=True):
        t = np.linspace(start, end, 401)
        z = piece(t)
        touching = float("engaged" in states)
        force = screen.eccentric_moment * 120.0**2 * np.cos(120.0 * t)
        rates = {
            "input": force * z[2],
            "isolation": screen.isolation_damping * z[2] ** 2,
            "shear": screen.shear_damping * (z[2] - z[3]) ** 2,
            "stop": touching * screen.stop_damping * (z[2] - z[3]) ** 2,
        }
        for name, rate in rates.items():
            work[name] += scipy.integrate.simpson(rate, x=t)
        start = end
    _check_power({name: value / orbit.period for name, value in work.items()})


def _powers(screen: ff.FlipFlowScreen, orbit) -> dict[str, float]:
    return {
        "input": orbit.input_power(),
        "isolation": screen.isolation_damping * orbit.mean_square_velocity("main"),
        "shear": screen.shear_damping * orbit.mean_square_velocity("relative"),
        "stop": screen.stop_damping * orbit.mean_square_velocity("relative", spring=0),
    }


def _check_power(found: dict[str, float]) -> None:
    for name, expected in POWER_120.items():
        close(f"{name}, W", found[name], expected, abs=max(1e-4 * expected, 0.05))
    lost = found["isolation"] + found["shear"] + found["stop"]
    close("what comes in is dissipated", found["input"], lost, rel=1e-4)


def _differences(
    machine: integrate.Machine, z: np.ndarray, omega: float, start: float, end: float, h: float
) -> np.ndarray:
    """d z(end) / d z(start) by central differences of the independent flow."""
    steps = np.diag(h * np.array([1.0, 1.0, omega, omega]))
    columns = []
    for step in steps:
        ahead = integrate.flow(machine, z + step, omega, start, end, 1e-13).final
        behind = integrate.flow(machine, z - step, omega, start, end, 1e-13).final
        columns.append((ahead - behind) / (2.0 * step.max()))
    return np.array(columns).T
