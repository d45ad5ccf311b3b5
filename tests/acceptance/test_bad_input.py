"""Every bad input ends in one sentence that names field, value and remedy, and in exit code 2."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from flipflow.cli.main import main

# Commands that read a machine file as their first argument, and what else they must be told.
COMMANDS = {
    "check": (),
    "analyze": (),
    "sensitivity": ("--vary", "floating_mass=+-5 %", "--n", "2"),
}

GOOD = (
    (Path(__file__).parents[2] / "src/flipflow/io/machines/ffs0827.toml")
    .read_text(encoding="utf-8")
    .split("\n[sources]\n")[0]
)


@pytest.fixture(params=COMMANDS)
def run(request, capsys, monkeypatch, tmp_path):
    """Run a command in a folder of its own; return exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    needed = COMMANDS[request.param]

    def call(file, *options):
        monkeypatch.setattr(sys, "argv", ["flipflow", request.param, str(file), *needed, *options])
        with pytest.raises(SystemExit) as ended:
            main()
        captured = capsys.readouterr()
        return ended.value.code or 0, captured.out, captured.err

    return call


def assert_one_sentence(result, *words, code=2):
    ended, out, err = result
    assert ended == code, err
    assert out == ""
    assert "Traceback" not in err
    assert err.count("\n") == 1, err
    assert err.startswith("Error: ")
    assert err.endswith(".\n")
    for word in words:
        assert word in err, err


def changed(old, new):
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)


