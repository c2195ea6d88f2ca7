"""Dagster's way into the versioned store: lazy datasets in, lazy or eager ones out.

The one module of `storage` that knows Dagster.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dagster as dg

from storage.errors import DamagedError, StoreError
from storage.schemas import find_schema
from storage.versions import WHOLE, Slot, VersionedStore
from storage.zarr_files import RECORD, stored_bytes

if TYPE_CHECKING:
    import xarray as xr

INTERRUPTED = "interrupted"
"""Why a run failed that a person stopped."""
DAMAGED = "damaged"
"""Name of a failure's metadata: the folder of the damaged version that was read."""


class ZarrIOManager(dg.IOManager):
    """Writes what an asset returns as a new version; opens the current version for what needs it.

    A dataset to be written carries its provenance in the attribute ``tsuya``.
    """

    def __init__(self, store: VersionedStore) -> None:
        self.store = store

    def handle_output(self, context: dg.OutputContext, dataset: xr.Dataset) -> None:
        """Validate against the schema, write, verify, publish. Raises StoreError, SchemaError."""
        slot = _slot(context)
        record = dataset.attrs.pop(RECORD)
        schema = find_schema(slot.system, slot.asset)
        try:
            written = self.store.write(slot, schema.conform(dataset), record)
        except (KeyboardInterrupt, dg.DagsterExecutionInterruptedError) as stop:
            # Left to itself, Dagster would take the interruption for trouble and try again.
            raise dg.Failure(description=INTERRUPTED, allow_retries=False) from stop
        except DamagedError as error:
            raise damage_failure(self.store, error) from error
        except (ValueError, StoreError) as error:
            # A lazy dataset's file turned out to be damaged, the disk is full: a second try at
            # once would not help.
            raise dg.Failure(description=str(error), allow_retries=False) from error
        folder = self.store.folder(slot, written.version)
        data_version = dg.DataVersion(written.content)
        # Internal to Dagster, and the only way to set it from an IO manager: pinned, tested.
        context.step_context.set_data_version(context.asset_key, data_version)
        context.add_output_metadata(
            {
                "version": written.version,
                "new content": written.is_new,
                "folder": dg.MetadataValue.path(str(folder)),
                "bytes in memory": int(dataset.nbytes),
                "bytes stored": stored_bytes(folder),
                "settings": dg.MetadataValue.json(record["settings"]),
            }
        )

    def load_input(self, context: dg.InputContext) -> xr.Dataset:
        """The current version, lazy. Raises dg.Failure, a sentence, where there is none."""
        try:
            return self.store.open(_slot(context))
        except DamagedError as error:
            raise damage_failure(self.store, error) from None
        except StoreError as error:  # a sentence; its trace says nothing more
            raise dg.Failure(description=str(error), allow_retries=False) from None


def damage_failure(store: VersionedStore, damage: DamagedError) -> dg.Failure:
    """The failure of a step that read damaged bytes; what is damaged is out of use from now on.

    Who launches again makes anew what was damaged.
    """
    store.discard(damage)
    return dg.Failure(
        description=str(damage), metadata={DAMAGED: str(damage.folder)}, allow_retries=False
    )


def _slot(context: Any) -> Slot:
    system, asset = context.asset_key.path
    partition = (
        context.asset_partition_key.replace("|", ".") if context.has_asset_partitions else ""
    )
    return Slot(system, asset, partition or WHOLE)
