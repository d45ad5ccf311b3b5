"""A start or a coast-down in numbers, without its motion."""

from __future__ import annotations

import dataclasses
from typing import Any

from flipflow.model.drive import SpeedProfile
from flipflow.results.codec import plain
from flipflow.transient.startup import RunUp


def run_up_summary(run: RunUp) -> dict[str, Any]:
    """Verdict, peaks, power and drive, SI."""
    history = run.history
    summary = {
        "schema": "flipflow/run-up/1",
        "version": history.version,
        "verdict": run.verdict,
        "outcome": run.outcome,
        "speed": run.speed,
        "final_speed": run.final_speed,
        "near": None if run.near is None else run.near._asdict(),
        "first_frequency": run.first_frequency,
        "time_to_speed": run.time_to_speed,
        "passing": run.passing,
        "peaks": {name: dataclasses.asdict(peak) for name, peak in run.peaks.items()},
        "power": run.power,
        "energy": history.energy,
        "drive": _drive(run),
        "notes": run.notes,
        "status": history.status,
        "method": history.method,
        "counters": history.counters,
    }
    return {name: plain(value) for name, value in summary.items()}


def _drive(run: RunUp) -> dict[str, Any]:
    if isinstance(run.drive, SpeedProfile):
        return {"times": run.drive.times, "speeds": run.drive.speeds}
    return dataclasses.asdict(run.drive)
