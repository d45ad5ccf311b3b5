"""Quantities of many variants of a machine at many frequencies, read off lanes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.lane_readings import Asked, Readings
from flipflow.batch.reasons import FOUND, NOT_COMPUTED, REFUSED
from flipflow.batch.solutions import nearby_motions, nothing_asked, solve_lanes
from flipflow.batch.variants import Batch, batches
from flipflow.dynamics.normal import normal_amplitude
from flipflow.model.quantities import BranchWord, Quantity, leading_coordinate
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem
from flipflow.studies.quantity_values import MOTION_VALUES, Frame, fields_of_rows, vector_terms

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Int = NDArray[np.int64]
Columns = Mapping[str, NDArray[Any]]
Tell = Callable[[float], None]

# Peaks of vectors by name, and the quantities that are read off them.
VECTORS: Mapping[str, tuple[str, ...]] = {
    "main": ("main_frame_acceleration",),
    "floating": ("floating_frame_acceleration",),
    "foundation": ("foundation_force", "support_force"),
    "shear": ("shear_piece_force",),
    "bearing": ("bearing_load", "bearing_life"),
}
ABOVE = 1.001  # least factor on the highest frequency at which one that falls begins
OF_STOPS = ("stop_force", "stop_piece_force")
SQUARED = ("shear_piece_power", "shear_temperature_rise")


def on_lanes(machine: Machine, quantity: Quantity) -> bool:
    """Whether lanes tell a quantity of a machine."""
    if quantity.of != "motion" or quantity.of_folds:
        return False
    return isinstance(machine, FlipFlowScreen) or quantity.name != "dissipated_power"


def lane_values(
    machine: Machine,
    columns: Columns,
    quantities: Sequence[Quantity],
    omega: Real,
    span: tuple[float, float],
    branch: BranchWord,
    threads: int = 1,
    tell: Tell | None = None,
) -> tuple[dict[str, Real], Int]:
    """Quantities (S, K) by name of S variants at K frequencies, and why one has none, (S, K).

    Parameters
    ----------
    machine
        The machine whose parameters are changed.
    columns
        Values by parameter, SI, (S,) each.
    quantities
        Quantities for which :func:`on_lanes` holds.
    omega
        Frequencies in rad/s, (K,), in any order.
    span
        Frequencies analysed: an upper or a lower motion is one reached from its ends.
    branch
        Which motion is meant where several exist.
    threads, tell
        As of :func:`~flipflow.batch.solutions.solve_lanes`.

    Returns
    -------
    tuple
        Values, NaN where there is none; reasons of :mod:`flipflow.batch.reasons`.
    """
    rows = len(next(iter(columns.values())))
    values = {one.name: np.full((rows, omega.size), np.nan) for one in quantities}
    reason = np.full((rows, omega.size), NOT_COMPUTED)
    groups, allowed = batches(machine, columns)
    reason[~allowed] = REFUSED
    for batch in groups:
        question = _Question(machine, columns, tuple(quantities), batch, threads, tell)
        found, why = question.rising(omega)
        if branch != "from-below":
            other, why_other = question.falling(omega, span[1])
            found, why = _outermost(found, why, other, why_other, branch)
        reason[batch.rows] = why
        for name, table in values.items():
            table[batch.rows] = np.where(why == FOUND, found[name], np.nan)
    return values, reason


Answer = tuple[dict[str, Real], Int]
# Names of the leading amplitude, of the jumps of the path, and of whether an even machine leans,
# beside those of the quantities.
SIZE, JUMPS, LEANS = "", "jumps", "leans"
RINGS = 8  # parts of a distance within which jumps are looked for
ONE_MOTION = 1e-6  # share within which two amplitudes are of one motion


def jump_distance(
    machine: Machine,
    columns: Columns,
    omega: float,
    most: float,
    span: tuple[float, float],
    threads: int = 1,
) -> Real:
    """Distance |omega - jump| / jump of S variants from their nearest jump, (S,), at most ``most``.

    Lanes rise and fall through rings around omega. Where they jump, part or meet, where their
    motion is lost to one of more periods, and where it begins to lean, is a jump. Distances are
    rounded down to a ring's edge, and 0 where two motions or none stand at omega. A jump and the
    one back may be missed where they lie within one ring.

    Parameters
    ----------
    machine, columns, span, threads
        As of :func:`lane_values`.
    omega
        Frequency in rad/s.
    most
        Distance beyond which none counts, below 1.
    """
    steps = most * np.arange(RINGS, 0, -1) / RINGS
    speeds = omega / np.concatenate([1.0 + steps, [1.0], 1.0 - steps[::-1]])
    inner = np.concatenate([steps[1:], [0.0, 0.0], steps[:0:-1]])  # edge of each ring, (2 RINGS,)
    rows = len(next(iter(columns.values())))
    nearest = np.full(rows, np.nan)
    for batch in batches(machine, columns)[0]:
        question = _Question(machine, columns, (), batch, threads, None)
        up, down, same = question.both_ways(speeds, span[1])
        told = (up[JUMPS], down[JUMPS], up[LEANS], down[LEANS], same.astype(float))
        jumped = np.any([np.diff(one, axis=1) != 0.0 for one in told], axis=0)
        near = np.where(jumped, inner, most).min(axis=1)
        nearest[batch.rows] = np.where(same[:, RINGS], near, 0.0)
    return nearest


def one_motion(
    machine: Machine, columns: Columns, omega: Real, span: tuple[float, float], threads: int = 1
) -> NDArray[np.bool_]:
    """Whether S variants come to the same motion at frequencies (K,) from below and above, (S, K).

    Parameters are those of :func:`lane_values`.
    """
    rows = len(next(iter(columns.values())))
    alone = np.zeros((rows, omega.size), bool)
    for batch in batches(machine, columns)[0]:
        question = _Question(machine, columns, (), batch, threads, None)
        alone[batch.rows] = question.both_ways(omega, span[1])[2]
    return alone


@dataclass(frozen=True, eq=False)
class _Question:
    """What is asked of one batch."""

    machine: Machine
    columns: Columns
    quantities: tuple[Quantity, ...]
    batch: Batch
    threads: int
    tell: Tell | None

    def rising(self, omega: Real) -> Answer:
        """Values and reasons at frequencies as they are reached while the speed rises."""
        order = np.argsort(omega, kind="stable")
        return _in_order(*self._solved(omega[order]), np.argsort(order, kind="stable"))

    def falling(self, omega: Real, top: float) -> Answer:
        """Values and reasons at frequencies as they are reached while the speed falls."""
        order = np.argsort(-omega, kind="stable")
        begin = max(top, ABOVE * float(omega.max()))
        solved = self._solved(np.concatenate([[begin], omega[order]]))
        return _in_order(*solved, 1 + np.argsort(order, kind="stable"))

    def both_ways(
        self, omega: Real, top: float
    ) -> tuple[dict[str, Real], dict[str, Real], NDArray[np.bool_]]:
        """Values from below and from above, and where both are of one motion, (L, K)."""
        (up, why), (down, why_down) = self.rising(omega), self.falling(omega, top)
        same = np.abs(up[SIZE] - down[SIZE]) <= ONE_MOTION * np.maximum(up[SIZE], down[SIZE])
        return up, down, same & (why == FOUND) & (why_down == FOUND)

    def _solved(self, omega: Real) -> Answer:
        nearby = nearby_motions(self.machine.system().with_bonded(), self.batch.system, omega)
        rows = self.batch.rows
        own = {name: column[rows] for name, column in self.columns.items()}
        of_screen = isinstance(self.machine, FlipFlowScreen)
        fields = fields_of_rows(self.machine, own) if of_screen else {}
        plan = _Plan(self.machine, self.batch, fields, omega, self.quantities)
        found, read = solve_lanes(self.batch, omega, plan.asked, nearby, self.threads, self.tell)
        told = _LaneMotions(plan, read)
        values = {one.name: told.value(one) for one in self.quantities}
        of_path = {
            SIZE: told.amplitude(plan.leading),
            JUMPS: found.jumps.astype(float),
            LEANS: found.leaning.astype(float),
        }
        return values | of_path, found.reason


def _in_order(values: dict[str, Real], why: Int, order: Int) -> Answer:
    return {name: one[:, order] for name, one in values.items()}, why[:, order]


def _outermost(
    one: dict[str, Real], why: Int, two: dict[str, Real], why_two: Int, branch: BranchWord
) -> Answer:
    """Of two motions the one of larger or of smaller leading amplitude; the one there is."""
    first = np.where(why == FOUND, one[SIZE], np.nan)
    second = np.where(why_two == FOUND, two[SIZE], np.nan)
    take = second > first if branch == "upper" else second < first
    take |= np.isnan(first) & ~np.isnan(second)
    return {name: np.where(take, two[name], one[name]) for name in one}, np.where(
        take, why_two, why
    )


@dataclass(frozen=True, eq=False)
class _Plan:
    """What lanes are to read at K frequencies."""

    machine: Machine
    batch: Batch
    fields: Mapping[str, Real]
    omega: Real
    quantities: tuple[Quantity, ...]

    @property
    def system(self) -> MechanicalSystem:
        """One of the machines."""
        return self.batch.system

    @cached_property
    def bonded(self) -> Real:
        """k d and c d of springs without gap whose forces are read, (L, B, 2, N)."""
        asked = {one.name for one in self.quantities} & set(OF_STOPS)
        return self.batch.bonded if asked else self.batch.bonded[:, :0]

    @property
    def leading(self) -> Any:
        """The coordinate by which motions are compared."""
        return leading_coordinate(self.system)

    @cached_property
    def coordinates(self) -> list[tuple[float, ...]]:
        """Vectors of the coordinates that are read, each once; the leading one first."""
        names = {one.name for one in self.quantities}
        wanted: list[Any] = [self.leading]
        wanted += [one.coordinate for one in self.quantities if one.coordinate is not None]
        wanted += ["main"] if names & {"main_amplitude", "dissipated_power"} else []
        wanted += ["floating"] if "floating_amplitude" in names else []
        vectors = [tuple(self.system.coordinate(one).tolist()) for one in wanted]
        return list(dict.fromkeys(vectors))

    @cached_property
    def vectors(self) -> list[str]:
        """Names of the vectors whose peaks are read."""
        names = {one.name for one in self.quantities}
        return [vector for vector, needed in VECTORS.items() if names & set(needed)]

    @cached_property
    def asked(self) -> Asked:
        """What the lanes are to read."""
        squared = {one.name for one in self.quantities} & set(SQUARED)
        asked = nothing_asked(self.system.size, self.omega.size)._replace(
            coordinate=np.array(self.coordinates),
            squared=np.array([[1.0, -1.0]] if squared else []).reshape(-1, self.system.size),
        )
        lanes, bonded = self.bonded.shape[:2]
        peaks = len(self.vectors) + bonded
        if peaks == 0:
            return asked
        linear = np.zeros((lanes, peaks, 3, self.system.size))
        along, across = np.zeros((2, lanes, self.omega.size, peaks), np.complex128)
        for q, name in enumerate(self.vectors):
            self._set_vector(name, linear[:, q], along[:, :, q], across[:, :, q])
        linear[:, len(self.vectors) :, :2] = self.bonded
        return asked._replace(linear=linear, along=along, across=across)

    def _set_vector(self, name: str, linear: Real, along: Complex, across: Complex) -> None:
        """Coefficients (L, 3, 2) of x, x', x'' and harmonics (L, K) of one vector of a screen."""
        field = self.fields.__getitem__
        terms, along[:], across[:] = vector_terms(name, field, self.omega, self.normal, self.sense)
        for (derivative, degree), value in terms.items():
            linear[:, derivative, degree] = np.ravel(value)

    @property
    def sense(self) -> float:
        """+1 or -1, as the unbalance turns."""
        return self.machine.normal_sense if isinstance(self.machine, FlipFlowScreen) else 1.0

    @cached_property
    def normal(self) -> Complex:
        """Y in m, both frames as one mass normal to the surface."""
        f = self.fields
        mass = f["main_mass"] + f["floating_mass"]
        Y = normal_amplitude(
            mass, f["normal_damping"], f["normal_stiffness"], f["eccentric_moment"], self.omega
        )
        return np.asarray(self.sense * Y)


