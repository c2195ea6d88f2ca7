"""One dataset in one folder: plain Zarr v3, complete, hashed, and strictly read."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import dask
import dask.array as da
import numpy as np
import pytest
import xarray as xr
import zarr

from storage import zarr_files
from storage.errors import MissingChunkError, StoreError
from storage.zarr_files import (
    add_to_record,
    content_hash,
    open_dataset,
    read_record,
    stored_bytes,
    verify_complete,
    write_dataset,
)


def _varied() -> xr.Dataset:
    """Variables of all the kinds that the schemas declare, with values that are easily lost."""
    random = np.random.default_rng(4)
    with_nan = random.normal(size=(6, 5)).astype(np.float32)
    with_nan[2, 3] = np.nan
    with_nan[0, 0] = -0.0
    with_nan[1, 1] = np.inf
    return xr.Dataset(
        {
            "mask": (("y", "x"), random.random((6, 5)) < 0.5),
            "picture": (("y", "x", "channel"), random.integers(0, 256, (6, 5, 3), np.uint8)),
            "count": (("y",), np.array([0, -1, 2**62, 3, 4, 5]), {"units": "pixels"}),
            "radiance": (("y", "x"), with_nan, {"long_name": "Radiance", "source": "Eq. 1"}),
            "half": (("x",), np.arange(5, dtype=np.float16)),
            "scalar": ((), 0.25),
            "flag": ((), np.True_),
            "all_zero": (("y", "x"), np.zeros((6, 5))),
        },
        coords={
            "y": np.arange(6) * 2.0,
            "latitude": (("y", "x"), random.random((6, 5)), {"units": "degree"}),
            # Units of time: no reader may turn a number of seconds into a duration.
            "exposure": (("x",), np.arange(5.0), {"units": "seconds"}),
        },
        attrs={"name": "Fuchs / 狐", "sizes": [1, 2], "white": 1.5},
    )


def _lazy(dataset: xr.Dataset) -> xr.Dataset:
    return dataset.chunk({"y": 2, "x": 3, "channel": 1})


def _bits(dataset: xr.Dataset) -> dict[str, tuple[Any, bytes]]:
    """Dtype and bytes of every variable: stricter than equality, which takes -0 for 0."""
    return {
        str(name): (variable.dtype, np.ascontiguousarray(variable.values).tobytes())
        for name, variable in dataset.variables.items()
    }


# ---- round trip ------------------------------------------------------------------------------


@pytest.mark.parametrize("lazy", [False, True], ids=["eager", "lazy"])
def test_what_is_written_is_read(tmp_path: Path, lazy: bool) -> None:
    given = _varied()
    folder = tmp_path / "new" / "group"
    write_dataset(_lazy(given) if lazy else given, folder, {"recipe": "r"})
    verify_complete(folder)
    found = open_dataset(folder)
    assert all(v.chunks for v in found.data_vars.values() if v.ndim), "expected a lazy dataset"
    assert _bits(found) == _bits(given)
    xr.testing.assert_identical(found.load(), given.assign_attrs(tsuya={"recipe": "r"}))


@pytest.mark.parametrize("lazy", [False, True], ids=["eager", "lazy"])
def test_a_group_is_plain_zarr(tmp_path: Path, lazy: bool) -> None:
    given = _varied()
    folder = tmp_path / "group"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_dataset(_lazy(given) if lazy else given, folder, {"recipe": "r"})
        group = zarr.open_group(folder, mode="r")
        by_zarr = {name: np.asarray(array[...]) for name, array in group.arrays()}
        by_xarray = xr.open_dataset(folder, engine="zarr", consolidated=False).load()
    assert set(by_zarr) == set(map(str, given.variables))
    for name, (dtype, data) in _bits(given).items():
        assert (by_zarr[name].dtype, by_zarr[name].tobytes()) == (dtype, data)
    assert _bits(by_xarray) == _bits(given)
    assert set(by_xarray.coords) == set(given.coords)
    assert group.attrs["tsuya"] == {"recipe": "r"}


def test_metadata_are_zarr_v3_and_not_consolidated(tmp_path: Path) -> None:
    write_dataset(_varied(), tmp_path / "group", {})
    documents = {path.parent.name: json.loads(path.read_text()) for path in _metadata(tmp_path)}
    assert set(documents) == {"group", *map(str, _varied().variables)}
    for document in documents.values():
        assert document["zarr_format"] == 3
        assert "consolidated_metadata" not in document
    hidden = {".zgroup", ".zattrs", ".zarray", ".zmetadata"}
    assert not [path for path in tmp_path.rglob("*") if path.name in hidden]


def _metadata(folder: Path) -> list[Path]:
    return list(folder.rglob("zarr.json"))


def test_a_dataset_that_was_read_can_be_written_again(tmp_path: Path) -> None:
    # What was read remembers its chunks and codecs (xarray's `encoding`); they must not stick.
    write_dataset(_lazy(_varied()), tmp_path / "first", {})
    read = open_dataset(tmp_path / "first")
    write_dataset(read.isel(y=slice(1, None)), tmp_path / "second", {})
    verify_complete(tmp_path / "second")
    assert _bits(open_dataset(tmp_path / "second")) == _bits(_varied().isel(y=slice(1, None)))


def test_the_caller_s_dataset_is_left_alone(tmp_path: Path) -> None:
    given = _lazy(_varied())
    given["radiance"].encoding["chunks"] = (1, 1)
    write_dataset(given, tmp_path / "group", {"recipe": "r"})
    assert "tsuya" not in given.attrs
    assert given["radiance"].encoding == {"chunks": (1, 1)}
    assert given["radiance"].chunks == _lazy(_varied())["radiance"].chunks


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (2, 0, 3), (0,)], ids=str)
@pytest.mark.parametrize("lazy", [False, True], ids=["eager", "lazy"])
def test_arrays_without_elements(tmp_path: Path, shape: tuple[int, ...], lazy: bool) -> None:
    """A scene without lights, a mesh without hits."""
    field = da.zeros(shape) if lazy else np.zeros(shape)
    dims = [f"d{axis}" for axis in range(len(shape))]
    write_dataset(xr.Dataset({"field": (dims, field)}), tmp_path / "group", {})
    verify_complete(tmp_path / "group")
    content_hash(tmp_path / "group")
    assert open_dataset(tmp_path / "group").load()["field"].shape == shape


def test_an_existing_folder_is_not_written_over(tmp_path: Path) -> None:
    write_dataset(_varied(), tmp_path / "group", {})
    before = content_hash(tmp_path / "group")
    with pytest.raises(FileExistsError):
        write_dataset(_varied() * 2, tmp_path / "group", {})
    assert content_hash(tmp_path / "group") == before


# ---- chunks ----------------------------------------------------------------------------------


def _array_metadata(folder: Path, name: str) -> dict[str, Any]:
    return dict(json.loads((folder / name / "zarr.json").read_text()))


def _stored_chunks(folder: Path, name: str) -> tuple[int, ...]:
    grid = _array_metadata(folder, name)["chunk_grid"]
    return tuple(grid["configuration"]["chunk_shape"])


@pytest.mark.parametrize(
    ("shape", "lazy_chunks"),
    [
        ((5, 1024, 1024), None),
        ((1024, 1024, 5), None),
        ((3, 2, 1500, 1000), None),
        ((5_000_000,), None),
        ((40, 400, 400), (1, 400, 400)),
        ((40, 400, 400), (40, 25, 25)),
        ((1200, 4096), (1, 4096)),
        ((12, 700, 700), (5, 700, 700)),
    ],
    ids=str,
)
def test_chunks_of_large_arrays_are_neither_small_nor_huge(
    tmp_path: Path, shape: tuple[int, ...], lazy_chunks: tuple[int, ...] | None
) -> None:
    dims = [f"d{axis}" for axis in range(len(shape))]
    field = da.zeros(shape, dtype=np.float32, chunks=lazy_chunks or shape)
    dataset = xr.Dataset({"field": (dims, field if lazy_chunks else np.zeros(shape, np.float32))})
    write_dataset(dataset, tmp_path / "group", {})
    verify_complete(tmp_path / "group")
    stored = int(np.prod(_stored_chunks(tmp_path / "group", "field"))) * 4
    assert 2**20 <= stored <= 10 * 2**20


def test_a_lazy_array_keeps_chunks_that_are_large_enough(tmp_path: Path) -> None:
    field = da.zeros((7, 512, 600), dtype=np.float32, chunks=(2, 512, 600))
    write_dataset(xr.Dataset({"field": (("z", "y", "x"), field)}), tmp_path / "group", {})
    assert _stored_chunks(tmp_path / "group", "field") == (2, 512, 600)


def test_uneven_lazy_chunks_are_evened_out(tmp_path: Path) -> None:
    field = da.from_array(np.arange(10.0), chunks=((1, 4, 5),))
    write_dataset(xr.Dataset({"field": ("x", field)}), tmp_path / "group", {})
    verify_complete(tmp_path / "group")
    np.testing.assert_array_equal(open_dataset(tmp_path / "group")["field"], np.arange(10.0))


@pytest.mark.parametrize("lazy", [False, True], ids=["eager", "lazy"])
@pytest.mark.parametrize(
    ("dtype", "value"),
    [("int64", 0), ("uint8", 0), ("bool", False), ("float32", 0.0), ("float32", np.nan)],
)
def test_chunks_of_the_fill_value_are_files_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, dtype: str, value: float, lazy: bool
) -> None:
    field = np.full((6, 5), value, dtype)
    monkeypatch.setattr(zarr_files, "CHUNK_TARGET_BYTES", 2 * field[0].nbytes)
    data = da.from_array(field, chunks=(2, 5)) if lazy else field
    write_dataset(xr.Dataset({"field": (("y", "x"), data)}), tmp_path / "group", {})
    assert _stored_chunks(tmp_path / "group", "field") == (2, 5)
    chunks = [path for path in (tmp_path / "group/field/c").rglob("*") if path.is_file()]
    assert len(chunks) == 3


def test_a_lazy_dataset_is_streamed(writers: Any, tmp_path: Path) -> None:
    """The peak of memory stays far below the dataset's size, and would not if it were loaded."""
    place = {"root": str(tmp_path), "slot": ["a", "b", "c"], "blocks": 48}
    lazy, eager = (
        writers.start("stream", **place, lazy=lazy).finish()[-1] for lazy in (True, False)
    )
    assert lazy["dataset"] == eager["dataset"] == 48 * 4 * 2**20
    assert lazy["rise"] < 0.35 * lazy["dataset"]
    assert eager["rise"] > 0.9 * eager["dataset"], "the measure itself is blind"


