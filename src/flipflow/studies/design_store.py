"""What a search has looked at, generation by generation, in a store that grows as it runs.

A search is the same for the same duty and seed. One that goes on begins anew and takes what it has
looked at before from the store: it ends as one that was never stopped, bit for bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from flipflow import __version__
from flipflow.batch.chunk_store import FINISHED, ChunkStore, Layout, Variable, create_store
from flipflow.compiled.arrays import Real
from flipflow.model.duty import Duty
from flipflow.studies.candidates import Space
from flipflow.studies.documents import CODEC
from flipflow.studies.study_plan import refuse_other

SCHEMA = "flipflow/design-search/2"
SHARES = "share"


def search_store(folder: Path, space: Space, generations: int, population: int) -> ChunkStore:
    """The store of a search, made where none is there: a chunk is a generation.

    Raises
    ------
    StoreError
        When it cannot be written, is damaged, or is one of another duty.
    MissingExtra
        When zarr is not installed.
    """
    manifest = {
        "schema": SCHEMA,
        "flipflow": __version__,
        "duty": CODEC.form(Duty).write(space.duty),
        "generations": generations,
    }
    if not folder.exists():
        growing = {
            name: Variable(("candidate", name), np.array(np.nan))
            for name in (SHARES, "objective", "excess")
        }
        shape = {
            "candidate": generations * population,
            SHARES: len(space.genes),
            "objective": len(space.objectives),
            "excess": len(space.constraints),
        }
        create_store(folder, Layout(manifest, {}, growing, shape, population))
    kept = ChunkStore(folder)
    refuse_other(kept.manifest, manifest, folder, "search")
    return kept


def looked_at(kept: ChunkStore, generation: int, u: Real) -> tuple[Real, Real] | None:
    """Objectives and excesses of candidates (C, D), where the store knows them."""
    if generation >= kept.chunks or kept.state(generation).word != FINISHED:
        return None
    known, objective, excess = (
        kept.read(name, generation)[: u.shape[0]] for name in (SHARES, "objective", "excess")
    )
    return (objective, excess) if np.array_equal(known, u) else None


def keep(kept: ChunkStore, generation: int, found: Mapping[str, Real]) -> None:
    """Write a generation: shares, objectives and excesses.

    Raises
    ------
    StoreError
        When it cannot be written.
    """
    if generation >= kept.chunks:
        return
    rows = {name: np.full((kept.rows, one.shape[1]), np.nan) for name, one in found.items()}
    for name, one in found.items():
        rows[name][: one.shape[0]] = one
    kept.write(generation, rows)
