"""kill -9 at any moment: what is current is the version before or the new one, and intact."""

from __future__ import annotations

import fcntl
import random
import shutil
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from storage import zarr_files
from storage.errors import NoVersionError
from storage.versions import Slot, VersionedStore

IntactNumber = Callable[[VersionedStore, Slot, str], int]
WriteNext = Callable[..., None]

SLOT = Slot("system", "asset", "key")
KILLS = 50


def _place(root: Path, **more: Any) -> dict[str, Any]:
    """The arguments that all jobs have."""
    slot = [SLOT.system, SLOT.asset, SLOT.partition]
    return {"root": str(root), "slot": slot, "checks": [], "store": {}, **more}


def _folder(root: Path) -> Path:
    return root / SLOT.system / SLOT.asset / SLOT.partition


def _sound_number(store: VersionedStore, intact_number: IntactNumber) -> int:
    """The number of the current version.

    Everything that the pointer names is there and whole, and nobody holds the lock.
    """
    pointer = store.pointer(SLOT)
    for version in (*pointer.earlier, *pointer.candidates):
        intact_number(store, SLOT, version)
    for version in store.versions(SLOT):
        # Also what no pointer names: a folder in versions/ is a whole version.
        zarr_files.verify_complete(store.folder(SLOT, version))
    with (_folder(store.root) / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    assert pointer.version is not None
    return intact_number(store, SLOT, pointer.version)


@pytest.fixture
def write_next(make_numbered: Callable[[int], xr.Dataset]) -> WriteNext:
    """Write without a hitch, and find what was written current."""

    def write(store: VersionedStore, number: int, *checks: str) -> None:
        record = {"settings": {"number": number}, "recipe": "r", "checks": list(checks)}
        written = store.write(SLOT, make_numbered(number), record)
        for check in checks:
            store.pass_version(SLOT, written.version, check, 1.0)
        assert store.current(SLOT) == written.version

    return write


@pytest.fixture(scope="module")
def one_version(writers: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store that holds version 1, to be copied."""
    root = tmp_path_factory.mktemp("one") / "store"
    writers.start("write_many", **_place(root, first=1, count=1)).finish()
    return root


@pytest.fixture
def root(one_version: Path, tmp_path: Path) -> Path:
    """A store of one's own that holds version 1."""
    return Path(shutil.copytree(one_version, tmp_path / "store"))


# ---- at random -------------------------------------------------------------------------------


@pytest.mark.parametrize("checks", [[], ["sharp", "bright"]], ids=["unchecked", "checked"])
def test_killed_at_random_moments(
    writers: Any,
    tmp_path: Path,
    intact_number: IntactNumber,
    write_next: WriteNext,
    checks: list[str],
) -> None:
    """A writer that writes one version after the other, killed 25 times, one seed a case."""
    # Collecting at once what is not among the two newest: kills meet the collection, too.
    place = _place(tmp_path, checks=checks, store={"keep": 2, "least_age_seconds": 0.0})
    store = VersionedStore(tmp_path, keep=2, least_age_seconds=0.0)
    moments = random.Random(len(checks))

    started = time.monotonic()
    first = writers.start("write_many", **place, first=1, count=2)
    begun, *_, ended = first.finish()
    earliest, latest = (event["time"] - started for event in (begun, ended))

    number, found, left_behind = 2, 2, Counter[str]()
    for _ in range(KILLS // 2):
        before = found
        writer = writers.start("write_many", **place, first=number + 1, count=1000)
        time.sleep(moments.uniform(earliest, latest))
        assert not writer.ended, writer.reported()[-1:]
        writer.kill()

        events = writer.reported()
        begins = [event["begin"] for event in events if "begin" in event]
        done = [event["done"] for event in events if "done" in event]
        assert not [event for event in events if "error" in event]
        found = _sound_number(store, intact_number)
        assert found in ((done or [before])[-1], (begins or [before])[-1])
        staged = [path.name for path in (_folder(tmp_path) / "staging").iterdir()]
        left_behind["staging"] += bool(staged)
        left_behind["collected"] += any(name.startswith("collected-") for name in staged)
        left_behind["candidate"] += bool(store.pointer(SLOT).candidates)
        left_behind["writes"] += len(done)
        number = (begins or [number])[-1]

    write_next(store, number + 1, *checks)
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
    ("zarr.storage:LocalStore.set", "lazy/c/", 6, "enter", "previous"),
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
    ("storage.sealed_json:dump", "current.json", 1, "enter", "previous"),
    ("storage.sealed_json:dump", "current.json", 1, "half", "previous"),
    ("storage.sealed_json:dump", "current.json", 1, "leave", "previous"),
    ("os:replace", "current.json", 1, "enter", "previous"),
    ("os:replace", "current.json", 1, "leave", "new"),
    ("shutil:rmtree", "staging", 1, "enter", "new"),
    ("storage.versions:VersionedStore.collect", SLOT.partition, 1, "enter", "new"),
]

# A version that waits for one check: it is current once the pointer was replaced again.
CHECKING = [
    ("os:replace", "current.json", 1, "leave", "previous"),
    ("storage.versions:VersionedStore.pass_version", "sharp", 1, "enter", "previous"),
    ("storage.sealed_json:dump", "verdicts", 1, "half", "previous"),
    ("os:replace", "verdicts", 1, "enter", "previous"),
    ("os:replace", "verdicts", 1, "leave", "previous"),
    ("storage.sealed_json:dump", "current.json", 2, "half", "previous"),
    ("os:replace", "current.json", 2, "enter", "previous"),
    ("os:replace", "current.json", 2, "leave", "new"),
]

REJECTING = [
    ("storage.sealed_json:dump", "verdicts", 1, "half", "rejected"),
    ("os:replace", "verdicts", 1, "leave", "rejected"),
    ("storage.sealed_json:dump", "current.json", 1, "half", "rejected"),
    ("os:replace", "current.json", 1, "enter", "rejected"),
    ("os:replace", "current.json", 1, "leave", "previous"),
]

# A candidate that nobody checks any more is collected.
COLLECTING = [
    ("storage.sealed_json:dump", "current.json", 2, "half"),
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
    root: Path,
    intact_number: IntactNumber,
    write_next: WriteNext,
    target: str,
    holding: str,
    call: int,
    when: str,
    current: str,
) -> None:
    store = VersionedStore(root)
    previous = store.current(SLOT)
    moment = _moment(target, holding, call, when)
    writer = writers.start("write_and_die", **moment, **_place(root, first=2, count=1))
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert _sound_number(store, intact_number) == (2 if current == "new" else 1)
    assert (store.current(SLOT) == previous) == (current == "previous")
    write_next(store, 3)
    # What the killed writer left goes with the first collection that finds it old.
    VersionedStore(root, least_age_seconds=0.0).collect(SLOT)
    assert list((_folder(root) / "staging").iterdir()) == []
    assert intact_number(store, SLOT, store.current(SLOT)) == 3


@pytest.mark.parametrize(("target", "holding", "call", "when", "current"), CHECKING, ids=_name)
def test_killed_while_checking(
    writers: Any,
    root: Path,
    intact_number: IntactNumber,
    write_next: WriteNext,
    target: str,
    holding: str,
    call: int,
    when: str,
    current: str,
) -> None:
    store = VersionedStore(root)
    previous = store.current(SLOT)
    place = _place(root, first=2, count=1, checks=["sharp"])
    writer = writers.start("write_and_die", **_moment(target, holding, call, when), **place)
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert _sound_number(store, intact_number) == (2 if current == "new" else 1)
    if current == "previous":
        # Checked again, it becomes current.
        (waiting,) = store.pointer(SLOT).candidates
        store.pass_version(SLOT, waiting, "sharp", 1.0)
        assert store.pointer(SLOT).earlier == (previous,)
    assert intact_number(store, SLOT, store.current(SLOT)) == 2
    write_next(store, 3, "sharp")


@pytest.mark.parametrize(("target", "holding", "call", "when", "current"), REJECTING, ids=_name)
def test_killed_while_rejecting(
    writers: Any,
    root: Path,
    intact_number: IntactNumber,
    write_next: WriteNext,
    target: str,
    holding: str,
    call: int,
    when: str,
    current: str,
) -> None:
    store = VersionedStore(root)
    write_next(store, 2)
    previous, rejected = store.versions(SLOT)
    place = {"root": str(root), "slot": [SLOT.system, SLOT.asset, SLOT.partition]}
    moment = _moment(target, holding, call, when)
    writer = writers.start("reject_and_die", **moment, **place, version=rejected)
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert _sound_number(store, intact_number) == {"previous": 1, "rejected": 2}[current]
    assert store.reject(SLOT, rejected, "sharp", "blurred") == previous
    write_next(store, 3)


@pytest.mark.parametrize(("target", "holding", "call", "when"), COLLECTING, ids=_name)
def test_killed_while_collecting(
    writers: Any,
    root: Path,
    intact_number: IntactNumber,
    make_numbered: Callable[[int], xr.Dataset],
    write_next: WriteNext,
    target: str,
    holding: str,
    call: int,
    when: str,
) -> None:
    """The pointer never names a folder that is gone."""
    store = VersionedStore(root, keep=2)
    record = {"settings": {"number": 2}, "recipe": "r", "checks": ["sharp"]}
    waiting = store.write(SLOT, make_numbered(2), record).version
    write_next(store, 3)
    # It collects at once what is not among the two newest, nor named: the version that waits.
    place = _place(root, first=4, count=1, store={"keep": 2, "least_age_seconds": 0.0})
    writer = writers.start("write_and_die", **_moment(target, holding, call, when), **place)
    assert writer.wait() == -9, (writer.reported(), "the moment was never met")

    assert _sound_number(store, intact_number) == 4
    assert store.version_under_check(SLOT, "any run") == store.current(SLOT)
    VersionedStore(root, keep=2, least_age_seconds=0.0).collect(SLOT)
    assert waiting not in store.versions(SLOT)
    assert list((_folder(root) / "staging").iterdir()) == []
    write_next(store, 5)


def test_killed_before_there_was_a_version(
    writers: Any, tmp_path: Path, write_next: WriteNext
) -> None:
    store = VersionedStore(tmp_path)
    moment = _moment("os:replace", "current.json", 1, "enter")
    writer = writers.start("write_and_die", **moment, **_place(tmp_path, first=1, count=1))
    assert writer.wait() == -9
    with pytest.raises(NoVersionError):
        store.open(SLOT)
    write_next(store, 2)
