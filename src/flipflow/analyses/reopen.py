"""Branches and basins from their documents: nothing is computed again but what is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from flipflow.analyses.frequency_response import solver_for, word_of
from flipflow.errors import StoreError
from flipflow.kernels import arclength
from flipflow.methods.exact import ExactSolver
from flipflow.methods.solver import Point, Solver, Traced
from flipflow.model.system import Machine
from flipflow.results.basins import Basins, GridAxis
from flipflow.results.branch import Branch, SpecialPoint
from flipflow.results.document import BASINS, BRANCH, machine_from, method_from
from flipflow.results.orbit import Orbit
from flipflow.results.status import BranchStatus


def branch_from(document: Mapping[str, Any]) -> Branch:
    """The branch that :func:`flipflow.results.document.branch_document` wrote.

    Raises
    ------
    StoreError
        When the document is of another kind, or does not fit its machine.
    """
    if document.get("schema") != BRANCH:
        raise StoreError(f"schema {document.get('schema')!r} is not a branch of this version")
    machine, method = machine_from(document["machine"]), method_from(document["method"])
    system = machine.system()

    @cache
    def solver_of(half_turn: bool, turns: int) -> Solver:
        return solver_for(system, method, half_turn=half_turn, turns=turns)

    own = document["half_turn"], document.get("turns", 1)
    solver = solver_of(*own)
    traced = _traced_from(document, solver)
    points, n = traced.omega.size, solver.system.size
    special = tuple(
        # Where a branch meets another, the point is one of the other's motions.
        _special_from(
            one, machine, solver_of(one.get("half_turn", own[0]), one.get("turns", own[1]))
        )
        for one in document["special_points"]
    )
    multipliers = np.asarray(document["multipliers"], dtype=float).reshape(points, 2 * n, 2)
    return Branch(
        machine=machine,
        method=method,
        solver=solver,
        traced=traced,
        return_maps=np.asarray(document["return_maps"], dtype=float).reshape(points, 2 * n, 2 * n),
        saddle_side_at_start=bool(document["saddle_side_at_start"]),
        multipliers=multipliers[..., 0] + 1j * multipliers[..., 1],
        stability=np.asarray(document["stability"], dtype="<U12"),
        special_points=special,
        status=BranchStatus[document["status"]],
        notes=tuple(document["notes"]),
        version=document["version"],
    )


def _traced_from(document: Mapping[str, Any], solver: Solver) -> Traced:
    """The points of a branch as they were followed, but for the depths: those are not kept."""
    u = np.asarray(document["unknowns"], dtype=float).reshape(-1, solver.unknowns)
    points = u.shape[0]
    # One more than the points: the step at which the branch ended.
    record = solver.new_branch(points + 1)
    record.depth[:] = np.nan
    record.u[:points] = u
    record.omega[:points] = document["omega"]
    record.tangent[:points] = np.reshape(document["tangent"], (points, -1))
    record.signature[:points] = document["signature"]
    record.iterations[:points] = document["iterations"]
    tried = len(document["rejected"])
    record.rejected[:tried], record.reason[:tried] = document["rejected"], document["reason"]
    course = arclength.Course(*document["course"])
    return Traced.recorded(record, points, int(document["code"]), course)


def _special_from(one: Mapping[str, Any], machine: Machine, solver: Solver) -> SpecialPoint:
    unknowns, known = np.asarray(one["unknowns"]), np.asarray(one["return_map"])
    point = Point(solver, unknowns, one["omega"], known_map=known)
    orbit = Orbit(machine, point, word_of(one["kind"]))
    return SpecialPoint(one["kind"], orbit, one["position"], one["spring"], one["side"])


def basins_from(document: Mapping[str, Any]) -> Basins:
    """The basins that :func:`flipflow.results.document.basins_document` wrote.

    Raises
    ------
    StoreError
        When the document is of another kind.
    """
    if document.get("schema") != BASINS:
        raise StoreError(f"schema {document.get('schema')!r} is not basins of this version")
    machine, omega = machine_from(document["machine"]), float(document["omega"])
    orbits = []
    for one in document["orbits"]:
        solver = ExactSolver(machine.system(), half_turn=False, turns=one["periods"])
        unknowns, known = np.asarray(one["unknowns"]), np.asarray(one["return_map"])
        orbits.append(Orbit(machine, Point(solver, unknowns, omega, known_map=known)))
    return Basins(
        machine=machine,
        omega=omega,
        axes=tuple(
            GridAxis(axis["kind"], axis["which"], np.asarray(axis["values"], float))
            for axis in document["axes"]
        ),
        labels=np.asarray(document["labels"], np.int64),
        turns=np.asarray(document["turns"], np.int64),
        orbits=tuple(orbits),
        most_turns=document["most_turns"],
        notes=tuple(document["notes"]),
        version=document["version"],
    )
