"""KITTI's rectified cameras: pictures numbered in folders, and 3 x 4 projections of them all."""

from __future__ import annotations

import os
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.drives.headers import ENDINGS, photograph_size
from storage.readers.drives.motions import place, rigid
from storage.readers.drives.recordings import (
    MOST_FRAMES,
    Lens,
    check_count,
    check_lens,
    pinhole_lens,
)

Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From a camera's axes (x right, y down, z forward) to x right, y forward, z up."""


class RectifiedCamera(NamedTuple):
    """``offset`` (4, 4): camera to the first camera; all look the same way."""

    lens: Lens
    offset: NDArray[np.float64]


def numbered_pictures(folder: Path) -> dict[int, Path]:
    """The pictures of a folder by the number in their names, what is named otherwise left out."""
    if not folder.is_dir():
        return {}
    found = {}
    with os.scandir(folder) as entries:
        # A folder may hold anything, without an end.
        for entry in islice(entries, 4 * MOST_FRAMES):
            stem, ending = os.path.splitext(entry.name)
            if ending.lower() in ENDINGS and stem.isdecimal() and len(stem) <= 12:
                found[int(stem)] = folder / entry.name
    check_count(folder, len(found))
    return dict(sorted(found.items()))


def rectified_camera(
    file: Path, label: str, projection: NDArray[np.float64], pictures: Mapping[int, Path]
) -> RectifiedCamera:
    """A camera by its projection K [I | t], (3, 4): points in the first camera's axes to pixels,
    the middle of the first pixel at (0, 0).

    Raises BadInput for a matrix of another form and for a lens that cannot be one.
    """
    k, shift = projection[:, :3], projection[:, 3]
    shape = (k[0, 1], k[1, 0], k[2, 0], k[2, 1])
    if any(shape) or k[2, 2] != 1 or not (k[0, 0] > 0 and k[1, 1] > 0):
        expected = "the projection fx 0 cx tx, 0 fy cy ty, 0 0 1 tz"
        raise BadInput(file, label, "of another form", expected)
    size = photograph_size(next(iter(pictures.values())))
    lens = pinhole_lens(k, *size)
    check_lens(file, lens, lambda key: f"{key} of {label}")
    where = place(file, label, -np.linalg.inv(k) @ shift)
    return RectifiedCamera(lens, rigid(np.eye(3), where))
