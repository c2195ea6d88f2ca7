"""Verifying what is stored, byte by byte, and putting what is damaged out of use."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from storage import zarr_files
from storage.errors import DamagedError
from storage.versions import Slot, VersionedStore


@dataclass(frozen=True)
class Finding:
    """One thing that is not what was written, and what was done about it."""

    slot: Slot
    what: str
    done: str

    def __str__(self) -> str:
        return f"{self.slot}: {self.what}; {self.done}."


def verify_slot(store: VersionedStore, slot: Slot) -> Iterator[Finding]:
    """Verify a slot's pointer, verdicts and versions; mend what is damaged, telling each.

    A damaged pointer is made again of versions and verdicts; a damaged verdict is put away, and
    its check runs again with the next launch; a damaged version is taken out of use, and the last
    good one is current again. Nothing is deleted but the damaged verdict.
    """
    files = store.files(slot)
    with files.locked() as pointer:
        try:
            files.stored_pointer()
        except DamagedError as error:
            files.point(pointer)
            yield Finding(slot, error.what, f"made again: {pointer.version or 'none'} is current")
        for version in files.versions():
            try:
                files.verdicts(version)
            except DamagedError as error:
                files.forget(version)
                if version == pointer.version:
                    # Not current any more in the launcher's eyes: it makes and checks it again.
                    files.point(replace(files.pointer(), recipe=None))
                yield Finding(slot, error.what, "put away; the next run checks again")
    for version in store.versions(slot):
        try:
            zarr_files.verify(store.folder(slot, version))
        except DamagedError as error:
            if not store.is_in_use(slot, version):
                continue
            current = store.discard(error)
            done = f"out of use: {current or 'none'} is current"
            yield Finding(slot, f"versions/{version}: {error.what}", done)
