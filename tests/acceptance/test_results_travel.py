"""Every public result becomes arrays, a table, a plot, a file, a picture in a notebook, a copy."""

from __future__ import annotations

import dataclasses
import math
import pickle
import re
from collections.abc import Callable
from functools import cache

import matplotlib as mpl
import numpy as np
import pytest

import flipflow as ff
from flipflow.io.results import SCHEMAS
from flipflow.results.result import Result
from judge import close

mpl.use("Agg")
WIDTH = 84.0
# Results of commands are made of others, and are read by people alone.
OF_COMMANDS = {"Startup", "Sweeps", "Check", "Reproduction"}


def chain() -> ff.MechanicalSystem:
    """A machine of its user: two masses, a stop, no names and no units."""
    return ff.MechanicalSystem(
        np.eye(2), [[0.06, -0.03], [-0.03, 0.06]], [[2.0, -1.0], [-1.0, 2.0]],
        [ff.ClearanceSpring([1.0, 0.0], 30.0, 0.3, 0.4)], ff.HarmonicForce([0.3, 0.0]),
    )  # fmt: skip


@cache
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827")


@cache
def branch() -> ff.Branch:
    return ff.frequency_response(screen(), (60.0, 220.0), ff.PiecewiseExact(points=60))


def large() -> ff.Orbit:
    return max(branch().orbits_at(203.0), key=lambda orbit: orbit.amplitude("relative"))


MADE: dict[str, Callable[[], object]] = {
    "Branch": branch,
    "FieldBranch": lambda: ff.continue_orbit(large(), "clearance", (5e-3, 7e-3)),
    "BifurcationCurve": lambda: ff.continue_bifurcation(
        branch().folds[0], ("clearance", "omega"), ((5e-3, 7e-3), (150.0, 230.0))
    ),
    "Orbit": large,
    "Basins": lambda: ff.basins(
        screen(),
        omega=203.0,
        displacement={"relative": np.linspace(-0.04, 0.04, 4)},
        velocity={"relative": [0.0, 2.0]},
    ),
    "JumpRisk": lambda: ff.jump_risk(screen(), 203.0),
    "History": lambda: ff.simulate(screen(), omega=120.0, periods=4),
    "RunUp": lambda: ff.start_up(screen(), speed=90.0),
    "Sweep": lambda: ff.sweep(screen(), np.linspace(190.0, 210.0, 4)),
    "Ramp": lambda: ff.ramp(screen(), (200.0, 209.0), 3.0),
    "Section": lambda: ff.poincare_section(screen(), 120.0, turns=8),
    "Spectrum": lambda: ff.spectrum(large(), "relative"),
    "LyapunovExponents": lambda: ff.lyapunov_exponents(chain(), 1.0, periods=64),
    "BifurcationDiagram": lambda: ff.bifurcation_diagram(chain(), "omega", [0.8, 0.9, 1.0]),
    "LinearResponse": lambda: ff.linear_response(screen(), np.linspace(10.0, 60.0, 9)),
    "OperatingRegion": lambda: ff.operating_region(screen()),
    "Loading": lambda: ff.loading(screen(), ff.Load(stiffness_factor=1.1)),
    "DesignMap": lambda: ff.design_map(
        screen(), 120.0, [5e-3, 7e-3], [6e6, 9e6], load=ff.Load(stiffness_factor=1.1)
    ),
    "ResponseFamily": lambda: ff.response_family(screen(), {"clearance": [5e-3, 6e-3]}),
    "Sensitivity": lambda: ff.sensitivity(
        screen(), {"clearance": (5.4e-3, 6.6e-3)}, "relative_amplitude", omega=120.0, n=16, rng=0
    ),
    "Study": lambda: ff.study(
        screen(),
        {"clearance": (5.4e-3, 6.6e-3)},
        ("relative_amplitude", "omega_ub"),
        [89.0, 120.0],
        sampling=ff.Sample(n=4),
        load_cases=[ff.Load(name="empty"), ff.Load(name="hot", temperature=40.0)],
    ),
    "Tolerance": lambda: ff.tolerance(made("Study"), ff.Limits(relative_amplitude=(5e-3, 9e-3))),
    "WorstCase": lambda: ff.worst_case(
        screen(), {"clearance": (5.4e-3, 6.6e-3)}, "relative_amplitude", [89.0, 120.0]
    ),
    "Comparison": lambda: ff.compare([screen(), screen().replace(clearance=5e-3)], omega=89.0),
    "FoundationLoads": lambda: ff.foundation_loads({"empty": branch().orbits_at(89.0)[0]}),
    "Proposal": lambda: ff.design(
        ff.Duty(
            project=ff.load_project("ffs0827"),
            target=7e-3,
            tolerance=2e-3,
            speed=(83.8, 83.8),
            free={"clearance": (2e-3, 9e-3), "eccentric_moment": ff.Choice((3.0, 4.0, 5.0))},
            load_cases=(ff.Load(), ff.Load(stiffness_factor=1.1, name="full")),
            limits=ff.Limits(),
        ),
        generations=2,
    ),
    "Assessment": lambda: ff.assess(ff.load_project("ffs0827")),
}
made = cache(lambda name: MADE[name]())


