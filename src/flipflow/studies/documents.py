"""What a file holds of machines, methods, motions and branches: all it takes to open them again.

:mod:`flipflow.results.codec` writes a result by its fields. Here stands what has other words in a
file: a motion lies beside the machine and the method it belongs to, and is read with their
equations. Amplitudes and the like are for other readers. Nothing is computed again when a file is
opened.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from flipflow.compiled.arrays import Complex, Int, Real
from flipflow.continuation import correction
from flipflow.continuation.bifurcation_curve import BifurcationCurve, CurvePoint
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.field_branch import FieldBranch, FieldSpecialPoint
from flipflow.continuation.field_solver import FieldPoint
from flipflow.continuation.frequency_response import formulation_of, method_of
from flipflow.model.arguments import (
    checked_count,
    checked_numbers,
    checked_speed,
    checked_speeds,
)
from flipflow.model.contact_law import ContactLaw
from flipflow.model.elements import ClearanceSpring
from flipflow.model.excitation import Excitation, HarmonicForce, MovingBase, Unbalance
from flipflow.model.parameters import parameter_names, value_of, with_values
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
from flipflow.results.codec import Codec, Form, array, plain
from flipflow.studies.response_family import Member, ResponseFamily
from flipflow.studies.sensitivity import OneAtATime, Sensitivity
from flipflow.transient.settling import PERIODIC, UNDECIDED, Settled
from flipflow.transient.settling import Word as Moving
from flipflow.transient.sweep import Jump, Sweep

Document = Mapping[str, Any]
P = TypeVar("P", bound=Point)
Word = Literal["stable", "unstable", "undetermined"]
MOST_TURNS = 10_000  # forcing periods after which a motion of a file may repeat
CODEC = Codec()

# Parts that are read again, by name and type, and where they stand in a result.
SPRING = CODEC.table(
    {
        "direction": Real, "stiffness": float, "damping": float, "gaps": tuple[float, float],
        "law": ContactLaw,
    }
)  # fmt: skip
FORMULATION = {"half_turn": bool, "turns": int}
FORMULATION_AT = {name: f"formulation.{name}" for name in FORMULATION}
POINT = CODEC.table(
    {"omega": float, **FORMULATION, "unknowns": Real, "return_map": Real},
    unknowns="u", **FORMULATION_AT,
)  # fmt: skip
PLACE = CODEC.table({"kind": str, "position": float, "spring": int, "side": int})
WORD = CODEC.table({"stability": Word})
ENDED = {"version": str, "status": BranchStatus, "notes": tuple[str, ...]}
FOLLOWED = {**ENDED, "omega": Real, "stability": tuple[Word, ...], "multipliers": Complex}
RECORDED = {"tangent": Real, "side": Real, "signature": Int, "iterations": Int}
TRIED = {"rejected": Int, "reason": Int}
BRANCH = CODEC.table(
    {
        "machine": Machine, "method": Method, **FOLLOWED, **FORMULATION,
        "saddle_side_at_start": bool, "return_maps": Real, "unknowns": Real, **RECORDED, **TRIED,
        "code": int, "course": tuple[float, ...],
    },
    **FORMULATION_AT, unknowns="traced.u", code="traced.code", course="traced.course.along_omega",
    **{name: f"traced.record.{name}" for name in RECORDED},
    **{name: f"traced.{name}" for name in TRIED},
)  # fmt: skip
FIELD_BRANCH = CODEC.table({**FOLLOWED, "field": str, "values": Real})
BIFURCATION_CURVE = CODEC.table(
    {**FOLLOWED, "bifurcation": str, "parameters": tuple[str, str], "values": Real},
    bifurcation="kind",
)
SWEEP = CODEC.table(
    {
        "machine": Machine, "version": str, "omega": Real, "settled": NDArray[np.bool_],
        "turns": Int, "jumps": tuple[Jump, ...], "max_periods": int, "most_turns": int,
    }
)  # fmt: skip


def machine_document(machine: Machine) -> dict[str, Any]:
    """A screen by its fields, any other machine by its matrices; infinite gaps are "inf"."""
    kept = machine if isinstance(machine, FlipFlowScreen) else machine.system()
    written: dict[str, Any] = MACHINES.write(kept)
    return written


def spring_from(document: Document) -> ClearanceSpring:
    """The spring of a document."""
    read = SPRING.read(document)
    clearance, minus = read.pop("gaps")
    return ClearanceSpring(clearance=clearance, clearance_minus=minus, **read)


class Motions:
    """Reads the motions of one machine by one method; equations are set up once."""

    def __init__(self, machine: Machine, method: Method) -> None:
        self.machine, self.method, self.system = machine, method, machine.system()
        self.states = 2 * self.system.size
        self._solvers: dict[tuple[bool, int], Solver] = {}

    def solver(self, half_turn: bool, turns: int) -> Solver:
        """A solver of such motions."""
        checked_count("turns", turns, MOST_TURNS)
        if (half_turn, turns) not in self._solvers:
            found = formulation_of(self.system, self.method, half_turn=half_turn, turns=turns)
            self._solvers[half_turn, turns] = found.solver()
        return self._solvers[half_turn, turns]

    def point(self, document: Document, kind: type[P], **more: Any) -> P:
        """A motion as its solver left it."""
        read = POINT.read(document)
        solver = self.solver(read["half_turn"], read["turns"])
        u, known = read["unknowns"], read["return_map"].reshape(self.states, self.states)
        checked_numbers("unknowns", u, "give finite numbers")
        omega = checked_speed(read["omega"])
        return kind(solver.formulation, u.reshape(solver.unknowns), omega, known_map=known, **more)

    def orbit(self, document: Document, kind: type[P], **more: Any) -> Orbit:
        """A motion and its stability."""
        word = WORD.read(document)["stability"]
        return Orbit(self.machine, self.point(document, kind, **more), word)


def orbit_document(orbit: Orbit) -> dict[str, Any]:
    """One motion of a machine, and the amplitudes of named coordinates."""
    return {
        "machine": machine_document(orbit.machine),
        "method": METHODS.write(method_of(orbit.point.formulation)),
        "periods": orbit.periods,
        "amplitude": _named(orbit.system, orbit.amplitude),
        **WORD.write(orbit),
        **POINT.write(orbit.point),
    }


def orbit_from(document: Document) -> Orbit:
    """The motion of a document."""
    motions = Motions(MACHINES.read(document["machine"]), METHODS.read(document["method"]))
    return motions.orbit(document, Point)


def branch_document(branch: Branch) -> dict[str, Any]:
    """A branch over frequency."""
    steps = [dataclasses.asdict(step) for step in branch.shortened_steps]
    read_off = _read_off(branch, branch.system)
    section = CODEC.form(Real).write(branch.traced.record.phase)
    return {"shortened_steps": steps, **read_off, **BRANCH.write(branch), "section": section}


def branch_from(document: Document) -> Branch:
    """The branch of a document."""
    read = BRANCH.read(document)
    motions = Motions(read["machine"], read["method"])
    solver = motions.solver(read["half_turn"], read["turns"])
    n, points = motions.states, read["omega"].size
    maps = read["return_maps"].reshape(points, n, n)
    # Files of the time when every point was solved for at phase 0 do not say so.
    stored = document.get("section")
    phase = np.zeros(points) if stored is None else CODEC.form(Real).read(stored)
    branch = Branch(
        formulation=solver.formulation,
        traced=_traced_from({**read, "phase": phase}, solver, maps),
        return_maps=maps,
        multipliers=read["multipliers"].reshape(points, n),
        stability=np.asarray(read["stability"], dtype="<U12").reshape(points),
        # Where a branch meets another, the point is one of the other's motions.
        special_points=tuple(
            SpecialPoint(orbit=motions.orbit(one, Point), **PLACE.read(one))
            for one in document["special_points"]
        ),
        **{name: read[name] for name in ("machine", "method", "saddle_side_at_start", *ENDED)},
    )
    _ = branch.shortened_steps  # a reason that is not known ends the reading
    return branch


def _traced_from(read: Document, solver: Solver, maps: Real) -> Traced:
    """The points of a branch as they were followed, but for the depths: those are not kept."""
    points, tried = read["omega"].size, read["rejected"].size
    # One more than the points: the step at which the branch ended.
    record = solver.new_branch(points + 1)
    record.depth[:] = np.nan
    record.omega[:points] = checked_speeds(read["omega"]) if points else 0.0
    kept_as = {"u": "unknowns", "phase": "phase", **{name: name for name in RECORDED}}
    for name, word in kept_as.items():
        values = read[word]
        kept = getattr(record, name)[:points]
        kept[:] = values.reshape(kept.shape)
    if solver.reads_jacobian:
        record.jacobian[:points] = maps - np.eye(maps.shape[1])
    record.rejected[:tried], record.reason[:tried] = read["rejected"], read["reason"]
    course = correction.Course(*read["course"])
    return Traced.recorded(record, points, read["code"], course)


def field_branch_document(branch: FieldBranch) -> dict[str, Any]:
    """A branch over a field of the machine."""
    return {**_row_document(branch, (branch.field,)), **FIELD_BRANCH.write(branch)}


def bifurcation_curve_document(curve: BifurcationCurve) -> dict[str, Any]:
    """A curve in two parameters of the machine."""
    return {**_row_document(curve, curve.parameters), **BIFURCATION_CURVE.write(curve)}


def _row_document(row: FieldBranch | BifurcationCurve, names: Sequence[str]) -> dict[str, Any]:
    """Motions, each of a machine that differs in its parameters alone.

    What the fields of a user's class do to its matrices no file can tell: there each motion is
    kept with its own machine.
    """
    document = {
        **_read_off(row, row.machine.system()),
        "machine": machine_document(row.machine),
        "points": [POINT.write(orbit.point) for orbit in row.orbits],
    }
    if not _tells(row, names):
        at_points = document["special_points"], [point.orbit for point in row.special_points]
        for parts, orbits in (at_points, (document["points"], row.orbits)):
            for part, orbit in zip(parts, orbits, strict=True):
                part["machine"] = machine_document(orbit.machine)
    return document


def _tells(row: FieldBranch | BifurcationCurve, names: Sequence[str]) -> bool:
    """Whether the machine, read again from a file, gives those of the motions by their values.

    A user's field may be called as a parameter of plain systems is: both ends are compared.
    """
    machine = row.machine
    known = {"omega", *parameter_names(machine)}.issuperset(names)
    if not known or not isinstance(machine, (FlipFlowScreen, MechanicalSystem)):
        return False
    values = np.reshape(row.values, (-1, len(names))).tolist()
    ends = zip((values[:1], values[-1:]), (row.orbits[:1], row.orbits[-1:]), strict=True)
    return all(
        machine_document(_changed(machine, dict(zip(names, at[0], strict=True))))
        == machine_document(orbits[0].machine)
        for at, orbits in ends
        if orbits
    )


def _changed(machine: Machine, values: Mapping[str, float]) -> Machine:
    """The machine with other values of parameters; the frequency is none of its own."""
    return with_values(machine, {name: v for name, v in values.items() if name != "omega"})


def _motions_at(machine: Machine, values: Mapping[str, float], one: Document) -> Motions:
    """Reads a motion that has a machine of its own, or one with such values of parameters."""
    stored = one.get("machine")
    own = _changed(machine, values) if stored is None else MACHINES.read(stored)
    return Motions(own, PiecewiseExact())


def bifurcation_curve_from(document: Document) -> BifurcationCurve:
    """The curve of a document."""
    read = BIFURCATION_CURVE.read(document)
    machine, names = MACHINES.read(document["machine"]), read["parameters"]
    values = read["values"].reshape(-1, 2)

    def orbit_at(at: tuple[float, float], one: Document) -> Orbit:
        return _motions_at(machine, dict(zip(names, at, strict=True)), one).orbit(one, Point)

    def special_point(one: Document) -> CurvePoint:
        at = CODEC.form(tuple[float, float]).read(one["values"])
        return CurvePoint(orbit=orbit_at(at, one), values=at, **PLACE.read(one))

    points = zip(values.tolist(), document["points"], document["stability"], strict=True)
    return BifurcationCurve(
        orbits=tuple(orbit_at(at, {**one, "stability": word}) for at, one, word in points),
        special_points=tuple(map(special_point, document["special_points"])),
        machine=machine,
        kind=read["bifurcation"],
        values=values,
        **{name: read[name] for name in ("parameters", *ENDED)},
    )


def field_branch_from(document: Document) -> FieldBranch:
    """The branch of a document."""
    read = FIELD_BRANCH.read(document)
    machine, field = MACHINES.read(document["machine"]), read["field"]

    def orbit_at(value: float, one: Document) -> Orbit:
        motions = _motions_at(machine, {field: value}, one)
        return motions.orbit(one, FieldPoint, value=value)

    def special_point(one: Document) -> FieldSpecialPoint:
        value = CODEC.form(float).read(one["value"])
        return FieldSpecialPoint(orbit=orbit_at(value, one), value=value, **PLACE.read(one))

    points = zip(read["values"].tolist(), document["points"], document["stability"], strict=True)
    return FieldBranch(
        orbits=tuple(orbit_at(value, {**one, "stability": word}) for value, one, word in points),
        special_points=tuple(map(special_point, document["special_points"])),
        machine=machine,
        **{name: read[name] for name in ("field", "values", *ENDED)},
    )


def _read_off(
    branch: Branch | FieldBranch | BifurcationCurve, system: MechanicalSystem
) -> dict[str, Any]:
    """What every branch tells other readers, and its special points."""
    return {
        "status_sentence": branch.status.value,
        "complete": branch.complete,
        "amplitude": _named(system, branch.amplitude),
        "phase": _named(system, branch.phase),
        "error": plain(branch.error),
        "special_points": [
            {
                **_place_of(point),
                "amplitude": _named(point.orbit.system, point.amplitude),
                **PLACE.write(point),
                **WORD.write(point.orbit),
                **POINT.write(point.orbit.point),
            }
            for point in branch.special_points
        ],
    }


def _place_of(point: SpecialPoint) -> dict[str, Any]:
    """Where a special point stands, besides its speed."""
    if isinstance(point, FieldSpecialPoint):
        return {"value": point.value}
    return {"values": list(point.values)} if isinstance(point, CurvePoint) else {}


def _named(system: MechanicalSystem, value: Callable[[Coordinate], object]) -> dict[str, Any]:
    """What is read off for each named coordinate."""
    return {str(which): plain(value(which)) for which in system.named}


def sweep_document(sweep: Sweep) -> dict[str, Any]:
    """What a machine settles to, speed by speed."""
    points = [row.point for row in sweep.rows]
    return {
        "amplitude": _named(sweep.system, sweep.amplitude),
        "periods": plain(sweep.periods),
        "distance": plain(sweep.distance),
        "complete": sweep.complete,
        "words": list(sweep.words),
        "states": [plain(row.recent) for row in sweep.rows],
        "points": [None if point is None else POINT.write(point) for point in points],
        **SWEEP.write(sweep),
    }


def sweep_from(document: Document) -> Sweep:
    """The sweep of a document."""
    read = SWEEP.read(document)
    motions = Motions(read["machine"], PiecewiseExact())
    columns = [document[name] for name in ("omega", "states", "points", "distance")]
    columns += [read.pop("turns").tolist(), read.pop("settled").tolist()]
    # Files of the time when a sweep said no word for what does not settle have none.
    known = [PERIODIC if settled else UNDECIDED for settled in columns[-1]]
    columns.append(CODEC.form(tuple[Moving, ...]).read(document.get("words", known)))
    rows = []
    for _, states, one, distance, turns, settled, word in zip(*columns, strict=True):
        recent = array(states).reshape(-1, motions.states)
        point = None if one is None else motions.point(one, Point)
        away = np.inf if point is None else CODEC.form(float).read(distance)
        rows.append(Settled(recent[-1].copy(), turns, point, away, settled, recent, word))
    checked_speeds(read["omega"])
    complete = CODEC.form(bool).read(document.get("complete", True))
    formulation = motions.solver(half_turn=False, turns=1).formulation
    return Sweep(rows=tuple(rows), formulation=formulation, complete=complete, **read)


def sensitivity_document(result: Sensitivity) -> dict[str, Any]:
    """A sensitivity by its fields, one by another name."""
    fields = CODEC.fields(Sensitivity).write(result)
    named = {"machine": fields.pop("machine"), "vary": fields.pop("distributions")}
    return {**named, "interval": isinstance(result.omega, tuple), **fields}


def sensitivity_from(document: Document) -> Sensitivity:
    """The sensitivity of a document."""
    read = CODEC.fields(Sensitivity).read
    found: Sensitivity = read({**_with_own(document), "distributions": document["vary"]})
    if not document["interval"]:
        return found
    low, high = np.asarray(found.omega).tolist()
    return dataclasses.replace(found, omega=(low, high))


def _with_own(document: Document) -> Document:
    """A document with the machine's own values, which those of screens did not hold."""
    if "own" in document:
        return document
    machine = MACHINES.read(document["machine"])
    return {**document, "own": [value_of(machine, name) for name in document["names"]]}


