"""State of long work: replaced whole or not at all, and of one recipe only."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from storage.errors import StoreError, StoreFullError
from storage.versions import Slot, VersionedStore
from storage.work_state import BusyError, WorkState


def _pieces(work: WorkState) -> list[Path]:
    return [path for path in work.folder.iterdir() if path.suffix != ".lock"]


@pytest.fixture
def work(store: VersionedStore, slot: Slot) -> WorkState:
    """Where work on one recipe keeps its state."""
    return store.work(slot, "recipe-a" * 8)


def test_nothing_was_kept_before_the_first_time(work: WorkState) -> None:
    assert work.read() is None
    assert not work.folder.exists()  # to ask leaves no trace


def test_the_last_state_is_read_by_the_next_process(
    work: WorkState, store: VersionedStore, slot: Slot
) -> None:
    for state in (b"first", b"", bytes(range(256)) * 100):
        work.keep(state)
        assert VersionedStore(store.root).work(slot, "recipe-a" * 8).read() == state
    assert len(_pieces(work)) == 1


def test_work_lies_beside_the_versions(work: WorkState, store: VersionedStore, slot: Slot) -> None:
    work.keep(b"state")
    assert work.folder == store.root / slot.system / slot.asset / slot.partition / "work"
    assert list(store.slots()) == []  # nothing is published by it
    assert store.versions(slot) == []


def test_a_killed_writer_leaves_the_old_state(
    work: WorkState, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(BaseException):
        pass

    def killed(*arguments: Any) -> None:
        raise Killed

    work.keep(b"old")
    for name in ("fsync", "replace"):
        with monkeypatch.context() as patch:
            patch.setattr(os, name, killed)
            with pytest.raises(Killed):
                work.keep(b"new and longer")
        assert len(_pieces(work)) == 2, "its piece, as after a kill"
        assert work.read() == b"old"
    work.keep(b"newer")
    assert work.read() == b"newer"
    assert len(_pieces(work)) == 1


def test_a_piece_alone_is_no_state(work: WorkState) -> None:
    work.keep(b"state")
    (path,) = work.folder.iterdir()
    path.rename(path.with_suffix(".part"))
    assert work.read() is None


def test_another_recipe_starts_afresh_and_leaves_the_first_one_its_state(
    work: WorkState, store: VersionedStore, slot: Slot
) -> None:
    work.keep(b"of a")
    other = store.work(slot, "recipe-b" * 8)
    assert other.read() is None
    assert work.read() == b"of a"  # to look takes nothing away
    other.keep(b"of b")
    assert other.read() == b"of b"
    assert work.read() == b"of a"


def test_one_process_works_on_a_recipe(
    work: WorkState,
    store: VersionedStore,
    slot: Slot,
    make_record: Callable[..., dict[str, Any]],
) -> None:
    same, other = store.work(slot, "recipe-a" * 8), store.work(slot, "recipe-b" * 8)
    with work.alone():
        work.keep(b"of a")
        with (
            pytest.raises(BusyError, match="another process works on the same recipe"),
            same.alone(),
        ):
            pass
        with other.alone():
            other.keep(b"of b")
        # A version of another recipe is published meanwhile.
        store.write(slot, xr.Dataset({"value": ((), 1.0)}), make_record())
        assert work.read() == b"of a"
        assert other.read() is None, "nobody works on it any more"
    with same.alone():
        assert same.read() == b"of a"


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:-1],
        lambda data: data[:20],
        lambda data: b"",
        lambda data: b"another program's" + data,
        lambda data: data[:-3] + bytes([data[-3] ^ 1]) + data[-2:],
    ],
    ids=["cut", "cut short", "empty", "foreign", "flipped bit"],
)
def test_a_state_that_is_not_whole_starts_the_work_anew(
    work: WorkState, damage: Callable[[bytes], bytes], caplog: pytest.LogCaptureFixture
) -> None:
    work.keep(bytes(range(256)))
    (path,) = _pieces(work)
    path.write_bytes(damage(path.read_bytes()))
    assert work.read() is None
    (said,) = caplog.messages
    assert "the work starts anew" in said
    work.keep(b"new")
    assert work.read() == b"new"


def test_partitions_keep_apart(work: WorkState, store: VersionedStore, slot: Slot) -> None:
    work.keep(b"fox")
    other = store.work(Slot(slot.system, slot.asset, "hare"), "recipe-a" * 8)
    assert other.read() is None
    other.keep(b"hare")
    assert work.read() == b"fox"


@pytest.mark.parametrize(
    ("number", "expected"),
    [(errno.ENOSPC, StoreFullError), (errno.EDQUOT, StoreFullError), (errno.EIO, StoreError)],
)
@pytest.mark.parametrize("name", ["fsync", "replace"])
def test_a_full_disk_is_one_sentence_and_leaves_the_old_state(
    work: WorkState,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    number: int,
    expected: type[StoreError],
) -> None:
    def full(*arguments: Any) -> None:
        raise OSError(number, os.strerror(number))

    work.keep(b"old")
    with monkeypatch.context() as patch:
        patch.setattr(os, name, full)
        with pytest.raises(expected) as refusal:
            work.keep(b"new")
    assert type(refusal.value) is expected
    assert "\n" not in str(refusal.value)
    assert str(work.folder) in str(refusal.value)
    assert work.read() == b"old"
    assert len(_pieces(work)) == 1, "the piece would fill the disk further"


def test_a_full_disk_before_the_folder_is_there(
    work: WorkState, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*arguments: Any, **options: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(Path, "mkdir", full)
        with pytest.raises(StoreFullError):
            work.keep(b"new")
    assert work.read() is None


def test_a_written_version_ends_the_work(
    work: WorkState,
    store: VersionedStore,
    slot: Slot,
    make_record: Callable[..., dict[str, Any]],
    make_numbered: Callable[[int], xr.Dataset],
) -> None:
    work.keep(b"state")
    beside = store.work(Slot(slot.system, slot.asset, "hare"), "recipe-a" * 8)
    beside.keep(b"another's")
    store.write(slot, make_numbered(1), make_record())
    assert not work.folder.exists()
    assert beside.read() == b"another's"


def test_equal_content_ends_the_work_too(
    work: WorkState,
    store: VersionedStore,
    slot: Slot,
    make_record: Callable[..., dict[str, Any]],
    make_numbered: Callable[[int], xr.Dataset],
) -> None:
    store.write(slot, make_numbered(1), make_record())
    work.keep(b"state")
    assert not store.write(slot, make_numbered(1), make_record()).is_new
    assert not work.folder.exists()


def test_a_version_that_cannot_be_written_leaves_the_work(
    work: WorkState,
    store: VersionedStore,
    slot: Slot,
    make_record: Callable[..., dict[str, Any]],
    make_numbered: Callable[[int], xr.Dataset],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A disk that is full at the end of a long training does not cost the training."""

    def full(*arguments: Any, **options: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    work.keep(b"state")
    with monkeypatch.context() as patch:
        patch.setattr("storage.zarr_files.sync", full)
        with pytest.raises(StoreFullError):
            store.write(slot, make_numbered(1), make_record())
    assert work.read() == b"state"
