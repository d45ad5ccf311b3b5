"""One data document per result: behind ``--json``, ``save`` and ``open_result``.

Documents are plain dictionaries of JSON types with ``"schema": "flipflow/<kind>/<version>"``;
complex numbers are pairs [re, im], what is not finite is null.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from flipflow.errors import StoreError
from flipflow.methods.options import (
    HarmonicBalance,
    Method,
    PiecewiseExact,
    SampledHarmonicBalance,
)
from flipflow.model.elements import ClearanceSpring, HarmonicForce, Unbalance
from flipflow.model.screen import FlipFlowScreen
from flipflow.model.system import Machine, MechanicalSystem
from flipflow.results.basins import Basins
from flipflow.results.branch import Branch, SpecialPoint
from flipflow.results.field_branch import FieldBranch
from flipflow.results.orbit import Orbit

Document = dict[str, Any]
METHODS: Mapping[str, type[Method]] = {
    "PiecewiseExact": PiecewiseExact,
    "HarmonicBalance": HarmonicBalance,
    "SampledHarmonicBalance": SampledHarmonicBalance,
}
BRANCH, ORBIT, BASINS = "flipflow/branch/1", "flipflow/orbit/1", "flipflow/basins/1"
FIELD_BRANCH = "flipflow/field-branch/1"


def plain(value: object) -> Any:
    """JSON types only: arrays become lists, complex numbers [re, im], inf and NaN null."""
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def branch_document(branch: Branch) -> Document:
    """A branch with what it takes to open it again, and the amplitudes of named coordinates."""
    system = branch.system
    traced = branch.traced
    return {
        "schema": BRANCH,
        "version": branch.version,
        "machine": machine_document(branch.machine),
        "method": method_document(branch.method),
        "status": branch.status.name,
        "status_sentence": branch.status.value,
        "complete": branch.complete,
        "notes": list(branch.notes),
        "shortened_steps": [dataclasses.asdict(step) for step in branch.shortened_steps],
        "omega": plain(branch.omega),
        "amplitude": {str(which): plain(branch.amplitude(which)) for which in system.named},
        "phase": {str(which): plain(branch.phase(which)) for which in system.named},
        "stability": branch.stability.tolist(),
        "multipliers": plain(branch.multipliers),
        "error": plain(branch.error),
        "special_points": [special_point_document(point) for point in branch.special_points],
        "half_turn": branch.solver.half_turn,
        "turns": branch.solver.turns,
        "saddle_side_at_start": branch.saddle_side_at_start,
        "unknowns": plain(traced.u),
        "tangent": plain(traced.tangent),
        "return_maps": plain(branch.return_maps),
        "course": plain(tuple(traced.course)),
        "signature": plain(traced.signature),
        "iterations": plain(traced.iterations),
        "rejected": plain(traced.rejected),
        "reason": plain(traced.reason),
        "code": traced.code,
    }


def field_branch_document(branch: FieldBranch) -> Document:
    """A branch over a field: amplitudes, stability, and the state of every motion."""
    system = branch.machine.system()
    return {
        "schema": FIELD_BRANCH,
        "version": branch.version,
        "machine": machine_document(branch.machine),
        "field": branch.field,
        "status": branch.status.name,
        "status_sentence": branch.status.value,
        "complete": branch.complete,
        "notes": list(branch.notes),
        "values": plain(branch.values),
        "omega": plain(branch.omega),
        "amplitude": {str(which): plain(branch.amplitude(which)) for which in system.named},
        "phase": {str(which): plain(branch.phase(which)) for which in system.named},
        "stability": branch.stability.tolist(),
        "multipliers": plain(branch.multipliers),
        "error": plain(branch.error),
        "periods": [orbit.periods for orbit in branch.orbits],
        "states": [plain(orbit.state) for orbit in branch.orbits],
        "special_points": [
            {"value": point.value, **special_point_document(point)}
            for point in branch.special_points
        ],
    }


def special_point_document(point: SpecialPoint) -> Document:
    """A special point: kind, frequency, amplitudes, the motion's unknowns."""
    system = point.orbit.system
    return {
        "kind": point.kind,
        "omega": point.omega,
        "position": point.position,
        "spring": point.spring,
        "side": point.side,
        "amplitude": {str(which): point.amplitude(which) for which in system.named},
        "half_turn": point.orbit.point.solver.half_turn,
        "turns": point.orbit.periods,
        "unknowns": plain(point.orbit.unknowns),
        "return_map": plain(point.orbit.return_map),
    }


