"""KITTI's raw recordings: a day's calibration, one drive's rectified pictures and its GPS and IMU.

After the data's own description (Geiger and others, Vision meets robotics: the KITTI dataset,
2013). Poses are places in the Mercator projection and roll, pitch and yaw, as the development kit
turns the one into the other; the world is east, north, up from the first place.
"""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.drives.kitti_cameras import numbered_pictures, rectified_camera
from storage.readers.drives.motions import inverse, place, rigid, rotation
from storage.readers.drives.recordings import Frame, Recording, check_count, counted
from storage.readers.drives.text_tables import Table

EARTH_RADIUS = 6_378_137.0
"""Metres, of the development kit's projection."""

_CAMERAS = "calib_cam_to_cam.txt"
_VELODYNE = "calib_velo_to_cam.txt"
_IMU = "calib_imu_to_velo.txt"
_EXPECTED = (
    "a day of KITTI's raw data: calib_cam_to_cam.txt, calib_velo_to_cam.txt, calib_imu_to_velo.txt "
    "and a drive …_sync with image_00/data to image_03/data and oxts/data"
)
_FOLDERS = ("image_00", "image_01", "image_02", "image_03")
_OXTS = 30
"""Numbers of a packet: latitude, longitude, altitude, roll, pitch, yaw …"""
_STAMP = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d)(\.\d+)?")


def find_kitti_raw(path: Path) -> Path | None:
    """The drive of a day's folder, the one with most pictures; or the folder as one itself."""
    if _is_drive(path):
        return path
    drives = _drives(path) if (path / _CAMERAS).is_file() else []
    return max(drives, key=_pictures, default=None)


def read_kitti_raw(drive: Path, day: Path) -> Recording:
    """A drive's pictures, z up and in metres; ``day``: the folder with the calibration, which
    holds the drive or is it.

    Raises BadInput for files that are missing, numbers that are missing or none, matrices that are
    no rotations or projections, and a drive without pictures.
    """
    file = day / _CAMERAS
    pictures = {
        name: found for name in _FOLDERS if (found := numbered_pictures(drive / name / "data"))
    }
    if not pictures:
        raise BadInput(drive, "number of pictures", "0", _EXPECTED)
    table = Table(file, _EXPECTED)
    cameras = {}
    for name, own in pictures.items():
        label = f"P_rect_{name[-2:]}"
        projection = _labelled(table, label, 12).reshape(3, 4)
        cameras[name] = rectified_camera(file, label, projection, own)
    numbers = sorted(set().union(*pictures.values()))
    first_camera = _first_camera(table, day)
    imu = _imu_poses(drive, numbers)
    times, notes = _times(drive, list(pictures), numbers)
    frames = [
        Frame(
            name,
            times[number],
            own[number],
            imu[number] @ first_camera @ cameras[name].offset,
            cameras[name].lens,
        )
        for name, own in pictures.items()
        for number in own
        if number in imu
    ]
    if not frames:
        raise BadInput(drive, "number of pictures with a packet in oxts/data", "0", _EXPECTED)
    check_count(file, len(frames))
    lost = len(numbers) - len(imu)
    if lost:
        notes.append(f"{counted(lost, 'instant')} without a packet in oxts/data left out.")
    others = [other for other in _drives(day) if other != drive]
    if others:
        notes.append(f"{drive.name} is read; {counted(len(others), 'drive')} beside it not.")
    notes.append("The world is KITTI's: east, north and up from the first place.")
    return Recording(file, frames, metric=True, up_known=True, notes=(*table.notes, *notes))


def _is_drive(folder: Path) -> bool:
    return any((folder / name / "data").is_dir() for name in _FOLDERS)


def _drives(day: Path) -> list[Path]:
    """A day's drives; unrectified ones (…_extract) have other lenses than the calibration's."""
    found = (folder for folder in day.iterdir() if folder.is_dir() and _is_drive(folder))
    return sorted(folder for folder in found if not folder.name.endswith("_extract"))


def _pictures(drive: Path) -> int:
    return sum(len(numbered_pictures(drive / name / "data")) for name in _FOLDERS)