def test_the_list_of_results_is_whole() -> None:
    """One list drives documents, arrays and figures."""
    assert {kind.__name__ for kind in SCHEMAS} - OF_COMMANDS == set(MADE)
    public = {kind for kind in SCHEMAS if kind.__name__ not in OF_COMMANDS}
    assert all(issubclass(kind, Result) for kind in public)


@pytest.mark.parametrize("name", MADE)
def test_arrays(name: str) -> None:
    """Labelled dimensions, units as attributes, nothing that is None."""
    data = made(name).to_xarray()
    assert data.attrs["title"]
    assert data.data_vars
    for variable in data.variables.values():
        assert variable.dtype.kind in "fciubU", (name, variable)
    frame = made(name).to_dataframe()
    assert len(frame.columns)
    assert not frame.map(lambda cell: cell is None).to_numpy().any()


@pytest.mark.parametrize("name", MADE)
def test_plots_on_given_axes(name: str) -> None:
    """The axes that were given are drawn on, and come back; their style stays."""
    from matplotlib import pyplot as plt  # noqa: PLC0415

    with mpl.rc_context({"lines.linewidth": 3.3}):
        sheet, (left, _) = plt.subplots(1, 2)
        assert made(name).plot(ax=left, units="SI") is left
        assert left.has_data()
        lines = [one for one in left.get_lines() if one.get_linestyle() == "-"]
        assert all(line.get_linewidth() in (3.3, 0.8) for line in lines)
        plt.close(sheet)


@pytest.mark.parametrize("name", MADE)
def test_said_in_a_line_and_shown_in_a_notebook(name: str) -> None:
    assert len(repr(made(name))) < 500
    shown = made(name)._repr_html_()
    assert "<table>" in shown
    assert "<svg" in shown
    assert len(shown) < 400_000


@pytest.mark.parametrize("name", MADE)
def test_files_and_copies(name: str, tmp_path) -> None:
    """Saved and opened again, pickled, written for others."""
    result = made(name)
    result.save(tmp_path / "it.json")
    again = ff.open_result(tmp_path / "it.json")
    copy = pickle.loads(pickle.dumps(result))  # noqa: S301
    first = result.to_dataframe()
    for other in (again, copy):
        second = other.to_dataframe()
        assert list(second.columns) == list(first.columns)
        numbers = first.select_dtypes("number").columns
        close(name, second[numbers].to_numpy(), first[numbers].to_numpy(), abs=0.0) if not first[
            numbers
        ].isna().to_numpy().any() else None
    for ending in (".nc", ".csv"):
        result.save(tmp_path / f"it{ending}")
        assert (tmp_path / f"it{ending}").stat().st_size


def test_netcdf_holds_all_of_a_branch(tmp_path) -> None:
    """Coordinates, multipliers, special points."""
    import xarray as xr  # noqa: PLC0415

    branch().save(tmp_path / "branch.nc")
    with xr.open_dataset(tmp_path / "branch.nc", engine="scipy") as data:
        mu = data["multipliers_real"].to_numpy() + 1j * data["multipliers_imag"].to_numpy()
        close("multipliers", mu, branch().multipliers, rel=1e-15)
        kinds = data["special_kind"].to_numpy().tolist()
        assert kinds == [p.kind for p in branch().special_points]
        assert "omega" in data.coords


@pytest.mark.parametrize("name", MADE)
def test_netcdf_keeps_words_and_truth_values(name: str, tmp_path) -> None:
    """Opened by xarray as anybody opens it, they are what they were: words can be selected by."""
    import xarray as xr  # noqa: PLC0415

    result = made(name)
    result.save(tmp_path / "it.nc")
    kept = result.to_xarray()
    with xr.open_dataset(tmp_path / "it.nc") as data:
        for key, variable in data.variables.items():
            assert variable.dtype.kind in "fibO", (key, variable)
            if key in kept.variables and kept[key].dtype.kind in "bU":
                assert variable.dtype.kind == {"b": "b", "U": "O"}[kept[key].dtype.kind]
                assert variable.to_numpy().tolist() == kept[key].to_numpy().tolist()
        if "coordinate" in kept.coords:
            for one in kept["coordinate"].to_numpy().tolist():
                assert data.sel(coordinate=one).coordinate == one


