"""The estimator of Sobol indices on functions whose indices are known in closed form."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from SALib.analyze import sobol
from scipy import stats

from flipflow.errors import MissingExtra
from flipflow.studies.sobol import saltelli_sample, sobol_indices
from judge import close

pytestmark = pytest.mark.numerical


def ishigami(u):
    """Ishigami's function with a = 7, b = 0.1 at points of the unit cube, (..., 3)."""
    x = np.pi * (2.0 * u - 1.0)
    return (
        np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])
    )


@pytest.fixture(scope="module")
def sample():
    return saltelli_sample(3, 4096, 0)


def indices(values, seed=0):
    return sobol_indices(values, np.random.default_rng(seed))


def test_ishigami(sample):
    """Closed form of the indices of Ishigami's function with a = 7, b = 0.1; estimates to 0.01."""
    found = indices(ishigami(sample)[:, :, None])
    close("first order", found.first_order[0], [0.3139, 0.4424, 0.0], abs=0.01)
    close("total", found.total[0], [0.5576, 0.4424, 0.2437], abs=0.01)
    assert found.groups[0] == 4096


def test_sample_changes_one_input_at_a_time(sample):
    assert sample.shape == (4096, 5, 3)
    for i in range(3):
        differs = np.any(sample[:, 0] != sample[:, i + 1], axis=0)
        assert differs.tolist() == [k == i for k in range(3)]
        np.testing.assert_array_equal(sample[:, i + 1, i], sample[:, -1, i])


def test_all_outputs_at_once_are_those_of_salib_one_by_one():
    """Indices and confidence intervals; SALib draws its resamples from a seeded generator."""
    u = saltelli_sample(3, 256, 3)
    values = np.stack([ishigami(u), u[..., 0] + 2.0 * u[..., 1], 5.0 + u[..., 2] ** 2], axis=2)
    found = indices(values, seed=7)
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[0.0, 1.0]] * 3}
    for k in range(3):
        known = sobol.analyze(problem, values[:, :, k].ravel(), calc_second_order=False, seed=7)
        for ours, theirs in (
            (found.first_order, "S1"), (found.total, "ST"),
            (found.first_order_confidence, "S1_conf"), (found.total_confidence, "ST_conf"),
        ):  # fmt: skip
            np.testing.assert_allclose(ours[k], known[theirs], rtol=1e-9, atol=1e-12)


def test_scipy_agrees_within_the_intervals(sample):
    found = indices(ishigami(sample)[:, :, None])
    uniform = stats.uniform(0.0, 1.0)
    other = stats.sobol_indices(
        func=lambda x: ishigami(x.T), n=4096, dists=[uniform] * 3, rng=np.random.default_rng(1)
    )
    first = found.first_order_confidence[0]
    assert np.all(np.abs(found.first_order[0] - other.first_order) <= 2.0 * first)
    assert np.all(np.abs(found.total[0] - other.total_order) <= 2.0 * found.total_confidence[0])


def test_the_interval_covers_the_truth_about_as_often_as_it_says():
    """Forty samples of 256 groups: the true index lies inside most of the 95 % intervals."""
    truth = np.array([0.5576, 0.4424, 0.2437])
    hits = []
    for seed in range(40):
        found = indices(ishigami(saltelli_sample(3, 256, seed))[:, :, None])
        hits.append(np.abs(found.total[0] - truth) <= found.total_confidence[0])
    assert np.mean(hits) > 0.85


def test_a_failed_value_takes_its_group_along_and_nothing_else(sample):
    values = np.stack([ishigami(sample), ishigami(sample)], axis=2)
    values[10:20, 2, 1] = np.nan
    found = indices(values)
    assert found.groups.tolist() == [4096, 4086]
    kept = np.delete(values[:, :, :1], np.arange(10, 20), axis=0)
    np.testing.assert_allclose(found.first_order[1], indices(kept).first_order[0], rtol=1e-12)
    np.testing.assert_allclose(found.total[1], indices(kept).total[0], rtol=1e-12)


def test_constant_outputs_have_indices_of_zero(sample):
    flat = np.full((*sample.shape[:2], 1), 0.1)
    found = indices(np.concatenate([flat, ishigami(sample)[:, :, None], 0.0 * flat], axis=2))
    assert found.constant.tolist() == [True, False, True]
    for table in (
        found.first_order, found.total, found.first_order_confidence, found.total_confidence,
    ):  # fmt: skip
        assert np.all(table[[0, 2]] == 0.0)
        assert np.all(np.isfinite(table[1]))


def test_where_every_group_failed_no_index_is_given(sample):
    found = indices(np.full((*sample.shape[:2], 1), np.nan))
    assert found.groups[0] == 0
    assert np.all(np.isnan(found.total))


def test_any_number_of_groups_may_be_drawn():
    assert saltelli_sample(2, 100, 0).shape == (100, 4, 2)


def test_without_salib_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "SALib.sample.sobol", None)
    with pytest.raises(MissingExtra, match="study"):
        saltelli_sample(2, 8, 0)


def test_resamples_in_which_nothing_varies_give_no_interval():
    """One group out of eight is unlike the others: many resamples leave it out."""
    values = np.ones((8, 3, 1))
    values[3] = [[2.0], [3.0], [1.5]]
    found = indices(values)
    assert np.isfinite(found.total).all()
    assert np.isnan(found.total_confidence).all()


def test_resamples_without_a_whole_group_give_no_interval():
    values = ishigami(saltelli_sample(1, 8, 0) * np.ones(3))[:, :, None]
    values[2:, 0] = np.nan
    found = indices(values)
    assert found.groups[0] == 2
    assert np.isfinite(found.mean).all()