# Name -> (text to replace, its replacement, words the sentence must hold).
VALUES = {
    "zero mass": ('"916 kg"', '"0 kg"', ("frames.main_mass", "'0 kg'", "above 0")),
    "negative mass": ('"310 kg"', '"-310 kg"', ("frames.floating_mass", "'-310 kg'", "above 0")),
    "negative damping": (
        'damping = "2.605 kN s/m"\npieces',
        'damping = "-2.605 kN s/m"\npieces',
        ("shear_springs.damping", "-2.605", "at least 0"),
    ),
    "negative clearance": ('"6 mm"', '"-6 mm"', ("stops.clearance", "'-6 mm'", "at least 0")),
    "negative speed": ('"850 rpm"', '"-850 rpm"', ("operation.speed", "'-850 rpm'", "above 0")),
    "zero speed": ('"850 rpm"', '"0 rpm"', ("operation.speed", "'0 rpm'", "above 0")),
    "unknown key": ("main_mass", "main_mas", ("frames.main_mas", "'916 kg'", "'main_mass'")),
    "unknown section": ("[operation]", "[operaton]", ("section", "[operaton]", "'operation'")),
    "unknown limit": ("stop_force", "stop_forze", ("limits.stop_forze", "'stop_force'")),
    "unknown law": ('"paper"', '"papr"', ("stops.law", "'papr'", "compression-only")),
    "unknown exciter": ('"circular"', '"linear"', ("exciter.type", "'linear'", "circular")),
    "wrong dimension": ('"916 kg"', '"916 kN/m"', ("frames.main_mass", "'916 kN/m'", "a mass")),
    "wrong dimension of a limit": ('"15 kN"', '"15 kW"', ("limits.stop_force", "'15 kW'", "force")),
    "unknown unit": ('"916 kg"', '"916 kilo"', ("frames.main_mass", "'916 kilo'", "kg")),
    "no unit": ('"916 kg"', '"916"', ("frames.main_mass", "'916'", "write the unit")),
    "bare number": ('"916 kg"', "916", ("frames.main_mass", "916", "write the unit")),
    "comma as decimal": ('"4168.25 kg mm"', '"4168,25 kg mm"', ("'4168,25 kg mm'", "a point")),
    "comma for thousands": ('"8100 kN/m"', '"8,100 kN/m"', ("stops.stiffness", "a point")),
    "text for a number": ('"916 kg"', '"heavy"', ("frames.main_mass", "'heavy'", "'1000 kg'")),
    "boolean for a number": ('"916 kg"', "true", ("frames.main_mass = true:", "'1000 kg'")),
    "list for a number": ('"916 kg"', '["916 kg"]', ("frames.main_mass", "'1000 kg'")),
    "date for a number": ('"916 kg"', "2024-01-01", ("frames.main_mass", "'1000 kg'")),
    "text for a count": ("pieces = 12", 'pieces = "12"', ("pieces", "'12'", "without quotes")),
    "boolean for a count": ("pieces = 12", "pieces = true", ("true: write a whole number, for",)),
    "broken count": ("pieces = 12", "pieces = 12.5", ("pieces", "12.5", "whole number")),
    "no pieces": ("pieces = 12", "pieces = 0", ("shear_springs.pieces", "0", "at least 1")),
    "huge count": ("pieces = 12", f"pieces = 1{'0' * 400}", ("pieces", "finite")),
    "not a number": ("pieces = 12", "pieces = nan", ("shear_springs.pieces", "nan", "finite")),
    "infinite mass": ('"916 kg"', '"inf"', ("frames.main_mass", "'inf'", "'1000 kg'")),
    "overflow": ('"916 kg"', '"1e999 kg"', ("frames.main_mass", "'1e999 kg'", "finite")),
    "pieces against a total": (
        "pieces = 12",
        'pieces = 12\nstiffness_each = "200 kN/m"',
        ("shear_springs.stiffness", "'2700 kN/m'", "2400 kN/m"),
    ),
    "supports against a total": (
        "supports = 4",
        'supports = 4\ndamping_each = "3 kN s/m"',
        ("isolation.damping", "'9.866 kN s/m'", "12 kN s/m"),
    ),
    "stop pieces against a total": (
        "pieces_per_side = 4",
        'pieces_per_side = 4\nstiffness_each = "8100 kN/m"',
        ("stops.stiffness", "'8100 kN/m'", "32400 kN/m"),
    ),
    "pieces not counted": (
        "supports = 4",
        'stiffness_each = "157.5 kN/m"',
        ("isolation.stiffness_each", "isolation.pieces"),
    ),
    "missing mass": ('main_mass = "916 kg"', "", ("frames.main_mass", "(left out)", "'1000 kg'")),
    "missing gap": ('clearance = "6 mm"', "", ("stops.clearance", "(left out)", "gap")),
    "reversed limit": (
        '["5 mm", "8 mm"]', '["8 mm", "5 mm"]', ("limits.relative_amplitude", "'8 mm'", "lesser"),
    ),
    "half a limit": (
        '["5 mm", "8 mm"]',
        '"8 mm"',
        (
            "limits.relative_amplitude",
            "'8 mm'",
            'write for example relative_amplitude = ["4 mm", "8 mm"]',
            'or relative_amplitude = ["0 mm", "8 mm"] for at most 8 mm',
        ),
    ),
    "half a limit on speed": (
        '["600 rpm", "1000 rpm"]',
        '"1000 rpm"',
        ("limits.speed", "'1000 rpm'", 'speed = ["0 rpm", "1000 rpm"] for at most 1000 rpm'),
    ),
    "a limit that is no pair": (
        '["5 mm", "8 mm"]', '"small"', ("limits.relative_amplitude", "'small'", '["4 mm", "8 mm"]'),
    ),
    "margin above one": ('jump_margin = "20 %"', 'jump_margin = "120 %"', ("limits.jump_margin",)),
    "temperature beyond the table": (
        'temperature = "50 degC"',
        'temperature = "80 degC"',
        ("load case 4", "'80 degC'", "50 degC"),
    ),
    "temperatures out of order": ('["50 degC", 0.85]', '["5 degC", 0.85]', ("rising order",)),
    "case without a name": ('name = "hot"', "", ("load case 4, name", "(left out)")),
    "case named twice": ('name = "hot"', 'name = "empty"', ("load case 4, name", "'empty'")),
    "unknown key in a case": ("temperature =", "temprature =", ("load case 4", "'temperature'")),
    "split beyond one": ("[0.5, 0.5]", "[0.5, 0.6]", ("split_main_floating", "[0.5, 0.6]")),
    "material of no dimension": ('"30 kg/m^2"', '"30 m"', ("load case 3, material", "'30 m'")),
    "area left out": ('deck_area = "2.16 m^2"', "", ("'30 kg/m^2'", "frames.deck_area")),
    "case in single brackets": (
        GOOD[GOOD.index("[[load_cases]]") :],
        '[load_cases]\nname = "empty"',
        ("load_cases", "[[load_cases]]"),
    ),
    "section as a value": ("format = 1", "format = 1\nsources = 3", ("sources = 3", "[sources]")),
    "other format": ("format = 1", "format = 99", ("format = 99", "format = 1")),
    "text in the title": ('customer = ""', "customer = 5", ("document.customer = 5", "quotes")),
    "clearance of 6 m": ('"6 mm"', '"6 m"', ("stops.clearance", "'6 m'", "looks wrong", "--force")),
    "kN read as N": (
        '"2700 kN/m"', '"2700 N/m"', ("shear_springs.stiffness", "'2700 N/m'", "looks wrong"),
    ),
    "kg m for kg mm": (
        '"4168.25 kg mm"', '"4168.25 kg m"', ("exciter.eccentric_moment", "looks wrong", "--force"),
    ),
    "Hz for rpm": ('"850 rpm"', '"850 Hz"', ("operation.speed", "'850 Hz'", "looks wrong")),
    "quantity without quotes": ('"916 kg"', "916 kg", ("line 16", "916 kg", "quotes")),
    "quote left open": ('"916 kg"', '"916 kg', ("line 16", "not valid TOML")),
    "line break in a key": ('drawing = ""', '"a\\nb" = ""', ("document.a\\nb", "not known")),
    "key given twice": ('drawing = ""', 'project = ""', ("project", "not valid TOML")),
}  # fmt: skip

SLIPS = ("clearance of 6 m", "kN read as N", "kg m for kg mm", "Hz for rpm")


@pytest.mark.parametrize("name", VALUES)
def test_value(run, tmp_path, name):
    old, new, words = VALUES[name]
    (tmp_path / "machine.toml").write_text(changed(old, new), encoding="utf-8")
    assert_one_sentence(run("machine.toml"), *words)


