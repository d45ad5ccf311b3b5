"""Ctrl-C and SIGTERM end a command by a sentence, at its first moment as in its midst."""

from __future__ import annotations

import dataclasses
import os
import pkgutil
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import flipflow as ff
from flipflow.cli.destination import Destination
from flipflow.compiled import workers
from flipflow.compiled.interruptible import interruptible
from flipflow.errors import IncompleteError
from flipflow.paper.page import write_figure
from flipflow.periodic.exact_solver import ExactSolver
from flipflow.results.stage import Stage

BOTH = [signal.SIGINT, signal.SIGTERM]
SMALL = str(Path(__file__).parents[1] / "machines" / "small.toml")
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

# Sends itself Ctrl-C right after it has locked something: the first time, the second, and so on.
LOCKED = """
import signal, threading
class Interrupting(threading.Condition):
    wanted = seen = 0
    def __init__(self, lock=None):
        super().__init__(lock)
        self.acquire = self.__enter__
    def __enter__(self, *words, **more):
        locked = self._lock.acquire(*words, **more)
        if threading.get_ident() == threading.main_thread().ident:
            Interrupting.seen += 1
            if Interrupting.seen == Interrupting.wanted:
                signal.raise_signal(signal.SIGINT)
        return locked
threading.Condition = Interrupting
from flipflow.batch.side_by_side import side_by_side
from flipflow.compiled.interruptible import interruptible
stopped = 0
def work(part, stop):
    pass
def run():
    side_by_side(work, 4, 1, 2)
    interruptible(dict)
while Interrupting.seen >= Interrupting.wanted:
    Interrupting.wanted, Interrupting.seen = Interrupting.wanted + 1, 0
    try:
        run()
    except KeyboardInterrupt:
        stopped += 1
Interrupting.wanted = 0
run()
print(stopped)
"""


def started(*words, folder):
    environment = os.environ | {"COLUMNS": "80"}
    return subprocess.Popen(
        [sys.executable, "-m", "flipflow.cli.main", *words], cwd=folder, env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def processor_seconds(pid):
    """Of a process and of those that it has started and that have ended, as compilers have."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


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


@pytest.mark.parametrize("where", ["typer.main.get_command", "typer.core.TyperGroup.parse_args"])
@pytest.mark.parametrize("number", BOTH)
def test_while_the_command_line_is_read_it_is_a_sentence(command, monkeypatch, where, number):
    monkeypatch.setattr(where, lambda *_, **__: os.kill(os.getpid(), number) or time.sleep(5.0))
    stopped = (130, "", "Stopped by the user; nothing is written.\n")
    assert command("check", "ffs0827") == stopped


@pytest.mark.parametrize("number", BOTH)
def test_a_signal_waits_while_files_take_their_places(command, monkeypatch, tmp_path, number):
    """What stands there is told, never that nothing does."""
    commit = Stage.commit

    def interrupted(stage):
        commit(stage)
        os.kill(os.getpid(), number)
        time.sleep(0.01)

    monkeypatch.setattr(Stage, "commit", interrupted)
    monkeypatch.chdir(tmp_path)
    words = "simulate", "ffs0827", "--periods", "3", "-o", "out", "--json", "out.json"
    code, _, error = command(*words)
    assert (code, error) == (
        130, "Stopped by the user; what was finished is in out and out.json.\n"
    )  # fmt: skip
    assert (tmp_path / "out.json").exists()
    assert (tmp_path / "out" / "motion.html").exists()


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
import flipflow.cli.main
flipflow.cli.main.AGAIN = {again}
flipflow.cli.main.main()
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
@pytest.mark.parametrize("again", [0.02, 1000.0], ids=["soon", "at the end"])
def test_a_signal_that_falls_into_a_callback_is_not_lost(tmp_path, number, again):
    program = DROPPED.format(again=again)
    words = (sys.executable, "-c", program, "reproduce", "2c", "-o", "out", str(int(number)))
    run = subprocess.run(
        words, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300.0
    )
    assert run.returncode == 130
    assert "Traceback" not in run.stderr
    assert run.stderr.endswith(".\n")
    if again > 1.0:
        assert run.stderr == "Stopped by the user; it had come to its end.\n"


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


@pytest.fixture(scope="module")
def chain():
    """Thirty masses in a row, four of them with a stop: a kernel's call takes minutes."""
    n = 30
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    stops = tuple(ff.ClearanceSpring(np.eye(n)[k], 5.0, 1e-3, 1.0) for k in range(4))
    force = ff.Unbalance(np.eye(n)[0])
    return ff.MechanicalSystem(np.eye(n), 1e-3 * K + 1e-4 * np.eye(n), K, stops, force)


@contextmanager
def interrupted_after(seconds):
    """What Ctrl-C does, after some seconds; the list is filled with the moment at which it came."""
    came = []

    def answer(_number, _frame):
        came.append(time.monotonic())
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, answer)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield came
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


