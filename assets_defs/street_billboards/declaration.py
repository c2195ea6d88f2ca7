"""The system: drives, and what can be made of them at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from assets_defs.sources import Source
from assets_defs.system import Dimension, System
from storage.readers.drives import Drive, read_drive, read_frame
from storage.readers.films import SUFFIXES as FILM_SUFFIXES
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    from numpy.typing import NDArray

CITY = "city"


def _check_drive(source: Source, settings: Mapping[str, Any]) -> None:
    """Everything but the pixels; then a few frames, whether they show one world: once."""
    if source.path is not None:
        drive = read_drive(source.path)
        is_first = "start" in settings  # those of `drive_poses`
        if is_first and not np.isnan(drive.poses).any():
            _check_agreement(drive, source.name)


def _check_agreement(drive: Drive, name: str) -> None:
    """Whether some frames in the middle of a drive show one world. Raises ValueError."""
    from pipelines.street_billboards.capture.drive_agreement import (
        LEAST_AGREEMENT,
        frames_compared,
        neighbours_agreement,
    )
    from pipelines.street_billboards.capture.drive_depth import RigFrame

    instants, reach = len(drive.times), frames_compared(len(drive.cameras)) // 2
    reach = min(reach, (instants - 1) // 2)
    middle = min(max(instants // 2, reach), instants - 1 - reach)
    found = neighbours_agreement(
        [
            RigFrame(read_frame(drive, frame), drive.intrinsics, drive.poses[frame])
            for frame in range(middle - reach, middle + reach + 1)
        ]
    )
    if found < LEAST_AGREEMENT:
        raise ValueError(
            f"{name}: of the points of time {drive.times[middle]:g} the frames beside it confirm "
            f"{found:.0%}; expected {LEAST_AGREEMENT:.0%} at least: intrinsics or poses are wrong."
        )


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
