"""The public face does not change unseen: names, kinds and signatures against a snapshot.

Regenerate ``public_face.txt`` with ``python tests/unit/test_public_face.py`` and read the
difference before it is committed.
"""

from __future__ import annotations

import inspect
import typing
from enum import Enum
from pathlib import Path
from types import SimpleNamespace

import flipflow

# Libraries whose types stand in hints, and which are not loaded for them.
OUTSIDE = {
    "xr": SimpleNamespace(Dataset=object),
    "pd": SimpleNamespace(DataFrame=object),
    "Axes": object,
    "Coordinate": object,
}
SNAPSHOT = Path(__file__).with_name("public_face.txt")


class Bare(str):
    """An annotation that shows without quotes."""

    __slots__ = ()

    def __repr__(self):
        return str(self)


def describe():
    """One line a public name, and one a public attribute of each public class.

    A class is public when it has a public name, or when a public function, method or property
    returns it; how the latter are made is not.
    """
    public = {name: getattr(flipflow, name) for name in flipflow.__all__}
    classes = {name: value for name, value in public.items() if inspect.isclass(value)}
    waiting = [value for value in public.values() if callable(value)]
    while waiting:
        for cls in returned(waiting.pop()):
            if cls.__module__.startswith("flipflow.") and cls not in classes.values():
                classes[cls.__name__] = cls
                waiting.append(cls)
    lines = [
        f"function {name}{signature(value)}"
        if callable(value)
        else f"value {name}: {type(value).__name__}"
        for name, value in sorted(public.items())
        if name not in classes
    ]
    for name, cls in sorted(classes.items()):
        made = signature(cls) if name in public else ", returned"
        lines += ["", f"class {name}{made}", *attributes(cls)]
    return "\n".join(lines) + "\n"


def attributes(cls):
    # What Python's own types bring along hangs on its version.
    ours = {name for base in cls.__mro__ if base.__module__ != "builtins" for name in vars(base)}
    for name in sorted(ours | fields(cls)):
        if name.startswith("_"):
            continue
        value = plain(cls, name)
        if inspect.isfunction(value):
            yield f"  {name}{signature(value)}"
        else:
            kind = "field" if name in fields(cls) else "property"
            yield f"  {name}: {kind}"


def fields(cls):
    return {name for base in cls.__mro__ for name in vars(base).get("__annotations__", ())}


def plain(cls, name):
    """An attribute as it stands in the class, the function where it is a method."""
    value = inspect.getattr_static(cls, name, None)
    return value.__func__ if isinstance(value, (classmethod, staticmethod)) else value


def signature(value):
    """The signature on one line, annotations as written."""
    if inspect.isclass(value) and issubclass(value, Exception) and "__init__" not in vars(value):
        return "(*args)"
    if inspect.isclass(value) and issubclass(value, Enum):
        return "(value)"  # what Python writes of it hangs on its version
    found = inspect.signature(value)
    parameters = [
        p if p.annotation is p.empty else p.replace(annotation=Bare(p.annotation))
        for p in found.parameters.values()
    ]
    result = found.return_annotation
    if result not in {None, inspect.Signature.empty}:
        result = Bare(result)
    return str(found.replace(parameters=parameters, return_annotation=result))


def returned(value):
    """Classes that a function returns, or the public methods and properties of a class."""
    if inspect.isclass(value):
        members = (plain(value, name) for name in dir(value) if not name.startswith("_"))
        functions = [
            getattr(member, "fget", None) or getattr(member, "func", member) for member in members
        ]
    else:
        functions = [value]
    for function in functions:
        if inspect.isfunction(function):
            yield from parts(typing.get_type_hints(function, localns=OUTSIDE).get("return"))


def parts(hint):
    """The classes inside a hint such as ``tuple[Orbit, ...]``."""
    if isinstance(hint, type) and not typing.get_args(hint):
        yield hint
    for part in typing.get_args(hint):
        yield from parts(part)


def test_public_face_is_as_recorded():
    assert describe() == SNAPSHOT.read_text(encoding="utf-8")


if __name__ == "__main__":
    SNAPSHOT.write_text(describe(), encoding="utf-8")
