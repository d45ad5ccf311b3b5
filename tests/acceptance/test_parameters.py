"""Parameters of any machine: fields of a dataclass, and places in a plain system."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import flipflow as ff
from flipflow.errors import InputError
from judge import close

pytestmark = pytest.mark.numerical


@dataclass(frozen=True)
class Rig:
    """A mass on a spring against one stop."""

    mass: float = 1.0
    gap: float = 0.4
    name: str = "rig"

    def system(self) -> ff.MechanicalSystem:  # noqa: D102
        stop = ff.ClearanceSpring([1.0], 30.0, 1.0, self.gap, math.inf)
        force = ff.HarmonicForce([0.5])
        return ff.MechanicalSystem([[self.mass]], [[0.06]], [[1.0]], (stop,), force)


def upper(machine, omega: float, interval):
    found = ff.frequency_response(machine, interval).orbits_at(omega)
    return max(found, key=lambda orbit: orbit.amplitude(0))


def test_a_field_of_a_dataclass_is_followed() -> None:
    """Each point is a motion of the machine of its value, found there by itself."""
    orbit = upper(Rig(), 1.4, (0.9, 2.5))
    branch = ff.continue_orbit(orbit, "gap", (0.2, 0.6))
    assert branch.complete
    for i in (0, branch.values.size // 2, -1):
        alone = ff.frequency_response(Rig(gap=float(branch.values[i])), (0.9, 2.5)).orbits_at(1.4)
        sizes = np.array([one.amplitude(0) for one in alone])
        assert np.abs(sizes - branch.amplitude(0)[i]).min() < 1e-9


def test_a_fold_is_followed_over_the_mass() -> None:
    branch = ff.frequency_response(Rig(), (0.9, 2.5))
    fold = max(branch.folds, key=lambda one: one.omega)
    curve = ff.continue_fold(fold, "mass", (0.7, 1.4))
    assert curve.complete
    heavy = ff.frequency_response(Rig(mass=1.4), (0.5, 2.5))
    ends = [omega for omega, v in zip(curve.omega, curve.values, strict=True) if v == 1.4]
    assert np.abs(np.array([f.omega for f in heavy.folds])[:, None] - ends).min() < 1e-7


@pytest.mark.parametrize(
    ("path", "bounds", "changed"),
    [
        ("springs[0].clearance", (4e-3, 7e-3), {"clearance": 7e-3}),
        ("springs[0].stiffness", (6e6, 9e6), {"stop_stiffness": 9e6}),
        ("springs[0].damping", (1e3, 4e3), {"stop_damping": 4e3}),
        ("forcing", (0.8, 1.1), {"eccentric_moment": 1.1 * 4.16825}),
    ],
)
def test_places_in_a_plain_system(path: str, bounds, changed) -> None:
    """As the screen's own fields do; the clearance of equal gaps moves both sides."""
    screen = ff.load("ffs0827")
    plain = screen.system()
    orbit = upper(plain, 195.0, (5.0, 250.0))
    branch = ff.continue_orbit(orbit, path, bounds)
    assert branch.complete
    assert branch.values[-1] == bounds[1]
    alone = ff.frequency_response(screen.replace(**changed), (5.0, 250.0)).orbits_at(195.0)
    sizes = np.array([one.amplitude("main") for one in alone])
    assert np.abs(sizes - branch.amplitude(0)[-1]).min() < 1e-9
    close("one way back", branch.orbit(-1).omega, 195.0)


def test_a_saved_branch_over_a_place_opens_again(tmp_path) -> None:
    orbit = upper(ff.load("ffs0827").system(), 195.0, (5.0, 250.0))
    branch = ff.continue_orbit(orbit, "springs[0].clearance", (5.5e-3, 6.5e-3))
    ff.save(branch, tmp_path / "branch.json")
    again = ff.open_result(tmp_path / "branch.json")
    close("amplitudes", again.amplitude(0), branch.amplitude(0), abs=1e-15)


def test_a_branch_of_a_machine_that_no_file_holds_is_not_saved(tmp_path) -> None:
    branch = ff.continue_orbit(upper(Rig(), 1.4, (0.9, 2.5)), "gap", (0.35, 0.45))
    with pytest.raises(InputError, match="FlipFlowScreen or a MechanicalSystem"):
        ff.save(branch, tmp_path / "branch.json")


@pytest.mark.parametrize(
    ("machine", "field"),
    [
        (Rig(), "name"), (Rig(), "height"), (Rig().system(), "springs[1].clearance"),
        (Rig().system(), "clearance"), (Rig().system(), "springs[0].clearance_minus"),
    ],
)  # fmt: skip
def test_what_is_no_parameter_is_refused(machine, field: str) -> None:
    orbit = upper(machine, 1.4, (0.9, 2.5))
    with pytest.raises(InputError):
        ff.continue_orbit(orbit, field, (0.1, 1.0))
