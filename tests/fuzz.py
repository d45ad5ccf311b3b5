"""Seeded fuzz of machine files, result files and calls: an InputError or what is documented.

Each case is made from a seed and its number. ``acceptance/test_odd_input.py`` runs a few,
``benchmarks/long_fuzz.py`` thousands.
"""

from __future__ import annotations

import copy
import gzip
import importlib.resources
import json
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import flipflow as ff
from flipflow.errors import FlipflowError, StoreError
from flipflow.io.check import check_project
from flipflow.io.results import SCHEMAS, document_of
from flipflow.io.template import template
from flipflow.model.project import Project
from flipflow.paper.reproduce import Reproduction
from flipflow.results.store import json_text
from odd_arguments import Call, classes, ending, functions, kinds, methods, odd

DOCUMENTS = Path(__file__).parent / "documents"
# Values as people mistype them, units and numbers beyond all machines, and what is no value.
WRITTEN = (
    '""', '"inf"', '"-inf kg"', '"nan kg"', '"1e999 kg"', '"1e-99999999999999999999 kg"', '"0 kg"',
    '"-5 kg"', '"5 kg kg"', '"1,5 kg"', '"5e kg"', '"kg"', '"5 lbf/in"', '"5 Kilogramm"', '"5 m"',
    '"1 mm"', '"850 rpm"', '"6 mm"', '"1e300 kN/m"', '"1e-300 kN/m"', '"5 %"', '"50 degC"',
    '"-300 degC"', '"x"', "0", "-1", "1.5", "12", "1e400", "9" * 400, "true", "nan", "inf", "[]",
    "{}", "[1, 2]", '["5 mm", "8 mm"]', '["8 mm", "5 mm"]', "[[1, 2], [3]]", '[["20 degC", 1.0]]',
    "1979-05-27", '"\\u0000"', '"\\u001b[31m"', '"\\u202e"', '"=1+1"', '"' + "k" * 5000 + '"',
    '"paper"', '"elasto-gap"', '"standing"', '"counter-flow"', '"star-delta"', "{a = {b = 1}}",
)  # fmt: skip
KEYS = (
    "x", "frames.x", '"\\u0007"', "k" * 3000, ".".join("a" * 300), "stops.clearance", "name",
    "format",
)  # fmt: skip
BYTES = (b"\x00", b"\xff", b"\x1b", b"[", b"]", b'"', b"=", b"\n", b"#", b"'", b"\xe2\x80\xae")
ODD_JSON = (
    None, True, 0, -1, 1.5, 10**400, 2**70, -(2**70), 1e308, "", "inf", "-inf", "nan", "x\0",
    "x" * 5000, [], {}, [[]], [[1.0], [1.0, 2.0]], [None], {"a": 1}, "flipflow/branch/1",
    [1.0, "x"], [[[1e300]]],
)  # fmt: skip


@cache
def machine_files() -> tuple[str, ...]:
    """Bundled machines and what ``flipflow new`` writes, as they stand."""
    folder = importlib.resources.files("flipflow.io") / "machines"
    texts = [
        one.read_text(encoding="utf-8") for one in folder.iterdir() if one.name[-5:] == ".toml"
    ]
    return (*sorted(texts), template())


def machine_file(seed: int, number: int) -> bytes:
    """A machine file with one to three things wrong, or odd."""
    rng = np.random.default_rng([seed, number, 1])
    texts = machine_files()
    lines = texts[rng.integers(len(texts))].splitlines()
    for _ in range(rng.integers(1, 4)):
        _spoil_line(lines, rng)
    content = "\n".join(lines).encode()
    if rng.random() < 0.2:
        at = rng.integers(len(content))
        content = content[:at] + BYTES[rng.integers(len(BYTES))] + content[at + rng.integers(2) :]
    if rng.random() < 0.05:
        content = content[: rng.integers(len(content))]
    return content


def _spoil_line(lines: list[str], rng: np.random.Generator) -> None:
    valued = [k for k, line in enumerate(lines) if "=" in line and line.lstrip()[:1] != "#"]
    if not valued:
        return
    at = valued[rng.integers(len(valued))]
    name, _, value = lines[at].partition("=")
    way = rng.integers(8)
    if way < 4:
        lines[at] = f"{name}= {WRITTEN[rng.integers(len(WRITTEN))]}"
    elif way == 4:
        del lines[at]
    elif way == 5:
        lines.insert(at, lines[rng.integers(len(lines))])
    elif way == 6:
        lines[at] = f"{KEYS[rng.integers(len(KEYS))]} ={value}"
    else:
        digits = "".join(c if c not in "0123456789" else str(rng.integers(10)) for c in value)
        lines[at] = f"{name}={digits}"


