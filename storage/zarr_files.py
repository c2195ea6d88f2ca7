"""One dataset in one folder as plain Zarr v3: write, verify, hash, read strictly.

Zarr reads an absent chunk as the fill value, silently. Here every chunk is written (empty ones
too), counted before a version is published, and demanded when it is read.
"""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.errors import MissingChunkError, StoreError, StoreFullError

if TYPE_CHECKING:
    import xarray as xr

RECORD = "tsuya"
"""Name of the group attribute that holds what the store itself knows of a version."""

CHUNK_TARGET_BYTES = 8 * 2**20
CHUNK_LEAST_BYTES = 2**20
_CHUNK_KEY = re.compile(r"(?:^|/)c(?:/\d+)*$")


def write_dataset(dataset: xr.Dataset, folder: Path, record: dict[str, Any]) -> None:
    """Stream a dataset, eager or dask-backed, into a new Zarr v3 group.

    ``record`` becomes the group attribute ``tsuya``. Memory stays bounded by a few chunks a
    thread. Raises StoreFullError when the disk fills up.
    """
    from zarr.storage import LocalStore

    prepared = dataset.assign_attrs({RECORD: record})
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in prepared.variables.items():
        chunks = _chunk_shape(variable.shape, variable.dtype.itemsize)
        if variable.chunks is not None:
            chunks = _lazy_chunks(variable, chunks)
            prepared[name] = prepared[name].chunk(dict(zip(variable.dims, chunks, strict=True)))
        encoding[str(name)] = {
            "chunks": chunks,
            "write_empty_chunks": True,
            "_FillValue": None,
        }
    folder.mkdir(parents=True)
    store = _stoppable_store()(LocalStore(folder))
    try:
        prepared.to_zarr(store, mode="w-", encoding=encoding, zarr_format=3, consolidated=False)
    except OSError as error:
        raise disk_error(error, folder) from error
    finally:
        store.stop()


def add_to_record(folder: Path, **entries: Any) -> None:
    """Add entries to the record of a group that is not published yet."""
    path = folder / "zarr.json"
    metadata = json.loads(path.read_text())
    metadata["attributes"][RECORD].update(entries)
    path.write_text(json.dumps(metadata, indent=2))


def read_record(folder: Path) -> dict[str, Any]:
    """The record of a stored group, without opening its arrays."""
    try:
        metadata = json.loads((folder / "zarr.json").read_text())
        return dict(metadata["attributes"][RECORD])
    except (OSError, ValueError, KeyError) as error:
        raise StoreError(
            f"{folder / 'zarr.json'}: the version's record cannot be read ({error}); "
            f"expected a Zarr v3 group with the attribute {RECORD!r}."
        ) from error


def open_dataset(folder: Path) -> xr.Dataset:
    """Open a stored group lazily; reading an absent chunk raises MissingChunkError."""
    import xarray as xr
    from zarr.storage import LocalStore

    opened: xr.Dataset = xr.open_zarr(
        _strict_store()(LocalStore(folder, read_only=True)),
        chunks={},
        consolidated=False,
        zarr_format=3,
        mask_and_scale=False,
    )
    return opened


def verify_complete(folder: Path) -> None:
    """Raise MissingChunkError unless every chunk that the shapes demand is a file."""
    for array_folder, metadata in _arrays(folder):
        shape = metadata["shape"]
        chunks = metadata["chunk_grid"]["configuration"]["chunk_shape"]
        expected = math.prod(math.ceil(n / c) for n, c in zip(shape, chunks, strict=True))
        # A scalar's one chunk is the file c itself.
        stored = _files(array_folder / "c") if shape else array_folder.glob("c")
        found = sum(1 for _ in stored)
        if found != expected:
            raise MissingChunkError(
                f"{array_folder}: {found} chunks are stored; expected {expected}."
            )


