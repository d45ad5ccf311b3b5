"""The documentation as built: links lead somewhere, pages fit, nothing is fetched or complained of.

``FLIPFLOW_DOCS`` names the folder that sphinx wrote; ``.ci/run`` sets it after building.
"""

from __future__ import annotations

import functools
import json
import os
import re
import shutil
import subprocess
import threading
from html import unescape
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urldefrag, urljoin, urlsplit

import pytest
from test_report_offline import QUIET, requests

BUILT = Path(os.environ.get("FLIPFLOW_DOCS", "nowhere")).absolute()
CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(
    not BUILT.is_dir(), reason="FLIPFLOW_DOCS names no folder with the documentation built"
)
browser = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
WIDTHS = 1400, 390
LOADED = {"img": "src", "script": "src", "link": "href", "source": "src", "iframe": "src"}
# No complaints: the theme notes light or dark, where it has scrolled to, what has the focus.
NOTES = re.compile(r'"\[PST\]: (?:Changed to auto mode|Scrolled sidebar|Set focus on search)')
HARNESS = """<!DOCTYPE html><title>looking</title><link rel="icon" href="data:,">
<pre id="seen"></pre><script>
const seen = [];
async function look(page, width) {
  const frame = document.createElement("iframe");
  frame.width = width; frame.height = 800; frame.src = page;
  await new Promise((done) => { frame.onload = done; document.body.append(frame); });
  const inside = frame.contentDocument;
  const broken = [...inside.images].filter((one) => one.complete && !one.naturalWidth);
  seen.push({page, width, needs: inside.documentElement.scrollWidth,
             broken: broken.map((b) => b.src)});
  frame.remove();
}
(async () => {
  for (const page of PAGES) for (const width of WIDTHS) await look(page, width);
  document.getElementById("seen").textContent = JSON.stringify(seen);
})();
</script>"""


class Page(HTMLParser):
    """What a page links to, what it loads, and the places that can be linked to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.places: set[str] = {"", "top"}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take in one element."""
        known = {name: value or "" for name, value in attrs}
        self.places |= {known[name] for name in ("id", "name") if name in known}
        if tag == "a" and "href" in known:
            self.links.append(known["href"])
        if known.get(LOADED.get(tag, "")) and known.get("rel") not in {"canonical", "next", "prev"}:
            self.loads.append(known[LOADED[tag]])


@functools.cache
def pages() -> dict[str, Page]:
    found = {str(one.relative_to(BUILT)): one for one in sorted(BUILT.rglob("*.html"))}
    return {
        name: Page(path.read_text(encoding="utf-8"))
        for name, path in found.items()
        if not name.startswith("_static")
    }


def test_every_page_is_there() -> None:
    wanted = (
        "index", "gallery", "validation", "how-to/motions", "how-to/long-runs", "how-to/numbers",
        "tutorials/first-machine", "tutorials/general-system", "troubleshooting", "glossary",
        "theory/bibliography", "coming-from", "api/index", "about/changelog", "about/cite",
    )  # fmt: skip
    assert {f"{name}.html" for name in wanted} <= set(pages())


def test_links_lead_somewhere() -> None:
    """Within the documentation: the file is there, and the place in it."""
    lost = []
    for name, page in pages().items():
        for link in (*page.links, *page.loads):
            if urlsplit(link).scheme or link.startswith("//"):
                continue
            target, place = urldefrag(urljoin(name, link))
            target = unquote(urlsplit(target).path)
            if not (BUILT / target).is_file():
                lost.append(f"{name}: {link}")
            elif target in pages() and unquote(place) not in pages()[target].places:
                lost.append(f"{name}: {link}, no such place")
    assert lost == []


def test_nothing_is_loaded_from_elsewhere() -> None:
    """Nor by style sheets."""
    away = re.compile(r"^(?:https?:)?//")
    loads = [f"{name}: {one}" for name, page in pages().items() for one in page.loads]
    assert [one for one in loads if away.match(one.partition(": ")[2])] == []
    for sheet in BUILT.rglob("*.css"):
        found = re.findall(r"url\(['\"]?((?:https?:)?//[^)]*)", sheet.read_text(encoding="utf-8"))
        assert found == [], sheet


@pytest.fixture(scope="module")
def looked(tmp_path_factory: pytest.TempPathFactory) -> tuple[list, str, list[str], str]:
    """Every page in a browser at both widths: what was seen, said and asked for, and by whom."""
    folder = tmp_path_factory.mktemp("browser")
    site = folder / "site"
    site.symlink_to(BUILT, target_is_directory=True)
    text = HARNESS.replace("PAGES", json.dumps([f"site/{name}" for name in pages()]))
    (folder / "look.html").write_text(text.replace("WIDTHS", json.dumps(WIDTHS)), encoding="utf-8")

    class Silent(SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Silent, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    home = f"http://127.0.0.1:{server.server_port}/"
    quiet = [one for one in QUIET if not one.startswith(("--virtual-time", "--host-resolver"))]
    log = folder / "net.json"
    ran = subprocess.run(
        [CHROMIUM, *quiet, "--virtual-time-budget=3000000", f"--log-net-log={log}",
         "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
         f"--user-data-dir={folder / 'profile'}", "--dump-dom", f"{home}look.html"],
        capture_output=True, text=True, timeout=900, check=True,
    )  # fmt: skip
    server.shutdown()
    server.server_close()
    seen = re.search(r'<pre id="seen">(.*?)</pre>', ran.stdout, re.DOTALL)
    assert seen
    assert seen[1], ran.stderr[-2000:]
    asked = requests(json.loads(log.read_text(encoding="utf-8")))
    return json.loads(unescape(seen[1])), ran.stderr, asked, home


@browser
@pytest.mark.browser
def test_pages_fit_a_desk_and_a_telephone(looked) -> None:
    """At 1400 and at 390 px no page is wider than its window, and every picture is there."""
    seen, *_ = looked
    assert len(seen) == len(WIDTHS) * len(pages())
    assert [one for one in seen if one["needs"] > one["width"] or one["broken"]] == []


@browser
@pytest.mark.browser
def test_the_console_stays_silent_and_nothing_is_asked_for(looked) -> None:
    _, said, asked, home = looked
    told = [line for line in said.splitlines() if "CONSOLE" in line]
    assert [line for line in told if not NOTES.search(line)] == []
    assert any(url.endswith("index.html") for url in asked)
    assert [url for url in asked if not url.startswith((home, "data:", "blob:"))] == []
