"""The machine for a duty: chosen among thousands, and proved as one that was drawn by hand."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from flipflow import __version__
from flipflow.batch.run_chunks import checked_executor
from flipflow.batch.side_by_side import Tell
from flipflow.compiled.arrays import Real
from flipflow.errors import Cancelled, InputError
from flipflow.model.arguments import checked_count, checked_monitor, checked_path
from flipflow.model.duty import Duty, SpringType
from flipflow.model.fields import FIELD
from flipflow.model.monitor import Monitor
from flipflow.model.numerals import rpm
from flipflow.model.project import Project
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.vary import Choice
from flipflow.results.result import Frozen, Result, above
from flipflow.studies.assessment import FAIL, Assessment, assess
from flipflow.studies.candidates import JUMP, MET, Space, label_of
from flipflow.studies.design_search import (
    GENERATIONS,
    POPULATION,
    Front,
    Polished,
    by_preference,
    polish,
    search,
    tightened,
)
from flipflow.studies.design_store import search_store
from flipflow.studies.tolerance import confidence_interval

SEARCHED, POLISHED = 0.7, 0.8  # shares of the work that are done then
DIGITS = (5, 6, 7)  # of the fields of a proposal
HALVINGS = 6  # of the way to a polished machine that leaves another motion or a jump too near
TRIED = 3  # machines proved before it is said that none passes
COEXISTING = 1e-3  # share by which the amplitude of another stable motion may differ


@dataclass(frozen=True, eq=False)
class Trial(Frozen):
    """One machine as a duty sees it.

    Parameters
    ----------
    name
        What it is called.
    screen
        The machine.
    amplitude
        Relative amplitude in m under every load case, at every corner of the scatter and every
        speed, (J,); NaN where there is no stable motion.
    """

    name: str
    screen: FlipFlowScreen
    amplitude: Real

    @property
    def band(self) -> float:
        """Greatest less least relative amplitude in m; infinite where one has none."""
        if np.isnan(self.amplitude).any():
            return math.inf
        return float(np.ptp(self.amplitude))


@dataclass(frozen=True, eq=False)
class Proposal(Frozen, Result):
    """What :func:`flipflow.design` returns.

    Parameters
    ----------
    duty
        What was asked.
    fields
        Free fields of the Pareto set, SI, (P,) each.
    objectives
        What was to be small, (P,) each, by name.
    chosen
        The machine that is recommended, or that misses the duty least.
    beside
        The machine of the file, and the same without stops.
    possible
        Whether the duty can be done.
    excess
        By what the chosen machine misses each constraint, as a share of it; at most 0 where met.
    against
        Where the duty cannot be done: the constraints that exclude each other, the dearest first.
    prices
        By binding constraint, how much the band in m falls for each share of it that is given
        more; of the ends of what is free, for each share of their interval.
    springs
        The catalogue's spring and how many of them; None without a catalogue.
    assessment
        The chosen machine judged as ``flipflow analyze`` judges: the exact solution under every
        load case, from rest to speed with its motor, blows, other motions.
    passing
        Yield: the share of machines as they are built, parts drawn evenly within their scatter,
        that meet every constraint in every case; NaN without scatter, where the search was stopped
        and where the duty cannot be done.
    passing_interval
        Its 95 % confidence interval, (2,).
    failing
        Share of these machines that miss each constraint.
    generations
        How long was searched.
    thrown_out
        Machines of the set that failed this proof, and why.
    evaluated
        Candidates that were looked at.
    cancelled
        Whether the search was stopped before its end: it is the best so far.
    version
        Of flipflow.
    """

    duty: Duty
    fields: Mapping[str, Real]
    objectives: Mapping[str, Real]
    chosen: Trial
    beside: tuple[Trial, ...]
    possible: bool
    excess: Mapping[str, float]
    against: tuple[str, ...]
    prices: Mapping[str, float]
    springs: tuple[SpringType, int] | None
    assessment: Assessment | None
    thrown_out: tuple[str, ...]
    evaluated: int
    cancelled: bool
    version: str
    passing: float = math.nan
    passing_interval: tuple[float, float] = (math.nan, math.nan)
    failing: Mapping[str, float] = field(default_factory=dict)
    generations: int = GENERATIONS

    def __repr__(self) -> str:
        return f"Proposal({self.duty.name}: {self.sentence})"

    @property
    def screen(self) -> FlipFlowScreen:
        """The machine that is recommended."""
        return self.chosen.screen

    @property
    def preferred(self) -> int:
        """Which machine of the set was polished: that nearest to the chosen one in its fields."""
        away = np.zeros(next(iter(self.fields.values())).size)
        for name, values in self.fields.items():
            own = float(getattr(self.screen, name))
            away += ((values - own) / (abs(own) or 1.0)) ** 2
        return int(np.argmin(away))

    @property
    def project(self) -> Project:
        """The duty's project with the chosen machine, its speed, loads and limits."""
        return _project(self.duty, self.chosen.screen)

    @property
    def machine_file(self) -> str:
        """The chosen machine as a machine file, which says where its new values come from."""
        sources = dict.fromkeys(
            (FIELD[name].key for name in self.fields), f"chosen for the duty {self.duty.name}"
        )
        before, now = self.duty.project.limits, self.duty.bounds
        asked = [f"limits.{n}" for n in now.given if getattr(now, n) != getattr(before, n)]
        sources |= dict.fromkeys(("operation.speed", *asked), f"the duty {self.duty.name}")
        return str(above("io.machine_text", "machine_text")(self.project, sources))

    @cached_property
    def factor(self) -> float:
        """The band of the machine of the file over that of the chosen one.

        Infinite where only the chosen one has none, NaN where neither has: under one combination.
        """
        before, now = self.beside[0].band, self.chosen.band
        return before / now if now > 0.0 else math.inf if before > 0.0 else math.nan

    @property
    def missed(self) -> tuple[str, ...]:
        """Constraints that the chosen machine misses, the worst first."""
        over = {name: share for name, share in self.excess.items() if share > MET}
        return tuple(sorted(over, key=lambda name: -over[name]))

    @property
    def sentence(self) -> str:
        """What was found, for people."""
        band = f"{1e3 * self.chosen.band:.3g} mm"
        if not self.possible and self.thrown_out and not self.missed:
            return f"no machine that was tried passes its proof: {self.thrown_out[-1]}"
        if not self.possible:
            return f"{self._impossible}; the nearest machine does {self._reached} mm"
        target, speed = 1e3 * self.duty.target, rpm(float(self.duty.speeds.mean()))
        asked = f"{target:.3g} +-{1e3 * self.duty.tolerance:.3g} mm asked"
        found = f"does {self._reached} mm, {asked}, at {speed} rpm "
        found += f"over every load case and scatter: a band of {band}"
        if math.isfinite(self.factor):
            found += f", {self.factor:.3g} times as steady as the machine of the file"
        if self.passing < 1.0:
            found += f"; {100.0 * self.passing:.3g} % of machines as built meet every constraint"
        return found

    @property
    def _reached(self) -> str:
        """Least and greatest amplitude in mm."""
        low, high = 1e3 * self.chosen.amplitude.min(), 1e3 * self.chosen.amplitude.max()
        return f"{low:.3g} to {high:.3g}"

    @property
    def _impossible(self) -> str:
        """Why the duty is not done."""
        names = [one for one in self.against or self.missed if one in self.excess]
        ends = [label_of(one) for one in self.against if one not in self.excess]
        words = " and ".join(map(label_of, names))
        chosen = any(isinstance(one.distribution, Choice) for one in self.duty.varied)
        if self.generations < GENERATIONS and (chosen or self.springs is not None):
            return f"no machine for the duty in {self.generations} generations: {words} missed"
        excluded = "exclude each other" if len(names) > 1 else "cannot be met"
        beside = f" (at the {' and the '.join(ends)})" if ends else ""
        return f"the duty cannot be done with what is free: {words} {excluded}{beside}"


