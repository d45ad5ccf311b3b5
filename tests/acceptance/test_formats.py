"""The report in other forms: PDF, XLSX and CSV; and that nothing is cut or overlaps in any."""

from __future__ import annotations

import csv
import dataclasses
import functools
import html as markup
import io
import re
import shutil
import subprocess
import sys
from pathlib import Path

import openpyxl
import pytest
from rich.console import Console

import flipflow as ff
from flipflow.errors import InputError, MissingExtra
from flipflow.io.results import document_of
from flipflow.plotting.svg import searchable_svg
from flipflow.report import summary
from flipflow.report.blocks import FigureBlock, Table
from flipflow.report.numbers import Numeral
from flipflow.report.pdf import pdf
from flipflow.report.registry import blocks_of
from flipflow.report.tables import table_files

CHROMIUM, POPPLER = shutil.which("chromium"), shutil.which("pdftotext")
OFFICE = shutil.which("soffice") or shutil.which("libreoffice")
poppler = pytest.mark.skipif(POPPLER is None, reason="poppler-utils is not installed")
browser = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
MACHINES = ("bundled", "thirty cases", "no allowed speed", "long german names")
PAPERS = {"a4": (595.3, 841.9), "letter": (612.0, 792.0)}  # points
SMALL = str(Path(__file__).parents[1] / "machines" / "small.toml")
FULL = 1.0 / 3.0  # of a page's height that every page but the last fills
FOOTER = 0.965  # of a page's height, below which the foot of every page stands
# Boxes of words hold more than their ink: so far they may reach into one another.
TOUCH, SHARE = 0.8, 0.35
GERMAN = (
    "leer",
    'voll <i> "Öl", Siebbelagsversteifung',
    "volle Materialauflage mit Anbackungen",
    "heiß, Umgebungstemperaturgrenzwert",
)
HOSTILE = ("=cmd|' /C calc'!A0", "+1", "-2+3", "@SUM(A1)", '=HYPERLINK("http://x","y")')


def _project(kind):
    project = ff.load_project("ffs0827")
    if kind == "no allowed speed":
        narrow = dataclasses.replace(project.limits, relative_amplitude=(7.8e-3, 8e-3))
        return dataclasses.replace(project, limits=narrow)
    if kind == "air, supports and limits on the way":
        hot = ff.Load(name="hot air", temperature=50.0, temperature_of="air")
        way = ff.PassingLimits(relative_amplitude=9e-3)
        return dataclasses.replace(
            project, load_cases=(hot,), limits=dataclasses.replace(project.limits, start=way),
            screen=project.screen.replace(load_centre=0.58),
        )  # fmt: skip
    if kind == "long german names":
        loads = tuple(
            dataclasses.replace(load, name=name)
            for load, name in zip(project.load_cases, GERMAN, strict=True)
        )
        document = dataclasses.replace(
            project.document,
            name="Spannwellensiebmaschine Sonderausführung",
            project="Sekundärrohstoffaufbereitungsanlage Niederschlesien",
            customer="Aufbereitungsmaschinengesellschaft Müller-Lüdenscheidt & Söhne GmbH",
            prepared_by="Dr.-Ing. Maximiliane Unterbergerstein-Wolkenstein",
        )
        return dataclasses.replace(project, load_cases=loads, document=document)
    return project


@pytest.fixture(scope="module")
def assessed(analysed, request):
    """``assessed("bundled")``: one of the machines of this module, judged once."""

    def found(kind):
        many = kind == "thirty cases"
        return request.getfixturevalue("thirty_cases") if many else analysed(_project(kind))

    return found


@pytest.fixture(scope="module")
def told_of(assessed):
    """``told_of("bundled")``: the document of a machine's report, made once for all its forms."""
    return functools.cache(lambda kind: document_of(assessed(kind)))


@pytest.fixture(scope="module")
def hostile():
    """A machine whose texts are formulas to other programs and markup to typst."""
    project = ff.load_project("ffs0827-linear")
    loads = tuple(
        ff.Load(name=name, stiffness_factor=1.0 + k / 10.0) for k, name in enumerate(HOSTILE)
    )
    document = dataclasses.replace(
        project.document, name="=1+1", customer='#panic("x") $a$ *b* _c_ <i> \\ // @x `y`'
    )
    project = dataclasses.replace(project, load_cases=loads, document=document)
    return ff.assess(project, omega=(85.0, 92.0))


