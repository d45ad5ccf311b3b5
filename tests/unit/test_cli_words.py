"""The words of the command line: help within 80 columns, options that refuse, whole sentences."""

from __future__ import annotations

import io
import re
from importlib import resources
from itertools import pairwise

import pytest
from rich.cells import cell_len
from rich.console import Console

from flipflow.cli import app, simulate, startup
from flipflow.errors import IncompleteError
from flipflow.periodic.options import HarmonicBalance
from flipflow.report.terminal import HARD_BLANK, say
from flipflow.studies.periodic_orbits import MOST_PERIODS
from flipflow.studies.sensitivity import N_MOST
from flipflow.transient.simulate import MOST_SAMPLES, SAMPLES_A_TURN
from flipflow.transient.startup import MOST_SECONDS

COMMANDS = [one.__name__ for one in app.COMMANDS]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_keeps_80_columns(command, name):
    code, out, _ = command(name, "--help")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80


def test_the_list_of_commands_is_cut_off_nowhere(command):
    code, out, _ = command("--help")
    assert code == 0
    assert "..." not in out.split("Commands:")[1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("orbits", "ffs0827", "--max-periods", "13"), f"from 1 to {MOST_PERIODS}"),
        (("sensitivity", "ffs0827", "--n", "1e9"), f"from 2 to {N_MOST}"),
        (("analyze", "ffs0827", "--harmonics", "two"), "from 1 to 200"),
        (("startup", "ffs0827", "--duration", "-1 s"), f"up to {MOST_SECONDS:.0f} s"),
        (
            ("startup", "ffs0827", "--profile", "0 s: 0 rpm, 9999 s: 800 rpm"),
            f"at most {MOST_SECONDS:.0f} s",
        ),
    ],
)  # fmt: skip
def test_options_refuse_what_the_analyses_refuse(command, words, said):
    code, _, err = command(*words)
    assert code == 2
    assert said in err
    assert err.count("\n") == 1


def test_bounds_of_options_are_those_of_the_analyses():
    assert simulate.MOST_TURNS <= MOST_SAMPLES / SAMPLES_A_TURN
    assert startup.LONGEST == MOST_SECONDS
    assert HarmonicBalance(200).harmonics == 200


@pytest.mark.parametrize(
    "beside",
    [("--speed", "800 rpm"), ("--motor-power", "5 kW"), ("--inertia", "1 kg m^2"),
     ("--duration", "5 s")],
)  # fmt: skip
def test_nothing_that_is_given_beside_a_profile_is_passed_over(command, beside):
    code, _, err = command("startup", "ffs0827", "--profile", "0 s: 0 rpm, 9 s: 90 rpm", *beside)
    assert code == 2
    assert f"{beside[0]} = '{beside[1]}': --profile lays the speed down" in err


@pytest.mark.parametrize("name", ["analyze", "simulate", "startup", "orbits", "basins"])
def test_a_working_speed_that_would_take_for_ever_is_refused(command, monkeypatch, tmp_path, name):
    monkeypatch.chdir(tmp_path)
    text = (resources.files("flipflow.io.machines") / "ffs0827.toml").read_text(encoding="utf-8")
    (tmp_path / "slow.toml").write_text(text.replace('"850 rpm"', '"0.001 rpm"'), encoding="utf-8")
    code, _, err = command(name, "slow.toml", "--force")
    assert code == 2
    assert err == "Error: operation.speed = '0.001 rpm': give a speed from 1 rpm to 100000 rpm.\n"


def test_a_number_stays_with_its_unit():
    out = io.StringIO()
    console = Console(file=out, width=40, highlight=False, markup=False, emoji=False)
    for count in range(1, 30):
        say(
            console,
            f"{'x' * count} greatest 39.2 mm at 1939.1 rpm, 12 % of 8 kg m/s, 3 g and 7 kW.",
        )
    lines = out.getvalue().splitlines()
    assert max(map(len, lines)) <= 40
    assert not any(re.match(r"(mm|rpm|%|kg|g|kW)\b", line) for line in lines)
    assert "\N{NO-BREAK SPACE}" not in out.getvalue()
    assert HARD_BLANK not in out.getvalue()


def test_a_sentence_with_wide_letters_is_broken_once():
    """Chinese letters are two columns wide: lines too long were broken again, after one word."""
    out = io.StringIO()
    console = Console(file=out, width=40, highlight=False, markup=False, emoji=False)
    said = f"{'筛分机 ' * 12}at 850 rpm in every load case of the machine"
    say(console, said)
    lines = out.getvalue().splitlines()
    assert " ".join(lines) == said
    for line, following in pairwise(lines):
        assert cell_len(f"{line} {following.split()[0]}") > 40 >= cell_len(line)


def test_every_error_is_a_whole_sentence(command, monkeypatch):
    def lost(*_words, **_options):
        raise IncompleteError("no point found between two")

    monkeypatch.setattr("flipflow.transient.simulate.simulate", lost)
    code, _, err = command("simulate", "ffs0827")
    assert (code, err) == (3, "Error: no point found between two.\n")


def test_on_a_terminal_an_error_breaks_between_words(command, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    code, _, err = command("simulate", "ffs0827", "--speed", "850,5 rpm")
    assert code == 2
    assert max(map(len, err.splitlines())) <= 80
    assert err.count("\n") == 2
