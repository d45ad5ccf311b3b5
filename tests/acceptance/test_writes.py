"""Files take their places together: the old set or the new one, whatever ends the command."""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
import signal
import stat
import subprocess
import sys
import time
from dataclasses import asdict
from pathlib import Path

import pytest

import flipflow as ff
from flipflow.cli.destination import Destination
from flipflow.cli.report_files import DOCUMENTS, KEY, REPORT, ReportKey, replaced_files
from flipflow.errors import StoreError
from flipflow.results import stage
from flipflow.results.stage import Stage
from flipflow.results.store import json_text
from flipflow.studies import assessment
from flipflow.studies.assessment import assess

# Linear, of one load case and one limit: for what is written, not for what is found.
SMALL = str(Path(__file__).parents[1] / "machines" / "small.toml")
QUICK = (SMALL, "--speeds", "800 rpm", "900 rpm")
KILLS = 6
# Writes the set of one folder, then that of the other, again and again, as a command does.
WRITER = """
import sys
from pathlib import Path
from flipflow.cli.destination import Destination

sets = [{p.name: p.read_bytes() for p in Path(one).iterdir()} for one in sys.argv[2:]]
for k in range(1_000_000):
    with Destination(Path(sys.argv[1]), None) as target:
        for name, content in sets[k % 2].items():
            target.content(name, content)
        target.keep()
    print(k, flush=True)
"""
# The same of a document that stands alone.
DOCUMENT_WRITER = """
import json, sys
from pathlib import Path
from flipflow.cli.destination import Destination

documents = [json.loads((Path(one) / "motion.json").read_text()) for one in sys.argv[2:]]
for k in range(1_000_000):
    with Destination(None, sys.argv[1] + "/motion.json") as target:
        target.document(documents[k % 2])
        target.keep()
    print(k, flush=True)
"""
KILLED = """
import os, signal, sys
from pathlib import Path
from flipflow.cli.destination import Destination
from flipflow.results import stage

swap = stage._exchange

def killed(one, other):
    if sys.argv[2] == "after":
        assert swap(one, other)
    os.kill(os.getpid(), signal.SIGKILL)

stage._exchange = killed
with Destination(Path(sys.argv[1]), None) as target:
    for name in ("a", "b", "c"):
        target.content(name, "new")
    target.keep()
"""


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def swaps(tmp_path):
    """Skip where the file system cannot exchange two folders in one step."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    able = stage._exchange(tmp_path / "one", tmp_path / "two")
    for name in ("one", "two"):
        (tmp_path / name).rmdir()
    if not able:
        pytest.skip("this file system cannot exchange two folders")


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def write(folder: Path, files: dict[str, str], **options: object) -> None:
    with Destination(folder, options.get("json")) as target:
        for name, text in files.items():
            target.content(name, text)
        if "json" in options:
            target.document({"schema": "new"})
        target.keep()


def old_set(folder: Path) -> dict[str, bytes]:
    folder.mkdir()
    for name in ("a", "b", "c", "notes.txt"):
        (folder / name).write_text("old")
    return content(folder)


SHORT = ("simulate", "ffs0827", "--periods")
COMMANDS = {
    "analyze": (("analyze", *QUICK), ("--harmonics", "3"), WRITER),
    "simulate": (("simulate", "ffs0827"), ("--periods", "30"), WRITER),
    "simulate --json": ((*SHORT, "20"), ("--periods", "30"), DOCUMENT_WRITER),
    "reproduce": (("reproduce", "6"), ("--machine", "rig-lin2024"), WRITER),
}


@pytest.mark.usefixtures("swaps")
@pytest.mark.parametrize("name", COMMANDS)
def test_a_killed_command_leaves_the_old_set_or_the_new_one(command, tmp_path, name):
    """What it writes in two cases is written in turn, and the writer is killed at any moment.

    The commands themselves are killed by benchmarks/killed_writes.py.
    """
    words, more, writer_of = COMMANDS[name]
    for folder, given in (("one", ()), ("two", more)):
        place = ("-o", folder)
        if writer_of is DOCUMENT_WRITER:
            (tmp_path / folder).mkdir()
            place = ("--json", f"{folder}/motion.json")
        assert command(*words, *given, *place)[0] in (0, 3)
    sets = [content(tmp_path / folder) for folder in ("one", "two")]
    assert all(sets[0][part] != sets[1].get(part) for part in sets[0] if "csv" not in part)
    (tmp_path / "out").mkdir()
    out, moments = tmp_path / "out", random.Random(7)  # noqa: S311
    for _ in range(KILLS):
        with subprocess.Popen(
            [sys.executable, "-c", writer_of, out, "one", "two"], stdout=subprocess.PIPE
        ) as writer:
            for _ in range(moments.choice((1, 2))):
                writer.stdout.readline()
            time.sleep(moments.uniform(0.0, 0.15))
            writer.send_signal(signal.SIGKILL)
            writer.stdout.read()
        left = {part: kept for part, kept in content(out).items() if not part.endswith(".part")}
        assert left in sets


@pytest.mark.usefixtures("swaps")
@pytest.mark.parametrize("moment", ["before", "after"])
def test_killed_about_the_one_step_that_counts(tmp_path, moment):
    old = old_set(tmp_path / "out")
    ended = subprocess.run([sys.executable, "-c", KILLED, "out", moment], check=False)
    assert ended.returncode == -signal.SIGKILL
    new = {**old, **dict.fromkeys("abc", b"new")}
    assert content(tmp_path / "out") == (old if moment == "before" else new)


@pytest.mark.usefixtures("swaps")
def test_what_a_killed_command_left_aside_is_removed_in_time(tmp_path, monkeypatch):
    old_set(tmp_path / "out")
    subprocess.run([sys.executable, "-c", KILLED, "out", "before"], check=False)
    assert len(list(tmp_path.iterdir())) == 2
    write(tmp_path / "out", {"a": "soon"})
    assert len(list(tmp_path.iterdir())) == 2
    monkeypatch.setattr(stage, "ABANDONED", -1.0)
    write(tmp_path / "out", {"a": "later"})
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_what_another_command_holds_aside_stays(tmp_path, monkeypatch):
    old_set(tmp_path / "out")
    monkeypatch.setattr(stage, "ABANDONED", -1.0)
    first, second = (Stage(tmp_path / "out", "--output") for _ in range(2))
    (first.aside / "a").write_text("first")
    (second.aside / "a").write_text("second")
    second.commit()
    first.commit()
    assert (tmp_path / "out" / "a").read_text() == "first"


@pytest.mark.parametrize("single", [False, True])
def test_other_files_modes_and_links_stay(tmp_path, monkeypatch, single):
    """By exchange of the folder, and by renaming one after the other where that cannot be."""
    old_set(tmp_path / "out")
    other = tmp_path / "out" / "notes.txt"
    inode = other.stat().st_ino
    (tmp_path / "out" / "a").chmod(0o640)
    (tmp_path / "out").chmod(0o750)
    if single:
        monkeypatch.setattr(stage, "_exchange", lambda *_: False)
    write(tmp_path / "out", {"a": "new", "d": "new"})
    assert content(tmp_path / "out") == {
        "a": b"new", "b": b"old", "c": b"old", "d": b"new", "notes.txt": b"old",
    }  # fmt: skip
    assert other.stat().st_ino == inode
    assert stat.S_IMODE((tmp_path / "out" / "a").stat().st_mode) == 0o640
    assert stat.S_IMODE((tmp_path / "out").stat().st_mode) == 0o750
    (tmp_path / "plain").touch()
    plain = stat.S_IMODE((tmp_path / "plain").stat().st_mode)
    assert stat.S_IMODE((tmp_path / "out" / "d").stat().st_mode) == plain
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_a_link_in_the_folder_is_followed_and_stays(tmp_path):
    old_set(tmp_path / "out")
    (tmp_path / "far").write_text("old")
    (tmp_path / "out" / "a").unlink()
    (tmp_path / "out" / "a").symlink_to("../far")
    write(tmp_path / "out", {"a": "new", "b": "new"})
    assert (tmp_path / "out" / "a").is_symlink()
    assert (tmp_path / "far").read_text() == "new"
    assert (tmp_path / "out" / "b").read_text() == "new"


@pytest.mark.parametrize("kind", ["here", "link", "folder within"])
def test_folders_that_cannot_be_exchanged(tmp_path, monkeypatch, kind):
    old_set(tmp_path / "out")
    folder = Path("out")
    if kind == "here":
        monkeypatch.chdir(tmp_path / "out")
        folder = Path()
    elif kind == "link":
        (tmp_path / "link").symlink_to("out")
        folder = Path("link")
    else:
        (tmp_path / "out" / "within").mkdir()
    inode = (tmp_path / "out").stat().st_ino
    write(folder, {"a": "new", "b": "new"})
    assert {content(tmp_path / "out")[name] for name in "ab"} == {b"new"}
    assert ((tmp_path / "out").stat().st_ino == inode) == (kind != "link")
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("ended", [OSError(errno.EIO, "Input/output error"), KeyboardInterrupt()])
def test_renaming_that_fails_half_way_is_undone(tmp_path, monkeypatch, ended):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "within").mkdir()  # so that the files are renamed one by one
    (tmp_path / "out" / "a").write_text("old")
    before, rename, calls = content(tmp_path / "out"), Path.replace, []

    def failing(path, target):
        calls.append(path)
        if len(calls) == 3:
            raise ended
        return rename(path, target)

    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises((StoreError, KeyboardInterrupt)):
        write(tmp_path / "out", {"a": "new", "b": "new", "c": "new"}, json="x.json")
    assert content(tmp_path / "out") == before
    assert not (tmp_path / "x.json").exists()
    assert not list(tmp_path.rglob("*.part"))


def test_a_document_elsewhere_belongs_to_the_set(tmp_path, monkeypatch):
    """The file of --json is written first; when it cannot be, the folder is as it was."""
    old = old_set(tmp_path / "out")
    beside = stage.write_beside

    def full(place, text):
        if place.name == "x.json":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return beside(place, text)

    monkeypatch.setattr(stage, "write_beside", full)
    with pytest.raises(
        StoreError, match=r"--json = 'x\.json': it cannot be written .No space left"
    ):
        write(tmp_path / "out", {"a": "new"}, json="x.json")
    assert content(tmp_path / "out") == old


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 3 MB, where this process may mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", disk]
    if shutil.which("mount") is None or subprocess.run(words, check=False).returncode:
        pytest.skip("no disk can be mounted here")
    yield disk
    subprocess.run(["umount", disk], check=True)


FILLING = {
    "analyze": ("analyze", *QUICK, "-o"),
    "simulate": ("simulate", "ffs0827", "-o"),
    "simulate --json": ("simulate", "ffs0827", "--json"),
    "reproduce": ("reproduce", "6", "-o"),
}


@pytest.mark.parametrize("name", FILLING)
def test_a_full_disk_leaves_the_old_set(command, small_disk, name):
    old = old_set(small_disk / "out")
    place = small_disk / "out" / ("a" if "--json" in name else "")
    code, _, err = command(*FILLING[name], place)
    assert code == 4
    assert f"{small_disk / 'out'}/" in err
    assert "No space left on device" in err
    assert ".part" not in err
    assert content(small_disk / "out") == old
    assert [path.name for path in small_disk.iterdir()] == ["out"]


def test_of_an_analysis_and_a_design_one_stays(tmp_path):
    """Files of both would tell of two machines, and each would let the other's page go."""
    keys = {name: ReportKey(name, {}, (REPORT, name, f"{name}.more")) for name in DOCUMENTS}
    for mine, others in (DOCUMENTS, DOCUMENTS[::-1]):
        folder = tmp_path / mine
        folder.mkdir()
        for name in (REPORT, f"{others}.more"):
            (folder / name).touch()
        text = json_text({"schema": "", KEY: asdict(keys[others])})
        (folder / others).write_text(text, encoding="utf-8")
        with pytest.raises(ff.InputError, match="the report of another input"):
            replaced_files(folder, mine, keys[mine], overwrite=False)
        gone = replaced_files(folder, mine, keys[mine], overwrite=True)
        assert gone == (REPORT, others, f"{others}.more")
        assert replaced_files(folder, others, keys[others], overwrite=False) == ()


