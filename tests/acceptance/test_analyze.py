"""The main job as a user runs it: ``flipflow analyze`` from a machine file to a folder."""

from __future__ import annotations

import csv
import json
import subprocess
import sys

import pytest
import xarray as xr

from flipflow.cli.main import main


def run(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["flipflow", *map(str, words)])
    try:
        main()
    except SystemExit as ended:
        return ended.code or 0
    return 0


@pytest.fixture(scope="module")
def analyzed(tmp_path_factory):
    """One run in a process of its own: its output and its folder."""
    folder = tmp_path_factory.mktemp("analyze")
    done = subprocess.run(
        [sys.executable, "-m", "flipflow.cli.main", "analyze", "ffs0827", "-o", "out"],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done, folder / "out"


def test_summary_opens_with_the_verdict_within_80_columns(analyzed):
    done, _ = analyzed
    lines = done.stdout.splitlines()
    assert lines[0].startswith("850 rpm: all limits met in all cases; tightest: ")
    assert max(map(len, lines)) <= 80
    assert "Traceback" not in done.stderr


def test_folder_holds_report_and_data(analyzed):
    _, folder = analyzed
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["report.html", "response.csv", "response.nc", "results.json"]


def test_data_agree_with_each_other(analyzed):
    """The exact folds of the empty machine in JSON; as many points in NetCDF as in CSV."""
    _, folder = analyzed
    document = json.loads((folder / "results.json").read_text())
    assert document["schema"] == "flipflow/assessment/1"
    region = document["region"]
    assert region["omega_ub"] == pytest.approx(206.405559, abs=1e-6)
    assert region["omega_lb"] == pytest.approx(198.649272, abs=1e-6)
    assert region["omega_cs"] == pytest.approx(81.0637405, abs=1e-6)
    with (folder / "response.csv").open() as file:
        rows = list(csv.DictReader(file))
    with xr.open_dataset(folder / "response.nc") as table:
        assert table.sizes["point"] == len(rows)
        assert float(table.amplitude.sel(coordinate="relative").max()) == pytest.approx(
            max(float(row["amplitude_relative [m]"]) for row in rows)
        )


def test_feasible_window_is_inside_the_region_and_binds(analyzed):
    _, folder = analyzed
    region = json.loads((folder / "results.json").read_text())["region"]
    for (low, high), (below, above) in zip(region["feasible"], region["binding"], strict=True):
        assert region["lower"] <= low < high <= region["upper"]
        assert below["limit"] == "relative_amplitude"
        assert above["limit"] == "main_frame_acceleration"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--speeds", "0 rpm", "900 rpm"), ("--speeds = '0 rpm to 900 rpm'", "above 0")),
        (("--speeds", "15 Hz", "5 Hz"), ("--speeds = '15 Hz to 5 Hz'", "reversed")),
        (("--speeds", "300 rpm", "300 rpm"), ("--speeds = '300 rpm to 300 rpm'", "empty")),
        (("--speeds", "300 rpm", "1e9 rpm"), ("'300 rpm to 1e9 rpm'", "no screen runs above")),
        (("--speeds", "300", "900 rpm"), ("--speeds", "'300'")),
        (("--speeds", "2,5 Hz", "900 rpm"), ("--speeds", "'2,5 Hz'", "point")),
        (("--harmonics", "0"), ("--harmonics = '0'", "1 to 200")),
        (("--harmonics", "10000"), ("--harmonics = '10000'", "1 to 200")),
    ],
)
def test_bad_ranges_and_orders(monkeypatch, capsys, tmp_path, options, words):
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "analyze", "ffs0827", *options) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("Error: ")
    for word in words:
        assert word in captured.err
    assert not list(tmp_path.iterdir())


def test_output_folder_that_cannot_be_written(monkeypatch, capsys, tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert run(monkeypatch, "analyze", "ffs0827", "-o", tmp_path / "file" / "out") == 4
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert "--output" in captured.err
    assert "cannot be written" in captured.err


def test_no_damping_at_all_is_refused_with_the_reason(monkeypatch, capsys, tmp_path):
    source = tmp_path / "undamped.toml"
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "new", source) == 0
    text = source.read_text()
    lines = [
        line.split("=")[0] + '= "0 kN s/m"' if "damping =" in line else line
        for line in text.splitlines()
    ]
    source.write_text("\n".join(lines) + "\n")
    capsys.readouterr()
    assert run(monkeypatch, "analyze", source) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "damping" in error
    assert "never dies out" in error


def test_harmonic_balance_of_the_paper_on_request(monkeypatch, capsys, tmp_path):
    """Third order lies within 2e-3 rad/s of the reference values of its own folds."""
    words = ("--harmonics", "3", "-o", tmp_path / "out", "--json", "-")
    assert run(monkeypatch, "analyze", "ffs0827", *words) == 0
    region = json.loads(capsys.readouterr().out)["region"]
    assert region["omega_ub"] == pytest.approx(206.415, abs=2e-3)
    assert region["omega_lb"] == pytest.approx(198.661, abs=2e-3)