@pytest.fixture(scope="module")
def drawn_once():
    """Sheets of both papers show the same figures, each of them drawn once."""
    known = {}

    def drawn(figure):
        if id(figure) not in known:
            known[id(figure)] = figure, searchable_svg(figure)
        return known[id(figure)][1]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("flipflow.report.pdf.searchable_svg", drawn)
        patched.setattr("flipflow.report.pdf.blocks_of", functools.cache(blocks_of))
        yield


@pytest.fixture(scope="module")
def printed(assessed, printed_page, drawn_once, tmp_path_factory):  # noqa: ARG001
    """``printed("bundled", "a4")``: the file of a report, as PDF or as its page is printed."""

    @functools.cache
    def made(kind, form):
        if form == "page":
            return printed_page(assessed(kind))
        sheet = tmp_path_factory.mktemp("pdf") / "report.pdf"
        sheet.write_bytes(pdf(assessed(kind), form))
        return sheet

    return made


@dataclasses.dataclass(frozen=True)
class Word:
    """A word of a page with its box in points, y down."""

    left: float
    top: float
    right: float
    foot: float
    text: str


@functools.cache
def pages(sheet):
    """Width, height and words of every page."""
    return tuple(_pages(sheet))


def _pages(sheet):
    told = subprocess.run(
        [POPPLER, "-bbox", sheet, "-"], capture_output=True, text=True, check=True
    ).stdout
    for page in told.split("<page ")[1:]:
        size = re.search(r'width="([\d.]+)" height="([\d.]+)"', page)
        words = re.findall(
            r'<word xMin="(\S+)" yMin="(\S+)" xMax="(\S+)" yMax="(\S+)">(.*?)</word>', page
        )
        yield (
            float(size[1]), float(size[2]),
            [Word(*map(float, box), markup.unescape(text)) for *box, text in words],
        )  # fmt: skip


def overlaps(words):
    """Pairs of words whose boxes lie over one another."""
    down_the_page = sorted(words, key=lambda word: word.top)
    for k, one in enumerate(down_the_page):
        for other in down_the_page[k + 1 :]:
            if other.top > one.foot:
                break
            across = min(one.right, other.right) - max(one.left, other.left)
            down = min(one.foot, other.foot) - max(one.top, other.top)
            least = min(one.foot - one.top, other.foot - other.top)
            if across > TOUCH and down > SHARE * least:
                yield one.text, other.text


FORMS = [
    pytest.param("a4", marks=poppler),
    pytest.param("letter", marks=poppler),
    pytest.param("page", marks=[poppler, browser, pytest.mark.browser]),
]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", MACHINES)
def test_nothing_is_cut_or_overlaps_and_pages_are_filled(printed, kind, form):
    ends = []
    for number, (width, height, words) in enumerate(pages(printed(kind, form)), 1):
        assert words, f"page {number} is empty"
        beyond = [
            word.text for word in words
            if word.left < 20.0 or word.right > width - 15.0 or word.top < 0 or word.foot > height
        ]  # fmt: skip
        assert beyond == [], f"page {number}"
        assert list(overlaps(words)) == [], f"page {number}"
        ends.append(max(word.foot for word in words if word.foot < FOOTER * height) / height)
    assert min(ends[:-1]) > FULL, ends


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", MACHINES)
def test_the_first_page_says_what_it_must(printed, assessed, told_of, kind, form):
    """Page 1 says in the document's words: may it run, what binds, does it start, the ground."""
    _, _, words = pages(printed(kind, form))[0]
    badge = assessed(kind).state  # it stands beside the verdict, which may take two lines
    text = " ".join(word.text for word in words if word.text != badge)
    document = told_of(kind)
    for piece in ("Allowed speed range:", "Does it start", "Into the ground"):
        assert piece in text
    for sentence in ("verdict", "allowed_speed_range", "does_it_start", "ground"):
        assert " ".join(document[sentence].split()) in text


@pytest.mark.parametrize("kind", MACHINES)
def test_the_terminal_keeps_to_80_columns(assessed, kind):
    out = io.StringIO()
    summary(assessed(kind), Console(file=out, width=80, highlight=False, markup=False))
    lines = out.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    told = " ".join(out.getvalue().split())
    assert " ".join(assessed(kind).verdict.split()) in told
    assert "…" not in told


