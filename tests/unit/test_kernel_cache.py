"""Compiled code is never stale, survives damage, and never needs a folder that can be written."""

from __future__ import annotations

import compileall
import functools
import json
import os
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

import flipflow
from flipflow.compiled import compile as kernel_compile
from flipflow.compiled import digest
from flipflow.compiled.folders import DAY, KEPT_DAYS, CacheFolders

INNER = (
    "from tiny.compile import kernel\nfrom tiny.constants import OFFSET\n\n"
    "@kernel\ndef factor(x):\n    return x * {factor} + OFFSET\n"
)
OUTER = (
    "from tiny.compile import kernel\nfrom tiny.inner import factor\n\n"
    "@kernel(entry=True)\ndef answer(x):\n    return factor(x) + 1.0\n"
)
RUN = "from tiny.outer import answer; print(answer(2.0), sum(answer.stats.cache_hits.values()))"
READ_ONLY = (
    "import tiny.folders, errno, os\n"
    "def refuse(path, stored): raise OSError(errno.EROFS, os.strerror(errno.EROFS))\n"
    "tiny.folders._write_whole = refuse\n"
)
UNTRIED = "import numba; numba.__version__ = '0.999.0'\n"
# Has used numba and loaded none of our modules. A child runs each request, until it ends itself;
# what is frozen it need not look through at its end, which would take longer than all else.
FORKING = """
import gc, json, os, sys
import numba; numba.njit(lambda x: x)(1.0)
gc.collect(); gc.freeze()
for request in sys.stdin:
    child = os.fork()
    if not child:
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
else:
    sys.exit()
asked = json.loads(request)
os.chdir(asked["folder"])
for stream, name in ((1, "stdout"), (2, "stderr")):
    os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
os.environ.update(asked["environment"])
sys.path.insert(0, asked["environment"]["PYTHONPATH"])
exec(asked["code"])
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """The one decorator with two kernels of its own: ``outer.answer`` calls ``inner.factor``."""
    folder = tmp_path / "sources" / "tiny"
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text("")
    for source in Path(kernel_compile.__file__).parent.glob("*.py"):
        text = source.read_text().replace("flipflow.compiled", "tiny")
        (folder / source.name).write_text(text)
    (folder / "constants.py").write_text("OFFSET = 0.0\n")
    (folder / "inner.py").write_text(INNER.format(factor="3.0"))
    (folder / "outer.py").write_text(OUTER)
    return folder


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    return tmp_path / "cache"


@functools.cache
def forking() -> subprocess.Popen:
    """Ends with its standard input, at the latest with this process."""
    return subprocess.Popen(
        [sys.executable, "-c", FORKING], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def _forking_ends() -> Iterator[None]:
    yield
    if forking.cache_info().currsize:
        with forking():
            forking.cache_clear()


def python(path: Path, code: str, cache: Path, **environment: str) -> subprocess.CompletedProcess:
    """A new process that finds ``tiny`` in a folder or an archive.

    Settings of numba need one that has not loaded it; loading it takes longer than all else.
    """
    ours = {"PYTHONPATH": str(path), "FLIPFLOW_CACHE_DIR": str(cache)}
    if environment or not hasattr(os, "fork"):
        return subprocess.run(
            [sys.executable, "-c", code], cwd=cache.parent, capture_output=True, text=True,
            env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **ours, **environment}, check=False,
        )  # fmt: skip
    request = {"folder": str(cache.parent), "environment": ours, "code": code}
    forking().stdin.write(json.dumps(request) + "\n")
    forking().stdin.flush()
    ended = int(forking().stdout.readline())
    told = ((cache.parent / name).read_text() for name in ("stdout", "stderr"))
    return subprocess.CompletedProcess(code, ended, *told)


def run(path: Path, cache: Path, before: str = "", **environment: str) -> tuple[float, int, str]:
    """Answer, number of cache hits and stderr of a fresh process."""
    done = python(path, before + RUN, cache, **environment)
    assert done.returncode == 0, done.stderr
    value, hits = done.stdout.split()[-2:]
    return float(value), int(hits), done.stderr


def test_a_change_in_a_called_file_is_never_stale(package: Path, cache: Path) -> None:
    """numba alone keeps running the old callee: its cache looks at the caller's file only."""
    assert run(package.parent, cache) == (7.0, 0, "")
    assert run(package.parent, cache) == (7.0, 1, ""), "the second run loads it"
    (package / "inner.py").write_text(INNER.format(factor="5.0"))
    assert run(package.parent, cache)[:2] == (11.0, 0), "stale code was run"
    (package / "inner.py").write_text(INNER.format(factor="3.0"))
    assert run(package.parent, cache)[:2] == (7.0, 1), "the first folder still serves"


