"""What a response of FFS0827 over 5 ... 250 rad/s has to be before its speed counts."""

import numpy as np

INTERVAL = 5.0, 250.0
LEAST_POINTS, LONGEST_STEP, FOLD_TOLERANCE = 300, 2.0, 1e-6
EXACT_FOLDS = 206.405559, 198.649272
BESIDE_FOLD = 0.01  # rad/s
SHARE = 0.01  # of a step


def check_response(branch):
    """Assert the contract: points, steps, stability of every point, both folds, nothing false."""
    assert branch.complete, branch.status.value
    assert (branch.omega[0], branch.omega[-1]) == INTERVAL
    assert branch.omega.size >= LEAST_POINTS, branch.omega.size
    step = np.abs(np.diff(branch.omega)).max()
    assert step <= LONGEST_STEP, step
    check_stability(branch)
    kinds = [point.kind for point in branch.special_points]
    assert kinds == ["contact begin", "fold", "fold", "contact end"], kinds
    for fold in branch.folds:
        off = abs(summit(branch, fold) - fold.omega)
        assert off <= FOLD_TOLERANCE, f"fold at {fold.omega} is off by {off}"


def check_stability(branch):
    """Every point has a word; "undetermined" is one only right beside a fold."""
    assert branch.stability.shape == branch.omega.shape
    assert set(branch.stability) <= {"stable", "unstable", "undetermined"}, set(branch.stability)
    folds = np.array([fold.omega for fold in branch.folds])
    for omega in branch.omega[branch.stability == "undetermined"]:
        assert np.abs(folds - omega).min() < BESIDE_FOLD, f"undetermined at {omega}"


def summit(branch, fold):
    """Omega where the branch turns, by a parabola through it and corrected points beside it."""
    index = int(fold.position)
    share = fold.position - index
    before, after = (
        branch.formulation.solver().between(branch.traced, index, share + sign * SHARE).omega
        for sign in (-1.0, 1.0)
    )
    bend = before - 2.0 * fold.omega + after
    assert bend != 0.0
    return fold.omega - (after - before) ** 2 / (8.0 * bend)
