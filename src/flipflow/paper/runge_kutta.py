"""The paper's sweeps: fixed steps by the classical Runge-Kutta method, speed after speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.model.drive import SpeedProfile
from flipflow.model.system import Coordinate, MechanicalSystem
from flipflow.transient.history import History
from flipflow.transient.speed_run import Start, run_history
from flipflow.transient.time_stepping import RungeKutta

METHOD = RungeKutta("rk4")
MOST_TURNS, SETTLED = 1000, 1e-6


@dataclass(frozen=True, eq=False)
class SteppedSweep:
    """Amplitudes after settling at one speed after the other.

    Parameters
    ----------
    omega
        Speeds in rad/s in the order passed, (n,).
    turns
        The last turn at each.
    """

    omega: Real
    turns: tuple[History, ...]

    def amplitude(self, which: Coordinate) -> Real:
        """Half peak-to-peak over the last turn in m, (n,)."""
        return np.array([_amplitude(turn, which) for turn in self.turns])


def stepped_sweep(system: MechanicalSystem, omega: Real) -> SteppedSweep:
    """From rest, each speed from where the one before ended, by the event-located RK4."""
    state, turns = np.zeros(2 * system.size), []
    for speed in omega.tolist():
        turns.append(_last_turn(system, speed, state))
        state = _end(turns[-1])
    return SteppedSweep(omega, tuple(turns))


def _last_turn(system: MechanicalSystem, speed: float, state: Real) -> History:
    """Turn after turn until one ends where it began."""
    period = 2.0 * np.pi / speed
    profile = SpeedProfile((0.0, period), (speed, speed))
    for _ in range(MOST_TURNS):
        start = Start(state, 0.0, speed)
        turn = run_history(system, profile, start, period, fastest=speed, method=METHOD)
        before, state = state, _end(turn)
        if np.abs(state - before).max() <= SETTLED * np.abs(state).max():
            break
    return turn


def _end(turn: History) -> Real:
    return np.concatenate([turn.x[-1], turn.v[-1]])


def _amplitude(turn: History, which: Coordinate) -> float:
    """Extremes of the cubics through displacement and velocity of every step."""
    from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415  slow to import

    t, rows = np.unique(turn.t, return_index=True)
    curve = CubicHermiteSpline(t, turn.displacement(which)[rows], turn.velocity(which)[rows])
    turning = curve.derivative().roots(extrapolate=False)
    seen = np.append(turn.displacement(which), curve(turning[np.isfinite(turning)]))
    return float(seen.max() - seen.min()) / 2.0
