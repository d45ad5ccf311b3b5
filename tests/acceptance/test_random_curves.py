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


def test_a_fold_at_a_corner_whose_multiplier_is_close_to_1_by_chance(curves) -> None:
    """It was taken for a fold of the map, and did not start; the end at a grazing was 4 % off."""
    _, kind, end, points, _, off = curves.follow(132, 322025456)
    assert kind == "fold"
    assert end == "MEETS_GRAZING"
    assert points > 100
    assert off < 1e-5


def test_where_multipliers_jump_at_another_touch_of_a_stop_there_is_no_curve(curves) -> None:
    """It did not start, and said nothing."""
    found = curves.follow(34, 1601462192)
    assert found[1:4] == ("period doubling", curves.SAYS_WHY, 0)