LONG = {
    "branch": lambda chain: ff.frequency_response(chain, (0.05, 2.5)),
    "series": lambda chain: ff.frequency_response(chain, (0.05, 2.5), ff.HarmonicBalance(15)),
    "motions": lambda chain: ff.periodic_orbits(chain, 1.2, max_periods=3),
    "sweep": lambda chain: ff.sweep(chain, np.linspace(1.2, 1.3, 50)),
    "glide": lambda chain: ff.ramp(chain, (1.2, 1.3), 1e-3),
    "section": lambda chain: ff.poincare_section(chain, 1.2, 20_000),
    "exponents": lambda chain: ff.lyapunov_exponents(chain, 1.2, periods=20_000),
    "basins": lambda chain: ff.basins(chain, 1.2, {0: np.linspace(-3.0, 3.0, 200)}),
    "turns": lambda chain: ff.simulate(chain, 1.2, 20_000),
    "slow turns": lambda chain: ff.simulate(chain, 1e-4, 2),
    "slow start": lambda _: ff.start_up(ff.load("ffs0827"), speed=0.05),
}


@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_ends_every_kernel_within_a_second(chain, name):
    """The signal comes after a second; whatever runs then is not waited for."""
    begin = time.monotonic()
    with interrupted_after(1.0) as came, pytest.raises(KeyboardInterrupt):
        LONG[name](chain)
    # On a quiet machine a tenth of a second, and half a one where a kernel has to end first.
    assert came[0] - begin < 6.0
    assert time.monotonic() - came[0] < 6.0


def test_what_was_stopped_can_be_asked_again(screen):
    """A stopped kernel leaves its flag and its scratch as they were."""
    solver = ExactSolver(screen.system(), half_turn=False)
    z, stop = np.zeros(4), solver.flow.stop
    stop[0] = 1
    with pytest.raises(IncompleteError):
        solver.section(z, 120.0, 4)
    stop[0] = 0
    whole = solver.section(z, 120.0, 2000)

    with interrupted_after(0.2), pytest.raises(KeyboardInterrupt):
        solver.section(z, 120.0, 1_000_000)
    assert stop[0] == 0
    np.testing.assert_array_equal(solver.section(z, 120.0, 2000), whole)


def test_a_failure_beside_the_main_thread_is_raised_in_it():
    def fails():
        raise IncompleteError("a sentence")

    with pytest.raises(IncompleteError, match="a sentence"):
        interruptible(fails)
    assert interruptible(lambda: 3.0) == 3.0


def test_an_interrupt_before_a_kernel_has_begun_stops_none(monkeypatch):
    """Its flag would stop the next one."""
    monkeypatch.setattr("flipflow.compiled.interruptible.undisturbed", lambda: 1 / 0)
    stop = np.zeros(1, np.int64)
    with pytest.raises(ZeroDivisionError):
        interruptible(dict, stop)
    assert stop[0] == 0


def test_an_interrupt_leaves_no_lock_that_nobody_opens():
    run = subprocess.run(
        [sys.executable, "-c", LOCKED], capture_output=True, text=True, timeout=60, check=False
    )
    assert (run.returncode, run.stderr) == (0, "")
    assert int(run.stdout) > 10


# Sends itself a signal when all is done, while Python ends.
LATE = """
import atexit, signal, sys
from flipflow.cli.main import main
number = int(sys.argv.pop())
atexit.register(lambda: signal.raise_signal(number))
main()
"""


@pytest.mark.parametrize("number", BOTH)
def test_a_signal_changes_nothing_once_all_is_said(tmp_path, number):
    for file, code, said in (("ffs0827", 0, ""), ("none.toml", 2, "Error: ")):
        words = (sys.executable, "-c", LATE, "check", file, str(int(number)))
        run = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert run.returncode == code
        assert run.stderr.startswith(said)
        assert run.stderr.count("\n") == bool(said)


