"""The report in a real browser without network: it draws itself, complains of and asks for nothing.

Chromium logs every request it starts, and whether a page started it or the
browser for its own housekeeping. No name is resolved, so that nothing could be fetched anyway.
"""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess

import pytest

import flipflow as ff
from flipflow.report.blocks import FigureBlock
from flipflow.report.html import html
from flipflow.report.registry import blocks_of

CHROMIUM = shutil.which("chromium")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed"),
]
QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-first-run", "--disable-extensions",
    "--enable-logging=stderr", "--v=0", "--virtual-time-budget=10000",
    "--host-resolver-rules=MAP * ~NOTFOUND",
)  # fmt: skip
FILLED, FOOTER = 1 / 3, 0.97  # shares of a page's height
NO_PAGE = "not an origin"  # who asks, when the browser does so for itself


@pytest.fixture(scope="module")
def assessment(analysed):
    return analysed("ffs0827")


@pytest.fixture(scope="module")
def opened(assessment, tmp_path_factory):
    """The document after its scripts ran, the browser's messages, the addresses it asked for."""
    folder = tmp_path_factory.mktemp("browser")
    report = folder / "report.html"
    report.write_text(html(assessment), encoding="utf-8")
    return browse(report.as_uri(), folder)


def browse(address, folder):
    log = folder / "net.json"
    ran = subprocess.run(
        [CHROMIUM, *QUIET, f"--user-data-dir={folder / 'profile'}", f"--log-net-log={log}",
         "--dump-dom", address],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    return ran.stdout, ran.stderr, requests(json.loads(log.read_text(encoding="utf-8")))


def requests(log):
    """Addresses a page asked for, from a log of Chromium's network stack; files do not pass it."""
    kinds = {number: name for name, number in log["constants"]["logEventTypes"].items()}
    started = [
        event.get("params", {})
        for event in log["events"]
        if kinds[event["type"]] == "URL_REQUEST_START_JOB"
    ]
    return [one["url"] for one in started if "url" in one and one["initiator"] != NO_PAGE]


def test_every_figure_is_drawn(opened, assessment):
    dom, _, _ = opened
    wanted = sum(isinstance(block, FigureBlock) for block in blocks_of(assessment))
    assert wanted > 5
    assert len(re.findall(r"<div[^>]*data-figure[^>]*class=\"js-plotly-plot\"", dom)) == wanted
    assert len(re.findall(r'<svg class="main-svg"', dom)) >= wanted
    assert assessment.verdict in dom


def test_the_console_stays_silent(opened):
    _, messages, _ = opened
    said = [line for line in messages.splitlines() if "CONSOLE" in line]
    assert said == []


def test_nothing_is_asked_for(opened):
    _, _, asked = opened
    assert [url for url in asked if not url.startswith("data:")] == []


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="poppler-utils is not installed")
@pytest.mark.parametrize("count", [1, 4, 8])
def test_the_first_page_is_one_page(analysed, printed_page, count):
    """Printed on A4, page 1 ends with its last line however many load cases there are."""
    project = ff.load_project("ffs0827")
    more = (ff.Load(name=f"half full {k}", stiffness_factor=1.0 + 0.01 * k) for k in range(16))
    loads = (*project.load_cases, *more)[:count]
    assessed = analysed(dataclasses.replace(project, load_cases=loads))
    first, second = first_two(printed_page(assessed, begin=count != 4))
    assert "Power, throw dissipated power" in first
    assert second.startswith("The machine" if count <= 4 else "Load cases and notes")
    assert all(load.name in (first if count <= 4 else second) for load in loads)


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="poppler-utils is not installed")
@pytest.mark.parametrize("machine", ["ffs0827", "ffs0827-linear", "rig-lin2024"])
def test_printed_pages_are_filled(analysed, printed_page, machine):
    """A figure that does not fit leaves a hole, but no page ends in its upper part."""
    sheet = printed_page(analysed(machine))
    ends = [lowest(page) for page in read(sheet, "-bbox").split("</page>")[:-1]]
    assert len(ends) > 5
    assert min(ends[:-1]) > FILLED, ends
    first, second = first_two(sheet)
    assert "Into the ground" in first
    assert "Load case amplitude" in first or second.startswith("Load cases and notes")


def lowest(page):
    """Foot of the lowest word above the footer, as a share of the page's height."""
    height = float(re.search(r'<page [^>]*height="([\d.]+)"', page)[1])
    feet = [float(foot) / height for foot in re.findall(r'yMax="([\d.]+)"', page)]
    return max(foot for foot in feet if foot < FOOTER)


def first_two(sheet):
    """Text of the first two pages."""
    return (" ".join(page.split()) for page in read(sheet, "-layout").split("\f")[:2])


def read(sheet, form):
    """What pdftotext reads."""
    text = subprocess.run(
        [shutil.which("pdftotext"), form, sheet, "-"],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    return text.stdout


def test_the_watch_would_notice(tmp_path):
    """A page that does ask and does complain is caught, so silence means something."""
    page = tmp_path / "bad.html"
    page.write_text(
        '<!DOCTYPE html><img src="http://127.0.0.1:9/x.png"><script>console.error("oh")</script>',
        encoding="utf-8",
    )
    _, messages, asked = browse(page.as_uri(), tmp_path)
    assert any("CONSOLE" in line and "oh" in line for line in messages.splitlines())
    assert any(url.startswith("http://127.0.0.1:9/") for url in asked)