def read(content: bytes, folder: Path, *, force: bool) -> str:
    """What is wrong with the way in which reading and checking a machine file ends."""
    place = folder / "machine.toml"
    place.write_bytes(content)

    def checked() -> object:
        project = ff.load_project(place, force=force)
        json_text(document_of(check_project(project)))
        return project

    return ending(Call("load_project", checked, {}, (Project,)), {})


@cache
def documents() -> dict[str, Any]:
    """Results as flipflow has written them, by name."""
    return {
        path.name: json.loads(gzip.decompress(path.read_bytes()))
        for path in sorted(DOCUMENTS.glob("*.gz"))
        if path.stat().st_size < 100_000
    }


def result_file(seed: int, number: int) -> bytes:
    """A result's document with a few parts replaced, left out or doubled, or its text damaged."""
    rng = np.random.default_rng([seed, number, 2])
    names = list(documents())
    document = copy.deepcopy(documents()[names[rng.integers(len(names))]])
    for _ in range(rng.integers(0, 4)):
        _spoil_part(document, rng)
    content = json.dumps(document).encode()
    if rng.random() < 0.3:
        at = int(rng.integers(len(content)))
        way = rng.integers(4)
        if way == 0:
            content = content[:at]
        elif way == 1:
            content = content[:at] + b"[" * int(rng.integers(1, 200_000)) + content[at:]
        elif way == 2:
            content = content[:at] + b"9" * int(rng.integers(1, 6000)) + content[at:]
        else:
            content = content[:at] + bytes([rng.integers(256)]) + content[at + 1 :]
    return content


def _spoil_part(document: Any, rng: np.random.Generator) -> None:
    """Walk down a random way and spoil what is there."""
    here = document
    while True:
        if not here:
            return
        keys = list(here) if isinstance(here, dict) else list(range(len(here)))
        key = keys[rng.integers(len(keys))]
        if isinstance(here[key], (dict, list)) and rng.random() < 0.8:
            here = here[key]
            continue
        break
    way = rng.integers(5)
    if way == 0:
        del here[key]
    elif way == 1 and isinstance(here, list):
        here.insert(key, copy.deepcopy(here[key]))
    elif way == 2 and isinstance(here[key], float):
        here[key] *= float(rng.choice([-1.0, 0.0, 1e-300, 1e12, 1e300]))
    else:
        here[key] = copy.deepcopy(ODD_JSON[rng.integers(len(ODD_JSON))])


def opened(content: bytes, folder: Path) -> str:
    """What is wrong with the way in which opening a result, and saving it again, ends."""
    place = folder / "result.json"
    place.write_bytes(content)

    def again() -> object:
        result = ff.open_result(place)
        try:
            ff.save(result, folder / "again.json")
        except FlipflowError as error:
            raise StoreError(str(error)) from None
        return result

    return ending(Call("open_result", again, {}, (*SCHEMAS, tuple, Reproduction)), {})


@cache
def calls() -> tuple[Call, ...]:
    """Every call of the public face that takes arguments."""
    return tuple(call for call in (*functions(), *classes(), *methods()) if call.arguments)


def call(seed: int, number: int) -> tuple[str, str]:
    """A call with one to three odd arguments, in words, and what is wrong with its end."""
    rng = np.random.default_rng([seed, number, 3])
    one = calls()[rng.integers(len(calls()))]
    names = sorted(kinds())
    count = min(int(rng.integers(1, 4)), len(one.arguments))
    chosen = rng.choice(sorted(one.arguments), count, replace=False)
    words = {str(name): str(names[rng.integers(len(names))]) for name in chosen}
    given = {name: odd(word) for name, word in words.items()}
    if any(one.dear.get(name, lambda _value: False)(value) for name, value in given.items()):
        return str(words), ""
    return f"{one.name} {words}", ending(one, {**one.arguments, **given})


def findings(kind: str, seed: int, numbers: range, folder: Path) -> Iterator[str]:
    """What goes wrong, with the number by which it is made again."""
    for number in numbers:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            told = ""
            if kind == "machine files":
                force = bool(number % 2)
                wrong = read(machine_file(seed, number), folder, force=force)
            elif kind == "result files":
                wrong = opened(result_file(seed, number), folder)
            else:
                told, wrong = call(seed, number)
        if wrong:
            yield f"{kind} {number} {told}: {wrong}"
