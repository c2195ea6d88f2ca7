"""Versions: what is current has passed its checks, and nothing published ever changes."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from storage.errors import MissingChunkError, NoVersionError
from storage.slot_files import Pointer
from storage.verification import verify_slot
from storage.versions import Slot, VersionedStore

MakeRecord = Callable[..., dict[str, Any]]
Fingerprint = Callable[[Path], dict[str, str]]
DAY = 24 * 3600.0


def _holding(value: float) -> xr.Dataset:
    return xr.Dataset({"value": ((), float(value))})


def _value(store: VersionedStore, slot: Slot, version: str | None = None) -> float:
    return float(store.open(slot, version)["value"])


def _write(store: VersionedStore, slot: Slot, value: float, *checks: str, **record: Any) -> str:
    """Write a small version; its name."""
    filled = {"settings": {}, "recipe": f"recipe of {value}", "checks": list(checks), **record}
    return store.write(slot, _holding(value), filled).version


def _folder(store: VersionedStore, slot: Slot) -> Path:
    return store.root / slot.system / slot.asset / slot.partition


def _make_older(path: Path, seconds: float) -> None:
    """Move the times of a folder and all in it back."""
    for each in (path, *path.rglob("*")):
        then = each.stat().st_mtime - seconds
        os.utime(each, (then, then))


# ---- writing and reading ---------------------------------------------------------------------


def test_what_is_written_is_current(store: VersionedStore, slot: Slot) -> None:
    with pytest.raises(NoVersionError, match="photo_fur/fur_photo/fox: no version has passed"):
        store.current(slot)
    assert store.pointer(slot) == Pointer()
    written = store.write(slot, _holding(3), {"settings": {}, "recipe": "r", "checks": []})
    assert written.is_new
    assert store.current(slot) == written.version
    assert store.versions(slot) == [written.version]
    assert _value(store, slot) == 3
    assert store.pointer(slot) == Pointer(written.version, "r", (), ())


def test_the_layout_is_as_documented(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1, "sharp")
    store.pass_version(slot, version, "sharp", 0.5)
    folder = store.root / "photo_fur" / "fur_photo" / "fox"
    assert {path.name for path in folder.iterdir()} == {
        "current.json",
        "versions",
        "verdicts",
        "staging",
        "lock",
    }
    assert json.loads((folder / "current.json").read_text())["version"] == version
    assert store.folder(slot) == folder / "versions" / version
    assert (folder / "verdicts" / f"{version}.json").is_file()
    assert list((folder / "staging").iterdir()) == []


def test_a_new_store_object_finds_what_another_wrote(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1)
    other = VersionedStore(str(store.root))
    assert other.current(slot) == version
    assert _value(other, slot) == 1


def test_the_record_tells_where_a_version_comes_from(store: VersionedStore, slot: Slot) -> None:
    given = {"settings": {"size": 4}, "recipe": "r", "checks": ["sharp"], "run": "17", "inputs": {}}
    written = store.write(slot, _holding(1), given)
    record = store.record(slot, written.version)
    assert given.items() <= record.items()
    assert record["version"] == written.version
    assert record["partition"] == "fox"
    assert record["content"] == written.content
    assert record["array_bytes"] == 8
    assert abs(time.time() - np.datetime64(record["created"][:19]).astype(float)) < 60


def test_slots_are_listed(store: VersionedStore, slot: Slot) -> None:
    others = [Slot("photo_fur", "attenuation", "fox"), Slot("street_billboards", "billboards")]
    for each in (slot, *others):
        _write(store, each, 1)
    assert list(store.slots()) == [others[0], slot, others[1]]


def test_partitions_do_not_mix(store: VersionedStore, slot: Slot) -> None:
    other = Slot(slot.system, slot.asset, "bunny")
    _write(store, slot, 1)
    _write(store, other, 2)
    assert (_value(store, slot), _value(store, other)) == (1, 2)


def test_an_unknown_version_is_told(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1)
    with pytest.raises(NoVersionError, match="no-such: no such version; expected one of") as caught:
        store.open(slot, "no-such")
    assert version in str(caught.value)


@pytest.mark.parametrize("text", ['{"version": ', "[]", '{"version": "x"}', None])
def test_a_broken_pointer_is_made_again_of_versions_and_verdicts(
    store: VersionedStore, slot: Slot, text: str | None
) -> None:
    good = [_write(store, slot, value, "sharp") for value in range(3)]
    for version in good:
        store.pass_version(slot, version, "sharp", 1.0)
    store.reject(slot, _write(store, slot, 3, "sharp"), "sharp", "blurred")
    waiting = _write(store, slot, 4, "sharp")
    before = store.pointer(slot)
    assert before == Pointer(good[2], "recipe of 2", (good[1], good[0]), (waiting,))
    path = _folder(store, slot) / "current.json"
    if text is None:
        path.unlink()
    else:
        path.write_text(text)
    assert store.pointer(slot) == before
    assert [found.slot for found in verify_slot(store, slot)] == [slot]
    assert store.files(slot).stored_pointer() == before
    assert list(verify_slot(store, slot)) == []


def test_a_reader_keeps_the_version_it_opened(tmp_path: Path, slot: Slot) -> None:
    store = VersionedStore(tmp_path, keep=1)
    _write(store, slot, 1)
    opened = store.open(slot)
    for value in (2, 3):
        _write(store, slot, value)
    assert float(opened["value"]) == 1
    assert _value(store, slot) == 3


def test_a_write_that_fails_leaves_nothing(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1)
    before = store.pointer(slot)

    def fail(_: object) -> np.ndarray:
        raise ValueError("the photograph is broken")

    lazy = xr.Dataset({"value": ("x", np.zeros(4))}).chunk()
    lazy["value"] = ("x", lazy["value"].data.map_blocks(fail, dtype=float))
    with pytest.raises(ValueError, match="the photograph is broken"):
        store.write(slot, lazy, {"settings": {}, "recipe": "r", "checks": []})
    assert store.pointer(slot) == before
    assert store.versions(slot) == [version]
    assert list((_folder(store, slot) / "staging").iterdir()) == []


def test_an_incomplete_version_is_not_published(
    store: VersionedStore, slot: Slot, monkeypatch: pytest.MonkeyPatch
) -> None:
    from storage import zarr_files

    version = _write(store, slot, 1)
    write_dataset = zarr_files.write_dataset

    def lose_a_chunk(dataset: xr.Dataset, folder: Path, record: dict[str, Any]) -> None:
        write_dataset(dataset, folder, record)
        (folder / "value/c").unlink()

    monkeypatch.setattr(zarr_files, "write_dataset", lose_a_chunk)
    with pytest.raises(MissingChunkError):
        _write(store, slot, 2)
    assert store.versions(slot) == [version]
    assert _value(store, slot) == 1
    assert list((_folder(store, slot) / "staging").iterdir()) == []


def test_all_is_on_disk_before_the_pointer_names_it(
    store: VersionedStore, slot: Slot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The order that a power cut demands: files, folder, pointer's file, then its new name."""
    events: list[str] = []
    fsync, rename, replace = os.fsync, os.rename, os.replace
    folder = _folder(store, slot)

    def note_sync(descriptor: int) -> None:
        path = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
        events.append(f"fsync {path.relative_to(folder)}")
        fsync(descriptor)

    def note_rename(source: Path, target: Path) -> None:
        events.append(f"rename {Path(target).relative_to(folder).parts[0]}")
        rename(source, target)

    def note_replace(source: Path, target: Path) -> None:
        # Zarr replaces its own files in staging, too.
        if "staging" not in Path(target).relative_to(folder).parts:
            events.append(f"replace {Path(target).relative_to(folder)}")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", note_sync)
    monkeypatch.setattr(os, "rename", note_rename)
    monkeypatch.setattr(os, "replace", note_replace)
    version = _write(store, slot, 1)
    staged = events[: events.index("rename versions")]
    files = list(store.folder(slot).rglob("*"))
    expected = {f"fsync staging/{version}/{path.relative_to(store.folder(slot))}" for path in files}
    assert set(staged) == {*expected, f"fsync staging/{version}"}
    beside = [event for event in events if event.startswith("fsync staging/current.json.")]
    assert events[len(staged) :] == [
        "rename versions",
        "fsync versions",
        *beside,
        "replace current.json",
        "fsync .",
    ]
    assert len(beside) == 1