def design(
    duty: Duty,
    *,
    generations: int | None = None,
    store: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    monitor: Monitor | None = None,
) -> Proposal:
    """Choose the machine for a duty and prove it.

    A Pareto set of machines that meet every limit in every load case and at every corner of the
    scatter is searched; what comes first in ``duty.prefer`` decides among them, and the band of
    the relative amplitude of the one that is taken is made as small as it gets. It is then judged
    as :func:`flipflow.assess` judges. One that fails is thrown out for the next.

    Parameters
    ----------
    duty
        What is asked, as :func:`flipflow.load_duty` reads it.
    generations
        How long to search; None: as long as pays.
    store
        Folder that grows as the search runs. Where one of the same duty is there, the search goes
        on with it, and ends as one that was never stopped.
    executor
        What judges the candidates, such as ``client.get_executor()`` of dask; None: threads of
        this process. The result is the same, bit for bit.
    monitor
        Called with a sentence and the share done. What raises :class:`~flipflow.Cancelled` ends
        the search, and the best so far is proposed.

    Returns
    -------
    Proposal
        The machine, its rivals, and what each limit costs; the nearest possible machine where the
        duty cannot be done.

    Raises
    ------
    InputError
        For anything but a duty.
    IncompleteError
        When the workers are gone; what the store holds by then stays.
    StoreError
        When the store cannot be written, another run writes to it, or it is of another duty.
    MissingExtra
        When pymoo is not installed; for a store where zarr is not.
    """
    if not isinstance(duty, Duty):
        remedy = 'give a duty, such as ff.load_duty("duty.toml")'
        raise InputError("duty", type(duty).__name__, remedy)
    checked_monitor(monitor)
    rounds = GENERATIONS if generations is None else checked_count("generations", generations, 9999)
    _refuse_speed(duty)
    front = _searched(Space(duty), rounds, store, executor, monitor)
    space = front.space
    outcome = _proved(space, front, monitor)
    found = outcome.found
    built = _yield(space, outcome)
    if monitor is not None and not outcome.cancelled:
        with suppress(Cancelled):  # nothing is left to end
            monitor("design, done", 1.0)
    return Proposal(
        duty=duty,
        fields={name: np.asarray(one) for name, one in space.columns(front.u).items()},
        objectives={one: front.judged.objective(one) for one in space.objectives},
        chosen=Trial("proposed", space.machine(found.u), found.judged.amplitude[0]),
        beside=_beside(space),
        possible=bool(found.judged.fits[0]) and not outcome.none_left,
        excess=_excess(space, outcome),
        against=found.against,
        prices=found.price,
        springs=space.spring_of(found.u),
        assessment=outcome.proof,
        thrown_out=outcome.thrown,
        evaluated=front.evaluated,
        cancelled=outcome.cancelled,
        version=__version__,
        passing=built.passing,
        passing_interval=built.interval,
        failing=built.failing,
        generations=rounds,
    )


