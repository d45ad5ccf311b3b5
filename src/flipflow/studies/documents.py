"""What a file holds of machines, methods, motions and branches: all it takes to open them again.

Documents are plain dictionaries of JSON types; complex numbers are pairs [re, im], what is not
finite is null. :mod:`flipflow.results.codec` writes what needs no words of its own.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from flipflow.continuation.branch import Branch, SpecialPoint
from flipflow.continuation.field_branch import FieldBranch
from flipflow.continuation.frequency_response import method_of
from flipflow.errors import StoreError
from flipflow.model.elements import ClearanceSpring, HarmonicForce, Unbalance
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Coordinate, Machine, MechanicalSystem
from flipflow.periodic.options import (
    HarmonicBalance,
    Method,
    PiecewiseExact,
    SampledHarmonicBalance,
)
from flipflow.periodic.orbit import Orbit
from flipflow.periodic.solver import Point
from flipflow.results.codec import Codec, array, exact, plain
from flipflow.transient.sweep import Sweep

Document = dict[str, Any]
METHODS: Mapping[str, type[Method]] = {
    "PiecewiseExact": PiecewiseExact,
    "HarmonicBalance": HarmonicBalance,
    "SampledHarmonicBalance": SampledHarmonicBalance,
}
SCREEN = Codec({}).form(FlipFlowScreen)


def branch_document(branch: Branch) -> Document:
    """A branch over frequency."""
    traced = branch.traced
    return {
        **_followed_document(branch, branch.system.named),
        "method": method_document(branch.method),
        "shortened_steps": [dataclasses.asdict(step) for step in branch.shortened_steps],
        "special_points": [special_point_document(point) for point in branch.special_points],
        "half_turn": branch.formulation.half_turn,
        "turns": branch.formulation.turns,
        "saddle_side_at_start": branch.saddle_side_at_start,
        "unknowns": plain(traced.u),
        "tangent": plain(traced.tangent),
        "return_maps": plain(branch.return_maps),
        "course": plain(tuple(traced.course)),
        "side": plain(traced.record.side),
        "signature": plain(traced.signature),
        "iterations": plain(traced.record.iterations),
        "rejected": plain(traced.rejected),
        "reason": plain(traced.reason),
        "code": traced.code,
    }


def field_branch_document(branch: FieldBranch) -> Document:
    """A branch over a field of the machine."""
    return {
        **_followed_document(branch, branch.machine.system().named),
        "field": branch.field,
        "values": plain(branch.values),
        "points": [_point_document(orbit.point) for orbit in branch.orbits],
        "special_points": [
            {"value": point.value, **special_point_document(point)}
            for point in branch.special_points
        ],
    }


def _followed_document(branch: Branch | FieldBranch, named: tuple[Coordinate, ...]) -> Document:
    """What every branch holds, and the amplitudes and phases of named coordinates."""
    return {
        "version": branch.version,
        "machine": machine_document(branch.machine),
        "status": branch.status.name,
        "status_sentence": branch.status.value,
        "complete": branch.complete,
        "notes": list(branch.notes),
        "omega": plain(branch.omega),
        "amplitude": {str(which): plain(branch.amplitude(which)) for which in named},
        "phase": {str(which): plain(branch.phase(which)) for which in named},
        "stability": branch.stability.tolist(),
        "multipliers": plain(branch.multipliers),
        "error": plain(branch.error),
    }


def special_point_document(point: SpecialPoint) -> Document:
    """A special point: kind, frequency, amplitudes, its motion."""
    system = point.orbit.system
    return {
        "kind": point.kind,
        "omega": point.omega,
        "position": point.position,
        "spring": point.spring,
        "side": point.side,
        "stability": point.orbit.stability,
        "amplitude": {str(which): point.amplitude(which) for which in system.named},
        **_point_document(point.orbit.point),
    }


def orbit_document(orbit: Orbit) -> Document:
    """One motion of a machine, and the amplitudes of named coordinates."""
    system = orbit.system
    return {
        "machine": machine_document(orbit.machine),
        "method": method_document(method_of(orbit.point.formulation)),
        "omega": orbit.omega,
        "periods": orbit.periods,
        "stability": orbit.stability,
        "amplitude": {str(which): plain(orbit.amplitude(which)) for which in system.named},
        **_point_document(orbit.point),
    }


def sweep_document(sweep: Sweep) -> Document:
    """What a machine settles to, speed by speed."""
    return {
        "version": sweep.version,
        "machine": machine_document(sweep.machine),
        "omega": plain(sweep.omega),
        "amplitude": {str(which): plain(sweep.amplitude(which)) for which in sweep.system.named},
        "periods": plain(sweep.periods),
        "settled": plain(sweep.settled),
        "turns": plain(sweep.turns),
        "distance": plain(sweep.distance),
        "jumps": [dataclasses.asdict(jump) for jump in sweep.jumps],
        "max_periods": sweep.max_periods,
        "most_turns": sweep.most_turns,
        "complete": sweep.complete,
        "states": [plain(row.recent) for row in sweep.rows],
        "points": [None if row.point is None else _point_document(row.point) for row in sweep.rows],
    }


def _point_document(point: Point) -> Document:
    """A motion as its solver left it."""
    return {
        "omega": point.omega,
        "half_turn": point.formulation.half_turn,
        "turns": point.formulation.turns,
        "unknowns": plain(point.u),
        "return_map": plain(point.return_map),
    }


def machine_document(machine: Machine) -> Document:
    """A screen by its fields, any other machine by its matrices; infinite gaps are "inf"."""
    if isinstance(machine, FlipFlowScreen):
        return {"kind": "screen", **SCREEN.write(machine)}
    system = machine.system()
    return {
        "kind": "system",
        **{name: plain(getattr(system, name)) for name in "MCK"},
        "springs": [
            {
                "direction": plain(spring.direction),
                "stiffness": spring.stiffness,
                "damping": spring.damping,
                "gaps": exact(spring.gaps),
                "law": spring.law,
            }
            for spring in system.springs
        ],
        "excitation": {
            "kind": type(system.excitation).__name__,
            "vector": plain(system.excitation.vector),
        },
        "coordinates": plain(system.coordinates),
    }


def machine_from(document: Mapping[str, Any]) -> Machine:
    """The machine of a document."""
    return screen_from(document) if document["kind"] == "screen" else system_from(document)


def screen_from(document: Mapping[str, Any]) -> FlipFlowScreen:
    """The screen of a document.

    Raises
    ------
    StoreError
        When the document holds a machine of another kind.
    """
    if document["kind"] != "screen":
        raise StoreError("the machine of this result is no screen, as it should be")
    screen: FlipFlowScreen = SCREEN.read(document)
    return screen


def system_from(document: Mapping[str, Any]) -> MechanicalSystem:
    """The system of a document."""
    springs = [
        ClearanceSpring(
            one["direction"],
            one["stiffness"],
            one["damping"],
            float(one["gaps"][0]),
            float(one["gaps"][1]),
            law=one["law"],
        )
        for one in document["springs"]
    ]
    kinds: Mapping[str, type[Unbalance | HarmonicForce]] = {
        "Unbalance": Unbalance,
        "HarmonicForce": HarmonicForce,
    }
    excitation = document["excitation"]
    force = kinds[excitation["kind"]](array(excitation["vector"], complex))
    M, C, K = (document[name] for name in "MCK")
    return MechanicalSystem(M, C, K, springs, force, document["coordinates"])


def method_document(method: Method) -> Document:
    """A method by name and options."""
    return {"name": type(method).__name__, **dataclasses.asdict(method)}


def method_from(document: Mapping[str, Any]) -> Method:
    """The method of a document.

    Raises
    ------
    StoreError
        For a method that this version does not know.
    """
    options = {key: value for key, value in document.items() if key != "name"}
    if document["name"] not in METHODS:
        raise StoreError(f"the method {document['name']!r} is not known; update flipflow")
    return METHODS[document["name"]](**options)
