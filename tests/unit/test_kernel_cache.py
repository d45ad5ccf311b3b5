"""Compiled code is never stale, and never needs a folder that cannot be written."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flipflow.compiled import compile as kernel_compile

INNER = "from tiny.compile import kernel\n\n@kernel\ndef factor(x):\n    return x * {factor}\n"
OUTER = (
    "from tiny.compile import kernel\nfrom tiny.inner import factor\n\n"
    "@kernel(entry=True)\ndef answer(x):\n    return factor(x) + 1.0\n"
)
RUN = "from tiny.outer import answer; print(answer(2.0), sum(answer.stats.cache_hits.values()))"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """The one decorator with two kernels of its own: ``outer.answer`` calls ``inner.factor``."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    shutil.copy(Path(kernel_compile.__file__), folder / "compile.py")
    (folder / "inner.py").write_text(INNER.format(factor="3.0"))
    (folder / "outer.py").write_text(OUTER)
    return folder


def run(package: Path, **environment: str) -> tuple[float, int, str]:
    """Answer, number of cache hits and stderr of a fresh process."""
    done = subprocess.run(
        [sys.executable, "-c", RUN], cwd=package.parent, capture_output=True, text=True,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(package.parent),
             **environment}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    value, hits = done.stdout.split()
    return float(value), int(hits), done.stderr


def test_a_change_in_a_called_file_is_never_stale(package: Path, tmp_path: Path) -> None:
    """numba alone keeps running the old callee: its cache looks at the caller's file only."""
    cache = str(tmp_path / "cache")
    assert run(package, FLIPFLOW_CACHE_DIR=cache)[:2] == (7.0, 0)
    assert run(package, FLIPFLOW_CACHE_DIR=cache)[:2] == (7.0, 1), "the second run loads it"
    (package / "inner.py").write_text(INNER.format(factor="5.0"))
    assert run(package, FLIPFLOW_CACHE_DIR=cache)[:2] == (11.0, 0), "stale code was run"
    (package / "inner.py").write_text(INNER.format(factor="3.0"))
    assert run(package, FLIPFLOW_CACHE_DIR=cache)[:2] == (7.0, 1), "the first folder still serves"


def test_a_kernel_for_kernels_is_not_run_from_python(package: Path, tmp_path: Path) -> None:
    """There is no machine code of it to run; the interpreter has to survive the attempt."""
    call = "from tiny.outer import answer; from tiny.inner import factor; answer(2.0); factor(2.0)"
    done = subprocess.run(
        [sys.executable, "-c", call], cwd=package.parent, capture_output=True, text=True,
        env={**os.environ, "FLIPFLOW_CACHE_DIR": str(tmp_path / "cache")}, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "KeyError" in done.stderr


def test_the_cache_stays_in_its_folder(package: Path, tmp_path: Path) -> None:
    """Nothing is written beside the sources."""
    cache = tmp_path / "cache"
    run(package, FLIPFLOW_CACHE_DIR=str(cache))
    assert list(cache.rglob("*.nbi"))
    assert not list(package.rglob("*.nb*"))


def test_a_cache_folder_that_cannot_be_written(package: Path, tmp_path: Path) -> None:
    """A file stands where the folder should be: it compiles all the same, and says a word."""
    blocked = tmp_path / "blocked"
    blocked.write_text("not a folder")
    value, hits, said = run(package, FLIPFLOW_CACHE_DIR=str(blocked))
    assert (value, hits) == (7.0, 0)
    assert "no writable cache folder" in said


def test_the_digest_knows_every_source(tmp_path: Path) -> None:
    """Another file, another content, another name: another digest each."""
    (tmp_path / "a.py").write_text("x = 1\n")
    digests = {kernel_compile.source_digest(tmp_path)}
    (tmp_path / "a.py").write_text("x = 2\n")
    digests.add(kernel_compile.source_digest(tmp_path))
    (tmp_path / "b.py").write_text("")
    digests.add(kernel_compile.source_digest(tmp_path))
    (tmp_path / "b.py").rename(tmp_path / "c.py")
    digests.add(kernel_compile.source_digest(tmp_path))
    assert len(digests) == 4
