"""Folders of photographs without poses: one camera, in the order of their names."""

from __future__ import annotations

import re
from collections import Counter
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.exif_cameras import ExifCamera, read_exif_camera
from storage.readers.gpx_files import places_at, read_gpx
from storage.readers.photographs import SUFFIXES
from storage.readers.pictures.image_decoding import decode_image
from storage.readers.pictures.srgb_curve import srgb_of_light

FEWEST = 8
_MOST = 100_000
_PHOTOGRAPHS = "a folder of photographs (PNG, JPEG, TIFF, WebP, AVIF, BMP)"
_ALIKE = 0.02
"""How much focal lengths of one lens may differ."""


class PhotographFolder(NamedTuple):
    """n photographs of one size.

    files: in the order of their names, numbers in them by their values.
    width, height: pixels, upright.
    times: (n,) float64, seconds since 1970 (EXIF; UTC where it says no zone); nan: not said.
    places: (n, 3) float64, degrees north, degrees east, metres above the sea, by EXIF's GPS or a
    GPX file in the folder; nan: not said.
    focal, focal_deviation: pixels, by EXIF; nan: not said.
    notes: sentences on what was left out, and on what it lacks.
    """

    folder: Path
    files: tuple[Path, ...]
    width: int
    height: int
    times: NDArray[np.float64]
    places: NDArray[np.float64]
    focal: float
    focal_deviation: float
    notes: tuple[str, ...]


def read_photograph_folder(path: str | PathLike[str]) -> PhotographFolder:
    """Look at a folder of photographs; only their heads are read.

    The photographs of the most frequent size are kept, and others left out with a note, as are
    those whose head is broken. Hidden files and what has no photograph's ending are not looked at.

    Raises BadInput for a folder that is missing or a file, and for fewer than 8 photographs.
    """
    folder = Path(path)
    if not folder.is_dir():
        found = "a file" if folder.exists() else "missing"
        raise BadInput(folder, "photographs", found, _PHOTOGRAPHS)
    found_files = sorted(
        (
            file
            for file in folder.iterdir()
            if file.suffix.lower() in SUFFIXES and not file.name.startswith(".") and file.is_file()
        ),
        key=_natural,
    )
    if len(found_files) > _MOST:
        raise BadInput(folder, "number of photographs", f"{len(found_files)}", f"at most {_MOST}")
    rows: list[tuple[Path, ExifCamera]] = []
    notes: list[str] = []
    for file in found_files:
        try:
            rows.append((file, read_exif_camera(file)))
        except BadInput as error:
            notes.append(f"Left out: {error}")
    size, kept = _of_one_size(rows, notes)
    if len(kept) < FEWEST:
        raise BadInput(folder, "number of photographs", f"{len(kept)}", f"at least {FEWEST}")
    cameras = [camera for _, camera in kept]
    focal, deviation = _one_focal([camera.focal for camera in cameras], cameras, notes)
    times = np.array([np.nan if c.time is None else c.time for c in cameras])
    unknown = (np.nan, np.nan, np.nan)
    places = np.array([unknown if c.place is None else c.place for c in cameras])
    places = _by_track(folder, times, places, notes)
    files = tuple(file for file, _ in kept)
    return PhotographFolder(folder, files, *size, times, places, focal, deviation, tuple(notes))


def read_folder_photograph(photographs: PhotographFolder, number: int) -> NDArray[np.uint8]:
    """One photograph: (height, width, 3) uint8, RGB codes of sRGB, upright.

    Raises BadInput as ``decode_image`` does and for another size than when the folder was read,
    IndexError for a photograph that is not there.
    """
    file = photographs.files[number]
    colours = decode_image(file).colours
    if colours.shape[:2] != (photographs.height, photographs.width):
        found = f"{colours.shape[1]} x {colours.shape[0]} pixels"
        expected = f"{photographs.width} x {photographs.height} pixels as the others"
        raise BadInput(file, "size", found, expected)
    if colours.dtype.kind == "f":
        colours = np.rint(255 * srgb_of_light(np.clip(colours, 0, 1))).astype(np.uint8)
    elif colours.dtype != np.uint8:
        most = int(np.iinfo(colours.dtype).max)
        colours = ((colours.astype(np.uint64) * 255 + most // 2) // most).astype(np.uint8)
    return np.ascontiguousarray(np.broadcast_to(colours, (*colours.shape[:2], 3)))


def _natural(file: Path) -> list[tuple[int, int, str]]:
    """Sorts img9 before img10; a name's digits count as a number."""
    parts = re.findall(r"\d+|\D+", file.name)
    return [(0, int(part), part) if part.isdecimal() else (1, 0, part.lower()) for part in parts]


def _of_one_size(
    rows: list[tuple[Path, ExifCamera]], notes: list[str]
) -> tuple[tuple[int, int], list[tuple[Path, ExifCamera]]]:
    sizes = Counter((camera.width, camera.height) for _, camera in rows)
    if not sizes:
        return (0, 0), []
    size, count = sizes.most_common(1)[0]
    if count < len(rows):
        notes.append(
            f"{len(rows) - count} photograph(s) that are not of {size[0]} x {size[1]} pixels "
            "as most were left out."
        )
    return size, [row for row in rows if (row[1].width, row[1].height) == size]


def _one_focal(
    focals: list[float], cameras: list[ExifCamera], notes: list[str]
) -> tuple[float, float]:
    """The focal length that photographs say; what zooms has none."""
    said = np.array(focals)[np.isfinite(focals)]
    if not said.size:
        notes.append("No focal length in EXIF: it has to be found or given.")
        return float("nan"), float("nan")
    middle = float(np.median(said))
    alike = np.abs(said / middle - 1) <= _ALIKE
    if not alike.all():
        least, most = said.min(), said.max()
        notes.append(
            f"Focal lengths of {least:.0f} to {most:.0f} pixels in EXIF: it zoomed, or there are "
            "two cameras. The median is taken for all."
        )
    deviations = [camera.focal_deviation for camera in cameras if np.isfinite(camera.focal)]
    return middle, max(float(np.median(deviations)), float(said.std()))


def _by_track(
    folder: Path, times: NDArray[np.float64], places: NDArray[np.float64], notes: list[str]
) -> NDArray[np.float64]:
    """Places with those of a GPX file in the folder put where EXIF has none."""
    tracks = sorted(file for file in folder.iterdir() if file.suffix.lower() == ".gpx")
    if not tracks:
        return places
    try:
        found = places_at(read_gpx(tracks[0]), times)
    except BadInput as error:
        notes.append(f"Left out: {error}")
        return places
    if not np.isfinite(found[:, 0]).any():
        name = shortened(tracks[0].name, 40)
        notes.append(f"{name} says nothing of the times of the photographs.")
    return np.where(np.isfinite(places[:, :1]), places, found)
