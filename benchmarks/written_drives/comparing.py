"""What comes back of the drive, compared with what was written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.written_drives import colmap, kitti, nuscenes, transforms
from benchmarks.written_drives.truth import Written
from storage.readers.drives import Drive, read_drive, read_frame

POSE_TOLERANCE = 1e-6
"""Of each number of a pose, and of a K in pixels."""

FORMS: dict[str, Callable[[Path], Written]] = {
    "transforms_fields": transforms.write_fields,
    "transforms_nerfstudio": transforms.write_nerfstudio,
    "transforms_instant_ngp": transforms.write_instant_ngp,
    "transforms_blender": transforms.write_blender,
    "transforms_distorted": transforms.write_distorted,
    "transforms_fisheye": transforms.write_fisheye,
    "transforms_panorama": transforms.write_panorama,
    "colmap_rig_binary": colmap.write_rig_binary,
    "colmap_text": colmap.write_text,
    "colmap_two_pieces": colmap.write_two_pieces,
    "colmap_fisheye": colmap.write_fisheye,
    "colmap_older_text": colmap.write_older_text,
    "kitti_sequence": kitti.write_sequence,
    "kitti_other_program": kitti.write_other_program,
    "kitti_commas": kitti.write_commas,
    "kitti_raw": kitti.write_raw,
    "nuscenes": nuscenes.write_nuscenes,
}
"""Who writes the drive into an empty folder, by the form's name."""


def format_mismatches(folder: Path) -> dict[str, int]:
    """The photographs of each form that come back otherwise than they were written.

    A photograph counts where its pose or its camera's K is off by more than 1e-6, where a pixel is
    (by more than two codes where it was distorted), where it is missing, and all of a form count
    that is refused, has other cameras or instants, or lacks a note.

    Parameters: ``folder``, which gets a folder for each of ``FORMS``.
    """
    return {form: _mismatches(write(folder / form)) for form, write in FORMS.items()}


def _mismatches(written: Written) -> int:
    total = written.poses.shape[0] * written.poses.shape[1]
    try:
        drive = read_drive(written.path)
    except ValueError:
        return total
    rows = len(drive.times)
    said = " ".join(drive.notes)
    if set(drive.cameras) != set(written.names) or rows != len(written.poses):
        return total
    if not all(word in said for word in written.notes):
        return total
    return sum(_off(drive, written, instant) for instant in range(rows))


def _off(drive: Drive, written: Written, instant: int) -> int:
    """How many photographs of one instant."""
    count = 0
    pictures = read_frame(drive, instant)
    for number, name in enumerate(written.names):
        camera = drive.cameras.index(name)
        expected = written.pictures[instant][number]
        height, width = expected.shape[:2]
        found = pictures[camera, :height, :width].astype(int)
        pose = np.abs(drive.poses[instant, camera] - written.poses[instant, number]).max()
        k = np.abs(drive.intrinsics[camera] - written.intrinsics[number]).max()
        same_size = tuple(drive.sizes[camera]) == (width, height)
        pixels = np.abs(found - expected).max() if same_size else np.inf
        there = drive.present[instant, camera]
        right = max(pose, k) <= POSE_TOLERANCE and pixels <= written.codes and there
        count += not right
    return count
