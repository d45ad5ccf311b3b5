"""The sections of a report, registered for the type of result they are made from.

A section is a function from a result to blocks. Later work adds sections; no template changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeVar

from flipflow.report.blocks import Block

Result = TypeVar("Result")


class Part(IntEnum):
    """The parts of a report, in their order."""

    FIRST_PAGE = 0
    DETAILS = 1
    APPENDIX = 2


@dataclass(frozen=True)
class Section:
    """A registered section: where it stands, how it is made, whether the terminal shows it."""

    part: Part
    order: int
    build: Callable[[Any], Iterable[Block]]
    brief: bool


_SECTIONS: dict[type, list[Section]] = {}


def section(
    kind: type[Result], part: Part, order: int, *, brief: bool = False
) -> Callable[[Callable[[Result], Iterable[Block]]], Callable[[Result], Iterable[Block]]]:
    """Register a section for results of a type.

    Parameters
    ----------
    kind
        Type of the result.
    part, order
        Part of the report, and place within it.
    brief
        Whether the terminal shows it, too.
    """

    def register(
        build: Callable[[Result], Iterable[Block]],
    ) -> Callable[[Result], Iterable[Block]]:
        _SECTIONS.setdefault(kind, []).append(Section(part, order, build, brief))
        return build

    return register


def blocks_of(result: object, *, brief: bool = False) -> tuple[Block, ...]:
    """All blocks of a result's report, in order; with ``brief`` those of the terminal only."""
    found = [s for kind in type(result).__mro__ for s in _SECTIONS.get(kind, [])]
    found.sort(key=lambda s: (s.part, s.order))
    return tuple(block for s in found if s.brief or not brief for block in s.build(result))
