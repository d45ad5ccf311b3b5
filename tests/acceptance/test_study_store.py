"""The store of a study: damaged, on a full disk, read-only, held by another, of other inputs."""

from __future__ import annotations

import gc
import json
import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress

import numpy as np
import pytest

import flipflow as ff
from flipflow.batch import chunk_store
from flipflow.errors import StoreError
from flipflow.signals import SIGNALS

zarr = pytest.importorskip("zarr")
VARY = {"shear_stiffness": (2.5e6, 2.9e6), "main_mass": ff.Normal(916.0, 20.0)}
OMEGA = (60.0, 89.0)


def study(store, machine=None, **changes):
    words = {"sampling": ff.Sample(n=256), "store": store} | changes
    return ff.study(
        machine or ff.load("ffs0827-linear"), VARY, "relative_amplitude", OMEGA, **words
    )


def files(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes()
            for path in folder.rglob("*") if path.is_file()}  # fmt: skip


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "study.zarr"
    study(folder)
    return folder


@pytest.fixture
def copy(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "study.zarr")


class Stop(Exception):  # noqa: N818
    """Ends a study from its monitor."""


def stopping(after):
    """A monitor that ends the work once some chunks are finished."""

    def tell(sentence, _share):
        if sentence.startswith(f"study: {after} of"):
            raise Stop

    return tell


def test_a_store_is_what_is_found_in_memory(whole):
    kept, found = ff.open_study(whole), study(None)
    assert kept.complete
    for name in ("values", "nominal", "at_low", "at_high", "columns"):
        first, second = getattr(kept, name), getattr(found, name)
        assert first.keys() == second.keys()
        for key in first:
            np.testing.assert_array_equal(first[key], second[key])
    np.testing.assert_array_equal(kept.reason, found.reason)
    assert (kept.machine, kept.sample, kept.distributions) == (
        found.machine, found.sample, found.distributions,
    )  # fmt: skip


def test_an_interrupt_waits_for_the_chunk_that_is_written(tmp_path, monkeypatch):
    written = chunk_store.write_file

    def interrupted(path, *words):
        if path.parent.name == "relative_amplitude":
            signal.raise_signal(signal.SIGINT)
        written(path, *words)

    monkeypatch.setattr(chunk_store, "write_file", interrupted)
    answer = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        study(tmp_path / "study.zarr")
    assert signal.getsignal(signal.SIGINT) is answer
    gc.collect()  # a coroutine that nobody awaited would warn
    store = chunk_store.ChunkStore(tmp_path / "study.zarr")
    words = sorted(state.word for state in store.states())
    assert words == ["finished", *["missing"] * (len(words) - 1)]


def test_an_answer_that_raises_leaves_the_others_in_place(tmp_path, monkeypatch):
    """SIGTERM of a host program that ends it by an exception of its own."""
    written, answers = chunk_store.write_file, [signal.getsignal(one) for one in SIGNALS]

    def terminated(path, *words):
        if path.parent.name == "relative_amplitude":
            signal.raise_signal(signal.SIGTERM)
        written(path, *words)

    def answer(_number, _frame):
        raise Stop

    monkeypatch.setattr(chunk_store, "write_file", terminated)
    before = signal.signal(signal.SIGTERM, answer)
    try:
        with pytest.raises(Stop):
            study(tmp_path / "study.zarr")
        assert signal.getsignal(signal.SIGINT) is answers[0]
        assert signal.getsignal(signal.SIGTERM) is answer
    finally:
        signal.signal(signal.SIGTERM, before)


def test_xarray_opens_it_by_itself(whole):
    xarray = pytest.importorskip("xarray")
    with xarray.open_zarr(whole, consolidated=False) as data:
        assert dict(data.sizes)["sample"] == 256
        assert data.relative_amplitude.attrs["units"] == "m"
        own = ff.open_study(whole).values["relative_amplitude"]
        np.testing.assert_array_equal(data.relative_amplitude, own)


def test_a_chunk_that_is_not_there_does_not_read_as_a_value(tmp_path):
    with pytest.raises(Stop):
        study(tmp_path / "s", monitor=stopping(2))
    half = ff.open_study(tmp_path / "s")
    assert not half.complete
    missing = (half.reason == -1).all(axis=(1, 2))
    assert missing.sum() == 128
    assert np.isnan(half.values["relative_amplitude"][missing]).all()
    assert half.reasons == {"not computed yet": 256}
    assert half.notes == ("128 of 256 machines are not computed yet.",)
    assert half.failed == 0.0


