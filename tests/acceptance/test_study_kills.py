"""Killed at random moments a study goes on as if nothing had been: threads, dask, its workers.

The sized-down twin of benchmarks/study_kills.py. Its outcome does not hang on when a kill comes.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("zarr")
pytest.importorskip("distributed")
# Worker processes of dask end by themselves, some time after their cluster is closed.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.fixture(scope="module")
def kills(script):
    return script("study_kills")


@pytest.fixture(scope="module")
def undisturbed(kills, tmp_path_factory):
    base = tmp_path_factory.mktemp("undisturbed")
    found = {}
    for make in (kills.quick, kills.lasting):
        make(base / make.__name__)
        found[make] = kills.files(base / make.__name__)
    return found


@pytest.mark.parametrize(("cluster", "times"), [(False, 4), (True, 2)])
def test_the_process_is_killed(kills, undisturbed, tmp_path, cluster, times):
    rng = np.random.default_rng(1)
    folders = kills.kill_runs(kills.quick, tmp_path, times, rng, cluster=cluster)
    for folder in folders:
        study = kills.quick(folder)
        assert study.complete
        assert study.notes == (
            "n = 3072 is no power of two: the sample covers the ranges less evenly.",
        )
        assert kills.files(folder) == undisturbed[kills.quick]


def test_workers_are_killed(kills, undisturbed, tmp_path):
    kills.kill_workers(kills.lasting, tmp_path / "store", 3, np.random.default_rng(2))
    assert kills.files(tmp_path / "store") == undisturbed[kills.lasting]


def test_a_cluster_of_processes_writes_what_threads_write(kills, undisturbed, tmp_path):
    kills.on_cluster(kills.lasting, tmp_path / "store")
    assert kills.files(tmp_path / "store") == undisturbed[kills.lasting]
