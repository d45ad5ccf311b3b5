"""The page of ``flipflow reproduce`` as a person sees it, on a screen and on a telephone."""

from __future__ import annotations

import html
import html.parser
import json
import re
import shutil
import subprocess

import pytest

import flipflow as ff
from flipflow.paper.page import PAGE, blocks, write_figure, write_page
from flipflow.paper.registry import FIGURES
from flipflow.plotting.symbols import TIMES, html_subscript, with_symbols
from flipflow.report.blocks import Heading, Table, Text

CHROMIUM = shutil.which("chromium")
WIDTHS = (1400, 390)
QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--no-first-run", "--disable-extensions",
    "--enable-logging=stderr", "--v=0", "--virtual-time-budget=30000", "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND",
)  # fmt: skip
NO_PAGE = "not an origin"  # who asks, when the browser does so for itself
# A window is never as narrow as a telephone, a frame in it is; the page in it tells what it sees.
FRAME = """<!DOCTYPE html><title></title>
<iframe width="{width}" height="1000" style="border: 0" src="page.html"></iframe>
<script>addEventListener("message", (told) => {{ document.title = told.data; }});</script>
"""
# What a person would stumble over, once everything is drawn.
MEASURE = """
<script>
const wide = (one) => one.scrollWidth > one.clientWidth + 1;
const lines = (cell) => {
  const range = document.createRange();
  range.selectNodeContents(cell);
  return new Set([...range.getClientRects()].map((one) => Math.round(one.bottom))).size;
};
const squeezed = [...document.querySelectorAll("td, th")].filter((cell) =>
  cell.textContent.trim() && lines(cell) > 2 * cell.textContent.trim().split(/\\s+/).length + 2);
parent.postMessage(JSON.stringify({
  width: innerWidth,
  page: document.documentElement.scrollWidth,
  tables: [...document.querySelectorAll("section.table")].filter(wide).length,
  figures: [...document.querySelectorAll("figure")].filter(wide).length,
  drawn: document.querySelectorAll(".js-plotly-plot").length,
  squeezed: squeezed.map((cell) => cell.textContent.trim()),
}), "*");
</script>
"""