def test_what_was_stopped_goes_on_and_ends_bit_for_bit_the_same(whole, tmp_path):
    for after in (1, 3):
        with pytest.raises(Stop):
            study(tmp_path / "s", monitor=stopping(after))
    told = []
    study(tmp_path / "s", monitor=lambda sentence, _: told.append(sentence))
    assert told[0] == "study: 3 of 4 chunks"
    assert told[-1] == "study: 4 of 4 chunks"
    assert files(tmp_path / "s") == files(whole)


def truncate(path):
    path.write_bytes(path.read_bytes()[:-9])


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("harm", "name", "words"),
    [
        (truncate, "relative_amplitude/c.1.0.0", "is damaged"),
        (flip, "relative_amplitude/c.1.0.0", "is damaged"),
        (os.remove, "relative_amplitude/c.1.0.0", "is missing"),
        (flip, "reason/c.1.0.0", "is damaged"),
        (os.remove, "reason/c.1.0.0", "is missing"),
        (flip, "checksum/c.1.0.0", "is damaged"),
        (truncate, "checksum/c.1.0.0", "is damaged"),
    ],
)
def test_a_damaged_chunk_is_found_named_and_redone(copy, whole, harm, name, words):
    harm(copy / name)
    with pytest.raises(StoreError, match=rf"chunk 1 \({name} {words}\); resume the study"):
        ff.open_study(copy)
    redone = study(copy)
    assert redone.notes == (f"Damaged, and computed again: chunk 1 ({name} {words}).",)
    assert files(copy) == files(whole)
    assert ff.open_study(copy).notes == ()


def test_a_chunk_without_its_checksum_is_not_finished(copy, whole):
    (copy / "checksum/c.2.0.0").unlink()
    half = ff.open_study(copy)
    assert (half.reason == -1).all(axis=(1, 2)).sum() == 64
    assert np.isnan(half.values["relative_amplitude"]).all(axis=(1, 2)).sum() == 64
    assert study(copy).complete
    assert files(copy) == files(whole)


@pytest.mark.parametrize(
    "name",
    [
        "zarr.json",
        "relative_amplitude/zarr.json",
        "main_mass/c.0",
        "nominal_relative_amplitude/c.0.0",
    ],
)
@pytest.mark.parametrize("harm", [truncate, flip])
def test_a_damaged_beginning_is_named(copy, name, harm):
    harm(copy / name)
    for call in (ff.open_study, study):
        with pytest.raises(StoreError, match=rf"is damaged: {name}"):
            call(copy)


def test_what_is_no_store(tmp_path):
    with pytest.raises(StoreError, match="is no store of flipflow"):
        ff.open_study(tmp_path)
    with pytest.raises(StoreError, match="is no store of flipflow"):
        study(tmp_path)
    with pytest.raises(ff.InputError, match="there is no such folder"):
        ff.open_study(tmp_path / "none")
    with pytest.raises(StoreError, match="there is no folder"):
        study(tmp_path / "none" / "s")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"machine": ff.load("ffs0827-linear").replace(shear_damping=2600.0)},
         "machine.shear_damping is 2605.0 there and 2600.0 here"),
        ({"sampling": ff.Sample(n=256, seed=1)}, "sample.seed is 0 there and 1 here"),
        ({"sampling": ff.Sample(n=512)}, "sample.n is 256 there and 512 here"),
        ({"branch": "upper"}, "branch is from-below there and upper here"),
        ({"load_cases": [ff.Load(name="full", floating_mass=10.0)]},
         "load_cases[0].floating_mass is 0.0 there and 10.0 here"),
        ({"load_cases": [ff.Load(), ff.Load(name="full", floating_mass=10.0)]},
         "length of load_cases is 1 there and 2 here"),
    ],
)  # fmt: skip
def test_other_inputs_are_refused_with_the_difference(copy, whole, changes, words):
    with pytest.raises(StoreError, match="holds a study of other inputs: ") as refused:
        study(copy, **changes)
    assert words in str(refused.value)
    assert files(copy) == files(whole)


def test_the_load_or_the_speed_that_differs_is_named_in_a_long_list(tmp_path):
    speeds = np.linspace(60.0, 89.0, 30)
    loads = [ff.Load(name="full", floating_mass=10.0), ff.Load(name="wet", floating_mass=20.0)]
    words = {"sampling": ff.Sample(n=2), "load_cases": loads}
    screen, folder = ff.load("ffs0827-linear"), tmp_path / "s"
    ff.study(screen, VARY, "stroke", speeds, store=folder, **words)
    with pytest.raises(StoreError, match=r"omega\[29\] is 89.0 there and 90.0 here; name"):
        ff.study(screen, VARY, "stroke", [*speeds[:-1], 90.0], store=folder, **words)
    words["load_cases"] = [loads[0], ff.Load(name="wet", floating_mass=30.0)]
    with pytest.raises(StoreError, match=r"load_cases\[1\].floating_mass is 20.0 there and 30.0"):
        ff.study(screen, VARY, "stroke", speeds, store=folder, **words)


