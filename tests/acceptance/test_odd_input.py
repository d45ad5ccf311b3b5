"""Odd files, odd results, odd calls and odd terminals end in a sentence; seeded fuzz of each."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import flipflow as ff
from flipflow.errors import StoreError
from flipflow.io import load_cases
from flipflow.io.source import bundled_text
from fuzz import findings

SEED = 15
# Of 3,000, 2,500 and 20,000, which benchmarks/long_fuzz.py runs.
CASES = {"machine files": 300, "result files": 60, "calls": 300}


@pytest.mark.parametrize("kind", CASES)
def test_fuzz(kind, tmp_path):
    print(f"seed {SEED}")  # noqa: T201  shown where it fails
    found = list(findings(kind, SEED, range(CASES[kind]), tmp_path))
    assert not found, "\n".join(found)


def run(*words, **options):
    return subprocess.run(
        [sys.executable, "-m", "flipflow", *words], text=True, check=False, **options
    )


def test_the_package_is_run_as_a_module():
    told = run("--version", capture_output=True)
    assert (told.returncode, told.stdout) == (0, f"flipflow {ff.__version__}\n")


def test_a_closed_terminal_is_said_where_it_can_be(tmp_path):
    """Without stdout an answer cannot be shown; without stderr the exit code says enough."""

    def closed(*numbers):
        return {"preexec_fn": lambda: [os.close(number) for number in numbers], "cwd": tmp_path}

    told = run("check", "ffs0827", stderr=subprocess.PIPE, **closed(1))
    assert told.returncode == StoreError.exit_code
    assert told.stderr == "Error: what was found cannot be shown (Bad file descriptor).\n"
    told = run("check", "ffs0827", stdout=subprocess.PIPE, **closed(2))
    assert told.returncode == 0
    assert told.stdout.startswith("FFS0827")
    assert run("check", "nowhere.toml", stdout=subprocess.PIPE, **closed(2)).returncode == 2
    assert run("check", "ffs0827", **closed(1, 2)).returncode == StoreError.exit_code
    told = run("check", "ffs0827", "--json", "x.json", stderr=subprocess.PIPE, **closed(1))
    assert told.returncode == StoreError.exit_code
    assert (tmp_path / "x.json").read_text().startswith('{\n"schema"')


def test_a_terminal_of_wide_letters_shows_what_it_can():
    env = os.environ | {"PYTHONIOENCODING": "utf-16"}
    told = run("check", "ffs0827", capture_output=True, env=env)
    assert told.returncode == 0, told.stderr


@pytest.mark.parametrize("code", ["ascii", "latin-1", "cp1252"])
def test_letters_that_a_terminal_has_not_are_escaped(code, tmp_path):
    """A traceback of a UnicodeEncodeError stood there; the JSON document stays one."""
    name, place = "M\u0142yn \u2013 \U0001f3ed", tmp_path / "mill.toml"
    text = bundled_text("ffs0827").replace('name = "FFS0827"', f'name = "{name}"', 1)
    place.write_text(text, encoding="utf-8")
    env = os.environ | {"PYTHONIOENCODING": code}
    given = {"capture_output": True, "env": env, "encoding": code}
    told = run("check", str(place), **given)
    assert told.returncode == 0, told.stderr
    assert "M\\u0142yn" in told.stdout
    told = run("check", str(place), "--json", "-", **given)
    assert told.returncode == 0, told.stderr
    assert name in json.dumps(json.loads(told.stdout), ensure_ascii=False)


LONG = {
    "unit": ('main_mass = "916 kg"', f'main_mass = "1 {"k" * 600_000}"', "at most 100 characters"),
    "value": ('main_mass = "916 kg"', f'main_mass = "{"1" * 600_000}"', "at most 100 characters"),
    "key": ('main_mass = "916 kg"', f'{"k" * 600_000} = "916 kg"', "this name is not known"),
    "section": ("[frames]", f"[{'k' * 600_000}]", "this name is not known"),
    "dotted key": ("format = 1", f"format = 1\n{'.'.join('a' * 1001)} = 1", "is not known"),
    "dotted source": ("format = 1", f"format = 1\nsources.{'.'.join('a' * 1001)} = 1", "and "),
    "tiny": ('"916 kg"', '"1e-99999999999999999999 kg"', "can be told from 0"),
}


@pytest.mark.parametrize("name", LONG)
def test_what_is_long_is_shown_short(tmp_path, name):
    old, new, told = LONG[name]
    text = bundled_text("ffs0827")
    assert old in text
    (tmp_path / "machine.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ff.InputError, match=told) as caught:
        ff.load_project(tmp_path / "machine.toml")
    assert len(str(caught.value)) < 2000


def test_each_load_case_takes_as_long_to_read_as_the_one_before(tmp_path):
    """Counted in steps of the interpreter: with the square of their number the ratio would be 4."""
    ff.load("ffs0827")  # what is loaded and known once does not count
    steps = 0

    def count_steps(frame, event, _):
        nonlocal steps
        steps += 1
        # Calls everywhere, and single steps within the reader: a set in one line is a loop, too.
        if frame.f_code.co_filename != load_cases.__file__:
            return None
        frame.f_trace_opcodes = event == "call" or frame.f_trace_opcodes
        return count_steps

    case = '\n[[load_cases]]\nname = "{0}"\nmaterial = "{0} kg"\nsplit_main_floating = [0.5, 0.5]\n'
    taken = []
    for count in (50, 100, 200):
        cases = "".join(case.format(1 + k / 1000) for k in range(count))
        (tmp_path / "machine.toml").write_text(bundled_text("ffs0827") + cases, encoding="utf-8")
        steps, before = 0, sys.gettrace()
        sys.settrace(count_steps)
        try:
            project = ff.load_project(tmp_path / "machine.toml")
        finally:
            sys.settrace(before)
        assert len(project.load_cases) > count
        taken.append(steps)
    assert taken[2] - taken[1] < 2.1 * (taken[1] - taken[0])


@pytest.mark.parametrize("name", ["a" * 5000, "a" * 300, "a\0b"])
def test_a_path_that_no_file_can_have(tmp_path, name):
    path = tmp_path / f"{name}.json"
    with pytest.raises(ff.InputError, match="there is no such file"):
        ff.open_result(path)
    with pytest.raises(StoreError, match="it cannot be written"):
        ff.save(ff.linear_response(ff.load("ffs0827"), 10.0), path)


def test_a_schema_of_a_thousand_words_is_shown_short(tmp_path):
    path = Path(tmp_path / "x.json")
    path.write_text(f'{{"schema": "flipflow/{"x" * 100_000}"}}')
    with pytest.raises(StoreError, match="update flipflow") as caught:
        ff.open_result(path)
    assert len(str(caught.value)) < 1000


def test_names_in_any_letters_are_written_and_drawn(tmp_path):
    """A coordinate in Greek, a load case that is no formula of TeX."""
    tiny = ff.MechanicalSystem(
        [[1.0]], [[40.0]], [[1e4]], (ff.ClearanceSpring([1.0], 2e4, 10.0, 1e-3),),
        ff.Unbalance([1e-3]), {"\N{GREEK SMALL LETTER PHI}": [1.0]},
    )  # fmt: skip
    branch = ff.frequency_response(tiny, (80.0, 120.0), ff.PiecewiseExact(20))
    for ending in ("nc", "csv", "json"):
        ff.save(branch, tmp_path / f"branch.{ending}")
    assert ff.open_result(tmp_path / "branch.json").omega.size == branch.omega.size
    screen = ff.load("ffs0827-linear")
    for name in ("$x^{2$", "\\frac{", "<b>&", "100 %"):
        figure = ff.figure(ff.operating_region(screen, load_cases=[ff.Load(name=name)]))
        for ending in ("html", "svg", "pdf"):
            assert figure.write(tmp_path / f"figure.{ending}").stat().st_size > 1000
