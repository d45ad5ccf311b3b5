"""Every result as labelled arrays: one description behind xarray, pandas, NetCDF and CSV."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flipflow.continuation.bifurcation_curve import BifurcationCurve
from flipflow.continuation.branch import Branch
from flipflow.continuation.field_branch import FieldBranch
from flipflow.dynamics.linear_response import LinearResponse
from flipflow.errors import InputError
from flipflow.io.judged_arrays import assessment_arrays, comparison_arrays, foundation_arrays
from flipflow.io.labelled import (
    Arrays,
    Variable,
    attributes,
    column,
    each,
    labels,
    unit_of,
    units_of,
)
from flipflow.io.study_arrays import (
    proposal_arrays,
    study_arrays,
    tolerance_arrays,
    worst_case_arrays,
)
from flipflow.model.quantities import QUANTITIES
from flipflow.model.system import Coordinate, MechanicalSystem
from flipflow.periodic.orbit import Orbit
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.bifurcation_diagram import BifurcationDiagram, Direction
from flipflow.studies.compare import Comparison
from flipflow.studies.design import Proposal
from flipflow.studies.design_map import DesignMap
from flipflow.studies.foundation_loads import (
    FoundationLoads,
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
from flipflow.studies.tolerance import Tolerance
from flipflow.studies.worst_case import WorstCase
from flipflow.transient.history import History
from flipflow.transient.run_up import RunUp
from flipflow.transient.sweep import Sweep

PASSES: tuple[Direction, ...] = ("up", "down")


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


def _specials(
    points: Sequence[Any], system: MechanicalSystem, units: Mapping[str, str]
) -> dict[str, Variable]:
    """Special points: kind, place and amplitudes."""
    omega = np.array([point.omega for point in points], float)
    amplitudes = [[point.amplitude(name) for name in system.named] for point in points]
    return {
        "special_kind": column("special", np.array([point.kind for point in points], str)),
        "special_omega": column("special", omega, units["frequency"]),
        "special_position": column("special", np.array([p.position for p in points], float)),
        "special_amplitude": Variable(
            ("special", "coordinate"),
            np.reshape(amplitudes, (len(points), len(system.named))),
            units["length"],
        ),
    }


@arrays_of.register
def _(branch: Branch) -> Arrays:
    units, system = units_of(branch.machine), branch.system
    return Arrays(
        "Periodic motions over frequency",
        "point",
        {
            "omega": column("point", branch.omega, units["frequency"]),
            "coordinate": labels(system.named),
        },
        {
            "amplitude": each("point", system, branch.amplitude, units["length"]),
            "phase": each("point", system, branch.phase, "rad"),
            "stability": column("point", np.asarray(branch.stability, str)),
            "stable": column("point", branch.stable),
            "error": column("point", branch.error, units["length"]),
            "multipliers": Variable(("point", "multiplier"), branch.multipliers),
            **_specials(branch.special_points, system, units),
        },
        attributes(branch, method=repr(branch.method), status=branch.status.value),
    )


@arrays_of.register
def _(branch: FieldBranch) -> Arrays:
    units, system = units_of(branch.machine), branch.machine.system()
    specials = _specials(branch.special_points, system, units)
    values = np.array([point.value for point in branch.special_points], float)
    return Arrays(
        f"Periodic motions over {branch.field}",
        "point",
        {"value": column("point", branch.values), "coordinate": labels(system.named)},
        {
            "omega": column("point", branch.omega, units["frequency"]),
            "amplitude": each("point", system, branch.amplitude, units["length"]),
            "phase": each("point", system, branch.phase, "rad"),
            "stability": column("point", np.asarray(branch.stability, str)),
            "stable": column("point", branch.stable),
            "multipliers": Variable(("point", "multiplier"), branch.multipliers),
            "special_value": column("special", values),
            **specials,
        },
        attributes(branch, field=branch.field, status=branch.status.value),
    )


@arrays_of.register
def _(curve: BifurcationCurve) -> Arrays:
    units, system = units_of(curve.machine), curve.machine.system()
    values = np.reshape([point.values for point in curve.special_points], (-1, 2))
    columns = {
        name: column("point", curve.values[:, k], unit_of(name))
        for k, name in enumerate(curve.parameters)
    }
    specials = {
        f"special_{name}": column("special", values[:, k], unit_of(name))
        for k, name in enumerate(curve.parameters)
    }
    return Arrays(
        f"{curve.kind} over {' and '.join(curve.parameters)}",
        "point",
        {"coordinate": labels(system.named)},
        {
            "omega": column("point", curve.omega, units["frequency"]),
            **columns,
            "amplitude": each("point", system, curve.amplitude, units["length"]),
            "phase": each("point", system, curve.phase, "rad"),
            "multipliers": Variable(("point", "multiplier"), curve.multipliers),
            **_specials(curve.special_points, system, units),
            **specials,
        },
        attributes(curve, kind=curve.kind, status=curve.status.value),
    )


@arrays_of.register
def _(orbit: Orbit) -> Arrays:
    units, system = units_of(orbit.machine), orbit.system
    springs = range(len(orbit.machine.system().springs))
    forces = [orbit.stop_force(j) for j in springs]
    return Arrays(
        "Periodic motion",
        "time",
        {"time": column("time", orbit.t, units["time"]), "coordinate": labels(system.named)},
        {
            "displacement": each("time", system, orbit.displacement, units["length"]),
            "velocity": each("time", system, orbit.velocity, units["velocity"]),
            "acceleration": each("time", system, orbit.acceleration, units["acceleration"]),
            "stop_force": Variable(
                ("time", "stop"), np.reshape(forces, (len(springs), orbit.t.size)).T, units["force"]
            ),
            "multipliers": Variable(("multiplier",), orbit.multipliers),
        },
        attributes(orbit, omega=orbit.omega, periods=orbit.periods, stability=orbit.stability),
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
        {"coordinate": labels(system.named)},
        {
            "omega": column("motion", [orbit.omega for orbit in orbits], units["frequency"]),
            "amplitude": each("motion", system, _of_all(orbits, Orbit.amplitude), units["length"]),
            "mean": each("motion", system, _of_all(orbits, Orbit.mean), units["length"]),
            "periods": column("motion", [orbit.periods for orbit in orbits]),
            "stability": column("motion", np.array([orbit.stability for orbit in orbits], str)),
            "multipliers": Variable(
                ("motion", "multiplier"), np.array([orbit.multipliers for orbit in orbits])
            ),
        },
        attributes(first),
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
        {**axes, "coordinate": labels(system.named)},
        {
            "label": Variable(dims, basins.labels),
            "turns": Variable(dims, basins.turns),
            "share": column("motion", basins.shares),
            "amplitude": Variable(
                ("motion", "coordinate"), np.reshape(amplitude, shape), units["length"]
            ),
        },
        attributes(basins, omega=basins.omega, unsettled=basins.unsettled),
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
            "frame": column("frame", np.array(frames, str)),
            "way": column("way", [1, -1]),
            "phase": column("phase", risk.phases, "rad"),
        },
        {
            "threshold": Variable(("frame", "way", "phase"), thresholds, units["impulse"]),
            "throw_frame": column("throw", np.array([str(one.frame) for one in throws], str)),
            "throw_impulse": column("throw", [one.impulse for one in throws], units["impulse"]),
            "throw_lump": column(
                "throw", [number_or_nan(one.lump) for one in throws], units["mass"]
            ),
            "throw_phase": column("throw", [one.phase for one in throws], "rad"),
        },
        attributes(risk, omega=risk.omega),
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
    stops = ("time", "stop")
    peak = (
        {}
        if history.peak is None
        else {"stop_force_peak": Variable(stops, history.peak, units["force"])}
    )
    return Arrays(
        "Motion over time",
        "time",
        {"time": column("time", history.t, units["time"]), "coordinate": labels(system.named)},
        {
            "displacement": each("time", system, history.displacement, units["length"]),
            "velocity": each("time", system, history.velocity, units["velocity"]),
            "acceleration": each("time", system, history.acceleration, units["acceleration"]),
            "stop_force": Variable(("time", "stop"), history.force, units["force"]),
            **peak,
            "omega": column("time", history.omega, units["frequency"]),
            "angle": column("time", history.angle, "rad"),
            **more,
        },
        attributes(history, status=history.status, method=history.method),
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
            "omega": column("step", sweep.omega, units["frequency"]),
            "coordinate": labels(system.named),
        },
        {
            "amplitude": each("step", system, sweep.amplitude, units["length"]),
            "least": each("step", system, lambda which: sweep.extremes(which)[0], units["length"]),
            "greatest": each(
                "step", system, lambda which: sweep.extremes(which)[1], units["length"]
            ),
            "periods": column("step", sweep.periods),
            "word": column("step", np.array(sweep.words, str)),
            "turns": column("step", sweep.turns),
            "distance": column("step", sweep.distance, units["length"]),
        },
        attributes(sweep),
    )


@arrays_of.register
def _(section: Section) -> Arrays:
    system, units = section.system, units_of(section.system)
    return Arrays(
        "Poincare section",
        "turn",
        {
            "turn": column("turn", np.arange(1, section.states.shape[0] + 1)),
            "coordinate": labels(system.named),
        },
        {
            "displacement": each("turn", system, section.displacement, units["length"]),
            "velocity": each("turn", system, section.velocity, units["velocity"]),
        },
        attributes(section, omega=section.omega, word=section.word, periods=section.periods),
    )


@arrays_of.register
def _(spectrum: Spectrum) -> Arrays:
    units = units_of(spectrum.system)
    return Arrays(
        "Spectrum",
        "frequency",
        {"frequency": column("frequency", spectrum.frequencies, units["frequency"])},
        {"amplitude": column("frequency", spectrum.amplitudes, units["length"])},
        attributes(spectrum, omega=spectrum.omega, which=str(spectrum.which)),
    )


@arrays_of.register
def _(found: LyapunovExponents) -> Arrays:
    rate = units_of(found.machine)["rate"]
    return Arrays(
        "Lyapunov exponents",
        "exponent",
        {},
        {
            "exponents": column("exponent", found.exponents, rate),
            "standard_error": column("exponent", found.standard_error, rate),
            "batches": Variable(("batch", "exponent"), found.batches, rate),
            "contact_share": column("stop", found.contact_share),
        },
        attributes(found, omega=found.omega, word=found.word, periods=found.periods),
    )


@arrays_of.register
def _(diagram: BifurcationDiagram) -> Arrays:
    system, n = diagram.system, diagram.system.size
    unit = units_of(diagram.machine)["length"]
    passes = [getattr(diagram, way) for way in PASSES]
    states = [points for passed in passes for points in passed.states]
    counts = [points.shape[0] for points in states]
    x = np.concatenate([np.zeros((0, 2 * n)), *states])[:, :n]

    def of_each(rows: Sequence[ArrayLike]) -> NDArray[Any]:
        """What is said of the motions of both passes, for each of their points."""
        return np.repeat(np.concatenate(rows), counts)

    return Arrays(
        f"Bifurcation diagram over {diagram.parameter}",
        "sample",
        {"coordinate": labels(system.named)},
        {
            "value": column("sample", of_each([passed.values for passed in passes])),
            "direction": column(
                "sample",
                of_each(
                    [np.full(one.values.size, way) for way, one in zip(PASSES, passes, strict=True)]
                ),
            ),
            "word": column("sample", of_each([np.array(one.words, str) for one in passes])),
            "periods": column("sample", of_each([passed.periods for passed in passes])),
            "displacement": each("sample", system, lambda c: x @ system.coordinate(c), unit),
        },
        attributes(diagram, parameter=diagram.parameter),
    )


@arrays_of.register
def _(response: LinearResponse) -> Arrays:
    units, system = units_of(response.machine), response.system
    return Arrays(
        "Response without contact",
        "point",
        {
            "omega": column("point", response.omega, units["frequency"]),
            "coordinate": labels(system.named),
        },
        {
            "amplitude": each("point", system, response.amplitude, units["length"]),
            "phase": each("point", system, response.phase, "rad"),
            "complex_amplitude": Variable(
                ("point", "freedom"), response.complex_amplitudes, units["length"]
            ),
            "natural_frequency": column("mode", response.natural_frequencies, units["frequency"]),
        },
        attributes(response),
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
            "feasible_from": column("interval", feasible[:, 0], "rad/s"),
            "feasible_to": column("interval", feasible[:, 1], "rad/s"),
            **{word: Variable((), np.asarray(mark), "rad/s") for word, mark in known.items()},
        },
        attributes(region, cases="; ".join(case.name or "empty" for case in region.cases)),
    )


@arrays_of.register
def _(found: DesignMap) -> Arrays:
    dims = "stop_stiffness", "clearance"
    units = {
        "omega_cs": "rad/s", "omega_lb": "rad/s", "omega_ub": "rad/s", "width": "rad/s",
        "amplitude": "m", "steadiness": "",
    }  # fmt: skip
    axes = {name: column(name, getattr(found, name), unit_of(name)) for name in dims}
    values = {name: Variable(dims, getattr(found, name), unit) for name, unit in units.items()}
    said = attributes(found, omega=found.omega)
    return Arrays("Gap and stop stiffness", "clearance", axes, values, said)


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
        {"machine": column("row", np.array(names, str))},
        {
            "omega": column("row", np.concatenate([one.omega for one in parts]), "rad/s"),
            "unloaded": column("row", np.concatenate([one.unloaded for one in parts]), "m"),
            "loaded": column("row", np.concatenate([one.loaded for one in parts]), "m"),
            "change": column("row", np.concatenate([one.change for one in parts]), "m"),
        },
        attributes(loading, load=loading.load.name or "load"),
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
        name: column("member", [math.nan if v is None else v for v in values])
        for name, values in table.items()
    }
    return Arrays(
        f"Responses over {family.field}",
        "member",
        {"value": column("member", family.values), "coordinate": labels(system.named)},
        {
            **columns,
            "failure": column("member", np.array(failure, str)),
            "member": column("point", owner),
            "omega": column("point", omega, units["frequency"]),
            "amplitude": each("point", system, amplitude, units["length"]),
        },
        attributes(family, field=family.field),
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
            "field": column("field", np.array(found.names, str)),
            **({"omega": column("frequency", omega, "rad/s")} if over else {}),
        },
        {
            **{name: Variable(dims, getattr(found, name)) for name in names},
            "mean": Variable(dims[:-1], np.asarray(found.mean), unit),
            "variance": Variable(dims[:-1], np.asarray(found.variance)),
        },
        attributes(found, quantity=found.quantity, groups=found.n),
    )


arrays_of.register(Study)(study_arrays)
arrays_of.register(Tolerance)(tolerance_arrays)
arrays_of.register(WorstCase)(worst_case_arrays)
arrays_of.register(Assessment)(assessment_arrays)
arrays_of.register(Comparison)(comparison_arrays)
arrays_of.register(FoundationLoads)(foundation_arrays)
arrays_of.register(Proposal)(proposal_arrays)