def test_the_value_of_a_list_that_differs_is_named(tmp_path):
    screen, folder = ff.load("ffs0827-linear"), tmp_path / "s"
    vary = {"main_mass": np.array([900.0, 910.0]), "floating_mass": np.array([300.0, 301.0])}
    words = {"sampling": "list", "store": folder}
    ff.study(screen, vary, "stroke", 60.0, **words)
    other = vary | {"main_mass": np.array([900.0, 911.0])}
    with pytest.raises(StoreError, match=r"values.main_mass\[1\] is 910.0 there and 911.0 here; n"):
        ff.study(screen, other, "stroke", 60.0, **words)
    with pytest.raises(StoreError, match=r"fields\[0\] is main_mass there and floating_mass here"):
        ff.study(screen, dict(reversed(vary.items())), "stroke", 60.0, **words)


def test_another_version_is_refused(copy, monkeypatch):
    monkeypatch.setattr("flipflow.studies.study_plan.__version__", "9.0.0")
    with pytest.raises(StoreError, match=r"flipflow is 0\.1\.0 there and 9\.0\.0 here"):
        study(copy)


HOLDER = """
import sys
from pathlib import Path
from flipflow.batch.chunk_store import ChunkStore
with ChunkStore(Path(sys.argv[1])).writing():
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_writer_is_refused(copy):
    """Another process that is at work; and once it is killed, nobody."""
    holder = subprocess.Popen([sys.executable, "-c", HOLDER, str(copy)],
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE)  # fmt: skip
    try:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(StoreError, match="another run writes to it"):
            study(copy)
        assert ff.open_study(copy).complete
    finally:
        holder.kill()
        holder.communicate()
    assert study(copy).complete


def test_a_second_writer_of_the_same_process_is_refused(tmp_path):
    refused = []

    def tell(sentence, _share):
        if sentence.startswith("study: 2 of"):
            with pytest.raises(StoreError, match="another run writes to it"):
                study(tmp_path / "s")
            refused.append(sentence)

    assert study(tmp_path / "s", monitor=tell).complete
    assert refused


def mounted(disk, *options):
    disk.mkdir(exist_ok=True)
    words = ["mount", *options, "tmpfs", str(disk)]
    if shutil.which("mount") is None or subprocess.run(words, check=False).returncode:
        pytest.skip("no disk can be mounted here")
    return disk


@pytest.fixture
def small_disk(tmp_path):
    disk = mounted(tmp_path / "disk", "-t", "tmpfs", "-o", "size=400k")
    yield disk
    subprocess.run(["umount", disk], check=True)


def fill(path):
    """Write until the disk is full."""
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))


def test_a_full_disk_keeps_what_is_finished(whole, small_disk):
    """A file takes all but a little; once it is gone the study goes on."""
    taken = small_disk / "taken"
    with pytest.raises(Stop):
        study(small_disk / "s", monitor=stopping(1))
    fill(taken)
    with pytest.raises(StoreError, match="No space left"):
        study(small_disk / "s")
    assert (ff.open_study(small_disk / "s").reason != -1).any(axis=(1, 2)).sum() == 64
    taken.unlink()
    assert study(small_disk / "s").complete
    assert files(small_disk / "s") == files(whole)


def test_a_disk_that_is_full_from_the_beginning(small_disk):
    fill(small_disk / "taken")
    with pytest.raises(StoreError, match="No space left"):
        study(small_disk / "s")
    assert [path.name for path in small_disk.iterdir()] == ["taken"]


@pytest.fixture
def read_only(whole, tmp_path):
    disk = mounted(tmp_path / "disk", "-t", "tmpfs", "-o", "size=4m")
    shutil.copytree(whole, disk / "whole")
    shutil.copytree(whole, disk / "half")
    (disk / "half/checksum/c.0.0.0").unlink()
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
    yield disk
    subprocess.run(["umount", disk], check=True)


def test_a_read_only_folder_opens_and_is_not_written(read_only):
    assert ff.open_study(read_only / "whole").complete
    assert not ff.open_study(read_only / "half").complete
    for name in ("half", "new"):
        with pytest.raises(StoreError, match="cannot be written"):
            study(read_only / name)


def test_the_manifest_says_what_was_asked(whole):
    attributes = json.loads((whole / "zarr.json").read_text())["attributes"]
    manifest = attributes["manifest"]
    assert manifest["flipflow"] == ff.__version__
    assert manifest["sample"] == {"n": 256, "method": "sobol", "seed": 0, "covariance": None}
    assert len(attributes["digest"]) == len(manifest["values"]) == 64
