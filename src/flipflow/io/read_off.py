"""Numbers read off a result that stand in its file for other readers, SI.

They are not needed to open it again.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import singledispatch
from typing import Any

from flipflow.periodic.orbit import Orbit
from flipflow.results.codec import exact, plain
from flipflow.studies.allowed_range import allowed_range
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.compare import Comparison
from flipflow.studies.documents import CODEC
from flipflow.studies.foundation_loads import CaseLoads, FoundationLoads, RunLoads
from flipflow.studies.jump_risk import JumpRisk, Throw
from flipflow.studies.sensitivity import OneAtATime
from flipflow.studies.start_and_blows import CaseRuns, Transients
from flipflow.studies.start_sentence import does_it_start
from flipflow.transient.history import History
from flipflow.transient.run_up import Peak, RunSummary, RunUp

RUN = ("version", "energy", "status", "method", "counters")


@singledispatch
def read_off(_result: object) -> dict[str, Any]:
    """Nothing, where the fields of a result say it all."""
    return {}


@read_off.register
def orbit_numbers(orbit: Orbit) -> dict[str, Any]:
    """The motion over its period, its contacts, multipliers and error."""
    named = orbit.system.named
    return {
        "multipliers": plain(orbit.multipliers),
        "error": plain(orbit.error),
        "t": plain(orbit.t),
        "displacement": {str(which): plain(orbit.displacement(which)) for which in named},
        "velocity": {str(which): plain(orbit.velocity(which)) for which in named},
        "stop_force": [
            plain(orbit.stop_force(j)) for j in range(len(orbit.machine.system().springs))
        ],
        "contacts": [plain(dataclasses.asdict(touch)) for touch in orbit.contact_intervals],
    }


@read_off.register
def history_numbers(history: History) -> dict[str, Any]:
    """Named coordinates over time, and the force of each stop."""
    named = history.system.named
    return {
        "displacement": {str(which): plain(history.displacement(which)) for which in named},
        "velocity": {str(which): plain(history.velocity(which)) for which in named},
        "acceleration": {str(which): plain(history.acceleration(which)) for which in named},
        "stop_force": [plain(history.stop_force(j)) for j in range(history.force.shape[1])],
    }


@read_off.register
def basins_numbers(basins: Basins) -> dict[str, Any]:
    """Shares of the cells with their 95 % confidence intervals."""
    return {
        "complete": basins.complete,
        "shares": plain(basins.shares),
        "share_intervals": plain(basins.share_intervals),
        "unsettled": basins.unsettled,
    }


@read_off.register
def run_up_numbers(run: RunUp) -> dict[str, Any]:
    """Verdict, time, energy, and how it was computed."""
    told = {name: plain(getattr(run.history, name)) for name in RUN}
    return {"verdict": run.verdict, "time_to_speed": plain(run.time_to_speed), **told}


@read_off.register
def risk_summary(risk: JumpRisk) -> dict[str, Any]:
    """Least impulse and lump, SI and rad; null where nothing throws the motion."""
    return {
        "working_relative_amplitude": _relative(risk.orbit),
        "other_motions": len(risk.others),
        "impulse": _throw_summary(risk.worst_impulse),
        "lump": _throw_summary(risk.worst_lump),
        "largest_impulse": {str(k): plain(size) for k, size in risk.largest_impulse.items()},
        "notes": list(risk.notes),
    }


def _throw_summary(throw: Throw | None) -> dict[str, Any] | None:
    if throw is None:
        return None
    fields = dict(vars(throw))
    lands = fields.pop("lands")
    return {**exact(fields), "lands_on_relative_amplitude": _relative(lands)}


def _relative(orbit: Orbit) -> float | None:
    """Amplitude of the coordinate "relative" in m; null where the machine names none so."""
    return orbit.amplitude("relative") if "relative" in orbit.system.coordinates else None


@read_off.register
def assessment_summary(assessment: Assessment) -> dict[str, Any]:
    """Verdict, limits, region and cases of an assessment."""
    region = assessment.region
    frequencies = ("omega_ea", "omega_ar", "omega_cs", "omega_lb", "omega_ub", "lower", "upper")
    return {
        "version": assessment.version,
        "input_hash": assessment.input_hash,
        "name": assessment.project.document.name or assessment.project.name,
        "verdict": assessment.verdict,
        "state": assessment.state,
        "allowed_speed_range": allowed_range(region),
        "does_it_start": does_it_start(assessment.transients),
        "omega": assessment.omega,
        "limits": [plain(vars(row)) for row in assessment.limits_table],
        "passing_limits": [plain(vars(row)) for row in assessment.passing_table],
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
                "gaps": plain(vars(case.gaps)),
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
        "ground": None if assessment.foundation is None else assessment.foundation.sentence,
        "foundation": None if assessment.foundation is None else loads_of(assessment.foundation),
        "transients": _transients(assessment.transients),
        "tornado": None if assessment.tornado is None else _tornado_document(assessment.tornado),
        "notes": list(assessment.notes),
    }


@read_off.register
def loads_of(loads: FoundationLoads) -> dict[str, Any]:
    """What goes into the ground in a sentence, and the loads of each support by its name."""
    every: tuple[CaseLoads | RunLoads, ...] = (*loads.cases, *loads.runs)
    each = {
        support: {one.name: _support_loads(loads, one, support) for one in every}
        for support in loads.supports
    }
    return {"sentence": loads.sentence, "each_support": each}


def _support_loads(
    loads: FoundationLoads, one: CaseLoads | RunLoads, support: str
) -> dict[str, Any]:
    if isinstance(one, RunLoads):
        return {"peaks": vars(loads.of_support(one.peaks))}
    static = loads.static_on(support, one)
    return {"static": vars(static), "running": vars(loads.of_support(one.running))}


@read_off.register
def comparison_summary(found: Comparison) -> dict[str, Any]:
    """Inputs that differ, and every result with its changes against the first machine, SI."""
    others = range(1, len(found.names))
    return {
        "names": list(found.names),
        "verdicts": [one.verdict for one in found.assessments],
        "inputs": [exact(vars(one)) for one in found.inputs],
        "results": [
            exact(vars(row) | {"changes": [row.change(k) for k in others]}) for row in found.results
        ],
    }


def _transients(found: Transients | None) -> dict[str, Any] | None:
    """Start, coast-down and jump risk, the worst and case by case; null without a speed."""
    if found is None:
        return None
    runs = {"start": found.start, "coast_down": found.coast_down}
    return {
        "state": found.state,
        "drive_assumed": found.assumed,
        "case": found.case,
        **{name: None if run is None else _run_summary(run) for name, run in runs.items()},
        "jump_risk": None if found.jump is None else risk_summary(found.jump),
        "reasons": dict(found.reasons),
        "findings": [dict(vars(one)) for one in found.findings],
        "cases": [_case_runs(one) for one in found.cases],
    }


def _case_runs(case: CaseRuns) -> dict[str, Any]:
    """One load case without its motions."""
    summary, peaks = CODEC.form(RunSummary | None), CODEC.form(Mapping[str, Peak])
    return {
        "name": case.case,
        "start": summary.write(case.start),
        "coast_down": summary.write(case.coast_down),
        "peaks": peaks.write(case.peaks),
        "jump_risk": None if case.jump is None else risk_summary(case.jump),
        "reasons": dict(case.reasons),
    }


def _run_summary(run: RunUp) -> dict[str, Any]:
    """A start or a coast-down without its motion."""
    whole = CODEC.form(RunUp).write(run) | run_up_numbers(run)
    return {name: value for name, value in whole.items() if name not in ("machine", "history")}


def _tornado_document(result: OneAtATime) -> dict[str, Any]:
    fields = ("quantity", "names", "ends", "omega", "nominal", "at_low", "at_high")
    return {name: plain(getattr(result, name)) for name in fields}
