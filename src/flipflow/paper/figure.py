"""What every figure of the paper is here: how it is computed, drawn, and what it claims."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from flipflow.model.screen import FlipFlowScreen
from flipflow.paper.claims import Claim
from flipflow.plotting.drawing import Drawing
from flipflow.plotting.figure import Figure
from flipflow.report.blocks import Table

Data = TypeVar("Data")


def no_tables(_data: object) -> tuple[Table, ...]:
    """For figures without tables."""
    return ()


@dataclass(frozen=True)
class PaperFigure(Generic[Data]):
    """A figure of the paper.

    Parameters
    ----------
    name
        "figure-08"; files and the command line use it.
    title
        What it shows.
    compute
        From the machine to the data that picture, tables and claims share.
    draw, tables
        From the data to the neutral figure or the drawing, and to tables for the page.
    claims
        What the paper says of it.
    findings
        What is found in it that the paper does not say.
    needs_stop
        Whether it is about the machine with stop.
    """

    name: str
    title: str
    compute: Callable[[FlipFlowScreen], Data]
    draw: Callable[[Data], Figure | Drawing]
    claims: tuple[Claim[Data], ...]
    tables: Callable[[Data], tuple[Table, ...]] = no_tables
    needs_stop: bool = True
    findings: tuple[Claim[Data], ...] = ()
