"""The system: drives, and what can be made of them at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.sources import Source
from assets_defs.street_billboards.drive_agreement import check_agreement
from assets_defs.system import Dimension, System
from storage.readers.drives import read_drive
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

CITY = "city"


def _check_drive(source: Source, settings: Mapping[str, Any]) -> None:
    """Everything but the pixels; then a few frames, whether they show one world."""
    if source.path is not None:
        check_agreement(read_drive(source.path), source.name)


def _overview(store: VersionedStore, slots: Sequence[Slot]) -> Mapping[str, NDArray[np.uint8]]:
    """The flight through each street, moving."""
    return {
        f"{slot.partition}-flight": store.open(slot)["flight"].values
        for slot in slots
        if slot.asset == "street_frames"
    }


STREET = System(
    name="street_billboards",
    title="Streets from eigen-textured billboards",
    dimensions=(
        Dimension(
            "drive",
            builtin=(CITY,),
            examples=(CITY,),
            default=CITY,
            suffixes=(),
            check=_check_drive,
            folders=True,
        ),
    ),
    overview=_overview,
)