@dataclass(frozen=True, eq=False)
class _LaneMotions:
    """The motions of L lanes at K frequencies; every answer is (L, K)."""

    plan: _Plan
    read: Readings

    @property
    def omega(self) -> Real:
        """Frequencies in rad/s, (K,)."""
        return self.plan.omega

    def value(self, quantity: Quantity) -> Real:
        """One quantity."""
        if quantity.part is not None and quantity.coordinate is not None:
            return np.asarray(getattr(self, quantity.part)(quantity.coordinate))
        told = MOTION_VALUES[quantity.name](self)
        return np.array(np.broadcast_to(told, self.read.approach.shape))

    def _place(self, which: Any) -> int:
        return self.plan.coordinates.index(tuple(self.plan.system.coordinate(which).tolist()))

    def field(self, name: str) -> Real:
        return self.plan.fields[name]

    def amplitude(self, which: Any) -> Real:
        g = self._place(which)
        return np.asarray(0.5 * (self.read.high[..., g] - self.read.low[..., g]))

    def phase(self, which: Any) -> Real:
        return np.angle(self.read.first[..., self._place(which)])

    def offset(self) -> Real:
        g = self._place("relative")
        return np.abs(0.5 * (self.read.high[..., g] + self.read.low[..., g]))

    def reach(self) -> Real:
        g = self._place("relative")
        return np.maximum(self.read.high[..., g], -self.read.low[..., g])

    def normal_amplitude(self) -> Real:
        return np.abs(self.plan.normal)

    def peak_acceleration(self, frame: Frame) -> Real:
        return self._peak(frame)

    def foundation_force(self) -> Real:
        return self._peak("foundation")

    def stop_force(self) -> Real:
        always = self.read.peak[..., len(self.plan.vectors) :]
        forces = np.concatenate([self.read.force, always], axis=2)
        return np.asarray(forces.max(axis=2, initial=0.0))

    def shear_force(self) -> Real:
        return self._peak("shear")

    def shear_power(self) -> Real:
        return np.asarray(self.field("shear_damping") * self.read.square[..., 0])

    def approach_speed(self) -> Real:
        return self.read.approach

    def bearing_load(self) -> Real:
        return self._peak("bearing")

    def dissipated_power(self) -> Real:
        X = self.read.first[..., self._place("main")]
        force = self.field("eccentric_moment") * self.omega**2
        across = self.field("normal_damping") * (self.omega * np.abs(self.plan.normal)) ** 2
        return np.asarray(0.5 * (across - self.omega * force * X.imag))

    def jump_margin(self) -> Real:
        return np.full(self.read.approach.shape, np.nan)

    def _peak(self, name: str) -> Real:
        return self.read.peak[..., self.plan.vectors.index(name)]
