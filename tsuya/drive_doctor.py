"""What a drive is good for, told within a minute: before hours are spent on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from assets_defs.street_billboards.given_poses import agreement, world_of
from assets_defs.street_billboards.unposed import camera_of, check_one_camera, pictures_of
from storage.readers.drives import Drive, read_drive
from tsuya.doctor import Finding

_LOOKED_AT = 3000
"""Frames in the middle of a film, at most: some seconds of work for each hundred."""
_CAMERA_HEIGHT = 1.5


def examine_drive(path: Path, focal: float | None = None) -> list[Finding]:
    """Look at a drive: what is read, whether its poses fit or can be found, what it lacks.

    focal: pixels, where it is known. Raises BadInput as ``read_drive``.
    """
    drive = read_drive(path)
    findings = [Finding("drive", True, _what(drive))]
    findings += [Finding("note", True, note) for note in drive.notes]
    look = _unposed if np.isnan(drive.poses).any() else _posed
    try:
        return findings + look(drive, focal)
    except ValueError as error:
        return [*findings, Finding("poses", False, str(error))]


def _what(drive: Drive) -> str:
    frames, cameras = drive.present.shape
    size = f"{drive.width} x {drive.height} pixels"
    poses = "without poses" if np.isnan(drive.poses).any() else "with poses"
    return f"{frames} frames of {cameras} camera(s), {size}, {poses}"


def _posed(drive: Drive, focal: float | None) -> list[Finding]:
    world = world_of(drive, np.arange(len(drive.times)), _CAMERA_HEIGHT)
    found = agreement(drive, world)
    notes = [Finding("note", True, note) for note in world.notes]
    places = world.poses[:, 0, :3, 3]
    metres = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
    return [
        *notes,
        Finding("poses", True, f"fit the photographs; {metres:.0f} m of road"),
        Finding("neighbouring frames", *found),
    ]


def _unposed(drive: Drive, focal: float | None) -> list[Finding]:
    from pipelines.street_billboards.poses.drive_quality import FRAMES, drive_quality
    from pipelines.street_billboards.poses.frame_choice import choose_frames

    check_one_camera(drive, drive.file.name)
    count = len(drive.times)
    first = max((count - _LOOKED_AT) // 2, 0)
    pictures = pictures_of(drive, np.arange(first, min(first + _LOOKED_AT, count)))
    choice = choose_frames(pictures.greys())
    chosen = choice.frames.tolist()
    start = max((len(chosen) - FRAMES) // 2, 0)
    some = list(pictures.colours(chosen[start : start + FRAMES]))
    quality = drive_quality(some, camera_of(drive, focal), frames=len(chosen))
    told = f"{quality.focal:.0f} pixels"
    if quality.focal_deviation > 0:
        told += f", standard deviation {quality.focal_deviation:.0f}"
    return [
        *(Finding("note", True, note) for note in choice.notes),
        Finding("parallax", True, f"{quality.parallax:.1%} of the width from frame to frame"),
        Finding(
            "poses",
            quality.registered == quality.asked,
            f"of {quality.registered} of {quality.asked} frames in the middle",
        ),
        Finding("focal length", True, told),
        Finding("sparse points", True, f"{quality.points:.0f} a frame"),
        *(Finding("lacks", False, sentence) for sentence in quality.lacking),
    ]