def test_a_kernel_moved_to_another_folder_is_still_watched(package: Path, cache: Path) -> None:
    """What counts is what is imported, wherever it lies."""
    run(package.parent, cache)
    moved = package / "room" / "inner.py"
    moved.parent.mkdir()
    (moved.parent / "__init__.py").write_text("")
    (package / "inner.py").rename(moved)
    (package / "outer.py").write_text(OUTER.replace("tiny.inner", "tiny.room.inner"))
    assert run(package.parent, cache)[:2] == (7.0, 0)
    assert run(package.parent, cache)[:2] == (7.0, 1)
    moved.write_text(INNER.format(factor="5.0"))
    assert run(package.parent, cache)[:2] == (11.0, 0), "stale code was run"


def test_a_constant_of_a_module_without_kernels_counts(package: Path, cache: Path) -> None:
    """numba freezes it into the code."""
    run(package.parent, cache)
    (package / "constants.py").write_text("OFFSET = 0.5\n")
    assert run(package.parent, cache)[:2] == (7.5, 0), "stale code was run"


def test_what_is_not_imported_does_not_count(package: Path, cache: Path) -> None:
    """A report or a command may change without a kernel being compiled anew."""
    run(package.parent, cache)
    (package / "report.py").write_text("")
    assert run(package.parent, cache)[:2] == (7.0, 1)


def test_a_source_edited_while_its_old_code_runs(package: Path, cache: Path) -> None:
    """The file on disk is then not what was compiled: nothing is kept under its name."""
    edit = f"open({str(package / 'inner.py')!r}, 'w').write({INNER.format(factor='5.0')!r})\n"
    late = f"from tiny.outer import answer; import time; time.sleep(0.05)\n{edit}"
    assert run(package.parent, cache, late)[0] == 7.0
    assert run(package.parent, cache)[:2] == (11.0, 0), "stale code was run"


@pytest.mark.parametrize("sources", [True, False], ids=["sources", "bytecode"])
def test_in_an_archive(package: Path, cache: Path, tmp_path: Path, sources: bool) -> None:
    """A program in a zip file is cached, and renewed, like any other; also without its sources."""
    archive = tmp_path / "program.zip"

    def pack() -> None:
        if not sources:
            compileall.compile_dir(package, legacy=True, quiet=1, force=True)
        with zipfile.ZipFile(archive, "w") as packed:
            for file in package.rglob("*.py" if sources else "*.pyc"):
                packed.write(file, file.relative_to(package.parent))

    pack()
    assert [run(archive, cache)[1] for _ in range(2)] == [0, 1]
    (package / "inner.py").write_text(INNER.format(factor="5.0"))
    pack()
    assert run(archive, cache)[:2] == (11.0, 0), "stale code was run"


def test_a_frozen_program(package: Path, cache: Path) -> None:
    """No file at all: its loader knows bytecode only, as those of frozen programs do."""
    freeze = (
        "import sys, importlib.util\n"
        "from importlib.machinery import PathFinder\n"
        "class Frozen:\n"
        "    def __init__(self, path): self.path = path\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] != 'tiny': return None\n"
        "        real = PathFinder.find_spec(name, path)\n"
        "        if real is None: return None\n"
        "        loader = Frozen(real.origin)\n"
        "        spec = importlib.util.spec_from_loader(\n"
        "            name, loader, is_package=real.submodule_search_locations is not None)\n"
        "        spec.submodule_search_locations = real.submodule_search_locations\n"
        "        return spec\n"
        "    def create_module(self, spec): return None\n"
        "    def get_source(self, name): return None\n"
        "    def get_code(self, name): return compile(open(self.path).read(), name, 'exec')\n"
        "    def exec_module(self, module):\n"
        "        exec(self.get_code(module.__name__), module.__dict__)\n"
        "sys.meta_path.insert(0, Frozen(None)); sys.frozen = True\n"
    )
    assert run(package.parent, cache, freeze)[:2] == (7.0, 0)
    assert run(package.parent, cache, freeze)[:2] == (7.0, 1)
    (package / "constants.py").write_text("OFFSET = 0.5\n")
    assert run(package.parent, cache, freeze)[:2] == (7.5, 0), "stale code was run"


