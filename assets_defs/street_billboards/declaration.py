"""The system: drives, and what can be made of them at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from assets_defs.sources import Source
from assets_defs.street_billboards.given_poses import agreement, world_of
from assets_defs.street_billboards.unposed import check_one_camera
from assets_defs.system import Dimension, System
from storage.readers.drives import read_drive
from storage.readers.films import SUFFIXES as FILM_SUFFIXES
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    from numpy.typing import NDArray

CITY = "city"


def _check_drive(source: Source, settings: Mapping[str, Any]) -> None:
    """Everything but the pixels; then some frames, whether they show one world: once."""
    if source.path is None:
        return
    drive = read_drive(source.path)
    is_first = "camera_height" in settings  # those of `drive_poses`
    if not is_first:
        return
    if np.isnan(drive.poses).any():
        check_one_camera(drive, source.name)
        return
    try:
        world = world_of(drive, np.arange(len(drive.times)), settings["camera_height"])
    except ValueError as error:
        raise ValueError(f"{source.name}: {error}") from error
    fits, sentence = agreement(drive, world)
    if not fits:
        raise ValueError(f"{source.name}: {sentence}: intrinsics or poses are wrong.")


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
            suffixes=FILM_SUFFIXES,
            check=_check_drive,
            folders=True,
        ),
    ),
    overview=_overview,
)