# ---- equal content ---------------------------------------------------------------------------


def test_equal_content_and_settings_add_no_version(
    store: VersionedStore, slot: Slot, make_record: MakeRecord
) -> None:
    first = store.write(slot, _holding(1), make_record(recipe="old", size=4))
    again = store.write(slot, _holding(1), make_record(recipe="new", size=4))
    assert (again.version, again.content, again.is_new) == (first.version, first.content, False)
    assert store.versions(slot) == [first.version]
    # So that the launcher knows that this recipe has run.
    assert store.pointer(slot).recipe == "new"
    assert list((_folder(store, slot) / "staging").iterdir()) == []


def test_other_settings_add_a_version_of_equal_content(
    store: VersionedStore, slot: Slot, make_record: MakeRecord
) -> None:
    first = store.write(slot, _holding(1), make_record(size=4))
    other = store.write(slot, _holding(1), make_record(size=5))
    assert other.is_new
    assert other.version != first.version
    assert other.content == first.content
    assert store.current(slot) == other.version


def test_equal_content_made_from_other_assets_adds_a_version(
    store: VersionedStore, slot: Slot, make_record: MakeRecord
) -> None:
    """What newer code's checks ask the version for has to be there."""
    mesh = {"asset": "mesh", "partition": "p", "version": "1", "content": "c"}
    first = store.write(slot, _holding(1), make_record())
    more = store.write(slot, _holding(1), make_record() | {"inputs": [mesh]})
    assert more.is_new
    assert more.content == first.content
    newer = mesh | {"version": "2"}
    assert not store.write(slot, _holding(1), make_record() | {"inputs": [newer]}).is_new


