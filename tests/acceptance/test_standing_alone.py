"""Results are arrays and a frozen machine: they may be copied, sent away, read by many at once."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
import sys
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import flipflow as ff

THREADS = 8


@pytest.fixture(scope="module")
def screen():
    return ff.load("ffs0827")


@pytest.fixture(scope="module")
def made(screen):
    """One of each result whose reading once needed a solver."""
    branch = ff.frequency_response(screen, (100.0, 210.0), ff.PiecewiseExact(60))
    return {
        "machine": screen,
        "system": screen.system(),
        "exact branch": branch,
        "series branch": ff.frequency_response(screen, (100.0, 210.0), ff.HarmonicBalance(5, 60)),
        "orbit": branch.orbits_at(203.0)[0],
        "history": ff.simulate(screen, 120.0, 5),
        "sweep": ff.sweep(screen, [110.0, 120.0, 130.0]),
        "basins": ff.basins(screen, 203.0, {"relative": np.linspace(-0.03, 0.03, 4)}),
        "field branch": ff.continue_orbit(branch.orbits_at(120.0)[0], "clearance", (5.8e-3, 6e-3)),
    }


def read_branch(branch, order) -> dict[int, tuple]:
    """What is read off the motions of a branch, in a given order."""
    found = {}
    for i in order:
        orbit = branch.orbit(i)
        found[i] = (
            orbit.amplitude("relative"), orbit.phase("main"), orbit.stop_force_peak(),
            orbit.error, orbit.state.tobytes(), orbit.multipliers.tobytes(),
            orbit.displacement("main").tobytes(), orbit.contact_intervals,
        )  # fmt: skip
    return found


def read_whole(branch) -> tuple[bytes, ...]:
    return tuple(
        part.tobytes()
        for part in (branch.amplitude("relative"), branch.phase("main"), branch.error)
    )


@pytest.fixture
def restless():
    """The interpreter switches threads every microsecond."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.parametrize("kind", ["exact branch", "series branch"])
@pytest.mark.usefixtures("restless")
def test_eight_threads_read_what_one_does_bit_for_bit(made, kind):
    """Amplitudes of one branch read by eight threads were once wrong by up to 124 %."""
    branch = made[kind]
    places = list(range(0, branch.omega.size, 3))
    alone, whole = read_branch(branch, places), read_whole(branch)
    together = threading.Barrier(THREADS)

    def read(seed: int):
        order = np.random.default_rng(seed).permutation(places).tolist()
        together.wait()
        return read_branch(branch, order), read_whole(branch)

    with ThreadPoolExecutor(THREADS) as pool:
        for motions, arrays in pool.map(read, range(THREADS)):
            assert motions == alone
            assert arrays == whole


@pytest.mark.usefixtures("restless")
def test_threads_analyse_machines_side_by_side(screen):
    """Whole analyses in threads are those of one thread."""
    gaps = [5e-3, 6e-3, 7e-3, 8e-3]

    def folds(gap: float):
        branch = ff.frequency_response(screen.replace(clearance=gap), (100.0, 230.0))
        return branch.omega.tobytes(), [point.omega for point in branch.special_points]

    alone = [folds(gap) for gap in gaps]
    with ThreadPoolExecutor(THREADS) as pool:
        assert list(pool.map(folds, gaps)) == alone


def test_a_process_reads_what_this_one_does_bit_for_bit(made):
    """A result sent to a process of its own, and what is read off it there sent back."""
    places = [0, 20, 40]
    spawned = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=spawned) as pool:
        for kind in ("exact branch", "series branch"):
            branch = made[kind]
            assert pool.submit(read_branch, branch, places).result() == read_branch(branch, places)
            assert pool.submit(read_whole, branch).result() == read_whole(branch)


def told(result) -> object:
    """Something that is read off each kind of result."""
    for name in ("amplitude", "displacement"):
        if hasattr(result, name):
            return np.asarray(getattr(result, name)("relative")).tobytes()
    if hasattr(result, "labels"):
        return result.labels.tobytes(), [told(orbit) for orbit in result.orbits]
    return repr(result.system().M), repr(result.system().coordinate("relative"))


@pytest.mark.parametrize(
    "kind",
    ["machine", "system", "exact branch", "series branch", "orbit", "history", "sweep", "basins",
     "field branch"],
)  # fmt: skip
def test_copies_tell_the_same(made, kind):
    result = made[kind]
    sent = pickle.loads(pickle.dumps(result))  # noqa: S301  our own
    for twin in (sent, copy.deepcopy(result)):
        assert type(twin) is type(result)
        assert told(twin) == told(result)


@pytest.mark.parametrize("kind", ["exact branch", "series branch", "sweep"])
@pytest.mark.usefixtures("restless")
def test_a_result_is_copied_while_others_read_it(made, kind):
    """What is worked out when asked for is not part of a copy: it may be growing."""
    result = copy.deepcopy(made[kind])
    vectors = ["main", "floating", "relative", 0, 1]
    done = threading.Event()

    def read() -> None:
        while not done.is_set():
            fresh = copy.copy(result)
            for which in vectors:
                fresh.amplitude(which)
                result.amplitude(which)
            result.__dict__.pop("_seen", None)

    with ThreadPoolExecutor(2) as pool:
        readers = [pool.submit(read) for _ in range(2)]
        try:
            sizes = {len(pickle.dumps(copy.deepcopy(result))) for _ in range(150)}
        finally:
            done.set()
        for reader in readers:
            reader.result()
    assert len(sizes) == 1


def first(_t, x, _v, _a):
    return x[:, 0]


def spoil(_t, x, _v, _a):
    x.fill(1.0)
    return x[:, 0]


def test_what_is_handed_out_is_not_what_is_kept(made):
    """Writing into an answer changes neither the result nor its later answers."""
    branch, sweep = made["exact branch"], made["sweep"]
    orbit = branch.orbit(5)
    before = orbit.amplitude("relative"), branch.orbit(5).state.copy(), sweep.amplitude("main")
    orbit.state[:] = 0.0
    orbit.return_map[:] = 0.0
    orbit.peak(spoil)
    sweep.extremes("main")[1][:] = 1.0
    assert orbit.amplitude("relative") == before[0]
    assert orbit.peak(first) < 1.0
    np.testing.assert_array_equal(branch.orbit(5).state, before[1])
    np.testing.assert_array_equal(sweep.amplitude("main"), before[2])
    with pytest.raises(ValueError, match="read-only"):
        branch.omega[0] = 1.0


def test_a_branch_keeps_its_points_and_nothing_else(made):
    """No scratch, no record of twenty thousand rows: about a kilobyte a point."""
    branch = made["exact branch"]
    assert len(pickle.dumps(branch)) < 2000 * (branch.omega.size + 20)
