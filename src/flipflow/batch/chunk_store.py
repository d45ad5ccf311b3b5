"""Arrays on disk that grow chunk by chunk: a zarr v3 group in which every file has a checksum.

A chunk of the store is one chunk of every growing array. Its files are written under temporary
names, synced and renamed; last comes a row of the array ``checksum``, which holds the SHA-256 of
each. A chunk is finished when that row is there and every file fits it, so that whatever ends a
run, nothing half-written is taken for finished, and nothing missing for a fill value. The store
opens with ``xarray.open_zarr(path, consolidated=False)``, too.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from flipflow.errors import InputError, MissingExtra, StoreError
from flipflow.results.stage import held, sweep
from flipflow.results.store import because, refused, sync_folder, write_file
from flipflow.signals import undisturbed

Array = NDArray[Any]
META = "zarr.json"
CHECKSUM = "checksum"
FLAT = {"name": "default", "separator": "."}  # all chunks of an array in one folder
BYTES = 32  # of a SHA-256
FIELD = "store"
PART = ".part"
# What zarr raises where a store does not hold what it should.
DAMAGE = (ValueError, LookupError, TypeError, OSError, AttributeError)
FINISHED, MISSING, DAMAGED = "finished", "missing", "damaged"


@dataclass(frozen=True, eq=False)
class Variable:
    """An array of a store.

    Parameters
    ----------
    dims
        Names of its dimensions.
    data
        Its values; of a growing array what stands where no chunk is finished, one number.
    units
        Its unit.
    """

    dims: tuple[str, ...]
    data: Array
    units: str = ""


@dataclass(frozen=True, eq=False)
class Layout:
    """What a store holds.

    Parameters
    ----------
    manifest
        What makes the store what it is, as JSON types.
    fixed
        Arrays known from the beginning.
    growing
        Arrays that grow along their first dimension.
    shape
        Length of each dimension.
    rows
        Rows of a chunk along that first dimension.
    """

    manifest: Mapping[str, Any]
    fixed: Mapping[str, Variable]
    growing: Mapping[str, Variable]
    shape: Mapping[str, int]
    rows: int

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        first = next(iter(self.growing.values())).dims[0]
        return -(-self.shape[first] // self.rows)


@dataclass(frozen=True)
class ChunkState:
    """Whether a chunk is finished; of a damaged one, the files and what is wrong with each."""

    index: int
    word: str
    files: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"chunk {self.index} ({'; '.join(self.files)})"


@undisturbed()
def create_store(folder: Path, layout: Layout) -> None:
    """Make a store without chunks; it is there whole or not at all.

    Raises
    ------
    InputError
        When something is there already.
    StoreError
        When nothing can be written there.
    MissingExtra
        When zarr is not installed.
    """
    zarr = _zarr()
    if folder.exists():
        raise InputError(FIELD, str(folder), "it exists, name another folder")
    if not folder.parent.is_dir():
        why = f"it cannot be written (there is no folder {str(folder.parent)!r})"
        raise refused(FIELD, folder, f"{why}, make it or name another")
    layout = _with_checksums(layout)
    aside, lock = folder.parent / f".{folder.name}-{uuid.uuid4().hex}{PART}", -1
    try:
        sweep(folder)
        aside.mkdir()
    except (OSError, ValueError) as error:
        raise refused(FIELD, folder, because(error, "a folder")) from None
    try:
        lock = held(aside)
        group = zarr.create_group(store=aside, zarr_format=3)
        growing = [name for name in layout.growing if name != CHECKSUM]
        for name, one in {**layout.fixed, **layout.growing}.items():
            _create(group, name, one, layout)
        digests = {path: _digest(aside / path) for path in _files(aside)}
        kept = {"manifest": layout.manifest, "files": digests, "rows": layout.rows}
        kept |= {"growing": growing, "chunks": layout.chunks}
        attributes = {**kept, "digest": _digest_of(kept)}
        write_file(aside / META, json.dumps(_group_meta(attributes), indent=1), FIELD)
        _sync_files(aside)
        aside.rename(folder)
        sync_folder(folder.parent)
    except OSError as error:
        raise refused(FIELD, folder, because(error, "a folder")) from None
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        if lock >= 0:
            os.close(lock)


class ChunkStore:
    """A store that is there.

    Parameters
    ----------
    folder
        Where it is.

    Raises
    ------
    InputError
        For a folder that is not there.
    StoreError
        For one that is no store, or whose fixed part is damaged.
    MissingExtra
        When zarr is not installed.
    """

    def __init__(self, folder: Path) -> None:
        _zarr()
        self.folder = folder
        self._lock = -1
        if not folder.is_dir():
            raise InputError(FIELD, str(folder), "there is no such folder; give one of ff.study")
        kept = self._read_attributes()
        self.manifest: Mapping[str, Any] = kept["manifest"]
        self.digest = _digest_of(self.manifest)
        self.growing: tuple[str, ...] = tuple(kept["growing"])
        self.rows, self.chunks = int(kept["rows"]), int(kept["chunks"])
        for path, digest in kept["files"].items():
            fault = _fault(folder / path, bytes.fromhex(digest))
            if fault:
                raise StoreError(
                    f"{folder} is damaged: {path} {fault}, and it cannot be made again; "
                    "begin with another folder."
                )

    def _read_attributes(self) -> Mapping[str, Any]:
        head = self.folder / META
        try:
            kept: dict[str, Any] = json.loads(head.read_text(encoding="utf-8"))["attributes"]
            digest = kept.pop("digest")
        except (FileNotFoundError, KeyError):
            raise StoreError(f"{self.folder} is no store of flipflow.") from None
        except OSError as error:
            raise StoreError(f"{self.folder} cannot be read ({error.strerror}).") from None
        except (ValueError, TypeError, AttributeError):
            raise StoreError(f"{self.folder} is damaged: {META} is no JSON document.") from None
        if digest != _digest_of(kept):
            raise StoreError(f"{self.folder} is damaged: {META} was changed after it was written.")
        return kept

    @contextmanager
    def writing(self) -> Iterator[Self]:
        """Hold the store, so that nobody else writes to it.

        Raises
        ------
        StoreError
            When another process, or another run of this one, writes to it, or it may not be
            written.
        """
        try:
            self._lock = os.open(self.folder / META, os.O_RDWR)
        except OSError as error:
            raise refused(FIELD, self.folder, because(error, "a folder")) from None
        try:
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                told = "another run writes to it; wait until it ends, or name another folder"
                raise refused(FIELD, self.folder, told) from None
            for left in self.folder.glob(f"**/.*{PART}"):
                left.unlink(missing_ok=True)
            yield self
            # Names that a power cut takes back are those of chunks that are computed again.
            for name in (*self.growing, CHECKSUM):
                sync_folder(self.folder / name)
        finally:
            os.close(self._lock)
            self._lock = -1

    def states(self) -> Iterator[ChunkState]:
        """The state of every chunk; all files are read."""
        for index in range(self.chunks):
            yield self.state(index)

    @undisturbed()
    def state(self, index: int) -> ChunkState:
        """The state of a chunk."""
        row = self._file(CHECKSUM, index)
        if not row.exists():
            return ChunkState(index, MISSING)
        try:
            known = self._group[CHECKSUM][index]
        except DAMAGE:
            return ChunkState(index, DAMAGED, (f"{self._path(CHECKSUM, index)} is damaged",))
        faults = [
            f"{self._path(name, index)} {fault}"
            for name, digest in zip(self.growing, known, strict=True)
            if (fault := _fault(self._file(name, index), bytes(digest)))
        ]
        return ChunkState(index, DAMAGED if faults else FINISHED, tuple(faults))

    @undisturbed()
    def write(self, index: int, values: Mapping[str, Array]) -> None:
        """Write a chunk: all its arrays, then their checksums.

        Raises
        ------
        StoreError
            When it cannot be written; the chunk is not finished then.
        """
        # zarr reads a chunk that it takes to be written in part; a damaged one cannot be read.
        for name in (CHECKSUM, *self.growing):
            self._file(name, index).unlink(missing_ok=True)
        begin = index * self.rows
        digests = np.zeros((1, len(self.growing), BYTES), np.uint8)
        for k, name in enumerate(self.growing):
            content = self._put(name, slice(begin, begin + len(values[name])), values[name])
            digests[0, k] = np.frombuffer(content, np.uint8)
        self._put(CHECKSUM, slice(index, index + 1), digests)

    @undisturbed()
    def read(self, name: str, index: int | None = None) -> Array:
        """The values of an array, or those of one chunk of a growing one.

        Raises
        ------
        StoreError
            When a file of it is damaged.
        """
        try:
            rows = (index or 0) * self.rows, ((index or 0) + 1) * self.rows
            found = self._group[name][... if index is None else slice(*rows)]
        except DAMAGE as error:
            raise StoreError(f"{self.folder} is damaged: {name} ({error}).") from None
        return np.asarray(found)

    def _put(self, name: str, rows: slice, values: Array) -> bytes:
        """Write the chunk of an array that these rows are; its digest."""
        self._writer.digests.clear()
        self._written[name][rows] = values
        ((_, digest),) = self._writer.digests.items()
        return bytes(digest)

    @cached_property
    def _writer(self) -> Any:
        return _synced_store()(self.folder)

    @cached_property
    def _written(self) -> Any:
        """The group with arrays whose chunks are written even where all is fill."""
        zarr = _zarr()
        with zarr.config.set({"array.write_empty_chunks": True}):
            group = zarr.open_group(store=self._writer, mode="r+", zarr_format=3)
            return {name: group[name] for name in (*self.growing, CHECKSUM)}

    @cached_property
    def _group(self) -> Any:
        return _zarr().open_group(
            store=self.folder, mode="r", zarr_format=3, use_consolidated=False
        )

    def _path(self, name: str, index: int) -> str:
        return f"{name}/{'.'.join(['c', str(index), *['0'] * (self._dims[name] - 1)])}"

    def _file(self, name: str, index: int) -> Path:
        return self.folder / self._path(name, index)

    @cached_property
    def _dims(self) -> Mapping[str, int]:
        group = self._group
        return {name: group[name].ndim for name in (*self.growing, CHECKSUM)}


def _with_checksums(layout: Layout) -> Layout:
    """The layout with the array that says which chunks are finished."""
    zero = Variable(("chunk", "file", "byte"), np.zeros((), np.uint8))
    shape = {"chunk": layout.chunks, "file": len(layout.growing), "byte": BYTES}
    return Layout(
        layout.manifest, layout.fixed, {**layout.growing, CHECKSUM: zero},
        {**layout.shape, **shape}, layout.rows,
    )  # fmt: skip


def _create(group: Any, name: str, one: Variable, layout: Layout) -> None:
    """An array of a new store, with a checksum that zarr itself checks on reading."""
    from zarr.codecs import Crc32cCodec  # noqa: PLC0415  an extra

    fixed = one.data.ndim > 0
    shape = one.data.shape if fixed else tuple(layout.shape[dim] for dim in one.dims)
    rows = {"chunk": 1}.get(one.dims[0], min(layout.rows, shape[0])) if one.dims else 1
    words = one.data.dtype.kind in "UOT"
    array = group.create_array(
        name, shape=shape, chunks=shape if fixed else (rows, *shape[1:]),
        dtype=str if words else one.data.dtype, dimension_names=one.dims,
        fill_value="" if words else one.data.dtype.type(0) if fixed else one.data.item(),
        compressors=(Crc32cCodec(),), chunk_key_encoding=FLAT, config={"write_empty_chunks": True},
        attributes={"units": one.units} if one.units else {},
    )  # fmt: skip
    if fixed:
        array[...] = one.data.astype(str) if words else one.data


def _zarr() -> Any:
    try:
        import zarr  # noqa: PLC0415  an extra
    except ImportError as error:
        raise MissingExtra("Stores need zarr: pip install 'flipflow[study]'.") from error
    return zarr


def _synced_store() -> Any:
    """A folder of zarr whose files are synced before they take their names."""
    from zarr.storage import LocalStore  # noqa: PLC0415  an extra

    class SyncedStore(LocalStore):  # type: ignore[misc]
        """Keeps the digest of each file that it writes."""

        def __init__(self, root: Path) -> None:
            super().__init__(root)
            self.digests: dict[str, bytes] = {}

        async def set(self, key: str, value: Any) -> None:
            """Write a whole file, or nothing."""
            content = value.to_bytes()
            write_file(self.root / key, content, FIELD)
            self.digests[key] = hashlib.sha256(content).digest()

    return SyncedStore


def _group_meta(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {"attributes": attributes, "zarr_format": 3, "node_type": "group"}


def _files(folder: Path) -> Iterator[str]:
    """Files of a new store but the one that holds their digests."""
    for path in sorted(folder.glob("**/*")):
        if path.is_file() and path != folder / META:
            yield path.relative_to(folder).as_posix()


def _sync_files(folder: Path) -> None:
    """See that all of a new store is on the disk before it takes its name."""
    for path in folder.glob("**/*"):
        if path.is_file():
            number = os.open(path, os.O_RDONLY)
            try:
                os.fsync(number)
            finally:
                os.close(number)
        else:
            sync_folder(path)
    sync_folder(folder)


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _digest_of(kept: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()


def _fault(path: Path, digest: bytes) -> str:
    """What is wrong with a file, in words; empty where nothing is."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return "is missing"
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    return "" if hashlib.sha256(content).digest() == digest else "is damaged"
