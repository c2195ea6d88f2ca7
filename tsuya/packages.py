"""Packages by what people type: a key of the store, or the path of a `.tsuya` file."""

from __future__ import annotations

from pathlib import Path

from storage.packages import Package, read_package
from storage.schemas import schemas_of
from storage.versions import Slot, VersionedStore
from tsuya.keys import parse_key

SUFFIX = ".tsuya"
_PACKAGE = "_package"


def find_package(store: VersionedStore, key: str) -> Package:
    """The package that a key or a path names.

    A key names a package asset, or another asset of the same items: of ``fur_frames/teapot.grass``
    the package is ``fur_package/teapot.grass``. Raises ValueError, BadInput, NoVersionError.
    """
    if key.endswith(SUFFIX) or Path(key).is_file():
        return read_package(key)
    slot = package_slot(parse_key(key))
    content = store.open(slot)["file"].values.tobytes()
    return read_package(content, f"{slot.system}-{slot.partition}{SUFFIX}")


def package_slot(slot: Slot) -> Slot:
    """Where the package of a slot's items lies."""
    return Slot(slot.system, package_asset(slot.system), slot.partition)


def package_asset(system: str) -> str:
    """The name of a system's package asset."""
    return next(each.asset for each in schemas_of(system) if each.asset.endswith(_PACKAGE))


def package_slots(store: VersionedStore) -> list[Slot]:
    """Every package of the store that has a current version."""
    return [
        slot
        for slot in store.slots()
        if slot.asset.endswith(_PACKAGE) and store.pointer(slot).version is not None
    ]
