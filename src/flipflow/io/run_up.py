"""The data document of a start or a coast-down."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from flipflow.model.drive import SpeedProfile
from flipflow.results.document import machine_document, plain
from flipflow.results.history import History
from flipflow.results.run_up import RunUp

MOST_ROWS = 2000


def run_up_document(run: RunUp) -> dict[str, Any]:
    """Verdict, peaks, power, and the history at up to 2000 of its steps."""
    machine = {"machine": machine_document(run.machine)}
    return run_up_summary(run) | machine | {"history": _rows(run.history)}


def run_up_summary(run: RunUp) -> dict[str, Any]:
    """The document without the machine and without the history."""
    history = run.history
    return {
        "schema": "flipflow/run-up/1",
        "version": history.version,
        "verdict": run.verdict,
        "outcome": run.outcome,
        "speed": run.speed,
        "final_speed": run.final_speed,
        "near": None if run.near is None else {"name": run.near[0], "omega": run.near[1]},
        "first_frequency": run.first_frequency,
        "time_to_speed": run.time_to_speed,
        "passing": run.passing,
        "peaks": {name: dataclasses.asdict(peak) for name, peak in run.peaks.items()},
        "power": dict(run.power),
        "energy": dict(history.energy),
        "drive": _drive(run),
        "notes": list(run.notes),
        "status": history.status,
        "method": history.method,
        "counters": dict(history.counters),
    }


def _drive(run: RunUp) -> dict[str, Any]:
    if isinstance(run.drive, SpeedProfile):
        return {"times": list(run.drive.times), "speeds": list(run.drive.speeds)}
    return dataclasses.asdict(run.drive)


def _rows(history: History) -> dict[str, Any]:
    """Some of the rows, evenly spread over the steps, first and last included."""
    count = min(history.t.size, MOST_ROWS)
    rows = np.unique(np.linspace(0, history.t.size - 1, count).round().astype(int))
    table = {"t": history.t, "omega": history.omega, "angle": history.angle}
    table |= {str(which): history.displacement(which) for which in history.system.named}
    table |= {f"stop_force_{j}": history.stop_force(j) for j in range(history.force.shape[1])}
    if history.torque is not None:
        table["torque"] = history.torque
    if history.normal is not None:
        table["normal"] = history.normal_displacement
    return {name: plain(values[rows]) for name, values in table.items()}