@poppler
@pytest.mark.parametrize("paper", PAPERS)
def test_the_pdf_has_its_paper_its_own_fonts_and_no_bitmap(printed, assessed, paper):
    sheet = printed("bundled", paper)
    width, height, _ = pages(sheet)[0]
    assert (width, height) == pytest.approx(PAPERS[paper], abs=0.5)
    fonts = subprocess.run(["pdffonts", sheet], capture_output=True, text=True, check=True).stdout
    rows = fonts.splitlines()[2:]
    assert rows
    assert all(re.match(r"[A-Z]{6}\+(LibertinusSerif|DejaVuSans)", row) for row in rows), fonts
    images = subprocess.run(
        ["pdfimages", "-list", sheet], capture_output=True, text=True, check=True
    ).stdout
    assert len(images.splitlines()) == 2, images
    text = " ".join(word.text for _, _, words in pages(sheet) for word in words)
    for block in blocks_of(assessed("bundled")):
        if isinstance(block, FigureBlock):
            assert " ".join(block.figure.caption.split()) in text
            labels = [panel.x.title for panel in block.figure.panels]
            assert all(label in text for label in labels if label)


@poppler
@poppler
def test_names_of_the_machine_file_are_whole_words(assessed, printed):
    """A letter without width stood between all letters: nothing was found, and words were cut."""
    text = subprocess.run(
        [POPPLER, printed("bundled", "a4"), "-"], capture_output=True, check=True
    ).stdout.decode()  # fmt: skip
    values = next(
        block for block in blocks_of(assessed("bundled"))
        if isinstance(block, Table) and block.title == "Values of the machine file"
    )  # fmt: skip
    words = text.split()
    assert [row[0].text for row in values.rows if row[0].text not in words] == []
    assert "\u200b" not in text


def test_texts_of_users_are_no_markup(hostile, tmp_path):
    (tmp_path / "report.pdf").write_bytes(pdf(hostile))
    text = " ".join(word.text for _, _, w in pages(tmp_path / "report.pdf") for word in w)
    for piece in ("=1+1", '#panic("x") $a$ *b* _c_ <i> \\ // @x `y`', "=cmd|' /C calc'!A0"):
        assert piece.replace(" ", "") in text.replace(" ", "")


def test_paper_and_missing_extras_are_said(assessed, monkeypatch, command, tmp_path):
    with pytest.raises(InputError, match="paper = 'a3': choose one of a4, letter"):
        pdf(assessed("bundled"), "a3")
    monkeypatch.chdir(tmp_path)
    code, _, err = command("analyze", "ffs0827", "--paper", "A3")
    assert (code, err) == (2, "Error: --paper = 'A3': choose one of a4, letter.\n")
    for module, option, word in (
        ("typst", "--pdf", "A PDF needs typst"),
        ("matplotlib", "--pdf", "Figures for print need matplotlib"),
        ("openpyxl", "--tables", "Tables need openpyxl"),
    ):
        with monkeypatch.context() as without:
            without.setitem(sys.modules, module, None)
            code, _, err = command("analyze", "ffs0827", option)
        assert code == MissingExtra.exit_code
        assert err == f"Error: {word}: pip install 'flipflow[report]'.\n"
    assert list(tmp_path.iterdir()) == []


