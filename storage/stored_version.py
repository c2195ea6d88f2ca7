"""One version in the store with the versions that it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from storage.errors import NoVersionError, StoreError
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class StoredVersion:
    """A version by name, so that all that is read of it belongs together.

    Checks compute their figures of one; `tsuya.load` makes a system's object of one.
    """

    store: VersionedStore
    slot: Slot
    version: str

    @property
    def record(self) -> dict[str, Any]:
        """Settings, inputs, hashes and times."""
        return self.store.record(self.slot, self.version)

    @property
    def dataset(self) -> xr.Dataset:
        """Its arrays, lazy."""
        return self.store.open(self.slot, self.version)

    def input(self, asset: str) -> xr.Dataset:
        """The version of an upstream asset that this one was made from, lazy.

        Where that one is damaged or gone, another one of the same content. Raises KeyError for an
        asset that it was not made from, NoVersionError where no version has that content any more.
        """
        for entry in self.record["inputs"]:
            if entry["asset"] == asset:
                slot = Slot(self.slot.system, asset, entry["partition"])
                return self.store.open(slot, self._whole(slot, entry))
        raise KeyError(f"{self.slot} was not made from {asset}.")

    def _whole(self, slot: Slot, entry: Mapping[str, str]) -> str:
        """The name of a version that an entry of the record's inputs means."""
        others = reversed(self.store.versions(slot))
        for version in (entry["version"], *others):
            try:
                same = self.store.record(slot, version)["content"] == entry["content"]
            except StoreError:
                continue
            if same and self.store.is_in_use(slot, version):
                return version
        raise NoVersionError(
            f"{self.slot} was made from version {entry['version']} of {slot}, which is damaged or "
            "gone; expected one of its content: make both again."
        )
