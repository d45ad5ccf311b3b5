"""Tables of what tests compare, made by running them: ``{validation}`` with a test a line."""

from __future__ import annotations

import ast
import functools
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

BLOCK = re.compile(r"^```\{validation\}\n(.*?)^```", re.DOTALL | re.MULTILINE)
ROOT = Path(__file__).parents[2]
HEADS = ("what", "trusted", "computed", "off by", "allowed")
MOST_ROWS = 6  # of a test; those nearest to what is allowed
Record = dict[str, Any]


class Validation(SphinxDirective):
    """Run tests; a table of what they compared, under a heading for each of them."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """The table, and beneath it the command that makes it."""
        tests = [line.strip() for line in self.content if line.strip()]
        page = Path(self.env.doc2path(self.env.docname)).read_text(encoding="utf-8")
        every = tuple(name for block in BLOCK.findall(page) for name in block.split())
        some = [one for one in recorded(every) if one["test"].startswith(tuple(tests))]
        if not some:
            raise ExtensionError(f"nothing is compared by {', '.join(tests)}")
        command = nodes.literal_block(text=f"python -m pytest {' '.join(tests)}")
        command["language"] = "bash"
        return [table(some), command]


@functools.cache
def recorded(tests: tuple[str, ...]) -> list[Record]:
    """What the tests compared, in the order of their run: one run for a whole page."""
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "record"
        done = subprocess.run(  # noqa: S603  this interpreter
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests],
            cwd=ROOT, env={**os.environ, "FLIPFLOW_RECORD": str(record)}, capture_output=True,
            text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            raise ExtensionError(f"a test of the page of validation fails:\n{done.stdout[-4000:]}")
        return [json.loads(line) for line in record.read_text(encoding="utf-8").splitlines()]


def table(records: Sequence[Record]) -> nodes.table:
    """The comparisons as a table, grouped by test."""
    group = nodes.tgroup(cols=len(HEADS))
    group += [nodes.colspec(colwidth=width) for width in (30, 22, 22, 13, 13)]
    group += nodes.thead("", nodes.row("", *(_cell(head) for head in HEADS)))
    body = nodes.tbody()
    for name, some in groupby(records, key=lambda one: one["test"].partition("[")[0]):
        rows = list(some)
        body += nodes.row("", _heading(name, len(rows)))
        rows.sort(key=lambda one: -_share(one))
        body += [nodes.row("", *map(_cell, _words(one))) for one in rows[:MOST_ROWS]]
    group += body
    return nodes.table("", group, classes=["validation"])


def _heading(name: str, count: int) -> nodes.entry:
    """What a test says of itself, and its name."""
    shown = "" if count <= MOST_ROWS else f" {count} comparisons, those nearest to their limits:"
    text = nodes.paragraph(
        "", "", nodes.strong(text=_said(name)), nodes.Text(shown), nodes.Text(" ")
    )
    text += nodes.literal(text=name.rpartition("/")[2])
    return nodes.entry("", text, morecols=len(HEADS) - 1)


def _said(name: str) -> str:
    """The first sentence of a test's docstring; its name in words where it has none."""
    path, function = name.split("::")
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == function:
            told = ast.get_docstring(node)
            if told:
                return " ".join(told.partition("\n\n")[0].split())
    return function.removeprefix("test_").replace("_", " ").capitalize() + "."


def _words(one: Record) -> Iterator[str]:
    case = one["test"].partition("[")[2].removesuffix("]")
    of = f", of {one['count']}" if one["count"] > 1 else ""
    yield f"{one['what']}{f' ({case})' if case else ''}{of}"
    yield from (_number(one["expected"]), _number(one["got"]))
    yield from (f"{one['off']:.1e}", f"{one['allowed']:.1e}")


def _number(text: str) -> str:
    value = complex(text)
    if value.imag == 0.0 and "j" not in text:
        return f"{value.real:.10g}"
    return f"{value.real:.8g} {'+' if value.imag >= 0.0 else '−'} {abs(value.imag):.8g}i"  # noqa: RUF001


def _share(one: Record) -> float:
    return float(one["off"] / one["allowed"]) if one["allowed"] else float(one["off"])


def _cell(text: str) -> nodes.entry:
    return nodes.entry("", nodes.paragraph(text=text))


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the directive known."""
    app.add_directive("validation", Validation)
    return {"parallel_read_safe": True}
