"""The command line: check, new, schema, version, and how quickly help is there."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from flipflow import __version__
from flipflow.cli import main as cli
from flipflow.io.source import bundled_names
from flipflow.model.limits import PASSING_FIELDS


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["flipflow", *arguments])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        captured = capsys.readouterr()
        return ended.value.code or 0, captured.out, captured.err

    return call


@pytest.mark.parametrize("name", ["ffs0827", "ffs0827-linear"])
def test_check_fits_80_columns(run, name):
    code, out, err = run("check", name)
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80


def test_check_shows_values_speeds_and_sources(run):
    _, out, _ = run("check", "ffs0827")
    assert "4168.25 kg mm" in out
    assert "4.16825 kg m" in out
    assert "631.5  10.524   66.125" in out
    assert "891.2  14.853   93.326" in out
    assert "assumed for demonstration" in out


def test_check_json_to_stdout_is_only_json(run):
    code, out, _ = run("check", "ffs0827", "--json", "-")
    document = json.loads(out)
    assert code == 0
    assert document["schema"] == "flipflow/check/1"
    assert document["values"][0]["si"] == [916.0]


def test_check_json_to_a_file(run, tmp_path):
    _, out, _ = run("check", "ffs0827-linear", "--json", "check.json")
    assert "natural frequency" in out
    assert json.loads((tmp_path / "check.json").read_text(encoding="utf-8"))["name"]


def test_brackets_in_a_file_are_text(run, tmp_path):
    run("new", "a.toml")
    text = (tmp_path / "a.toml").read_text(encoding="utf-8")
    text = text.replace('"My screen"', '"[bold]Screen[/nothing]"')
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    assert "[bold]Screen[/nothing]" in run("check", "a.toml")[1]


def test_new_writes_a_file_that_checks_and_never_overwrites(run, tmp_path):
    assert run("new", "a.toml")[0] == 0
    before = (tmp_path / "a.toml").read_bytes()
    code, out, _ = run("check", "a.toml")
    assert code == 0
    assert "the file is complete" in out
    code, _, err = run("new", "a.toml")
    assert code == 2
    assert "not overwritten" in err
    assert (tmp_path / "a.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "code", "word"), [("a.txt", 2, ".toml"), ("no/folder.toml", 4, "written")]
)
def test_new_refuses(run, name, code, word):
    found, _, err = run("new", name)
    assert found == code
    assert word in err
    assert "Traceback" not in err


def test_schema(run, tmp_path):
    code, out, _ = run("schema")
    assert code == 0
    assert json.loads(out)["title"] == "flipflow machine file"
    run("schema", "--json", "schema.json")
    assert json.loads((tmp_path / "schema.json").read_text(encoding="utf-8")) == json.loads(out)


def test_version(run):
    assert run("--version") == (0, f"flipflow {__version__}\n", "")


def test_nothing_asked_shows_help(run):
    code, out, err = run()
    assert code == 2
    assert "check" in out + err


def test_interrupt_ends_with_130(run, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("flipflow.io.project.load_project", interrupted)
    assert run("check", "ffs0827")[0] == 130


def test_help_loads_nothing_heavy():
    """Seconds depend on the machine that runs the test; what is imported does not."""
    code = (
        "import sys; from flipflow.cli.app import app; "
        "heavy = {'numpy', 'scipy', 'numba', 'xarray', 'pint', 'rich', 'plotly'}; "
        "print(sorted(heavy & set(sys.modules)))"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "[]"


def test_a_check_without_warm_air_calculates_nothing():
    """What solves for motions, and compiles, is loaded where rubber is to be warmed."""
    code = (
        "import sys; from flipflow.io.project import load_project; "
        "from flipflow.io.check import check_project; check_project(load_project('ffs0827')); "
        "print('numba' in sys.modules)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "False"


def test_values_without_a_source_are_counted_and_grouped(run, tmp_path):
    run("new", "a.toml")
    lines = (tmp_path / "a.toml").read_text(encoding="utf-8").split("[sources]")[0]
    (tmp_path / "a.toml").write_text(lines, encoding="utf-8")
    _, out, _ = run("check", "a.toml")
    assert max(map(len, out.splitlines())) <= 80
    words = " ".join(out.split("Sources")[1].split())
    assert "no source given for " in words
    assert "frames (main_mass, floating_mass" in words
    count = int(words.split("no source given for ")[1].split()[0])
    document = json.loads(run("check", "a.toml", "--json", "-")[1])
    assert count == len(document["values"]) + len(document["load_cases"])


def test_limits_on_the_way_stand_with_their_names(run):
    run("new", "a.toml")
    _, out, _ = run("check", "a.toml")
    for passage, fields in PASSING_FIELDS.items():
        rows = out.split(f"[limits.{passage}]")[1].splitlines()[1:]
        assert rows[0].split()[0] in {field.name for field in fields}


@pytest.mark.parametrize("command", ["analyze", "check"])
def test_help_and_readme_name_every_bundled_machine(run, command):
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    _, out, _ = run(command, "--help")
    for name in bundled_names():
        assert name in out.replace("-\n", "-").split() or f"{name}," in out
        assert f"`{name}`" in readme