def test_other_data_add_a_version_of_other_content(
    store: VersionedStore, slot: Slot, make_record: MakeRecord
) -> None:
    first = store.write(slot, _holding(1), make_record())
    other = store.write(slot, _holding(1 + 2**-52), make_record())
    assert other.is_new
    assert other.content != first.content


def test_settings_are_compared_as_they_are_stored(
    store: VersionedStore, slot: Slot, make_record: MakeRecord
) -> None:
    # JSON has lists only.
    store.write(slot, _holding(1), make_record(sizes=(1, 2)))
    assert not store.write(slot, _holding(1), make_record(sizes=(1, 2))).is_new
    assert not store.write(slot, _holding(1), make_record(sizes=[1, 2])).is_new
    assert store.write(slot, _holding(1), make_record(sizes=[2, 1])).is_new


def test_content_equal_to_an_earlier_version_s_is_new(store: VersionedStore, slot: Slot) -> None:
    versions = [_write(store, slot, value) for value in (1, 2, 1)]
    assert store.versions(slot) == versions
    assert store.current(slot) == versions[2]


def test_content_of_a_rejected_version_must_be_checked_again(
    store: VersionedStore, slot: Slot
) -> None:
    good = _write(store, slot, 1)
    store.reject(slot, _write(store, slot, 2, "sharp"), "sharp", "blurred")
    again = _write(store, slot, 2, "sharp")
    assert store.pointer(slot).candidates == (again,)
    assert store.current(slot) == good


@pytest.mark.parametrize("damaged", ["value/c", "zarr.json", "."], ids=["chunk", "record", "all"])
def test_equal_content_replaces_a_damaged_version(
    store: VersionedStore, slot: Slot, damaged: str
) -> None:
    """Who loses a file materialises again: that must help."""
    lost = _write(store, slot, 1)
    path = store.folder(slot) / damaged
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()
    assert _write(store, slot, 1) != lost
    assert _value(store, slot) == 1


# ---- candidates and verdicts -----------------------------------------------------------------


def test_a_candidate_is_not_current(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1, "sharp")
    assert store.pointer(slot) == Pointer(candidates=(version,))
    with pytest.raises(NoVersionError, match=r"no version has passed its checks \(1 not checked\)"):
        store.open(slot)
    assert _value(store, slot, version) == 1


@pytest.mark.parametrize("order", list(itertools.permutations(["sharp", "bright", "round"])))
def test_all_checks_must_pass(store: VersionedStore, slot: Slot, order: tuple[str, ...]) -> None:
    good = _write(store, slot, 0)
    version = _write(store, slot, 1, "sharp", "bright", "round")
    for check in order:
        assert store.current(slot) == good
        store.pass_version(slot, version, check, 1.0)
    assert store.pointer(slot) == Pointer(version, "recipe of 1", (good,), ())


