"""simulate, sweep and orbits at the command line: answers, JSON, bad input."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "flipflow.cli.main", *arguments]
    environment = {"COLUMNS": "80"}
    import os  # noqa: PLC0415

    return subprocess.run(
        command, capture_output=True, text=True, check=False, env=os.environ | environment
    )


def test_orbits_lists_three_motions() -> None:
    done = run("orbits", "ffs0827", "--speed", "203 rad/s", "--json", "-")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "flipflow/orbits/1"
    assert [one["stability"] for one in document["orbits"]] == ["stable", "unstable", "stable"]


def test_sweep_tells_both_jumps_in_rpm(tmp_path) -> None:
    arguments = ("--speeds", "1800 rpm", "2050 rpm", "--steps", "26", "-o", str(tmp_path))
    done = run("sweep", "ffs0827", *arguments)
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert "jumps between 1970 and 1980 rpm" in done.stdout
    assert "jumps between 1900 and 1890 rpm" in done.stdout
    assert (tmp_path / "sweep.html").stat().st_size > 10_000


def test_simulate_says_whether_it_settled(tmp_path) -> None:
    target = tmp_path / "history.json"
    done = run(
        "simulate", "ffs0827", "--periods", "150", "--impulse", "2 s: main 100", "--json",
        str(target),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert "Settled:" in done.stdout
    document = json.loads(target.read_text())
    assert document["energy"]["impulses"] != 0.0
    assert len(document["t"]) == len(document["displacement"]["relative"])


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (("orbits", "ffs0827", "--max-periods", "0"), "max_periods"),
        (("orbits", "ffs0827", "--speed", "fast"), "--speed"),
        (("sweep", "ffs0827", "--speeds", "900 rpm", "800 rpm"), "--speeds"),
        (("sweep", "ffs0827", "--speeds", "900 rpm", "inf rpm"), "--speeds"),
        (("sweep", "ffs0827", "--speeds", "800 rpm", "900 rpm", "--steps", "1"), "--steps"),
        (("sweep", "ffs0827", "--speeds", "800 rpm", "900 rpm", "--rate", "-3"), "rate"),
        (("simulate", "ffs0827", "--periods", "0"), "periods"),
        (("simulate", "ffs0827", "--impulse", "300"), "--impulse"),
        (("simulate", "ffs0827", "--impulse", "1 s: deck 300"), "--impulse"),
        (("simulate", "ffs0827", "--impulse", "1 s: main 1e99"), "impulse"),
        (("simulate", "ffs0827", "--impulse", "99 s: main 1"), "disturbances"),
        (("simulate", "nothing-there"), "nothing-there"),
    ],
)
def test_bad_input_is_one_sentence(arguments, field) -> None:
    done = run(*arguments)
    assert done.returncode == 2, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert field in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
