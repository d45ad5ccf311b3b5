"""Every result as labelled arrays: one description behind xarray, pandas, NetCDF and CSV."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow import __version__
from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import InputError
from flipflow.io.labelled import Arrays, Variable
from flipflow.model.quantities import QUANTITIES, quantity_named
from flipflow.model.screen import is_screen
from flipflow.model.system import Coordinate, Machine, MechanicalSystem
from flipflow.periodic.orbit import Orbit
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.bifurcation_diagram import BifurcationDiagram, Direction
from flipflow.studies.candidates import quantity_of
from flipflow.studies.compare import Comparison
from flipflow.studies.design import Proposal
from flipflow.studies.foundation_loads import (
    DIRECTIONS,
    CaseLoads,
    Components,
    FoundationLoads,
    RunLoads,
)
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.loading import LoadedMachine, Loading
from flipflow.studies.lyapunov import LyapunovExponents
from flipflow.studies.operating_region import OperatingRegion
from flipflow.studies.poincare import Section, Spectrum
from flipflow.studies.quantity_values import number_or_nan
from flipflow.studies.ramp import Ramp
from flipflow.studies.response_family import ResponseFamily
from flipflow.studies.sensitivity import Sensitivity
from flipflow.studies.study import Study
from flipflow.studies.study_plan import unit_of
from flipflow.studies.tolerance import Tolerance
from flipflow.transient.history import History
from flipflow.transient.startup import RunUp
from flipflow.transient.sweep import Sweep

SI = {
    "length": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N", "torque": "N m",
    "time": "s", "frequency": "rad/s", "rate": "1/s", "impulse": "kg m/s", "mass": "kg",
}  # fmt: skip
PASSES: tuple[Direction, ...] = ("up", "down")


def units_of(machine: Machine | None) -> Mapping[str, str]:
    """SI for a screen; a machine of its user has units of its own, which nobody told."""
    return SI if machine is None or is_screen(machine) else dict.fromkeys(SI, "")


@singledispatch
def arrays_of(result: object) -> Arrays:
    """The arrays of a result.

    Raises
    ------
    InputError
        For what is no result.
    """
    known = ", ".join(sorted(kind.__name__ for kind in arrays_of.registry if kind is not object))
    raise InputError("result", type(result).__name__, f"arrays are known of {known}")


def _labels(names: Iterable[Coordinate]) -> Variable:
    return Variable(("coordinate",), np.array([str(name) for name in names]))


def _each(
    dim: str, system: MechanicalSystem, read: Callable[[Coordinate], ArrayLike], unit: str
) -> Variable:
    """A value of every coordinate along a dimension."""
    values = np.stack([np.asarray(read(name)) for name in system.named], axis=-1)
    return Variable((dim, "coordinate"), values, unit)


def _column(dim: str, values: ArrayLike, unit: str = "") -> Variable:
    return Variable((dim,), np.asarray(values), unit)


def _specials(
    points: Sequence[Any], system: MechanicalSystem, units: Mapping[str, str]
) -> dict[str, Variable]:
    """Special points: kind, place and amplitudes."""
    omega = np.array([point.omega for point in points], float)
    amplitudes = [[point.amplitude(name) for name in system.named] for point in points]
    return {
        "special_kind": _column("special", np.array([point.kind for point in points], str)),
        "special_omega": _column("special", omega, units["frequency"]),
        "special_position": _column("special", np.array([p.position for p in points], float)),
        "special_amplitude": Variable(
            ("special", "coordinate"),
            np.reshape(amplitudes, (len(points), len(system.named))),
            units["length"],
        ),
    }


def _attributes(result: Any, **more: str | float) -> dict[str, str | float]:
    """What is said of every result, and more."""
    return {"flipflow_version": getattr(result, "version", __version__), **more}


@arrays_of.register
def _(branch: Branch) -> Arrays:
    units, system = units_of(branch.machine), branch.system
    return Arrays(
        "Periodic motions over frequency",
        "point",
        {
            "omega": _column("point", branch.omega, units["frequency"]),
            "coordinate": _labels(system.named),
        },
        {
            "amplitude": _each("point", system, branch.amplitude, units["length"]),
            "phase": _each("point", system, branch.phase, "rad"),
            "stability": _column("point", np.asarray(branch.stability, str)),
            "stable": _column("point", branch.stable),
            "error": _column("point", branch.error, units["length"]),
            "multipliers": Variable(("point", "multiplier"), branch.multipliers),
            **_specials(branch.special_points, system, units),
        },
        _attributes(branch, method=repr(branch.method), status=branch.status.value),
    )


@arrays_of.register
def _(branch: FieldBranch) -> Arrays:
    units, system = units_of(branch.machine), branch.machine.system()
    specials = _specials(branch.special_points, system, units)
    values = np.array([point.value for point in branch.special_points], float)
    return Arrays(
        f"Periodic motions over {branch.field}",
        "point",
        {"value": _column("point", branch.values), "coordinate": _labels(system.named)},
        {
            "omega": _column("point", branch.omega, units["frequency"]),
            "amplitude": _each("point", system, branch.amplitude, units["length"]),
            "phase": _each("point", system, branch.phase, "rad"),
            "stability": _column("point", np.asarray(branch.stability, str)),
            "stable": _column("point", branch.stable),
            "multipliers": Variable(("point", "multiplier"), branch.multipliers),
            "special_value": _column("special", values),
            **specials,
        },
        _attributes(branch, field=branch.field, status=branch.status.value),
    )


@arrays_of.register
def _(orbit: Orbit) -> Arrays:
    units, system = units_of(orbit.machine), orbit.system
    springs = range(len(orbit.machine.system().springs))
    forces = [orbit.stop_force(j) for j in springs]
    return Arrays(
        "Periodic motion",
        "time",
        {"time": _column("time", orbit.t, units["time"]), "coordinate": _labels(system.named)},
        {
            "displacement": _each("time", system, orbit.displacement, units["length"]),
            "velocity": _each("time", system, orbit.velocity, units["velocity"]),
            "acceleration": _each("time", system, orbit.acceleration, units["acceleration"]),
            "stop_force": Variable(
                ("time", "stop"), np.reshape(forces, (len(springs), orbit.t.size)).T, units["force"]
            ),
            "multipliers": Variable(("multiplier",), orbit.multipliers),
        },
        _attributes(orbit, omega=orbit.omega, periods=orbit.periods, stability=orbit.stability),
    )


@arrays_of.register
def _(orbits: tuple) -> Arrays:  # type: ignore[type-arg]
    if not orbits or not all(isinstance(orbit, Orbit) for orbit in orbits):
        raise InputError("result", orbits, "give the motions of periodic_orbits")
    first: Orbit = orbits[0]
    units, system = units_of(first.machine), first.system
    return Arrays(
        "Coexisting motions",
        "motion",
        {"coordinate": _labels(system.named)},
        {
            "omega": _column("motion", [orbit.omega for orbit in orbits], units["frequency"]),
            "amplitude": _each("motion", system, _of_all(orbits, Orbit.amplitude), units["length"]),
            "mean": _each("motion", system, _of_all(orbits, Orbit.mean), units["length"]),
            "periods": _column("motion", [orbit.periods for orbit in orbits]),
            "stability": _column("motion", np.array([orbit.stability for orbit in orbits], str)),
            "multipliers": Variable(
                ("motion", "multiplier"), np.array([orbit.multipliers for orbit in orbits])
            ),
        },
        _attributes(first),
    )


def _of_all(
    orbits: Sequence[Orbit], read: Callable[[Orbit, Coordinate], float]
) -> Callable[[Coordinate], list[float]]:
    return lambda which: [read(orbit, which) for orbit in orbits]


@arrays_of.register
def _(basins: Basins) -> Arrays:
    units, system = units_of(basins.machine), basins.machine.system()
    dims = tuple(f"{axis.kind}_{axis.which}" for axis in basins.axes)
    kinds = {"displacement": "length", "velocity": "velocity"}
    axes = {
        dim: Variable((dim,), axis.values, units[kinds[axis.kind]])
        for dim, axis in zip(dims, basins.axes, strict=True)
    }
    amplitude = [[orbit.amplitude(name) for name in system.named] for orbit in basins.orbits]
    shape = len(basins.orbits), len(system.named)
    return Arrays(
        "Basins",
        "motion",
        {**axes, "coordinate": _labels(system.named)},
        {
            "label": Variable(dims, basins.labels),
            "turns": Variable(dims, basins.turns),
            "share": _column("motion", basins.shares),
            "amplitude": Variable(
                ("motion", "coordinate"), np.reshape(amplitude, shape), units["length"]
            ),
        },
        _attributes(basins, omega=basins.omega, unsettled=basins.unsettled),
    )


@arrays_of.register
def _(risk: JumpRisk) -> Arrays:
    units, frames = units_of(risk.machine), [str(name) for name in risk.thresholds]
    thresholds = np.reshape(list(risk.thresholds.values()), (len(frames), 2, risk.phases.size))
    throws = (*risk.impulses, *risk.lumps)
    return Arrays(
        "Least blows that make the motion jump",
        "throw",
        {
            "frame": _column("frame", np.array(frames, str)),
            "way": _column("way", [1, -1]),
            "phase": _column("phase", risk.phases, "rad"),
        },
        {
            "threshold": Variable(("frame", "way", "phase"), thresholds, units["impulse"]),
            "throw_frame": _column("throw", np.array([str(one.frame) for one in throws], str)),
            "throw_impulse": _column("throw", [one.impulse for one in throws], units["impulse"]),
            "throw_lump": _column(
                "throw", [number_or_nan(one.lump) for one in throws], units["mass"]
            ),
            "throw_phase": _column("throw", [one.phase for one in throws], "rad"),
        },
        _attributes(risk, omega=risk.omega),
    )


@arrays_of.register
def _(history: History) -> Arrays:
    system, units = history.system, units_of(history.system)
    known = {"torque": (history.torque, "torque"), "normal": (history.normal, "length")}
    more = {
        name: Variable(("time", "derivative")[: values.ndim], values, units[unit])
        for name, (values, unit) in known.items()
        if values is not None
    }
    return Arrays(
        "Motion over time",
        "time",
        {"time": _column("time", history.t, units["time"]), "coordinate": _labels(system.named)},
        {
            "displacement": _each("time", system, history.displacement, units["length"]),
            "velocity": _each("time", system, history.velocity, units["velocity"]),
            "acceleration": _each("time", system, history.acceleration, units["acceleration"]),
            "stop_force": Variable(("time", "stop"), history.force, units["force"]),
            "omega": _column("time", history.omega, units["frequency"]),
            "angle": _column("time", history.angle, "rad"),
            **more,
        },
        _attributes(history, status=history.status, method=history.method),
    )


@arrays_of.register
def _(run: RunUp) -> Arrays:
    arrays = arrays_of(run.history)
    peaks = {f"peak_{name}": peak.value for name, peak in run.peaks.items()}
    said = {"outcome": run.outcome, "final_speed": run.final_speed, "working_speed": run.speed}
    return dataclasses.replace(
        arrays, title="Motion at varying speed", attributes={**arrays.attributes, **said, **peaks}
    )


@arrays_of.register
def _(ramp: Ramp) -> Arrays:
    arrays = arrays_of(ramp.history)
    said = {"rate": ramp.rate, "jumps": float(len(ramp.jumps))}
    return dataclasses.replace(
        arrays, title="Motion at gliding speed", attributes={**arrays.attributes, **said}
    )


@arrays_of.register
def _(sweep: Sweep) -> Arrays:
    units, system = units_of(sweep.machine), sweep.system
    return Arrays(
        "Settled motions over speed",
        "step",
        {
            "omega": _column("step", sweep.omega, units["frequency"]),
            "coordinate": _labels(system.named),
        },
        {
            "amplitude": _each("step", system, sweep.amplitude, units["length"]),
            "least": _each("step", system, lambda which: sweep.extremes(which)[0], units["length"]),
            "greatest": _each(
                "step", system, lambda which: sweep.extremes(which)[1], units["length"]
            ),
            "periods": _column("step", sweep.periods),
            "word": _column("step", np.array(sweep.words, str)),
            "turns": _column("step", sweep.turns),
            "distance": _column("step", sweep.distance, units["length"]),
        },
        _attributes(sweep),
    )


@arrays_of.register
def _(section: Section) -> Arrays:
    system, units = section.system, units_of(section.system)
    return Arrays(
        "Poincare section",
        "turn",
        {
            "turn": _column("turn", np.arange(1, section.states.shape[0] + 1)),
            "coordinate": _labels(system.named),
        },
        {
            "displacement": _each("turn", system, section.displacement, units["length"]),
            "velocity": _each("turn", system, section.velocity, units["velocity"]),
        },
        _attributes(section, omega=section.omega, word=section.word, periods=section.periods),
    )


@arrays_of.register
def _(spectrum: Spectrum) -> Arrays:
    units = units_of(spectrum.system)
    return Arrays(
        "Spectrum",
        "frequency",
        {"frequency": _column("frequency", spectrum.frequencies, units["frequency"])},
        {"amplitude": _column("frequency", spectrum.amplitudes, units["length"])},
        _attributes(spectrum, omega=spectrum.omega, which=str(spectrum.which)),
    )


@arrays_of.register
def _(found: LyapunovExponents) -> Arrays:
    rate = units_of(found.machine)["rate"]
    return Arrays(
        "Lyapunov exponents",
        "exponent",
        {},
        {
            "exponents": _column("exponent", found.exponents, rate),
            "standard_error": _column("exponent", found.standard_error, rate),
            "batches": Variable(("batch", "exponent"), found.batches, rate),
            "contact_share": _column("stop", found.contact_share),
        },
        _attributes(found, omega=found.omega, word=found.word, periods=found.periods),
    )


@arrays_of.register
def _(diagram: BifurcationDiagram) -> Arrays:
    system, n = diagram.system, diagram.system.size
    unit = units_of(diagram.machine)["length"]
    values, ways, states = [], [], [np.zeros((0, 2 * n))]
    for way in PASSES:
        passed = getattr(diagram, way)
        for value, points in zip(passed.values, passed.states, strict=True):
            values += [float(value)] * points.shape[0]
            ways += [way] * points.shape[0]
            states.append(points)
    x = np.concatenate(states)[:, :n]
    return Arrays(
        f"Bifurcation diagram over {diagram.parameter}",
        "sample",
        {"coordinate": _labels(system.named)},
        {
            "value": _column("sample", np.array(values, float)),
            "direction": _column("sample", np.array(ways, str)),
            "displacement": _each("sample", system, lambda c: x @ system.coordinate(c), unit),
        },
        _attributes(diagram, parameter=diagram.parameter),
    )


@arrays_of.register
def _(response: LinearResponse) -> Arrays:
    units, system = units_of(response.machine), response.system
    return Arrays(
        "Response without contact",
        "point",
        {
            "omega": _column("point", response.omega, units["frequency"]),
            "coordinate": _labels(system.named),
        },
        {
            "amplitude": _each("point", system, response.amplitude, units["length"]),
            "phase": _each("point", system, response.phase, "rad"),
            "complex_amplitude": Variable(
                ("point", "freedom"), response.complex_amplitudes, units["length"]
            ),
            "natural_frequency": _column("mode", response.natural_frequencies, units["frequency"]),
        },
        _attributes(response),
    )


@arrays_of.register
def _(region: OperatingRegion) -> Arrays:
    words = ("omega_ea", "omega_ar", "omega_cs", "omega_lb", "omega_ub", "lower", "upper")
    marks = {word: getattr(region, word) for word in words}
    known = {word: number_or_nan(mark) for word, mark in marks.items()}
    feasible = np.reshape(np.asarray(region.feasible, float), (-1, 2))
    return Arrays(
        "Operating region",
        "interval",
        {},
        {
            "feasible_from": _column("interval", feasible[:, 0], "rad/s"),
            "feasible_to": _column("interval", feasible[:, 1], "rad/s"),
            **{word: Variable((), np.asarray(mark), "rad/s") for word, mark in known.items()},
        },
        _attributes(region, cases="; ".join(case.name or "empty" for case in region.cases)),
    )


@arrays_of.register
def _(loading: Loading) -> Arrays:
    machines: dict[str, LoadedMachine] = {"without_stop": loading.without_stop}
    if loading.with_stop is not None:
        machines["with_stop"] = loading.with_stop
    regions = {name: machine.region for name, machine in machines.items()}
    names = [name for name, region in regions.items() for _ in region.omega]
    parts = list(regions.values())
    return Arrays(
        "Empty against loaded machine",
        "row",
        {"machine": _column("row", np.array(names, str))},
        {
            "omega": _column("row", np.concatenate([one.omega for one in parts]), "rad/s"),
            "unloaded": _column("row", np.concatenate([one.unloaded for one in parts]), "m"),
            "loaded": _column("row", np.concatenate([one.loaded for one in parts]), "m"),
            "change": _column("row", np.concatenate([one.change for one in parts]), "m"),
        },
        _attributes(loading, load=loading.load.name or "load"),
    )


@arrays_of.register
def _(family: ResponseFamily) -> Arrays:
    units, system = units_of(family.machine), family.machine.system()
    table = family.table()
    failure = [str(one or "") for one in table.pop("failure")]
    table.pop(family.field)
    counts = [member.branch.omega.size for member in family.members]
    owner = np.repeat(np.arange(len(family.members)), counts)
    omega = np.concatenate([member.branch.omega for member in family.members])

    def amplitude(which: Coordinate) -> NDArray[np.float64]:
        return np.concatenate([member.branch.amplitude(which) for member in family.members])

    columns = {
        name: _column("member", [math.nan if v is None else v for v in values])
        for name, values in table.items()
    }
    return Arrays(
        f"Responses over {family.field}",
        "member",
        {"value": _column("member", family.values), "coordinate": _labels(system.named)},
        {
            **columns,
            "failure": _column("member", np.array(failure, str)),
            "member": _column("point", owner),
            "omega": _column("point", omega, units["frequency"]),
            "amplitude": _each("point", system, amplitude, units["length"]),
        },
        _attributes(family, field=family.field),
    )


@arrays_of.register
def _(found: Sensitivity) -> Arrays:
    over = found.over_frequency
    dims = ("frequency", "field") if over else ("field",)
    omega = np.atleast_1d(np.asarray(found.omega, float))
    names = ("first_order", "first_order_confidence", "total", "total_confidence")
    unit = QUANTITIES[found.quantity].unit if found.quantity in QUANTITIES else ""
    return Arrays(
        f"Sobol indices of {found.quantity}",
        "field",
        {
            "field": _column("field", np.array(found.names, str)),
            **({"omega": _column("frequency", omega, "rad/s")} if over else {}),
        },
        {
            **{name: Variable(dims, getattr(found, name)) for name in names},
            "mean": Variable(dims[:-1], np.asarray(found.mean), unit),
            "variance": Variable(dims[:-1], np.asarray(found.variance)),
        },
        _attributes(found, quantity=found.quantity, groups=found.n),
    )


@arrays_of.register
def _(found: Study) -> Arrays:
    dims = ("sample", "case", "omega")
    asked = {name: quantity_named(name, found.machine) for name in found.quantities}
    whole = {name for name, one in asked.items() if one.of == "response"}
    own = {name: dims[:2] if name in whole else dims for name in asked}
    ends = {"low": found.at_low, "high": found.at_high}
    return Arrays(
        "Quantities of many machines",
        "sample",
        {
            "case": _column("case", np.array(found.cases, str)),
            "omega": _column("omega", found.omega, "rad/s"),
            "field": _column("field", np.array(found.names, str)),
        },
        {
            **{
                name: _column("sample", column, unit_of(found.machine, name))
                for name, column in found.columns.items()
            },
            **{name: Variable(own[name], found.values[name], asked[name].unit) for name in asked},
            "reason": Variable(dims, found.reason),
            **{
                f"nominal_{name}": Variable(own[name][1:], found.nominal[name], asked[name].unit)
                for name in asked
            },
            **{
                f"{end}_{name}": Variable(("field", *own[name][1:]), table[name], asked[name].unit)
                for end, table in ends.items()
                for name in asked
            },
        },
        _attributes(found, sampling=found.sampling, branch=found.branch),
    )


@arrays_of.register
def _(found: Tolerance) -> Arrays:
    ends = ("frequency", "end")
    return Arrays(
        "Machines that meet every limit",
        "frequency",
        {
            "omega": _column("frequency", found.omega, "rad/s"),
            "end": _column("end", np.array(["low", "high"])),
            "limit": _column("limit", np.array(found.checked, str)),
            "case": _column("case", np.array(found.cases, str)),
            "field": _column("field", np.array(found.names, str)),
            "factor": _column("factor", found.factors),
        },
        {
            "share": _column("frequency", found.share),
            "share_interval": Variable(ends, found.share_interval),
            "unknown": _column("frequency", found.unknown),
            "jump_share": _column("frequency", found.jump_share),
            "jump_interval": Variable(ends, found.jump_interval),
            "coexisting": _column("frequency", found.coexisting),
            "by_limit": Variable(("frequency", "limit"), found.by_limit.T),
            "by_case": Variable(("frequency", "case"), found.by_case.T),
            "halved": Variable(("frequency", "field"), found.halved.T),
            "scaled": Variable(("frequency", "factor"), found.scaled.T),
            "passing": Variable(("machine", "frequency"), found.passing),
            "jumped": Variable(("machine", "frequency"), found.jumped),
        },
        _attributes(found, machines=found.size),
    )


@arrays_of.register
def _(found: Proposal) -> Arrays:
    excess, price = list(found.excess), list(found.prices)
    return Arrays(
        "Machines for a duty",
        "candidate",
        {
            **{
                name: _column("candidate", values, unit_of(found.screen, name))
                for name, values in found.fields.items()
            },
            "constraint": _column("constraint", np.array(excess, str)),
            "binding": _column("binding", np.array(price, str)),
        },
        {
            **{
                name.replace(" ", "_"): _column("candidate", values, quantity_of(name).unit)
                for name, values in found.objectives.items()
            },
            "amplitude": _column("combination", found.chosen.amplitude, "m"),
            "excess": _column("constraint", [found.excess[name] for name in excess]),
            "price": _column("binding", [found.prices[name] for name in price], "m"),
        },
        _attributes(found, possible=str(found.possible), band=found.chosen.band),
    )


@arrays_of.register
def _(assessment: Assessment) -> Arrays:
    names = [case.name for case in assessment.cases]
    words = list(dict.fromkeys(name for case in assessment.cases for name in case.values))
    values = {
        word: _column(
            "case",
            [number_or_nan(case.values.get(word)) for case in assessment.cases],
            QUANTITIES[word].unit,
        )
        for word in words
    }
    rows = assessment.limits_table
    return Arrays(
        "Every load case at working speed",
        "case",
        {
            "case": _column("case", np.array(names, str)),
            "limit": _column("limit", np.array([row.name for row in rows], str)),
        },
        {
            **values,
            "limit_least": _column("limit", [row.limit[0] for row in rows]),
            "limit_most": _column("limit", [row.limit[1] for row in rows]),
            "limit_worst": _column("limit", [number_or_nan(row.worst) for row in rows]),
            "limit_margin": _column("limit", [number_or_nan(row.margin) for row in rows]),
            "limit_state": _column("limit", np.array([row.state for row in rows], str)),
        },
        _attributes(assessment, verdict=assessment.verdict, omega=number_or_nan(assessment.omega)),
    )


@arrays_of.register
def _(found: Comparison) -> Arrays:
    rows = found.results
    values = np.reshape(
        [[number_or_nan(one) for one in row.values] for row in rows], (len(rows), -1)
    )
    return Arrays(
        "Machines compared",
        "result",
        {
            "result": _column("result", np.array([row.name for row in rows], str)),
            "machine": _column("machine", np.array(found.names, str)),
        },
        {
            "case": _column("result", np.array([row.case for row in rows], str)),
            "unit": _column("result", np.array([row.unit for row in rows], str)),
            "value": Variable(("result", "machine"), values.astype(float)),
        },
        _attributes(found),
    )


@arrays_of.register
def _(loads: FoundationLoads) -> Arrays:
    every: tuple[CaseLoads | RunLoads, ...] = (*loads.cases, *loads.runs)
    peaks = [one.running if isinstance(one, CaseLoads) else one.peaks for one in every]
    static = [one.static if isinstance(one, CaseLoads) else Components() for one in every]

    def ways(parts: Sequence[Components]) -> Variable:
        forces = [[number_or_nan(getattr(part, way)) for way in DIRECTIONS] for part in parts]
        return Variable(("load", "direction"), np.reshape(forces, (len(parts), -1)), "N")

    return Arrays(
        "Loads on the foundation, all supports together",
        "load",
        {
            "load": _column("load", np.array([one.name for one in every], str)),
            "direction": _column("direction", np.array(DIRECTIONS)),
        },
        {
            "static": ways(static),
            "dynamic": ways(peaks),
            "static_share": _column("support", np.array(loads.static_shares, float)),
        },
        _attributes(loads, position=loads.position, supports=float(len(loads.supports))),
    )