def _refuse_speed(duty: Duty) -> None:
    """See that the duty asks for speeds at which the machine may run."""
    if duty.bounds.speed is None:
        return
    low, high = duty.bounds.speed
    if duty.speed[0] < low or duty.speed[1] > high:
        told = " to ".join(dict.fromkeys(rpm(one) for one in duty.speed))
        remedy = f"the limits allow {rpm(low)} to {rpm(high)} rpm, change one of the two"
        raise InputError("speed", f"{told} rpm", remedy)


def _searched(
    space: Space,
    rounds: int,
    store: str | os.PathLike[str] | None,
    executor: Executor | None,
    monitor: Monitor | None,
) -> Front:
    """The search, kept in a store where one is named."""
    tell = _told(monitor, "searching", 0.0, SEARCHED)
    if executor is not None:
        checked_executor(executor)
    if store is None:
        return search(space, rounds, tell, executor=executor)
    with search_store(checked_path("store", store), space, rounds, POPULATION).writing() as kept:
        return search(space, rounds, tell, kept=kept, executor=executor)


@dataclass(frozen=True, eq=False)
class _Outcome:
    """The machine that is taken, its proof, and what was thrown out before it."""

    found: Polished
    proof: Assessment | None = None
    thrown: tuple[str, ...] = ()
    none_left: bool = False
    cancelled: bool = False


