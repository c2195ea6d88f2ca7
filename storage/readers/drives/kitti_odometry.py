"""KITTI's odometry benchmark: a sequence's `calib.txt`, `times.txt`, pictures and poses.

Its description is the readme of the development kit, http://www.cvlibs.net/datasets/kitti. Other
programs write the same poses for drives of their own, with `image_l` and `image_r`, and without
labels in `calib.txt`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.drives.kitti_cameras import (
    Z_UP,
    RectifiedCamera,
    numbered_pictures,
    rectified_camera,
)
from storage.readers.drives.motions import place, rigid, rotation
from storage.readers.drives.recordings import Frame, Recording, check_count, counted
from storage.readers.drives.text_tables import Table

_CALIBRATION = "calib.txt"
_FOLDERS = {
    "image_0": 0, "image_1": 1, "image_2": 2, "image_3": 3, "image_l": 0, "image_r": 1,
}  # fmt: skip
"""Folders of pictures and which projection is theirs."""
_MOST_SEQUENCES = 100
_EXPECTED = (
    "a KITTI sequence with calib.txt, image_0 to image_3 (or image_l, image_r) and poses.txt"
)


def find_kitti_odometry(path: Path) -> Path | None:
    """The calibration of a sequence, which has pictures beside it: of the folder itself, or of the
    benchmark's, where poses lie apart; there of one with poses and of those the longest."""
    own = path / _CALIBRATION
    if _has_pictures(path) and own.is_file():
        return own
    sequences = [folder / _CALIBRATION for folder in _sequences(path)]
    return max(sequences, key=lambda file: _worth(file, path), default=None)


def read_kitti_odometry(file: Path, root: Path) -> Recording:
    """A sequence: the pictures that are there, with poses where there are any.

    Poses are those of the first camera, the first of them at zero; the world is turned so that z is
    up, y where the first camera looks. Times are of `times.txt`, otherwise pictures' numbers.

    Raises BadInput for numbers that are missing or none, matrices that are no rotations or
    projections, and a sequence without pictures.
    """
    folder = file.parent
    pictures = {name: found for name in _FOLDERS if (found := numbered_pictures(folder / name))}
    if not pictures:
        raise BadInput(folder, "number of pictures", "0", _EXPECTED)
    calibration = Table(file, _EXPECTED)
    cameras = {name: _camera(calibration, name, own) for name, own in pictures.items()}
    numbers = sorted(set().union(*pictures.values()))
    poses, pose_notes = _poses(folder, root, numbers)
    times, time_notes = _times(folder, numbers)
    frames = [
        _frame(name, number, times, poses, cameras[name], own[number])
        for name, own in pictures.items()
        for number in own
        if (poses is None or number in poses) and number in times
    ]
    if not frames:
        raise BadInput(file, "number of pictures with a pose and a time", "0", _EXPECTED)
    check_count(file, len(frames))
    notes = [*calibration.notes, *pose_notes, *time_notes]
    others = len(_sequences(root)) - 1
    if folder != root and others > 0:
        notes.insert(0, f"Sequence {folder.name} is read; {counted(others, 'other sequence')} not.")
    return Recording(file, frames, metric=True, up_known=True, notes=tuple(notes))


def _has_pictures(folder: Path) -> bool:
    return any((folder / name).is_dir() for name in _FOLDERS)


def _sequences(root: Path) -> list[Path]:
    """The sequences of the whole benchmark's folder."""
    folder = root / "sequences"
    found = sorted(folder.iterdir())[:_MOST_SEQUENCES] if folder.is_dir() else []
    return [own for own in found if _has_pictures(own) and (own / _CALIBRATION).is_file()]


def _worth(file: Path, root: Path) -> tuple[bool, int]:
    count = max(len(numbered_pictures(file.parent / name)) for name in _FOLDERS)
    return _poses_file(file.parent, root) is not None, count


