"""One dataset in one folder as plain Zarr v3: write, verify, hash, read strictly.

Zarr reads an absent chunk as the fill value, silently. Here every chunk is written (empty ones
too), looked for before a version is published, and demanded when it is read. Each chunk ends in
its checksum (the codec crc32c, which every reader of Zarr v3 knows), the group's ``zarr.json``
holds hashes of the arrays' and a seal of its own bytes: a flipped bit is an error, not data.
What was written before there were checksums is read on.
"""

from __future__ import annotations

import asyncio
import errno
import hashlib
import itertools
import json
import math
import os
import re
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage import sealed_json
from storage.errors import DamagedError, MissingChunkError, StoreError, StoreFullError

if TYPE_CHECKING:
    import xarray as xr

RECORD = "tsuya"
"""Name of the group attribute that holds what the store itself knows of a version."""

CHUNK_TARGET_BYTES = 8 * 2**20
CHUNK_LEAST_BYTES = 2**20
_CHUNK_KEY = re.compile(r"^(.*?)/?c(?:/\d+)*$")
_ARRAYS = "arrays"
"""Entry of the record: the hash of each array's ``zarr.json``."""
_CHECKSUM = {"name": "crc32c"}
_CHECKSUM_BYTES = 4


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
    store = _stoppable_store(folder)(LocalStore(folder))
    try:
        prepared.to_zarr(store, mode="w-", encoding=encoding, zarr_format=3, consolidated=False)
    except OSError as error:
        raise disk_error(error, folder) from error
    finally:
        store.stop()


def add_to_record(folder: Path, **entries: Any) -> None:
    """Add entries to the record of a group that is not published yet, and seal it."""
    path = folder / "zarr.json"
    metadata = json.loads(path.read_text())
    arrays = {name: _hash((folder / name / "zarr.json").read_bytes()) for name in _arrays(folder)}
    entries |= {_ARRAYS: arrays, sealed_json.SEAL: sealed_json.BLANK}
    metadata["attributes"][RECORD].update(entries)
    with path.open("wb") as file:
        sealed_json.dump(metadata, file)


def read_record(folder: Path) -> dict[str, Any]:
    """The record of a stored group, without opening its arrays. Raises DamagedError."""
    record = _sealed_record(folder)
    return {name: record[name] for name in record if name not in (_ARRAYS, sealed_json.SEAL)}


def _sealed_record(folder: Path) -> dict[str, Any]:
    """The record with the hashes of the arrays' metadata."""
    try:
        metadata = sealed_json.loads((folder / "zarr.json").read_bytes())
        record = dict(metadata["attributes"][RECORD])
        if _ARRAYS in record and sealed_json.SEAL not in record:
            raise ValueError("its seal is lost")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DamagedError(
            folder, f"zarr.json, the version's record, cannot be read ({error})"
        ) from error
    return record


def open_dataset(folder: Path) -> xr.Dataset:
    """Open a stored group lazily.

    Raises DamagedError where metadata are not what was written; reading an absent chunk raises
    MissingChunkError, a damaged one DamagedError, both naming it.
    """
    import xarray as xr
    from zarr.storage import LocalStore

    arrays = _verified_metadata(folder)
    checked = frozenset(name for name, metadata in arrays.items() if _has_checksums(metadata))
    opened: xr.Dataset = xr.open_zarr(
        _strict_store(folder, frozenset(arrays), checked)(LocalStore(folder, read_only=True)),
        chunks={},
        consolidated=False,
        zarr_format=3,
        mask_and_scale=False,
    )
    return opened.assign_attrs({RECORD: read_record(folder)})


def verify(folder: Path) -> None:
    """Raise DamagedError unless all bytes of a published group are those that were written."""
    record = read_record(folder)
    verify_complete(folder)
    for name, metadata in _verified_metadata(folder).items():
        if _has_checksums(metadata):
            for chunk in _chunk_files(folder / name, metadata):
                key = chunk.relative_to(folder).as_posix()
                _check_chunk(folder, key, memoryview(chunk.read_bytes()))
    if "content" in record and content_hash(folder) != record["content"]:
        raise DamagedError(folder, "its content hash is not the one that was noted")


