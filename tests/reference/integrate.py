"""Event-located integration of M x'' + C x' + K x + sum d H = f + sum Re(F exp(i n w t)) by DOP853.

Between contacts the machine is linear, which nothing here makes use of but the right side, a matrix
and a force: every smooth piece is handed to scipy, which stops at the first event. The contact of a
stop is a state machine, with p how far beyond the gap:

    OPEN      y within the gaps, no force
    ENGAGED   k p + c p'
    RELEASED  beyond the gap, but the force has fallen to zero (compression-only, elasto-gap)
    OUTWARDS  k p on the way out (undamped-rebound)
    DOUBLED   2 k p, where the damper would carry more than the spring (elasto-gap)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from flipflow.model.excitation import Excitation, MovingBase, Unbalance
from flipflow.model.system import MechanicalSystem

OPEN, ENGAGED, RELEASED = "open", "engaged", "released"
OUTWARDS, DOUBLED = "outwards", "doubled"
# What each state watches, the way it crosses zero, and the state that follows: k p + c p' is the
# push, k p - c p' the spring's lead over its damper.
WATCHED = {
    ("paper", ENGAGED): [("depth", -1.0, OPEN)],
    ("compression-only", ENGAGED): [("push", -1.0, RELEASED)],
    ("compression-only", RELEASED): [("depth", -1.0, OPEN), ("push", 1.0, ENGAGED)],
    ("undamped-rebound", ENGAGED): [("rate", -1.0, OUTWARDS)],
    ("undamped-rebound", OUTWARDS): [("depth", -1.0, OPEN), ("rate", 1.0, ENGAGED)],
    ("elasto-gap", DOUBLED): [("lead", 1.0, ENGAGED)],
    ("elasto-gap", ENGAGED): [("lead", -1.0, DOUBLED), ("push", -1.0, RELEASED)],
    ("elasto-gap", RELEASED): [("depth", -1.0, OPEN), ("push", 1.0, ENGAGED)],
}
RTOL, ATOL_SHARE = 1e-11, 1e-13
STEPS_PER_TURN = 100
MOST_PIECES = 10_000
TOGETHER, NEAR = 1e-10, 1e-6  # of a turn: events closer than the first are one


@dataclass(frozen=True)
class Stop:
    """One one-sided stop: acts where side * y > gap."""

    direction: np.ndarray
    side: int
    gap: float
    stiffness: float
    damping: float
    law: str

    def depth(self, x: np.ndarray) -> float:
        """How far beyond the gap."""
        return float(self.side * (self.direction @ x) - self.gap)

    def rate(self, v: np.ndarray) -> float:
        """Its rate."""
        return float(self.side * (self.direction @ v))

    def push(self, x: np.ndarray, v: np.ndarray) -> float:
        """Force against the motion of spring and damper together."""
        return self.stiffness * self.depth(x) + self.damping * self.rate(v)

    def watched(self, what: str, x: np.ndarray, v: np.ndarray) -> float:
        """Value of one of the functions that are watched."""
        if what == "depth":
            return self.depth(x)
        if what == "rate":
            return self.rate(v)
        if what == "push":
            return self.push(x, v)
        return self.stiffness * self.depth(x) - self.damping * self.rate(v)

    def acting(self, state: str) -> tuple[float, float]:
        """Stiffness and damping that act in a state."""
        share = {ENGAGED: 1.0, OUTWARDS: 1.0, DOUBLED: 2.0}.get(state, 0.0)
        return share * self.stiffness, self.damping if state == ENGAGED else 0.0

    def state_at(self, x: np.ndarray, v: np.ndarray) -> str:
        """State as position and push say."""
        if self.depth(x) < 0.0 or (self.depth(x) == 0.0 and self.rate(v) <= 0.0):
            return OPEN
        if self.law == "undamped-rebound":
            return ENGAGED if self.rate(v) > 0.0 else OUTWARDS
        if self.law == "elasto-gap" and self.watched("lead", x, v) < 0.0:
            return DOUBLED
        return RELEASED if self.law != "paper" and self.push(x, v) < 0.0 else ENGAGED

    @property
    def entered(self) -> str:
        """State on the way in."""
        return DOUBLED if self.law == "elasto-gap" and self.damping > 0.0 else ENGAGED


@dataclass(frozen=True)
class Machine:
    """Matrices, one-sided stops, what excites it, and a constant force."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    stops: tuple[Stop, ...]
    excitations: tuple[Excitation, ...]
    static: np.ndarray

    @classmethod
    def of(cls, system: MechanicalSystem) -> Machine:
        """The same machine with every two-sided spring written as two one-sided stops."""
        stops = tuple(
            Stop(s.direction, side, gap, s.stiffness, s.damping, s.law)
            for s in system.springs
            for side, gap in zip((1, -1), s.gaps, strict=True)
            if np.isfinite(gap)
        )
        given = system.excitation
        excitations = given if isinstance(given, tuple) else (given,)
        static = np.zeros(system.size) if system.static_force is None else system.static_force
        return cls(system.M, system.C, system.K, stops, excitations, static)

    def forces(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes (m, N) and speeds (m,) of what acts from outside, sum Re(F exp(i w t))."""
        speeds = np.array([one.order * omega for one in self.excitations])
        rows = []
        for one, speed in zip(self.excitations, speeds, strict=True):
            if isinstance(one, MovingBase):
                rows.append((one.stiffness + 1j * speed * one.damping) * one.displacement)
            else:
                rows.append(one.vector * (speed**2 if isinstance(one, Unbalance) else 1.0))
        return np.array(rows, complex), speeds


@dataclass(frozen=True)
class Trajectory:
    """Pieces of dense output between the contacts, and the state at the end."""

    ends: np.ndarray
    pieces: tuple[Callable[[np.ndarray], np.ndarray], ...]
    states: tuple[tuple[str, ...], ...]
    final: np.ndarray

    def __call__(self, t: np.ndarray) -> np.ndarray:
        """States (n, 2 N) at times t."""
        owner = np.minimum(np.searchsorted(self.ends, t), self.ends.size - 1)
        found = np.empty((len(t), self.final.size))
        for piece in np.unique(owner):
            own = owner == piece
            found[own] = self.pieces[piece](t[own]).T
        return found


def flow(
    machine: Machine,
    z: np.ndarray,
    omega: float,
    start: float,
    end: float,
    rtol: float = RTOL,
    steps: int = STEPS_PER_TURN,
) -> Trajectory:
    """The motion from state z = (x, x') at time ``start`` to time ``end``.

    A contact shorter than one of the ``steps`` that a turn has at least may be overlooked.
    """
    n = machine.M.shape[0]
    z = np.array(z, float)
    states = [stop.state_at(z[:n], z[n:]) for stop in machine.stops]
    size = max((abs(stop.gap) for stop in machine.stops), default=0.0) or np.abs(z).max()
    atol = ATOL_SHARE * size * np.repeat([1.0, omega], n)
    ends, pieces, history = [], [], []
    highest = max(one.order for one in machine.excitations)
    t = start
    for _ in range(MOST_PIECES):
        events, targets = _events(machine, states)
        solution = solve_ivp(
            right_side(machine, states, omega), (t, end), z, method="DOP853", events=events,
            rtol=rtol, atol=atol, dense_output=True, first_step=min(end - t, 1e-3 / omega),
            max_step=2.0 * np.pi / omega / steps / highest,
        )  # fmt: skip
        assert solution.success, solution.message
        t, z = float(solution.t[-1]), solution.y[:, -1]
        ends.append(t)
        pieces.append(solution.sol)
        history.append(tuple(states))
        if solution.status == 0:
            return Trajectory(np.array(ends), tuple(pieces), tuple(history), z)
        for which, target in _due(events, targets, solution, 2.0 * np.pi / omega):
            states[which] = target
    raise AssertionError(f"more than {MOST_PIECES} contacts")


def _due(events: list, targets: list, solution: object, turn: float) -> list:
    """Every change due at the end of a piece: stops that touch at once switch at once."""
    t, z = float(solution.t[-1]), solution.y[:, -1]
    before = max(t - NEAR * turn, float(solution.t[0]))
    found = []
    for event, target, times in zip(events, targets, solution.t_events, strict=True):
        # scipy names one of the events that fall together, and the others never cross again.
        now, slope = event(t, z), 0.0
        if t > before:
            slope = (now - event(before, solution.sol(before))) / (t - before)
        together = abs(now) <= TOGETHER * turn * abs(slope)
        if times.size or (together and slope * event.direction > 0.0):
            found.append(target)
    return found


def amplitude(
    trajectory: Trajectory, vector: np.ndarray, start: float, end: float, count: int = 2000
) -> float:
    """Half peak-to-peak of vector @ x over [start, end], each extreme refined by a parabola."""
    n = vector.size
    t = np.linspace(start, end, count)
    y = trajectory(t)[:, :n] @ vector
    return (top(t, y, trajectory, vector) + top(t, -y, trajectory, -vector)) / 2.0


def top(t: np.ndarray, y: np.ndarray, trajectory: Trajectory, vector: np.ndarray) -> float:
    """Largest value: the zero of the velocity around the largest sample, by bisection."""
    n = vector.size
    k = int(y.argmax())
    low, high = t[max(k - 1, 0)], t[min(k + 1, t.size - 1)]

    def velocity(time: float) -> float:
        return float(trajectory(np.array([time]))[0, n:] @ vector)

    if velocity(low) * velocity(high) >= 0.0:
        return float(y[k])
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if velocity(middle) > 0.0 else (low, middle)
    return float(trajectory(np.array([low]))[0, :n] @ vector)


def right_side(
    machine: Machine, states: list[str], omega: float
) -> Callable[[float, np.ndarray], np.ndarray]:
    """z' = A z + b + Re(F exp(i w t)) with the stops that are engaged now."""
    n = machine.M.shape[0]
    K, C, constant = machine.K.copy(), machine.C.copy(), machine.static.copy()
    for stop, state in zip(machine.stops, states, strict=True):
        stiffness, damping = stop.acting(state)
        square = np.outer(stop.direction, stop.direction)
        K += stiffness * square
        C += damping * square
        constant += stop.side * stiffness * stop.gap * stop.direction
    inverse = np.linalg.inv(machine.M)
    A, b = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    A[:n, n:] = np.eye(n)
    A[n:, :n], A[n:, n:], b[n:] = -inverse @ K, -inverse @ C, inverse @ constant
    forces, speeds = machine.forces(omega)
    F = np.hstack([np.zeros_like(forces), forces @ inverse.T]).T
    # One product: (A, b, Re F, -Im F) times (z, 1, cos w t, sin w t).
    whole = np.hstack([A, b[:, None], F.real, -F.imag])
    basis = np.ones(whole.shape[1])
    own, cosines, sines = basis[: 2 * n], *np.split(basis[2 * n + 1 :], 2)

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        own[:] = z
        angles = speeds * t
        np.cos(angles, out=cosines)
        np.sin(angles, out=sines)
        return whole @ basis

    return rate


def _events(
    machine: Machine, states: list[str]
) -> tuple[list[Callable[[float, np.ndarray], float]], list[tuple[int, str]]]:
    """Terminal events of every stop in its present state, and what it becomes."""
    n = machine.M.shape[0]
    events, targets = [], []

    def add(which: int, target: str, direction: float, what: str) -> None:
        stop = machine.stops[which]

        def event(_: float, z: np.ndarray) -> float:
            return stop.watched(what, z[:n], z[n:])

        event.terminal, event.direction = True, direction
        events.append(event)
        targets.append((which, target))

    for which, (stop, state) in enumerate(zip(machine.stops, states, strict=True)):
        if state == OPEN:
            add(which, stop.entered, 1.0, "depth")
            continue
        for what, direction, target in WATCHED[stop.law, state]:
            add(which, target, direction, what)
    return events, targets
