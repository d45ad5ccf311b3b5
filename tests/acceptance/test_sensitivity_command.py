"""``flipflow sensitivity``: answer, bad words, Ctrl-C."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import flipflow as ff
from flipflow.plotting.sensitivity import changes
from flipflow.studies.sensitivity import OneAtATime


def test_command(command, tmp_path):
    words = (
        "ffs0827", "--vary", "clearance=5.4 mm..6.6 mm", "--vary", "frames.floating_mass=+-5 %",
        "--vary", "shear_stiffness=2700 kN/m +/- 90 kN/m", "--speed", "1100 rpm", "--n", "16",
        "--json", tmp_path / "s.json", "-o", tmp_path / "out",
    )  # fmt: skip
    code, out, _ = command("sensitivity", *words)
    assert code == 0
    assert max(map(len, out.replace(str(tmp_path), "").splitlines())) <= 80
    rows = [line for line in out.splitlines() if line.startswith(("clear", "float", "shear"))]
    assert rows[0].startswith("clearance")
    assert len(rows) == 3
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["results.json", "sensitivity.html", "tornado.html"]
    result = ff.open_result(tmp_path / "s.json")
    assert result.names == ("clearance", "floating_mass", "shear_stiffness")
    assert result.ends[1] == pytest.approx((294.5, 325.5))
    assert result.distributions[2] == ff.Normal(2.7e6, 9e4)


def test_what_is_rounding_is_no_change():
    """A gap that is not reached, whose ends differ in the last digit of the quantity alone."""
    value, lost = 43.2e3, 43.2e3 - 43.2e3 * (1.0 - 2.0**-52)
    one = OneAtATime(
        machine=ff.load("ffs0827"), quantity="stop_force", names=("clearance", "main_mass"),
        distributions=((5e-3, 6e-3), (900.0, 950.0)), omega=100.0, nominal=value,
        at_low=np.array([value, value - 5e3]), at_high=np.array([value - lost, value + 5e3]),
        own=(6e-3, 916.0),
    )  # fmt: skip
    low, high = changes(one, None)
    assert low == pytest.approx([0.0, -5.0])
    assert list(high) == [0.0, pytest.approx(5.0)]
    without = dataclasses.replace(one, nominal=np.inf)
    assert np.all(np.isneginf(changes(without, None)[0]))


def test_command_over_speeds_and_for_whole_responses(command):
    command_of = ("sensitivity", "ffs0827-linear", "--vary", "floating_mass=+-5 %", "--n", "16")
    words = (*command_of, "--json", "-")
    code, out, _ = command(*words, "--speeds", "300 rpm", "1000 rpm")
    assert code == 0
    document = json.loads(out)
    assert len(document["omega"]) == len(document["total"]) == 100
    code, out, _ = command(*words, "--quantity", "omega_ar")
    assert code == 0
    assert json.loads(out)["interval"] is True
    code, out, _ = command(*command_of, "--speeds", "300 rpm", "1000 rpm")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), ("--vary", "left out")),
        (("--vary", "clearance"), ("--vary", "5.4 mm..6.6 mm")),
        (("--vary", "clearance=5.4 mm"), ("--vary", "5.4 mm..6.6 mm")),
        (("--vary", "clearance=5,4 mm..6 mm"), ("--vary clearance", "no commas")),
        (("--vary", "clearance=5.4..6.6"), ("--vary clearance", "unit")),
        (("--vary", "clearance=6 mm..5 mm"), ("--vary = 'clearance=6 mm..5 mm'", "reversed")),
        (("--vary", "clearance=6 mm..6 mm"), ("--vary = 'clearance=6 mm..6 mm'", "empty")),
        (("--vary", "clearance=-6 mm..6 mm"), ("--vary = 'clearance=-6 mm..6 mm'", "at least 0")),
        (("--vary", "clearance=6 mm +/- 0 mm"), ("--vary = 'clearance=6 mm +/- 0 mm'", "above 0")),
        (("--vary", "bearings=+-50 %"), ("--vary = 'bearings=+-50 %'", "counted")),
        (("--vary", "clearance=+-5%", "--n", "1.5"), ("--n = '1.5'", "from 2")),
        (("--vary", "clearence=5 mm..6 mm"), ("'clearence'", "'clearance'")),
        (("--vary", "clearance=+-500 %"), ("between 0 % and 100 %",)),
        (("--vary", "clearance_minus=+-5 %"), ("no value to vary about",)),
        (("--vary", "clearance=+-5%", "--vary", "clearance=+-5%"), ("twice",)),
        (("--vary", "clearance=+-5%", "--quantity", "size"), ("quantity", "'size'")),
        (("--vary", "clearance=+-5%", "--n", "1"), ("--n = '1'", "from 2")),
        (("--vary", "clearance=+-5%", "--seed", "-1"), ("--seed = '-1'",)),
        (("--vary", "clearance=+-5%", "--speed", "850"), ("--speed", "unit")),
        (("--vary", "clearance=+-5%", "--speeds", "9 Hz", "5 Hz"), ("reversed",)),
        (("--vary", "clearance=+-5%", "--speed", "9 Hz", "--speeds", "5 Hz", "9 Hz"), ("--speed",)),
        (("--vary", "clearance=+-5%", "--branch", "middle"), ("branch", "from-below")),
    ],
)
def test_bad_words_at_the_command(command, options, words):
    code, out, err = command("sensitivity", "ffs0827", *options)
    assert code == 2
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("Error: ")
    for word in words:
        assert word in err


def test_command_is_cancelled_without_a_traceback(command, monkeypatch):
    def interrupted(*_args, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("flipflow.studies.sensitivity.sensitivity", interrupted)
    code, _, err = command("sensitivity", "ffs0827", "--vary", "clearance=+-5%")
    assert code == 130
    assert "Traceback" not in err