def _proved(space: Space, front: Front, monitor: Monitor | None) -> _Outcome:
    """Polish and prove machines of the set as they are preferred, until one passes."""
    order = by_preference(front)[:TRIED]
    found = Polished(front.u[order[0]], space.judge(front.u[order[:1]]), {})
    if front.cancelled:
        return _Outcome(found, cancelled=True)
    proof = None
    thrown: list[str] = []
    try:
        for k in order:
            if not front.judged.fits[k]:
                found = polish(space, front.u[k], _told(monitor, "polishing", SEARCHED, POLISHED))
                if not bool(found.judged.fits[0]):
                    return _Outcome(found, None, tuple(thrown))
            # A polish may end too near to a jump, of which it knows nothing.
            for found in _versions(space, front.u[k], monitor):
                proof, why = _proof(space.duty, space.machine(found.u), monitor)
                if not why:
                    return _Outcome(found, proof, tuple(thrown))
                thrown.append(why)
    except Cancelled:
        return _Outcome(found, None, tuple(thrown), cancelled=True)
    return _Outcome(found, proof, tuple(thrown), none_left=True)


@dataclass(frozen=True, eq=False)
class _Yield:
    """Shares of machines as they are built."""

    passing: float = math.nan
    interval: tuple[float, float] = (math.nan, math.nan)
    failing: Mapping[str, float] = field(default_factory=dict)


def _yield(space: Space, outcome: _Outcome) -> _Yield:
    proposed = not outcome.cancelled and outcome.found.judged.fits[0]
    if not proposed or not space.duty.scatter:
        return _Yield()
    judged = space.around(outcome.found.u).built(outcome.found.u)
    fits, missed = judged.fits, (judged.excess > MET).mean(axis=0).tolist()
    low, high = confidence_interval(np.array([fits.sum()]), float(fits.size))[0].tolist()
    failing = dict(zip(space.constraints, missed, strict=True))
    return _Yield(float(fits.mean()), (low, high), failing)


def _versions(space: Space, u: Real, monitor: Monitor | None) -> Iterator[Polished]:
    """A candidate as polished; else tightened, or halfway there, as far as it fits; as found."""
    polished = polish(space, u, _told(monitor, "polishing", SEARCHED, POLISHED))

    def on_the_way(share: float) -> Polished:
        there = u + share * (polished.u - u)
        judged = space.around(there).judge(there[None], margins=space.duty.loads)
        return Polished(there, judged, polished.price if share == 1.0 else {})

    best, low, high = on_the_way(1.0), 0.0, 1.0
    if not best.judged.fits[0]:
        best = on_the_way(0.0)
        for _ in range(HALVINGS):
            middle = on_the_way(0.5 * (low + high))
            if middle.judged.fits[0]:
                best, low = middle, 0.5 * (low + high)
            else:
                high = 0.5 * (low + high)
        if best.judged.fits[0]:
            tell = _told(monitor, "polishing", POLISHED, POLISHED)
            yield _rounded(space, tightened(space, best, polished.u, tell))
    if best.judged.fits[0] and not np.array_equal(best.u, u):
        yield _rounded(space, best)
    yield _rounded(space, best if np.array_equal(best.u, u) else on_the_way(0.0))


