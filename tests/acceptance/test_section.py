"""Poincare sections and spectra against what is known of the motions."""

from __future__ import annotations

import numpy as np
import pytest

import flipflow as ff
from judge import close

pytestmark = pytest.mark.numerical


@pytest.fixture(scope="module")
def screen() -> ff.FlipFlowScreen:
    return ff.load("ffs0827")


@pytest.fixture(scope="module")
def chain() -> ff.MechanicalSystem:
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    stop = ff.ClearanceSpring([1.0, 0.0], 100.0, 0.0, 1.0, np.inf)
    return ff.MechanicalSystem(np.eye(2), 0.03 * K, K, (stop,), ff.HarmonicForce([0.0, 0.1]))


def test_a_periodic_motion_is_one_point(screen) -> None:
    points = ff.poincare_section(screen, 120.0, 50)
    exact = ff.frequency_response(screen, (100.0, 130.0)).orbits_at(120.0)[0]
    assert np.abs(points.states - exact.state).max() < 1e-9
    assert points.displacement("relative").shape == (50,)


def test_two_periods_are_two_points(chain) -> None:
    """Two-mass chain: beyond 0.7388 the upper motion repeats after two periods."""
    upper = next(o for o in ff.periodic_orbits(chain, 0.74, 2) if o.periods == 2)
    states = ff.poincare_section(chain, 0.74, 40, initial=upper, skip=0).states
    assert np.abs(states[::2] - states[0]).max() < 1e-8
    assert np.abs(states[1::2] - states[1]).max() < 1e-8
    assert np.abs(states[0] - states[1]).max() > 1e-3


def test_a_quasi_periodic_motion_fills_a_curve(chain) -> None:
    """Two-mass chain: past the Neimark-Sacker point; the points lie along a curve."""
    branch = ff.frequency_response(chain, (0.5, 0.8))
    start = branch.orbits_at(0.612)[0].state + np.array([1e-3, 0.0, 0.0, 0.0])
    states = ff.poincare_section(chain, 0.612, 600, initial=start, skip=4000).states
    assert np.unique(np.round(states[:, 0], 6)).size > 500, "it repeats"
    scaled = (states - states.mean(axis=0)) / states.std(axis=0)
    apart = np.linalg.norm(scaled[:, None] - scaled[None], axis=2) + 10.0 * np.eye(600)
    # 600 points over a cloud in four dimensions would lie some 0.4 apart.
    assert np.median(apart.min(axis=1)) < 0.03


def test_spectrum_of_an_orbit_has_its_first_harmonic_and_no_even_ones(screen) -> None:
    orbit = ff.frequency_response(screen, (100.0, 130.0)).orbits_at(120.0)[0]
    lines = ff.spectrum(orbit, "relative")
    t = np.linspace(0.0, orbit.period, 4097)[:-1]
    first = 2.0 * abs(np.mean(orbit.displacement("relative", t) * np.exp(-1j * 120.0 * t)))
    assert lines.frequencies[1] == pytest.approx(120.0)
    assert lines.amplitudes[1] == pytest.approx(first, rel=1e-6)
    assert lines.amplitudes[2::2].max() < 1e-9 * first
    assert lines.amplitudes[3] > 1e-3 * first


def test_spectrum_of_a_history_agrees_with_that_of_its_orbit(screen) -> None:
    history = ff.simulate(screen, 120.0, 300)
    lines = ff.spectrum(history, "relative", periods=64)
    orbit = ff.frequency_response(screen, (100.0, 130.0)).orbits_at(120.0)[0]
    exact = ff.spectrum(orbit, "relative")
    for k in (1, 3, 5):
        at = int(np.argmin(np.abs(lines.frequencies - k * 120.0)))
        assert lines.amplitudes[at] == pytest.approx(exact.amplitudes[k], rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("periods", [2, 3, 20])
def test_a_mean_does_not_leak_into_the_lines_beside_it(screen, periods) -> None:
    """Unequal gaps: the frames move about 2 mm beside where they rest."""
    moved = screen.replace(clearance=3e-3, clearance_minus=9e-3)
    orbit = ff.frequency_response(moved, (100.0, 140.0)).orbits_at(130.0)[0]
    exact = ff.spectrum(orbit, "relative").amplitudes
    history = ff.simulate(moved, 130.0, 40, initial=orbit)
    lines = ff.spectrum(history, "relative", periods).amplitudes
    close("mean and harmonics", lines[: 4 * periods : periods], exact[:4], rel=1e-4)
    assert exact[0] > 1e-3
    if periods > 2:
        assert lines[1] < 1e-3 * exact[0], "half of a harmonic stands on either side of it alone"


def test_bad_sections_and_spectra_are_refused(screen) -> None:
    with pytest.raises(ff.InputError, match="turns"):
        ff.poincare_section(screen, 120.0, 0)
    history = ff.simulate(screen, 120.0, 10, t=[0.0, 0.1, 0.3, 0.35])
    with pytest.raises(ff.InputError, match="even"):
        ff.spectrum(history, "relative")
    with pytest.raises(ff.InputError, match="periods"):
        ff.spectrum(ff.simulate(screen, 120.0, 10), "relative", periods=11)
    with pytest.raises(ff.InputError, match="periods = 1: give a whole number from 2"):
        ff.spectrum(ff.simulate(screen, 120.0, 10), "relative", periods=1)
    with pytest.raises(
        ff.InputError, match=r"1 forcing periods, .* times in each': give 2 forcing periods or more"
    ):
        ff.spectrum(ff.simulate(screen, 120.0, 1), "relative")
    rare = ff.simulate(screen, 120.0, 10, t=np.arange(4) * 2.0 * np.pi / 120.0 / 0.4)
    with pytest.raises(ff.InputError, match=r"0\.4 times in each"):
        ff.spectrum(rare, "relative")


def test_figures(tmp_path, screen) -> None:
    ff.figure(ff.poincare_section(screen, 120.0, 20)).write(tmp_path / "section.svg")
    ff.figure(ff.spectrum(ff.simulate(screen, 120.0, 60), "main")).write(tmp_path / "spectrum.svg")
    assert (tmp_path / "section.svg").stat().st_size > 1000
    assert (tmp_path / "spectrum.svg").stat().st_size > 1000
