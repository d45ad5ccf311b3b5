"""Tolerances: shares against closed forms, against narrower studies, and machines that jump."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import flipflow as ff
from flipflow.plotting.dispatch import figure
from flipflow.plotting.plotly import described
from flipflow.plotting.study import map_figure, parallel_figure, study_tornado
from flipflow.report.blocks import FigureBlock, Note, Text
from flipflow.report.registry import blocks_of
from flipflow.report.study import spread_table, study_blocks
from flipflow.studies.tolerance import (
    confidence_interval,
    limits_in_words,
    limits_left_out,
    stands_out,
)

pytestmark = pytest.mark.numerical
OMEGA = 89.0


@pytest.fixture(scope="module")
def linear():
    return ff.load("ffs0827-linear")


def amplitude(machine):
    return float(ff.linear_response(machine, [OMEGA]).amplitude("relative")[0])


def judged(machine, vary, most, n=4096, **sampling):
    """Amplitude without stop is proportional to the eccentric moment."""
    found = ff.study(
        machine, vary, "relative_amplitude", OMEGA, sampling=ff.Sample(n=n, **sampling)
    )
    return ff.tolerance(found, ff.Limits(relative_amplitude=(0.0, most)))


def test_a_uniform_tolerance_passes_its_share(linear):
    """The limit lies 40 % of the half width above the middle: 70 %, at half the width 90 %."""
    m = linear.eccentric_moment
    found = judged(linear, {"eccentric_moment": (0.9 * m, 1.1 * m)}, 1.04 * amplitude(linear))
    assert found.share[0] == pytest.approx(0.7, abs=2e-3)
    assert found.halved[0, 0] == pytest.approx(0.9, abs=2e-3)
    assert found.gain[0, 0] == pytest.approx(0.2, abs=3e-3)
    assert found.costliest() == "eccentric_moment"
    expected = np.clip(0.5 + 0.2 / found.factors, 0.0, 1.0)
    np.testing.assert_allclose(found.scaled[:, 0], expected, atol=5e-3)
    low, high = found.share_interval[0]
    assert low < 0.7 < high


def test_a_normal_tolerance_passes_its_share(linear):
    m = linear.eccentric_moment
    vary = {"eccentric_moment": ff.Normal(m, 0.05 * m)}
    found = judged(linear, vary, 1.04 * amplitude(linear))
    assert found.share[0] == pytest.approx(stats.norm.cdf(0.8), abs=2e-3)
    assert found.halved[0, 0] == pytest.approx(stats.norm.cdf(1.6), abs=3e-3)
    known = np.isfinite(found.scaled[:, 0])
    assert known.sum() > 10
    expected = stats.norm.cdf(0.8 / found.factors[known])
    np.testing.assert_allclose(found.scaled[known, 0], expected, atol=5e-3)


def test_halved_is_what_a_study_of_half_the_tolerance_finds(linear):
    """Of fields that vary together, one deviation halved and the correlation kept."""
    k2, m2 = linear.shear_stiffness, linear.floating_mass
    most = 1.05 * amplitude(linear)

    def of(half):
        s, t = 0.04 * k2 * half, 0.04 * m2
        covariance = [[s * s, 0.5 * s * t], [0.5 * s * t, t * t]]
        vary = {"shear_stiffness": ff.Normal(k2, s), "floating_mass": ff.Normal(m2, t)}
        return judged(linear, vary, most, covariance=covariance)

    wide, narrow = of(1.0), of(0.5)
    assert 0.5 < wide.share[0] < 0.95
    assert wide.halved[0, 0] == pytest.approx(narrow.share[0], abs=0.012)
    low, high = wide.halved_interval[0, 0]
    assert low < narrow.share[0] < high
    assert abs(narrow.share[0] - wide.share[0]) > 0.02


def test_intervals_are_those_of_clopper_and_pearson():
    for passing, count in ((0, 40), (1, 40), (17, 40), (39, 40), (40, 40)):
        expected = stats.binomtest(passing, count).proportion_ci(method="exact")
        found = confidence_interval(np.array([float(passing)]), float(count))
        np.testing.assert_allclose(found[0], expected, rtol=1e-8, atol=1e-12)


def test_every_limit_in_every_case(screen):
    loads = [ff.Load(name="empty"), ff.Load(name="full", stiffness_factor=1.3)]
    vary, asked = {"clearance": (5e-3, 7e-3)}, ("relative_amplitude", "stop_force")
    found = ff.study(screen, vary, asked, OMEGA, load_cases=loads, sampling=ff.Sample(n=64))
    limits = ff.Limits(relative_amplitude=(5e-3, 7.2e-3), stop_force=8e3, speed=(80.0, 95.0))
    result = ff.tolerance(found, limits)
    size, force = (found.values[name][:, :, 0] for name in found.quantities)
    fine = (size >= 5e-3) & (size <= 7.2e-3) & (force <= 8e3)
    np.testing.assert_array_equal(result.passing[:, 0], fine.all(axis=1))
    assert result.share[0] == fine.all(axis=1).mean()
    np.testing.assert_array_equal(result.by_case[:, 0], fine.mean(axis=0))
    assert result.by_limit[2, 0] == (force <= 8e3).all(axis=1).mean()
    assert result.checked == ("relative_amplitude", "speed", "stop_force")
    assert result.by_limit[result.checked.index("speed"), 0] == 1.0
    assert 0.0 < result.share[0] < 1.0
    slow = ff.tolerance(found, replace(limits, speed=(90.0, 95.0)))
    assert slow.share[0] == 0.0
    assert math.isnan(result.jump_share[0])
    assert any("ask the study for omega_lb and omega_ub" in note for note in result.notes)


def test_a_fold_that_moves_through_the_speed_is_a_share_that_jumps(screen):
    """At the upper jump speed of the nominal machine about half of its like have jumped."""
    vary = {"stop_stiffness": ff.Normal(8.1e6, 2e5), "clearance": (5.8e-3, 6.2e-3)}
    nominal = ff.frequency_response(screen, (150.0, 230.0))
    omega = max(fold.omega for fold in nominal.folds) - 0.5
    asked = ("relative_amplitude", "omega_lb", "omega_ub")
    found = ff.study(screen, vary, asked, omega, sampling=ff.Sample(n=64))
    result = ff.tolerance(found, ff.Limits(relative_amplitude=(0.0, 0.02)))
    beyond = omega > found.values["omega_ub"][:, 0]
    np.testing.assert_array_equal(result.jumped[:, 0], beyond)
    assert result.jump_share[0] == beyond.mean()
    assert 0.2 < beyond.mean() < 0.8
    low, high = result.jump_interval[0]
    assert low < beyond.mean() < high
    size = found.values["relative_amplitude"][:, 0, 0]
    assert size[beyond].max() < 0.5 * size[~beyond].min()
    rows = [[cell.text for cell in row] for row in spread_table(found).rows]
    first, second = (row for row in rows if row[0] == "relative amplitude")
    assert (first[1], second[1]) == ("empty", "empty, jumped")
    assert (int(first[-1]), int(second[-1])) == ((~beyond).sum(), beyond.sum())
    assert first[2] != "-" == second[2]  # the nominal machine has not jumped
    assert {row[1] for row in rows if row[0] == "upper jump speed"} == {"empty"}
    assert "counted, the rest have none" not in spread_table(found).caption
    values = dict(found.values)
    values["omega_ub"] = np.where(np.arange(64)[:, None] < 50, values["omega_ub"], np.nan)
    said = spread_table(replace(found, values=values)).caption
    assert "Upper jump speed: 50 of 64 machines are counted, the rest have none." in said


def test_a_gain_within_the_confidence_interval_is_none(linear):
    """Of 90 machines, a tolerance that moves nothing brings shares that differ by chance."""
    m = linear.eccentric_moment
    vary = {"eccentric_moment": (0.9 * m, 1.1 * m), "main_mass": (915.99, 916.01)}
    most = 1.04 * amplitude(linear)
    few, many = (judged(linear, vary, most, n=n, method="monte-carlo") for n in (90, 4096))
    assert few.gain[1, 0] != 0.0
    assert not stands_out(few)[1, 0]
    assert stands_out(many)[:, 0].tolist() == [True, False]
    assert many.costliest() == "eccentric_moment"
    assert [bar.colour for bar in figure(many).panels[1].bars] == ["allowed", "mark"]
    assert "may be chance" in figure(many).caption
    none = replace(few, halved=few.halved[1:], halved_interval=few.halved_interval[1:],
                   names=few.names[1:], distributions=few.distributions[1:])  # fmt: skip
    assert none.costliest() is None
    words = [block.text for block in blocks_of(none) if isinstance(block, Text)]
    assert words[0].endswith("halved one at a time, none stands out.")


def test_many_machines_are_translucent_lines(linear):
    """A line each, so that overlaid ones are darker; colours are named in legend and caption."""
    m = linear.eccentric_moment
    drawn = {}
    for n in (16, 256):
        found = ff.study(linear, {"eccentric_moment": (0.9 * m, 1.1 * m)}, "relative_amplitude",
                         OMEGA, sampling=ff.Sample(n=n))  # fmt: skip
        passing = np.arange(n) % 2 == 0
        drawn[n] = parallel_figure(found, passing, met="the one limit looked at")
        names = [trace.name for trace in drawn[n].panels[0].traces if trace.legend]
        assert names == ["does not", "meets the one limit looked at"]
        assert "Green: the machine meets the one limit looked at; red:" in drawn[n].caption
    lines = {n: [t for t in one.panels[0].traces if not t.legend] for n, one in drawn.items()}
    assert {n: len(some) for n, some in lines.items()} == {16: 16, 256: 256}
    assert {t.opacity for t in lines[16]} == {1.0}
    assert max(t.opacity for t in lines[256]) < 0.3
    whole = described(drawn[256])["data"]
    assert {item.get("opacity", 1.0) for item in whole} == {1.0, lines[256][0].opacity}


def test_large_numbers_in_figures_of_a_study_have_no_exponent(linear):
    """A stiffness that is held, levels of contours, and the ends of axes."""
    scales = np.array([0.9, 1.0])
    grid = ff.study(
        linear,
        {name: getattr(linear, name) * scales for name in ("eccentric_moment", "shear_damping")}
        | {"isolation_stiffness": linear.isolation_stiffness * np.array([1.0, 50.0])},
        "relative_amplitude", OMEGA,
    )  # fmt: skip
    machine = linear.replace(isolation_stiffness=50.0 * linear.isolation_stiffness)
    held = map_figure(replace(grid, machine=machine))
    assert "Held: k1, kN/m = 31500." in held.caption
    notes = [note.text for panel in parallel_figure(grid).panels for note in panel.notes]
    assert "31500" in notes
    assert not any("e+" in text for text in notes)


def test_what_a_report_of_several_cases_speeds_and_fields_says(linear):
    """Shading and colours are of every load case; what is held, or left out, is named."""
    m, k = linear.eccentric_moment, linear.shear_stiffness
    loads = (ff.Load(name="empty"), ff.Load(name="soft", stiffness_factor=0.9))
    limits = ff.Limits(relative_amplitude=(0.0, 1.03 * amplitude(linear)))
    grid = ff.study(
        linear,
        {"eccentric_moment": m * np.array([0.9, 1.0]), "shear_stiffness": k * np.array([1.0, 1.2]),
         "isolation_stiffness": linear.isolation_stiffness * np.array([0.5, 0.97])},
        "relative_amplitude", OMEGA, load_cases=loads,
    )  # fmt: skip
    drawn = map_figure(grid, limits=limits)
    assert "Held: k1, kN/m = 611.1." in drawn.caption
    assert "every limit in every load case" in drawn.caption
    table = grid.values["relative_amplitude"][:, :, 0]
    met = (table <= limits.relative_amplitude[1]).all(axis=1)
    of_first = table[:, 0] <= limits.relative_amplitude[1]
    near = grid.columns["isolation_stiffness"] > 0.9 * linear.isolation_stiffness
    assert of_first[near].sum() > met[near].sum()
    assert int((drawn.panels[0].cells[0].kind == 1).sum()) == int(met[near].sum())
    sample = ff.study(
        linear, {"eccentric_moment": (0.9 * m, 1.1 * m)}, "relative_amplitude",
        OMEGA + np.arange(6.0), load_cases=loads, sampling=ff.Sample(n=16),
    )  # fmt: skip
    assert study_tornado(sample, "relative_amplitude").title.endswith(", load case empty")
    blocks = list(study_blocks(sample, ff.tolerance(sample, limits)))
    (table_,) = (b for b in blocks if getattr(b, "title", "") == "Machines that meet each limit")
    assert table_.caption == "The first 4 of 6 speeds; the share at each stands above."
    captions = [b.figure.caption for b in blocks if isinstance(b, FigureBlock)]
    assert any("meets every limit in every load case; red" in one for one in captions)


def test_a_list_has_no_cost_of_tolerances_and_notes_stand_once(linear):
    m = linear.eccentric_moment
    found = ff.study(
        linear, {"eccentric_moment": [0.9 * m, m, 1.1 * m]}, "relative_amplitude", OMEGA,
        sampling="list",
    )  # fmt: skip
    noted = replace(found, notes=("Damaged, and computed again: chunk 0.",))
    limits = ff.Limits(relative_amplitude=(0.0, amplitude(linear)))
    blocks = list(study_blocks(noted, ff.tolerance(noted, limits)))
    titles = [b.figure.title for b in blocks if isinstance(b, FigureBlock)]
    assert titles
    assert not [title for title in titles if title.startswith("What tolerances cost")]
    told = [b.text for b in blocks if isinstance(b, Note)]
    assert told.count(noted.notes[0]) == 1


def test_a_share_of_too_few_machines_is_a_mark_not_a_line_of_one_point(linear):
    """The figure was empty, and did not say why."""
    limits = ff.Limits(relative_amplitude=(0.0, 1.0))
    vary = {"shear_stiffness": (0.99 * linear.shear_stiffness, 1.01 * linear.shear_stiffness)}
    shares = []
    for n in (16, 256):
        study = ff.study(linear, vary, "relative_amplitude", OMEGA, sampling=ff.Sample(n=n))
        drawn = figure(ff.tolerance(study, limits))
        (share,) = (one for one in drawn.panels[0].traces if one.name.startswith("share"))
        shares.append((share.x.size, share.symbol, "Other factors need" in drawn.caption))
    assert shares[0] == (1, "circle", True)
    assert shares[1][0] > 1
    assert shares[1][1:] == (None, False)


def test_limits_that_were_not_looked_at_are_named():
    start = ff.PassingLimits(stop_force=9e3)
    limits = ff.Limits(stop_force=8e3, shear_strain=0.2, start=start)
    assert limits_in_words(limits, ("stop_force",)) == "the one limit looked at"
    named = ("shear strain", "stop force at start")
    assert limits_left_out(limits, ("stop_force",)) == named
    limits = replace(limits, start=None)
    assert limits_in_words(limits, ("stop_force", "shear_strain")) == "every limit"


def test_what_is_refused(linear):
    grid = ff.study(linear, {"main_mass": np.array([900.0, 930.0])}, "stroke", OMEGA)
    with pytest.raises(ff.InputError, match="not built by chance"):
        ff.tolerance(grid, ff.Limits(relative_amplitude=(0.0, 1.0)))
    drawn = ff.study(linear, {"main_mass": (900.0, 930.0)}, "stroke", OMEGA,
                     sampling=ff.Sample(n=4))  # fmt: skip
    with pytest.raises(ff.InputError, match="did not ask for relative_amplitude"):
        ff.tolerance(drawn, ff.Limits(relative_amplitude=(0.0, 1.0)))
    with pytest.raises(ff.InputError, match="none can be checked"):
        ff.tolerance(drawn, ff.Limits())


def test_a_list_has_a_share_and_no_tolerance(linear):
    masses = np.linspace(880.0, 950.0, 8)
    found = ff.study(linear, {"main_mass": masses}, "relative_amplitude", OMEGA, sampling="list")
    result = ff.tolerance(found, ff.Limits(relative_amplitude=(0.0, amplitude(linear))))
    assert (
        result.share[0] == (found.values["relative_amplitude"][:, 0, 0] <= amplitude(linear)).mean()
    )
    assert np.isnan(result.halved).all()
    assert result.costliest() is None


@pytest.mark.parametrize(("asked", "share", "words"), [
    (("jump_margin",), 1.0, "8 of 8 machines jump at other folds than omega_lb and omega_ub"),
    ((), 0.0, "8 of 8 machines may jump, as jump_margin would tell, at other folds"),
])  # fmt: skip
def test_folds_of_another_resonance_are_told(asked, share, words):
    """Two stable motions, .460 and .373 mm, between folds at 49.9 and 58.5 rad/s, far below."""
    machine = ff.FlipFlowScreen(
        main_mass=3149.1830805158397, floating_mass=1108.5368420018617,
        eccentric_moment=5.396972025220704, isolation_stiffness=467523.86470786564,
        isolation_damping=3841.665711034478, shear_stiffness=5066615.69832155,
        shear_damping=2558.2072349656282, stop_stiffness=36333156.38700062,
        stop_damping=26558.491314624025, clearance=0.00019443730600225996,
    )  # fmt: skip
    gap = machine.clearance
    study = ff.study(
        machine, {"clearance": (0.995 * gap, 1.005 * gap)},
        ("relative_amplitude", "omega_lb", "omega_ub", *asked), 52.65522,
        sampling=ff.Sample(n=8, seed=0),
    )  # fmt: skip
    found = ff.tolerance(study, ff.Limits(relative_amplitude=(0.0, 1.0)))
    assert found.coexisting == pytest.approx([share])
    assert len(found.notes) == 1
    assert found.notes[0].startswith(words)
