"""What the speed of a response is measured for: the contract of benchmarks/speed.py, untimed.

At least 300 points and steps of at most 2 rad/s from 5 to 250 rad/s, the stability and the error
of every point, both folds refined to 1e-6 rad/s, and nothing else found but contact.
"""

import numpy as np
import pytest

import flipflow as ff

pytestmark = pytest.mark.numerical


@pytest.fixture(scope="module")
def contract(script):
    return script("contract")


@pytest.fixture(
    scope="module",
    params=[ff.PiecewiseExact(), ff.HarmonicBalance(3), ff.HarmonicBalance(9)],
    ids=["exact", "H=3", "H=9"],
)
def branch(request, contract):
    return ff.frequency_response(ff.load("ffs0827"), contract.INTERVAL, request.param)


def test_response_is_what_its_speed_is_measured_for(branch, contract):
    contract.check_response(branch)


def test_exact_folds_are_the_reference_ones(branch, contract):
    """To 1e-6 rad/s for the exact method; a truncated series has folds of its own, farther off."""
    exact = isinstance(branch.method, ff.PiecewiseExact)
    tolerance = contract.FOLD_TOLERANCE if exact else 0.02
    found = [fold.omega for fold in branch.folds]
    np.testing.assert_allclose(found, contract.EXACT_FOLDS, rtol=0.0, atol=tolerance)


def test_every_point_has_an_error_or_none_is_promised(branch):
    """Infinite only beside a fold, where one Newton step bounds nothing."""
    assert branch.error.shape == branch.omega.shape
    assert not np.any(np.isnan(branch.error))
    promised = np.isfinite(branch.error)
    assert promised.mean() > 0.98
    folds = np.array([fold.omega for fold in branch.folds])
    for omega in branch.omega[~promised]:
        assert np.abs(folds - omega).min() < 1.0, omega
    bound = 1e-9 if isinstance(branch.method, ff.PiecewiseExact) else 1e-3
    assert branch.error[promised].max() < bound
