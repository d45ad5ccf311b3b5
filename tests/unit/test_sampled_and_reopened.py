"""Branches of the sampled balance say what they are, and reopen as they were saved."""

import pytest

import flipflow as ff
from flipflow.errors import SampledContactWarning

pytestmark = pytest.mark.numerical
METHOD = ff.SampledHarmonicBalance(3, 256, 1e6)


@pytest.fixture(scope="module")
def screen():
    return ff.load("ffs0827")


def test_a_motion_of_the_sampled_balance_is_continued_as_one(screen):
    with pytest.warns(SampledContactWarning):
        first = ff.frequency_response(screen, (60.0, 70.0), METHOD)
    with pytest.warns(SampledContactWarning):
        branch = ff.continue_orbit(first.orbit(3), "omega", (60.0, 65.0))
    assert branch.method == METHOD


def test_special_points_reopen_with_their_stability(screen, tmp_path):
    branch = ff.frequency_response(screen, (190.0, 215.0), ff.HarmonicBalance(3))
    assert branch.folds
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    words = [point.orbit.stability for point in branch.special_points]
    assert [point.orbit.stability for point in again.special_points] == words


def test_the_step_at_which_a_branch_ended_reopens(screen, tmp_path):
    """Few samples and a sharp switch stall the branch close to the speed of first contact."""
    with pytest.warns(SampledContactWarning):
        branch = ff.frequency_response(screen, (60.0, 200.0), ff.SampledHarmonicBalance(3, 64, 1e9))
    assert not branch.complete
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    assert again.shortened_steps == branch.shortened_steps