def of_screens(kind: type, complete: Callable[[Document], Document] = dict) -> Form:
    """The form of a result whose machine a file calls "screen", which it had to be once.

    ``complete`` adds what earlier files did not hold.
    """
    fields = CODEC.fields(kind)

    def write(value: object) -> dict[str, Any]:
        written = fields.write(value)
        return {"screen": written.pop("machine"), **written}

    def read(document: Document) -> object:
        return fields.read(complete({**document, "machine": document["screen"]}))

    return Form(write, read)


def _by_name(*kinds: type) -> dict[str, type]:
    return {kind.__name__: kind for kind in kinds}


def excitation_document(given: Excitation | tuple[Excitation, ...]) -> object:
    """One excitation as an object, several as a list of them."""
    if isinstance(given, tuple):
        return [EXCITATION.write(one) for one in given]
    return EXCITATION.write(given)


def excitation_from(document: object) -> Excitation | tuple[Excitation, ...]:
    """What :func:`excitation_document` wrote."""
    if isinstance(document, list):
        return tuple(EXCITATION.read(one) for one in document)
    return EXCITATION.read(document)  # type: ignore[no-any-return]


EXCITATION = CODEC.tagged("kind", _by_name(Unbalance, HarmonicForce, MovingBase))
METHODS = CODEC.tagged("name", _by_name(PiecewiseExact, HarmonicBalance, SampledHarmonicBalance))
SCREENS, SYSTEMS = {"screen": FlipFlowScreen}, {"system": MechanicalSystem}
MACHINES = CODEC.tagged("kind", SCREENS | SYSTEMS)
CODEC.learn(
    {
        ClearanceSpring: Form(SPRING.write, spring_from),
        Excitation | tuple[Excitation, ...]: Form(excitation_document, excitation_from),
        Machine: Form(machine_document, MACHINES.read),
        FlipFlowScreen: CODEC.tagged("kind", SCREENS),
        MechanicalSystem: CODEC.tagged("kind", SYSTEMS),
        Method: METHODS,
        Distribution: CODEC.tagged("kind", _by_name(Interval, Normal, Choice)),
        Orbit: Form(orbit_document, orbit_from),
        Branch: Form(branch_document, branch_from),
        FieldBranch: Form(field_branch_document, field_branch_from),
        BifurcationCurve: Form(bifurcation_curve_document, bifurcation_curve_from),
        Sweep: Form(sweep_document, sweep_from),
        Sensitivity: Form(sensitivity_document, sensitivity_from),
        OneAtATime: of_screens(OneAtATime, _with_own),
        Member: of_screens(Member),
        ResponseFamily: of_screens(ResponseFamily),
    }
)