def _frame(
    camera: str,
    number: int,
    times: Mapping[int, float],
    poses: Mapping[int, NDArray[np.float64]] | None,
    rectified: RectifiedCamera,
    photograph: Path,
) -> Frame:
    pose = None if poses is None else poses[number] @ rectified.offset
    return Frame(camera, times[number], photograph, pose, rectified.lens)


def _camera(table: Table, folder: str, pictures: Mapping[int, Path]) -> RectifiedCamera:
    """By the labels P0 to P3, or by the line's number where lines have none."""
    wanted = _FOLDERS[folder]
    labelled = {label: line for label, line in table.labelled().items() if label.startswith("P")}
    if labelled:
        row, words = labelled.get(f"P{wanted}", (-1, ""))
    else:
        lines = [(row, line) for row, line in enumerate(table.lines) if line]
        row, words = lines[wanted] if wanted < len(lines) else (-1, "")
    if row < 0:
        raise BadInput(table.file, f"P{wanted} of {folder}", "missing", "P0: and 12 numbers")
    projection = table.numbers(row, words, 12).reshape(3, 4)
    return rectified_camera(table.file, f"P{wanted}", projection, pictures)


def _poses(
    folder: Path, root: Path, numbers: list[int]
) -> tuple[dict[int, NDArray[np.float64]] | None, list[str]]:
    """Poses of the first camera by the picture's number, z up; None where there is no file."""
    file = _poses_file(folder, root)
    if file is None:
        apart = folder.parent.parent / "poses" / f"{folder.name}.txt"
        there = f"; {apart.name} lies outside of the folder" if apart.is_file() else ""
        return None, [f"Without poses.txt: poses are to be found{there}."]
    table = Table(file, _EXPECTED)
    lines = [(row, line) for row, line in enumerate(table.lines) if line]
    check_count(file, len(lines))
    turned = rigid(Z_UP, np.zeros(3))
    poses = {}
    for number in numbers:
        if number >= len(lines):
            continue
        row, words = lines[number]
        matrix = table.numbers(row, words, 12).reshape(3, 4)
        field = f"line {row + 1}"
        turn, scale = rotation(file, field, matrix[:, :3])
        if abs(scale - 1) > 1e-2:
            raise BadInput(file, field, f"scaled by {scale:.3g}", "a rotation and a place")
        poses[number] = turned @ rigid(turn, place(file, field, matrix[:, 3]))
    notes = [
        "KITTI's world has the first camera's axes: turned so that z is up and y where it looks.",
        *table.notes,
    ]
    if len(lines) > len(poses):
        notes.append(
            f"{file.name} has {len(lines)} poses for {counted(len(poses), 'picture')}: those of "
            "the pictures are read."
        )
    if len(numbers) > len(poses):
        notes.append(
            f"{counted(len(numbers) - len(poses), 'picture')} beyond the {len(lines)} poses of "
            f"{file.name} left out."
        )
    return poses, notes


def _poses_file(folder: Path, root: Path) -> Path | None:
    places = (folder / "poses.txt", *(own / f"poses/{folder.name}.txt" for own in (folder, root)))
    return next((file for file in places if file.is_file()), None)


def _times(folder: Path, numbers: list[int]) -> tuple[dict[int, float], list[str]]:
    file = folder / "times.txt"
    if not file.is_file():
        note = "Without times.txt: times are the pictures' numbers."
        return {number: float(number) for number in numbers}, [note]
    table = Table(file, _EXPECTED)
    lines = [(row, line) for row, line in enumerate(table.lines) if line]
    known = [number for number in numbers if number < len(lines)]
    times = {number: float(table.numbers(*lines[number], 1)[0]) for number in known}
    if len(known) == len(numbers):
        return times, table.notes
    note = (
        f"{counted(len(numbers) - len(known), 'picture')} beyond the {len(lines)} times of "
        "times.txt left out."
    )
    return times, [*table.notes, note]
