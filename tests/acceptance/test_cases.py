"""``--case NAME``: a command looks at one load case, and what it writes says which."""

from __future__ import annotations

import dataclasses
import json
import re

import pytest

import flipflow as ff
from flipflow.model.numerals import case_words
from flipflow.report.html import html
from flipflow.report.registry import blocks_of
from flipflow.studies.allowed_range import allowed_range

DATE = r"20\d\d-[01]\d-[0-3]\d"
FULL = "full, stiffening"
COMMANDS = {
    "orbits": ("orbits", "ffs0827", "--max-periods", "1"),
    "simulate": ("simulate", "ffs0827", "--periods", "30"),
    "sweep": ("sweep", "ffs0827", "--speeds", "800 rpm", "850 rpm", "--steps", "3"),
    "basins": ("basins", "ffs0827", "--cells", "3"),
    "startup": ("startup", "ffs0827", "--duration", "3 s"),
    "sensitivity": ("sensitivity", "ffs0827", "--vary", "clearance=5.4 mm..6.6 mm", "--n", "4"),
}


@pytest.fixture(scope="module")
def project():
    return ff.load_project("ffs0827")


@pytest.fixture
def run(command, monkeypatch, tmp_path):
    """Run a command for a load case, writing into a folder; its words, document and pages."""
    monkeypatch.chdir(tmp_path)

    def of(name, case):
        document = tmp_path / "found.json"
        options = ("--case", case, "-o", ".", "--json", document.name)
        code, out, err = command(*COMMANDS[name], *options)
        assert code == 0, err
        pages = [page.read_text(encoding="utf-8") for page in tmp_path.glob("*.html")]
        assert pages
        return out, json.loads(document.read_text(encoding="utf-8")), pages

    return of


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_takes_a_case_and_says_so(run, name):
    out, document, pages = run(name, FULL)
    assert max(map(len, out.splitlines())) <= 80
    assert out.splitlines()[0].startswith(f"FFS0827, case {FULL}")
    assert document["name"] == f"FFS0827, case {FULL}"
    for page in pages:
        assert re.search(rf"<p>FFS0827, case {FULL}, revision A, {DATE}</p>", page)


@pytest.mark.parametrize("name", COMMANDS)
def test_an_unknown_case_ends_in_a_sentence_that_lists_them(command, name):
    code, _, err = command(*COMMANDS[name], "--case", "half full")
    assert code == 2
    for known in ("'empty'", f"'{FULL}'", "'full, carried mass'", "'hot'"):
        assert known in err
    assert err.count("\n") == 1


def test_the_case_changes_the_machine(command, project):
    loaded = project.screen.loaded(project.load_cases[1])
    _, out, _ = command("orbits", "ffs0827", "--case", FULL, "--max-periods", "1", "--json", "-")
    (found,) = json.loads(out)["orbits"]
    (expected,) = ff.periodic_orbits(loaded, project.speed)
    assert found["machine"]["shear_stiffness"] == pytest.approx(1.3 * 2.7e6)
    assert found["amplitude"]["relative"] == pytest.approx(expected.amplitude("relative"), rel=1e-9)


def test_without_a_case_the_empty_machine_is_named(command, tmp_path):
    command(*COMMANDS["orbits"], "-o", str(tmp_path))
    page = (tmp_path / "motion-1.html").read_text(encoding="utf-8")
    assert re.search(rf"<p>FFS0827, empty machine, revision A, {DATE}</p>", page)


def test_the_ends_of_the_allowed_range_name_their_case(project):
    unlimited = dataclasses.replace(project, limits=ff.Limits(), load_cases=project.load_cases[1:2])
    words = allowed_range(ff.assess(unlimited).region)
    assert "from contact begins (w_cs, empty machine) to jump when" in words
    assert words.endswith("(w_lb, empty machine).")


@pytest.mark.usefixtures("analysed_once")
def test_a_case_called_case_has_the_word_once(project, analysed):
    """Fault seen in a report: "case case 29"."""
    loads = tuple(ff.Load(name=f"case {k}", stiffness_factor=1.0 + 0.1 * k) for k in range(28, 31))
    found = analysed(dataclasses.replace(project, load_cases=loads))
    page = html(found)
    assert "(case 28)" in page
    assert not re.search("case case", page, re.IGNORECASE)
    compared = blocks_of(ff.compare([found.project, found.project]))
    assert "case case" not in repr(compared).lower()


@pytest.mark.parametrize(
    ("name", "words"),
    [("hot", "case hot"), ("case 29", "case 29"), ("Load case 3", "Load case 3"),
     ("casehardened", "case casehardened"), ("Fall 4", "case Fall 4")],
)  # fmt: skip
def test_words_for_a_case(name, words):
    assert case_words(name) == words
    assert case_words(name, capital=True) == words[0].upper() + words[1:]
