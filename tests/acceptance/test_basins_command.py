"""``flipflow basins``: answer, bad words, and Ctrl-C that loses nothing."""

from __future__ import annotations

import json
import os
import signal

import pytest

import flipflow as ff
from flipflow.cli.progress import stoppable
from flipflow.errors import Cancelled, IncompleteError


def test_command_line(command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    words = ("basins", "ffs0827", "--speed", "203 rad/s", "--cells", 20, "-o", "out")
    code, out, _ = command(*words, "--json", "basins.json")
    assert code == 0
    lines = out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith("FFS0827 at 1939 rpm (32.31 Hz, 203 rad/s): 2 motions")
    text = " ".join(line.strip() for line in lines)
    assert "39.2 mm" in text
    assert "kg m/s" in text
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "basins.html", "basins.json",
    ]  # fmt: skip
    document = json.loads((tmp_path / "basins.json").read_text())
    assert document["schema"] == "flipflow/basins/1"
    assert document["jump_risk"]["impulse"]["impulse"] > 0


@pytest.mark.parametrize(
    "words",
    [
        ("--speed", "203 kg"),
        ("--speed", "-3 rpm"),
        ("--speed", "203 rad/s", "--cells", "0"),
        ("--speed", "203 rad/s", "--cells", "100000"),
    ],
)
def test_command_line_refuses_with_one_sentence(command, monkeypatch, tmp_path, words):
    monkeypatch.chdir(tmp_path)
    code, _, err = command("basins", "ffs0827", *words)
    assert code == 2
    assert err.startswith("Error: ")
    assert err.count("\n") == 1


# Frames that rattle between hard stops a tenth of a millimetre away, with hardly any damping.


def test_a_machine_without_motions_is_told_in_a_sentence(command, monkeypatch, tmp_path):
    """Whether a rattling machine's motions are found hangs on rounding: here none are."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("flipflow.studies.periodic_orbits.periodic_orbits", lambda *_: ())
    code, out, err = command("basins", "ffs0827", "--speed", "300 rpm", "--cells", "4")
    assert (code, out) == (3, "")
    assert err.startswith("Error: No motion that repeats itself was found at 300 rpm")
    assert err.count("\n") == 1


def test_basins_are_kept_where_there_is_no_jump_risk(command, monkeypatch, tmp_path):
    def on_the_edge(*_words, **_options):
        raise IncompleteError("It stands on the edge of a jump.")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("flipflow.studies.jump_risk.jump_risk", on_the_edge)
    code, out, _ = command("basins", "ffs0827-linear", "--cells", "2")
    assert code == 0
    assert "Note: No jump risk: It stands on the edge of a jump." in out
    document = json.loads((tmp_path / "ffs0827-linear-flipflow" / "basins.json").read_text())
    assert document["jump_risk"] is None


def test_interrupt_keeps_cells_and_ends_other_stages():
    """Ctrl-C while cells run becomes Cancelled at the next word; elsewhere it ends the program."""
    before = signal.getsignal(signal.SIGINT)
    with stoppable(lambda _sentence, _share: None, "cells") as told:
        told("cells", 0.1)
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(Cancelled):
            told("cells", 0.2)
    with stoppable(lambda _sentence, _share: None, "cells") as told:
        told("motions", 0.0)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_interrupted_command_writes_what_it_has(command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    run_cells = ff.basins

    def interrupted(*given, monitor, **options):
        def told(sentence, share):
            if sentence == "cells" and share > 0.3:
                os.kill(os.getpid(), signal.SIGINT)
            monitor(sentence, share)

        return run_cells(*given, monitor=told, **options)

    monkeypatch.setattr("flipflow.studies.basins.basins", interrupted)
    code, _, err = command("basins", "ffs0827", "--speed", "203 rad/s", "-o", "out")
    assert code == 130
    assert "Stopped by the user" in err
    document = json.loads((tmp_path / "out" / "basins.json").read_text())
    assert not document["complete"]
    assert document["jump_risk"] is None
