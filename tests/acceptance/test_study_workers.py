"""Workers that are lost: others compute their chunks; a study says when none is left."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

import flipflow as ff
from flipflow.batch.run_chunks import MOST_LOST, run_chunks
from flipflow.cli.cluster import executor_of

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


def deadly(folder, index, deaths):
    """Ends its worker some times before it returns; how often it did stands in the folder."""
    if len(list(Path(folder).glob(f"{index}-*"))) < deaths:
        Path(folder, f"{index}-{os.getpid()}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 10 * index


@pytest.fixture(scope="module")
def client():
    """A cluster that gives a task up as soon as its worker ends."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0",
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster) as found,
    ):  # fmt: skip
        cluster.scheduler.allowed_failures = 0
        yield found


def test_a_chunk_whose_worker_is_lost_is_handed_out_again(client, tmp_path):
    tasks = [(index, (str(tmp_path), index, 2 * (index == 1))) for index in range(4)]
    found = dict(run_chunks(client.get_executor(), deadly, tasks))
    assert found == {0: 0, 1: 10, 2: 20, 3: 30}
    assert len(list(tmp_path.glob("1-*"))) == 2


def test_a_chunk_that_ends_every_worker_ends_the_study(client, tmp_path, monkeypatch):
    monkeypatch.setattr("flipflow.batch.run_chunks.MOST_LOST", 1)
    tasks = [(0, (str(tmp_path), 0, 99))]
    with pytest.raises(ff.IncompleteError, match="Chunk 0 ended its worker 1 times"):
        list(run_chunks(client.get_executor(), deadly, tasks))
    assert MOST_LOST > 1


def test_processes_that_are_gone_leave_what_is_finished(tmp_path):
    """A pool of the standard library does not begin anew: the study ends, and goes on elsewhere."""
    pytest.importorskip("zarr")
    screen, vary = ff.load("ffs0827-linear"), {"main_mass": (900.0, 930.0)}
    store = tmp_path / "study.zarr"

    def study(executor, monitor=None):
        return ff.study(screen, vary, "stroke", 89.0, sampling=ff.Sample(n=64 * 300), store=store,
                        executor=executor, monitor=monitor)  # fmt: skip

    with ProcessPoolExecutor(1, get_context("spawn")) as pool:

        def kill(sentence, _share):
            if sentence.startswith("study: 3 of"):
                for process in pool._processes.values():
                    process.kill()

        with pytest.raises(ff.IncompleteError, match="The workers are gone"):
            study(pool, kill)
    half = ff.open_study(store)
    assert 3 * 64 <= (half.reason != -1).sum() < 300 * 64
    assert study(None).complete


CLUSTER = """
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


@pytest.mark.parametrize("how", ["killed", "closed"])
def test_a_scheduler_that_is_gone_ends_the_study(tmp_path, how):
    """What was finished is in the store."""
    pytest.importorskip("zarr")
    screen, vary = ff.load("ffs0827-linear"), {"main_mass": (900.0, 930.0)}
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    cluster = subprocess.Popen([sys.executable, script], stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, text=True)  # fmt: skip
    client = distributed.Client(cluster.stdout.readline().strip(), timeout=60)

    def gone(sentence, _share):
        if sentence.startswith("study: 3 of"):
            cluster.kill() if how == "killed" else client.close()

    try:
        with pytest.raises(ff.IncompleteError, match="gone"):
            ff.study(
                screen, vary, "stroke", 89.0, sampling=ff.Sample(n=64 * 300),
                store=tmp_path / "s", executor=client.get_executor(), monitor=gone,
            )  # fmt: skip
    finally:
        cluster.kill()
        cluster.communicate()
        client.close()
    assert (ff.open_study(tmp_path / "s").reason != -1).sum() >= 3 * 64


def slow(folder, index):
    """Takes a while, and says that it was here."""
    Path(folder, str(index)).touch()
    time.sleep(0.5)
    return index


def test_a_cluster_that_has_lost_all_workers_ends_the_study(tmp_path, monkeypatch):
    """A nanny of dask gives up whose worker ends while it begins, and nobody computes any more."""
    monkeypatch.setattr("flipflow.batch.run_chunks.LOOK", 0.02)
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0",
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster) as client,
        distributed.Client(processes=False, n_workers=0, dashboard_address=":0"),
    ):  # fmt: skip

        def tasks():
            yield 0, (str(tmp_path), 0)
            while not Path(tmp_path, "0").exists():
                time.sleep(0.01)
            time.sleep(1.0)
            cluster.scale(0)
            while client.nthreads():
                time.sleep(0.01)
            yield 1, (str(tmp_path), 1)

        # The client without workers that was made last is another one.
        assert list(run_chunks(client.get_executor(), slow, [(7, (str(tmp_path), 7))])) == [(7, 7)]
        with pytest.raises(ff.IncompleteError, match="lost all workers"):
            list(run_chunks(client.get_executor(), slow, tasks()))


def test_ctrl_c_in_a_terminal_is_one_sentence(tmp_path):
    """There it comes to the worker processes as well."""
    (tmp_path / "wide.toml").write_text(
        'machine = "ffs0827"\n[vary]\nclearance = "+-5 %"\n[study]\nsamples = 100000\n'
        'quantities = ["relative_amplitude"]\n', encoding="utf-8",
    )  # fmt: skip
    run = subprocess.Popen(
        [sys.executable, "-m", "flipflow", "study", "wide.toml", "--workers", "2"], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    end = time.monotonic() + 120.0
    while not any(tmp_path.glob("wide.zarr/relative_amplitude/c.*")):
        assert time.monotonic() < end
        time.sleep(0.05)
    os.killpg(run.pid, signal.SIGINT)
    _, error = run.communicate(timeout=60.0)
    assert run.returncode == 130
    assert re.fullmatch(r"Stopped by the user; \d+ of \d+ chunks are in wide.zarr, and .*\n", error)


def test_a_signal_while_workers_are_closed_leaves_none(monkeypatch):
    """Interrupted in its midst, dask waits for what does not come."""
    closed, close = [], distributed.Client.close

    def interrupted(client, *given, **more):
        signal.raise_signal(signal.SIGINT)
        close(client, *given, **more)
        closed.append(client.status)

    monkeypatch.setattr(distributed.Client, "close", interrupted)
    with pytest.raises(KeyboardInterrupt), executor_of(1, None):
        pass
    assert closed[:1] == ["closed"]
