"""kill -9 at any moment: what is current is the version before or the new one, and intact."""

from __future__ import annotations

import fcntl
import random
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from storage import zarr_files
from storage.errors import NoVersionError
from storage.versions import Slot, VersionedStore

IntactNumber = Callable[[VersionedStore, Slot, str], int]

SLOT = Slot("system", "asset", "key")
KILLS = 60


def _place(root: Path, **more: Any) -> dict[str, Any]:
    """The arguments that all jobs have."""
    slot = [SLOT.system, SLOT.asset, SLOT.partition]
    return {"root": str(root), "slot": slot, "checks": [], "store": {}, **more}


def _folder(root: Path) -> Path:
    return root / SLOT.system / SLOT.asset / SLOT.partition


def _assert_sound(store: VersionedStore, intact_number: IntactNumber) -> None:
    """Everything that the pointer names is there and whole, and nobody holds the lock."""
    pointer = store.pointer(SLOT)
    named = [*pointer.earlier, *pointer.candidates]
    for version in named if pointer.version is None else (pointer.version, *named):
        zarr_files.verify_complete(store.folder(SLOT, version))
        intact_number(store, SLOT, version)
    for version in store.versions(SLOT):
        # Also what no pointer names: a folder in versions/ is a whole version.
        zarr_files.verify_complete(store.folder(SLOT, version))
    with (_folder(store.root) / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _write_next(writers: Any, store: VersionedStore, number: int, **place: Any) -> None:
    """Another process writes without a hitch, and what it wrote is current."""
    *_, done = writers.start(
        "write_many", **_place(store.root, first=number, count=1, **place)
    ).finish()
    assert done["done"] == number
    assert store.current(SLOT) == done["version"]


# ---- at random -------------------------------------------------------------------------------


@pytest.mark.parametrize("checks", [[], ["sharp", "bright"]], ids=["unchecked", "checked"])
def test_killed_at_random_moments(
    writers: Any, tmp_path: Path, intact_number: IntactNumber, checks: list[str]
) -> None:
    """A writer that writes one version after the other, killed 30 times, one seed a case."""
    # Collecting at once what is not among the two newest: kills meet the collection, too.
    place = _place(tmp_path, checks=checks, store={"keep": 2, "least_age_seconds": 0.0})
    store = VersionedStore(tmp_path, keep=2, least_age_seconds=0.0)
    moments = random.Random(len(checks))

    first = writers.start("write_many", **place, first=1, count=3)
    started = time.monotonic()
    begun, *_, ended = first.finish()
    earliest, latest = (event["time"] - started for event in (begun, ended))

    number, left_behind = 3, Counter[str]()
    for _ in range(KILLS // 2):
        before = intact_number(store, SLOT, store.current(SLOT))
        assert before in (number, number - 1)
        writer = writers.start("write_many", **place, first=number + 1, count=1000)
        time.sleep(moments.uniform(earliest, latest))
        assert not writer.ended, writer.reported()[-1:]
        writer.kill()

        events = writer.reported()
        begins = [event["begin"] for event in events if "begin" in event]
        done = [event["done"] for event in events if "done" in event]
        assert not [event for event in events if "error" in event]
        found = intact_number(store, SLOT, store.current(SLOT))
        assert found in ((done or [before])[-1], (begins or [before])[-1])
        _assert_sound(store, intact_number)
        staged = [path.name for path in (_folder(tmp_path) / "staging").iterdir()]
        left_behind["staging"] += bool(staged)
        left_behind["collected"] += any(name.startswith("collected-") for name in staged)
        left_behind["candidate"] += bool(store.pointer(SLOT).candidates)
        left_behind["writes"] += len(done)
        number = (begins or [number])[-1]

    _write_next(writers, store, number + 1, checks=checks)
    store.collect(SLOT)
    assert list((_folder(tmp_path) / "staging").iterdir()) == []
    # Otherwise the kills missed what they are for.
    assert left_behind["staging"] >= KILLS // 8, left_behind


# ---- at chosen places ------------------------------------------------------------------------

# module:name, what an argument holds, which call, when, which version is current then.
WRITING = [
    ("storage.zarr_files:write_dataset", "staging", 1, "enter", "previous"),
    ("pathlib:Path.mkdir", "staging", 1, "leave", "previous"),
    ("zarr.storage:LocalStore.set", "eager/zarr.json", 1, "enter", "previous"),
    ("zarr.storage:LocalStore.set", "eager/c/", 1, "enter", "previous"),
    ("zarr.storage:LocalStore.set", "lazy/c/", 1, "enter", "previous"),
    ("zarr.storage:LocalStore.set", "lazy/c/", 9, "enter", "previous"),
    ("storage.zarr_files:verify_complete", "staging", 1, "enter", "previous"),
    ("storage.zarr_files:content_hash", "staging", 1, "enter", "previous"),
    ("storage.zarr_files:content_hash", "staging", 1, "leave", "previous"),
    ("storage.zarr_files:add_to_record", "staging", 1, "leave", "previous"),
    ("storage.zarr_files:sync", "staging", 1, "enter", "previous"),
    ("storage.zarr_files:_fsync", "staging", 20, "enter", "previous"),
    ("storage.zarr_files:sync", "staging", 1, "leave", "previous"),
    ("fcntl:flock", "lock", 1, "leave", "previous"),
    ("os:rename", "versions", 1, "enter", "previous"),
    ("os:rename", "versions", 1, "leave", "previous"),
    ("storage.zarr_files:sync_folder", "versions", 1, "leave", "previous"),
    ("json:dump", "current.json", 1, "enter", "previous"),
    ("json:dump", "current.json", 1, "half", "previous"),
    ("json:dump", "current.json", 1, "leave", "previous"),
    ("os:replace", "current.json", 1, "enter", "previous"),
    ("os:replace", "current.json", 1, "leave", "new"),
    ("shutil:rmtree", "staging", 1, "enter", "new"),
    ("storage.versions:VersionedStore.collect", SLOT.partition, 1, "enter", "new"),
]

# A version that waits for one check: it is current once the pointer was replaced again.
CHECKING = [
    ("os:replace", "current.json", 1, "leave", "previous"),
    ("storage.versions:VersionedStore.pass_version", "sharp", 1, "enter", "previous"),
    ("json:dump", "verdicts", 1, "half", "previous"),
    ("os:replace", "verdicts", 1, "enter", "previous"),
    ("os:replace", "verdicts", 1, "leave", "previous"),
    ("json:dump", "current.json", 2, "half", "previous"),
    ("os:replace", "current.json", 2, "enter", "previous"),
    ("os:replace", "current.json", 2, "leave", "new"),
]

REJECTING = [
    ("json:dump", "verdicts", 1, "half", "rejected"),
    ("os:replace", "verdicts", 1, "leave", "rejected"),
    ("json:dump", "current.json", 1, "half", "rejected"),
    ("os:replace", "current.json", 1, "enter", "rejected"),
    ("os:replace", "current.json", 1, "leave", "previous"),
]

# The oldest of three versions, a candidate that nobody checks any more, is collected.
COLLECTING = [
    ("json:dump", "current.json", 2, "half"),
    ("os:replace", "current.json", 2, "enter"),
    ("os:replace", "current.json", 2, "leave"),
    ("os:rename", "collected-", 1, "enter"),
    ("os:rename", "collected-", 1, "leave"),
    ("shutil:rmtree", "collected-", 1, "enter"),
]


def _moment(target: str, holding: str, call: int, when: str) -> dict[str, Any]:
    return {"target": target, "holding": holding, "call": call, "when": when}


def _name(value: object) -> str:
    return str(value).rpartition(":")[2]


@pytest.mark.parametrize(("target", "holding", "call", "when", "current"), WRITING, ids=_name)
def test_killed_while_writing(
    writers: Any,
    tmp_path: Path,
    intact_number: IntactNumber,
    target: str,
    holding: str,
    call: int,
    when: str,
    current: str,
) -> None:
    store = VersionedStore(tmp_path)
    _write_next(writers, store, 1)
    previous = store.current(SLOT)
    moment = _moment(target, holding, call, when)
    writer = writers.start("write_and_die", **moment, **_place(tmp_path, first=2, count=1))
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert intact_number(store, SLOT, store.current(SLOT)) == (2 if current == "new" else 1)
    assert (store.current(SLOT) == previous) == (current == "previous")
    _assert_sound(store, intact_number)
    _write_next(writers, store, 3)
    # What the killed writer left goes with the first collection that finds it old.
    VersionedStore(tmp_path, least_age_seconds=0.0).collect(SLOT)
    assert list((_folder(tmp_path) / "staging").iterdir()) == []
    assert intact_number(store, SLOT, store.current(SLOT)) == 3


@pytest.mark.parametrize(("target", "holding", "call", "when", "current"), CHECKING, ids=_name)
def test_killed_while_checking(
    writers: Any,
    tmp_path: Path,
    intact_number: IntactNumber,
    target: str,
    holding: str,
    call: int,
    when: str,
    current: str,
) -> None:
    store = VersionedStore(tmp_path)
    _write_next(writers, store, 1)
    previous = store.current(SLOT)
    place = _place(tmp_path, first=2, count=1, checks=["sharp"])
    writer = writers.start("write_and_die", **_moment(target, holding, call, when), **place)
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert intact_number(store, SLOT, store.current(SLOT)) == (2 if current == "new" else 1)
    _assert_sound(store, intact_number)
    if current == "previous":
        # Checked again, it becomes current.
        (waiting,) = store.pointer(SLOT).candidates
        store.pass_version(SLOT, waiting, "sharp", 1.0)
        assert store.pointer(SLOT).earlier == (previous,)
    assert intact_number(store, SLOT, store.current(SLOT)) == 2
    _write_next(writers, store, 3, checks=["sharp"])


@pytest.mark.parametrize(("target", "holding", "call", "when", "current"), REJECTING, ids=_name)
def test_killed_while_rejecting(
    writers: Any,
    tmp_path: Path,
    intact_number: IntactNumber,
    target: str,
    holding: str,
    call: int,
    when: str,
    current: str,
) -> None:
    store = VersionedStore(tmp_path)
    writers.start("write_many", **_place(tmp_path, first=1, count=2)).finish()
    previous, rejected = store.versions(SLOT)
    place = {"root": str(tmp_path), "slot": [SLOT.system, SLOT.asset, SLOT.partition]}
    moment = _moment(target, holding, call, when)
    writer = writers.start("reject_and_die", **moment, **place, version=rejected)
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert store.current(SLOT) == {"previous": previous, "rejected": rejected}[current]
    _assert_sound(store, intact_number)
    assert store.reject(SLOT, rejected, "sharp", "blurred") == previous
    _write_next(writers, store, 3)


@pytest.mark.parametrize(("target", "holding", "call", "when"), COLLECTING, ids=_name)
def test_killed_while_collecting(
    writers: Any,
    tmp_path: Path,
    intact_number: IntactNumber,
    target: str,
    holding: str,
    call: int,
    when: str,
) -> None:
    """The pointer never names a folder that is gone."""
    store = VersionedStore(tmp_path, keep=2, least_age_seconds=0.0)
    candidate = writers.start(
        "write_and_die",
        **_moment("storage.versions:VersionedStore.pass_version", "sharp", 1, "enter"),
        **_place(tmp_path, first=1, count=1, checks=["sharp"]),
    )
    assert candidate.wait() == -9
    _write_next(writers, store, 2)
    (waiting,) = store.pointer(SLOT).candidates
    place = _place(tmp_path, first=3, count=1, store={"keep": 2, "least_age_seconds": 0.0})
    writer = writers.start("write_and_die", **_moment(target, holding, call, when), **place)
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert intact_number(store, SLOT, store.current(SLOT)) == 3
    _assert_sound(store, intact_number)
    assert store.version_under_check(SLOT, "any run") == store.current(SLOT)
    store.collect(SLOT)
    assert waiting not in store.versions(SLOT)
    assert list((_folder(tmp_path) / "staging").iterdir()) == []
    _write_next(writers, store, 4)


def test_killed_before_there_was_a_version(writers: Any, tmp_path: Path) -> None:
    store = VersionedStore(tmp_path)
    moment = _moment("os:replace", "current.json", 1, "enter")
    writer = writers.start("write_and_die", **moment, **_place(tmp_path, first=1, count=1))
    assert writer.wait() == -9
    with pytest.raises(NoVersionError):
        store.open(SLOT)
    _write_next(writers, store, 2)
