"""What compiled code depends on: the sources that its module imports.

Sources come from the loaders of the modules, so that they are found in a zip file and in a frozen
program too. numba freezes every constant that a kernel sees into its code; a module counts
whether it defines kernels or not.
"""

from __future__ import annotations

import ast
import dis
import functools
import hashlib
import os
import sys
import time
from collections.abc import Iterable, Iterator
from importlib.machinery import ModuleSpec
from importlib.util import resolve_name
from pathlib import Path
from types import CodeType
from typing import NamedTuple

_STARTED = time.time()


class Import(NamedTuple):
    """One import statement: dots, module and names as in ``from ..module import names``."""

    level: int
    module: str
    names: tuple[str, ...] = ()


class Source(NamedTuple):
    """A module as its loader gives it."""

    content: bytes
    imports: frozenset[str]  # names of modules, and of what may be one
    changed: float  # seconds since the epoch; 0 where nobody knows


@functools.cache
def module_digest(module: str, compiled_by: str) -> str | None:
    """Digest of a module's :func:`closure` and of a text that says how it is compiled.

    None where nothing can be promised: a source cannot be read, or has been edited since this
    process began, which runs the code of before; and of what is typed in, or a script of its own.
    """
    if module == "__main__":
        return None
    try:
        sources = closure(module)
    except (ImportError, OSError, SyntaxError, ValueError):
        return None
    if module not in sources or any(source.changed > _STARTED for source in sources.values()):
        return None
    digest = hashlib.sha256(compiled_by.encode())
    for name, source in sorted(sources.items()):
        digest.update(f"\n{name} {len(source.content)}\n".encode())
        digest.update(source.content)
    return digest.hexdigest()[:16]


def closure(module: str) -> dict[str, Source]:
    """The module and all that it imports, of its own package and of this one."""
    packages = {module.partition(".")[0], __name__.partition(".")[0]}
    found: dict[str, Source] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in found or name.partition(".")[0] not in packages:
            continue
        if (source := _source(name)) is not None:
            found[name] = source
            waiting += source.imports
    return found


@functools.cache
def _source(name: str) -> Source | None:
    """Source of a module; None where there is no module of this name."""
    spec = _spec(name)
    if spec is None:
        return None
    content, imports = _content(spec)
    package = spec.name if spec.submodule_search_locations is not None else spec.parent
    # Asked after reading: what is edited in between counts as changed.
    return Source(content, frozenset(_modules(imports, package)), _changed(spec))


def _spec(name: str) -> ModuleSpec | None:
    """Where a module comes from; unlike ``importlib.util.find_spec`` nothing is imported."""
    spec = getattr(sys.modules.get(name), "__spec__", None)
    if isinstance(spec, ModuleSpec):
        return spec
    parent, _, _ = name.rpartition(".")
    path = None
    if parent:
        package = _spec(parent)
        if package is None or package.submodule_search_locations is None:
            return None
        path = package.submodule_search_locations
    found = (finder.find_spec(name, path) for finder in sys.meta_path)
    return next((spec for spec in found if spec is not None), None)


def _content(spec: ModuleSpec) -> tuple[bytes, Iterator[Import]]:
    """What the loader has of a module, best its source, and its import statements."""
    text = getattr(spec.loader, "get_source", lambda _: None)(spec.name)
    if text is not None:
        return text.encode(), _imports(ast.parse(text).body)
    code = getattr(spec.loader, "get_code", lambda _: None)(spec.name)
    if code is not None:
        return describe_code(code).encode(), _imports_of_code(code)
    if spec.loader is None:
        return b"", iter(())  # a folder that is a package without saying so
    if not spec.has_location or spec.origin is None:
        raise ImportError(f"the loader of {spec.name} has nothing to show", name=spec.name)
    # An extension module, or a module whose source pytest has rewritten.
    content = Path(spec.origin).read_bytes()
    return content, _imports(ast.parse(content).body) if spec.origin.endswith(".py") else iter(())


def _changed(spec: ModuleSpec) -> float:
    """When the file of a module, or the archive that holds it, was last written."""
    try:
        status = Path(getattr(spec.loader, "archive", spec.origin or "")).stat()
    except OSError:
        return 0.0
    # Only the time of the inode is never copied from another file; Windows has none.
    return status.st_mtime if os.name == "nt" else status.st_ctime


def _imports(body: Iterable[ast.AST]) -> Iterator[Import]:
    """Every import statement that is run, inside functions too."""
    for node in body:
        if isinstance(node, ast.Import):
            yield from (Import(0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield Import(node.level, node.module or "", tuple(alias.name for alias in node.names))
        elif isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            yield from _imports(node.orelse)
        elif not isinstance(node, ast.expr):
            yield from _imports(ast.iter_child_nodes(node))


def _imports_of_code(code: CodeType) -> Iterator[Import]:
    """The same, of a module that comes without source."""
    stack: list[object] = []
    for step in dis.get_instructions(code):
        if step.opname.startswith("LOAD_"):
            stack.append(step.argval)
        elif step.opname == "IMPORT_NAME":
            level, names = stack[-2:]
            yield Import(int(str(level)), step.argval, names if isinstance(names, tuple) else ())
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _imports_of_code(constant)


def _modules(imports: Iterable[Import], package: str | None) -> Iterator[str]:
    """Full names of all that these statements may import as a module."""
    for level, module, names in imports:
        base = resolve_name("." * level + module, package) if level else module
        yield from (f"{base}.{name}" for name in names)
        yield base
        if not names:
            # "import a.b" gives the name a.
            parts = base.split(".")
            yield from (".".join(parts[:count]) for count in range(1, len(parts)))


def describe_code(code: CodeType) -> str:
    """Bytecode with names and constants, the same in every process, unlike what marshal writes."""
    constants = [
        describe_code(each) if isinstance(each, CodeType)
        else sorted(map(repr, each)) if isinstance(each, frozenset) else repr(each)
        for each in code.co_consts
    ]  # fmt: skip
    names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
    arguments = (code.co_argcount, code.co_kwonlyargcount, code.co_flags)
    return repr((code.co_code, code.co_exceptiontable, names, arguments, constants))