def test_another_report_is_not_overwritten(command, tmp_path, monkeypatch):
    """It is refused before the work."""
    worked = []
    monkeypatch.setattr(assessment, "assess", lambda *a, **k: worked.append(a) or assess(*a, **k))

    def analyzed(*words):
        worked.clear()
        return command("analyze", *words, "-o", "out")

    own = Path(SMALL).read_text(encoding="utf-8").replace('customer = ""', 'customer = "Another"')
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    assert analyzed(*QUICK, "--tables")[0] == 0
    assert worked
    before = content(tmp_path / "out")
    assert analyzed(*QUICK)[0] == 0  # the same input and options
    assert content(tmp_path / "out").keys() == before.keys()
    for words, why in (
        (("own.toml", *QUICK[1:]), "it holds the report of another input"),
        ((*QUICK[:3], "910 rpm"), "by other options (--speeds 800 rpm 900 rpm)"),
        ((*QUICK, "--harmonics", "3"), "by other options (--speeds 800 rpm 900 rpm)"),
    ):
        code, out, err = analyzed(*words)
        assert (code, out) == (2, "")
        assert err.startswith("Error: --output = 'out': it holds the report of ")
        assert why in err
        assert "--overwrite" in err
        assert err.count("\n") == 1
        assert not worked
    assert content(tmp_path / "out").keys() == before.keys()
    assert analyzed("own.toml", *QUICK[1:], "--overwrite")[0] == 0
    assert not (tmp_path / "out" / "tables.xlsx").exists(), "a file of the other report"
    key = json.loads((tmp_path / "out" / "results.json").read_text())["report"]
    assert key["options"] == {"--speeds": "800 rpm 900 rpm"}
    assert set(key["files"]) == {path.name for path in (tmp_path / "out").iterdir()}
    # A title block that changes makes another report, though every number stays.
    (tmp_path / "own.toml").write_text(own.replace('revision = "A"', 'revision = "B"'))
    assert own != (tmp_path / "own.toml").read_text()
    assert analyzed("own.toml", *QUICK[1:])[0] == 2


def test_a_report_of_an_unknown_input_is_not_overwritten(command, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.html").write_text("mine")
    code, _, err = command("analyze", *QUICK, "-o", "out")
    assert code == 2
    assert "whose input is not known" in err
    assert content(tmp_path / "out") == {"report.html": b"mine"}