@pytest.fixture(scope="module")
def page(reproduction, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reproduction")
    write_page(reproduction, folder)
    return folder / PAGE


@pytest.fixture(scope="module", params=WIDTHS)
def seen(request, page, tmp_path_factory):
    """What the page measures of itself, the browser's messages, the addresses asked for."""
    folder = tmp_path_factory.mktemp("seen")
    return request.param, *looked_at(page.read_text(encoding="utf-8"), request.param, folder)


def looked_at(text, width, folder):
    """What a page of this width sees of itself, the browser's messages, what it asked for."""
    (folder / "page.html").write_text(
        text.replace("</body>", MEASURE + "</body>"), encoding="utf-8"
    )
    (folder / "frame.html").write_text(FRAME.format(width=width), encoding="utf-8")
    log = folder / "net.json"
    ran = subprocess.run(
        [CHROMIUM, *QUIET, "--window-size=1500,1100", f"--log-net-log={log}",
         f"--user-data-dir={folder / 'profile'}", "--dump-dom", (folder / "frame.html").as_uri()],
        capture_output=True, text=True, timeout=300, check=True,
    )  # fmt: skip
    title = html.unescape(re.search(r"<title>(\{.*?\})</title>", ran.stdout)[1])
    return json.loads(title), ran.stderr, requests(json.loads(log.read_text(encoding="utf-8")))


def requests(log):
    """Addresses a page asked for, from a log of Chromium's network stack; files do not pass it."""
    kinds = {number: name for name, number in log["constants"]["logEventTypes"].items()}
    started = [
        event.get("params", {})
        for event in log["events"]
        if kinds[event["type"]] == "URL_REQUEST_START_JOB"
    ]
    return [one["url"] for one in started if "url" in one and one["initiator"] != NO_PAGE]


class Links(html.parser.HTMLParser):
    """Anchors of a page, and what it links to."""

    def __init__(self):
        super().__init__()
        self.anchors, self.targets = [], []

    def handle_starttag(self, tag, attrs):
        """Take what an element is called and what it points to."""
        found = dict(attrs)
        self.anchors += [found["id"]] if "id" in found else []
        self.targets += [found["href"]] if tag == "a" else []


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is missing")
def test_nothing_is_wider_than_the_screen(seen):
    width, found, _, _ = seen
    assert found["width"] == width
    assert found["page"] <= width
    assert found["tables"] == 0
    assert found["figures"] == 0
    assert found["drawn"] == len(FIGURES) - 3  # three are drawings


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is missing")
def test_the_look_would_notice(tmp_path):
    """A page with a table that is too wide and a column that breaks words."""
    bad = (
        "<!DOCTYPE html><body><section class='table' style='overflow-x: auto'><table><tr>"
        "<td style='width: 1px; overflow-wrap: anywhere'>width of the operating region</td>"
        "<td><div style='width: 500px'>wide</div></td></tr></table></section>"
        "<div style='width: 600px'>wider</div><script>console.error('oh')</script></body>"
    )
    found, messages, _ = looked_at(bad, 390, tmp_path)
    assert found["page"] > found["width"] == 390
    assert found["tables"] == 1
    assert found["squeezed"] == ["width of the operating region"]
    assert any("CONSOLE" in line and "oh" in line for line in messages.splitlines())


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is missing")
def test_no_cell_wraps_letter_by_letter(seen):
    """The first column of Figures 12 and 13 did."""
    assert seen[1]["squeezed"] == []


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is missing")
def test_the_console_stays_silent_and_nothing_is_asked_for(seen):
    _, _, messages, asked = seen
    assert [line for line in messages.splitlines() if "CONSOLE" in line] == []
    assert [url for url in asked if not url.startswith("data:")] == []


def test_every_claim_links_to_its_figure(reproduction, page):
    links = Links()
    links.feed(page.read_text(encoding="utf-8").partition("<script>")[0])
    assert sorted(set(links.anchors)) == sorted(links.anchors)
    assert set(links.anchors) == set(FIGURES)
    wanted = [f"#{one.figure}" for one in (*reproduction.claims, *reproduction.findings)]
    assert links.targets == [target for target in wanted for _ in range(2)]


def test_every_title_is_said_once(reproduction, page):
    text = re.sub(r"<script.*?</script>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    found = re.findall(r"<(h[1-3])[^>]*>(.*?)</\1>", text)
    heads = [html.unescape(re.sub(r"<[^>]+>", "", words)).lower() for _, words in found]
    for one in reproduction.figures:
        title = with_symbols(one.title, str.__add__).lower()
        assert sum(head.endswith(title) for head in heads) == 1, one.title


def test_numbers_stand_in_tables(reproduction):
    """Each number of each claim is a cell of its own, below its figure."""
    made = list(blocks(reproduction))
    starts = [k for k, one in enumerate(made) if isinstance(one, Heading)]
    for one, start, end in zip(reproduction.figures, starts, [*starts[1:], len(made)], strict=True):
        tables = [block for block in made[start:end] if isinstance(block, Table)]
        filled = [
            cell
            for table in tables
            if table.columns[:1] and table.columns[0].title == "Claim"
            for row in table.rows
            for cell, column in zip(row, table.columns, strict=True)
            if column.numeric
        ]
        claims = (*one.claims, *one.findings)
        assert len(filled) == sum(len(claim.evaluation.numbers) for claim in claims)
        assert all(cell.text for cell in filled)


def test_symbols_are_symbols(page):
    text = re.sub(r"<script.*?</script>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for symbol in ("ω<sub>01</sub>", "ω<sub>lb</sub>", "k<sub>2</sub>", "m<sub>0</sub>r"):
        assert symbol in text
    assert re.findall(r"\bw_?(?:01|02|ea|ar|cs|lb|ub)\b|\bm0r\b|\beps\b", text) == []


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("from w_ea to w02", "from ω<sub>ea</sub> to ω<sub>02</sub>"),
        ("k2 x 1.3, 0.7 m1", f"k<sub>2</sub> {TIMES} 1.3, 0.7 m<sub>1</sub>"),
        ("sin(w t)", "sin(ω t)"),
        ("m0r grows", "m<sub>0</sub>r grows"),
        ("with stop", "with stop"),
        ("5 m2x", "5 m2x"),
    ],
)
def test_words_become_symbols(said, shown):
    assert with_symbols(said, html_subscript) == shown


def test_files_of_a_figure_carry_the_symbols(reproduction, tmp_path):
    (one,) = (figure for figure in reproduction.figures if figure.name == "figure-02c")
    write_figure(one, tmp_path)
    page = (tmp_path / "figure-02c.html").read_text(encoding="utf-8")
    assert "ω\\u003csub>ea" in page or "\\u03c9\\u003csub>ea" in page
    assert "w_ea" not in page.partition("<script>")[0]
    reader = shutil.which("pdftotext")
    if reader is not None:
        words = subprocess.run(
            [reader, tmp_path / "figure-02c.pdf", "-"], capture_output=True, check=True
        ).stdout.decode()
        assert "ω" in words
        assert "w_" not in words


def test_the_legend_of_a_family_has_the_unit_of_its_axes(screen):
    figure = ff.figure(ff.response_family(screen, {"clearance": [2e-3]}, omega=(40.0, 60.0)))
    names = {trace.name for panel in figure.panels for trace in panel.traces if trace.legend}
    assert {name for name in names if name.startswith("e =")} == {"e = 2 mm"}
    assert {panel.y.unit for panel in figure.panels} == {"mm"}


def test_the_page_says_whose_machine_it_is():
    own = ff.load("ffs0827")
    for machine, whose in ((own, "the paper's"), (own.replace(clearance=5e-3), "not the paper's")):
        told = list(blocks(ff.reproduce(machine, ["figure-02c"])))
        text = next(one for one in told if isinstance(one, Text) and one.lead == "Machine:").text
        assert text.startswith(f"{whose}, m1 916 kg, ")
        assert text.endswith(f" e {1e3 * machine.clearance:.2f} mm.")
