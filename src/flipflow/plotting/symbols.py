"""Symbols of the literature in running text: "w_ea" and "k2" as letters with subscripts."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

SYMBOL = re.compile(
    r"\b(?:(?P<speed>w)(?:_?(?P<of>01|02|ea|ar|cs|lb|ub))?"
    r"|(?P<letter>[kcmx])(?P<number>[0-3]|f)|(?P<moment>m0r)|(?P<eps>eps)|(?P<million>1e6)"
    r"|(?P<micro>um))\b|(?<=\S) (?P<times>x) (?=\d)"
)
TIMES = "\N{MULTIPLICATION SIGN}"
# Keys of plotly.js whose values are read by people; "x2" elsewhere is an axis.
SHOWN = frozenset({"name", "legendgroup", "text", "ticktext", "hovertemplate"})
# What a renderer makes of a letter and its subscript.
Subscript = Callable[[str, str], str]


def with_symbols(text: str, subscript: Subscript) -> str:
    """The text with symbols for the words that stand for them: w_ea, w01, k2, m0r, x2, eps, x 1.3.

    Parameters
    ----------
    text
        As it is said in a terminal.
    subscript
        ``subscript("ω", "01")`` is the symbol in the renderer's language.
    """

    def symbol(match: re.Match[str]) -> str:
        found = match.groupdict()
        if found["speed"]:
            return subscript("ω", found["of"]) if found["of"] else "ω"
        if found["letter"]:
            return subscript(found["letter"], found["number"])
        if found["moment"]:
            return subscript("m", "0") + "r"
        if found["times"]:
            return f" {TIMES} "
        return "ε" if found["eps"] else "µm" if found["micro"] else "10⁶"

    return SYMBOL.sub(symbol, text)


def html_subscript(letter: str, index: str) -> str:
    """For HTML, and for plotly.js, which knows the same element."""
    return f"{letter}<sub>{index}</sub>"


def svg_with_symbols(svg: str) -> str:
    """A drawing whose words carry symbols; what follows a subscript returns to the line."""
    return re.sub(r"(?<=>)([^<>]+)(?=</text>)", lambda match: _svg_words(match[1]), svg)


def _svg_words(text: str) -> str:
    first, *rest = with_symbols(text, lambda a, b: f"{a}\0{b}\0").split("\0")
    pieces = [first]
    for index, after in zip(rest[::2], rest[1::2], strict=True):
        pieces.append(f'<tspan dy="0.27em" font-size="75%">{index}</tspan>')
        pieces.append(f'<tspan dy="-0.2em">{after}</tspan>' if after else "")
    return "".join(pieces)


def described_with_symbols(described: Any, *, shown: bool = False) -> Any:
    """Data and layout for plotly.js with symbols in every word that is shown."""
    if isinstance(described, Mapping):
        return {
            key: described_with_symbols(value, shown=key in SHOWN)
            for key, value in described.items()
        }
    if isinstance(described, list) and (shown or isinstance(next(iter(described), None), Mapping)):
        return [described_with_symbols(one, shown=shown) for one in described]
    if shown and isinstance(described, str):
        return with_symbols(described, html_subscript)
    return described
