"""What a file holds of machines, methods, motions and branches: all it takes to open them again.

:mod:`flipflow.results.codec` writes a result by its fields. Here stands what has other words in a
file: a motion lies beside the machine and the method it belongs to, and is read with their
equations. Amplitudes and the like are for other readers. Nothing is computed again when a file is
opened.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from flipflow.continuation import arclength
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.field_branch import FieldBranch, FieldSpecialPoint
from flipflow.continuation.field_path import FieldPoint
from flipflow.continuation.frequency_response import formulation_of, method_of
from flipflow.model.arguments import (
    checked_count,
    checked_flag,
    checked_numbers,
    checked_speed,
    checked_speeds,
    checked_word,
)
from flipflow.model.elements import ClearanceSpring, HarmonicForce, Unbalance
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Coordinate, Machine, MechanicalSystem
from flipflow.model.vary import Choice, Distribution, Interval, Normal
from flipflow.periodic.options import (
    HarmonicBalance,
    Method,
    PiecewiseExact,
    SampledHarmonicBalance,
)
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Point, Solver, Traced
from flipflow.periodic.stability import STABLE, UNDETERMINED, UNSTABLE
from flipflow.results.codec import Codec, Form, array, exact, plain
from flipflow.studies.sensitivity import Sensitivity
from flipflow.transient.settle import Settled
from flipflow.transient.sweep import Jump, Sweep

Document = Mapping[str, Any]
P = TypeVar("P", bound=Point)
MOST_TURNS = 10_000  # forcing periods after which a motion of a file may repeat
PLACE = ("kind", "position", "spring", "side")
RECORDED = ("tangent", "side", "signature", "iterations")
CODEC = Codec()


def machine_document(machine: Machine) -> dict[str, Any]:
    """A screen by its fields, any other machine by its matrices; infinite gaps are "inf"."""
    kept = machine if isinstance(machine, FlipFlowScreen) else machine.system()
    written: dict[str, Any] = MACHINES.write(kept)
    return written


def spring_document(spring: ClearanceSpring) -> dict[str, Any]:
    """A spring with both gaps."""
    fields = {name: plain(getattr(spring, name)) for name in ("direction", "stiffness", "damping")}
    return {**fields, "gaps": exact(spring.gaps), "law": spring.law}


def spring_from(document: Document) -> ClearanceSpring:
    """The spring of a document."""
    fields = {name: document[name] for name in ("direction", "stiffness", "damping", "law")}
    plus, minus = map(float, document["gaps"])
    return ClearanceSpring(clearance=plus, clearance_minus=minus, **fields)


class Motions:
    """Reads the motions of one machine by one method; equations are set up once.

    Parameters
    ----------
    machine, method
        What moves, and how its motions were found.
    """

    def __init__(self, machine: Machine, method: Method) -> None:
        self.machine, self.method, self.system = machine, method, machine.system()
        self._solvers: dict[tuple[bool, int], Solver] = {}

    @classmethod
    def of(cls, document: Document) -> Self:
        """Of the machine and the method of a document; the exact one where it names none."""
        method = METHODS.read(document["method"]) if "method" in document else PiecewiseExact()
        return cls(MACHINES.read(document["machine"]), method)

    def solver(self, document: Document) -> Solver:
        """A solver of what the motion of a document was solved for."""
        half_turn = checked_flag("half_turn", document["half_turn"])
        turns = checked_count("turns", document["turns"], MOST_TURNS)
        if (half_turn, turns) not in self._solvers:
            found = formulation_of(self.system, self.method, half_turn=half_turn, turns=turns)
            self._solvers[half_turn, turns] = found.solver()
        return self._solvers[half_turn, turns]

    def point(self, document: Document, kind: type[P], **more: Any) -> P:
        """A motion as its solver left it."""
        solver, states = self.solver(document), 2 * self.system.size
        u = array(document["unknowns"], float, (solver.unknowns,))
        return kind(
            solver.formulation,
            checked_numbers("unknowns", u, "give finite numbers"),
            checked_speed(document["omega"]),
            known_map=array(document["return_map"], float, (states, states)),
            **more,
        )

    def orbit(self, document: Document, kind: type[P], **more: Any) -> Orbit:
        """A motion and its stability."""
        word = checked_word("stability", document["stability"], WORDS)
        return Orbit(self.machine, self.point(document, kind, **more), word)


def point_document(point: Point) -> dict[str, Any]:
    """A motion as its solver left it."""
    return {
        "omega": point.omega,
        "half_turn": point.formulation.half_turn,
        "turns": point.formulation.turns,
        "unknowns": plain(point.u),
        "return_map": plain(point.return_map),
    }


def orbit_document(orbit: Orbit) -> dict[str, Any]:
    """One motion of a machine, and the amplitudes of named coordinates."""
    return {
        "machine": machine_document(orbit.machine),
        "method": METHODS.write(method_of(orbit.point.formulation)),
        "periods": orbit.periods,
        "stability": orbit.stability,
        "amplitude": _named(orbit.system, orbit.amplitude),
        **point_document(orbit.point),
    }


def orbit_from(document: Document) -> Orbit:
    """The motion of a document."""
    return Motions.of(document).orbit(document, Point)


def branch_document(branch: Branch) -> dict[str, Any]:
    """A branch over frequency."""
    traced = branch.traced
    return {
        **_followed_document(branch, branch.system),
        "method": METHODS.write(branch.method),
        "shortened_steps": [dataclasses.asdict(step) for step in branch.shortened_steps],
        "half_turn": branch.formulation.half_turn,
        "turns": branch.formulation.turns,
        "saddle_side_at_start": branch.saddle_side_at_start,
        "return_maps": plain(branch.return_maps),
        "unknowns": plain(traced.u),
        **{name: plain(getattr(traced.record, name)) for name in RECORDED},
        "rejected": plain(traced.rejected),
        "reason": plain(traced.reason),
        "code": traced.code,
        "course": plain(tuple(traced.course)),
    }


def branch_from(document: Document) -> Branch:
    """The branch of a document."""
    motions = Motions.of(document)
    traced, states = _traced_from(document, motions), 2 * motions.system.size
    points = traced.omega.size
    return Branch(
        machine=motions.machine,
        method=motions.method,
        formulation=motions.solver(document).formulation,
        traced=traced,
        return_maps=array(document["return_maps"], float, (points, states, states)),
        saddle_side_at_start=checked_flag("saddle_side_at_start", document["saddle_side_at_start"]),
        multipliers=array(document["multipliers"], complex, (points, states)),
        stability=_words_from(document["stability"], points),
        # Where a branch meets another, the point is one of the other's motions.
        special_points=tuple(
            SpecialPoint(orbit=motions.orbit(one, Point), **_place_from(one))
            for one in document["special_points"]
        ),
        **_ended_from(document),
    )


def _traced_from(document: Document, motions: Motions) -> Traced:
    """The points of a branch as they were followed, but for the depths: those are not kept."""
    solver, states, omega = motions.solver(document), 2 * motions.system.size, document["omega"]
    points = len(omega)
    # One more than the points: the step at which the branch ended.
    record = solver.new_branch(points + 1)
    record.depth[:] = np.nan
    record.u[:points] = array(document["unknowns"], float, (points, solver.unknowns))
    record.omega[:points] = checked_speeds(omega) if points else []
    for name in RECORDED:
        kept: NDArray[Any] = getattr(record, name)[:points]
        kept[:] = array(document[name], kept.dtype.type, kept.shape)
    if solver.reads_jacobian:
        maps = array(document["return_maps"], float, (points, states, states))
        record.jacobian[:points] = maps - np.eye(states)
    tried = len(document["rejected"])
    record.rejected[:tried], record.reason[:tried] = document["rejected"], document["reason"]
    course = arclength.Course(*array(document["course"]).tolist())
    return Traced.recorded(record, points, CODEC.form(int).read(document["code"]), course)


def field_branch_document(branch: FieldBranch) -> dict[str, Any]:
    """A branch over a field of the machine."""
    return {
        **_followed_document(branch, branch.machine.system()),
        "field": branch.field,
        "values": plain(branch.values),
        "points": [point_document(orbit.point) for orbit in branch.orbits],
    }


def field_branch_from(document: Document) -> FieldBranch:
    """The branch of a document."""
    screen, field = CODEC.form(FlipFlowScreen).read(document["machine"]), document["field"]

    def orbit_at(one: Document) -> Orbit:
        value = CODEC.form(float).read(one["value"])
        motions = Motions(screen.replace(**{field: value}), PiecewiseExact())
        return motions.orbit(one, FieldPoint, value=value)

    values, words = document["values"], document["stability"]
    points = zip(document["points"], values, words, strict=True)
    return FieldBranch(
        machine=screen,
        field=field,
        orbits=tuple(
            orbit_at({**one, "value": value, "stability": word}) for one, value, word in points
        ),
        values=array(values),
        special_points=tuple(
            FieldSpecialPoint(orbit=orbit_at(one), value=one["value"], **_place_from(one))
            for one in document["special_points"]
        ),
        **_ended_from(document),
    )


def _followed_document(branch: Branch | FieldBranch, system: MechanicalSystem) -> dict[str, Any]:
    """What every branch holds, and the amplitudes and phases of named coordinates."""
    return {
        "version": branch.version,
        "machine": machine_document(branch.machine),
        "status": branch.status.name,
        "status_sentence": branch.status.value,
        "complete": branch.complete,
        "notes": list(branch.notes),
        "omega": plain(branch.omega),
        "amplitude": _named(system, branch.amplitude),
        "phase": _named(system, branch.phase),
        "stability": branch.stability.tolist(),
        "multipliers": plain(branch.multipliers),
        "error": plain(branch.error),
        "special_points": [
            {
                **({"value": point.value} if isinstance(point, FieldSpecialPoint) else {}),
                **{name: getattr(point, name) for name in PLACE},
                "stability": point.orbit.stability,
                "amplitude": _named(point.orbit.system, point.amplitude),
                **point_document(point.orbit.point),
            }
            for point in branch.special_points
        ],
    }


def _named(system: MechanicalSystem, value: Callable[[Coordinate], object]) -> dict[str, Any]:
    """What is read off for each named coordinate."""
    return {str(which): plain(value(which)) for which in system.named}


def _ended_from(document: Document) -> dict[str, Any]:
    """How a branch ended, and what is to be said of it."""
    kinds = {"status": BranchStatus, "notes": tuple[str, ...], "version": str}
    return {name: CODEC.form(kind).read(document[name]) for name, kind in kinds.items()}


def _place_from(document: Document) -> dict[str, Any]:
    """What a special point is, and where it stands along its branch."""
    kinds = dict(zip(PLACE, (str, float, int, int), strict=True))
    return {name: CODEC.form(kind).read(document[name]) for name, kind in kinds.items()}


def _words_from(words: list[str], points: int) -> NDArray[np.str_]:
    for word in words:
        checked_word("stability", word, WORDS)
    return np.asarray(words, dtype="<U12").reshape(points)


def sweep_document(sweep: Sweep) -> dict[str, Any]:
    """What a machine settles to, speed by speed."""
    return {
        "version": sweep.version,
        "machine": machine_document(sweep.machine),
        "omega": plain(sweep.omega),
        "amplitude": _named(sweep.system, sweep.amplitude),
        "periods": plain(sweep.periods),
        "settled": plain(sweep.settled),
        "turns": plain(sweep.turns),
        "distance": plain(sweep.distance),
        "jumps": [dataclasses.asdict(jump) for jump in sweep.jumps],
        "max_periods": sweep.max_periods,
        "most_turns": sweep.most_turns,
        "complete": sweep.complete,
        "states": [plain(row.recent) for row in sweep.rows],
        "points": [None if row.point is None else point_document(row.point) for row in sweep.rows],
    }


def sweep_from(document: Document) -> Sweep:
    """The sweep of a document."""
    motions = Motions.of(document)
    columns = [document[name] for name in ("states", "points", "distance", "turns", "settled")]
    rows = []
    for states, one, distance, turns, settled in zip(*columns, strict=True):
        recent = array(states, float, (-1, 2 * motions.system.size))
        point = None if one is None else motions.point(one, Point)
        away = np.inf if point is None else CODEC.form(float).read(distance)
        kept = checked_count("turns", turns, 2**63), point, away, checked_flag("settled", settled)
        rows.append(Settled(recent[-1].copy(), *kept, recent))
    omega = checked_speeds(document["omega"])
    if omega.size != len(rows):
        raise ValueError(f"{len(rows)} rows are not one for each of {omega.size} speeds")
    return Sweep(
        machine=motions.machine,
        omega=omega,
        rows=tuple(rows),
        jumps=CODEC.form(tuple[Jump, ...]).read(document["jumps"]),
        max_periods=checked_count("max_periods", document["max_periods"], MOST_TURNS),
        most_turns=checked_count("most_turns", document["most_turns"], 2**63),
        formulation=motions.solver({"half_turn": False, "turns": 1}).formulation,
        version=CODEC.form(str).read(document["version"]),
        complete=checked_flag("complete", document.get("complete", True)),
    )


def sensitivity_document(result: Sensitivity) -> dict[str, Any]:
    """A sensitivity by its fields, some by other names."""
    fields = CODEC.fields(Sensitivity).write(result)
    named = {"machine": fields.pop("screen"), "vary": fields.pop("distributions")}
    return {**named, "interval": isinstance(result.omega, tuple), **fields}


def sensitivity_from(document: Document) -> Sensitivity:
    """The sensitivity of a document."""
    named = {"screen": document["machine"], "distributions": document["vary"]}
    found: Sensitivity = CODEC.fields(Sensitivity).read({**document, **named})
    if not document["interval"]:
        return found
    low, high = np.asarray(found.omega).tolist()
    return dataclasses.replace(found, omega=(low, high))


def _by_name(*kinds: type) -> dict[str, type]:
    return {kind.__name__: kind for kind in kinds}


WORDS = (STABLE, UNSTABLE, UNDETERMINED)
METHODS = CODEC.tagged("name", _by_name(PiecewiseExact, HarmonicBalance, SampledHarmonicBalance))
SCREENS, SYSTEMS = {"screen": FlipFlowScreen}, {"system": MechanicalSystem}
MACHINES = CODEC.tagged("kind", SCREENS | SYSTEMS)
CODEC.learn(
    {
        ClearanceSpring: Form(spring_document, spring_from),
        Unbalance | HarmonicForce: CODEC.tagged("kind", _by_name(Unbalance, HarmonicForce)),
        Machine: Form(machine_document, MACHINES.read),
        FlipFlowScreen: CODEC.tagged("kind", SCREENS),
        MechanicalSystem: CODEC.tagged("kind", SYSTEMS),
        Method: METHODS,
        Distribution: CODEC.tagged("kind", _by_name(Interval, Normal, Choice)),
        Orbit: Form(orbit_document, orbit_from),
        Branch: Form(branch_document, branch_from),
        FieldBranch: Form(field_branch_document, field_branch_from),
        Sweep: Form(sweep_document, sweep_from),
        Sensitivity: Form(sensitivity_document, sensitivity_from),
    }
)