# ---- content hash ----------------------------------------------------------------------------


def _hash(dataset: xr.Dataset, folder: Path, **record: Any) -> str:
    write_dataset(dataset, folder, record)
    return content_hash(folder)


def test_equal_data_have_equal_hashes_whatever_the_record(tmp_path: Path) -> None:
    first = _hash(_varied(), tmp_path / "first", settings={"size": 1})
    second = _hash(_varied(), tmp_path / "second", settings={"size": 2}, run="another")
    assert first == second
    add_to_record(tmp_path / "second", created="now")
    assert content_hash(tmp_path / "second") == first


def test_eager_and_lazy_data_of_equal_chunks_have_equal_hashes(tmp_path: Path) -> None:
    # Far below 1 MB: both are stored in the chunks that the store plans.
    assert _hash(_varied(), tmp_path / "eager") == _hash(_lazy(_varied()), tmp_path / "lazy")


def test_eager_and_lazy_data_of_equal_large_chunks_have_equal_hashes(tmp_path: Path) -> None:
    field = np.random.default_rng(0).random((5, 512, 1024))
    given = xr.Dataset({"field": (("z", "y", "x"), field)})
    eager = _hash(given, tmp_path / "eager")
    assert _stored_chunks(tmp_path / "eager", "field") == (2, 512, 1024)
    assert _hash(given.chunk({"z": 2}), tmp_path / "lazy") == eager


