"""Faults that results once had when they travelled, each with the test of its kind."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot as plt

import flipflow as ff
from flipflow.errors import IncompleteError, InputError, StoreError
from flipflow.plotting.panels import Axis, Line, Note, Panel, PanelGrid, Trace

mpl.use("Agg")
API = Path(__file__).parents[2] / "docs" / "api" / "index.md"


@dataclass(frozen=True)
class Rig:
    """An oscillator between two stops."""

    c: float = 0.06

    def system(self) -> ff.MechanicalSystem:
        """As matrices and springs."""
        stop = ff.ClearanceSpring([1.0], 30.0, 1.0, clearance=1.0)
        force = ff.HarmonicForce([0.5])
        return ff.MechanicalSystem([[1.0]], [[self.c]], [[1.0]], [stop], force)


@dataclass(frozen=True)
class Hammer:
    """A tool on a body, with a stop on one side and names of its user for what moves."""

    gap: float = 0.5
    force: float = 0.3
    stop: float = 20.0
    zeta: float = 0.03

    def system(self) -> ff.MechanicalSystem:
        """As matrices and springs."""
        K = np.array([[1.5, -0.5], [-0.5, 0.5]])
        stop = ff.ClearanceSpring([-1.0, 1.0], self.stop, 0.0, self.gap, np.inf)
        names = {"body": [1.0, 0.0], "tool": [0.0, 1.0], "stretch": [-1.0, 1.0]}
        return ff.MechanicalSystem(
            np.diag([1.0, 0.4]), 2.0 * self.zeta * K, K, [stop],
            ff.HarmonicForce([self.force, 0.0]), names,
        )  # fmt: skip


@cache
def hammer_branch() -> ff.Branch:
    return ff.frequency_response(Hammer(), (0.3, 2.5))


@cache
def chain() -> ff.MechanicalSystem:
    """Two masses of its user, without names and without units."""
    stop = ff.ClearanceSpring([1.0, 0.0], 30.0, 0.3, 0.4)
    C, K = [[0.06, -0.03], [-0.03, 0.06]], [[2.0, -1.0], [-1.0, 2.0]]
    return ff.MechanicalSystem(np.eye(2), C, K, [stop], ff.HarmonicForce([0.3, 0.0]))


@cache
def chain_branch() -> ff.Branch:
    return ff.frequency_response(chain(), (0.5, 1.9))


@cache
def fold_curve() -> ff.FieldBranch:
    fold = ff.frequency_response(Rig(), (0.4, 8.0)).folds[0]
    return ff.continue_fold(fold, "c", (0.02, 1.0))


@cache
def closed() -> ff.Branch:
    """A branch that ends where it began."""
    (start, *_) = ff.periodic_orbits(ff.load("ffs0827"), omega=446.0, max_periods=3)
    branch = ff.continue_orbit(start, "omega", (300.0, 600.0))
    assert branch.status is ff.BranchStatus.CLOSED
    return branch


@pytest.mark.parametrize("made", [closed, fold_curve])
def test_a_repr_tells_least_and_greatest(made) -> None:
    """Of what it spans, though it ends where it began."""
    branch = made()
    values = branch.omega if isinstance(branch, ff.Branch) else branch.values
    low, high = map(float, re.search(r"([\d.]+) to ([\d.]+)", repr(branch)).groups())
    assert (low, high) == pytest.approx((values.min(), values.max()), rel=1e-5)
    assert high - low > 0.1 * high


def test_an_argument_that_is_not_there_is_refused_by_its_own_name() -> None:
    """Not by that of a function of the inside."""
    with pytest.raises(TypeError, match=r"^figure\(\) got an unexpected keyword argument 'ax'"):
        ff.figure(chain_branch(), ax=None)


def test_a_machine_of_its_user_keeps_its_numbers_and_words() -> None:
    """Nothing is a millimetre, a speed in rpm, or a coordinate of a screen."""
    orbit = max(chain_branch().orbits_at(1.5), key=lambda one: one.amplitude(0))
    drawn = ff.figure(chain_branch(), coordinate=0).panels[0]
    top = max(float(trace.y.max()) for trace in drawn.traces if trace.name == "x[0]")
    assert top == pytest.approx(chain_branch().peak(0).amplitude(0), rel=1e-3)
    results = (
        chain_branch(), orbit, [orbit], [chain_branch()], fold_curve(),
        ff.poincare_section(chain(), 1.0, turns=8), ff.simulate(chain(), 1.0, 2),
        ff.sweep(chain(), np.array([0.8, 0.9, 1.0])),
        ff.bifurcation_diagram(chain(), "omega", [0.8, 0.9]),
        ff.lyapunov_exponents(chain(), 1.0, periods=64),
        ff.sensitivity(chain(), {"forcing": (0.9, 1.1)}, "amplitude[1]", omega=1.0, n=4),
        ff.response_family(chain(), {"forcing": [0.9, 1.0]}, omega=(0.5, 1.5)),
    )  # fmt: skip
    for result in results:
        for text in _texts(ff.figure(result)):
            assert not re.search(r"\bx2\b|\brpm\b|\bmm\b|\bm/s\b|\brad/s\b|1/s", text), text


def test_legends_have_the_units_of_the_axes() -> None:
    drawn = ff.figure(ff.response_family(ff.load("ffs0827"), {"clearance": [5e-3, 6e-3]}))
    assert drawn.panels[0].y.unit == "mm"
    names = {trace.name for trace in drawn.panels[0].traces}
    assert {"e = 5 mm", "e = 6 mm"} <= names
    assert not any("0.00" in name or name.endswith(" m") for name in names)


@pytest.mark.parametrize(
    ("field", "call"),
    [
        ("omega", lambda pair: ff.sweep(chain(), pair)),
        ("omega", lambda pair: ff.linear_response(chain(), pair)),
        ("values", lambda pair: ff.bifurcation_diagram(chain(), "omega", pair)),
        (r"vary\['forcing'\]", lambda pair: ff.response_family(chain(), {"forcing": pair})),
    ],
)
def test_a_pair_that_is_no_interval_is_refused(field, call) -> None:
    with pytest.raises(ff.InputError, match=rf"{field} = .*a pair is an interval elsewhere"):
        call((0.8, 1.0))


def test_what_has_no_name_is_asked_for_by_an_index() -> None:
    with pytest.raises(ff.InputError, match="coordinate = 'tip': none is named: give an index"):
        chain_branch().amplitude("tip")


def test_every_class_that_is_listed_as_importable_is() -> None:
    """The page says from where; what stands elsewhere is listed with its place."""
    text = API.read_text(encoding="utf-8")
    everything, _, parts = text.partition("## Parts of results")
    assert parts
    listed = [name for block in re.findall(r"```\{eval-rst\}(.*?)```", everything, re.DOTALL)
              for name in re.findall(r"^   (\w[\w.]*)$", block, re.MULTILINE)]  # fmt: skip
    assert len(listed) > 70
    assert [name for name in listed if "." in name or not hasattr(ff, name)] == []


def test_the_figure_of_basins_says_where_its_marks_are() -> None:
    values = {"relative": np.linspace(-0.02, 0.02, 2)}
    caption = ff.figure(ff.basins(ff.load("ffs0827"), 120.0, values)).caption
    assert "what is not on its axes is 0 for the cells, but not for the motions" in caption


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (("sweep", "ffs0827", "--speeds", "800 rpm", "820 rpm", "--steps", "2"), "sweep.html"),
        (("orbits", "ffs0827", "--speed", "850 rpm", "--max-periods", "1"), "motion-1.html"),
    ],
)
def test_a_figure_of_a_command_names_its_machine_and_has_one_title(
    command, tmp_path, words, name
) -> None:
    code, _, told = command(*words, "-o", tmp_path / "out")
    assert code == 0, told
    page = (tmp_path / "out" / name).read_text(encoding="utf-8")
    read = re.sub(r"<script.*?</script>", "", page.partition("<body>")[2], flags=re.DOTALL)
    assert "FFS0827" in read
    (title,) = re.findall(r"<h1>(.*?)</h1>", read)
    assert read.count(title) == 1


def test_each_coordinate_of_a_user_has_a_look_of_its_own() -> None:
    """On a page, in a plot, and with more names than there are colours."""
    names = ["body", "tool", "stretch"]
    for drawn in (
        ff.figure(hammer_branch()), ff.figure(ff.linear_response(Hammer(), np.linspace(0.3, 2.0)))
    ):  # fmt: skip
        for panel in drawn.panels:
            lines = [trace for trace in panel.traces if trace.name in names]
            assert list(dict.fromkeys(trace.name for trace in lines)) == names
            looks = {(trace.name, trace.colour) for trace in lines}
            assert len(looks) == len({colour for _, colour in looks}) == len(names)
    assert {trace.role for trace in ff.figure(hammer_branch()).panels[0].traces} >= {
        "stable", "unstable",
    }  # fmt: skip
    K = 2.0 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1)
    named = {f"mass {k}": row for k, row in enumerate(np.eye(8))}
    long = ff.MechanicalSystem(np.eye(8), 0.1 * K, K, (), ff.HarmonicForce(np.eye(8)[0]), named)
    drawn = ff.figure(ff.linear_response(long, np.linspace(0.3, 2.0)))
    assert len({(one.colour, one.symbol) for one in drawn.panels[0].traces}) == 8


def test_results_share_axes() -> None:
    """Each takes one colour of the cycle for all of its parts; what explains them comes once."""
    sheet, axes = plt.subplots()
    for gap in (0.3, 0.5, 0.8):
        ff.frequency_response(Hammer(gap=gap), (0.3, 2.5)).plot(ax=axes, coordinate="stretch")
    cycle = mpl.rcParams["axes.prop_cycle"].by_key()["color"]
    drawn = [line for line in axes.get_lines() if np.isfinite(line.get_xdata()).sum() > 2]
    assert {line.get_color() for line in drawn} == set(cycle[:3])
    assert {line.get_color() for line in drawn if line.get_linestyle() == "--"} == set(cycle[:3])
    marks = [
        line for line in axes.get_lines() if line.get_marker() != "None" and line.get_xdata().size
    ]
    assert {line.get_color() for line in marks} == set(cycle[:3])
    handles, words = axes.get_legend_handles_labels()
    assert words.count("stretch") == 3
    others = [word for word in words if word != "stretch"]
    assert {"unstable", "period doubling"} <= set(others)
    assert len(others) == len(set(others))
    colours = {one.get_color() for one, word in zip(handles, words, strict=True) if word in others}
    assert len(colours) == 1
    assert not colours & set(cycle)
    assert axes.get_ylabel() == "amplitude, stretch"
    plt.close(sheet)


def test_curves_of_folds_share_axes() -> None:
    """The cusp has the colour of its curve."""
    sheet, axes = plt.subplots()
    for _ in range(2):
        fold_curve().plot(ax=axes)
    assert any(point.kind == "cusp" for point in fold_curve().special_points)
    one, two = mpl.rcParams["axes.prop_cycle"].by_key()["color"][:2]
    seen = [line.get_color() for line in axes.get_lines() if line.get_xdata().size]
    assert seen == [one, one, two, two]
    assert axes.get_legend_handles_labels()[1].count("cusp") == 1
    plt.close(sheet)


@pytest.mark.parametrize(
    "result",
    [
        hammer_branch,
        lambda: ff.linear_response(Hammer(), np.linspace(0.3, 2.0)),
        lambda: ff.simulate(Hammer(), 1.0, 4),
        lambda: ff.response_family(Hammer(), {"gap": [0.4, 0.5]}, omega=(0.5, 1.5)),
        lambda: ff.sweep(Hammer(), np.linspace(1.0, 1.2, 3)),
        lambda: ff.bifurcation_diagram(Hammer(), "omega", [1.0, 1.1]),
    ],
)
def test_an_axis_names_the_coordinate_that_was_asked_for(result) -> None:
    axes = result().plot(coordinate="tool")
    assert "tool" in axes.get_ylabel()
    plt.close(axes.figure)


@dataclass(frozen=True)
class Shaken:
    """Its field has the name that a factor has in plain systems."""

    forcing: float = 0.5

    def system(self) -> ff.MechanicalSystem:
        """As matrices and springs."""
        stop = ff.ClearanceSpring([1.0], 30.0, 1.0, clearance=1.0)
        force = ff.HarmonicForce([self.forcing])
        return ff.MechanicalSystem([[1.0]], [[0.06]], [[1.0]], [stop], force)


@cache
def hammer_folds() -> ff.FieldBranch:
    return ff.continue_fold(hammer_branch().folds[-1], "gap", (0.3, 0.8))


@pytest.mark.parametrize(
    "made",
    [
        hammer_folds,
        fold_curve,  # with a cusp
        lambda: ff.continue_orbit(hammer_branch().orbits_at(2.3)[0], "force", (0.2, 0.5)),
        lambda: ff.continue_bifurcation(
            hammer_branch().folds[-1], ("gap", "omega"), ((0.3, 0.8), (1.0, 3.0))
        ),
        lambda: ff.continue_orbit(
            ff.frequency_response(Shaken(), (0.4, 0.8)).orbits_at(0.7)[0], "forcing", (0.3, 0.9)
        ),
    ],
)
def test_branches_over_a_field_of_a_user_are_kept(made, tmp_path) -> None:
    """Each motion with its machine as a plain system; what was read can be written again."""
    first = made()
    first.save(tmp_path / "one.json")
    again = ff.open_result(tmp_path / "one.json")
    again.save(tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()
    assert repr(again) == repr(first)
    for one, other in zip(first.orbits, again.orbits, strict=True):
        assert isinstance(other.machine, ff.MechanicalSystem)
        assert other.amplitude(0) == one.amplitude(0)
        assert other.stop_force(0).max() == one.stop_force(0).max()
    for one, other in zip(first.special_points, again.special_points, strict=True):
        assert other.amplitude(0) == one.amplitude(0)
    assert ff.figure(again).panels[0].y == ff.figure(first).panels[0].y
    name = first.field if isinstance(first, ff.FieldBranch) else "gap"
    if name != "forcing":
        with pytest.raises(ff.InputError, match=f"field = '{name}'.*springs.0..clearance"):
            ff.continue_orbit(again.orbits[0], name, (0.0, 9.0))


@cache
def empty() -> ff.Branch:
    """What is left of a branch whose start was not found."""
    hard = Hammer(gap=0.01, stop=1e8)
    branch = ff.frequency_response(hard, (0.8, 1.0), ff.HarmonicBalance(25))
    assert (branch.omega.size, branch.status) == (0, ff.BranchStatus.NO_START)
    return branch


@pytest.mark.parametrize(
    "show",
    [
        ff.figure,
        ff.Branch.plot,
        lambda branch: ff.figure([branch, branch]),
        lambda branch: ff.figure(branch, multipliers=True),
    ],
)
@pytest.mark.parametrize("met", [False, True])
def test_a_branch_without_points_says_why_it_has_no_figure(show, met: bool) -> None:
    """Also where it was to begin on another branch."""
    begun = dataclasses.replace(hammer_branch().folds[0], position=-1.0)
    branch = dataclasses.replace(empty(), special_points=(begun,) if met else ())
    with pytest.raises(
        IncompleteError, match=r"no points\. No periodic motion.*Start from another"
    ):
        show(branch)


def test_a_fold_between_unstable_motions_is_no_jump() -> None:
    """Nobody stands there who could jump: neither a line nor an arrow nor a mark says so."""
    branch = hammer_branch()
    sides = {
        fold.omega: {str(branch.stability[int(fold.position) + k]) for k in (0, 1)}
        for fold in branch.folds
    }
    unstable = [omega for omega, words in sides.items() if words == {"unstable"}]
    assert len(unstable) == 1
    assert len(sides) == 4
    panel = ff.figure(branch).panels[0]
    jumps = [line.at for line in panel.lines if "jump" in line.text]
    assert sorted(jumps) == pytest.approx(sorted(set(sides) - set(unstable)), rel=1e-12)
    assert sorted(arrow.x0 for arrow in panel.arrows) == sorted(jumps)
    for drawn in (panel, ff.figure([branch]).panels[0]):
        marks = {one.name: one.x.tolist() for one in drawn.traces if one.role == "point"}
        assert sorted(marks["jump (fold)"]) == pytest.approx(sorted(jumps), rel=1e-12)
        assert marks["fold, both sides unstable"] == pytest.approx(unstable, rel=1e-12)


def test_a_curve_of_folds_between_unstable_motions_is_no_jump_speed() -> None:
    names = []
    for fold in hammer_branch().folds:
        at = fold.omega
        curve = ff.continue_bifurcation(
            fold, ("gap", "omega"), ((0.499, 0.501), (0.99 * at, 1.01 * at))
        )
        names.append(ff.figure(curve).panels[0].traces[0].name)
    assert sorted(names) == ["fold, both sides unstable", *["jump speed (fold)"] * 3]


def test_branches_over_one_field_share_a_figure() -> None:
    """Each has its own colour and one entry of the legend, and marks have one for all."""
    other = ff.continue_fold(
        ff.frequency_response(Rig(), (0.4, 8.0)).folds[1], "c", (0.05, 0.07)
    )  # fmt: skip
    drawn = ff.figure([fold_curve(), other])
    speeds, amplitudes = drawn.panels
    assert ff.figure(hammer_folds()).panels[1].y.label == "amplitude, body"
    assert speeds.y.label == "angular frequency"
    lines = [trace for trace in speeds.traces if trace.role != "point"]
    assert len({trace.name for trace in lines}) == len({trace.colour for trace in lines}) == 2
    assert all(trace.name.startswith("fold, ") and trace.legend for trace in lines)
    assert [trace.name for trace in speeds.traces if trace.role == "point"] == ["cusp"]
    assert not any(trace.legend for trace in amplitudes.traces)
    same = ff.figure([fold_curve(), fold_curve()], width=84)
    names = [trace.name[:8] for trace in same.panels[0].traces if trace.role != "point"]
    assert names == ["1: fold,", "2: fold,"]

    motions = [
        ff.continue_orbit(hammer_branch().orbits_at(omega)[0], "gap", (0.4, 0.6))
        for omega in (0.5, 2.4)
    ]
    panel = ff.figure(motions, coordinate="stretch").panels[0]
    assert {trace.name for trace in panel.traces} == {"1 period, at 0.5", "1 period, at 2.4"}
    assert panel.y.label == "amplitude, stretch"
    with pytest.raises(ff.InputError, match="give branches over gap alone"):
        ff.figure([*motions, fold_curve()])
    with pytest.raises(ff.InputError, match="curves of folds and motions"):
        ff.figure([*motions, hammer_folds()])
    with pytest.raises(ff.InputError, match="give branches over frequency, or over one field"):
        ff.figure([*motions, hammer_branch()])


@pytest.mark.parametrize("made", [hammer_branch, fold_curve, lambda: ff.load_project("ffs0827")])
def test_a_width_without_room_is_refused_with_the_least_one(made, tmp_path) -> None:
    result = made()
    if isinstance(result, ff.Project):
        result = ff.operating_region(result.screen)
    with pytest.raises(ff.InputError, match=r"width = 3\.3: give \d+ mm or more") as told:
        ff.figure(result, width=3.3)
    least = int(re.search(r"(\d+) mm", str(told.value))[1])
    assert 20 <= least <= 84
    for ending in ("png", "html"):
        ff.figure(result, width=least).write(tmp_path / f"it.{ending}")
    with pytest.raises(ff.InputError, match=f"give {least} mm"):
        ff.figure(result, width=least - 0.5)


def _texts(part: object) -> Iterator[str]:
    """Every text of a figure that is drawn: not captions, and not what only the mouse shows."""
    if isinstance(part, str):
        yield part
    elif isinstance(part, tuple):
        for one in part:
            yield from _texts(one)
    elif isinstance(part, (PanelGrid, Panel, Axis, Trace, Line, Note)) and is_dataclass(part):
        for field in fields(part):
            if field.name not in {"caption", "x_also", "role", "colour", "symbol", "dash"}:
                yield from _texts(getattr(part, field.name))


@pytest.mark.parametrize("name", ["omega", "return_map"])
def test_a_file_with_a_number_beyond_all_machines_is_refused(name, tmp_path):
    """Its square is infinite and warns."""
    path = tmp_path / "orbit.json"
    ff.save(ff.periodic_orbits(Rig(), 1.4)[0], path)
    document = json.loads(path.read_text())
    document[name] = 1e200 if name == "omega" else [[1e200, 0.0], [0.0, 1.0]]
    path.write_text(json.dumps(document))
    with pytest.raises(StoreError, match=rf"{name}: no result has a number beyond 1e\+150"):
        ff.open_result(path)


def test_a_motion_that_grows_ends_before_what_no_file_holds():
    machine = ff.MechanicalSystem([[1.0]], [[-3.0]], [[1.0]], [], ff.HarmonicForce([1.0]))
    with pytest.raises(IncompleteError, match="grows beyond all numbers"):
        ff.simulate(machine, 0.9, 30)


def test_a_history_is_of_finite_numbers():
    found = ff.simulate(Rig(), 1.4, 2)
    for name in ("t", "x", "a", "force", "omega"):
        values = getattr(found, name).copy()
        values[-1] = np.inf
        with pytest.raises(InputError, match=rf"^{name} = .*give finite numbers"):
            dataclasses.replace(found, **{name: values})


def test_a_coordinate_whose_name_netcdf_cannot_hold_is_refused_by_a_sentence(tmp_path) -> None:
    """scipy writes names in Latin letters alone: it ended in a UnicodeEncodeError."""
    stop = ff.ClearanceSpring([1.0], 29.0, 0.0, 1.26)
    for name, told in (("Träger", None), ("筛机", "NetCDF has names in Latin letters alone")):
        rig = ff.MechanicalSystem(
            [[1.0]], [[0.1]], [[1.0]], [stop], ff.HarmonicForce([0.7]), coordinates={name: (1.0,)}
        )
        grid = np.linspace(-0.5, 0.5, 2)
        found = ff.basins(rig, 0.5, {name: grid}, {name: grid})
        for ending in ("json", "csv"):
            ff.save(found, tmp_path / f"it.{ending}")
        if told is None:
            ff.save(found, tmp_path / "it.nc")
        else:
            with pytest.raises(InputError, match=told):
                ff.save(found, tmp_path / "other.nc")
    assert not (tmp_path / "other.nc").exists()
