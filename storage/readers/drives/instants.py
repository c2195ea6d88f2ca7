"""Photographs sorted into instants, and the places of cameras that an instant lacks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.drives.motions import inverse
from storage.readers.drives.recordings import Frame, shown_number

Instant = dict[str, Frame]
"""The photographs of one time by camera."""


def instants(file: Path, frames: Sequence[Frame], spread: float) -> list[Instant]:
    """Instants in the order of time: a photograph belongs to the one before it if that is at most
    ``spread`` of a camera's usual step ago and lacks its camera.

    Raises BadInput for two photographs of one camera and time.
    """
    apart = spread * _usual_step(frames)
    found: list[Instant] = []
    start = -np.inf
    for frame in sorted(frames, key=lambda frame: frame.time):
        if found and frame.camera in found[-1] and found[-1][frame.camera].time == frame.time:
            raise BadInput(
                file,
                f"picture {frame.photograph.name}",
                f"a second photograph of camera {frame.camera} at time {shown_number(frame.time)}",
                "one photograph of a camera at a time",
            )
        late = frame.time - start > apart
        if not found or late or frame.camera in found[-1]:
            found.append({})
            start = frame.time
        found[-1][frame.camera] = frame
    return found


def _usual_step(frames: Sequence[Frame]) -> float:
    """The shortest of the cameras' median steps from photograph to photograph; 0 for no step."""
    times: dict[str, list[float]] = {}
    for frame in frames:
        times.setdefault(frame.camera, []).append(frame.time)
    steps = [float(np.median(np.diff(np.sort(own)))) for own in times.values() if len(own) > 1]
    return min((step for step in steps if step > 0), default=0.0)


def with_absent(poses: NDArray[np.float64], present: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Poses (f, c, 4, 4) with those of absent cameras filled in: as the camera stands to another
    one of that instant in the nearest instant that has both; if none has, as that other one.

    ``present`` (f, c): each instant has one at least.
    """
    filled = poses.copy()
    for instant, camera in zip(*np.nonzero(~present), strict=True):
        others = np.nonzero(present[instant])[0]
        both = present[:, camera, None] & present[:, others]
        rows, columns = np.nonzero(both)
        if not len(rows):
            filled[instant, camera] = poses[instant, others[0]]
            continue
        nearest = int(np.argmin(np.abs(rows - instant)))
        row, other = rows[nearest], others[columns[nearest]]
        offset = inverse(poses[row, other]) @ poses[row, camera]
        filled[instant, camera] = poses[instant, other] @ offset
    return filled