@pytest.mark.parametrize("name", [str(name) for name in _varied().variables])
def test_one_changed_value_changes_the_hash(tmp_path: Path, name: str) -> None:
    changed = _varied()
    values = np.atleast_1d(changed[name].values.copy())
    last = values.reshape(-1)
    last[-1] = ~last[-1] if values.dtype == bool else last[-1] + 1
    changed[name] = changed[name].copy(data=values.reshape(changed[name].shape))
    assert _hash(changed, tmp_path / "changed") != _hash(_varied(), tmp_path / "given")


def test_the_sign_of_zero_and_the_dtype_count(tmp_path: Path) -> None:
    hashes = [
        _hash(xr.Dataset({"field": ("x", field)}), tmp_path / str(number))
        for number, field in enumerate(
            [np.zeros(2), -np.zeros(2), np.zeros(2, np.int64), np.zeros(2, np.uint64)]
        )
    ]
    assert len(set(hashes)) == 4


def test_names_dimensions_and_attributes_count(tmp_path: Path) -> None:
    given = _varied()
    others = [
        given.rename(radiance="luminance"),
        given.rename_dims(x="column"),
        given.assign_attrs(name="Hase"),
        given.assign(radiance=given["radiance"].assign_attrs(source="Eq. 2")),
        given.reset_coords("latitude"),
        given.rename(mask="all_zero", all_zero="mask"),
    ]
    hashes = {_hash(other, tmp_path / str(number)) for number, other in enumerate(others)}
    assert len(hashes | {_hash(given, tmp_path / "given")}) == len(others) + 1


