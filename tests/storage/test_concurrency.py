"""Readers and writers at once: everyone sees whole versions, and no good one is lost."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from storage.versions import Slot, VersionedStore

IntactNumber = Callable[[VersionedStore, Slot, str], int]

SLOT = Slot("system", "asset", "key")
OTHER = Slot("system", "asset", "other")


def _place(root: Path, slot: Slot, first: int, count: int, **more: Any) -> dict[str, Any]:
    return {
        "root": str(root),
        "slot": [slot.system, slot.asset, slot.partition],
        "first": first,
        "count": count,
        "checks": [],
        "store": {"keep": 100},
        **more,
    }


@pytest.mark.parametrize("checks", [[], ["sharp"]], ids=["unchecked", "checked"])
def test_a_reader_sees_whole_versions_while_a_writer_publishes(
    writers: Any,
    tmp_path: Path,
    number_of: Callable[[xr.Dataset], int],
    checks: list[str],
) -> None:
    store = VersionedStore(tmp_path)
    writers.start("write_many", **_place(tmp_path, SLOT, 1, 1)).finish()
    place = _place(tmp_path, SLOT, 2, 16, checks=checks, store={"keep": 2})
    writer = writers.start("write_many", **place)
    # Every value is compared with the number that the same version tells: a mixture would differ.
    read = [number_of(store.open(SLOT))]
    while not writer.ended:
        read.append(number_of(store.open(SLOT)))
    writer.finish()
    read.append(number_of(store.open(SLOT)))
    assert read == sorted(read), "what is current went back"
    assert read[-1] == 17
    assert len(set(read)) >= 3, "the reader hardly saw the writer at work"


def test_writers_of_different_partitions_do_not_meet(
    writers: Any, tmp_path: Path, intact_number: IntactNumber
) -> None:
    store = VersionedStore(tmp_path)
    jobs = [
        writers.start("write_many", **_place(tmp_path, slot, first, 6))
        for slot, first in ((SLOT, 1), (OTHER, 101))
    ]
    reports = [job.finish() for job in jobs]
    spans = [(report[0]["time"], report[-1]["time"]) for report in reports]
    assert max(start for start, _ in spans) < min(end for _, end in spans), "one after the other"
    for slot, first in ((SLOT, 1), (OTHER, 101)):
        pointer = store.pointer(slot)
        assert pointer.version is not None
        numbers = [intact_number(store, slot, name) for name in (pointer.version, *pointer.earlier)]
        assert numbers == list(range(first + 5, first - 1, -1))
        assert pointer.candidates == ()


@pytest.mark.parametrize("checks", [[], ["sharp", "bright"]], ids=["unchecked", "checked"])
def test_writers_of_one_partition_lose_nothing(
    writers: Any, tmp_path: Path, intact_number: IntactNumber, checks: list[str]
) -> None:
    store = VersionedStore(tmp_path)
    jobs = [
        writers.start("write_many", **_place(tmp_path, SLOT, first, 5, checks=checks))
        for first in (1, 101, 201)
    ]
    reports = [job.finish() for job in jobs]
    done = {
        event["version"]: event["done"] for report in reports for event in report if "done" in event
    }
    assert sorted(done.values()) == [*range(1, 6), *range(101, 106), *range(201, 206)]
    pointer = store.pointer(SLOT)
    assert pointer.version == max(done), "expected the version that was begun last"
    good = (max(done), *pointer.earlier)
    assert {name: intact_number(store, SLOT, name) for name in good} == done
    assert list(good) == sorted(good, reverse=True)
    assert pointer.candidates == ()
    assert store.versions(SLOT) == sorted(done)


def test_writers_of_the_same_data_agree_on_one_version(writers: Any, tmp_path: Path) -> None:
    store = VersionedStore(tmp_path)
    jobs = [writers.start("write_many", **_place(tmp_path, SLOT, 7, 1)) for _ in range(4)]
    written = {job.finish()[-1]["version"] for job in jobs}
    assert written == {store.current(SLOT)} == set(store.versions(SLOT))


def test_verdicts_of_many_threads_are_all_kept(tmp_path: Path) -> None:
    """Checks of one run end at the same time; the last one of them promotes."""
    store = VersionedStore(tmp_path)
    checks = [f"check {number}" for number in range(12)]
    record = {"settings": {}, "recipe": "r", "checks": checks}
    version = store.write(SLOT, xr.Dataset({"value": ((), 1.0)}), record).version
    together = threading.Barrier(len(checks))

    def judge(check: str) -> None:
        together.wait()
        store.pass_version(SLOT, version, check, 1.0)

    threads = [threading.Thread(target=judge, args=(check,)) for check in checks]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(store.verdicts(SLOT, version)) == set(checks)
    assert store.current(SLOT) == version


def test_a_version_that_was_begun_earlier_and_ends_later_is_an_earlier_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from storage import zarr_files

    store = VersionedStore(tmp_path)
    record: dict[str, Any] = {"settings": {}, "recipe": "r", "checks": []}
    hold, held = threading.Event(), threading.Event()
    content_hash = zarr_files.content_hash

    def slow_hash(folder: Path) -> str:
        if threading.current_thread() is slow:
            held.set()
            assert hold.wait(30)
        return content_hash(folder)

    monkeypatch.setattr(zarr_files, "content_hash", slow_hash)
    slow = threading.Thread(
        target=store.write, args=(SLOT, xr.Dataset({"value": ((), 1.0)}), record)
    )
    slow.start()
    assert held.wait(30)
    newer = store.write(SLOT, xr.Dataset({"value": ((), 2.0)}), record).version
    hold.set()
    slow.join()
    older, newest = store.versions(SLOT)
    assert (store.current(SLOT), newest) == (newer, newer)
    assert store.pointer(SLOT).earlier == (older,)
    assert float(store.open(SLOT)["value"]) == 2


def test_the_lock_of_one_slot_does_not_hold_up_another(tmp_path: Path) -> None:
    store = VersionedStore(tmp_path)
    record: dict[str, Any] = {"settings": {}, "recipe": "r", "checks": []}
    data = xr.Dataset({"value": ((), 1.0)})
    ended = threading.Event()
    with store.files(SLOT).locked():

        def write_other() -> None:
            store.write(OTHER, data, record)
            ended.set()

        thread = threading.Thread(target=write_other)
        thread.start()
        assert ended.wait(30)
    thread.join()
    assert store.pointer(SLOT).version is None