def orbit_document(orbit: Orbit) -> Document:
    """One motion: over time, its contacts, multipliers and error."""
    system = orbit.system
    return {
        "schema": ORBIT,
        "omega": orbit.omega,
        "periods": orbit.periods,
        "stability": orbit.stability,
        "multipliers": plain(orbit.multipliers),
        "error": plain(orbit.error),
        "t": plain(orbit.t),
        "displacement": {str(which): plain(orbit.displacement(which)) for which in system.named},
        "velocity": {str(which): plain(orbit.velocity(which)) for which in system.named},
        "amplitude": {str(which): orbit.amplitude(which) for which in system.named},
        "stop_force": [plain(orbit.stop_force(j)) for j in range(len(system.springs))],
        "contacts": [plain(dataclasses.asdict(touch)) for touch in orbit.contact_intervals],
    }


def basins_document(basins: Basins) -> Document:
    """Labels, shares and motions of a grid of initial states; what it takes to open it again."""
    system = basins.machine.system()
    return {
        "schema": BASINS,
        "version": basins.version,
        "machine": machine_document(basins.machine),
        "omega": basins.omega,
        "axes": [
            {"kind": axis.kind, "which": axis.which, "values": plain(axis.values)}
            for axis in basins.axes
        ],
        "labels": plain(basins.labels),
        "turns": plain(basins.turns),
        "most_turns": basins.most_turns,
        "complete": basins.complete,
        "shares": plain(basins.shares),
        "share_intervals": plain(basins.share_intervals),
        "unsettled": basins.unsettled,
        "orbits": [
            {
                "periods": orbit.periods,
                "amplitude": {str(which): orbit.amplitude(which) for which in system.named},
                "unknowns": plain(orbit.unknowns),
                "return_map": plain(orbit.return_map),
            }
            for orbit in basins.orbits
        ],
        "notes": list(basins.notes),
    }


def machine_document(machine: Machine) -> Document:
    """A screen by its fields, any other machine by its matrices; infinite gaps are "inf"."""
    if isinstance(machine, FlipFlowScreen):
        fields = dataclasses.asdict(machine)
        return {"kind": "screen", **{key: _with_inf(value) for key, value in fields.items()}}
    system = machine.system()
    return {
        "kind": "system",
        **{name: plain(getattr(system, name)) for name in "MCK"},
        "springs": [
            {
                "direction": plain(spring.direction),
                "stiffness": spring.stiffness,
                "damping": spring.damping,
                "gaps": [_with_inf(gap) for gap in spring.gaps],
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
    values = {key: value for key, value in document.items() if key != "kind"}
    if document["kind"] == "screen":
        table = tuple(tuple(row) for row in values.pop("temperature_factor", ()))
        numbers = {key: math.inf if value == "inf" else value for key, value in values.items()}
        return FlipFlowScreen(temperature_factor=table, **numbers)  # type: ignore[arg-type]
    springs = [
        ClearanceSpring(
            one["direction"],
            one["stiffness"],
            one["damping"],
            float(one["gaps"][0]),
            float(one["gaps"][1]),
            law=one["law"],
        )
        for one in values["springs"]
    ]
    kinds: Mapping[str, type[Unbalance | HarmonicForce]] = {
        "Unbalance": Unbalance,
        "HarmonicForce": HarmonicForce,
    }
    vector = _complex(values["excitation"]["vector"])
    return MechanicalSystem(
        values["M"], values["C"], values["K"], springs,
        kinds[values["excitation"]["kind"]](vector), values["coordinates"],
    )  # fmt: skip


def method_document(method: Method) -> Document:
    """A method by name and options."""
    return {"name": type(method).__name__, **dataclasses.asdict(method)}


def method_from(document: Mapping[str, Any]) -> Method:
    """The method of a document."""
    options = {key: value for key, value in document.items() if key != "name"}
    if document["name"] not in METHODS:
        raise StoreError(f"method {document['name']!r} is not known; update flipflow")
    return METHODS[document["name"]](**options)


def _with_inf(value: object) -> object:
    return "inf" if value == math.inf else value


def _complex(pairs: object) -> np.ndarray[Any, np.dtype[np.complex128]]:
    array = np.asarray(pairs, dtype=float)
    return np.asarray(array[..., 0] + 1j * array[..., 1])
