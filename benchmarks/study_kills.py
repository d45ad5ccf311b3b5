"""Kill a study at random moments, again and again: nothing finished is lost, nothing is corrupt.

    python benchmarks/study_kills.py --kills 100 --seed 0

Three ways: the process that runs on threads, the one that runs on a cluster of dask, and the
workers of such a cluster. After every kill the store is read: no chunk is damaged,
and all that were finished still are. At its end every store is that of an undisturbed run, file by
file. ``tests/acceptance/test_study_kills.py`` is the sized-down twin.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

import numpy as np

import flipflow as ff
from flipflow.batch.chunk_store import DAMAGED, FINISHED, ChunkStore

WORKERS = 2
# Processes begin with everything loaded, so that a kill meets the work and not its imports.
PROCESSES = multiprocessing.get_context("forkserver")
PROCESSES.set_forkserver_preload(["flipflow.studies.study", "flipflow.io.project", "zarr"])


def quick(folder, executor=None):
    """Chunks of a few milliseconds: a kill meets the writing of one."""
    screen = ff.load("ffs0827-linear")
    vary = {"shear_stiffness": (2.5e6, 2.9e6), "main_mass": ff.Normal(916.0, 20.0)}
    asked = ("relative_amplitude", "stop_force", "exciter_force")
    return ff.study(
        screen, vary, asked, [60.0, 89.0], sampling=ff.Sample(n=64 * 48), store=folder,
        executor=executor, threads=2,
    )  # fmt: skip


def lasting(folder, executor=None):
    """Chunks of a quarter of a second: a kill meets a worker at work."""
    screen = ff.load("ffs0827")
    vary = {"clearance": (5e-3, 7e-3), "shear_stiffness": ff.Normal(2.7e6, 9e4)}
    return ff.study(
        screen, vary, "relative_amplitude", 110.0, sampling=ff.Sample(n=64 * 8, seed=3),
        store=folder, executor=executor, threads=2,
    )  # fmt: skip


def on_cluster(make, folder, told=None):
    """A study on worker processes of dask; ``told`` is sent their numbers."""
    from distributed import Client, LocalCluster  # noqa: PLC0415

    with (
        LocalCluster(
            n_workers=WORKERS, threads_per_worker=1, processes=True, dashboard_address=":0",
            silence_logs=50,
        ) as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        client.wait_for_workers(WORKERS)
        if told is not None:
            told.send(list(client.run(os.getpid).values()))
        return make(folder, client.get_executor())


def finished(folder):
    """Chunks that are finished; a damaged one is what must not be."""
    if not folder.exists():
        return set()
    states = list(ChunkStore(folder).states())
    assert not [str(one) for one in states if one.word == DAMAGED]
    return {one.index for one in states if one.word == FINISHED}


def files(folder):
    """Every file of a store, by its place."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def kill_runs(make, within, kills, rng, *, cluster=False):
    """Kill the process that runs a study, each time after a random while.

    Returns the stores that were made on the way; a study that ended begins anew.
    """
    folders, whole = [within / "0"], 0
    for _ in range(kills):
        folder = folders[-1]
        before = finished(folder)
        target, words = (on_cluster, (make, folder)) if cluster else (make, (folder,))
        run = PROCESSES.Process(target=target, args=words)
        run.start()
        # Half of the kills wait for a chunk more, so that the study comes on.
        wait_for_chunk(folder, len(before), run) if rng.random() < 0.5 else None
        time.sleep(rng.exponential(3.0 if cluster else 0.15))
        run.kill()
        run.join()
        after = finished(folder)
        assert before <= after
        if folder.exists() and len(after) == ChunkStore(folder).chunks:
            whole += 1
            folders.append(within / str(whole))
    return folders


def wait_for_chunk(folder, count, run):
    """Until one chunk more has its checksum, or the run has ended."""
    while run.is_alive() and len(list(folder.glob("checksum/c.*"))) <= count:
        time.sleep(0.005)


def kill_workers(make, folder, kills, rng):
    """Kill workers of a cluster while a study runs on it; they are started anew by its nannies.

    A nanny gives up whose worker is killed while it begins; when all have, the study ends with a
    sentence, and goes on when it is called again.
    """
    from distributed import Client, LocalCluster  # noqa: PLC0415

    with (
        LocalCluster(
            n_workers=WORKERS, threads_per_worker=1, processes=True, dashboard_address=":0",
            silence_logs=50,
        ) as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        client.wait_for_workers(WORKERS)
        done = threading.Event()
        counted = []

        def shoot():
            while len(counted) < kills and not done.is_set():
                # Half of the kills wait for a chunk more: faster than workers begin, kills would
                # let none of them come to work.
                count = len(list(folder.glob("checksum/c.*")))
                waits = rng.random() < 0.5
                while waits and len(list(folder.glob("checksum/c.*"))) <= count:
                    if done.wait(0.02):
                        return
                time.sleep(rng.exponential(0.5))
                nannies = list(cluster.workers.values())
                # A worker that is being started anew has no number yet, or has ended already.
                known = [one.process.pid for one in nannies if one.process and one.process.pid]
                if known and not done.is_set():
                    with suppress(ProcessLookupError):
                        os.kill(int(rng.choice(known)), signal.SIGKILL)
                        counted.append(1)

        shooting = threading.Thread(target=shoot)
        shooting.start()
        try:
            with suppress(ff.IncompleteError):
                make(folder, client.get_executor())
        finally:
            done.set()
            shooting.join()
        return len(counted)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    with tempfile.TemporaryDirectory() as name:
        base = Path(name)
        undisturbed = {}
        for make in (quick, lasting):
            make(base / make.__name__)
            undisturbed[make] = files(base / make.__name__)
        for make, cluster in ((quick, False), (quick, True)):
            within = base / f"killed-{cluster}"
            within.mkdir()
            folders = kill_runs(make, within, options.kills, rng, cluster=cluster)
            for folder in folders:
                make(folder)
                assert files(folder) == undisturbed[make]
            print(f"process {'with dask' if cluster else 'on threads'}: {options.kills} kills, "
                  f"{len(folders)} stores, all whole and equal")  # fmt: skip
        shot, stores = 0, 0
        while shot < options.kills:
            folder = base / f"workers-{stores}"
            shot += kill_workers(lasting, folder, options.kills - shot, rng)
            if len(finished(folder)) < ChunkStore(folder).chunks:
                continue
            assert files(folder) == undisturbed[lasting]
            stores += 1
        print(f"workers of dask: {shot} kills, {stores} stores, all whole and equal")


if __name__ == "__main__":
    main()
