"""Data documents of motions in time: histories, sweeps, sets of orbits."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from flipflow.results.document import Document, machine_document, orbit_document, plain
from flipflow.results.history import History
from flipflow.results.orbit import Orbit
from flipflow.results.sweep import Sweep

HISTORY, SWEEP, ORBITS = "flipflow/history/1", "flipflow/sweep/1", "flipflow/orbits/1"


def history_document(history: History) -> Document:
    """A motion over time: coordinates, stop forces, energies, how far from settled."""
    named = history.system.named
    return {
        "schema": HISTORY,
        "version": history.version,
        "method": history.method,
        "status": history.status,
        "settled": history.settled,
        "distance": plain(history.distance),
        "energy": plain(history.energy),
        "counters": plain(history.counters),
        "notes": list(history.notes),
        "t": plain(history.t),
        "omega": plain(history.omega),
        "angle": plain(history.angle),
        "torque": plain(history.torque),
        "normal": plain(history.normal),
        "displacement": {str(which): plain(history.displacement(which)) for which in named},
        "velocity": {str(which): plain(history.velocity(which)) for which in named},
        "acceleration": {str(which): plain(history.acceleration(which)) for which in named},
        "stop_force": [plain(history.stop_force(j)) for j in range(history.force.shape[1])],
        "events": [dataclasses.asdict(event) for event in history.events],
    }


def sweep_document(sweep: Sweep) -> Document:
    """What a machine settles to, speed by speed."""
    return {
        "schema": SWEEP,
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
    }


def orbits_document(orbits: Sequence[Orbit]) -> Document:
    """Every motion found at one speed."""
    return {"schema": ORBITS, "orbits": [orbit_document(orbit) for orbit in orbits]}