def test_analyze_writes_what_is_asked_for(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("analyze", SMALL, "--speeds", "800 rpm", "900 rpm", "-o", "out")
    code, out, err = command(*words, "--paper", "letter", "--tables")
    assert code == 0, err
    assert (tmp_path / "out" / "report.pdf").read_bytes().startswith(b"%PDF-")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    tables = {name for name in names if name.startswith("table-")}
    assert {"table-limit.csv", "table-response-over-speed.csv"} <= tables
    assert names - tables == {
        "report.html", "report.pdf", "response.csv", "response.nc", "results.json", "tables.xlsx",
    }  # fmt: skip
    assert f"report.pdf, tables.xlsx, {len(tables)} tables as CSV" in " ".join(out.split())


def opened(content):
    book = openpyxl.load_workbook(io.BytesIO(content))
    return {sheet.title: [[cell.value for cell in row] for row in sheet] for sheet in book}


@pytest.fixture(scope="module")
def sheets(assessed):
    """The tables of the bundled machine."""
    return opened(table_files(assessed("bundled"))["tables.xlsx"])


@pytest.fixture(scope="module")
def hostile_files(hostile):
    return table_files(hostile)


def test_every_table_is_a_sheet_and_numbers_are_numbers(assessed, sheets):
    found = assessed("bundled")
    tables = [block for block in blocks_of(found) if isinstance(block, Table)]
    assert len(sheets) == len(tables) + 2  # the report's head, and the response
    head, first, *_ = limits = sheets["Limit"]
    assert head == [
        "Limit", "Unit", "Allowed, least", "Allowed, most", "Worst", "Case", "Margin [%]", "State",
    ]  # fmt: skip
    worst = 1e3 * found.cases[1].values["relative_amplitude"]
    assert first == [
        "Relative amplitude", "mm", 5, 8, pytest.approx(worst, rel=1e-11), "full, stiffening",
        pytest.approx(100.0 * (worst / 5.0 - 1.0), rel=1e-9), "attention",
    ]  # fmt: skip
    assert ["Speed", "rpm", 600, 1000, 850, "all", 15, "pass"] in limits
    cases = sheets["Load case"]
    assert cases[0] == [
        "Load case", "amplitude [mm]", "stroke [mm]", "phase [deg]", "main frame [g]",
        "floating frame [g]", "stop force [kN]",
    ]  # fmt: skip
    shown = {row[0]: row for row in cases[1:]}
    assert shown["full, stiffening"][-1] == "not reached"
    assert shown["hot"][-1] == pytest.approx(1e-3 * found.cases[3].values["stop_force"], rel=1e-11)
    for name, rows in sheets.items():
        for row in rows[1:]:
            for title, value in zip(rows[0], row, strict=True):
                if "[" in title and isinstance(value, str):
                    assert not re.fullmatch(r"[-+\d. e]+( \S+)?", value), (name, title, value)
    assert sheets["Branches"][1][3] == found.cases[0].branch.omega.size


@pytest.mark.parametrize("kind", ["bundled", "air, supports and limits on the way"])
def test_every_number_of_a_column_of_numbers_is_known(assessed, kind):
    """What a table shows under a number is a number to other programs, a range its two ends."""
    found = assessed(kind)
    for table in (block for block in blocks_of(found) if isinstance(block, Table)):
        told = [k for k, column in enumerate(table.columns) if column.numeric or column.ends]
        texts = {row[k].text for row in table.rows for k in told}
        left = {text for text in texts if not isinstance(text, Numeral)}
        assert {text for text in left if re.search(r"\d", text)} == set(), table.title


def test_limits_on_the_way_and_ranges_have_their_ends(assessed):
    files = opened(table_files(assessed("air, supports and limits on the way"))["tables.xlsx"])
    head, *rows = files["Limits on start and stop"]
    allowed = [head.index(title) for title in ("Unit", "Allowed, most", "Allowed, remark")]
    limits = {row[0]: [row[k] for k in allowed] for row in rows}
    assert limits["Relative amplitude, start"] == ["mm", 9, None]
    assert limits["Stop force, start"] == ["kN", 15, "while running"]
    cases = files["Load cases"]
    assert [cases[1][0], cases[1][cases[0].index("Temperature [degC]")]] == ["hot air", 50]
    support = next(rows for name, rows in files.items() if name.startswith("One support, running"))
    least, most = (support[0].index(f"Static, vertical, {end} [kN]") for end in ("least", "most"))
    assert 0.0 < support[1][least] < support[1][most]


def test_the_response_has_g_and_forces_in_the_units_of_the_file(assessed, sheets):
    found = assessed("bundled")
    head, *rows = sheets["Response over speed"]
    assert {"Speed [rpm]", "Relative amplitude [mm]", "Main frame acceleration [g]",
            "Stop force [kN]", "Foundation force [kN]"} <= set(head)  # fmt: skip
    case = found.cases[0]
    own = [dict(zip(head, row, strict=True)) for row in rows if row[0] == case.name]
    assert len(own) == case.branch.omega.size
    assert sum(case.branch.omega.size for case in found.cases) == len(rows)
    k = min(range(len(own)), key=lambda i: abs(own[i]["Speed [rpm]"] - 850.0))
    orbit = case.branch.orbit(k)
    assert own[k]["Relative amplitude [mm]"] == pytest.approx(1e3 * orbit.amplitude("relative"))
    assert own[k]["Stop force [kN]"] == pytest.approx(1e-3 * orbit.stop_force_peak())
    # Beside the working speed the quantities are those of page 1, 850 rpm, to what they change by.
    assert own[k]["Main frame acceleration [g]"] == pytest.approx(2.93, rel=0.02)
    assert own[k]["Foundation force [kN]"] == pytest.approx(3.91, rel=0.02)


def test_no_formula_comes_from_a_text(hostile_files):
    book = openpyxl.load_workbook(io.BytesIO(hostile_files["tables.xlsx"]))
    kinds = {cell.data_type for sheet in book for row in sheet for cell in row}
    assert "f" not in kinds
    names = {row[0].value for row in book["Load case"].iter_rows(min_row=2)}
    assert names == set(HOSTILE)
    assert all(row[0].quotePrefix for row in book["Load case"].iter_rows(min_row=2))
    for name, text in hostile_files.items():
        if name.endswith(".csv"):
            for row in csv.reader(io.StringIO(text)):
                for cell in row:
                    assert not cell.startswith(("=", "@", "\t", "\r")), (name, cell)
                    assert re.fullmatch(r"[+-][\d.e+-]+|[^+-].*|", cell, re.DOTALL), (name, cell)


def test_the_response_beside_the_report_has_no_formula(hostile, tmp_path):
    from flipflow.io.response import write_response  # noqa: PLC0415

    write_response(hostile, tmp_path)
    with (tmp_path / "response.csv").open(encoding="utf-8", newline="") as lines:
        names = {row[0] for row in list(csv.reader(lines))[1:]}
    assert names == {f"'{name}" for name in HOSTILE}


@pytest.mark.skipif(OFFICE is None, reason="LibreOffice is not installed")
def test_libreoffice_opens_the_tables(hostile_files, tmp_path):
    (tmp_path / "tables.xlsx").write_bytes(hostile_files["tables.xlsx"])
    subprocess.run(
        [OFFICE, "--headless", f"-env:UserInstallation=file://{tmp_path / 'profile'}",
         "--convert-to", "xlsx:Calc MS Excel 2007 XML", "--outdir", tmp_path / "again",
         tmp_path / "tables.xlsx"],
        capture_output=True, timeout=180, check=True,
    )  # fmt: skip
    before = opened((tmp_path / "tables.xlsx").read_bytes())
    again = opened((tmp_path / "again" / "tables.xlsx").read_bytes())
    assert again.keys() == before.keys()
    for name, rows in before.items():
        for row, other in zip(rows, again[name], strict=True):
            for one, two in zip(row, other, strict=False):
                numbers = isinstance(one, (int, float))
                assert two == (pytest.approx(one) if numbers else one)


@pytest.mark.parametrize(
    ("old", "new", "label", "place"),
    [
        ('name = "empty"', 'name = "em\\u0007pty"', "load case 1, name", 3),
        ('name = "empty"', 'name = "a\\nb"', "load case 1, name", 2),
        ('customer = ""', 'customer = "x\\u001b[31m"', "document.customer", 2),
        ("[sources]", '[sources]\nframes.main_mass = "\\t"', "sources.frames.main_mass", 1),
    ],
)
def test_control_characters_are_refused_with_their_place(tmp_path, command, old, new, label, place):
    monkey = tmp_path / "own.toml"
    command("new", monkey)
    text = monkey.read_text(encoding="utf-8")
    assert old in text
    monkey.write_text(text.replace(old, new, 1), encoding="utf-8")
    code, _, err = command("check", monkey)
    assert code == 2
    assert err.startswith(f"Error: {label} = ")
    assert f"character {place} is a control character (U+00" in err
    assert err.count("\n") == 1


def test_two_lines_of_a_customer_are_no_control_characters(tmp_path, command):
    command("new", tmp_path / "own.toml")
    text = (tmp_path / "own.toml").read_text(encoding="utf-8")
    text = text.replace('customer = ""', 'customer = """Söhne GmbH\nAbt. Technik"""')
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    assert ff.load_project(tmp_path / "own.toml").document.customer == "Söhne GmbH\nAbt. Technik"
