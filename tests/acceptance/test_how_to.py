"""The how-to pages: each block is short, stands alone, and runs."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import flipflow as ff

DOCS = Path(__file__).parents[2] / "docs"
MOST_STATEMENTS, MOST_COLUMNS = 10, 100
CELL = re.compile(r"^```\{code-cell\} ipython3\n(.*?)^```$", re.DOTALL | re.MULTILINE)
QUESTION = re.compile(r"^## (.*)\n", re.MULTILINE)


def questions() -> dict[str, str]:
    """The code of each question; cells whose input the page hides only show a picture."""
    found = {}
    for page in sorted((DOCS / "how-to").glob("*.md")):
        _, *parts = QUESTION.split(page.read_text(encoding="utf-8"))
        for question, text in zip(parts[::2], parts[1::2], strict=True):
            (found[question],) = (
                cell for cell in CELL.findall(text) if not cell.startswith(":tags: [remove-input]")
            )
    return found


QUESTIONS = questions()


def test_the_questions_are_there() -> None:
    assert len(QUESTIONS) >= 10
    for word in (
        "gaps", "bifurcation", "chaos", "cusp", "touches no other", "starts", "double", "harmonics",
        "matters", "pandas",
    ):  # fmt: skip
        assert any(word in question for question in QUESTIONS), word


def statements(code: str) -> Iterator[ast.stmt]:
    """All of them, those within others too."""
    return (node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.stmt))


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_block_is_short(question: str) -> None:
    """Statements within loops, classes and functions count, and so do imports."""
    code = QUESTIONS[question]
    nodes = list(statements(code))
    assert len(nodes) <= MOST_STATEMENTS
    assert max(map(len, code.splitlines())) <= MOST_COLUMNS
    imported = [n.module for n in nodes if isinstance(n, ast.ImportFrom)]
    imported += [a.name for n in nodes if isinstance(n, ast.Import) for a in n.names]
    assert not [name for name in imported if name and name.startswith("flipflow.")]


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_block_runs_alone(
    question: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """It tells something, and writes the picture that the page shows."""
    code = QUESTIONS[question]
    monkeypatch.chdir(tmp_path)
    exec(compile(code, question, "exec"), {"__name__": "__main__"})  # noqa: S102
    assert capsys.readouterr().out.strip()
    for name in re.findall(r'"(\w+\.(?:svg|nc|json))"', code):
        assert (tmp_path / name).stat().st_size > 1000


def test_every_status_of_a_branch_has_its_remedy() -> None:
    page = (DOCS / "troubleshooting.md").read_text(encoding="utf-8")
    for status in ff.BranchStatus:
        assert f"`{status.name}`" in page, status