def test_other_checks_do_not_count(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1, "sharp")
    store.pass_version(slot, version, "bright", 1.0)
    assert store.pointer(slot).version is None
    store.pass_version(slot, version, "sharp", 1.0)
    store.pass_version(slot, version, "bright", 1.0)
    assert store.pointer(slot).version == version


@pytest.mark.parametrize("order", list(itertools.permutations(["pass", "pass too", "reject"])))
def test_one_failed_check_is_enough(
    store: VersionedStore, slot: Slot, order: tuple[str, ...]
) -> None:
    good = _write(store, slot, 0)
    version = _write(store, slot, 1, "pass", "pass too", "reject")
    for check in order:
        if check == "reject":
            assert store.reject(slot, version, check, "blurred") == good
        else:
            store.pass_version(slot, version, check, 1.0)
    assert store.pointer(slot) == Pointer(good, "recipe of 0", (), ())
    assert _value(store, slot, version) == 1, "a rejected version stays for inspection"


def test_a_check_that_fails_and_then_passes_does_not_bring_a_version_back(
    store: VersionedStore, slot: Slot
) -> None:
    good = _write(store, slot, 0)
    version = _write(store, slot, 1, "sharp")
    store.reject(slot, version, "sharp", "blurred")
    store.pass_version(slot, version, "sharp", 1.0)
    assert store.current(slot) == good


def test_verdicts_are_kept_with_their_figures(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1, "sharp", "bright")
    assert store.verdicts(slot, version) == {}
    store.pass_version(slot, version, "sharp", 0.25)
    store.reject(slot, version, "bright", "12 % too dark")
    verdicts = store.verdicts(slot, version)
    assert verdicts["sharp"] == {"passed": True, "figure": 0.25}
    assert verdicts["bright"]["passed"] is False
    assert verdicts["bright"]["reason"] == "12 % too dark"


def test_rejecting_the_current_version_restores_the_last_good_one(
    store: VersionedStore, slot: Slot
) -> None:
    versions = [_write(store, slot, value) for value in range(4)]
    for rejected, left in ((3, 2), (1, 2), (2, 0)):
        # Rejecting the version before the current one leaves the current one.
        assert store.reject(slot, versions[rejected], "sharp", "") == versions[left]
        assert store.current(slot) == versions[left]
        assert store.pointer(slot).recipe == f"recipe of {left}"
    assert store.reject(slot, versions[0], "sharp", "") is None
    assert store.pointer(slot) == Pointer()
    assert store.versions(slot) == versions


def test_every_order_of_verdicts_on_three_candidates(tmp_path: Path, slot: Slot) -> None:
    """What is current is the newest that has passed, in whatever order verdicts come."""
    written = VersionedStore(tmp_path / "written")
    versions = [_write(written, slot, value, "sharp") for value in range(3)]
    combinations = itertools.product(
        itertools.product([True, False], repeat=3), itertools.permutations(range(3))
    )
    for number, (passed, order) in enumerate(combinations):
        store = VersionedStore(tmp_path / str(number))
        shutil.copytree(written.root, store.root)
        for done, index in enumerate(order, start=1):
            if passed[index]:
                store.pass_version(slot, versions[index], "sharp", 1.0)
            else:
                store.reject(slot, versions[index], "sharp", "blurred")
            good = sorted((versions[i] for i in order[:done] if passed[i]), reverse=True)
            waiting = tuple(versions[i] for i in range(3) if i not in order[:done])
            pointer = store.pointer(slot)
            assert pointer.version == (good[0] if good else None), (passed, order, done)
            assert pointer.earlier == tuple(good[1:])
            assert pointer.candidates == waiting


def test_an_older_version_that_passes_late_takes_no_newer_one_s_place(
    tmp_path: Path, slot: Slot
) -> None:
    store = VersionedStore(tmp_path, keep=2)
    late = _write(store, slot, 0, "sharp")
    before, current = (_write(store, slot, value) for value in (1, 2))
    store.pass_version(slot, late, "sharp", 1.0)
    assert store.pointer(slot) == Pointer(current, "recipe of 2", (before,), ())