def _labelled(table: Table, label: str, count: int) -> NDArray[np.float64]:
    lines = table.labelled()
    if label not in lines:
        raise BadInput(table.file, label, "missing", f"{label}: and {count} numbers")
    row, words = lines[label]
    return table.numbers(row, words, count)


def _motion(file: Path) -> NDArray[np.float64]:
    """(4, 4) of a file's R and T."""
    table = Table(file, _EXPECTED)
    turn, _ = rotation(file, "R", _labelled(table, "R", 9).reshape(3, 3))
    return rigid(turn, place(file, "T", _labelled(table, "T", 3)))


def _first_camera(table: Table, day: Path) -> NDArray[np.float64]:
    """(4, 4): the first rectified camera's axes to the IMU's."""
    turn, _ = rotation(table.file, "R_rect_00", _labelled(table, "R_rect_00", 9).reshape(3, 3))
    to_camera = rigid(turn, np.zeros(3)) @ _motion(day / _VELODYNE) @ _motion(day / _IMU)
    return inverse(to_camera)


def _imu_poses(drive: Path, numbers: list[int]) -> dict[int, NDArray[np.float64]]:
    """IMU to world, of the pictures' numbers for which there is a packet."""
    folder = drive / "oxts" / "data"
    packets = {}
    for number in numbers:
        file = folder / f"{number:010d}.txt"
        if file.is_file():
            table = Table(file, _EXPECTED)
            words = table.lines[0] if table.lines else ""
            packets[number] = table.numbers(0, words, _OXTS)
            _check_packet(file, packets[number])
    if not packets:
        return {}
    first = next(iter(packets.values()))
    scale = np.cos(np.radians(first[0]))
    origin = _mercator(first, scale)
    return {
        number: rigid(_turn(*packet[3:6]), _mercator(packet, scale) - origin)
        for number, packet in packets.items()
    }


def _check_packet(file: Path, packet: NDArray[np.float64]) -> None:
    for what, value, most in (
        ("latitude", packet[0], 89.0),
        ("longitude", packet[1], 360.0),
        ("altitude", packet[2], 1e5),
    ):
        if not abs(value) <= most:
            raise BadInput(file, what, f"{value:g}", f"from {-most:g} to {most:g}")


def _mercator(packet: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    """Metres east, north and up, of a packet's latitude, longitude (degrees) and altitude."""
    east = scale * EARTH_RADIUS * np.radians(packet[1])
    north = scale * EARTH_RADIUS * np.log(np.tan(np.pi / 4 + np.radians(packet[0]) / 2))
    return np.array([east, north, packet[2]])


def _turn(roll: float, pitch: float, yaw: float) -> NDArray[np.float64]:
    """IMU (x forward, y left, z up) to east, north, up; radians, yaw from the east."""
    (sr, cr), (sp, cp), (sy, cy) = ((np.sin(a), np.cos(a)) for a in (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def _times(
    drive: Path, folders: list[str], numbers: list[int]
) -> tuple[dict[int, float], list[str]]:
    """Seconds from the first stamp, by number: of one number all pictures are of one instant."""
    for name in folders:
        file = drive / name / "timestamps.txt"
        if file.is_file():
            stamps = _stamps(file)
            if all(number in stamps for number in numbers):
                return stamps, []
    note = "Without timestamps.txt of all pictures: times are the pictures' numbers."
    return {number: float(number) for number in numbers}, [note]


def _stamps(file: Path) -> dict[int, float]:
    start: datetime | None = None
    found = {}
    for row, line in enumerate(Table(file, _EXPECTED).lines):
        stamp = _STAMP.fullmatch(line)
        if stamp is None:
            if not line:
                continue
            raise BadInput(file, f"line {row + 1}", f'"{line}"', "2011-09-26 13:02:25.964389445")
        try:
            moment = datetime.fromisoformat(stamp[1])
        except ValueError:
            raise BadInput(file, f"line {row + 1}", f'"{line}"', "a date and a time") from None
        start = start or moment
        found[row] = (moment - start) / timedelta(seconds=1) + float(stamp[2] or 0)
    return found