def test_netcdf_of_names_in_any_script(tmp_path) -> None:
    import xarray as xr  # noqa: PLC0415

    names = {"Stößel": [1.0, 0.0], "\N{GREEK CAPITAL LETTER DELTA}": [-1.0, 1.0]}
    named = dataclasses.replace(chain(), coordinates=names)
    found = ff.linear_response(named, np.linspace(0.5, 2.0, 5))
    found.save(tmp_path / "it.nc")
    with xr.open_dataset(tmp_path / "it.nc") as data:
        for name in names:
            seen = data.amplitude.sel(coordinate=name).to_numpy()
            close(name, seen, found.amplitude(name), rel=1e-15)


def test_units_and_coordinates() -> None:
    """Engineering for a screen, none for a machine of its user, SI where it is asked for."""
    by_default = ff.figure(branch()).panels[0]
    assert by_default.x.title == "shaft speed, rpm"
    in_si = ff.figure(branch(), units="SI", coordinate="main").panels[0]
    assert in_si.x.title == "angular frequency, rad/s"
    close("scale", in_si.traces[0].x * 30.0 / math.pi, by_default.traces[0].x, rel=1e-12)
    assert in_si.y.title == "amplitude, main frame (x1), m"
    of_chain = ff.figure(ff.frequency_response(chain(), (0.5, 1.5))).panels[0]
    assert of_chain.x.title == "angular frequency"
    assert of_chain.y.title == "amplitude"
    with pytest.raises(ff.InputError, match="coordinate"):
        ff.figure(branch(), coordinate="third")
    with pytest.raises(ff.InputError, match="no choice"):
        ff.figure(made("OperatingRegion"), coordinate="main")
    with pytest.raises(ff.InputError, match="units"):
        ff.figure(branch(), units="furlongs")


def test_every_figure_of_a_screen_is_in_an_engineers_units() -> None:
    """Families and loading stood over rad/s, as the paper's figures do."""
    units = {
        axis.unit for name in MADE for panel in ff.figure(made(name)).panels
        for axis in (panel.x, panel.y)
    }  # fmt: skip
    assert {"rpm", "mm"} <= units
    assert not {"rad/s", "m", "N"} & units
    written = [line.text for panel in ff.figure(made("Loading")).panels for line in panel.lines]
    assert all(text.endswith(" rpm") for text in written if text)
    (over,) = ff.figure(made("ResponseFamily"), coordinate="main").panels
    assert [unit for unit, _ in over.traces[0].x_also] == ["Hz", "rad/s"]


def test_what_is_shown_by_single_marks_is_seen() -> None:
    """Of a share of few machines no drawing showed mark and interval; of a sweep, half the ends."""
    (few,) = ff.figure(made("Tolerance")).panels
    interval, share = few.traces
    assert share.x.size == 1
    assert interval.x.tolist() == [1.0, 1.0]
    close("interval, %", interval.y, 100.0 * made("Tolerance").share_interval[0], rel=1e-12)
    (speeds,) = ff.figure(made("Sweep")).panels
    ends = [trace.x for trace in speeds.traces]
    assert speeds.x.bounds[0] < min(map(np.min, ends))
    assert speeds.x.bounds[1] > max(map(np.max, ends))


def test_figures_of_a_journal_column(tmp_path) -> None:
    """84 mm wide, whatever the result, and below each other what stood side by side."""
    for name in MADE:
        drawn = ff.figure(made(name), width=WIDTH)
        close("width", drawn.width, WIDTH * 96.0 / 25.4, rel=1e-12)
        drawn.write(tmp_path / f"{name}.svg")
        head = (tmp_path / f"{name}.svg").read_text(encoding="utf-8")[:1200]
        width = float(head.split('width="')[1].split("mm")[0])
        close("width, mm", width, WIDTH, rel=1e-5)
    assert ff.figure(made("Orbit"), width=WIDTH).columns == 1


def test_multipliers_are_tracked() -> None:
    """Each column is one multiplier: it never jumps to where another stood."""
    from flipflow.plotting.branches import tracked_multipliers  # noqa: PLC0415

    drawn = ff.figure(branch(), multipliers=True)
    assert drawn.panels[1].traces[0].name == "unit circle"
    tracked = tracked_multipliers(branch().multipliers)
    steps, sorted_steps = (
        np.abs(np.diff(m, axis=0)).sum() for m in (tracked, branch().multipliers)
    )
    assert steps <= sorted_steps