def test_a_check_is_about_the_version_of_its_run(store: VersionedStore, slot: Slot) -> None:
    good = _write(store, slot, 0, run="first")
    second, third = (
        _write(store, slot, i, "sharp", run=run) for i, run in ((1, "2nd"), (2, "3rd"))
    )
    assert store.version_under_check(slot, "2nd") == second
    assert store.version_under_check(slot, "3rd") == third
    assert store.version_under_check(slot, "first") == good
    # A check that is run by itself is about what is current.
    assert store.version_under_check(slot, "another") == good
    store.reject(slot, good, "sharp", "blurred")
    # Nothing is current: the newest of those that wait.
    assert store.version_under_check(slot, "another") == third


def test_rollback_goes_back_one_version_at_a_time(store: VersionedStore, slot: Slot) -> None:
    versions = [_write(store, slot, value) for value in range(3)]
    assert store.rollback(slot) == versions[1]
    assert store.pointer(slot) == Pointer(versions[1], "recipe of 1", (versions[0],), ())
    assert store.rollback(slot) == versions[0]
    before = store.pointer(slot)
    with pytest.raises(NoVersionError, match="no earlier good version; expected one to go back to"):
        store.rollback(slot)
    assert store.pointer(slot) == before
    assert _value(store, slot) == 0
    # What is written next is current again, and the rolled back ones are not good ones to go to.
    newest = _write(store, slot, 3)
    assert store.pointer(slot) == Pointer(newest, "recipe of 3", (versions[0],), ())


def test_rollback_keeps_candidates(store: VersionedStore, slot: Slot) -> None:
    first, _, waiting = (
        _write(store, slot, value, *checks) for value, checks in ((0, ()), (1, ()), (2, ("sharp",)))
    )
    assert store.rollback(slot) == first
    store.pass_version(slot, waiting, "sharp", 1.0)
    assert store.pointer(slot) == Pointer(waiting, "recipe of 2", (first,), ())


def test_published_versions_never_change(
    store: VersionedStore, slot: Slot, fingerprint: Fingerprint
) -> None:
    version = _write(store, slot, 1, "sharp")
    folder = store.folder(slot, version)
    before = fingerprint(folder), [path.stat().st_mtime_ns for path in sorted(folder.rglob("*"))]
    store.pass_version(slot, version, "sharp", 1.0)
    _write(store, slot, 1)
    _write(store, slot, 2)
    store.rollback(slot)
    store.reject(slot, version, "sharp", "blurred")
    store.collect(slot)
    store.open(slot, version).load()
    after = fingerprint(folder), [path.stat().st_mtime_ns for path in sorted(folder.rglob("*"))]
    assert after == before


# ---- collection ------------------------------------------------------------------------------


def test_the_last_versions_stay(tmp_path: Path, slot: Slot) -> None:
    store = VersionedStore(tmp_path, keep=3)
    versions = [_write(store, slot, value) for value in range(6)]
    assert store.versions(slot) == versions, "nothing younger than a day goes"
    for version in versions:
        _make_older(store.folder(slot, version), DAY - 60)
    assert store.collect(slot) == []
    for version in versions:
        _make_older(store.folder(slot, version), 120)
    assert sorted(store.collect(slot)) == versions[:3]
    assert store.versions(slot) == versions[3:]
    assert store.pointer(slot) == Pointer(
        versions[5], "recipe of 5", (versions[4], versions[3]), ()
    )
    assert list((_folder(store, slot) / "staging").iterdir()) == []


def test_only_old_versions_go(tmp_path: Path, slot: Slot) -> None:
    store = VersionedStore(tmp_path, keep=1)
    versions = [_write(store, slot, value) for value in range(4)]
    _make_older(store.folder(slot, versions[1]), DAY + 1)
    assert store.collect(slot) == [versions[1]]
    assert store.versions(slot) == [versions[0], *versions[2:]]


def test_writing_collects(tmp_path: Path, slot: Slot) -> None:
    store = VersionedStore(tmp_path, keep=2)
    old = [_write(store, slot, value) for value in range(3)]
    for version in old:
        _make_older(store.folder(slot, version), DAY + 1)
    new = _write(store, slot, 3)
    assert store.versions(slot) == [old[2], new]


