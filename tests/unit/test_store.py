"""Files are written whole or not at all, in one place, and refused in one sentence."""

from __future__ import annotations

import errno
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import flipflow as ff
from flipflow import results
from flipflow.errors import InputError, StoreError
from flipflow.io.template import write_template
from flipflow.results.store import write_file
from flipflow.studies.assessment import Assessment

SOURCE = Path(results.__file__).parents[1]
SMALL = Path(__file__).parents[1] / "machines" / "small.toml"


@pytest.fixture(scope="module")
def assessment() -> Assessment:
    return ff.assess(ff.load_project(SMALL), omega=(85.0, 90.0))


@pytest.fixture(scope="module")
def spectrum():
    return ff.linear_response(ff.load("ffs0827"), [10.0, 20.0])


@pytest.fixture
def writers(assessment, spectrum):
    """Everything in the public face and the reports that writes a file, by ending."""
    from flipflow.io.response import write_response  # noqa: PLC0415
    from flipflow.report import write_html  # noqa: PLC0415

    return {
        "json": lambda path: ff.save(spectrum, path),
        "csv": lambda path: ff.save(assessment.cases[0].branch, path),
        "nc": lambda path: ff.save(assessment.cases[0].branch, path),
        "html": lambda path: ff.figure(assessment.cases[0].branch).write(path),
        "svg": lambda path: ff.figure(assessment.cases[0].branch).write(path),
        "report.html": lambda path: write_html(assessment, path),
        "response.csv": lambda path: write_response(assessment, Path(path).parent),
        "toml": write_template,
    }


KINDS = ["json", "csv", "nc", "html", "svg", "report.html", "response.csv", "toml"]


def name_of(kind: str) -> str:
    return kind if "." in kind else f"x.{kind}"


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize("kind", KINDS)
def test_a_full_disk_leaves_the_old_file(tmp_path, monkeypatch, writers, kind):
    target = tmp_path / name_of(kind)
    if kind != "toml":  # a machine file is never overwritten
        target.write_text("kept")
    before = content(tmp_path)

    def full(_descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StoreError, match=r"cannot be written \(No space left on device\)") as told:
        writers[kind](target)
    assert str(told.value).count("\n") == 0
    assert target.name in str(told.value) or kind == "response.csv"
    assert content(tmp_path) == before


@pytest.mark.parametrize("kind", KINDS)
def test_ctrl_c_leaves_the_old_file(tmp_path, monkeypatch, writers, kind):
    target = tmp_path / name_of(kind)
    if kind != "toml":
        target.write_text("kept")
    before = content(tmp_path)

    def pressed(_descriptor):
        raise KeyboardInterrupt

    monkeypatch.setattr("os.fsync", pressed)
    with pytest.raises(KeyboardInterrupt):
        writers[kind](target)
    assert content(tmp_path) == before


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("none/{}", "there is no folder"),
        ("file/{}", "Not a directory"),
        ("folder/{}", "this is a folder"),
        ("a\0b/{}", "null byte"),
        ("{0}/" + 300 * "x" + "{0}", "there is no folder|File name too long"),
        ("loop/{}", "symbolic links"),
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_where_nothing_can_be_written(tmp_path, writers, kind, place, words):
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder" / name_of(kind)).mkdir(parents=True)
    (tmp_path / "folder" / "response.nc").mkdir()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    names = {path: path.lstat().st_mtime_ns for path in tmp_path.rglob("*")}
    with pytest.raises(StoreError, match=words) as told:
        writers[kind](str(tmp_path / place.format(name_of(kind))))
    assert told.value.exit_code == 4
    assert re.match(r"\w+ = '", str(told.value))
    assert len(str(told.value).splitlines()) == 1
    assert {path: path.lstat().st_mtime_ns for path in tmp_path.rglob("*")} == names


def test_a_file_that_may_not_be_written_stays(tmp_path, monkeypatch, spectrum):
    target = tmp_path / "x.json"
    target.write_text("kept")
    target.chmod(0o444)
    # Permissions would not hold an administrator back.
    monkeypatch.setattr("os.access", lambda path, _mode: path.name != "x.json")
    with pytest.raises(StoreError, match="may not be written"):
        ff.save(spectrum, target)
    assert target.read_text() == "kept"


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666])
def test_a_file_keeps_its_mode(tmp_path, mode):
    target = tmp_path / "x"
    target.write_bytes(b"old")
    target.chmod(mode)
    write_file(target, b"new")
    assert stat.S_IMODE(target.stat().st_mode) == mode
    assert target.read_bytes() == b"new"


def test_a_new_file_has_the_mode_of_any_other(tmp_path):
    (tmp_path / "other").write_bytes(b"")
    write_file(tmp_path / "x", b"new")
    assert (tmp_path / "x").stat().st_mode == (tmp_path / "other").stat().st_mode


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_a_link(tmp_path, there):
    (tmp_path / "far").mkdir()
    real, link = tmp_path / "far" / "real", tmp_path / "link"
    if there:
        real.write_bytes(b"old")
    link.symlink_to(real)
    write_file(link, b"new")
    assert link.is_symlink()
    assert real.read_bytes() == b"new"
    assert [path.name for path in real.parent.iterdir()] == ["real"]


def test_a_reader_of_the_old_file_goes_on_reading_it(tmp_path):
    target = tmp_path / "x"
    write_file(target, b"old")
    with target.open("rb") as reader:
        write_file(target, b"newer")
        assert reader.read() == b"old"


def test_a_pipe_is_written_to_as_it_is(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with subprocess.Popen(["cat", tmp_path / "pipe"], stdout=subprocess.PIPE) as reader:
        write_file(tmp_path / "pipe", b"through")
        assert reader.communicate()[0] == b"through"
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_full_device_is_said():
    with pytest.raises(StoreError, match=r"'/dev/full': it cannot be written \(No space left"):
        write_file("/dev/full", b"x")


def test_a_fresh_file_is_never_written_over(tmp_path):
    write_file(tmp_path / "x", b"mine", fresh=True)
    with pytest.raises(InputError, match="exists and is not overwritten"):
        write_file(tmp_path / "x", b"yours", fresh=True)
    assert content(tmp_path) == {"x": b"mine"}


def test_files_are_written_in_one_place():
    """The cache of kernels aside, whose files are no user's."""
    writes = re.compile(
        r"\.write_(?:bytes|text)\(|\bopen\([^)]*[\"'][wxa]b?[\"']|savefig\((?!buffer)"
    )
    found = {
        str(path.relative_to(SOURCE))
        for path in SOURCE.rglob("*.py")
        if "compiled" not in path.parts and writes.search(path.read_text(encoding="utf-8"))
    }
    assert found == {"results/store.py"}


def test_the_store_loads_no_numpy():
    """The command line refuses a file before it loads anything."""
    code = "import sys, flipflow.results.store; print('numpy' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "False\n"