@pytest.mark.parametrize("name", SLIPS)
def test_force_lets_slips_through_with_a_warning(run, tmp_path, name):
    old, new, _ = VALUES[name]
    text, case, _ = changed(old, new).partition("[[load_cases]]")
    if name == "Hz for rpm":  # blows upon stops and a start take long at 51,000 rpm
        text = re.sub(r"\[stops\][^\n]*\n[^[]*", "", text).replace('"850 Hz"', '"85 Hz"')
    (tmp_path / "machine.toml").write_text(f'{text}{case}\nname = "empty"\n', encoding="utf-8")
    code, out, err = run("machine.toml", "--force")
    assert code == 0, err
    assert "looks wrong" in re.sub(r"\s+", " ", out + err)


@pytest.mark.parametrize("name", sorted(set(VALUES) - set(SLIPS)))
def test_force_lets_nothing_else_through(run, tmp_path, name):
    old, new, words = VALUES[name]
    (tmp_path / "machine.toml").write_text(changed(old, new), encoding="utf-8")
    assert_one_sentence(run("machine.toml", "--force"), *words)


def test_missing_file_names_what_is_bundled(run):
    assert_one_sentence(run("nowhere.toml"), "nowhere.toml", "ffs0827")
    assert_one_sentence(run("ffs0872"), "ffs0872", "did you mean 'ffs0827'")


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("[duty]", "this is a duty file, which flipflow design reads"),
        ("[vary]", "this is a study file, which flipflow study reads"),
    ],
)
def test_a_file_of_another_command(command, tmp_path, section, words):
    path = tmp_path / "other.toml"
    path.write_text(f'machine = "ffs0827"\n{section}\n')
    code, _, err = command("check", str(path))
    assert (code, err) == (2, f"Error: section = '{section}': {words}.\n")


@pytest.mark.parametrize(("order", "kind"), [("study", "study"), ("design", "duty")])
def test_a_machine_where_another_file_is_asked(command, order, kind):
    code, _, err = command(order, "ffs0827")
    told = f'this is a machine file; name it in a {kind} file, machine = "..."'
    assert (code, err) == (2, f"Error: section = '[frames]': {told}.\n")


def test_folder(run, tmp_path):
    result = run(tmp_path)
    assert_one_sentence(result, "machine file", "folder")
    assert result[2].count("machine file =") == 1


@pytest.mark.parametrize("content", [b"", b" \n\t\n", b"\xef\xbb\xbf"])
def test_empty_file(run, tmp_path, content):
    (tmp_path / "empty.toml").write_bytes(content)
    assert_one_sentence(run("empty.toml"), "empty.toml", "flipflow new")


def test_comments_only(run, tmp_path):
    (tmp_path / "comments.toml").write_text("# nothing\n", encoding="utf-8")
    assert_one_sentence(run("comments.toml"), "frames.main_mass", "(left out)")


def test_file_of_100_mb_is_not_read(run, tmp_path, monkeypatch):
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(100_000_000)
    monkeypatch.setattr(Path, "read_bytes", lambda _: pytest.fail("the file was read"))
    assert_one_sentence(run("large.toml"), "large.toml", "100 MB", "at most 1 MB")


def test_not_utf8(run, tmp_path):
    (tmp_path / "latin.toml").write_bytes(b"format = 1\n# M\xfcller\n")
    assert_one_sentence(run("latin.toml"), "latin.toml", "line 2", "UTF-8")


def test_deep_nesting(run, tmp_path):
    (tmp_path / "deep.toml").write_text("a = " + "[" * 100_000, encoding="utf-8")
    assert_one_sentence(run("deep.toml"), "deep.toml")


def test_null_in_the_path(run):
    assert_one_sentence(run("a\0b"), "machine file", "cannot be read")


@pytest.mark.skipif(
    os.name == "nt" or os.geteuid() == 0, reason="needs a file that may not be read"
)
def test_unreadable_file(run, tmp_path):
    (tmp_path / "secret.toml").write_text(GOOD, encoding="utf-8")
    (tmp_path / "secret.toml").chmod(0)
    assert_one_sentence(run("secret.toml"), "secret.toml", "cannot be read")


def test_json_that_cannot_be_written(run):
    """What cannot be written is the store's error, whichever file it is."""
    ended = run("ffs0827", "--json", "no/such/folder/x.json")
    assert_one_sentence(ended, "--json", "x.json", code=4)


def test_usage_errors_end_with_2(run):
    code, _, err = run("ffs0827", "--forse")
    assert code == 2
    assert "--force" in err
    assert "Traceback" not in err


def test_the_installed_command_ends_the_same_way(tmp_path):
    """The console script itself, in a process of its own."""
    (tmp_path / "machine.toml").write_text(changed('"916 kg"', '"0 kg"'), encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, "-m", "flipflow.cli.main", "check", "machine.toml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert_one_sentence((ended.returncode, ended.stdout, ended.stderr), "frames.main_mass")
