"""``flipflow study`` and ``flipflow store info``: file, report, store, Ctrl-C, resume, workers."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flipflow as ff
from flipflow.batch import chunk_store
from flipflow.batch.chunk_store import Layout, create_store
from flipflow.io.labelled import Arrays, Variable
from flipflow.io.study_file import read_study_file
from flipflow.io.tables import table_columns
from flipflow.model.fields import FIELD
from flipflow.model.quantities import QUANTITIES
from flipflow.studies.study import go_on

pytest.importorskip("zarr")
SPREAD = """
machine = "ffs0827"

[vary]
clearance = "5.4 mm..6.6 mm"
shear_stiffness = "2700 kN/m +/- 90 kN/m"
stop_stiffness = "8100 kN/m +/- 300 kN/m"
floating_mass = "+-3 %"

[study]
quantities = ["relative_amplitude", "stop_force"]
load_cases = ["empty", "hot"]
samples = 32
seed = 4
correlation = [["shear_stiffness", "stop_stiffness", 0.6]]
"""
MAP = """
machine = "ffs0827"
[vary]
clearance = {from = "5 mm", to = "7 mm", values = 3}
stops.stiffness = ["8 MN/m", "9 MN/m"]
[study]
quantities = ["relative_amplitude"]
speeds = ["850 rpm", "900 rpm"]
load_cases = ["empty"]
"""
LONG = """
machine = "ffs0827"
[vary]
clearance = "5.4 mm..6.6 mm"
[study]
quantities = ["relative_amplitude"]
load_cases = ["empty"]
samples = 16384
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (("spread", SPREAD), ("map", MAP), ("long", LONG)):
        (tmp_path / f"{name}.toml").write_text(text)
    return tmp_path


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes()
            for path in folder.rglob("*") if path.is_file()}  # fmt: skip


def test_a_file_says_what_a_call_says(here):
    one = read_study_file(here / "spread.toml")
    assert one.vary == {
        "clearance": pytest.approx((5.4e-3, 6.6e-3)),
        "shear_stiffness": ff.Normal(2.7e6, 9e4),
        "stop_stiffness": ff.Normal(8.1e6, 3e5),
        "floating_mass": pytest.approx((0.97 * 310.0, 1.03 * 310.0)),
    }
    covariance = np.array(one.sampling.covariance)
    assert covariance[1, 2] == pytest.approx(0.6 * 9e4 * 3e5)
    assert (one.sampling.n, one.sampling.seed, one.sampling.method) == (32, 4, "sobol")
    assert [load.name for load in one.load_cases] == ["empty", "hot"]
    assert one.omega == pytest.approx([850.0 * np.pi / 30.0])


def test_a_tolerance_in_the_unit_of_its_field(here):
    """About the machine's own value; of one piece by ``_each``."""
    written = 'clearance = "+-0.5 mm"\nshear_stiffness_each = "+- 9 kN/m"\nstop_damping = "+-4 %"'
    (here / "own.toml").write_text(f'machine = "ffs0827"\n[vary]\n{written}\n')
    one = read_study_file(here / "own.toml")
    own = one.project.screen
    each = 9e3 * getattr(own, FIELD["shear_stiffness"].count)
    assert one.vary == {
        "clearance": pytest.approx((own.clearance - 5e-4, own.clearance + 5e-4)),
        "shear_stiffness": pytest.approx((own.shear_stiffness - each, own.shear_stiffness + each)),
        "stop_damping": pytest.approx((0.96 * own.stop_damping, 1.04 * own.stop_damping)),
    }


