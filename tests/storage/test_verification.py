"""Rot: every flipped bit is noticed, names its place, and is mended from what is still good."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from storage.errors import DamagedError, NoVersionError, StoreError
from storage.verification import verify_slot
from storage.versions import STORED, Slot, VersionedStore

FLIPS = 150


def _noise(seed: int) -> xr.Dataset:
    noise = np.random.default_rng(seed).normal(size=(40, 30))
    return xr.Dataset({"field": (("y", "x"), noise)}, coords={"y": np.arange(40)})


def _write(store: VersionedStore, slot: Slot, seed: int) -> str:
    record = {"settings": {"seed": seed}, "recipe": f"recipe of {seed}", "checks": ["sharp"]}
    version = store.write(slot, _noise(seed), record).version
    store.pass_version(slot, version, "sharp", 0.1)
    return version


def flip(path: Path, chance: random.Random) -> None:
    """Flip one bit of a file."""
    data = bytearray(path.read_bytes())
    data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    path.write_bytes(data)


@pytest.fixture
def two(store: VersionedStore, slot: Slot) -> tuple[str, str]:
    """Two good versions; the second is current."""
    return _write(store, slot, 1), _write(store, slot, 2)


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size)


def test_every_flipped_bit_of_a_version_is_noticed_when_it_is_read(
    store: VersionedStore, slot: Slot, two: tuple[str, str], tmp_path: Path
) -> None:
    """Chunks, coordinates, arrays' and the group's metadata: what is opened is right or refused."""
    chance = random.Random(7)
    folder = store.folder(slot, two[1])
    shutil.copytree(folder, tmp_path / "good")
    names = {path.relative_to(folder) for path in _files(folder)}
    for _ in range(FLIPS):
        path = folder / chance.choice(sorted(names))
        flip(path, chance)
        with pytest.raises(DamagedError) as caught:
            store.open(slot, two[1]).load()
        assert caught.value.folder == folder
        assert path.name in str(caught.value) or path.parent.name in str(caught.value)
        shutil.copy(tmp_path / "good" / path.relative_to(folder), path)
    xr.testing.assert_equal(store.open(slot, two[1]).load(), _noise(2))


def test_every_flipped_bit_of_a_slot_is_mended(
    store: VersionedStore, slot: Slot, two: tuple[str, str], tmp_path: Path
) -> None:
    """Then what is current is good, and another look finds nothing."""
    chance = random.Random(8)
    folder = store.files(slot).folder
    shutil.copytree(folder, tmp_path / "good")
    current = {"versions": two[1], "verdicts": two[1], "current.json": two[1]}
    for _ in range(FLIPS):
        path = chance.choice(_files(folder))
        inside = path.relative_to(folder)
        flip(path, chance)
        found = list(verify_slot(store, slot))
        assert len(found) == 1, (inside, found)
        is_current_version = inside.parts[:2] == ("versions", two[1])
        expected = two[0] if is_current_version else current[inside.parts[0]]
        assert store.current(slot) == expected, (inside, found)
        seed = 1 if is_current_version else 2
        xr.testing.assert_equal(store.open(slot).load(), _noise(seed))
        assert list(verify_slot(store, slot)) == []
        if is_current_version:
            assert not store.verdicts(slot, two[1])[STORED]["passed"]
            again = _write(store, slot, 2)
            assert store.current(slot) == again != two[1]
        shutil.rmtree(folder)
        shutil.copytree(tmp_path / "good", folder)


def test_damage_of_all_versions_leaves_none(
    store: VersionedStore, slot: Slot, two: tuple[str, str]
) -> None:
    for version in two:
        flip(store.folder(slot, version) / "field/c/0/0", random.Random(1))
    assert len(list(verify_slot(store, slot))) == 2
    with pytest.raises(NoVersionError):
        store.current(slot)
    assert _write(store, slot, 2) == store.current(slot)


def test_rollback_passes_over_what_is_damaged(store: VersionedStore, slot: Slot) -> None:
    first, second, _ = (_write(store, slot, seed) for seed in (1, 2, 3))
    flip(store.folder(slot, second) / "field/c/0/0", random.Random(2))
    assert store.rollback(slot) == first
    with pytest.raises(NoVersionError, match="no earlier good version"):
        store.rollback(slot)


def test_a_version_without_checksums_is_read_and_verified(
    store: VersionedStore, slot: Slot, two: tuple[str, str]
) -> None:
    """As stores were before: no codec, no hashes, no seals; content hashes are the same."""
    folder = store.folder(slot)
    plain = store.root / "plain"
    import json

    import zarr

    group = zarr.open_group(plain, mode="w", zarr_format=3)
    source = zarr.open_group(folder, mode="r")
    for name, array in source.arrays():
        made = group.create_array(
            name,
            data=np.asarray(array[...]),
            chunks=array.chunks,
            fill_value=array.fill_value,
            dimension_names=array.metadata.dimension_names,
            compressors=[zarr.codecs.ZstdCodec(level=0)],
            config={"write_empty_chunks": True},
            attributes=dict(array.attrs),
        )
        assert [codec["name"] for codec in made.metadata.to_dict()["codecs"]] == ["bytes", "zstd"]
    record = dict(store.record(slot))
    group.attrs.update({key: value for key, value in source.attrs.items() if key != "tsuya"})
    group.attrs["tsuya"] = record
    assert json.loads((plain / "zarr.json").read_text())["attributes"]["tsuya"] == record
    shutil.rmtree(folder)
    plain.rename(folder)
    assert list(verify_slot(store, slot)) == []
    xr.testing.assert_equal(store.open(slot).load(), _noise(2))
    # Equal content: nothing is stale because of the checksums alone.
    assert _write(store, slot, 2) == two[1]
    flip(folder / "field/c/0/0", random.Random(3))
    (found,) = verify_slot(store, slot)
    assert "content hash" in found.what or "damaged" in found.what
    assert store.current(slot) == two[0]


def test_what_is_not_the_stores_is_left_alone(
    store: VersionedStore, slot: Slot, two: tuple[str, str]
) -> None:
    files = store.files(slot)
    strays = [
        files.folder / "Thumbs.db",
        files.folder / "versions" / ".DS_Store",
        files.folder / "versions" / "lost+found" / "#1",
        files.folder / "versions" / "copy of 20260101" / "zarr.json",
        store.folder(slot) / "Thumbs.db",
        store.folder(slot) / "field" / ".DS_Store",
        store.folder(slot) / "field" / "c" / "0" / "desktop.ini",
        files.folder / "verdicts" / "notes.txt",
        store.root / "lost+found" / "a" / "b" / "c",
        store.root / "photo_fur" / "Thumbs.db",
        store.root / "photo_fur" / "fur_photo" / ".DS_Store",
    ]
    for path in strays:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"not ours")
    assert list(store.slots()) == [slot]
    assert store.versions(slot) == list(two)
    assert list(verify_slot(store, slot)) == []
    xr.testing.assert_equal(store.open(slot).load(), _noise(2))
    store.collect(slot)
    assert _write(store, slot, 3) == store.current(slot)
    assert all(path.exists() for path in strays)


def test_a_damaged_verdict_is_checked_again(
    store: VersionedStore, slot: Slot, two: tuple[str, str]
) -> None:
    flip(store.files(slot).folder / "verdicts" / f"{two[1]}.json", random.Random(4))
    (found,) = verify_slot(store, slot)
    assert "verdicts" in found.what
    assert store.current(slot) == two[1]
    assert store.pointer(slot).recipe is None, "the launcher makes it again, and checks it"
    assert _write(store, slot, 2) == two[1]
    assert store.verdicts(slot, two[1])["sharp"]["passed"]


def test_a_read_only_store_says_so(store: VersionedStore, slot: Slot, two: tuple[str, str]) -> None:
    import os

    if os.geteuid() == 0:
        pytest.skip("root writes everywhere")
    store.root.chmod(0o500)
    try:
        with pytest.raises(StoreError, match="cannot be written"):
            _write(store, Slot("photo_fur", "fur_photo", "other"), 1)
    finally:
        store.root.chmod(0o700)


def test_settings_outlive_a_damaged_version_and_not_a_rejected_one(
    store: VersionedStore, slot: Slot
) -> None:
    """Who makes again what was damaged asks for the same."""
    damaged = _write(store, slot, 7)
    flip(store.folder(slot, damaged) / "zarr.json", random.Random(5))
    assert len(list(verify_slot(store, slot))) == 1
    assert store.pointer(slot).version is None
    assert store.pointer(slot).settings == {"seed": 7}
    again = _write(store, slot, 7)
    store.reject(slot, again, "sharp", "blurred")
    assert store.pointer(slot).settings is None
