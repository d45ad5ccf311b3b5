"""The public face in one script, line by line as users were promised it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff

WORDS = {"stable", "unstable", "undetermined"}


def test_machines(tmp_path, screen):
    (tmp_path / "a.toml").write_text(MACHINE, encoding="utf-8")
    assert ff.load(tmp_path / "a.toml").main_mass == 916.0
    project = ff.load_project(str(tmp_path / "a.toml"))
    assert (project.screen.clearance, project.speed) == (6e-3, None)
    assert isinstance(project.limits, ff.Limits)
    assert [case.name for case in project.load_cases] == ["empty"]
    assert project.document.project == ""

    assert screen.replace(clearance=8e-3).clearance == 8e-3
    assert screen.clearance == 6e-3
    one_sided = screen.replace(clearance=6e-3, clearance_minus=math.inf)
    assert one_sided.system().springs[0].gaps == (6e-3, math.inf)
    made = ff.FlipFlowScreen(
        main_mass=916.0, floating_mass=310.0, eccentric_moment=4.16825,
        isolation_stiffness=630e3, isolation_damping=9866.0,
        shear_stiffness=2700e3, shear_damping=2605.0,
        stop_stiffness=8100e3, stop_damping=2605.0, clearance=6e-3,
    )  # fmt: skip
    np.testing.assert_allclose(made.system().K, screen.system().K)
    loaded = screen.loaded(
        ff.Load(
            stiffness_factor=1.3, damping_factor=1.0, main_mass=0, floating_mass=0,
            temperature=None,
        )
    )  # fmt: skip
    assert loaded.shear_stiffness == pytest.approx(1.3 * screen.shear_stiffness)
    assert isinstance(screen.system(), ff.MechanicalSystem)


@pytest.mark.parametrize("force", [ff.Unbalance, ff.HarmonicForce])
def test_any_machine_goes_through_the_same_functions(force):
    spring = ff.ClearanceSpring(
        direction=[1.0, -1.0], stiffness=40.0, damping=0.1, clearance=1.0, clearance_minus=2.0
    )
    system = ff.MechanicalSystem(
        [[2.0, 0.0], [0.0, 1.0]], [[0.2, -0.1], [-0.1, 0.1]], [[9.0, -4.0], [-4.0, 4.0]],
        springs=(spring,), excitation=force([0.5, 0.0]),
    )  # fmt: skip
    r = ff.frequency_response(system, omega=(0.5, 1.0))
    assert (r.omega[0], r.omega[-1]) == (0.5, 1.0)
    assert r.amplitude(0).shape == r.omega.shape


@pytest.mark.parametrize("method", [None, ff.HarmonicBalance(harmonics=3)])
def test_branch(response, method):
    r = response(method)
    n = r.omega.size
    assert (r.omega[0], r.omega[-1]) == (5.0, 250.0)
    for name in ("main", "floating", "relative", 1):
        assert r.amplitude(name).shape == r.phase(name).shape == (n,)
    assert set(r.stability) <= WORDS
    np.testing.assert_array_equal(r.stable, np.asarray(r.stability) == "stable")
    assert r.multipliers.shape == (n, 4)
    sizes = np.abs(r.multipliers)
    assert np.all((sizes[:, :-1] >= sizes[:, 1:] * (1.0 - 1e-12)) | np.isnan(sizes[:, 1:]))
    assert r.error.shape == (n,)
    for point in (*r.special_points, *r.folds):
        assert point.kind
        assert 5.0 <= point.omega <= 250.0
        assert point.amplitude("relative") > 0.0
    assert len(r.folds) == 2


def test_orbits_and_branches_of_them(screen, exact):
    os = ff.periodic_orbits(screen, omega=203.0, max_periods=1, rng=0)
    assert [o.stable for o in os] == [True, False, True]
    o = os[0]
    assert (o.omega, o.periods) == (203.0, 1)
    motions = (o.displacement("relative"), o.velocity("main"), o.acceleration("floating"))
    for motion in (*motions, o.stop_force()):
        assert motion.shape == o.t.shape
    assert o.amplitude("relative") == pytest.approx(np.ptp(o.displacement("relative")) / 2, 1e-3)
    assert o.multipliers.shape == (4,)
    onward = ff.continue_orbit(o, "omega", (200.0, 206.0))
    assert (onward.omega.min(), onward.omega.max()) >= (200.0, 203.0)
    folds = ff.continue_fold(exact.folds[0], "clearance", (5.5e-3, 6.5e-3))
    assert folds.values.size > 2


def test_time_and_speed(screen):
    h = ff.simulate(screen, omega=204.0, periods=400, initial="rest", disturbances=())
    assert h.displacement("relative").shape == h.t.shape
    w = ff.sweep(screen, omega=np.array([202.0, 201.0, 200.0]))
    assert w.omega.tolist() == [202.0, 201.0, 200.0]
    assert w.amplitude("relative").shape == (3,)
    assert w.jumps == ()
    x, v = np.linspace(-0.02, 0.02, 5), np.array([0.0, 1.0])
    b = ff.basins(screen, omega=203.0, displacement={"relative": x}, velocity={"relative": v})
    assert b.labels.shape == (5, 2)
    assert b.shares.shape == (len(b.orbits),)


def test_questions(screen):
    region = ff.operating_region(screen, limits=None, load_cases=())
    assert 0.0 < region.omega_ea < region.omega_ar
    assert 0.0 < region.omega_cs < region.omega_lb < region.omega_ub
    assert (region.lower, region.upper) == (region.omega_cs, region.omega_lb)
    assert len(region.feasible) >= 1
    loading = ff.loading(screen, ff.Load(stiffness_factor=1.1))
    assert loading.with_stop.region.lower == pytest.approx(region.lower)
    vary = {"clearance": (5.4e-3, 6.6e-3)}
    d = ff.sensitivity(screen, vary, "relative_amplitude", omega=120.0, n=8, rng=0)
    assert d.first_order.shape == d.total.shape == (1,)


def test_files(tmp_path, exact):
    ff.figure(exact).write(str(tmp_path / "x.html"))
    assert (tmp_path / "x.html").stat().st_size > 1000
    ff.save(exact, tmp_path / "r.json")
    np.testing.assert_array_equal(ff.open_result(tmp_path / "r.json").omega, exact.omega)


MACHINE = """
[frames]
main_mass = "916 kg"
floating_mass = "310 kg"
[exciter]
eccentric_moment = "4168.25 kg mm"
[isolation]
stiffness = "630 kN/m"
damping = "9.866 kN s/m"
[shear_springs]
stiffness = "2700 kN/m"
damping = "2.605 kN s/m"
[stops]
stiffness = "8100 kN/m"
damping = "2.605 kN s/m"
clearance = "6 mm"
"""
