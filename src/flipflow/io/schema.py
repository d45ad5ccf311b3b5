"""JSON schema of the machine file, generated from its layout."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from flipflow.io.layout import (
    FORMAT,
    SECTION_SENTENCES,
    SECTIONS,
    Entry,
    Kind,
    sections_within,
)
from flipflow.model.fields import FIELDS, Field

Schema = dict[str, object]

_QUANTITY = r"^\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*[^0-9\s,.].*$"


def machine_schema() -> Schema:
    """Return the JSON schema (draft 2020-12) of a machine file.

    Returns
    -------
    dict
        The schema, ready for ``json.dumps``; editors check and complete machine files with it.
    """
    properties: Schema = {"format": {"const": FORMAT, "description": "Format of this file."}}
    outer = {name: entries for name, entries in SECTIONS.items() if "." not in name}
    properties.update({name: _section(name, entries) for name, entries in outer.items()})
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"flipflow/machine/{FORMAT}",
        "title": "flipflow machine file",
        "type": "object",
        "properties": properties,
        "required": sorted({field.key.split(".")[0] for field in FIELDS if field.required}),
        "additionalProperties": False,
    }


def _section(name: str, entries: tuple[Entry, ...]) -> Schema:
    sentence = SECTION_SENTENCES[name]
    if name == "sources":
        text = {"type": "string"}
        return {"type": "object", "description": sentence, "additionalProperties": text}
    inner = sections_within(name)
    table: Schema = {
        "type": "object",
        "properties": {
            **{entry.key: _entry(entry) for entry in entries},
            **{key: _section(f"{name}.{key}", SECTIONS[f"{name}.{key}"]) for key in inner},
        },
        "additionalProperties": False,
    }
    demands = [_demand(entry) for entry in entries if entry.kind == "quantity"]
    given = [demand for demand in demands if demand is not None]
    if given:
        table["allOf"] = given
    if name != "load_cases":
        return {**table, "description": sentence}
    table["required"] = ["name"]
    return {"type": "array", "description": sentence, "items": table}


def _demand(entry: Entry) -> Schema | None:
    """Demand a required field, as a total or in pieces."""
    if entry.field is None or not entry.field.required:
        return None
    ways: list[Schema] = [{"required": [entry.key]}]
    if entry.field.count is not None:
        ways.append({"required": [f"{entry.key}_each"]})
    return {"anyOf": ways}


def _entry(entry: Entry) -> Schema:
    schema: Schema = {"description": entry.sentence, **_KINDS[entry.kind](entry)}
    if entry.example != "" and entry.kind != "text":
        schema["examples"] = [entry.example]
    return schema


def _quantity(entry: Entry) -> Schema:
    return _number(entry.field) if entry.field is not None else {}


def _number(field: Field) -> Schema:
    if field.whole:
        return {"type": "integer", "minimum": int(field.lower)}
    if not field.unit:
        bound = "exclusiveMinimum" if field.lower_open else "minimum"
        plain = {"type": "number", bound: field.lower}
        return {"anyOf": [plain, {"type": "string", "pattern": r"%\s*$"}]}
    text: Schema = {"type": "string", "pattern": _QUANTITY, "x-unit": field.unit}
    if field.infinite:
        text["pattern"] = rf"{_QUANTITY}|^\s*\+?inf\s*$"
    return text


def _interval(entry: Entry) -> Schema:
    return {"type": "array", "items": _quantity(entry), "minItems": 2, "maxItems": 2}


def _temperatures(_: Entry) -> Schema:
    row = [{"type": "string", "pattern": _QUANTITY}, {"type": "number", "exclusiveMinimum": 0}]
    pair = {"type": "array", "prefixItems": row, "minItems": 2, "maxItems": 2}
    return {"type": "array", "items": pair, "minItems": 1}


def _torques(_: Entry) -> Schema:
    torque = {"anyOf": [{"type": "number", "minimum": 0}, {"type": "string", "pattern": _QUANTITY}]}
    row = [{"type": "string", "pattern": _QUANTITY}, torque]
    pair = {"type": "array", "prefixItems": row, "minItems": 2, "maxItems": 2}
    return {"type": "array", "items": pair, "minItems": 2}


def _split(_: Entry) -> Schema:
    share = {"type": "number", "minimum": 0, "maximum": 1}
    return {"type": "array", "items": share, "minItems": 2, "maxItems": 2}


def _choice(entry: Entry) -> Schema:
    return {"enum": list(entry.choices)}


def _text(_: Entry) -> Schema:
    return {"type": "string"}


_KINDS: Mapping[Kind, Callable[[Entry], Schema]] = {
    "quantity": _quantity,
    "each": _quantity,
    "material": _quantity,
    "interval": _interval,
    "temperatures": _temperatures,
    "torques": _torques,
    "split": _split,
    "choice": _choice,
    "text": _text,
}
