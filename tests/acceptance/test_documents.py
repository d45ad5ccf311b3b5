"""Documents: those of every command open again, old ones still do, damaged ones say so."""

from __future__ import annotations

import copy
import gzip
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import StoreError
from flipflow.io.check import Check
from flipflow.io.command_results import Startup, Sweeps
from flipflow.io.results import SCHEMAS
from flipflow.paper.reproduce import Reproduction
from flipflow.studies.assessment import Assessment
from flipflow.studies.basins import Basins
from flipflow.studies.compare import Comparison
from flipflow.studies.design import Proposal
from flipflow.studies.jump_risk import JumpRisk
from flipflow.studies.sensitivity import Sensitivity
from flipflow.studies.study import Study
from flipflow.transient.history import History

OLD = Path(__file__).parents[1] / "documents"
NAMES = sorted(path.name.removesuffix(".json.gz") for path in OLD.glob("*.gz"))
NEVER_OPENED = "summary"


def old_document(name: str) -> dict[str, Any]:
    return json.loads(gzip.decompress((OLD / f"{name}.json.gz").read_bytes()))


def opened(document: object, folder: Path) -> Any:
    (folder / "document.json").write_text(json.dumps(document))
    return ff.open_result(folder / "document.json")


@pytest.mark.parametrize("name", sorted(set(NAMES) - {NEVER_OPENED}))
def test_an_old_document_opens_and_says_what_it_said(tmp_path, name):
    before = old_document(name)
    result = opened(before, tmp_path)
    assert isinstance(result, tuple) or SCHEMAS[type(result)] == before["schema"]
    ff.save(result, tmp_path / "again.json")
    after = json.loads((tmp_path / "again.json").read_text())
    assert_holds(after, before, name)


def test_an_old_document_of_every_kind_is_tried():
    """A new kind has no old documents; once it is released, one is put beside these."""
    schemas = {old_document(name)["schema"] for name in NAMES}
    assert schemas >= set(SCHEMAS.values()) | {"flipflow/orbits/1"}


# Estimates near rounding, the version that wrote, and what a command puts beside a result.
OTHERWISE = {"error", "version", "jump_risk"}


def assert_holds(after: Any, before: Any, where: str) -> None:
    """What an old document said stands in the new one; numbers worked out anew are close."""
    if isinstance(before, dict):
        for key in before.keys() - OTHERWISE:
            assert key in after, f"{where}.{key}"
            assert_holds(after[key], before[key], f"{where}.{key}")
    elif isinstance(before, list) and before and named(before[0]):
        # Rows of a table that go by name: a new quantity is one row more.
        rows = {named(one): one for one in after}
        for one in before:
            assert named(one) in rows, f"{where}, {named(one)}"
            assert_holds(rows[named(one)], one, f"{where}, {named(one)}")
    elif isinstance(before, list) and before and isinstance(before[0], (list, dict)):
        for one, other in zip(after, before, strict=True):
            assert_holds(one, other, where)
    elif isinstance(before, list) and all(type(x) in (int, float) for x in before):
        np.testing.assert_allclose(after, before, rtol=1e-9, atol=1e-12, err_msg=where)
    elif isinstance(before, float):
        assert after == pytest.approx(before, rel=1e-9, abs=1e-12), where
    else:
        assert after == before, where


def named(row: Any) -> tuple[str, str] | None:
    """Quantity and load case by which a row of a comparison goes."""
    return (
        (row["name"], row["case"])
        if isinstance(row, dict) and {"name", "case"} <= row.keys()
        else None
    )


LINEAR = "ffs0827-linear"
SMALL = str(Path(__file__).parents[1] / "machines" / "small.toml")
COMMANDS = {
    "analyze": (Assessment, SMALL, "--speeds", "800 rpm", "802 rpm"),
    "basins": (Basins, LINEAR, "--cells", "2"),
    "check": (Check, LINEAR),
    "compare": (Comparison, SMALL, SMALL, "--speed", "800 rpm"),
    "design": (Proposal, "duty.toml", "--generations", "1"),
    "orbits": (tuple, LINEAR, "--max-periods", "1"),
    "reproduce": (Reproduction, "1"),
    "sensitivity": (Sensitivity, LINEAR, "--vary", "floating_mass=+-5 %", "--n", "2"),
    "simulate": (History, LINEAR, "--periods", "2"),
    "startup": (Startup, LINEAR, "--profile", "0 s: 0 rpm, 0.3 s: 300 rpm"),
    "study": (Study, "study.toml"),
    "sweep": (Sweeps, LINEAR, "--speeds", "800 rpm", "802 rpm", "--steps", "2", "--rate", "60"),
}
STUDY = f"""
machine = "{LINEAR}"
[vary]
floating_mass = ["300 kg", "310 kg"]
[study]
quantities = ["relative_amplitude"]
speed = "800 rpm"
"""
DUTY = f"""
machine = "{LINEAR}"
[duty]
relative_amplitude = "6 mm"
tolerance = "3 mm"
speed = "700 rpm"
load_cases = ["empty"]
[free]
shear_stiffness = "2500 kN/m..2900 kN/m"
"""
NO_RESULT = {"new", "schema"}
NAMED = {"basins", "orbits", "sensitivity", "simulate", "study"}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_document_of_a_command_opens_as_what_was_found(command, monkeypatch, tmp_path, name):
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(STUDY)
    Path("duty.toml").write_text(DUTY)
    kind, *words = COMMANDS[name]
    code, _, err = command(name, *words, "--json", "found.json")
    assert code == 0, err
    found = ff.open_result("found.json")
    assert isinstance(found, kind)
    ff.save(found, "again.json")
    written = [json.loads(Path(file).read_text()) for file in ("found.json", "again.json")]
    if name == "basins":  # the jump risk is a second result, beside the basins in one file
        risk = written[0].pop("jump_risk")
        assert risk is None or isinstance(opened(risk, tmp_path), JumpRisk)
    if name in NAMED:  # what the machine is called stands beside the result
        assert written[0].pop("name")
    assert written[0] == written[1]


