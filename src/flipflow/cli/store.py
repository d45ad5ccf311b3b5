"""``flipflow store info``: what the store of a study holds, and whether it is whole."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flipflow.cli.output import console, print_list, printable
from flipflow.errors import InputError, StoreError
from flipflow.model.numerals import rpm

if TYPE_CHECKING:
    from flipflow.batch.chunk_store import ChunkState, ChunkStore
    from flipflow.report.blocks import Block

MOST_NAMED = 20
REMEDY = "give the folder that flipflow study wrote, NAME.zarr or that of --store"


def info(
    store: Annotated[Path, typer.Argument(metavar="STORE", help="Folder of a study.")],
) -> None:
    """Say what the store of a study holds; every file is checked.

    Ends with exit code 4 where something is damaged.
    """
    from flipflow.batch.chunk_store import DAMAGED, META, ChunkStore  # noqa: PLC0415  quick --help
    from flipflow.report.terminal import show  # noqa: PLC0415

    if not store.is_dir():
        raise InputError("STORE", str(store), f"there is no such folder; {REMEDY}")
    if not (store / META).exists():
        raise InputError("STORE", str(store), f"it is no store of a study; {REMEDY}")
    kept = ChunkStore(store)
    states = list(kept.states())
    damaged = [state for state in states if state.word == DAMAGED]
    show(_contents(kept, states), console())
    named = [printable(str(state)) for state in damaged[:MOST_NAMED]]
    print_list(console(), "Damaged:", named)
    if damaged:
        count = f"{len(damaged)} chunk{'' if len(damaged) == 1 else 's'}"
        told = f"{store} is damaged: {count}; flipflow study --resume {store} redoes what is named."
        raise StoreError(told)


def _contents(kept: ChunkStore, states: list[ChunkState]) -> Block:
    from flipflow.batch.chunk_store import FINISHED, MISSING  # noqa: PLC0415  keeps --help quick
    from flipflow.report.blocks import Values  # noqa: PLC0415
    from flipflow.studies.study_plan import plan_from  # noqa: PLC0415

    plan = plan_from(kept)
    words = [state.word for state in states]
    missing = f", {words.count(MISSING)} to be computed" if MISSING in words else ""
    omega = plan.omega
    speeds = f"{rpm(float(omega.min()))} to {rpm(float(omega.max()))} rpm, {omega.size} speeds"
    sample = plan.design.sample
    rows = [
        ("Fields", ", ".join(plan.design.columns)),
        ("Quantities", ", ".join(plan.quantities)),
        ("Load cases", ", ".join(plan.cases)),
        ("Speeds", speeds if omega.size > 1 else f"{rpm(float(omega[0]))} rpm"),
        ("Machines", f"{plan.design.size}, {plan.design.sampling}"),
        ("Seed", "none" if sample is None else str(sample.seed)),
        ("flipflow", str(kept.manifest["flipflow"])),
        ("Inputs", kept.digest),
        ("Chunks", f"{words.count(FINISHED)} of {kept.chunks} finished{missing}"),
    ]
    return Values(tuple((label, printable(text)) for label, text in rows))