def test_a_study_and_its_report(command, here):
    code, out, err = command("study", "spread.toml", "--json", "found.json")
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80
    said = " ".join(out.split())
    assert "32 machines at 850 rpm meet the 3 limits looked at in every load case" in said
    assert "Not looked at: main frame acceleration, floating frame acceleration, shear" in said
    names = sorted(path.name for path in (here / "spread-flipflow").iterdir())
    assert names == ["machines.csv", "report.html", "results.json", "study.html", "tolerance.html"]
    page = (here / "spread-flipflow/report.html").read_text()
    for words in (
        "Machines that meet the 3 limits looked at",
        "Not looked at: main frame acceleration",
        "Machines that meet each limit looked at",
        "all looked at, every case",
        "What tolerances cost at 850 rpm",
        "What the machines do at 850 rpm",
        "What moves each quantity at 850 rpm",
        "normal, 2700 kN/m, standard deviation 90.0 kN/m",
        "shear_stiffness and stop_stiffness, correlation 0.6",
        "Machines of the study",
    ):
        assert words in page
    result, found = ff.open_result(here / "found.json"), ff.open_study("spread.zarr")
    assert isinstance(result, ff.Tolerance)
    assert result.size == found.size == 32
    assert result.checked == ("relative_amplitude", "speed", "stop_force")
    rows = (here / "spread-flipflow/machines.csv").read_text().splitlines()
    assert len(rows) == 33
    before = files(here / "spread.zarr")
    code, _, err = command("study", "spread.toml")
    assert code == 2
    assert "it exists; go on with --resume spread.zarr" in err
    code, again, _ = command("study", "spread.toml", "--resume", "spread.zarr")
    assert code == 0
    assert "32 machines at 850 rpm" in " ".join(again.split())
    assert files(here / "spread.zarr") == before
    code, out, _ = command("study", "--resume", "spread.zarr", "-o", "other")
    assert code == 0
    assert "no limit is judged; limits and title are in the study file" in " ".join(out.split())
    assert "What the machines do at 850 rpm" in (here / "other/report.html").read_text()


def test_a_grid_is_drawn_as_a_map(command, here):
    code, out, _ = command("study", "map.toml")
    assert code == 0
    head = (here / "map-flipflow/machines.csv").read_text().splitlines()[0]
    assert "relative_amplitude_empty_850 rpm [m]" in head
    assert "nominal" not in head
    assert "What the machines do at 850 rpm:" in out
    assert "This is the first speed of the study" in out
    assert max(map(len, out.splitlines())) <= 80
    names = {path.name for path in (here / "map-flipflow").iterdir()}
    assert {"map.html", "report.html"} <= names
    page = (here / "map-flipflow/report.html").read_text()
    assert "Shaded: machines that meet the 2 limits looked at. Not looked at: main frame" in page
    assert ff.open_study("map.zarr").grid_shape == (3, 2)


def test_a_map_of_each_quantity_says_what_its_contours_are(screen):
    vary = {"clearance": [5e-3, 6e-3, 7e-3], "stop_stiffness": [7e6, 9e6]}
    found = ff.study(screen, vary, ("relative_amplitude", "stop_force", "omega_ub"), 89.0)
    drawn = ff.figure(found)
    titles = [panel.title for panel in drawn.panels]
    assert titles == ["Relative amplitude in mm, at 849.9 rpm", "Stop force in kN, at 849.9 rpm"]
    for panel in drawn.panels:
        line, label = panel.traces[0], panel.notes[0]
        assert np.nanmin(line.x) < label.x < np.nanmax(line.x)
    assert "relative amplitude in mm and the stop force in kN" in drawn.caption


def test_columns_are_named_by_speeds_that_can_be_told_apart():
    """In rpm with four digits; more where four are the same."""
    omega = np.array([8.5, 850.0, 850.04, 1207.3]) * np.pi / 30.0
    axis, values = Variable(("omega",), omega, "rad/s"), np.zeros((2, 4))
    arrays = Arrays(
        "", "sample", {"omega": axis}, {"size": Variable(("sample", "omega"), values)}, {}
    )
    names = [name for name, _ in table_columns(arrays)]
    assert names == ["size_8.5 rpm", "size_850 rpm", "size_850.04 rpm", "size_1207.3 rpm"]
    near = Variable(("omega",), omega[[0, 1, 3]], "rad/s")
    arrays = replace(arrays, coordinates={"omega": near}, variables={
        "size": Variable(("sample", "omega"), values[:, :3])})  # fmt: skip
    assert [name for name, _ in table_columns(arrays)][-1] == "size_1207 rpm"


def test_the_page_of_studies_lists_every_quantity():
    page = (Path(__file__).parents[2] / "docs/tutorials/studies.md").read_text(encoding="utf-8")
    table = page.partition("## What can be asked")[2].partition("\n## ")[0]
    asked = {name for name, one in QUANTITIES.items() if one.of != "operation"}
    assert set(re.findall(r"`(\w+)`", table)) == asked


def test_store_info(command, here):
    command("study", "map.toml")
    code, out, _ = command("store", "info", "map.zarr")
    assert code == 0
    assert "clearance, stop_stiffness" in out
    assert "Chunks      1 of 1 finished" in out
    assert max(map(len, out.splitlines())) <= 80
    (here / "map.zarr/reason/c.0.0.0").unlink()
    code, out, err = command("store", "info", "map.zarr")
    assert code == 4
    assert "chunk 0 (reason/c.0.0.0 is missing)" in out
    assert err.count("\n") == 1
    code, out, _ = command("study", "--resume", "map.zarr")
    assert code == 0
    assert "computed again: chunk 0" in " ".join(out.split())
    code, _, err = command("store", "info", "none.zarr")
    assert code == 2
    assert "no such folder" in err


