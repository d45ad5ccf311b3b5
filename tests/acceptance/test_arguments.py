"""Arguments of the public face: numpy's numbers are numbers, and what is none is refused."""

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import InputError


@pytest.fixture(scope="module")
def screen():
    return ff.load("ffs0827")


@pytest.mark.parametrize("number", [np.int64(900), np.float32(900.0), np.float64(900.0)])
def test_fields_take_numbers_of_numpy(screen, number):
    assert screen.replace(main_mass=number) == screen.replace(main_mass=900.0)


def test_speeds_and_counts_take_numbers_of_numpy(screen):
    (plain,) = ff.periodic_orbits(screen, 120.0)
    (orbit,) = ff.periodic_orbits(screen, np.int64(120))
    assert np.array_equal(orbit.state, plain.state)
    branch = ff.frequency_response(screen, (100.0, 130.0))
    assert branch.orbits_at(np.int64(120))[0].omega == 120.0
    cells = ff.basins(
        screen, np.float32(120), {"relative": [0.0]}, most_turns=np.int64(100), threads=np.int64(1)
    )
    assert cells.labels.tolist() == [0]


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda s: ff.ramp(s, 120.0, 1.0), "two different speeds"),
        (lambda s: ff.ramp(s, (120.0, 120.0), 1.0), "two different speeds"),
        (lambda s: ff.simulate(s, 120.0, 5, disturbances=["blow"]), "ff.Impulse"),
        (lambda _: ff.continue_orbit(120.0, "omega", (100.0, 130.0)), "give a motion"),
        (lambda s: ff.periodic_orbits(s, 120.0, rng=-1), "whole number of at least 0"),
        (lambda s: ff.basins(s, 120.0, {"relative": [0.0]}, rng="x"), "whole number of at least 0"),
        (lambda s: ff.poincare_section(s, 120.0, 5, skip=-1), "skip = -1"),
        (lambda s: s.replace(main_mass=np.array([900.0])), "a number in kg"),
        (lambda s: s.replace(main_mass=np.bool_(True)), "a number in kg"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(screen, call, told):
    with pytest.raises(InputError) as caught:
        call(screen)
    assert told in str(caught.value)


def test_a_kind_of_point_that_there_is_not_is_refused(screen):
    """Of "folds" there were none, without a word, where the branch has two of kind "fold"."""
    branch = ff.frequency_response(screen, (100.0, 130.0))
    assert branch.points_of("fold") == branch.folds == ()
    over = ff.continue_orbit(branch.orbits_at(120.0)[0], "clearance", (5.9e-3, 6.1e-3))
    assert over.points_of("cusp") == ()
    for one in (branch, over):
        with pytest.raises(InputError, match=r"kind = 'folds': choose one of fold, contact begin"):
            one.points_of("folds")
    with pytest.raises(InputError, match=r"omega = '1146 rpm': give a number in rad/s, the branch"):
        branch.orbits_at("1146 rpm")


def test_a_limit_on_speed_outside_the_speeds_analysed_is_said(screen):
    region = ff.operating_region(screen, ff.Limits(speed=(1000.0, 2000.0)))
    assert region.feasible == ()
    assert any("outside the speeds analysed" in note for note in region.notes)