def test_several_results_in_one_figure() -> None:
    both = ff.figure([branch(), branch()], coordinate="main")
    assert "main" in both.panels[0].y.label
    orbits = branch().orbits_at(203.0)
    assert len(ff.figure(orbits).panels[0].traces) == 3
    names = {trace.name for trace in ff.figure(made("ResponseFamily")).panels[0].traces}
    assert {"e = 5 mm", "e = 6 mm"} <= names
    assert ff.figure(result=branch()).panels


def test_a_machine_of_its_user_has_no_units() -> None:
    """Nor have its curves over a field, and the speeds written at its jumps."""
    followed = ff.frequency_response(chain(), (0.5, 1.9))
    fold = followed.folds[0]
    curve = ff.figure(ff.continue_fold(fold, "springs[0].clearance", (0.35, 0.45)), coordinate=0)
    assert [panel.y.title for panel in curve.panels] == ["angular frequency", "amplitude, x[0]"]
    written = [line.text for line in ff.figure(followed).panels[0].lines if line.text]
    assert written
    jump = followed.folds[1]  # the other one meets unstable motions alone
    assert any(text.endswith(f" {jump.omega:.4g}") for text in written)
    large = max(followed.orbits_at(1.5), key=lambda orbit: orbit.amplitude(0))
    (trace,) = ff.figure([large], coordinate=0).panels[0].traces
    assert trace.name == f"{large.amplitude(0):.4g}, {large.stability}"
    in_si = [line.text for line in ff.figure(branch(), units="SI").panels[0].lines]
    assert any(text.endswith(f"{branch().folds[0].omega:.4g} rad/s") for text in in_si)


def results_of_chain(omega: float) -> list[object]:
    """Results that hang on the units of a machine, one of each kind, of one that has none."""
    machine = chain()
    orbits = ff.periodic_orbits(machine, omega)
    return [
        ff.frequency_response(machine, (0.7 * omega, 1.3 * omega)),
        orbits[0],
        ff.linear_response(machine, [omega, 1.1 * omega]),
        ff.sweep(machine, [omega, 1.01 * omega]),
        ff.simulate(machine, omega=omega, periods=3),
        ff.poincare_section(machine, omega, 5, skip=5),
        ff.spectrum(orbits[0], 0),
        ff.lyapunov_exponents(machine, omega, periods=64, skip=16),
        ff.basins(machine, omega=omega, displacement={0: [0.0, 0.1]}, velocity={0: [0.0]}),
        ff.jump_risk(machine, orbits[0]),
        ff.ramp(machine, (omega, 1.1 * omega), 0.01 * omega**2),
        ff.continue_orbit(orbits[0], "springs[0].clearance", (0.35, 0.45)),
    ]


def results_of_screen(kinds: set[str]) -> list[object]:
    """The same of a screen: those that are made already, but for the one of the chain."""
    exponents = ff.lyapunov_exponents(screen(), 89.0, periods=64, skip=16)
    return [*(made(kind) for kind in sorted(kinds - {"LyapunovExponents"})), exponents]


def test_no_unit_is_written_of_a_machine_that_has_none() -> None:
    """Neither in words nor in tables; those of a screen are SI. An angle is in rad for both."""
    without = results_of_chain(1.25)
    kinds = {type(result).__name__ for result in without}
    assert len(kinds) == len(without)
    for results, known in ((without, False), (results_of_screen(kinds), True)):
        for result in results:
            units = {v.attrs.get("units") for v in result.to_xarray().variables.values()}
            units -= {None, "", "rad"}
            assert bool(units) == known, (result, units)
            written = re.search(r"\b(rad/s|1/s|kg|m/s|mm)\b", repr(result) + result._repr_html_())
            assert known or written is None, (result, written)
            points = getattr(result, "special_points", ())
            assert all(repr(point).endswith(" rad/s)") == known for point in points)


def test_decades_of_a_spectrum_stay_decades_in_other_units() -> None:
    """0.006 m are as far above 1e-3 m as 6 mm are above 1 mm."""
    lines = ff.spectrum(large(), "relative")
    (mm,), (m,) = (ff.figure(lines, units=units).panels for units in ("engineering", "SI"))
    close("decades", m.traces[0].y + 3.0, mm.traces[0].y, abs=1e-12)
    first = float(m.traces[0].y.max())
    close("first harmonic", 10.0**first, float(lines.amplitudes.max()), rel=1e-12)
    assert (m.y.title, m.x.title) == ("relative (x2) amplitude, m", "angular frequency, rad/s")
    assert all(word == f"1e{at:g}" for at, word in m.y.ticks)
    of_chain = ff.figure(ff.spectrum(ff.periodic_orbits(chain(), 1.2)[0], 0)).panels[0]
    assert (of_chain.x.title, of_chain.y.title) == ("angular frequency", "x[0] amplitude")
