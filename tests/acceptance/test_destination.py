"""Where commands write: refused before the work, said after it, and kept when Ctrl-C stops it."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import flipflow as ff
from flipflow.errors import InputError
from flipflow.paper.reproduce import reproduce

FULL = Path("/dev/full")
# Linear, of one load case and one limit: for what is written, not for what is found.
SMALL = str(Path(__file__).parents[1] / "machines" / "small.toml")
# Each command that computes, in a form that takes a second or two.
QUICK = {
    "analyze": (SMALL, "--speeds", "800 rpm", "900 rpm"),
    "basins": ("ffs0827-linear", "--cells", "2"),
    "orbits": ("ffs0827-linear", "--max-periods", "1"),
    "reproduce": ("3",),
    "sensitivity": ("ffs0827-linear", "--vary", "floating_mass=+-5 %", "--n", "4"),
    "simulate": ("ffs0827-linear", "--periods", "3"),
    "startup": ("ffs0827-linear", "--profile", "0 s: 0 rpm, 1 s: 300 rpm"),
    "sweep": ("ffs0827-linear", "--speeds", "800 rpm", "900 rpm", "--steps", "3"),
}
FILES = {
    "analyze": "report.html, results.json, response.nc, response.csv",
    "basins": "basins.html, basins.json",
    "orbits": "motion-1.html",
    "sensitivity": "results.json, sensitivity.html, tornado.html",
    "simulate": "motion.html",
    "startup": "start.html",
    "sweep": "sweep.html",
}


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def at_work(monkeypatch):
    """``at_work(act)``: every command calls ``act`` where its work would begin."""

    def install(act):
        def begun(*_words):
            act()

        modules = [importlib.import_module(f"flipflow.cli.{name}") for name in QUICK]
        monkeypatch.setattr("flipflow.cli.progress.progress", begun)
        for module in modules:
            if hasattr(module, "progress"):
                monkeypatch.setattr(module, "progress", begun)

    return install


@pytest.mark.parametrize(
    ("target", "word"),
    [
        ("no/such/x.json", "there is no folder 'no/such'"),
        (".", "this is a folder"),
        ("", "name a file"),
        ("a\0b", "name a file"),
        ("locked/x.json", "it may not be written"),
    ],
)
@pytest.mark.parametrize("name", [*QUICK, "check"])
def test_a_bad_json_file_is_refused_before_the_work(
    command, at_work, monkeypatch, tmp_path, name, target, word
):
    (tmp_path / "locked").mkdir()
    # Permissions would not hold an administrator back.
    monkeypatch.setattr("os.access", lambda path, _mode: path.name != "locked")
    at_work(lambda: pytest.fail("the work was begun"))
    code, out, err = command(name, *QUICK.get(name, ("ffs0827",)), "--json", target)
    assert (code, out) == (4, "")
    assert err.startswith("Error: --json = ")
    assert word in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("target", ["file", "file/below"])
@pytest.mark.parametrize("name", QUICK)
def test_a_bad_folder_is_refused_before_the_work(command, at_work, tmp_path, name, target):
    (tmp_path / "file").write_text("kept")
    at_work(lambda: pytest.fail("the work was begun"))
    code, out, err = command(name, *QUICK[name], "-o", target)
    assert (code, out) == (4, "")
    assert err.startswith("Error: --output = ")
    assert err.count("\n") == 1
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize("written", ["own.toml", "link.json", "folder/../own.toml"])
@pytest.mark.parametrize("name", [*QUICK, "check"])
def test_the_file_that_is_read_is_not_written_to(command, at_work, tmp_path, name, written):
    command("new", "own.toml")
    before = (tmp_path / "own.toml").read_bytes()
    (tmp_path / "link.json").symlink_to("own.toml")
    (tmp_path / "folder").mkdir()
    at_work(lambda: pytest.fail("the work was begun"))
    words = ("3", "--machine", "own.toml") if name == "reproduce" else ("own.toml",)
    code, out, err = command(name, *words, *QUICK.get(name, ("",))[1:], "--json", written)
    assert (code, out) == (2, "")
    assert err.startswith(f"Error: --json = {written!r}: this is the file that is read")
    assert (tmp_path / "own.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "link"),
    [("simulate", "motion.html"), ("analyze", "response.csv"), ("reproduce", "figure-03.svg")],
)
def test_a_link_in_the_folder_to_the_file_that_is_read_is_not_followed(
    command, tmp_path, name, link
):
    shutil.copy(SMALL, "own.toml")
    before = (tmp_path / "own.toml").read_bytes()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / link).symlink_to("../own.toml")
    words = ("3", "--machine", "own.toml") if name == "reproduce" else ("own.toml",)
    code, _, err = command(name, *words, *QUICK[name][1:], "-o", "out")
    assert code == 2
    assert "this is the file that is read" in err
    assert (tmp_path / "own.toml").read_bytes() == before


@pytest.mark.parametrize("name", FILES)
def test_a_document_does_not_take_the_place_of_a_figure(command, at_work, tmp_path, name):
    """One of both was lost, and both were said to be written."""
    figure = next(one for one in FILES[name].split(", ") if not one.endswith(".json"))
    at_work(lambda: pytest.fail("the work was begun"))
    code, out, err = command(name, *QUICK[name], "-o", "out", "--json", f"out/../out/{figure}")
    assert (code, out) == (2, "")
    assert err.endswith("a file of --output may have this name, give it the ending .json.\n")
    assert not (tmp_path / "out").exists()


def test_a_document_in_the_place_of_that_of_the_folder_keeps_its_key(command, tmp_path):
    """The same command was refused the second time, for the report had lost what made it."""
    words = ("analyze", *QUICK["analyze"], "-o", "out", "--json", "out/results.json")
    for _ in range(2):
        code, _, err = command(*words)
        assert code == 0, err
    assert ff.open_result(tmp_path / "out" / "results.json").cases


def test_a_link_to_a_folder_that_is_not_there_is_named(command, tmp_path):
    (tmp_path / "x.json").symlink_to("gone/y.json")
    code, _, err = command("check", "ffs0827", "--json", "x.json")
    assert code == 4
    assert f"there is no folder {str(tmp_path / 'gone')!r}" in err


@pytest.mark.skipif(not FULL.exists(), reason="needs a device that is full")
def test_a_document_for_a_full_disk_is_said(command):
    code, _, err = command("simulate", *QUICK["simulate"], "--json", str(FULL))
    assert code == 4
    assert err == (
        "Error: --json = '/dev/full': it cannot be written (No space left on device), name a file "
        "in a folder you own.\n"
    )


@pytest.mark.parametrize("name", FILES)
def test_every_command_says_where_it_wrote(command, tmp_path, name):
    code, out, err = command(name, *QUICK[name], "-o", "out", "--json", "x.json")
    assert code == 0, err
    lines = out.splitlines()
    assert lines[-2:] == [f"Written to out: {FILES[name]}", "Written to x.json"]
    assert max(map(len, lines)) <= 80
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(
        FILES[name].split(", ")
    )
    json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))


def test_names_that_do_not_fit_a_line_stand_below_their_folder(command):
    folder = "a-folder-with-a-rather-long-name"
    code, out, _ = command("analyze", *QUICK["analyze"], "-o", folder)
    assert code == 0
    assert out.splitlines()[-2:] == [f"Written to {folder}:", f"  {FILES['analyze']}"]


def test_a_document_for_the_terminal_stands_there_alone(command):
    code, out, _ = command("simulate", *QUICK["simulate"], "-o", "out", "--json", "-")
    assert code == 0
    assert json.loads(out)["schema"] == "flipflow/history/1"


@pytest.mark.skipif(not FULL.exists(), reason="needs a device that is full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_an_answer_that_cannot_be_shown_is_in_its_files(tmp_path, unbuffered):
    with FULL.open("w") as full:
        ended = subprocess.run(
            [sys.executable, "-m", "flipflow.cli.main", "simulate", *QUICK["simulate"],
             "-o", "out", "--json", "x.json"],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
        )  # fmt: skip
    assert ended.returncode == 4
    assert ended.stderr == "Error: what was found cannot be shown (No space left on device).\n"
    assert (tmp_path / "out" / "motion.html").exists()
    assert json.loads((tmp_path / "x.json").read_text())


@pytest.mark.parametrize("name", QUICK)
def test_ctrl_c_ends_a_command_with_a_sentence(command, at_work, name):
    def pressed():
        raise KeyboardInterrupt

    at_work(pressed)
    code, out, err = command(name, *QUICK[name], "-o", "out", "--json", "x.json")
    assert (code, out) == (130, "")
    assert err == "Stopped by the user; nothing is written.\n"


def test_ctrl_c_while_files_are_written_leaves_none(command, monkeypatch, tmp_path):
    def pressed(_figure, _path):
        raise KeyboardInterrupt

    monkeypatch.setattr("flipflow.plotting.figure.Figure.write", pressed)
    code, _, err = command("sensitivity", *QUICK["sensitivity"], "-o", "out")
    assert code == 130
    assert err == "Stopped by the user; nothing is written.\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("rows", [4, 10])
def test_ctrl_c_in_a_sweep_keeps_the_speeds_that_settled(command, monkeypatch, tmp_path, rows):
    """Ten speeds up and ten down; stopped on the way up, and just after it."""
    heard = []
    run = ff.sweep

    def interrupted(*given, monitor, **options):
        def told(sentence, share):
            heard.append(sentence)
            if len(heard) == rows + 1:
                os.kill(os.getpid(), signal.SIGINT)
            monitor(sentence, share)

        return run(*given, monitor=told, **options)

    monkeypatch.setattr("flipflow.transient.sweep.sweep", interrupted)
    words = ("ffs0827", "--speeds", "800 rpm", "900 rpm", "--steps", "10")
    code, out, err = command("sweep", *words, "-o", "out", "--json", "s.json")
    assert code == 130
    assert err == "Stopped by the user; what was finished is in out and s.json.\n"
    assert "Written to out: sweep.html" in out
    document = json.loads((tmp_path / "s.json").read_text())
    assert document["complete"] is False
    up, down = document["up"], document["down"]
    assert len(up["omega"]) == len(up["settled"]) == min(rows + 1, 10)
    assert (down is None) == (rows < 10)
    if down is not None:
        assert len(down["omega"]) == 1
        assert not down["complete"]
    assert up["complete"] == (rows >= 10)


@pytest.mark.parametrize(
    ("ended", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "Stopped by the user; what was finished is in s.json.\n"),
        (InputError("omega", 1.0, "no stable motion is known at the first speed"), 0, ""),
    ],
)
def test_what_ends_a_glide_leaves_the_sweeps(command, monkeypatch, tmp_path, ended, code, said):
    def glide(*_words, **_more):
        raise ended

    monkeypatch.setattr("flipflow.studies.ramp.ramp", glide)
    words = ("ffs0827", "--speeds", "800 rpm", "900 rpm", "--steps", "3", "--rate", "30")
    found, out, err = command("sweep", *words, "--json", "s.json")
    assert (found, err) == (code, said)
    document = json.loads((tmp_path / "s.json").read_text())
    assert len(document["down"]["omega"]) == 3
    assert document["complete"] == (code == 0)
    assert ("Note: no glide: no stable motion is known" in out) == (code == 0)


def test_a_glide_that_ends_early_says_so(command, tmp_path):
    words = ("ffs0827", "--speeds", "1800 rpm", "1900 rpm", "--steps", "2", "--rate", "0.2")
    code, out, err = command("sweep", *words, "--json", "s.json")
    assert code == 0, err
    assert "for want of steps: give a greater --rate" in out
    glides = json.loads((tmp_path / "s.json").read_text())["glides"]
    assert [one["complete"] for one in glides] == [False, False]


def test_ctrl_c_in_a_reproduction_keeps_the_figures_that_are_finished(
    command, monkeypatch, tmp_path
):
    run = reproduce

    def interrupted(screen, names):
        if names == ("figure-05",):
            raise KeyboardInterrupt
        return run(screen, names)

    monkeypatch.setattr("flipflow.paper.reproduce.reproduce", interrupted)
    code, out, err = command("reproduce", "2c", "4", "5", "-o", "out", "--json", "c.json")
    assert code == 130
    assert err == "Stopped by the user; what was finished is in out and c.json.\n"
    assert "and 2 figures as HTML, SVG and PDF" in out
    assert (tmp_path / "out" / "figure-04.svg").exists()
    assert not (tmp_path / "out" / "figure-05.svg").exists()
    assert json.loads((tmp_path / "c.json").read_text())["claims"]


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "ffs0827", "--periods", "20", "--impulse", "9999 s: main 1"),
        ("simulate", "ffs0827", "--json", "nowhere/x.json"),
        ("reproduce", "2c"),
        ("compare", "ffs0827", "ffs0827-linear"),
    ],
)
def test_what_ends_a_command_leaves_no_empty_folder(command, monkeypatch, tmp_path, words):
    """An extra that is missing, an option that is wrong: what was made for the files goes."""
    monkeypatch.setitem(sys.modules, "jinja2", None)
    code, _, err = command(*words, "-o", tmp_path / "new" / "out")
    assert code in (2, 4)
    assert err.startswith("Error: ")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "new" / "out").mkdir(parents=True)
    assert command(*words, "-o", tmp_path / "new" / "out")[0] == code
    assert (tmp_path / "new" / "out").is_dir(), "it was there before"