def test_every_command_with_a_document_is_tried():
    from flipflow.cli.app import COMMANDS as ALL  # noqa: PLC0415  the command line is slow to load

    assert {one.__name__ for one in ALL} - NO_RESULT == set(COMMANDS)


BAD = (
    None, True, 0, -1, 1.5, 1e308, 10**400, "x", "inf", "\udc80", [], {}, [[]], [1, "x"],
    {"a": 1}, [[1], [2, 3]], {"shape": [10**12, 10**12]}, {"shape": "x"},
)  # fmt: skip
MISSING = object()


def spoilt(document: Any, place: tuple[Any, ...], value: object) -> Any:
    """The document with another value in a place, or without it."""
    changed = copy.copy(document)
    if len(place) > 1:
        changed[place[0]] = spoilt(document[place[0]], place[1:], value)
    elif value is MISSING:
        del changed[place[0]]
    else:
        changed[place[0]] = value
    return changed


def places(document: object, most: int = 4) -> Iterator[tuple[Any, ...]]:
    """Where something stands in a document: of lists the first member."""
    inner: dict[Any, Any] = document if isinstance(document, dict) else {}
    if isinstance(document, list) and document:
        inner = {0: document[0]}
    for key, part in inner.items():
        yield (key,)
        if most > 1:
            yield from ((key, *rest) for rest in places(part, most - 1))


@pytest.mark.parametrize("name", sorted(set(NAMES) - {NEVER_OPENED}))
def test_a_spoilt_document_opens_or_says_what_is_wrong(tmp_path, name):
    """Any value of a document may be of another type, too large, or missing."""
    document, rng = old_document(name), np.random.default_rng(len(name))
    where = [(place, bad) for place in places(document) for bad in (*BAD, MISSING)]
    refused = []
    for k in rng.permutation(len(where))[:12]:  # of thousands in benchmarks/long_fuzz.py
        place, bad = where[k]
        try:
            assert repr(opened(spoilt(document, place, bad), tmp_path))
        except StoreError as error:
            refused.append(str(error))
    assert refused
    assert all("\n" not in sentence and len(sentence) < 600 for sentence in refused)


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"schema": "flipflow/branch/1", "machine": ' + "[" * 100_000 + "]" * 100_000 + "}",
        '{"schema": "flipflow/orbit/1", "omega": ' + "9" * 5000 + "}",
        '{"schema": "flipflow/orbit/1", "omega": ',
        '{"schema": "flipflow/claims/1", "whole": 3}',
        '{"schema": "flipflow/orbits/1", "orbits": {"a": 1}}',
        '{"schema": "flipflow/basins/1", "rows": NaN}',
        '{"schema": "flipflow/\\ud800/1"}',
        "\ufeff{}",
        "",
    ],
    ids=range(10),
)
def test_a_hostile_document_is_refused_in_a_sentence(tmp_path, text):
    (tmp_path / "x.json").write_text(text, encoding="utf-8")
    with pytest.raises(StoreError) as caught:
        ff.open_result(tmp_path / "x.json")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_a_document_cut_off_anywhere_is_refused(tmp_path):
    text = json.dumps(old_document("sweep"))
    for share in np.linspace(0.0, 0.99, 40):
        (tmp_path / "x.json").write_text(text[: int(share * len(text))])
        with pytest.raises(StoreError, match="cannot be read as a result"):
            ff.open_result(tmp_path / "x.json")


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "x.json").write_bytes(b'{"schema": "\xff\xfe"}')
    with pytest.raises(StoreError, match="cannot be read as a result"):
        ff.open_result(tmp_path / "x.json")


def test_names_of_half_a_surrogate_survive(tmp_path):
    loading = ff.loading(ff.load("ffs0827"), ff.Load(name="na\u00df \udc80"), omega=(85.0, 90.0))
    ff.save(loading, tmp_path / "x.json")
    assert "na\u00df \\udc80" in (tmp_path / "x.json").read_text(encoding="utf-8")
    assert ff.open_result(tmp_path / "x.json").load.name == loading.load.name