def test_kernels_of_one_name_do_not_clash(package: Path, cache: Path) -> None:
    """Same name, same line, same file but for a constant, in two modules."""
    (package / "other.py").write_text(OUTER.replace("1.0", "2.0"))
    both = "from tiny.other import answer as other; print(other(2.0))\n"
    for _ in range(2):
        done = python(package.parent, both + RUN, cache)
        assert done.stdout.split()[:2] == ["8.0", "7.0"], done.stderr


def test_argument_types_have_code_of_their_own(package: Path, cache: Path) -> None:
    """Of two processes with other types neither hides what the other has kept."""
    run(package.parent, cache)
    whole = "from tiny.outer import answer; answer(2)\n"
    assert run(package.parent, cache, whole)[:2] == (7.0, 1)
    assert run(package.parent, cache, whole)[:2] == (7.0, 2)


def test_processes_fill_one_cache_together(package: Path, cache: Path) -> None:
    """Started at once on an empty folder, each gets the right answer and a whole file stays."""
    workers = [
        subprocess.Popen(
            [sys.executable, "-c", RUN], stdout=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(package.parent), "FLIPFLOW_CACHE_DIR": str(cache)},
        )
        for _ in range(3)
    ]  # fmt: skip
    assert {worker.communicate()[0].split()[0] for worker in workers} == {"7.0"}
    assert not list(cache.rglob("*.tmp"))
    assert run(package.parent, cache) == (7.0, 1, "")


SHARED = (
    "from __future__ import annotations\nfrom tiny.compile import kernel\n\n"
    "@kernel(shared=True)\ndef factor(x: float) -> {returned}:\n    return x * {factor}\n"
)


def test_a_shared_kernel_is_compiled_once(package: Path, cache: Path) -> None:
    """Two entries call the one code, which is fetched with them, and anew once it is changed."""
    (package / "inner.py").write_text(SHARED.format(returned="float", factor="3.0"))
    (package / "other.py").write_text(OUTER.replace("1.0", "2.0"))
    other = (
        "from tiny.other import answer; print(answer(2.0), sum(answer.stats.cache_hits.values()))"
    )
    assert run(package.parent, cache) == (7.0, 0, "")
    (kept,) = cache.rglob("tiny.inner.factor-*")
    written = kept.stat().st_mtime_ns
    assert python(package.parent, other, cache).stdout.split() == ["8.0", "0"]
    assert python(package.parent, other, cache).stdout.split() == ["8.0", "1"]
    assert kept.stat().st_mtime_ns == written
    kept.write_bytes(b"damaged")
    assert run(package.parent, cache)[:2] == (7.0, 1)
    (package / "inner.py").write_text(SHARED.format(returned="float", factor="5.0"))
    assert run(package.parent, cache) == (11.0, 0, "")
    assert run(package.parent, cache) == (11.0, 1, "")


def test_a_shared_kernel_returns_what_its_annotation_says(package: Path, cache: Path) -> None:
    (package / "inner.py").write_text(SHARED.format(returned="complex", factor="3.0"))
    done = python(package.parent, "import tiny.inner", cache)
    assert "TypeError: factor" in done.stderr
    (package / "inner.py").write_text(SHARED.format(returned="int", factor="3"))
    assert run(package.parent, cache) == (7.0, 0, "")


@pytest.mark.parametrize("source", [INNER, SHARED.replace("{returned}", "float")])
def test_a_kernel_for_kernels_is_not_run_from_python(
    package: Path, cache: Path, source: str
) -> None:
    """There is no machine code of it to run; the interpreter has to survive the attempt."""
    (package / "inner.py").write_text(source.format(factor="3.0"))
    call = "from tiny.outer import answer; from tiny.inner import factor; answer(2.0); factor(2.0)"
    done = python(package.parent, call, cache)
    assert done.returncode == 1
    assert "KeyError" in done.stderr or "TypeError: factor is called by kernels only" in done.stderr


