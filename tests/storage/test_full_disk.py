"""A full disk: one sentence, the version before stays current, nothing is left half-written."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import dask
import numpy as np
import pytest
import xarray as xr

from storage import sealed_json, zarr_files
from storage.errors import StoreError, StoreFullError
from storage.versions import Slot, VersionedStore

Fingerprint = Callable[[Path], dict[str, str]]

SLOT = Slot("system", "asset", "key")
RECORD: dict[str, Any] = {"settings": {}, "recipe": "r", "checks": []}
DISK_BYTES = 4 * 2**20


def _noise(megabytes: float, seed: int) -> xr.Dataset:
    """Data that no codec makes smaller."""
    values = np.random.default_rng(seed).integers(0, 256, int(megabytes * 2**20), np.uint8)
    return xr.Dataset({"noise": ("x", values)})


def _assert_one_sentence(error: StoreError, where: Path) -> None:
    message = str(error)
    assert message.startswith(f"{where}")
    assert "the disk is full" in message
    assert "\n" not in message
    assert message.endswith(".")
    assert ". " not in message


def _folder(store: VersionedStore) -> Path:
    return store.root / SLOT.system / SLOT.asset / SLOT.partition


class _Before:
    """What a store holds, to be compared with what it holds after a failure."""

    def __init__(self, store: VersionedStore, fingerprint: Fingerprint) -> None:
        self._store, self._fingerprint = store, fingerprint
        self._files = fingerprint(store.root)
        self._pointer = store.pointer(SLOT)

    def assert_unchanged(self) -> None:
        """Not a file more, not a file less, and the current version can be read."""
        assert self._store.pointer(SLOT) == self._pointer
        assert self._fingerprint(self._store.root) == self._files
        assert list((_folder(self._store) / "staging").iterdir()) == []
        if self._pointer.version is not None:
            xr.testing.assert_equal(self._store.open(SLOT).load(), _noise(0.5, 1))


# ---- a real disk -----------------------------------------------------------------------------


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 4 MB; only root can make one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(mount, capture_output=True, text=True)
    except FileNotFoundError:
        pytest.skip("a small disk needs the command mount")
    if mounted.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {mounted.stderr.strip()}")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


@pytest.fixture
def small_store(small_disk: Path) -> VersionedStore:
    """A store on the small disk with a version of half a megabyte."""
    store = VersionedStore(small_disk / "store")
    store.write(SLOT, _noise(0.5, 1), RECORD)
    return store


def _fill(disk: Path) -> Path:
    """Fill a disk to the last byte."""
    filler = disk / "filler"
    with filler.open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while True:
            file.write(b"\0" * 4096)
    assert shutil.disk_usage(disk).free == 0
    return filler


@pytest.mark.parametrize("lazy", [False, True], ids=["eager", "lazy"])
def test_data_larger_than_the_disk(
    small_store: VersionedStore, fingerprint: Fingerprint, lazy: bool
) -> None:
    before = _Before(small_store, fingerprint)
    data = _noise(6, 2)
    with pytest.raises(StoreFullError) as caught:
        small_store.write(SLOT, data.chunk({"x": 2**20}) if lazy else data, RECORD)
    _assert_one_sentence(caught.value, _folder(small_store) / "staging")
    before.assert_unchanged()
    # The room is free again: what fits can be written at once.
    smaller = small_store.write(SLOT, _noise(2, 3), RECORD)
    assert small_store.current(SLOT) == smaller.version


def test_a_disk_without_a_byte_left(small_store: VersionedStore, fingerprint: Fingerprint) -> None:
    filler = _fill(small_store.root.parent)
    before = _Before(small_store, fingerprint)
    with pytest.raises(StoreFullError) as caught:
        small_store.write(SLOT, _noise(0.1, 2), RECORD)
    _assert_one_sentence(caught.value, _folder(small_store) / "staging")
    before.assert_unchanged()
    filler.unlink()
    assert small_store.write(SLOT, _noise(0.1, 2), RECORD).is_new


def test_a_disk_that_fills_up_before_the_pointer_is_replaced(
    small_store: VersionedStore, fingerprint: Fingerprint, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _Before(small_store, fingerprint)
    sync_folder = zarr_files.sync_folder

    def fill_then_sync(folder: Path) -> None:
        if folder.name == "versions":
            _fill(small_store.root.parent)
        sync_folder(folder)

    monkeypatch.setattr(zarr_files, "sync_folder", fill_then_sync)
    with pytest.raises(StoreFullError) as caught:
        small_store.write(SLOT, _noise(0.5, 2), RECORD)
    _assert_one_sentence(caught.value, _folder(small_store) / "current.json")
    before.assert_unchanged()


def test_verdicts_on_a_full_disk(small_store: VersionedStore, fingerprint: Fingerprint) -> None:
    checked = {**RECORD, "checks": ["sharp"]}
    waiting = small_store.write(SLOT, _noise(0.5, 2), checked).version
    filler = _fill(small_store.root.parent)
    before = _Before(small_store, fingerprint)
    with pytest.raises(StoreFullError):
        small_store.pass_version(SLOT, waiting, "sharp", 1.0)
    with pytest.raises(StoreFullError):
        small_store.reject(SLOT, waiting, "sharp", "blurred")
    before.assert_unchanged()
    filler.unlink()
    small_store.pass_version(SLOT, waiting, "sharp", 1.0)
    assert small_store.current(SLOT) == waiting


def test_the_first_version_on_a_full_disk(small_disk: Path) -> None:
    store = VersionedStore(small_disk / "store")
    filler = _fill(small_disk)
    with pytest.raises(StoreFullError):
        store.write(SLOT, _noise(0.5, 1), RECORD)
    assert store.pointer(SLOT).version is None
    filler.unlink()
    assert store.write(SLOT, _noise(0.5, 1), RECORD).is_new


# ---- an injected error -----------------------------------------------------------------------


def _no_room(*_: Any, **__: Any) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.fixture
def store(store: VersionedStore) -> VersionedStore:
    """A store with a version of half a megabyte."""
    store.write(SLOT, _noise(0.5, 1), RECORD)
    return store


@pytest.mark.parametrize("number", [500, errno.ENOSPC, errno.EDQUOT], ids=["", "disk", "quota"])
@pytest.mark.parametrize("call", [1, 2, 4, 7])
@pytest.mark.parametrize("lazy", [False, True], ids=["eager", "lazy"])
def test_no_room_for_a_chunk(
    store: VersionedStore,
    fingerprint: Fingerprint,
    monkeypatch: pytest.MonkeyPatch,
    lazy: bool,
    call: int,
    number: int,
) -> None:
    from zarr.storage import LocalStore

    before = _Before(store, fingerprint)
    store_one = LocalStore.set
    calls = 0

    async def fail(self: LocalStore, key: str, value: Any) -> None:
        nonlocal calls
        calls += 1
        if calls >= call:
            raise OSError(number, os.strerror(number))
        await store_one(self, key, value)

    monkeypatch.setattr(LocalStore, "set", fail)
    monkeypatch.setattr(zarr_files, "CHUNK_TARGET_BYTES", 2**20)
    data = _noise(6, 2)
    full = number in (errno.ENOSPC, errno.EDQUOT)
    with pytest.raises(StoreFullError if full else StoreError) as caught:
        store.write(SLOT, data.chunk({"x": 2**20}) if lazy else data, RECORD)
    if full:
        _assert_one_sentence(caught.value, _folder(store) / "staging")
    before.assert_unchanged()


@pytest.mark.parametrize("lazy", [False, True], ids=["eager", "lazy"])
def test_chunks_under_way_do_not_make_the_folder_anew(
    store: VersionedStore,
    fingerprint: Fingerprint,
    monkeypatch: pytest.MonkeyPatch,
    lazy: bool,
) -> None:
    """One chunk fails while others are being written, or computed: they come after the end."""
    from zarr.storage import LocalStore

    before = _Before(store, fingerprint)
    store_one = LocalStore.set
    slow: list[str] = []

    async def fail_or_dawdle(self: LocalStore, key: str, value: Any) -> None:
        if key == "noise/c/0":
            await asyncio.sleep(0.02)
            _no_room()
        if key.startswith("noise/c/"):
            slow.append(key)
            await asyncio.sleep(0.05)
        await store_one(self, key, value)

    def compute_slowly(block: np.ndarray) -> np.ndarray:
        if slow:
            time.sleep(0.15)
        return block

    monkeypatch.setattr(zarr_files, "CHUNK_TARGET_BYTES", 2**20)
    monkeypatch.setattr(LocalStore, "set", fail_or_dawdle)
    data = _noise(6, 2)
    if lazy:
        data = data.chunk({"x": 2**20}).map(
            lambda noise: noise.copy(data=noise.data.map_blocks(compute_slowly, dtype=np.uint8))
        )
    with dask.config.set(num_workers=4), pytest.raises(StoreFullError):
        store.write(SLOT, data, RECORD)
    assert slow, "no other chunk was under way"
    before.assert_unchanged()
    time.sleep(0.3)
    before.assert_unchanged()


@pytest.mark.parametrize(
    "target",
    [
        (Path, "mkdir"),
        (sealed_json, "dump"),
        (os, "rename"),
        (os, "fsync"),
        (zarr_files, "sync_folder"),
        (os, "replace"),
    ],
    ids=lambda target: target[1],
)
def test_no_room_anywhere(
    store: VersionedStore,
    fingerprint: Fingerprint,
    monkeypatch: pytest.MonkeyPatch,
    target: tuple[Any, str],
) -> None:
    before = _Before(store, fingerprint)
    with monkeypatch.context() as patched:
        patched.setattr(*target, _no_room)
        with pytest.raises(StoreFullError) as caught:
            store.write(SLOT, _noise(0.1, 2), RECORD)
    assert "the disk is full" in str(caught.value)
    before.assert_unchanged()
    assert store.write(SLOT, _noise(0.1, 2), RECORD).is_new


@pytest.mark.parametrize("fails", ["write", "fsync", "replace"])
def test_no_room_for_the_pointer(
    store: VersionedStore,
    fingerprint: Fingerprint,
    monkeypatch: pytest.MonkeyPatch,
    fails: str,
) -> None:
    before = _Before(store, fingerprint)
    sync_folder = zarr_files.sync_folder

    def sync_then_fill(folder: Path) -> None:
        sync_folder(folder)
        if folder.name == "versions":
            # The new version is in its place; only the pointer is missing.
            target = {
                "write": "storage.sealed_json.dump",
                "fsync": "os.fsync",
                "replace": "os.replace",
            }[fails]
            monkeypatch.setattr(target, _no_room)

    monkeypatch.setattr(zarr_files, "sync_folder", sync_then_fill)
    with pytest.raises(StoreFullError) as caught:
        store.write(SLOT, _noise(0.1, 2), RECORD)
    _assert_one_sentence(caught.value, _folder(store) / "current.json")
    before.assert_unchanged()


def test_a_pointer_that_was_replaced_keeps_its_version(
    store: VersionedStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The failure comes after the replacement: what the pointer names must stay."""
    before = store.current(SLOT)
    sync_folder = zarr_files.sync_folder

    def fail_for_the_pointer(folder: Path) -> None:
        if folder.name == SLOT.partition:
            _no_room()
        sync_folder(folder)

    monkeypatch.setattr(zarr_files, "sync_folder", fail_for_the_pointer)
    with pytest.raises(StoreFullError):
        store.write(SLOT, _noise(0.1, 2), RECORD)
    assert store.current(SLOT) != before
    xr.testing.assert_equal(store.open(SLOT).load(), _noise(0.1, 2))
    assert store.pointer(SLOT).earlier == (before,)


def test_other_errors_of_the_disk_are_told(
    store: VersionedStore, fingerprint: Fingerprint, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _Before(store, fingerprint)

    def read_only(*_: Any) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    with monkeypatch.context() as patched:
        patched.setattr(os, "rename", read_only)
        with pytest.raises(StoreError, match="Read-only file system") as caught:
            store.write(SLOT, _noise(0.1, 2), RECORD)
    assert not isinstance(caught.value, StoreFullError)
    before.assert_unchanged()
