"""What many tests share: the bundled machine, and branches followed once a session."""

from __future__ import annotations

import dataclasses
import functools
import gc
import importlib
import pickle
import pkgutil
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import typer.main
from numba import types

import flipflow as ff
from flipflow.cli.main import main
from flipflow.compiled import cache
from flipflow.continuation.branch import Branch
from flipflow.dynamics.machine_columns import Named
from flipflow.io.project import Project
from flipflow.model.monitor import Monitor
from flipflow.paper.reproduce import Reproduction
from flipflow.periodic.derivatives import MotionDerivatives
from flipflow.periodic.orbit import Orbit
from flipflow.report.blocks import FigureBlock, Heading
from flipflow.report.html import head_of, page
from flipflow.report.registry import blocks_of
from flipflow.signals import SIGNALS
from flipflow.studies import derivatives, start_and_blows
from flipflow.studies.assessment import Assessment, assess
from kernels_ahead import compile_ahead

LIGHT_DAMPING = {"isolation_damping": 3000.0, "shear_damping": 600.0, "stop_damping": 600.0}
# Files that share what takes long.
TOGETHER = {
    "test_formats.py": "reports", "test_layout_of_reports.py": "reports",
    "test_report_offline.py": "reports",
    "test_paper_claims.py": "paper", "test_paper_figures.py": "paper",
    "test_reproduction_page.py": "paper",
    "test_results_travel.py": "results", "test_journal_figures.py": "results",
}  # fmt: skip
# What takes longest, begun first: one begun last would leave the other processes idle.
LONGEST = (
    "reports", "results", "test_design.py", "test_derivatives.py", "paper", "test_study_kills.py",
    "test_laws.py", "test_kernel_cache.py", "test_drive.py", "test_stopping.py",
    "test_bad_input.py", "test_study_workers.py", "test_destination.py", "test_starts.py",
    "test_unusual_machines.py", "test_lanes.py", "test_jump_risk.py", "test_field_solver.py",
    "test_near_grazing.py", "test_random_machines.py", "test_paths.py", "test_smooth_law.py",
)  # fmt: skip