def content_hash(folder: Path) -> str:
    """Hash of what the arrays hold: the hash of the sorted hashes of chunks and array metadata.

    The dataset's own attributes count; the store's record (settings, times) does not, so two runs
    that give the same arrays have the same hash.
    """
    digests = []
    for path in _files(folder):
        if path == folder / "zarr.json":
            attributes = json.loads(path.read_text())["attributes"]
            attributes.pop(RECORD, None)
            data = json.dumps(attributes, sort_keys=True).encode()
        else:
            data = path.read_bytes()
        name = path.relative_to(folder).as_posix()
        digests.append(f"{name}:{hashlib.sha256(data).hexdigest()}")
    return hashlib.sha256("\n".join(sorted(digests)).encode()).hexdigest()


def stored_bytes(folder: Path) -> int:
    """Bytes of all files of a group, metadata included."""
    return sum(path.stat().st_size for path in _files(folder))


def sync(folder: Path) -> None:
    """fsync every file and folder below, then the folder itself."""
    for parent, _, names in os.walk(folder, topdown=False):
        for name in names:
            _fsync(Path(parent) / name)
        _fsync(Path(parent))


def sync_folder(folder: Path) -> None:
    """fsync one folder: the names in it, not what the names hold."""
    _fsync(folder)


def disk_error(error: OSError, where: Path) -> StoreError:
    """The one sentence for an OSError met while writing."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return StoreFullError(
            f"{where}: the disk is full; the version was not published and what was stored "
            "before is unchanged; free some space and run again."
        )
    # The whole error: it names the file, which a lazy dataset may have wanted to read.
    return StoreError(f"{where}: cannot be written ({error}).")


def _fsync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _files(folder: Path) -> Iterator[Path]:
    for parent, _, names in os.walk(folder):
        for name in names:
            yield Path(parent) / name


def _arrays(folder: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    for path in folder.rglob("zarr.json"):
        metadata = json.loads(path.read_text())
        if metadata["node_type"] == "array":
            yield path.parent, metadata


def _chunk_shape(shape: tuple[int, ...], itemsize: int) -> tuple[int, ...]:
    """Whole trailing axes, leading ones split, so that a chunk is about CHUNK_TARGET_BYTES."""
    chunks = [max(1, length) for length in shape]  # A chunk of an empty axis still has a length.
    for axis, length in enumerate(shape):
        row = itemsize * math.prod(chunks[axis + 1 :])
        chunks[axis] = max(1, min(length, CHUNK_TARGET_BYTES // max(row, 1)))
        if row * chunks[axis] <= CHUNK_TARGET_BYTES:
            break
    return tuple(chunks)


def _lazy_chunks(variable: Any, planned: tuple[int, ...]) -> tuple[int, ...]:
    """A lazy variable keeps its own chunks unless they are too small to be files."""
    own = tuple(blocks[0] for blocks in variable.chunks)
    large_enough = math.prod(own) * variable.dtype.itemsize >= CHUNK_LEAST_BYTES
    return own if large_enough else planned


def _stoppable_store() -> Any:
    """The wrapper class (made on demand: importing zarr takes a second)."""
    from zarr.storage import WrapperStore

    class StoppableStore(WrapperStore[Any]):
        """Writes nothing once it is stopped.

        When one chunk fails, zarr and dask raise at once and go on with other chunks behind the
        scenes: they would make the folder anew while the caller deletes it.
        """

        stopped = False
        at_work = 0

        async def set(self, key: str, value: Any) -> None:
            # Counted before `stopped` is looked at, so that `stop` cannot miss it.
            self.at_work += 1
            try:
                if self.stopped:
                    raise StoreError(f"{self._store}: chunk {key} comes after the writing ended.")
                await self._store.set(key, value)
            finally:
                self.at_work -= 1

        def stop(self) -> None:
            """Refuse what comes, wait for what is under way."""
            self.stopped = True
            while self.at_work:
                time.sleep(0.001)

    return StoppableStore


def _strict_store() -> Any:
    """The wrapper class (made on demand: importing zarr takes a second)."""
    from zarr.storage import WrapperStore

    class StrictStore(WrapperStore[Any]):
        """Raises MissingChunkError where zarr would return the fill value."""

        async def get(self, key: str, prototype: Any, byte_range: Any = None) -> Any:
            value = await self._store.get(key, prototype, byte_range)
            if value is None and _CHUNK_KEY.search(key):
                raise MissingChunkError(
                    f"{self._store}: chunk {key} is missing; expected every chunk of the array."
                )
            return value

    return StrictStore
