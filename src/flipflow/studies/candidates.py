"""Candidates for a duty: from numbers between 0 and 1 to machines, and what each is like.

A candidate is judged under every load case, at every temperature and at every corner of the
scatter of its parts, all of them lanes of one call. It is as bad as its worst.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flipflow.batch.reasons import FOUND
from flipflow.batch.side_by_side import processors
from flipflow.compiled.arrays import Real
from flipflow.model.duty import Duty, Objective, SpringType
from flipflow.model.fields import FIELD
from flipflow.model.limits import limit_bounds
from flipflow.model.quantities import QUANTITIES, Quantity
from flipflow.model.screen import FlipFlowScreen, Load
from flipflow.model.vary import Choice, Interval
from flipflow.studies.rubber_temperature import warmed_load
from flipflow.studies.study_values import evaluate_loaded, jump_distance_loaded, one_motion_loaded

Columns = dict[str, NDArray[Any]]
TARGET, MOTION, EVEN = "relative amplitude asked", "a stable motion", "a motion that does not lean"
STRAIN, FORCE = "strain of the catalogue", "force of the catalogue"
ALONE = "one motion at speed"
JUMP = "jump_margin"
AMPLITUDE, OFFSET = "relative_amplitude", "relative_offset"
MET = 1e-6  # excess up to which a constraint counts as met: a polish ends on what binds
BUILT = 1024  # machines of which the yield is a share; Sobol's sequence wants a power of 2
SIGNIFICANT = 12  # digits of a field, so that one that was rounded is told by as few
LEAN = 1e-2  # share of the amplitude by which equal gaps may be left to one side
READ: Mapping[Objective, str] = {
    "acceleration": "floating_frame_acceleration",
    "stop force": "stop_force",
    "foundation force": "foundation_force",
    "power": "dissipated_power",
}


def quantity_of(name: str) -> Quantity:
    """The quantity of an objective; the band is one of amplitudes."""
    return QUANTITIES[READ.get(name, AMPLITUDE)]  # type: ignore[call-overload]


def label_of(constraint: str) -> str:
    """A constraint, or the least or greatest of a field, in words."""
    if constraint in QUANTITIES:
        return QUANTITIES[constraint].label
    end, _, name = constraint.partition(" ")
    return f"{end} {FIELD[name].key}" if name in FIELD else constraint


@dataclass(frozen=True)
class Gene:
    """One number between 0 and 1, and what it stands for."""

    name: str
    low: float
    high: float
    values: tuple[float, ...] = ()

    def decoded(self, u: Real) -> Real:
        """Values of the field at shares (C,)."""
        if self.values:
            return np.asarray(np.asarray(self.values)[self.index(u)])
        values = self.low + u * (self.high - self.low)
        return np.array([float(f"{one:.{SIGNIFICANT}g}") for one in values.tolist()])

    def index(self, u: Real) -> NDArray[np.int64]:
        """Which of the values a share stands for."""
        count = len(self.values)
        return np.asarray(np.minimum((u * count).astype(np.int64), count - 1))

    def share_of(self, value: float) -> float:
        """The share that stands for a value, kept within the gene's ends."""
        if self.values:
            place = int(np.argmin(np.abs(np.asarray(self.values) - value)))
            return (place + 0.5) / len(self.values)
        return float(np.clip((value - self.low) / (self.high - self.low), 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Judged:
    """What C candidates are like; arrays with the candidates first.

    Parameters
    ----------
    amplitude
        Relative amplitude in m under every combination, (C, J); NaN where there is none.
    worst
        Greatest value of each quantity over all combinations, SI, (C,).
    excess
        By what each constraint is missed, as a share of it; at most 0 where it is met, (C, G).
    """

    amplitude: Real
    worst: Mapping[str, Real]
    excess: Real

    @property
    def band(self) -> Real:
        """Greatest less least relative amplitude in m; infinite where one has none."""
        known = np.isfinite(self.amplitude).all(axis=1)
        spread = np.full(known.size, np.inf)
        spread[known] = np.ptp(self.amplitude[known], axis=1)
        return spread

    @property
    def fits(self) -> NDArray[np.bool_]:
        """Whether every constraint is met."""
        return np.asarray((self.excess <= MET).all(axis=1))

    def objective(self, name: Objective) -> Real:
        """What is to be small, (C,)."""
        return self.band if name == "steadiness" else self.worst[READ[name]]


@dataclass(frozen=True, eq=False)
class Space:
    """All candidates of a duty.

    Parameters
    ----------
    duty
        What is asked.
    near
        A machine near those looked at, whose range of speeds is theirs; None: that of the duty.
    margin_as_built
        Whether machines with all parts at one end of their scatter have to keep the margin to the
        jump, too, not the drawing alone.
    """

    duty: Duty
    near: FlipFlowScreen | None = None
    margin_as_built: bool = True

    @property
    def screen(self) -> FlipFlowScreen:
        """The machine to begin with."""
        return self.near or self.duty.project.screen

    def around(self, u: Real) -> Space:
        """The same candidates, looked at from one of them, (D,)."""
        return replace(self, near=self.machine(u))

    @cached_property
    def springs(self) -> tuple[tuple[SpringType, int], ...]:
        """Every spring of the catalogue with every number of pieces, softest first."""
        low, high = self.duty.pieces
        all_of = itertools.product(self.duty.catalogue, range(low, high + 1))
        return tuple(sorted(all_of, key=lambda one: (one[0].stiffness * one[1], one[0].name)))

    @cached_property
    def genes(self) -> tuple[Gene, ...]:
        """The numbers that make a candidate."""
        found = []
        for one in self.duty.varied:
            given = one.distribution
            if isinstance(given, Choice):
                numbers = tuple(float(value) for value in given.values)
                found.append(Gene(one.name, 0.0, 1.0, numbers))
            elif isinstance(given, Interval):
                found.append(Gene(one.name, given.low, given.high))
        if self.springs:
            found.append(Gene("springs", 0.0, 1.0, tuple(range(len(self.springs)))))
        return tuple(found)

    @cached_property
    def objectives(self) -> tuple[Objective, ...]:
        """What is to be small, of what the machine's data tell, most important first."""
        return tuple(
            one
            for one in self.duty.prefer
            if one == "steadiness" or not QUANTITIES[READ[one]].missing(self.screen)
        )

    @cached_property
    def limited(self) -> tuple[str, ...]:
        """Limits on a motion that are given and can be checked."""
        bounds = self.duty.bounds
        return tuple(
            name
            for name in bounds.given
            if name != AMPLITUDE
            and QUANTITIES[name].of == "motion"
            and not QUANTITIES[name].of_folds
            and not QUANTITIES[name].missing(self.screen)
        )

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of what must be met, in the order of ``excess``."""
        of_springs = (name for name, _, _ in self._of_springs)
        return (TARGET, MOTION, EVEN, *self.limited, *of_springs, ALONE, *self._of_jumps)

    @cached_property
    def _of_jumps(self) -> tuple[str, ...]:
        """The limit on the distance to the jump, where one is given."""
        given = self.duty.bounds.jump_margin
        return (JUMP,) if given and not QUANTITIES[JUMP].missing(self.screen) else ()

    @cached_property
    def _of_springs(self) -> tuple[tuple[str, str, str], ...]:
        """Limits of the catalogue: name, the spring's field, what it limits."""
        found = []
        if any(one.strain is not None for one in self.duty.catalogue):
            found.append((STRAIN, "strain", "shear_strain"))
        if any(one.force is not None for one in self.duty.catalogue):
            found.append((FORCE, "force", "shear_piece_force"))
        return tuple(found)

    def columns(self, u: Real) -> Columns:
        """Fields of candidates (C, D) as columns (C,)."""
        found: Columns = {}
        for d, gene in enumerate(self.genes):
            if gene.name == "springs":
                found |= self._spring_columns(gene.index(u[:, d]))
            else:
                found[gene.name] = gene.decoded(u[:, d])
        return found

    def _spring_columns(self, index: NDArray[np.int64]) -> Columns:
        pairs = [self.springs[i] for i in index.tolist()]
        omega = float(self.duty.speeds.mean())
        stiffness = np.array([one.stiffness * count for one, count in pairs])
        loss = np.array([one.loss_factor for one, _ in pairs])
        found: Columns = {"shear_stiffness": stiffness, "shear_damping": loss * stiffness / omega}
        found["shear_pieces"] = np.array([float(count) for _, count in pairs])
        if all(one.height is not None for one, _ in pairs):
            found["shear_height"] = np.array([one.height for one, _ in pairs], float)
        return found

    def machine(self, u: Real) -> FlipFlowScreen:
        """The machine of one candidate, (D,)."""
        row = {name: column[0].item() for name, column in self.columns(u[None]).items()}
        return self.screen.replace(**row)

    def rounded(self, u: Real, digits: int) -> Real:
        """A candidate, (D,), whose fields have so many significant digits."""
        found = u.copy()
        for d, gene in enumerate(self.genes):
            if not gene.values:
                value = float(f"{gene.decoded(u[d : d + 1])[0]:.{digits}g}")
                found[d] = gene.share_of(value)
        return found

    def spring_of(self, u: Real) -> tuple[SpringType, int] | None:
        """The catalogue's spring of a candidate, and how many."""
        if not self.springs:
            return None
        d = next(d for d, gene in enumerate(self.genes) if gene.name == "springs")
        return self.springs[int(self.genes[d].index(u[d : d + 1])[0])]

    def share_of(self, screen: FlipFlowScreen) -> Real:
        """The candidate nearest to a machine, (D,)."""
        found = []
        for gene in self.genes:
            if gene.name == "springs":
                total = [one.stiffness * count for one, count in self.springs]
                place = int(np.argmin(np.abs(np.array(total) - screen.shear_stiffness)))
                found.append((place + 0.5) / len(self.springs))
            else:
                found.append(gene.share_of(getattr(screen, gene.name)))
        return np.array(found)

    def judge(self, u: Real, *, margins: Sequence[Load] = ()) -> Judged:
        """What candidates (C, D) are like.

        Whether all parts at one end of their scatter leave another stable motion at speed, and how
        far the jump is then and from the drawing, is looked at under the loads ``margins`` and of
        those that fit else: it takes motions at many speeds. Without loads both count as met.
        """
        springs = [self.spring_of(one) for one in u]
        return self._judged(self.columns(u), springs, self.duty.corners, margins)

    def built(self, u: Real) -> Judged:
        """Machines as they are built from one candidate (D,), parts drawn evenly in the scatter."""
        from scipy.stats import qmc  # noqa: PLC0415  slow to import

        scatter, screen = self.duty.scatter, self.machine(u)
        draws = 2.0 * qmc.Sobol(len(scatter), rng=self.duty.seed).random(BUILT) - 1.0
        rows = {name: np.repeat(column, BUILT) for name, column in self.columns(u[None]).items()}
        for (name, share), draw in zip(scatter.items(), draws.T, strict=True):
            rows[name] = float(getattr(screen, name)) * (1.0 + share * draw)
        springs = [self.spring_of(u)] * BUILT
        return self._judged(rows, springs, self.duty.corners[:1], self.farthest)

    def _judged(
        self,
        columns: Columns,
        springs: Sequence[tuple[SpringType, int] | None],
        corners: Sequence[Mapping[str, float]],
        margins: Sequence[Load],
    ) -> Judged:
        count = len(springs)
        found = self.judge_columns(columns, count, corners)
        over = [found.excess]
        for _, field, name in self._of_springs:
            allowed = [getattr(one[0], field) if one else None for one in springs]
            most = np.array([np.inf if one is None else one for one in allowed])
            over.append((found.worst[name] / most - 1.0)[:, None])
        over.append(np.full((count, 1 + len(self._of_jumps)), -1.0))
        excess = np.concatenate(over, axis=1)
        fit = np.flatnonzero((excess <= MET).all(axis=1))
        if margins and fit.size:
            kept = {name: one[fit] for name, one in columns.items()}
            excess[fit, self.constraints.index(ALONE)] = self._not_alone(kept, corners, margins)
            if self._of_jumps:
                excess[fit, -1] = self._nearness(kept, corners, margins)
        return Judged(found.amplitude, found.worst, excess)

    @cached_property
    def farthest(self) -> tuple[Load, ...]:
        """The loads between which the jump moves farthest: softest and stiffest for its mass."""
        loads = self.duty.loads

        def own(load: Load) -> float:
            loaded = self._under(load)
            return loaded.shear_stiffness / loaded.floating_mass

        ends = (min(loads, key=own), max(loads, key=own))
        return ends[:1] if ends[0] is ends[1] else ends

    def _not_alone(
        self, columns: Columns, corners: Sequence[Mapping[str, float]], loads: Sequence[Load]
    ) -> Real:
        """Share of extreme corners, loads and speeds at which there is another motion, (C,)."""
        count = len(next(iter(columns.values())))
        ends = self.duty.ends if len(corners) > 1 else corners
        rows = self._scattered(columns, count, ends)
        told = [
            one_motion_loaded(self.screen, rows, load, self.duty.speeds, processors())
            for load in loads
        ]
        alone = np.concatenate([one.reshape(count, -1) for one in told], axis=1)
        return np.asarray(1.0 - alone.mean(axis=1))

    def _nearness(
        self, columns: Columns, corners: Sequence[Mapping[str, float]], loads: Sequence[Load]
    ) -> Real:
        """By how much machines come too near to the jump under some loads, as a share, (C,)."""
        least = float(self.duty.bounds.jump_margin or 1.0)
        count = len(next(iter(columns.values())))
        ends = self.duty.ends if self.margin_as_built and len(corners) > 1 else ()
        rows = self._scattered(columns, count, (*corners[:1], *ends))
        told = [
            jump_distance_loaded(self.screen, rows, load, self.duty.speeds, least, processors())
            for load in loads
        ]
        table = np.concatenate([one.reshape(count, -1) for one in told], axis=1)
        return np.asarray(1.0 - _least(table) / least)

    def judge_columns(
        self, columns: Columns, count: int, corners: Sequence[Mapping[str, float]]
    ) -> Judged:
        """What machines with these fields are like, (C,) each, but for a catalogue's limits."""
        wanted = {AMPLITUDE, OFFSET, *self.limited}
        wanted |= {READ[one] for one in self.objectives if one != "steadiness"}
        wanted |= {name for _, _, name in self._of_springs}
        names = sorted(wanted)
        rows, parts = self._scattered(columns, count, corners), []
        for load in self.duty.loads:
            values, reason = evaluate_loaded(
                self.screen, rows, load, names, self.duty.speeds, "from-below", processors()
            )
            parts.append((values, reason))
        tables = {
            name: np.concatenate([values[name].reshape(count, -1) for values, _ in parts], axis=1)
            for name in names
        }
        reasons = np.concatenate([why.reshape(count, -1) for _, why in parts], axis=1)
        worst = {name: _greatest(table) for name, table in tables.items()}
        lean = _greatest(tables[OFFSET] / tables[AMPLITUDE]) - LEAN
        excess = [self._off_target(tables[AMPLITUDE]), (reasons != FOUND).mean(axis=1)]
        excess.append(lean if self._even else np.full(count, -1.0))
        for name in self.limited:
            low, high = limit_bounds(self.duty.bounds, name)
            over = worst[name] / high - 1.0 if np.isfinite(high) else np.full(count, -1.0)
            least = _least(tables[name])
            under = 1.0 - least / low if np.isfinite(low) and low > 0.0 else np.full(count, -1.0)
            excess.append(np.maximum(over, under))
        return Judged(tables[AMPLITUDE], worst, np.stack(excess, axis=1))

    @cached_property
    def _even(self) -> bool:
        """Whether the machine is the same on both sides under every load."""
        loaded = map(self._under, self.duty.loads)
        return all(one.system().symmetric for one in loaded)

    def _under(self, load: Load) -> FlipFlowScreen:
        """The machine to begin with under a load, its rubber as warm as its work keeps it."""
        omega = float(self.duty.speeds.mean())
        return self.screen.loaded(warmed_load(self.screen, load, omega).load)

    def _off_target(self, amplitude: Real) -> Real:
        """By how much the farthest amplitude misses the tolerance, as a share of the target."""
        duty = self.duty
        far = _greatest(np.abs(amplitude - duty.target))
        return np.asarray((far - duty.tolerance) / duty.target)

    def _scattered(
        self, columns: Columns, count: int, corners: Sequence[Mapping[str, float]]
    ) -> Columns:
        """Each candidate at every corner of the scatter, corners side by side."""
        rows = {name: np.repeat(column, len(corners)) for name, column in columns.items()}
        for name in self.duty.scatter:
            own = rows.get(name, np.full(count * len(corners), float(getattr(self.screen, name))))
            rows[name] = own * np.tile([corner[name] for corner in corners], count)
        return rows


def _greatest(table: Real) -> Real:
    """Greatest of each row, infinite where one is not known."""
    return np.where(np.isnan(table).any(axis=1), np.inf, table.max(axis=1))


def _least(table: Real) -> Real:
    """Least of each row, 0 where one is not known."""
    return np.where(np.isnan(table).any(axis=1), 0.0, table.min(axis=1))
