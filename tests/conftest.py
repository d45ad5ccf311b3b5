"""What many tests share: the bundled machine, and branches followed once a session."""

from __future__ import annotations

import functools
import signal
import sys
from collections.abc import Callable

import pytest

import flipflow as ff
from flipflow.cli.main import main
from flipflow.continuation.branch import Branch
from flipflow.paper.reproduce import Reproduction

LIGHT_DAMPING = {"isolation_damping": 3000.0, "shear_damping": 600.0, "stop_damping": 600.0}


def pytest_configure() -> None:
    """A shell ignores Ctrl-C in what it runs in the background, and so would all that we start."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Tests of a file stay on one process: what they share is then made once."""
    from xdist.scheduler import LoadFileScheduling  # noqa: PLC0415  only with pytest-xdist

    return LoadFileScheduling(config, log)


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


@pytest.fixture
def command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """``command("sweep", "ffs0827", ...)``: exit code, stdout and stderr, in this process."""

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.setenv("COLUMNS", "80")
        monkeypatch.setattr(sys, "argv", ["flipflow", *map(str, words)])
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