def test_the_cache_stays_in_its_folder(package: Path, cache: Path) -> None:
    """Nothing is written beside the sources, and nothing anywhere before a kernel is called."""
    assert python(package.parent, "import tiny.outer", cache).returncode == 0
    assert not cache.exists()
    run(package.parent, cache)
    assert len(list(cache.glob("*/*"))) == 1
    assert {file.suffix for file in package.rglob("*")} == {".py"}


def test_without_compiling(package: Path, cache: Path) -> None:
    """numba's own switch still works."""
    done = python(package.parent, "from tiny.outer import answer; print(answer(2.0))", cache,
                  NUMBA_DISABLE_JIT="1")  # fmt: skip
    assert done.stdout.strip() == "7.0", done.stderr
    assert not cache.exists()


def test_one_set_of_options(package: Path, cache: Path) -> None:
    """An entry is lightly optimised, whoever compiles it, and numba's setting stays as it was.

    Another level asked for by the environment, which changes the making of machine code, has
    files of its own.
    """
    spy = (
        "import numba, numba.core.codegen as codegen\nfrom numba import config\n"
        "numba.njit(lambda x: x)(1.0)\n"
        "builders = {'_pass_builder', '_pass_manager_builder'} & set(vars(codegen.CPUCodegen))\n"
        "(name,) = builders; levels = set(); build = getattr(codegen.CPUCodegen, name)\n"
        "def spy(self, **options):\n"
        "    levels.add(int(options.get('opt', config.OPT))); return build(self, **options)\n"
        "setattr(codegen.CPUCodegen, name, spy)\n"
        "from tiny.outer import answer; answer(2.0)\n"
        "assert levels == {0, 1}, levels\nassert config.OPT == {}\n"
    )
    assert run(package.parent, cache, spy.replace("{}", "3"), NUMBA_OPT="3")[:2] == (7.0, 0)
    assert run(package.parent, cache, spy.replace("{}", "2"), NUMBA_OPT="2")[:2] == (7.0, 0)
    assert run(package.parent, cache)[:2] == (7.0, 1)