def pressed_after(monkeypatch, place, number=signal.SIGINT):
    """Have a function of the program send a signal when it has done what it does."""
    holder, name = pkgutil.resolve_name(place.rpartition(".")[0]), place.rpartition(".")[2]
    run = getattr(holder, name)

    def sending(*given, **more):
        found = run(*given, **more)
        monkeypatch.setattr(holder, name, run)
        signal.raise_signal(number)
        return found

    monkeypatch.setattr(holder, name, sending)


SAID_ONCE = ["flipflow.cli.app._say", "flipflow.cli.app.said"]


@pytest.mark.parametrize("number", BOTH)
@pytest.mark.parametrize("place", SAID_ONCE)
def test_a_sentence_is_said_once(command, monkeypatch, tmp_path, place, number):
    monkeypatch.chdir(tmp_path)
    pressed_after(monkeypatch, place, number)
    code, _, error = command("check", "none.toml")
    assert code == 2
    assert error.startswith("Error: ")
    assert error.count("\n") == 1


WRITING = {
    "simulate": ("simulate", SMALL, "--periods", "3", "-o", "out", "--json", "s.json"),
    "reproduce": ("reproduce", "2c", "-o", "out"),
    "several": ("analyze", SMALL, SMALL, "-o", "out"),
    "new": ("new", "fresh.toml"),
}
WRITTEN = {
    "simulate": "out and s.json", "reproduce": "out", "new": "fresh.toml",
    "several": "out/small-flipflow and out/small-2-flipflow and out",
}  # fmt: skip


@pytest.mark.parametrize("name", WRITING)
def test_what_is_written_is_said_whenever_the_signal_comes(command, monkeypatch, tmp_path, name):
    """Here when the command has come to its end, and is about to give its exit code."""
    monkeypatch.chdir(tmp_path)
    pressed_after(monkeypatch, "typer.core.TyperCommand.invoke")
    code, _, error = command(*WRITING[name])
    assert code == 130
    assert error == f"Stopped by the user; what was finished is in {WRITTEN[name]}.\n"
    for place in WRITTEN[name].split(" and "):
        assert (tmp_path / place).exists()


