"""One periodic motion and everything that can be read off it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.compiled.arrays import Int, Real
from flipflow.dynamics.motion import (
    ContactInterval,
    Motion,
    longest_on,
    nodes_on,
    phase_of,
    states_on,
)
from flipflow.errors import InputError
from flipflow.model.arguments import (
    checked_index,
    checked_kind,
    checked_numbers,
    checked_reals,
    takes,
)
from flipflow.model.contact_law import OPEN, WHOLE, force_in, shares
from flipflow.model.elements import ClearanceSpring
from flipflow.model.screen import unit_in
from flipflow.model.system import Coordinate, Machine, MechanicalSystem
from flipflow.periodic.solver import Point
from flipflow.periodic.stability import STABLE, full_turn, stability_words
from flipflow.results.result import Frozen, Result, above

Pieces = NDArray[np.intp]
POINTS_PER_TURN = 720  # default times in each forcing period
ZOOMS, ZOOMED = 2, 17  # how often a summit is looked at more closely, and at how many times
MOST_TOPS = 8  # summits that are looked at more closely
NEARLY = 0.98  # share of the highest sample below which no summit beside one is higher
QUANTITY = "give a function of (t, x, v, a) that returns one number for each time"


@dataclass(frozen=True, eq=False)
class Orbit(Frozen, Result):
    """A periodic motion of a machine under forcing at ``omega``.

    Time is counted from the moment the unbalance points along +x; SI units; arrays over time are
    (n,). Coordinates are named ("main", "floating", "relative") or a degree of freedom's index.

    Parameters
    ----------
    machine
        What moves so.
    point
        The motion as its solver left it.
    word
        Stability where the branch knows it better than the multipliers do.
    """

    machine: Machine
    point: Point
    word: str | None = None

    def __repr__(self) -> str:
        return f"Orbit({self.omega:.6g}{unit_in(self.machine, 'rad/s')}, {self.stability})"

    @property
    def unknowns(self) -> Real:
        """The solver's unknowns at the motion."""
        return self.point.u

    @property
    def omega(self) -> float:
        """Forcing frequency in rad/s."""
        return self.point.omega

    @property
    def return_map(self) -> Real:
        """Linearised return map of the state over a turn, or over half a turn with sign."""
        return self.point.return_map.copy()

    @property
    def system(self) -> MechanicalSystem:
        """The machine."""
        return self.point.formulation.system

    @property
    def periods(self) -> int:
        """Number of forcing periods after which the motion repeats."""
        return self.point.formulation.turns

    @property
    def period(self) -> float:
        """Duration in s after which the motion repeats."""
        return 2.0 * np.pi * self.periods / self.omega

    @cached_property
    def motion(self) -> Motion:
        """The motion as a function of time, with its record of contacts."""
        with self.point.formulation.lent() as solver:
            return solver.motion(self.unknowns, self.omega)

    @cached_property
    def t(self) -> Real:
        """Times in s over the period, both ends included, (721,)."""
        return np.linspace(0.0, self.period, POINTS_PER_TURN * self.periods + 1)

    @cached_property
    def state(self) -> Real:
        """State (x, x') at t = 0, shape (2 N,)."""
        at = self.unknowns[None], np.array([self.omega])
        with self.point.formulation.lent() as solver:
            return np.array(solver.states(*at)[0])

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers of the full period, largest modulus first, (2 N,)."""
        return full_turn(self.point.eigenvalues, half_turn=self.point.formulation.half_turn)

    @cached_property
    def monodromy(self) -> Real:
        """Linearised flow over the full period, (2 N, 2 N), saltation included."""
        M = self.return_map
        return np.asarray(M @ M if self.point.formulation.half_turn else M)

    @cached_property
    def stability(self) -> str:
        """Whether it returns after a small disturbance: "stable", "unstable", "undetermined"."""
        if self.word is not None:
            return self.word
        return str(stability_words(self.point.eigenvalues[None], None)[0])

    @property
    def stable(self) -> bool:
        """Whether ``stability`` is "stable"."""
        return self.stability == STABLE

    @cached_property
    def error(self) -> float:
        """Estimated distance in m from the exact motion; infinite where there is no estimate."""
        with self.point.formulation.lent() as solver:
            return float(solver.errors(self.unknowns[None], np.array([self.omega]))[0])

    def displacement(self, which: Coordinate, t: ArrayLike | None = None) -> Real:
        """Displacement of a coordinate in m at times t (default: :attr:`t`)."""
        return self._along(which, t, 0)

    def velocity(self, which: Coordinate, t: ArrayLike | None = None) -> Real:
        """Velocity of a coordinate in m/s at times t (default: :attr:`t`)."""
        return self._along(which, t, 1)

    def acceleration(self, which: Coordinate, t: ArrayLike | None = None) -> Real:
        """Acceleration of a coordinate in m/s^2 at times t; it jumps where a damped stop acts."""
        return self._along(which, t, 2)

    def stop_force(self, spring: int = 0, t: ArrayLike | None = None) -> Real:
        """Force H of a stop in N at times t (default: :attr:`t`), positive against +d."""
        times = np.mod(self._times(t), self.period)
        flat = np.atleast_1d(times).ravel()
        piece = self.motion.piece(flat)
        x, v, _ = states_on(self.motion, flat, piece)
        return self._force(spring, x, v, piece).reshape(times.shape)

    def amplitude(self, which: Coordinate) -> float:
        """Half peak-to-peak of a coordinate over the period, in m; from the exact extremes."""
        low, high, _ = self._extremes(which)
        return (high - low) / 2.0

    def mean(self, which: Coordinate) -> float:
        """Middle between the greatest and the least value of a coordinate, in m."""
        low, high, _ = self._extremes(which)
        return (high + low) / 2.0

    def phase(self, which: Coordinate) -> float:
        """Phase of the first harmonic against the exciting force in rad; positive: it leads.

        NaN where there is none, as in a motion that nothing excites once a turn.
        """
        low, high, first = self._extremes(which)
        return float(phase_of(np.asarray(first), np.asarray(0.5 * (high - low))))

    @property
    def contact_intervals(self) -> tuple[ContactInterval, ...]:
        """Every touch of every stop with a gap within the period."""
        kept = self._given.opening
        return tuple(
            replace(touch, spring=kept[touch.spring]) for touch in self.motion.contact_intervals()
        )

    def contact_share(self, spring: int = 0) -> float:
        """Share of the period during which a stop has a force, 0 to 1; 1 for one without gap."""
        if self._spring(spring).bonded:
            return 1.0
        touches = (c for c in self.contact_intervals if c.spring == spring)
        return sum(c.end - c.start for c in touches) / self.period

    def peak(self, quantity: Callable[[Real, Real, Real, Real], Real]) -> float:
        """Greatest |quantity| over the period.

        ``quantity(t, x, v, a)`` gets times (K,) and displacement, velocity, acceleration (K, N) on
        a grid with both sides of every change of contact, and returns (K,); then on finer and finer
        ones about the highest point, within one piece.
        """
        if not takes(quantity, 4):
            raise InputError("quantity", quantity, QUANTITY)

        def size(t: Real, states: Real) -> Real:
            values = checked_reals("quantity", quantity(t.copy(), *states.copy()), QUANTITY)
            if values.shape != t.shape:
                raise InputError("quantity", values, QUANTITY)
            return np.abs(values)

        t, piece, states = self._grid
        values = size(t, states)
        best, tops = float(values.max()), _tops(values, piece)
        rows = np.arange(tops.size)
        low, high = np.maximum(tops - 1, 0), np.minimum(tops + 1, t.size - 1)
        low, high = (np.where(piece[one] == piece[tops], one, tops) for one in (low, high))
        begin, end, same = t[low], t[high], np.repeat(piece[tops], ZOOMED)
        for _ in range(ZOOMS):
            fine = np.linspace(begin, end, ZOOMED, axis=1)
            at = fine.ravel()
            seen = size(at, states_on(self.motion, at, same)).reshape(fine.shape)
            top = seen.argmax(axis=1)
            begin = fine[rows, np.maximum(top - 1, 0)]
            end = fine[rows, np.minimum(top + 1, ZOOMED - 1)]
        return max([best, *map(_summit, seen)])

    def stop_force_peak(self, spring: int = 0) -> float:
        """Greatest |H| of a stop over the period in N."""
        stop = self._spring(spring)
        regime = self._regime(spring, np.arange(self.motion.start.size))
        f_k, f_c = shares(stop.law, regime)
        still, nothing = np.zeros(regime.shape), np.zeros((regime.size, self.system.size))
        constant = force_in(stop.law, stop.stiffness, stop.damping, stop.gaps, regime, still, still)
        stiffness = np.outer(f_k * stop.stiffness, stop.direction)
        damping = np.outer(f_c * stop.damping, stop.direction)
        return longest_on(self.motion, np.stack([stiffness, damping, nothing], axis=1), constant)

    def mean_square_velocity(self, which: Coordinate, spring: int | None = None) -> float:
        """Mean of (d x')^2 over the period in m^2/s^2, by Gauss quadrature on every piece.

        With ``spring``, only the time is counted during which that stop's damper acts; what the
        stop takes is :meth:`stop_power`.
        """
        vector = self.system.coordinate(which)
        if spring is not None:
            self._spring(spring)

        def square(t: Real, piece: Pieces) -> Real:
            rate = self.motion.piece_derivative(t, piece, 1) @ vector
            if spring is None:
                return np.asarray(rate**2)
            _, damped = shares(self._spring(spring).law, self._regime(spring, piece))
            return np.asarray(rate**2 * damped)

        return self._mean(square)

    def stop_power(self, spring: int = 0) -> float:
        """Mean power that a stop takes in W: the mean of H y' over the period, by Gauss quadrature.

        It is what its damping takes, and what its spring still holds where the law lets go early.
        """
        stop = self._spring(spring)

        def power(t: Real, piece: Pieces) -> Real:
            x, v, _ = states_on(self.motion, t, piece)
            return self._force(spring, x, v, piece) * (v @ stop.direction)

        return self._mean(power)

    def input_power(self) -> float:
        """Mean power that the excitation feeds in, W."""
        speeds = [1j * order * self.omega for order in self.system.orders]
        forces = [self.system.force(self.omega, order) for order in self.system.orders]

        def power(t: Real, piece: Pieces) -> Real:
            turns = np.exp(np.outer(t, speeds))
            rate = self.motion.piece_derivative(t, piece, 1)
            return np.asarray(np.sum((turns @ forces).real * rate, axis=1))

        return self._mean(power)

    def sensitivity(
        self, quantity: str | tuple[str, Coordinate], names: Sequence[str]
    ) -> NDArray[Any]:
        r"""Exact derivatives of what is read off the motion, as it moves with parameters.

        With the flow :math:`\varphi` over the period, z = phi(z, p) gives the state's
        :math:`z_p = (I - M)^{-1} \varphi_p`, M the monodromy matrix; what is read off follows by
        the chain rule along the motion, own dependence on a parameter included.

        Parameters
        ----------
        quantity
            "state" at t = 0, "multipliers", a quantity of the machine such as "stop_force", or a
            reading with its coordinate or spring: ("amplitude", "relative"), ("mean", 0),
            ("phase", 0), ("mean_square_velocity", 0), ("contact_share", 0),
            ("stop_force_peak", 0).
        names
            P parameters: fields of the machine, or of a plain system "forcing" and places such
            as "springs[0].clearance"; and "omega".

        Returns
        -------
        ndarray
            In SI, (P,); of the state (2 N, P), of the multipliers (2 N, P), complex, NaN where two
            of them coincide.

        Raises
        ------
        InputError
            For an unknown quantity or name, and where the machine has a kink in a parameter.
        IncompleteError
            At a fold, and where a derivative has two sides: at grazing under a law whose force
            kicks on entry (for multipliers and times of contact under every law), at two peaks of
            one height.
        """
        found = above("studies.derivatives", "orbit_sensitivity")(self, quantity, names)
        return cast("NDArray[Any]", found)

    def _mean(self, function: Callable[[Real, Pieces], Real]) -> float:
        t, piece, weight = nodes_on(self.motion)
        return float(weight @ function(t, piece))

    def _times(self, t: ArrayLike | None) -> Real:
        return self.t if t is None else checked_numbers("t", t, "give finite times in s")

    def _along(self, which: Coordinate, t: ArrayLike | None, order: int) -> Real:
        times = self._times(t)
        return np.asarray(self.motion.derivative(times, order) @ self.system.coordinate(which))

    @cached_property
    def _grid(self) -> tuple[Real, Pieces, Real]:
        """Times, pieces, and x, x', x'' (3, K, N) on the motion's own grid."""
        t, piece = self.motion.samples()
        return t, piece, states_on(self.motion, t, piece)

    @property
    def touches(self) -> bool:
        """Whether any stop carries a force during the period; one without gap always does."""
        always = any(spring.bonded for spring in self._given.springs)
        return always or bool(self.contact_intervals)

    @cached_property
    def _given(self) -> MechanicalSystem:
        """The machine with all its springs, those too that never open or never act."""
        return self.machine.system()

    def _spring(self, number: int) -> ClearanceSpring:
        count = len(self._given.springs)
        remedy = f"the machine has {count} springs, from 0 on"
        return self._given.springs[checked_index("spring", number, count, remedy)]

    def _regime(self, spring: int, piece: Pieces) -> Int:
        """Regime of a spring in each piece: one without gap always pushes."""
        if self._spring(spring).bonded:
            return np.full(piece.shape, WHOLE)
        if spring not in self._given.opening:
            return np.full(piece.shape, OPEN)
        return np.asarray(self.motion.regime[piece, self._given.opening.index(spring)])

    def _force(self, spring: int, x: Real, v: Real, piece: Pieces) -> Real:
        """Force of a spring of the machine as it was given, at displacement and velocity (K, N)."""
        stop, regime = self._spring(spring), self._regime(spring, piece)
        y, rate = x @ stop.direction, v @ stop.direction
        return force_in(stop.law, stop.stiffness, stop.damping, stop.gaps, regime, y, rate)

    @cached_property
    def _seen(self) -> dict[bytes, tuple[float, float, complex]]:
        """Extremes and first harmonic of the coordinates that were asked for."""
        return {}

    def _extremes(self, which: Coordinate) -> tuple[float, float, complex]:
        vector = self.system.coordinate(which)
        key = vector.tobytes()
        if key not in self._seen:
            low, high, first = self.motion.extremes(vector[None])
            self._seen[key] = float(low[0]), float(high[0]), complex(first[0])
        return self._seen[key]


def checked_orbit(name: str, orbit: object) -> Orbit:
    """A motion, and nothing else."""
    remedy = "give a motion, for example one of ff.periodic_orbits"
    return checked_kind(name, orbit, Orbit, remedy)


def state_at_rest(system: MechanicalSystem) -> Real:
    """State (x, x') of the machine standing still, (2 N,)."""
    return np.concatenate([system.static_position(), np.zeros(system.size)])


def initial_state(system: MechanicalSystem, initial: str | Orbit | ArrayLike) -> Real:
    """State (x, x') from "rest", an orbit or numbers, (2 N,)."""
    size = system.size
    remedy = f"give {2 * size} finite numbers, (x, x')"
    if isinstance(initial, Orbit):
        if initial.state.size != 2 * size:
            raise InputError("initial", initial, "give an orbit of this machine")
        return initial.state
    if isinstance(initial, str):
        if initial != "rest":
            raise InputError("initial", initial, 'give "rest", an orbit, or a state (x, x\')')
        return state_at_rest(system)
    state = checked_numbers("initial", initial, remedy)
    if state.shape != (2 * size,):
        raise InputError("initial", initial, remedy)
    return state


def _summit(values: Real) -> float:
    """Top of the parabola through the highest sample and its neighbours."""
    k = int(values.argmax())
    if k in (0, values.size - 1):
        return float(values[k])
    a, b, c = values[k - 1 : k + 2].tolist()
    curvature = a - 2.0 * b + c
    return b - (c - a) ** 2 / (8.0 * curvature) if curvature < 0.0 else b


def _tops(values: Real, piece: Pieces) -> Pieces:
    """Indices of samples no lower than those beside them in their piece, and nearly the highest."""
    change = np.diff(piece) != 0
    rising = np.concatenate([[True], change | (np.diff(values) >= 0.0)])
    falling = np.concatenate([change | (np.diff(values) <= 0.0), [True]])
    tops = np.flatnonzero(rising & falling & (values >= NEARLY * values.max()))
    return tops[np.argsort(-values[tops], kind="stable")[:MOST_TOPS]]