DAMAGE = {
    "empty": lambda _: b"",
    "a few bytes": lambda whole: whole[:7],
    "checksum only": lambda whole: whole[:32],
    "half": lambda whole: whole[: len(whole) // 2],
    "last byte missing": lambda whole: whole[:-1],
    "zeros": lambda whole: bytes(len(whole)),
    "zeros at the end": lambda whole: whole[:-512] + bytes(512),
    "a bit": lambda whole: whole[:1000] + bytes([whole[1000] ^ 1]) + whole[1001:],
    "garbage": lambda _: bytes(range(256)) * 20,
    "a pickle that would print": lambda _: b"cbuiltins\nprint\n(S'unpickled'\ntR.",
    "longer": lambda whole: whole + b"\n",
}


def test_a_damaged_file_is_compiled_anew(package: Path, cache: Path, tmp_path: Path) -> None:
    """It is never unpickled; it is said once, and a whole file takes its place."""
    run(package.parent, cache)
    (file,) = cache.glob("*/*")
    (damaged := tmp_path / "damaged").mkdir()
    for kind, damage in DAMAGE.items():
        (damaged / kind).write_bytes(damage(file.read_bytes()))
    call = (
        "import pathlib, shutil, sys\nfrom tiny.compile import kernel\n"
        "from tiny.outer import answer\n"
        f"for damaged in pathlib.Path({str(damaged)!r}).iterdir():\n"
        f"    shutil.copy(damaged, {str(file)!r})\n"
        "    for hits in (0, 1):\n"
        "        again = kernel(entry=True)(answer.py_func)\n"
        "        assert again(2.0) == 7.0\n"
        "        assert sum(again.stats.cache_hits.values()) == hits, damaged\n"
        "    print('end of', damaged.name, file=sys.stderr)\n"
    )
    done = python(package.parent, call, cache)
    assert done.returncode == 0, done.stderr
    for said in done.stderr.split("end of")[:-1]:
        assert said.count(f"compiled anew: {file}") == 1, done.stderr
    assert done.stderr.count("compiled anew") == len(DAMAGE)
    assert "unpickled" not in done.stdout


def test_a_whole_file_of_another_kernel(package: Path, cache: Path) -> None:
    """Copied under the wrong name it is not taken for the right one."""
    (package / "other.py").write_text(OUTER.replace("1.0", "2.0"))
    python(package.parent, "from tiny.other import answer; answer(2.0)", cache)
    (other,) = cache.glob("*/*")
    run(package.parent, cache)
    (right,) = cache.glob("*/tiny.outer.*")
    shutil.copy(other, right)
    assert run(package.parent, cache) == (7.0, 0, "")


def test_a_filled_cache_that_cannot_be_written_is_used(package: Path, cache: Path) -> None:
    """As one that is installed for all users, or an image of a container."""
    run(package.parent, cache)
    assert run(package.parent, cache, READ_ONLY) == (7.0, 1, "")


def test_a_cache_folder_that_cannot_be_written(package: Path, cache: Path, tmp_path: Path) -> None:
    """A file stands where the folder should be: it compiles all the same, and says why, once."""
    cache.write_text("not a folder")
    (scratch := tmp_path / "scratch").mkdir()
    whole = "from tiny.outer import answer; answer(2)\n"
    value, hits, said = run(package.parent, cache, whole, TMPDIR=str(scratch))
    assert (value, hits) == (7.0, 0)
    assert said.count("no writable cache folder") == 1
    assert "Not a directory" in said or "File exists" in said
    assert not list(scratch.iterdir()), "something stayed behind"


@pytest.mark.skipif(sys.platform == "win32", reason="files have no limit of size")
def test_a_full_disk(package: Path, cache: Path) -> None:
    """What could not be written whole does not stay."""
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
    value, hits, said = run(package.parent, cache, full)
    assert (value, hits) == (7.0, 0)
    assert said.count("no writable cache folder") == 1
    assert "File too large" in said
    assert not list(cache.glob("*/*"))


PARTS = (
    "from tiny.outer import answer\nfrom tiny.workers import compile_parts, work\n\n"
    "def whole(): answer(2)\n\ndef real(): answer(2.0)\n\ndef both(): answer(2); answer(2.0)\n\n"
    "PARTS = {'whole': [whole], 'real': [real], 'both': [both]}\n"
    "if __name__ == '__main__':\n    work(PARTS)\n"
)
AHEAD = (
    "from tiny.ahead import PARTS, compile_parts\n"
    "compile_parts('tiny.ahead', PARTS, lambda seconds: None)\n"
    "from tiny.outer import answer; answer(2)\n"
)


def test_workers_fill_the_cache_once(package: Path, cache: Path, tmp_path: Path) -> None:
    """The second time none is started."""
    (package / "ahead.py").write_text(PARTS)
    (scratch := tmp_path / "scratch").mkdir()
    assert run(package.parent, cache, AHEAD, TMPDIR=str(scratch)) == (7.0, 2, "")
    assert not list(scratch.iterdir())
    idle = "import subprocess, numpy.testing; subprocess.Popen = None\n"
    assert run(package.parent, cache, idle + AHEAD) == (7.0, 2, "")


def test_workers_share_a_temporary_folder(package: Path, cache: Path, tmp_path: Path) -> None:
    """Where no cache can be written their work still serves, with one word; then it is gone."""
    (package / "ahead.py").write_text(PARTS)
    (scratch := tmp_path / "scratch").mkdir()
    cache.write_text("not a folder")
    look = f"import os; assert len(os.listdir({str(scratch)!r})) == 1\n"
    value, hits, said = run(package.parent, cache, AHEAD + look, TMPDIR=str(scratch))
    assert (value, hits) == (7.0, 2), said
    assert said.count("\n") == said.count("no writable cache folder") == 1
    assert "Not a directory" in said or "File exists" in said
    assert not list(scratch.iterdir()), "something stayed behind"


def test_without_any_folder(package: Path, cache: Path) -> None:
    """No temporary folder either: no worker is started, as its work would be lost."""
    (package / "ahead.py").write_text(PARTS)
    cache.write_text("not a folder")
    nowhere = (
        "import subprocess, tempfile, numpy.testing; subprocess.Popen = None\n"
        "def mkdtemp(**options): raise FileNotFoundError(2, 'No usable temporary directory')\n"
        "tempfile.mkdtemp = mkdtemp\n"
    )
    value, hits, said = run(package.parent, cache, nowhere + AHEAD)
    assert (value, hits) == (7.0, 0)
    assert said.count("\n") == said.count("no writable cache folder") == 1


def test_a_numba_that_has_not_been_tried(package: Path, cache: Path) -> None:
    """It compiles by numba alone, to the same results, in files of its own."""
    log = "import logging; logging.basicConfig(level='DEBUG')\n"
    value, hits, said = run(package.parent, cache, UNTRIED + log)
    assert (value, hits) == (7.0, 0)
    assert "numba 0.999.0 has not been tried" in said
    assert list(cache.rglob("*.nbi"))
    assert run(package.parent, cache, UNTRIED)[:2] == (7.0, 1)
    (package / "inner.py").write_text(INNER.format(factor="5.0"))
    assert run(package.parent, cache, UNTRIED)[:2] == (11.0, 0), "stale code was run"
    assert {file.suffix for file in package.rglob("*")} == {".py"}
    blocked = cache.with_name("blocked")
    blocked.write_text("not a folder")
    value, hits, said = run(package.parent, blocked, UNTRIED)
    assert (value, hits, said.count("no writable cache folder")) == (11.0, 0, 1)
    done = python(package.parent, UNTRIED + "from tiny.inner import factor; factor(2.0)", cache)
    assert done.returncode == 0, done.stderr


def test_folders_out_of_use_are_dropped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A month after the last use; what is not of the cache is never touched."""
    monkeypatch.setenv("FLIPFLOW_CACHE_DIR", str(tmp_path))
    foreign, fresh = "photographs", "f" * 16
    old, used, idle = (f"{n:016x}" for n in range(3))
    CacheFolders().write(used, "file", b"content")
    for name in (old, idle, foreign):
        (tmp_path / name).mkdir()
    (tmp_path / used / "left.tmp").touch()
    past = time.time() - (KEPT_DAYS + 1.0) * DAY
    for path in (old, f"{used}/left.tmp", used, foreign):
        os.utime(tmp_path / path, (past, past))
    assert CacheFolders().read(used, "file") == b"content"
    CacheFolders().write(fresh, "file", b"")
    assert {p.name for p in tmp_path.iterdir()} == {used, idle, foreign, fresh}
    assert [p.name for p in (tmp_path / used).iterdir()] == ["file"]


def test_what_an_import_statement_may_name(package: Path, cache: Path) -> None:
    """Relative, in a function, in a branch, of a package's submodule; not for type checkers."""
    room = package / "room"
    room.mkdir()
    for name in ("__init__", "a", "b", "c", "d", "e"):
        (room / f"{name}.py").write_text("")
    (room / "f.py").write_text(
        "from typing import TYPE_CHECKING\nfrom . import a\nimport tiny.room.b as b\n"
        "def f():\n    if f:\n        from tiny.room import c\n    from .d import nothing\n"
        "if TYPE_CHECKING:\n    from tiny.room import e\n"
    )
    names = "from tiny.digest import closure; print(*sorted(closure('tiny.room.f')))"
    found = python(package.parent, names, cache).stdout.split()
    assert found == ["tiny", "tiny.room", *(f"tiny.room.{name}" for name in "abcdf")]


def kernel_modules() -> list[str]:
    root = Path(flipflow.__file__).parent
    return [
        ".".join(["flipflow", *file.relative_to(root).with_suffix("").parts])
        for file in root.rglob("*.py")
        if "\n@kernel" in file.read_text() or "\n@chosen_by_type" in file.read_text()
    ]


@pytest.mark.parametrize("module", kernel_modules())
def test_kernel_modules_import_only_what_kernels_need(module: str) -> None:
    """A change elsewhere must not compile anew; nor may they take names from the package itself.

    Those are loaded by name when first used, which no import statement tells.
    """
    rooms = {"compiled", "dynamics", "periodic", "continuation", "transient", "batch"}
    found = set(digest.closure(module))
    assert module in found
    tables = {"flipflow.errors", "flipflow.model", "flipflow.model.contact_law"}
    assert {name.split(".")[1] for name in found - tables} <= rooms
    assert "flipflow" not in found


def test_a_profiler_has_nothing_compiled_anew(package: Path, cache: Path) -> None:
    """Under one, numba changes the flags of a kernel's code when it is first called."""
    calls = "from tiny.outer import answer; answer(2.0); answer(2)"
    assert python(package.parent, calls, cache).returncode == 0
    kept = {file.name for file in cache.rglob("*.kernel")}
    profiled = f"import cProfile; cProfile.run({calls!r})"
    assert python(package.parent, profiled, cache).returncode == 0
    assert {file.name for file in cache.rglob("*.kernel")} == kept