def test_what_is_written_is_said_while_it_is_shown(command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    pressed_after(monkeypatch, "flipflow.cli.reproduce._show")
    code, _, error = command("reproduce", "2c", "-o", "out")
    assert (code, error) == (130, "Stopped by the user; what was finished is in out.\n")
    assert (tmp_path / "out" / "reproduction.html").exists()


MAKES = ["tempfile.TemporaryFile", "pathlib.Path.mkdir", "flipflow.results.stage.held"]


@pytest.mark.parametrize("place", [*MAKES, "flipflow.results.stage.write_beside"])
def test_a_signal_leaves_nothing_that_was_begun(command, monkeypatch, tmp_path, place):
    monkeypatch.chdir(tmp_path)
    pressed_after(monkeypatch, place)
    code, _, error = command(*WRITING["simulate"])
    assert (code, error) == (130, "Stopped by the user; nothing is written.\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("place", ["pathlib.Path.touch", "flipflow.results.store.write_beside"])
def test_a_new_file_is_there_whole(command, monkeypatch, tmp_path, place):
    monkeypatch.chdir(tmp_path)
    pressed_after(monkeypatch, place)
    code, _, error = command("new", "fresh.toml")
    assert (code, error) == (130, "Stopped by the user; what was finished is in fresh.toml.\n")
    assert [path.name for path in tmp_path.iterdir()] == ["fresh.toml"]
    monkeypatch.undo()
    assert command("check", tmp_path / "fresh.toml")[0] == 0


def test_a_second_signal_leaves_nothing_either(command, monkeypatch, tmp_path):
    """It comes while the first has what is begun removed."""
    monkeypatch.chdir(tmp_path)
    pressed_after(monkeypatch, "flipflow.plotting.figure.Figure.write")
    remove = shutil.rmtree

    def interrupted(*given, **more):
        signal.raise_signal(signal.SIGINT)
        remove(*given, **more)

    monkeypatch.setattr(shutil, "rmtree", interrupted)
    code, _, error = command(*WRITING["simulate"])
    assert (code, error) == (130, "Stopped by the user; nothing is written.\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", BOTH)
def test_two_signals_at_once_are_one(command, monkeypatch, tmp_path, number):
    """The second comes before what is begun is removed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("flipflow.cli.main.MOMENT", 1000.0)
    pressed_after(monkeypatch, "flipflow.plotting.figure.Figure.write")
    end = Destination.__exit__

    def interrupted(*given):
        signal.raise_signal(number)
        end(*given)

    monkeypatch.setattr(Destination, "__exit__", interrupted)
    code, _, error = command(*WRITING["simulate"])
    assert (code, error) == (130, "Stopped by the user; nothing is written.\n")
    assert list(tmp_path.iterdir()) == []


def test_a_signal_is_answered_while_a_pipe_is_not_read(command, monkeypatch, tmp_path):
    """Nobody may ever read it."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    came = []

    def waiting(_path, _content):
        signal.raise_signal(signal.SIGINT)
        came.append("answered too late")

    monkeypatch.setattr(Path, "write_bytes", waiting)
    code, _, error = command("orbits", SMALL, "--json", "pipe")
    assert (code, error) == (130, "Stopped by the user; nothing is written.\n")
    assert came == []


# Of each what computes, and how often it is called.
LAST = {
    "basins": ("flipflow.studies.basins.basins", 1, ("--cells", "2")),
    "sweep": (
        "flipflow.transient.sweep.sweep", 2,
        ("--speeds", "800 rpm", "850 rpm", "--steps", "2", "--rate", "300"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LAST)
def test_a_signal_at_the_end_of_what_is_kept_is_not_lost(command, monkeypatch, tmp_path, name):
    """All is finished before the monitor is called again."""
    place, calls, words = LAST[name]
    monkeypatch.chdir(tmp_path)
    run, ended = pkgutil.resolve_name(place), []

    def interrupted(*given, **more):
        found = run(*given, **more)
        ended.append(found)
        if len(ended) == calls:
            signal.raise_signal(signal.SIGINT)
        return found

    monkeypatch.setattr(place, interrupted)
    code, out, error = command(name, SMALL, *words, "-o", "out", "--json", "s.json")
    assert (code, error) == (
        130, "Stopped by the user; what was finished is in out and s.json.\n"
    )  # fmt: skip
    assert (tmp_path / "out" / f"{name}.html").exists()
    assert "Speed rising by" not in out


# A worker that Ctrl-C reaches before it has loaded anything, as it does in a terminal.
EARLY_WORKER = """
import signal
signal.raise_signal(signal.SIGINT)
"""


def test_a_worker_that_compiles_is_deaf_to_ctrl_c_from_its_first_moment(tmp_path, monkeypatch):
    (tmp_path / "early_worker.py").write_text(EARLY_WORKER, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    assert workers._run("early_worker", ["part"], None, lambda _: None)


def test_a_signal_between_two_workers_ends_both(monkeypatch):
    made = []

    class Worker:
        def __init__(self, *_given, **_more):
            made.append(self)
            self.killed = False
            signal.raise_signal(signal.SIGINT)

        def kill(self):
            self.killed = True

        def wait(self):
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(subprocess, "Popen", Worker)
    with pytest.raises(KeyboardInterrupt):
        workers._run("module", ["one", "two"], None, lambda _: None)
    assert [one.killed for one in made] == [True]


def test_slow_turns_are_refused_where_they_take_hours(screen):
    with pytest.raises(ff.InputError, match=r"omega = 1e-07: 200 turns at it hold .* hours"):
        ff.simulate(screen, 1e-7)
    for run in (ff.start_up, ff.coast_down):
        with pytest.raises(ff.InputError, match=r"speed = 0.0001: 20 turns at it are about 9e"):
            run(screen, speed=1e-4)


def test_the_energies_of_a_slow_turn_are_those_of_a_whole_one(screen, monkeypatch):
    """A turn that is calculated in parts is the same motion, energies included."""
    whole = ff.simulate(screen, 2.0, 2)
    monkeypatch.setattr("flipflow.transient.recording.WORK_A_CALL", 300.0)
    parts = ff.simulate(screen, 2.0, 2)
    np.testing.assert_allclose(parts.x, whole.x, atol=1e-13)
    for name, value in whole.energy.items():
        assert parts.energy[name] == pytest.approx(value, rel=1e-9, abs=1e-9)


def test_the_monitor_is_told_how_long_the_rest_will_take(screen, monkeypatch):
    monkeypatch.setattr("flipflow.transient.simulate.SILENT_SECONDS", 0.0)
    heard = []
    ff.simulate(screen, 120.0, 500, monitor=lambda sentence, _share: heard.append(sentence))
    assert len(heard) > 10
    assert all(sentence.endswith(" s to go") for sentence in heard)
