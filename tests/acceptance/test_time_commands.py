"""simulate, sweep and orbits at the command line: answers, JSON, bad input."""

from __future__ import annotations

import json

import pytest


def test_orbits_lists_three_motions(command):
    code, out, err = command("orbits", "ffs0827", "--speed", "203 rad/s", "--json", "-")
    assert code == 0, err
    document = json.loads(out)
    assert document["schema"] == "flipflow/orbits/1"
    assert [one["stability"] for one in document["orbits"]] == ["stable", "unstable", "stable"]


def test_sweep_tells_both_jumps_in_rpm(command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    arguments = ("--speeds", "1800 rpm", "2050 rpm", "--steps", "26", "-o", ".")
    code, out, err = command("sweep", "ffs0827", *arguments)
    assert code == 0, err
    assert max(map(len, out.splitlines())) <= 80
    assert "jumps between 1970 and 1980 rpm" in out
    assert "jumps between 1900 and 1890 rpm" in out
    assert (tmp_path / "sweep.html").stat().st_size > 10_000


def test_simulate_says_whether_it_settled(command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    target = tmp_path / "history.json"
    code, out, err = command(
        "simulate", "ffs0827", "--periods", "150", "--impulse", "2 s: main 100", "--json",
        target.name,
    )  # fmt: skip
    assert code == 0, err
    assert max(map(len, out.splitlines())) <= 80
    assert "Settled:" in out
    document = json.loads(target.read_text())
    assert document["energy"]["impulses"] != 0.0
    assert len(document["t"]) == len(document["displacement"]["relative"])


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (("orbits", "ffs0827", "--max-periods", "0"), "--max-periods"),
        (("orbits", "ffs0827", "--speed", "fast"), "--speed"),
        (("sweep", "ffs0827", "--speeds", "900 rpm", "800 rpm"), "--speeds"),
        (("sweep", "ffs0827", "--speeds", "900 rpm", "inf rpm"), "--speeds"),
        (("sweep", "ffs0827", "--speeds", "800 rpm", "900 rpm", "--steps", "1"), "--steps"),
        (("sweep", "ffs0827", "--speeds", "800 rpm", "900 rpm", "--rate", "-3"), "--rate"),
        (("simulate", "ffs0827", "--periods", "0"), "--periods"),
        (("simulate", "ffs0827", "--periods", "2.5"), "give a whole number from 1 to 100000"),
        (("simulate", "ffs0827", "--speed", "1e-9 rpm"), "from 1 rpm to 100000 rpm"),
        (("simulate", "ffs0827", "--impulse", "300"), "--impulse"),
        (("simulate", "ffs0827", "--impulse", "1 s: deck 300"), "--impulse"),
        (("simulate", "ffs0827", "--impulse", "1 s: main 1e99"), "--impulse = '1 s: main 1e99'"),
        (("simulate", "ffs0827", "--impulse", "-2 s: main 3"), "--impulse = '-2 s: main 3'"),
        (("sweep", "ffs0827", "--speeds", "800 rpm", "900 rpm", "--rate", "1,5"), "--rate = '1,5'"),
        (("sweep", "ffs0827", "--speeds", "800 rpm", "900 rpm", "--rate", "1e-9"), "at least 0.17"),
        (
            ("simulate", "ffs0827", "--impulse", "99 s: main 1"),
            "--impulse = '99 s: main 1': give a time before",
        ),
        (("simulate", "nothing-there"), "nothing-there"),
        (("simulate", "ffs0827", "--speed", "1e99 rpm"), "from 1 rpm to 100000 rpm"),
        (("orbits", "ffs0827", "--speed", "1e99 rpm"), "from 1 rpm to 100000 rpm"),
        (("basins", "ffs0827", "--speed", "1e99 rpm"), "from 1 rpm to 100000 rpm"),
        (("sweep", "ffs0827", "--speeds", "1 rpm", "1e9 rpm"), "no screen runs above"),
    ],
)
def test_bad_input_is_one_sentence(command, arguments, field):
    code, out, err = command(*arguments)
    assert code == 2, out + err
    assert field in err
    assert len(err.strip().splitlines()) == 1