def _rounded(space: Space, found: Polished) -> Polished:
    """A candidate with as few digits as leave it fit."""
    for digits in DIGITS:
        u = space.rounded(found.u, digits)
        judged = space.around(u).judge(u[None], margins=space.duty.loads)
        if judged.fits[0]:
            return replace(found, u=u, judged=judged)
    return found


def _told(monitor: Monitor | None, words: str, low: float, high: float) -> Tell:
    """What tells a stage's share of the whole."""

    def tell(share: float) -> None:
        if monitor is not None:
            monitor(f"design, {words}", low + (high - low) * share)

    return tell


def _project(duty: Duty, screen: FlipFlowScreen) -> Project:
    own = duty.project.document
    return replace(
        duty.project,
        document=replace(
            own, name=f"{own.name or duty.project.name}, for {duty.name}", revision=""
        ),
        screen=screen,
        speed=float(duty.speeds.mean()),
        load_cases=duty.loads,
        limits=duty.bounds,
        name=duty.name,
    )


def _proof(duty: Duty, screen: FlipFlowScreen, monitor: Monitor | None) -> tuple[Assessment, str]:
    """The drawing judged, and why it fails; so may machines with all parts at one end of theirs."""
    tell = _told(monitor, "proving", POLISHED, 1.0)
    words = ("every part at its least", "every part at its greatest")
    ends = dict(zip(words, duty.ends, strict=True)) if duty.ends else {}
    parts = 1 + len(ends)
    drawn = assess(_project(duty, screen), monitor=lambda _, share: tell(share / parts))
    if drawn.state == FAIL or drawn.start_fails:
        return drawn, drawn.verdict
    why = _other_motion(drawn, duty)
    for k, (name, factors) in enumerate(ends.items(), 1):
        if why:
            break
        fields = {field: factor * getattr(screen, field) for field, factor in factors.items()}
        built = assess(
            _project(duty, screen.replace(**fields)),
            monitor=lambda _, share, k=k: tell((k + share) / parts),  # type: ignore[misc]
        )
        told = built.verdict if built.start_fails else _other_motion(built, duty)
        why = f"{name}: {told}" if told else ""
    return drawn, why


def _other_motion(proof: Assessment, duty: Duty) -> str:
    """Another stable motion at speed under some load, or none at all; empty where all is well."""
    for case in proof.cases:
        own = None if case.orbit is None else case.orbit.amplitude("relative")
        for orbit in case.orbits:
            size = orbit.amplitude("relative")
            if own is not None and orbit.stable and abs(size - own) > COEXISTING * own:
                name = case.name
                return f"{name}: another stable motion of {1e3 * size:.3g} mm exists at speed"
            far = abs(size - duty.target) > duty.tolerance
            if own is None and orbit.stable and far:
                return f"{case.name}: only a motion of {1e3 * size:.3g} mm exists at speed"
    return ""


def _beside(space: Space) -> tuple[Trial, ...]:
    """The machine of the file, and the same without stops."""
    trials = []
    for name, screen in (
        ("as the file has it", space.screen),
        ("without stops", space.screen.replace(clearance=math.inf, clearance_minus=None)),
    ):
        alone = Space(replace(space.duty, project=replace(space.duty.project, screen=screen)))
        # One field makes a row; the others are the machine's own.
        own = {"main_mass": np.array([screen.main_mass])}
        trials.append(
            Trial(name, screen, alone.judge_columns(own, 1, alone.duty.corners).amplitude[0])
        )
    return tuple(trials)


def _excess(space: Space, outcome: _Outcome) -> dict[str, float]:
    """Of the margin to the jump, which a search only compares, what the proof found."""
    excess = dict(zip(space.constraints, outcome.found.judged.excess[0].tolist(), strict=True))
    if JUMP in excess:
        rows = () if outcome.proof is None else outcome.proof.limits_table
        known = [-row.margin for row in rows if row.name == JUMP and row.margin is not None]
        excess[JUMP] = known[0] if known else math.nan
    return excess