def pytest_configure() -> None:
    """A shell ignores Ctrl-C in what it runs in the background, and so would all that we start."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Every module is loaded, and the collector of garbage looks no more at what lives to the end.

    A module that is first loaded by a test would keep what the test has replaced for a moment.
    """
    for one in pkgutil.walk_packages(ff.__path__, f"{ff.__name__}."):
        importlib.import_module(one.name)
    gc.collect()
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes longest comes first, what is left in the order of the names of files."""
    places = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: places.get(_group(item.path.name), len(places)))


def _group(file: str) -> str:
    """What stays on one process: a file, or several that share what takes long."""
    return TOGETHER.get(file, file)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes() -> None:
    """Large kernels are compiled before the processes start that would each compile them."""
    compile_ahead()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Tests of a file stay on one process: what they share is then made once.

    Files are begun in the order of collection, and not those with the most tests first.
    """
    from xdist.scheduler import LoadFileScheduling  # noqa: PLC0415  only with pytest-xdist

    class Grouped(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return _group(file.rpartition("/")[2])

    config.option.loadscopereorder = False
    return Grouped(config, log)


@pytest.fixture(scope="session")
def script() -> Iterator[Callable[[str], ModuleType]]:
    """``script("paths")``: a script of ``benchmarks`` as a module; they import each other.

    Their folder comes last: workers of later tests inherit the path.
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys, "path", [*sys.path, str(Path(__file__).parents[1] / "benchmarks")])
        yield importlib.import_module


@pytest.fixture(scope="session")
def screen() -> ff.FlipFlowScreen:
    """FFS0827 with stop, as bundled."""
    return ff.load("ffs0827")


@pytest.fixture(scope="session")
def response(screen: ff.FlipFlowScreen) -> Callable[..., Branch]:
    """``response(method, omega, **changes)``: the branch of FFS0827 with fields changed."""

    @functools.cache
    def followed(
        method: ff.PiecewiseExact | ff.HarmonicBalance | None = None,
        omega: tuple[float, float] = (5.0, 250.0),
        **changes: float,
    ) -> Branch:
        return ff.frequency_response(screen.replace(**changes), omega, method)

    return followed


@pytest.fixture(scope="session")
def exact(response: Callable[..., Branch]) -> Branch:
    """The exact branch of FFS0827, 5 to 250 rad/s."""
    return response()


@contextmanager
def signals_as_they_were() -> Iterator[None]:
    """A command that has ended leaves Ctrl-C and SIGTERM without an answer, as its process ends."""
    before = {one: signal.getsignal(one) for one in SIGNALS}
    try:
        yield
    finally:
        for one, answer in before.items():
            signal.signal(one, answer)


@pytest.fixture(autouse=True)
def _signals() -> Iterator[None]:
    with signals_as_they_were():
        yield


@pytest.fixture(scope="session", autouse=True)
def _command_line_built_once() -> Iterator[None]:
    """What reads a command line is made anew for each, which takes longer than most answers."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(typer.main, "get_command", functools.cache(typer.main.get_command))
        yield


@pytest.fixture(scope="session", autouse=True)
def _blows_once() -> Iterator[None]:
    """What throws a motion is half of an analysis, and the same for machines that differ in words.

    ``ff.jump_risk`` itself finds it anew each time.
    """
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(start_and_blows, "jump_risk", functools.cache(start_and_blows.jump_risk))
        yield


def _told(kind: types.Type) -> str:
    """A type as numba words it, a structure with its fields."""
    fields = getattr(kind, "fields", getattr(kind, "types", ()))
    return " ".join([str(kind), *map(_told, fields)])


@pytest.fixture(scope="session", autouse=True)
def _arrays_of_one_layout() -> Iterator[None]:
    """A kernel is compiled anew for arrays that lie otherwise in memory: that can take a minute."""
    load = cache.KernelCache.load_overload

    def checked(self: cache.KernelCache, sig: Any, target: object) -> object:
        told = " ".join(map(_told, getattr(sig, "args", sig)))
        assert not re.search(r"d, [AF]\)|readonly", told), f"arrays of another layout: {told}"
        return load(self, sig, target)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(cache.KernelCache, "load_overload", checked)
        yield


@pytest.fixture
def command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """``command("sweep", "ffs0827", ...)``: exit code, stdout and stderr, in this process."""

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.setenv("COLUMNS", "80")
        monkeypatch.setattr(sys, "argv", ["flipflow", *map(str, words)])
        with signals_as_they_were():
            try:
                main()
                code = 0
            except SystemExit as ended:
                code = ended.code or 0
        told = capsys.readouterr()
        assert "Traceback" not in told.err
        return code, told.out, told.err

    return call


@pytest.fixture(scope="session")
def reproduction() -> Reproduction:
    """All figures and claims of the paper on its own machine."""
    return ff.reproduce()


@pytest.fixture(scope="session")
def analysed() -> Callable[..., Assessment]:
    """``analysed(project, **options)``: each project, or bundled machine, once a session."""
    known: dict[bytes, Assessment] = {}

    def found(project: Project | str, **options: object) -> Assessment:
        if isinstance(project, str):
            project = ff.load_project(project)
        key = pickle.dumps((project, sorted(options.items())))
        if key not in known:
            known[key] = assess(project, **options)
        return known[key]

    return found


@pytest.fixture(scope="session")
def thirty_cases(analysed: Callable[..., Assessment]) -> Assessment:
    """FFS0827 under thirty load cases."""
    loads = tuple(
        ff.Load(name=f"Fall {k + 1}: Steifigkeit", stiffness_factor=1.0 + 0.01 * k)
        for k in range(30)
    )
    return analysed(dataclasses.replace(ff.load_project("ffs0827"), load_cases=loads))


@pytest.fixture(scope="session")
def printed_page(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """``printed_page(assessment)``: the PDF that Chromium prints of a report, each once a session.

    With ``begin`` the figures behind the results, which stand on later sheets than the second,
    are left out: a browser needs most of its time for them.
    """
    known: dict[str, Path] = {}

    def printed(assessment: Assessment, *, begin: bool = False) -> Path:
        blocks = blocks_of(assessment)
        if begin:
            late = next(
                k for k, one in enumerate(blocks)
                if isinstance(one, Heading) and one.text == "Results"
            )  # fmt: skip
            rest = (one for one in blocks[late:] if not isinstance(one, FigureBlock))
            blocks = (*blocks[:late], *rest)
        text = page(blocks, **head_of(assessment))
        if text not in known:
            folder = tmp_path_factory.mktemp("printed")
            (folder / "report.html").write_text(text, encoding="utf-8")
            known[text] = _print(folder / "report.html")
        return known[text]

    return printed


def _print(report: Path) -> Path:
    """A page as Chromium prints it."""
    sheet = report.with_suffix(".pdf")
    subprocess.run(
        [shutil.which("chromium"), "--headless", "--no-sandbox", "--disable-gpu",
         "--virtual-time-budget=20000", f"--user-data-dir={report.with_name('profile')}",
         "--no-pdf-header-footer", f"--print-to-pdf={sheet}", report.as_uri()],
        capture_output=True, timeout=900, check=True,
    )  # fmt: skip
    return sheet


@pytest.fixture
def slopes_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The derivatives of a motion are made once for all that is read off it."""
    made, known = derivatives._slopes, {}

    def slopes(orbit: Orbit, parameters: Sequence[Named]) -> MotionDerivatives:
        key = id(orbit), tuple(one.name for one in parameters)
        if key not in known:
            known[key] = orbit, made(orbit, parameters)  # an orbit that is kept keeps its number
        return known[key][1]

    monkeypatch.setattr(derivatives, "_slopes", slopes)


@pytest.fixture(scope="module")
def analysed_once(analysed: Callable[..., Assessment]) -> Iterator[None]:
    """Commands, comparisons and designs take analyses from ``analysed``, each made once."""

    def known(project: Project, *, monitor: Monitor | None = None, **options: object) -> Assessment:
        if monitor is not None:
            monitor("known already", 0.0)
        return analysed(project, **options)

    with pytest.MonkeyPatch.context() as patched:
        for room in ("assessment", "compare", "design"):
            patched.setattr(f"flipflow.studies.{room}.assess", known)
        yield
