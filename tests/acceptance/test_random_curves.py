"""The sized-down twin of benchmarks/random_curves.py: a curve in two parameters of each machine."""

import pytest

MACHINES = 10
SEED = 20261130

pytestmark = [pytest.mark.numerical, pytest.mark.slow]


@pytest.fixture(scope="module")
def curves(script):
    return script("random_curves")


@pytest.mark.parametrize("number", range(MACHINES))
def test_a_curve_is_followed_to_its_ends(curves, number) -> None:
    """On a bound, closed or where another contact begins; every motion has its multiplier."""
    found = curves.follow(number, SEED)
    if found is None:
        pytest.skip("the machine has no special point, or the parameter drawn is not finite")
    _, kind, end, points, _, off = found
    assert end in curves.WHOLE, kind
    assert points > 20
    assert off < 1e-5
