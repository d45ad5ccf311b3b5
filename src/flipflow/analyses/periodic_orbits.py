"""Every periodic motion found at one frequency, mirror images too."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flipflow.analyses.frequency_response import first_unknowns
from flipflow.errors import InputError
from flipflow.methods.exact import ExactSolver
from flipflow.methods.solver import Point, Real
from flipflow.methods.two_event import TwoEventProblem
from flipflow.model.system import Machine, MechanicalSystem, system_of
from flipflow.results.orbit import Orbit

STARTS = 64
SETTLING_TURNS = 60
SAME = 1e-6


def periodic_orbits(
    machine: Machine, omega: float, max_periods: int = 1, rng: int | np.random.Generator = 0
) -> tuple[Orbit, ...]:
    """Periodic motions of one forcing period at ``omega``, stable and unstable.

    Starts: the motion reached from below; for one symmetric stop, every zero of the scalar problem
    of two-touch motions; rest, and a low-discrepancy cloud of states as large as the linear motion
    or the gaps. Each is tried as it is (unstable motions are found so) and after some turns of
    settling. Newton on the exact flow over a whole turn, so that motions need not be
    symmetric; for a machine that is its own mirror image every motion's mirror image is one too.

    Parameters
    ----------
    machine
        A screen or a :class:`~flipflow.MechanicalSystem`.
    omega
        Forcing frequency in rad/s.
    max_periods
        Forcing periods after which a motion may repeat: 1.
    rng
        Seed or generator for the cloud of starts.

    Returns
    -------
    tuple of Orbit
        Without duplicates, largest relative motion at the first gap first. A search, not a proof:
        a motion with a small basin and weak instability can be missed.

    Raises
    ------
    InputError
        For a frequency that is not finite or not above 0.
    """
    if max_periods != 1:
        raise InputError(
            "max_periods", max_periods, "motions of one forcing period are searched: 1"
        )
    number = isinstance(omega, (int, float)) and not isinstance(omega, bool)
    if not (number and math.isfinite(omega) and omega > 0.0):
        raise InputError("omega", omega, "give a finite frequency above 0 rad/s")
    solver = ExactSolver(system_of(machine), half_turn=False)
    found: list[Point] = []
    for start in _starts(solver, omega, np.random.default_rng(rng)):
        for turns in (0, SETTLING_TURNS):
            z = solver.settled(start, omega, turns) if turns else start
            point = solver.solve(z, omega)
            if point is None:
                continue
            _keep(found, point, solver)
            if solver.system.symmetric:
                _keep(found, _mirrored(solver, point), solver)
    orbits = [Orbit(machine, point) for point in found]
    which = _first_gap(solver.system)
    return tuple(sorted(orbits, key=lambda o: (-_reach(o, which), -o.state @ which)))


def _starts(solver: ExactSolver, omega: float, rng: np.random.Generator) -> list[Real]:
    """Rest, the motion from below, two-touch motions, and a cloud of states."""
    from scipy.stats import qmc  # noqa: PLC0415  slow to import, and few ask for all motions

    n = solver.system.size
    X = np.abs(solver.builder.contact_free(np.array([omega]))[0])
    gaps = [g for s in solver.builder.springs for g in s.gaps if math.isfinite(g)]
    size = np.maximum(2.0 * X, 3.0 * max(gaps, default=0.0))
    box = np.concatenate([size, omega * size])
    cloud = (
        qmc.Sobol(2 * n, rng=rng).random(STARTS) if solver.builder.springs else np.zeros((0, 2 * n))
    )
    starts = [np.zeros(2 * n), first_unknowns(solver, omega), *((2.0 * cloud - 1.0) * box)]
    if TwoEventProblem.applies(solver.builder):
        starts += list(TwoEventProblem(solver.builder).states(omega)[0])
    return starts


def _keep(found: list[Point], point: Point, solver: ExactSolver) -> None:
    """Add a point unless it is known."""
    scale = np.concatenate(
        [np.full(solver.system.size, 1.0), np.full(solver.system.size, point.omega)]
    )
    for known in found:
        size = np.abs(known.u / scale).max() + solver.length
        if np.abs((known.u - point.u) / scale).max() < SAME * size:
            return
    found.append(point)


def _mirrored(solver: ExactSolver, point: Point) -> Point:
    """The mirror image: minus the state half a turn later."""
    half = solver.motion(point.u, point.omega)
    t = math.pi / point.omega
    state = -np.concatenate([half.derivative(t, 0), half.derivative(t, 1)])
    mirrored = solver.solve(state, point.omega)
    return point if mirrored is None else mirrored


def _first_gap(system: MechanicalSystem) -> NDArray[np.float64]:
    n = system.size
    direction = system.springs[0].direction if system.springs else np.eye(n)[0]
    return np.concatenate([direction, np.zeros(n)])


def _reach(orbit: Orbit, which: Real) -> float:
    """Half peak-to-peak at the first gap, in m, in steps that hide rounding between mirrors."""
    vector = which[: orbit.system.size]
    low, high, _ = orbit.point.solver.extremes(
        orbit.unknowns[None], np.array([orbit.omega]), vector[None]
    )
    return round(float(high[0, 0] - low[0, 0]) / 2.0, 9)