def verify_complete(folder: Path) -> None:
    """Raise MissingChunkError unless every chunk that the shapes demand is a file with bytes."""
    for name, metadata in _verified_metadata(folder).items():
        expected = list(_chunk_files(folder / name, metadata))
        lacking = [path for path in expected if not _has_bytes(path)]
        if lacking:
            raise MissingChunkError(
                folder,
                f"chunk {lacking[0].relative_to(folder)} is missing or empty "
                f"({len(expected) - len(lacking)} of {len(expected)} chunks of {name} are there)",
            )


def content_hash(folder: Path) -> str:
    """Hash of what the arrays hold: the hash of the sorted hashes of chunks and array metadata.

    The dataset's own attributes count; the store's record (settings, times) does not, so two runs
    that give the same arrays have the same hash. Checksums do not count either: they were added
    when there were versions already.
    """
    attributes = json.loads((folder / "zarr.json").read_bytes())["attributes"]
    attributes.pop(RECORD, None)
    digests = [f"zarr.json:{_hash(json.dumps(attributes, sort_keys=True).encode())}"]
    for name in _arrays(folder):
        path = folder / name / "zarr.json"
        metadata = json.loads(path.read_bytes())
        checked = _has_checksums(metadata)
        plain = _without_checksums(metadata) if checked else path.read_bytes()
        digests.append(f"{name}/zarr.json:{_hash(plain)}")
        for chunk in _chunk_files(folder / name, metadata):
            data = memoryview(chunk.read_bytes())
            key = chunk.relative_to(folder).as_posix()
            digests.append(f"{key}:{_hash(data[:-_CHECKSUM_BYTES] if checked else data)}")
    return _hash("\n".join(sorted(digests)).encode())


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


def _hash(data: bytes | memoryview) -> str:
    return hashlib.sha256(data).hexdigest()


def _arrays(folder: Path) -> list[str]:
    """Names of the group's arrays; what else lies in the folder is not the store's."""
    return sorted(path.parent.name for path in folder.glob("*/zarr.json"))


def _verified_metadata(folder: Path) -> dict[str, dict[str, Any]]:
    """Each array's metadata, by name. Raises DamagedError where they are not as recorded."""
    recorded = _sealed_record(folder).get(_ARRAYS)
    found = {}
    for name in _arrays(folder) if recorded is None else recorded:
        try:
            data = (folder / name / "zarr.json").read_bytes()
            found[name] = json.loads(data)
        except (OSError, ValueError) as error:
            raise DamagedError(folder, f"{name}/zarr.json cannot be read ({error})") from error
        if recorded is not None and _hash(data) != recorded[name]:
            raise DamagedError(folder, f"{name}/zarr.json has not the hash that was noted")
    return found


def _chunk_files(array: Path, metadata: dict[str, Any]) -> Iterator[Path]:
    """Every chunk file that the array's shape demands; a scalar's one is the file ``c``."""
    chunks = metadata["chunk_grid"]["configuration"]["chunk_shape"]
    counts = [math.ceil(n / c) for n, c in zip(metadata["shape"], chunks, strict=True)]
    for place in itertools.product(*(range(count) for count in counts)):
        yield array.joinpath("c", *map(str, place))


def _has_bytes(path: Path) -> bool:
    try:
        return path.stat().st_size > 0
    except FileNotFoundError:
        return False


def _has_checksums(metadata: dict[str, Any]) -> bool:
    return bool(metadata["codecs"][-1]["name"] == _CHECKSUM["name"])


def _with_checksums(metadata: dict[str, Any]) -> bytes:
    """An array's ``zarr.json`` that says that each chunk ends in its checksum."""
    return json.dumps({**metadata, "codecs": [*metadata["codecs"], _CHECKSUM]}, indent=2).encode()


