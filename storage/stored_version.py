"""One version in the store with the versions that it was made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

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

        Raises KeyError for an asset that it was not made from.
        """
        for entry in self.record["inputs"]:
            if entry["asset"] == asset:
                slot = Slot(self.slot.system, asset, entry["partition"])
                return self.store.open(slot, entry["version"])
        raise KeyError(f"{self.slot} was not made from {asset}.")
