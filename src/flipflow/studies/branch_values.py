"""Quantities of every motion of a branch, as a table over speed needs them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flipflow.compiled.arrays import Real
from flipflow.continuation.branch import Branch
from flipflow.model.screen import FlipFlowScreen
from flipflow.studies.quantity_values import Working


def branch_values(
    screen: FlipFlowScreen, branch: Branch, names: Sequence[str]
) -> Mapping[str, Real]:
    """Quantities by name, SI, each (n,) over the points of a branch; NaN where data are missing."""
    jumps = tuple(fold.omega for fold in branch.folds)
    rows = np.full((branch.omega.size, len(names)), np.nan)
    for i in range(branch.omega.size):
        motion = Working(screen, branch.orbit(i), jumps)
        for k, name in enumerate(names):
            value = motion.value(name)
            rows[i, k] = np.nan if value is None else value
    return {name: rows[:, k] for k, name in enumerate(names)}
