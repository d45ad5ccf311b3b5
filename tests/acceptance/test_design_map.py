"""The design map: each cell is the machine's own region, each curve holds the cells' folds."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import flipflow as ff
from judge import close

pytestmark = pytest.mark.numerical
GAPS, STOPS, OMEGA = (4e-3, 6e-3, 8e-3), (6e6, 9e6), 120.0


@pytest.fixture(scope="module")
def found(screen) -> ff.DesignMap:
    return ff.design_map(screen, OMEGA, GAPS, STOPS, load=ff.Load(stiffness_factor=1.3))


def test_cells_are_machines(screen, found) -> None:
    """Speeds and amplitude of a cell as the machine of that gap and stop has them by itself."""
    for j, i in ((0, 0), (1, 2)):
        machine = screen.replace(clearance=GAPS[i], stop_stiffness=STOPS[j])
        region = ff.operating_region(machine)
        close("contact", found.omega_cs[j, i], region.omega_cs, rel=1e-9)
        close("width", found.width[j, i], region.upper - region.lower, rel=1e-6)
        empty, loaded = (
            ff.frequency_response(one, (5.0, 250.0)).orbit_from_below(OMEGA)
            for one in (machine, machine.loaded(ff.Load(stiffness_factor=1.3)))
        )
        close("amplitude", found.amplitude[j, i], empty.amplitude("relative"), rel=1e-9)
        share = loaded.amplitude("relative") / empty.amplitude("relative")
        close("share", found.steadiness[j, i], share, rel=1e-9)
    assert math.isnan(found.omega_lb[0, 0])


def test_curves_pass_through_the_cells(found) -> None:
    """At the widest gap the fold curve of a stop ends on both of the cell's folds."""
    grazing, *folds = found.curves
    assert grazing.kind == "grazing"
    assert len(folds) == len(STOPS)
    for j, curve in enumerate(folds):
        ends = np.sort(curve.omega[curve.along("clearance") == GAPS[-1]])
        close("folds", ends, [found.omega_lb[j, -1], found.omega_ub[j, -1]], abs=1e-6)
        assert len(curve.points_of("cusp")) == 1


def begins(found: ff.DesignMap) -> list[object]:
    """What the figure draws where contact begins."""
    return [one for one in ff.figure(found).panels[0].traces if one.name == "contact begins"]


def test_a_stop_that_is_never_touched_has_no_trace(found) -> None:
    """Fault: traces of nothing, with an entry of the legend."""
    nowhere = np.full_like(found.omega_cs, math.nan)
    bare = dataclasses.replace(found, omega_cs=nowhere, curves=())
    assert not begins(bare)
    nowhere[1] = found.omega_cs[1]
    (one,) = begins(dataclasses.replace(bare, omega_cs=nowhere))
    assert one.legend


def test_unequal_gaps_have_a_contact_speed_for_each_stop(screen) -> None:
    """The side touched last depends on the stop: its figure draws the cells."""
    found = ff.design_map(screen.replace(clearance_minus=7e-3), OMEGA, GAPS, STOPS)
    assert np.ptp(found.omega_cs[:, 0]) > 0.1
    assert found.curves
    assert all(curve.kind == "fold" for curve in found.curves)
    for trace, row in zip(begins(found), found.omega_cs, strict=True):
        close("drawn", trace.y, row * 30.0 / math.pi, rel=1e-12)


def test_bad_input(screen) -> None:
    for gaps, stops in (((6e-3,), STOPS), (GAPS, (-1.0, 2.0)), (GAPS, "many")):
        with pytest.raises(ff.InputError):
            ff.design_map(screen, OMEGA, gaps, stops)