def _without_checksums(metadata: dict[str, Any]) -> bytes:
    """An array's ``zarr.json`` as it was before chunks had checksums."""
    return json.dumps({**metadata, "codecs": metadata["codecs"][:-1]}, indent=2).encode()


def _append_checksum(chunk: Path, data: Any) -> None:
    """Add its checksum to a chunk's file; ``data``: what was written there."""
    import google_crc32c

    with chunk.open("ab") as file:
        file.write(google_crc32c.value(data).to_bytes(_CHECKSUM_BYTES, "little"))


def _check_chunk(folder: Path, key: str, data: memoryview) -> None:
    """Raise DamagedError unless a chunk ends in its checksum."""
    import google_crc32c
    import numpy as np

    found = int.from_bytes(data[-_CHECKSUM_BYTES:], "little")
    if google_crc32c.value(np.frombuffer(data[:-_CHECKSUM_BYTES], np.uint8)) != found:
        raise DamagedError(folder, f"chunk {key} is damaged: it has not its checksum")


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


def _stoppable_store(folder: Path) -> Any:
    """The wrapper class of one group (made on demand: importing zarr takes a second)."""
    from zarr.storage import WrapperStore

    class StoppableStore(WrapperStore[Any]):
        """Adds the checksums, and writes nothing once it is stopped.

        Zarr's own codec would copy every chunk for the four bytes. When one chunk fails, zarr and
        dask raise at once and go on with other chunks behind the scenes: they would make the folder
        anew while the caller deletes it.
        """

        stopped = False
        at_work = 0

        async def set(self, key: str, value: Any) -> None:
            # Counted before `stopped` is looked at, so that `stop` cannot miss it.
            self.at_work += 1
            try:
                if self.stopped:
                    raise StoreError(f"{self._store}: chunk {key} comes after the writing ended.")
                if key.endswith("/zarr.json"):
                    metadata = json.loads(value.to_bytes())
                    value = type(value).from_bytes(_with_checksums(metadata))
                await self._store.set(key, value)
                if _CHUNK_KEY.match(key):
                    data = value.as_numpy_array()
                    await asyncio.to_thread(_append_checksum, folder / key, data)
            finally:
                self.at_work -= 1

        def stop(self) -> None:
            """Refuse what comes, wait for what is under way."""
            self.stopped = True
            while self.at_work:
                time.sleep(0.001)

    return StoppableStore


def _strict_store(folder: Path, arrays: frozenset[str], checked: frozenset[str]) -> Any:
    """The wrapper class of one group (made on demand: importing zarr takes a second)."""
    from zarr.storage import WrapperStore

    class StrictStore(WrapperStore[Any]):
        """Raises DamagedError, naming the chunk, where zarr would return the fill value or noise.

        It has these arrays and nothing that lies beside them. The chunks of those in ``checked``
        have checksums: they are compared and taken off here, once, where a chunk's name is known;
        to zarr it looks as if there were none.
        """

        async def list_dir(self, prefix: str) -> AsyncIterator[str]:
            async for name in self._store.list_dir(prefix):
                if prefix or name in arrays or name == "zarr.json":
                    yield name

        async def get(self, key: str, prototype: Any, byte_range: Any = None) -> Any:
            value = await self._store.get(key, prototype, byte_range)
            chunk = _CHUNK_KEY.match(key)
            if chunk and value is None:
                raise MissingChunkError(folder, f"chunk {key} is missing")
            if chunk and chunk[1] in checked:
                _check_chunk(folder, key, memoryview(value.as_numpy_array()))
                return value[:-_CHECKSUM_BYTES]
            if key.removesuffix("/zarr.json") in checked:
                plain = _without_checksums(json.loads(value.to_bytes()))
                return prototype.buffer.from_bytes(plain)
            return value

    return StrictStore