def test_good_versions_outlive_newer_bad_ones(tmp_path: Path, slot: Slot) -> None:
    store = VersionedStore(tmp_path, keep=2)
    good = [_write(store, slot, value) for value in range(2)]
    bad = [_write(store, slot, value, "sharp") for value in range(2, 6)]
    for version in bad:
        store.reject(slot, version, "sharp", "blurred")
    for version in (*good, *bad):
        _make_older(store.folder(slot, version), 2 * DAY)
    assert sorted(store.collect(slot)) == bad[:2]
    assert store.versions(slot) == [*good, *bad[2:]]
    assert store.rollback(slot) == good[0]
    assert _value(store, slot) == 0


def test_a_collected_candidate_is_forgotten(tmp_path: Path, slot: Slot) -> None:
    store = VersionedStore(tmp_path, keep=1)
    waiting = _write(store, slot, 0, "sharp")
    good = _write(store, slot, 1)
    _make_older(store.folder(slot, waiting), 2 * DAY)
    assert store.collect(slot) == [waiting]
    assert store.pointer(slot) == Pointer(good, "recipe of 1", (), ())
    assert store.version_under_check(slot, "any") == good


def test_abandoned_staging_goes_when_it_is_old(store: VersionedStore, slot: Slot) -> None:
    version = _write(store, slot, 1)
    staging = _folder(store, slot) / "staging"
    old, young = staging / "old", staging / "young"
    for piece in (old, young):
        (piece / "value").mkdir(parents=True)
        (piece / "value" / "zarr.json").write_text("{")
    _make_older(old, DAY + 1)
    assert store.collect(slot) == ["old"]
    assert list(staging.iterdir()) == [young]
    assert store.versions(slot) == [version]


def test_collecting_where_nothing_is(store: VersionedStore, slot: Slot) -> None:
    assert store.collect(slot) == []
    assert store.pointer(slot) == Pointer()


# ---- all together ----------------------------------------------------------------------------

CHECKS = ("sharp", "bright")
KEEP = 3
SLOT = Slot("system", "asset", "key")


class _Known(NamedTuple):
    """What the model knows of a version that was written."""

    value: int
    size: int
    checks: tuple[str, ...]
    recipe: str
    files: dict[str, str]


