"""What the repository promises about its shape, its names, and what a start loads."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from pathlib import Path

import pytest

import flipflow

ROOT = Path(__file__).parents[2]
MOST_LINES = 600
VAGUE = {"utils", "util", "helpers", "helper", "common", "manager"}
HEAVY = ("numba", "scipy", "xarray", "plotly", "matplotlib", "pint")


def modules(*folders):
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def loaded_by(code):
    """Names among HEAVY that a fresh interpreter has loaded after running ``code``."""
    script = f"{code}\nimport sys\nprint('loaded:', *(m for m in {HEAVY!r} if m in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return done.stdout.rsplit("loaded:", 1)[1].split()


def test_no_module_is_longer_than_fits_a_head():
    too_long = {
        str(path.relative_to(ROOT)): lines
        for path in modules("src", "tests")
        if (lines := len(path.read_text(encoding="utf-8").splitlines())) > MOST_LINES
    }
    assert not too_long, f"modules of more than {MOST_LINES} lines: {too_long}"


def test_no_module_has_a_name_that_says_nothing():
    vague = [str(p.relative_to(ROOT)) for p in modules("src", "tests") if p.stem.lower() in VAGUE]
    assert not vague


def test_no_module_of_the_tests_has_the_name_of_a_script():
    """Both folders are on the path of tests that run scripts."""
    names = [{path.stem for path in (ROOT / of).glob("*.py")} for of in ("tests", "benchmarks")]
    assert all(names)
    assert not set.intersection(*names)


def imports_of(path, names):
    """Modules among ``names`` that a module imports, those for type checkers left out."""
    waiting, found = [ast.parse(path.read_text(encoding="utf-8"))], set()
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            waiting += node.orelse
            continue
        waiting += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            own = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= own & names or {node.module}
    return found & names


def test_no_modules_import_each_other_in_a_circle():
    """Imports within functions count: they too say what a module cannot do without."""
    paths = {
        ".".join(path.relative_to(ROOT / "src").with_suffix("").parts).removesuffix(
            ".__init__"
        ): path
        for path in modules("src")
    }
    graph = {name: imports_of(path, set(paths)) for name, path in paths.items()}
    assert graph["flipflow.plotting.figure"] >= {"flipflow.plotting.plotly"}
    graphlib.TopologicalSorter(graph).prepare()


def test_whoever_is_judged_by_the_reference_integrators_is_run_on_a_generic_processor():
    for path in modules("tests"):
        source = path.read_text(encoding="utf-8")
        if path.name.startswith("test_") and "\nfrom reference import" in source:
            assert "pytest.mark.numerical" in source, path


def test_import_loads_nothing_heavy():
    assert loaded_by("import flipflow") == []


def test_help_loads_nothing_heavy():
    code = (
        "import sys\nfrom flipflow.cli.main import main\nsys.argv = ['flipflow', '--help']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass"
    )
    assert loaded_by(code) == []


def test_kernels_are_compiled_only_through_the_decorator():
    for path in modules("src"):
        if path.name == "compile.py":
            continue
        source = path.read_text(encoding="utf-8")
        assert "njit" not in source, path
        assert "numba.jit" not in source, path


def test_names_for_type_checkers_are_those_loaded_at_run_time():
    tree = ast.parse(Path(flipflow.__file__).read_text(encoding="utf-8"))
    block = next(
        node
        for node in tree.body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    typed = {}
    for statement in block.body:
        assert isinstance(statement, ast.ImportFrom)
        for alias in statement.names:
            assert alias.asname == alias.name, f"write {alias.name} as {alias.name}"
            typed[alias.name] = statement.module
    assert typed == flipflow._HOME


@pytest.mark.parametrize("name", sorted(flipflow._HOME))
def test_public_name_can_be_loaded(name):
    assert getattr(flipflow, name).__doc__


def test_every_public_name_stands_in_the_documentation():
    listed = (ROOT / "docs/api/index.md").read_text(encoding="utf-8").split()
    assert set(flipflow._HOME) <= set(listed)


def test_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="frequency_respons"):
        flipflow.frequency_respons  # noqa: B018
