"""Poses that users' files have: read as the photographs say, adjusted if asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from storage.readers.drives import Drive, read_frame

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.street_billboards.poses.worlds import World


def world_of(drive: Drive, chosen: NDArray[np.integer], camera_height: float) -> World:
    """The world in which the photographs of some frames agree. Raises ValueError."""
    from pipelines.street_billboards.poses.worlds import right_world

    def load(frame: int) -> NDArray[np.uint8]:
        return read_frame(drive, int(chosen[frame]))

    return right_world(
        load,
        drive.poses[chosen],
        drive.intrinsics,
        camera_height=camera_height,
        is_metric=drive.metric,
    )


def agreement(drive: Drive, world: World) -> tuple[bool, str]:
    """Whether some frames in the middle of a drive show one world, and a sentence on it."""
    from pipelines.street_billboards.capture.drive_agreement import (
        LEAST_AGREEMENT,
        frames_compared,
        neighbours_agreement,
    )
    from pipelines.street_billboards.capture.drive_depth import RigFrame

    instants, reach = len(world.order), frames_compared(len(drive.cameras)) // 2
    reach = min(reach, (instants - 1) // 2)
    middle = min(max(instants // 2, reach), instants - 1 - reach)
    found = neighbours_agreement(
        [
            RigFrame(
                read_frame(drive, int(world.order[frame])), world.intrinsics, world.poses[frame]
            )
            for frame in range(middle - reach, middle + reach + 1)
        ]
    )
    return found >= LEAST_AGREEMENT, (
        f"of the points of time {drive.times[middle]:g} the frames beside it confirm "
        f"{found:.0%}; expected {LEAST_AGREEMENT:.0%} at least"
    )


def adjusted(
    drive: Drive,
    world: World,
    instants: NDArray[np.integer],
    progress: Callable[[float], None],
) -> tuple[NDArray[np.float64], Sequence[str]]:
    """A world's poses without the noise of centimetres, and what is to be said of it."""
    from pipelines.street_billboards.poses.adjusted_poses import adjust_poses

    frames = (list(read_frame(drive, int(instant))) for instant in instants)

    def told(done: float) -> None:
        progress(done / len(instants))

    found = adjust_poses(frames, world.poses, world.intrinsics, progress=told)
    return found.poses, found.notes