def _hashes(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


class StoreMachine(RuleBasedStateMachine):
    """Any sequence of operations against a model of sets: what is current is the best of `good`."""

    @initialize()
    def begin(self) -> None:
        """An empty store, an empty model."""
        self.store = VersionedStore(tempfile.mkdtemp(), keep=KEEP)
        self.known: dict[str, _Known] = {}
        self.there: set[str] = set()
        self.old: set[str] = set()
        self.good: set[str] = set()
        self.waiting: set[str] = set()
        self.verdicts: dict[tuple[str, str], bool] = {}
        self.writes = 0
        self.last_current: str | None = None
        self.recipe: str | None = None

    def teardown(self) -> None:
        """Whatever happened, no published byte has changed. Leave nothing on disk."""
        if hasattr(self, "store"):
            for version in self.there:
                assert _hashes(self.store.folder(SLOT, version)) == self.known[version].files
            shutil.rmtree(self.store.root)

    @property
    def current(self) -> str | None:
        """The newest good version."""
        return max(self.good, default=None)

    def promote_if_passed(self, version: str) -> None:
        """A version that waits and has passed all its checks is good; KEEP good ones count."""
        if version in self.waiting and all(
            self.verdicts.get((version, check)) for check in self.known[version].checks
        ):
            self.waiting.remove(version)
            self.good = set(sorted({*self.good, version})[-KEEP:])

    def forget_old(self) -> set[str]:
        """What collection takes away: old, not good, not among the newest."""
        gone = (self.there & self.old) - self.good - set(sorted(self.there)[-KEEP:])
        self.there -= gone
        self.waiting -= gone
        return gone

    @rule(value=st.integers(0, 4), size=st.integers(0, 1), count=st.integers(0, 2))
    def write(self, value: int, size: int, count: int) -> None:
        """Write, with none, one or two checks to wait for."""
        checks = CHECKS[:count]
        self.writes += 1
        recipe = f"recipe {self.writes}"
        record = {"settings": {"size": size}, "recipe": recipe, "checks": checks}
        written = self.store.write(SLOT, _holding(value), record)
        now = self.current and self.known[self.current]
        assert written.is_new == (not now or (now.value, now.size) != (value, size))
        if not written.is_new:
            assert written.version == self.current
            self.recipe = recipe
        else:
            version = written.version
            assert version > max(self.known, default=""), "versions sort by the time of writing"
            files = _hashes(self.store.folder(SLOT, version))
            self.known[version] = _Known(value, size, checks, recipe, files)
            self.there.add(version)
            self.waiting.add(version)
            self.promote_if_passed(version)
        self.forget_old()

    def judge(self, version: str, check: str, passed: bool) -> None:
        """One check's verdict, in store and model."""
        self.verdicts[version, check] = passed
        if passed:
            self.store.pass_version(SLOT, version, check, 0.5)
            self.promote_if_passed(version)
        else:
            self.good.discard(version)
            self.waiting.discard(version)
            assert self.store.reject(SLOT, version, check, "bad") == self.current

    @precondition(lambda self: self.there)
    @rule(data=st.data(), check=st.sampled_from(CHECKS), passed=st.booleans())
    def judge_any(self, data: st.DataObject, check: str, passed: bool) -> None:
        """Any check says anything of any version, awaited or not."""
        self.judge(data.draw(st.sampled_from(sorted(self.there))), check, passed)

    @precondition(lambda self: self.waiting)
    @rule(newest=st.booleans())
    def pass_all(self, newest: bool) -> None:
        """A version that waits passes all its checks."""
        version = max(self.waiting) if newest else min(self.waiting)
        for check in self.known[version].checks:
            self.judge(version, check, True)

    @precondition(lambda self: self.good)
    @rule(current=st.booleans())
    def reject_good(self, current: bool) -> None:
        """A check fails after all: of the current version, or of the oldest good one."""
        self.judge(max(self.good) if current else min(self.good), "sharp", False)

    @precondition(lambda self: self.there)
    @rule()
    def roll_back(self) -> None:
        """Back to the good version before, where there is one."""
        if len(self.good) < 2:
            with pytest.raises(NoVersionError):
                self.store.rollback(SLOT)
        else:
            self.good.remove(max(self.good))
            assert self.store.rollback(SLOT) == self.current

    @precondition(lambda self: self.there - self.old)
    @rule(data=st.data())
    def grow_old(self, data: st.DataObject) -> None:
        """A day goes by for some of the versions."""
        ageing = set(sorted(self.there - self.old)[: data.draw(st.integers(1, 4))])
        for version in ageing:
            _make_older(self.store.folder(SLOT, version), DAY + 1)
        self.old |= ageing

    @precondition(lambda self: self.old)
    @rule()
    def collect(self) -> None:
        """Collect what nobody needs."""
        assert set(self.store.collect(SLOT)) == self.forget_old()

    @invariant()
    def the_store_is_as_the_model_says(self) -> None:
        """Pointer, folders, verdicts, the current value and recipe."""
        if not hasattr(self, "store"):
            return
        pointer = self.store.pointer(SLOT)
        assert pointer.version == self.current
        assert set(pointer.earlier) == self.good - {self.current}
        assert list(pointer.earlier) == sorted(pointer.earlier, reverse=True)
        assert list(pointer.candidates) == sorted(self.waiting)
        assert self.store.versions(SLOT) == sorted(self.there)
        for version in self.there:
            expected = {c: p for (v, c), p in self.verdicts.items() if v == version}
            verdicts = self.store.verdicts(SLOT, version)
            assert {check: verdict["passed"] for check, verdict in verdicts.items()} == expected
        if self.current != self.last_current:
            self.last_current = self.current
            self.recipe = self.known[self.current].recipe if self.current else None
        assert pointer.recipe == self.recipe
        if self.current:
            known = self.known[self.current]
            assert _value(self.store, SLOT) == known.value
            assert all(self.verdicts.get((self.current, check)) for check in known.checks)


StoreMachine.TestCase.settings = settings(
    max_examples=15,
    stateful_step_count=30,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
TestStoreMachine = StoreMachine.TestCase
