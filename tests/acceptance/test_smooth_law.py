"""Claim P1, Fig. 6 of Minerals 2024, 14, 406, and the balance that samples the smooth law."""

from __future__ import annotations

import math

import numpy as np
import pytest

import flipflow as ff
from flipflow.continuation.branch import Branch
from flipflow.errors import InputError, SampledContactWarning
from flipflow.model.smooth import smooth_force
from flipflow.paper.figure_06 import compare_laws
from judge import close, kinds, relative_amplitude

pytestmark = pytest.mark.numerical
WHAT_BELONGS = ["contact begin", "fold", "fold", "contact end"]


def sampled(screen, omega=(5.0, 250.0), **options) -> Branch:
    with pytest.warns(SampledContactWarning, match="sampled at fixed times"):
        return ff.frequency_response(screen, omega, ff.SampledHarmonicBalance(**options))


def test_smooth_force_is_the_papers_formula(screen) -> None:
    """Eq. (3) written out at a sharpness at which all its terms count; 1e-12."""
    e, k3, c3, eps = 6e-3, 8.1e6, 2605.0, 200.0
    x = np.linspace(-12e-3, 12e-3, 41)
    v = np.linspace(1.0, -2.0, 41)
    expected = (c3 * v + k3 * (x - e)) * (1.0 + np.tanh(eps * (x - e))) / 2.0
    expected += (c3 * v + k3 * (x + e)) * (1.0 - np.tanh(eps * (x + e))) / 2.0
    close("G", smooth_force(screen.stop(), x, v, eps), expected, rel=1e-12, abs=1e-9)
    one_sided = screen.replace(clearance_minus=math.inf).stop()
    close("open side", smooth_force(one_sided, -8e-3, 1.0), 0.0)


def test_claim_p1_three_conditions(screen) -> None:
    """Away from a layer of 6.9 um the laws differ by less than 1e-3 of what the switch moves.

    At the edge of the layer the smooth law lacks one part in a thousand of c3 x2' + k3 d, with d
    half the layer; inside, half of the damper's jump is missing at the gap itself.
    """
    stop, amplitude, omega = screen.stop(), 10e-3, 120.0
    stiff, damped, moving = compare_laws(stop, amplitude, omega)
    close("layer, m", stiff.layer_width, 6.907e-6, rel=1e-3)
    jumps = (0.0, 2605.0 * 1.2, 2605.0 * 1.2 * math.sqrt(1.0 - 0.6**2))
    for law, jump in zip((stiff, damped, moving), jumps, strict=True):
        edge = 1.0e-3 * (jump + 8.1e6 * law.layer_width / 2.0)
        assert 0.5 * edge < law.largest < 1.1 * edge, f"{law.condition}: {law.largest} N"
        assert law.rms < 0.2 * law.largest
        assert law.largest < 2e-4 * law.largest_force
        assert law.largest_inside >= 0.49 * jump
    with pytest.raises(InputError, match="beyond the gap"):
        compare_laws(stop, 5e-3, omega)


def test_moderate_sharpness_converges_to_exact_contact(screen, response) -> None:
    """Third order, many samples in the layer: the branch of HarmonicBalance(3), nothing false.

    The smooth law's own error falls with the square of 1 / sharpness: 1.5e-4 of the amplitude at
    1e4 per metre, tenfold at a third of it; what sampling adds is far less at 100 rad/s.
    """
    balance = relative_amplitude(response(ff.HarmonicBalance(3)), 100.0)
    off = []
    for sharpness in (3e3, 1e4):
        branch = sampled(screen, samples=2048, sharpness=sharpness)
        assert branch.complete
        assert kinds(branch) == WHAT_BELONGS
        assert len(branch.folds) == 2
        off.append(relative_amplitude(branch, 100.0) / balance - 1.0)
    close("order in 1 / sharpness", math.log(off[0] / off[1]) / math.log(1e4 / 3e3), 2.0, abs=0.1)
    close("folds", [f.omega for f in branch.folds], [206.415, 198.661], abs=0.02)
    assert off[1] < 2e-4


def test_paper_sharpness_converges_with_samples_away_from_trouble(screen, response) -> None:
    """At 1e6 per metre, 60 to 120 rad/s: amplitudes within a sample's share of the jump.

    One sample on the wrong side of the gap moves Lambda_1 by 2 c3 v / N, 5 N at N = 1024.
    """
    balance = relative_amplitude(response(ff.HarmonicBalance(3)), 120.0)
    off = [
        abs(relative_amplitude(sampled(screen, (60.0, 125.0), samples=n), 120.0) / balance - 1.0)
        for n in (64, 1024)
    ]
    assert off[1] < 1e-4
    assert off[0] < 5e-3


def test_paper_sharpness_shows_false_turning_points_and_says_so(screen) -> None:
    """Third order, 1024 samples, as the paper: dozens of turning points, of which two are real.

    Where each lies is an accident of the samples; that there are false ones is not.
    """
    branch = sampled(screen, (100.0, 210.0))
    assert len(branch.folds) > 10
    assert any("sampled at fixed times" in note for note in branch.notes)
    close("largest amplitude", branch.amplitude("relative").max(), 40.0e-3, rel=0.01)


def test_a_sharper_switch_does_not_finish_and_the_status_says_so(screen) -> None:
    """At 1e8 per metre no sample is ever in the layer, and each one that crosses a gap is a jump.

    Where the branch ends depends on its steps; on the way it turns where the machine does not.
    Public codes that sample the piecewise law stall between 141 and 190 rad/s.
    """
    branch = sampled(screen, (60.0, 210.0), sharpness=1e8)
    assert branch.status.name in {"STEP_TOO_SMALL", "POINT_LIMIT"}
    assert not branch.complete
    assert 140.0 < branch.omega[-1] < 206.0
    assert len(branch.folds) > 10


def test_results_survive_a_file(screen, tmp_path) -> None:
    branch = sampled(screen, (90.0, 110.0), samples=256, sharpness=1e4)
    ff.save(branch, tmp_path / "sampled.json")
    again = ff.open_result(tmp_path / "sampled.json")
    assert again.method == branch.method
    assert again.notes == branch.notes
    close("again", again.amplitude("main"), branch.amplitude("main"), rel=1e-13)


@pytest.mark.parametrize(
    "options",
    [{"samples": 12}, {"sharpness": 0.0}, {"sharpness": math.nan}, {"samples": 1e3}],
    ids=str,
)
def test_bad_options_are_refused(options) -> None:
    with pytest.raises(InputError, match=next(iter(options))):
        ff.SampledHarmonicBalance(**options)


def test_only_the_papers_law_is_sampled(screen) -> None:
    clipped = screen.replace(stop_law="compression-only")
    with pytest.raises(InputError, match="smooth form"):
        ff.frequency_response(clipped, (5.0, 50.0), ff.SampledHarmonicBalance())
