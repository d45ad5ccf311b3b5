"""Results from their documents: nothing is computed again but what is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation import arclength
from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.branch_status import BranchStatus
from flipflow.continuation.field_branch import FieldBranch, FieldSpecialPoint
from flipflow.continuation.field_path import FieldPoint
from flipflow.continuation.frequency_response import formulation_of
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem
from flipflow.model.vary import Distribution
from flipflow.periodic.options import Method, PiecewiseExact
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Formulation, Point, Solver, Traced
from flipflow.results.codec import Codec, Form, array
from flipflow.studies.documents import (
    branch_document,
    field_branch_document,
    machine_document,
    machine_from,
    method_document,
    method_from,
    orbit_document,
    screen_from,
    sweep_document,
    system_from,
)
from flipflow.studies.sensitivity import (
    Sensitivity,
    distribution_document,
    distribution_from,
    sensitivity_document,
    sensitivity_from,
)
from flipflow.transient.settle import Settled
from flipflow.transient.sweep import Jump, Sweep

Document = Mapping[str, Any]
FormulationFor = Callable[[bool, int], Formulation]


def branch_from(document: Document) -> Branch:
    """The branch that :func:`flipflow.studies.documents.branch_document` wrote."""
    machine, method = machine_from(document["machine"]), method_from(document["method"])
    formulation_for = _formulations(machine, method)
    formulation = formulation_for(document["half_turn"], document["turns"])
    traced = _traced_from(document, formulation.solver())
    points, n = traced.omega.size, formulation.system.size
    return Branch(
        machine=machine,
        method=method,
        formulation=formulation,
        traced=traced,
        return_maps=_return_maps(document, n),
        saddle_side_at_start=document["saddle_side_at_start"],
        multipliers=array(document["multipliers"], complex).reshape(points, 2 * n),
        stability=np.asarray(document["stability"], dtype="<U12"),
        # Where a branch meets another, the point is one of the other's motions.
        special_points=tuple(
            SpecialPoint(
                orbit=Orbit(machine, _point_from(one, formulation_for), one["stability"]),
                **_place(one),
            )
            for one in document["special_points"]
        ),
        status=BranchStatus[document["status"]],
        notes=tuple(document["notes"]),
        version=document["version"],
    )


def _formulations(machine: Machine, method: Method) -> FormulationFor:
    """Formulations by whether they look for half a turn, and by turns, each made once."""
    system = machine.system()

    @cache
    def formulation_for(half_turn: bool, turns: int) -> Formulation:
        return formulation_of(system, method, half_turn=half_turn, turns=turns)

    return formulation_for


def _return_maps(document: Document, n: int) -> Real:
    return array(document["return_maps"]).reshape(-1, 2 * n, 2 * n)


def _traced_from(document: Document, solver: Solver) -> Traced:
    """The points of a branch as they were followed, but for the depths: those are not kept."""
    u = array(document["unknowns"]).reshape(-1, solver.unknowns)
    points = u.shape[0]
    # One more than the points: the step at which the branch ended.
    record = solver.new_branch(points + 1)
    record.depth[:] = np.nan
    record.u[:points] = u
    record.omega[:points] = document["omega"]
    record.tangent[:points] = array(document["tangent"]).reshape(points, solver.unknowns + 1)
    record.side[:points] = document["side"]
    record.signature[:points] = document["signature"]
    record.iterations[:points] = document["iterations"]
    if solver.reads_jacobian:
        record.jacobian[:points] = _return_maps(document, solver.system.size) - np.eye(
            solver.unknowns
        )
    tried = len(document["rejected"])
    record.rejected[:tried], record.reason[:tried] = document["rejected"], document["reason"]
    course = arclength.Course(*document["course"])
    return Traced.recorded(record, points, document["code"], course)


def _point_from(document: Document, formulation_for: FormulationFor) -> Point:
    """A motion as its solver left it."""
    formulation = formulation_for(document["half_turn"], document["turns"])
    known = array(document["return_map"])
    return Point(formulation, array(document["unknowns"]), document["omega"], known_map=known)


def _place(document: Document) -> dict[str, Any]:
    """What a special point is, and where it stands along its branch."""
    return {name: document[name] for name in ("kind", "position", "spring", "side")}


def orbit_from(document: Document) -> Orbit:
    """The motion that :func:`flipflow.studies.documents.orbit_document` wrote."""
    machine, method = machine_from(document["machine"]), method_from(document["method"])
    point = _point_from(document, _formulations(machine, method))
    return Orbit(machine, point, document["stability"])


def field_branch_from(document: Document) -> FieldBranch:
    """The branch that :func:`flipflow.studies.documents.field_branch_document` wrote."""
    screen, field = screen_from(document["machine"]), document["field"]

    def orbit_at(value: float, one: Document, word: str) -> Orbit:
        machine = screen.replace(**{field: value})
        formulation = _formulations(machine, PiecewiseExact())(one["half_turn"], one["turns"])
        point = FieldPoint(
            formulation, array(one["unknowns"]), one["omega"],
            known_map=array(one["return_map"]), value=value,
        )  # fmt: skip
        return Orbit(machine, point, word)

    points = zip(document["values"], document["points"], document["stability"], strict=True)
    return FieldBranch(
        machine=screen,
        field=field,
        orbits=tuple(orbit_at(*point) for point in points),
        values=array(document["values"]),
        special_points=tuple(
            FieldSpecialPoint(
                orbit=orbit_at(one["value"], one, one["stability"]),
                value=one["value"],
                **_place(one),
            )
            for one in document["special_points"]
        ),
        status=BranchStatus[document["status"]],
        notes=tuple(document["notes"]),
        version=document["version"],
    )


def sweep_from(document: Document) -> Sweep:
    """The sweep that :func:`flipflow.studies.documents.sweep_document` wrote."""
    machine = machine_from(document["machine"])
    formulation_for = _formulations(machine, PiecewiseExact())
    rows = []
    for k, (states, one) in enumerate(zip(document["states"], document["points"], strict=True)):
        recent = array(states)
        point = None if one is None else _point_from(one, formulation_for)
        distance = np.inf if point is None else document["distance"][k]
        turns, settled = document["turns"][k], document["settled"][k]
        rows.append(Settled(recent[-1].copy(), turns, point, distance, settled, recent))
    return Sweep(
        machine=machine,
        omega=array(document["omega"]),
        rows=tuple(rows),
        jumps=tuple(Jump(**jump) for jump in document["jumps"]),
        max_periods=document["max_periods"],
        most_turns=document["most_turns"],
        formulation=formulation_for(False, 1),
        version=document["version"],
        complete=document.get("complete", True),
    )


# Every other result is made of these, of numbers and of words.
CODEC = Codec(
    {
        Machine: Form(machine_document, machine_from),
        FlipFlowScreen: Form(machine_document, screen_from),
        MechanicalSystem: Form(machine_document, system_from),
        Method: Form(method_document, method_from),
        Distribution: Form(distribution_document, distribution_from),
        Orbit: Form(orbit_document, orbit_from),
        Branch: Form(branch_document, branch_from),
        FieldBranch: Form(field_branch_document, field_branch_from),
        Sweep: Form(sweep_document, sweep_from),
        Sensitivity: Form(sensitivity_document, sensitivity_from),
    }
)