def test_a_folder_that_is_no_store(command, here):
    (here / "empty").mkdir()
    for words, told in (("none.zarr", "no such folder"), ("empty", "it is no store of a study")):
        code, _, err = command("store", "info", words)
        assert code == 2
        assert told in err
        assert "the folder that flipflow study wrote, NAME.zarr or that of --store" in err
        assert "ff." not in err


def test_a_store_of_a_design_is_told_from_one_of_a_study(command, here):
    manifest = {"schema": "flipflow/design-search/1"}
    growing = {"excess": chunk_store.Variable(("candidate",), np.array(np.nan))}
    create_store(here / "search", Layout(manifest, {}, growing, {"candidate": 4}, 4))
    for words in (("store", "info", "search"), ("study", "--resume", "search")):
        code, _, err = command(*words)
        assert code == 4
        assert "search holds the search of a design, and no study; flipflow design goes on" in err


def test_worker_processes_find_the_same(command, here):
    pytest.importorskip("distributed")
    assert command("study", "map.toml", "--store", "one")[0] == 0
    code, _, err = command("study", "map.toml", "--store", "two", "--workers", "2")
    assert (code, err) == (0, "")
    assert files(here / "one") == files(here / "two")


def started(*words, folder, **more):
    call = [sys.executable, "-m", "flipflow.cli.main", *words]
    environment = os.environ | {"COLUMNS": "80"}
    return subprocess.Popen(call, cwd=folder, env=environment, stdout=subprocess.PIPE, **more)


def until(holds, seconds=180.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_it_keeps_what_is_finished_and_goes_on(command, here, number):
    run = started("study", "long.toml", folder=here, stderr=subprocess.PIPE, text=True)
    until(lambda: len(list(here.glob("long.zarr/checksum/c.*"))) >= 2)
    run.send_signal(number)
    _, error = run.communicate(timeout=60.0)
    assert run.returncode == 130
    finished = len(list(here.glob("long.zarr/checksum/c.*")))
    assert error == (
        f"Stopped by the user; {finished} of 256 chunks are in long.zarr, and flipflow study "
        "long.toml --resume long.zarr goes on.\n"
    )
    assert 2 <= finished < 256
    half = ff.open_study(here / "long.zarr")
    assert (half.reason != -1).sum() == 64 * finished
    code, _, err = command("store", "info", "long.zarr")
    assert (code, err) == (0, "")

    def tell(sentence, _share):
        raise ff.Cancelled(sentence)

    with pytest.raises(ff.Cancelled, match=f"^study: {finished} of 256 chunks$"):
        go_on(here / "long.zarr", monitor=tell)


def test_stopped_while_the_report_is_written_the_store_is_said(command, here, monkeypatch):
    def pressed(*_words):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("flipflow.report.study.study_blocks", pressed)
        code, _, err = command("study", "map.toml")
    goes_on = "flipflow study map.toml --resume map.zarr"
    assert code == 130
    assert (
        err == f"Stopped by the user; the finished chunks are in map.zarr, and {goes_on} goes on.\n"
    )
    assert not (here / "map-flipflow").exists()
    assert command(*goes_on.split()[1:])[0] == 0


def test_a_terminal_sees_the_time_left(here):
    reads, writes = pty.openpty()
    run = started("study", "long.toml", folder=here, stderr=writes)
    os.close(writes)
    seen = b""
    while b" left" not in seen:
        seen += os.read(reads, 4096)
    assert b"of 256 chunks, " in seen
    run.kill()
    run.communicate()
    os.close(reads)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("machine = ", "machin = "), ("[machin]", "'machine'")),
        (('"ffs0827"', '"none.toml"'), ("machine file", "no such file")),
        (("clearance =", "clearence ="), ("vary.clearence", "'clearance'")),
        (('"5.4 mm..6.6 mm"', '"5.4 mm"'), ("vary.clearance", "5.4 mm..6.6 mm")),
        (('"5.4 mm..6.6 mm"', "5.4"), ("vary.clearance = 5.4", "a list of at least two")),
        (('"5.4 mm..6.6 mm"', '"+-0.5 kg"'), ("vary.clearance", "mass", "length")),
        (('"5.4 mm..6.6 mm"', '"+-8 mm"'), ("vary.clearance",)),
        (('"5.4 mm..6.6 mm"', '"+-0 mm"'), ("vary.clearance",)),
        (('"5.4 mm..6.6 mm"', '"+-"'), ("vary.clearance",)),
        (('"5.4 mm..6.6 mm"', '["5 mm"]'), ("vary.clearance", "a list of at least two values")),
        (('"5.4 mm..6.6 mm"', '["5 mm", "6 kg"]'), ("vary.clearance", "6 kg")),
        (('"5.4 mm..6.6 mm"', '{from = "5 mm", to = "6 mm"}'), ("vary.clearance.values",)),
        (('"5.4 mm..6.6 mm"', '"+/-3 %"'), ("vary.clearance = '+/-3 %'", "the mean before")),
        (
            ('"5.4 mm..6.6 mm"', '{from = "6 mm", to = "5 mm", values = 3}'),
            ("vary.clearance = {'from': '6 mm', 'to': '5 mm'}", "reversed"),
        ),
        (
            ("seed = 4", 'speeds = {from = "16 Hz", to = "9 Hz", values = 3}'),
            ("study.speeds = {'from': '16 Hz', 'to': '9 Hz'}", "reversed"),
        ),
        (("samples = 32", "samples = 1"), ("study.samples = 1",)),
        (("samples = 32", 'sampling = "grid"'), ("study.seed", "draws nothing")),
        (("seed = 4", "seed = -4"), ("study.seed = -4",)),
        (('"hot"]', '"cold"]'), ("study.load_cases = 'cold'", "'hot'")),
        (('"stop_force"]', '"size"]'), ("quantity = 'size'",)),
        ((", 0.6]", ", 1.6]"), ("study.correlation",)),
        (
            ('["shear_stiffness", "stop', '["clearance", "stop'),
            ("study.correlation", "clearance is not normal", "m +/- s"),
        ),
        (
            ('["shear_stiffness", "stop', '["main_mass", "stop'),
            ("study.correlation = 'main_mass'", "does not vary"),
        ),
        (("seed = 4", 'speed = "850"'), ("study.speed", "unit")),
        (("seed = 4", "sead = 4"), ("study.sead", "'seed'")),
        (("seed = 4", 'branch = "middle"'), ("study.branch", "from-below")),
        (("[study]", "[[study]]"), ("study", "[study] on a line of its own")),
    ],
)
def test_bad_files(command, here, change, words):
    assert change[0] in SPREAD
    (here / "bad.toml").write_text(SPREAD.replace(*change))
    code, out, err = command("study", "bad.toml")
    assert code == 2
    assert out == ""
    assert err.count("\n") == 1
    for word in words:
        assert word in err
    assert not (here / "bad.zarr").exists()


