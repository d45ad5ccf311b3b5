"""What the names of colours, dashes and symbols mean, for all renderers.

Colours differ in lightness as well as in hue, and every line also differs by symbol or dash, so
that a figure can be read in black and white.
"""

from __future__ import annotations

from collections.abc import Mapping

INK = "#1c2126"
FAINT = "#d9dde1"

COLOURS: Mapping[str, str] = {
    "relative": "#111417",
    "main": "#1f5fa8",
    "floating": "#c9571a",
    "case 0": "#111417",
    "case 1": "#1f5fa8",
    "case 2": "#c9571a",
    "case 3": "#2f8f6b",
    "case 4": "#8e4f9f",
    "case 5": "#8a8f94",
    "limit": "#a3262a",
    "speed": "#1c2126",
    "gap": "#6b7278",
    "mark": "#6b7278",
    "jump": "#1c2126",
    "allowed": "#2f8f6b",
    "beneath": "#eadfbf",
    "input": "#4b545c",
    "isolation": "#1f5fa8",
    "shear": "#c9571a",
    "stop": "#111417",
    "normal": "#2f8f6b",
}
FILLS: Mapping[str, str] = {
    "case band": "rgba(31,95,168,0.15)",
    "allowed": "rgba(47,143,107,0.17)",
    "contact": "rgba(90,98,105,0.24)",
    "contact minus": "rgba(90,98,105,0.13)",
}
TINTS: Mapping[str, str] = {
    "none": "#ffffff",
    "case 0": "#eceef0",
    "case 1": "#8fb7e6",
    "case 2": "#f6d9c4",
    "case 3": "#7fc4a6",
    "case 4": "#d9bfe2",
    "case 5": "#b4bac0",
}
DASHES: Mapping[str, str] = {"unstable": "dash", "undetermined": "dot"}
SYMBOLS = ("", "circle", "square", "triangle", "diamond", "cross")
HATCHES = ("", "/", "\\", "x", "-", ".")
CASES = 6

STABILITY_WORDS: Mapping[str, str] = {
    "stable": "returns after a small disturbance",
    "unstable": "does not return after a small disturbance",
    "undetermined": "on the edge: neither returns nor leaves",
}


def case_colour(index: int) -> str:
    """Name of the colour of a load case."""
    return f"case {index % CASES}"


def case_symbol(index: int) -> str | None:
    """Symbol of a load case; the first has none."""
    return SYMBOLS[index % CASES] or None