def test_chunks_that_change_places_change_the_hash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The hashes of the chunks alone are the same set in both.
    monkeypatch.setattr(zarr_files, "CHUNK_TARGET_BYTES", 8)
    upward = _hash(xr.Dataset({"field": ("x", [1.0, 2.0])}), tmp_path / "upward")
    downward = _hash(xr.Dataset({"field": ("x", [2.0, 1.0])}), tmp_path / "downward")
    assert upward != downward


def test_the_hash_is_the_same_in_another_process(writers: Any, tmp_path: Path) -> None:
    # Another hash seed there: the order of a set must not reach the metadata.
    names = [f"name_{number}" for number in range(12)]
    given = xr.Dataset(
        {"field": ("x", np.arange(4.0), dict.fromkeys(names, 1))},
        coords={name: ("x", np.arange(4)) for name in names},
        attrs=dict.fromkeys(names, "text"),
    )
    there = writers.start("hash_of", folder=str(tmp_path / "there")).finish()[-1]["hash"]
    assert _hash(given, tmp_path / "here") == there


# ---- missing chunks --------------------------------------------------------------------------


@pytest.fixture
def split(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A group with an array of 3 x 2 chunks and a scalar, far from the fill value."""
    monkeypatch.setattr(zarr_files, "CHUNK_TARGET_BYTES", 64)
    monkeypatch.setattr(zarr_files, "CHUNK_LEAST_BYTES", 64)
    field = da.from_array(np.arange(6 * 8.0).reshape(6, 8) + 1, chunks=(2, 4))
    dataset = xr.Dataset({"field": (("y", "x"), field), "c": ((), 3.5)})
    write_dataset(dataset, tmp_path / "split", {})
    assert _stored_chunks(tmp_path / "split", "field") == (2, 4)
    return tmp_path / "split"


def test_reading_a_missing_chunk_raises(split: Path) -> None:
    (split / "field/c/1/0").unlink()
    # Plain zarr gives the fill value: what this store is there to prevent.
    by_zarr = zarr.open_array(split / "field", mode="r")
    assert np.isnan(np.asarray(by_zarr[2, 0]))
    found = open_dataset(split)
    with pytest.raises(MissingChunkError, match=r"field/c/1/0 is missing; expected"):
        found.load()
    first_rows = np.arange(16.0).reshape(2, 8) + 1
    np.testing.assert_array_equal(open_dataset(split)["field"][:2], first_rows)
    with pytest.raises(MissingChunkError, match=r"field/c/1/0"):
        open_dataset(split)["field"][2:4, :4].values  # noqa: B018


def test_reading_a_missing_scalar_raises(split: Path) -> None:
    (split / "c/c").unlink()
    with pytest.raises(MissingChunkError, match=r"c/c is missing"):
        open_dataset(split).load()


def test_a_missing_coordinate_raises_when_opened(tmp_path: Path) -> None:
    write_dataset(_varied(), tmp_path / "group", {})
    (tmp_path / "group/y/c/0").unlink()
    with pytest.raises(MissingChunkError, match=r"y/c/0 is missing"):
        open_dataset(tmp_path / "group")


@pytest.mark.parametrize("chunk", ["field/c/0/0", "field/c/2/1", "c/c"])
def test_an_incomplete_group_is_told(split: Path, chunk: str) -> None:
    verify_complete(split)
    (split / chunk).unlink()
    with pytest.raises(MissingChunkError) as caught:
        verify_complete(split)
    assert f"{split}: chunk {chunk} is missing or empty" in str(caught.value)


def test_an_array_without_any_chunk_is_told(split: Path) -> None:
    for path in (split / "field/c").rglob("*"):
        if path.is_file():
            path.unlink()
    with pytest.raises(MissingChunkError, match="0 of 6 chunks of field are there"):
        verify_complete(split)


# ---- the record ------------------------------------------------------------------------------


def test_the_record_is_kept_and_extended(tmp_path: Path) -> None:
    folder = tmp_path / "group"
    write_dataset(_varied(), folder, {"settings": {"sizes": [1, 2]}, "recipe": "狐"})
    add_to_record(folder, content="hash")
    assert read_record(folder) == {"settings": {"sizes": [1, 2]}, "recipe": "狐", "content": "hash"}
    assert open_dataset(folder).attrs["tsuya"] == read_record(folder)
    assert zarr.open_group(folder, mode="r").attrs["name"] == "Fuchs / 狐"


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.unlink(),
        lambda path: path.write_text(path.read_text()[:50]),
        lambda path: path.write_text('{"attributes": {}}'),
    ],
    ids=["absent", "cut", "another program's"],
)
def test_a_record_that_cannot_be_read_is_told(
    tmp_path: Path, damage: Callable[[Path], object]
) -> None:
    write_dataset(_varied(), tmp_path / "group", {})
    damage(tmp_path / "group/zarr.json")
    with pytest.raises(
        StoreError, match=r"group: zarr\.json, the version's record, cannot be read"
    ):
        read_record(tmp_path / "group")


# ---- bytes on disk ---------------------------------------------------------------------------


def test_stored_bytes_are_what_du_counts(tmp_path: Path) -> None:
    write_dataset(_varied(), tmp_path / "group", {})
    counted = sum(
        os.path.getsize(os.path.join(parent, name))
        for parent, _, names in os.walk(tmp_path / "group")
        for name in names
    )
    assert stored_bytes(tmp_path / "group") == counted > 0


def test_every_file_and_folder_is_synced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_dataset(_lazy(_varied()), tmp_path / "group", {})
    synced: set[str] = set()

    def note(descriptor: int) -> None:
        synced.add(os.readlink(f"/proc/self/fd/{descriptor}"))

    monkeypatch.setattr(os, "fsync", note)
    zarr_files.sync(tmp_path / "group")
    expected = {tmp_path / "group", *(tmp_path / "group").rglob("*")}
    assert synced == {str(path) for path in expected}


def test_an_error_of_lazy_data_is_not_hidden(tmp_path: Path) -> None:
    def fail(_: object) -> np.ndarray:
        raise ValueError("the photograph is broken")

    field = da.zeros(4).map_blocks(fail, dtype=float)
    with pytest.raises(ValueError, match="the photograph is broken"):
        write_dataset(xr.Dataset({"field": ("x", field)}), tmp_path / "group", {})


def test_a_file_that_lazy_data_need_is_named(tmp_path: Path) -> None:
    def fail(_: object) -> np.ndarray:
        return np.frombuffer((tmp_path / "photograph.raw").read_bytes())

    field = da.zeros(4).map_blocks(fail, dtype=float)
    with pytest.raises(StoreError, match=r"photograph\.raw"):
        write_dataset(xr.Dataset({"field": ("x", field)}), tmp_path / "group", {})


def test_the_module_is_imported_without_zarr() -> None:
    """Dagster loads definitions often: what is heavy is imported where it is needed."""
    code = (
        "import sys, storage.versions, storage.schemas.photo_fur;"
        "print([name for name in ('zarr', 'xarray', 'dask', 'numpy') if name in sys.modules])"
    )
    root = Path(zarr_files.__file__).parents[1]
    found = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "[]"


def test_a_dataset_can_travel_to_a_worker(tmp_path: Path) -> None:
    """Dask's workers unpickle what they compute."""
    cloudpickle = pytest.importorskip("cloudpickle")
    write_dataset(_varied(), tmp_path / "group", {})
    with dask.config.set(scheduler="synchronous"):
        travelled = cloudpickle.loads(cloudpickle.dumps(open_dataset(tmp_path / "group")))
        assert _bits(travelled) == _bits(_varied())
    (tmp_path / "group/radiance/c/0/0").unlink()
    travelled = cloudpickle.loads(cloudpickle.dumps(open_dataset(tmp_path / "group")))
    with pytest.raises(MissingChunkError):
        travelled["radiance"].load()