@pytest.mark.parametrize("word", ["grid", "list"])
def test_a_range_has_no_values_to_combine(command, here, word):
    """It was told by the words of Python, an Interval that needs an array."""
    (here / "bad.toml").write_text(
        f'machine = "ffs0827"\n[vary]\nclearance = "5 mm..6 mm"\n[study]\nsampling = "{word}"\n'
    )
    code, _, err = command("study", "bad.toml")
    assert code == 2
    assert f"study.sampling = '{word}': clearance is a range, give a list of values" in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), ("FILE", "left out")),
        (("long.toml", "--workers", "0"), ("--workers = '0'",)),
        (
            ("long.toml", "--workers", "2", "--scheduler", "tcp://x:1"),
            ("leave one of the two out",),
        ),
        (("long.toml", "--store", "a", "--resume", "b"), ("leave one of the two out",)),
        (("long.toml", "--resume", "none.zarr"), ("no such folder",)),
        (("long.toml", "--scheduler", "nonsense"), ("--scheduler = 'nonsense'",)),
    ],
)
@pytest.mark.usefixtures("here")
def test_bad_options(command, options, words):
    code, out, err = command("study", *options)
    assert code == 2
    assert out == ""
    assert err.count("\n") == 1
    for word in words:
        assert word in err


def test_the_file_of_a_store_is_held_against_it(command, here):
    assert command("study", "map.toml")[0] == 0
    (here / "map.toml").write_text(MAP.replace("5 mm", "4 mm"))
    code, _, err = command("study", "map.toml", "--resume", "map.zarr")
    assert code == 4
    assert "holds a study of other inputs: vary.clearance.values" in err


def test_results_of_a_study_document(here, command):
    assert command("study", "map.toml", "--json", "-")[0] == 0
    document = json.loads((here / "map-flipflow/results.json").read_text())
    assert document["schema"] == "flipflow/study/1"
    assert document["name"] == "FFS0827"
