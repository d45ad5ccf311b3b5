"""Ctrl-C and SIGTERM end a command by a sentence, at its first moment as in its midst."""

from __future__ import annotations

import dataclasses
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import flipflow as ff
from flipflow.paper.page import write_figure

BOTH = [signal.SIGINT, signal.SIGTERM]
# Sends itself a signal while the command line loads what it is built with.
EARLY = """
import os, sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == "typer":
            os.kill(os.getpid(), int(sys.argv[1]))
sys.meta_path.insert(0, Interrupting())
from flipflow.cli.main import main
main()
"""


def started(*words, folder):
    environment = os.environ | {"COLUMNS": "80"}
    return subprocess.Popen(
        [sys.executable, "-m", "flipflow.cli.main", *words], cwd=folder, env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def processor_seconds(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def until(holds, seconds=120.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.parametrize("number", BOTH)
def test_in_the_first_moment_it_is_a_sentence(number):
    run = subprocess.run(
        [sys.executable, "-c", EARLY, str(int(number))], capture_output=True, text=True, check=False
    )
    assert run.returncode == 130
    assert run.stdout == ""
    assert run.stderr == "Stopped by the user; nothing is written.\n"


@pytest.mark.parametrize("number", BOTH)
def test_a_stopped_simulation_says_that_nothing_is_written(tmp_path, number):
    run = started("simulate", "ffs0827", "--periods", "100000", "-o", "out", folder=tmp_path)
    until((tmp_path / "out").exists)
    time.sleep(1.0)
    run.send_signal(number)
    _, error = run.communicate(timeout=60.0)
    assert run.returncode == 130
    assert error == "Stopped by the user; nothing is written.\n"


@pytest.mark.parametrize("number", BOTH)
def test_a_stopped_reproduction_keeps_what_is_finished_and_says_so(tmp_path, number):
    """Figures are written as they are made, so that only the page is left to write."""
    known = resource.getrusage(resource.RUSAGE_CHILDREN)
    others = known.ru_utime + known.ru_stime
    run = started("reproduce", "2c", "4", "6", "7", "-o", "out", folder=tmp_path)
    figures = [f"figure-{name}.pdf" for name in ("02c", "04", "06")]
    # What is finished waits beside the folder until all of it takes its place.
    until(lambda: all(any(tmp_path.rglob(name)) for name in figures))
    before = processor_seconds(run.pid)
    run.send_signal(number)
    _, error = run.communicate(timeout=120.0)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    passed = after.ru_utime + after.ru_stime - others - before
    assert run.returncode == 130
    assert error == "Stopped by the user; what was finished is in out.\n"
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert "reproduction.html" in names
    assert not any(name.startswith("figure-07") for name in names)
    assert passed < 2.0  # seconds of a processor, whoever else uses it


def test_a_long_simulation_is_drawn_thin_and_kept_whole():
    """What is drawn does not grow with the turns; what is kept does."""
    screen = ff.load("ffs0827")
    drawn, kept = [], []
    for turns in (500, 2000):
        history = ff.simulate(screen, 89.0, turns)
        figure = ff.figure(history)
        drawn.append(sum(trace.x.size for panel in figure.panels for trace in panel.traces))
        kept.append(history.t.size)
        whole = [trace for trace in figure.panels[0].traces if trace.name == "relative (x2)"]
        greatest = max(trace.y.max() for trace in whole)
        assert greatest == pytest.approx(1e3 * history.displacement("relative").max(), rel=1e-12)
    assert drawn[1] == pytest.approx(drawn[0], rel=0.01)
    assert kept[1] > 3.9 * kept[0]


# Sends itself a signal where Python drops what is raised: in the callback of a weak reference.
DROPPED = """
import os, sys, weakref
number = int(sys.argv.pop())
class Gone: pass
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == "flipflow.paper.page":
            gone = Gone()
            self.reference = weakref.ref(gone, lambda _: os.kill(os.getpid(), number))
            del gone
sys.meta_path.insert(0, Interrupting())
from flipflow.cli.main import main
main()
"""


MADE = """
import sys
import flipflow.cli.app
from flipflow.cli.main import main
def run():
    try:
        exec("raise KeyboardInterrupt")
    except KeyboardInterrupt:
        sys.exit(130)
flipflow.cli.app.run = run
main()
"""


@pytest.mark.parametrize("number", BOTH)
def test_a_signal_that_falls_into_a_callback_is_not_lost(tmp_path, number):
    words = (sys.executable, "-c", DROPPED, "reproduce", "2c", "-o", "out", str(int(number)))
    run = subprocess.run(
        words, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300.0
    )
    assert run.returncode == 130
    assert "Traceback" not in run.stderr
    assert run.stderr.endswith(".\n")


def test_an_interrupt_in_code_made_from_text_ends_with_the_same_code(tmp_path):
    """Dataclasses are such code; after one, ``python -m`` ends itself by SIGINT of its own."""
    (tmp_path / "made.py").write_text(MADE, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-m", "made"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 130


def test_a_figure_is_written_whole_or_not_at_all(tmp_path):
    """Ctrl-C between its files."""
    found = ff.reproduce(figures=("2c",)).figures[0]

    class Interrupted:
        def write(self, path):
            if path.suffix == ".svg":
                raise KeyboardInterrupt
            path.write_text("begun")

    with pytest.raises(KeyboardInterrupt):
        write_figure(dataclasses.replace(found, figure=Interrupted()), tmp_path)
    assert list(tmp_path.iterdir()) == []
