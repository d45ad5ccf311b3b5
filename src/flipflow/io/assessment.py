"""An assessment in numbers, without the motions they are read off."""

from __future__ import annotations

from typing import Any

from flipflow.io.jump_risk import risk_summary
from flipflow.io.run_up import run_up_summary
from flipflow.results.codec import plain
from flipflow.studies.assessment import Assessment
from flipflow.studies.sensitivity import OneAtATime
from flipflow.studies.start_and_blows import Transients

ASSESSMENT = "flipflow/assessment/1"


def assessment_document(assessment: Assessment) -> dict[str, Any]:
    """Verdict, limits, region and cases of an assessment."""
    region = assessment.region
    frequencies = ("omega_ea", "omega_ar", "omega_cs", "omega_lb", "omega_ub", "lower", "upper")
    return {
        "schema": ASSESSMENT,
        "version": assessment.version,
        "input_hash": assessment.input_hash,
        "name": assessment.project.document.name or assessment.project.name,
        "verdict": assessment.verdict,
        "omega": assessment.omega,
        "limits": [plain(vars(row)) for row in assessment.limits_table],
        "region": {
            **{name: plain(getattr(region, name)) for name in frequencies},
            "feasible": plain(region.feasible),
            "binding": [[vars(bound) for bound in pair] for pair in region.binding],
            "cases": [
                {"name": c.name, "intervals": plain(c.intervals), "unchecked": plain(c.unchecked)}
                for c in region.cases
            ],
        },
        "cases": [
            {
                "name": case.name,
                "values": plain(case.values),
                "energy": plain(case.energy),
                "stop_reached": case.stop_reached,
                "stability": None if case.orbit is None else case.orbit.stability,
                "multipliers": None if case.orbit is None else plain(case.orbit.multipliers),
                "branch_status": case.branch.status.name,
                "special_points": [
                    {
                        "kind": p.kind,
                        "omega": p.omega,
                        "relative_amplitude": p.amplitude("relative"),
                    }
                    for p in case.branch.special_points
                ],
            }
            for case in assessment.cases
        ],
        "transients": _transients(assessment.transients),
        "tornado": None if assessment.tornado is None else _tornado_document(assessment.tornado),
        "notes": list(assessment.notes),
    }


def _transients(found: Transients | None) -> dict[str, Any] | None:
    """Start, coast-down and jump risk of the empty machine; null without a working speed."""
    if found is None:
        return None
    runs = {"start": found.start, "coast_down": found.coast_down}
    return {
        "drive_assumed": found.assumed,
        **{name: None if run is None else run_up_summary(run) for name, run in runs.items()},
        "jump_risk": None if found.jump is None else risk_summary(found.jump),
        "reasons": dict(found.reasons),
    }


def _tornado_document(result: OneAtATime) -> dict[str, Any]:
    fields = ("quantity", "names", "ends", "omega", "nominal", "at_low", "at_high")
    return {name: plain(getattr(result, name)) for name in fields}
