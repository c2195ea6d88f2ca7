"""`Drive`: what a street is built from, in arrays, whatever the files were."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.drives.recordings import Lens
from storage.readers.films import Film


class Drive(NamedTuple):
    """c cameras on one car, f instants.

    file: the file that the drive is known by.
    cameras: names, from left to right along the rig's own x axis at the first instant.
    width, height: pixels, of the largest photographs; smaller ones have black to their right and
        below, so that K stays as it is.
    intrinsics: (c, 3, 3) float64, K in pixels, the middle of the first pixel at (0, 0); NaN where
        nothing is known of a lens.
    poses: (f, c, 4, 4) float64, camera to world; the camera's axes are OpenCV's: x right, y down,
        z forward. Of a camera that is absent: where it would be by the rig. All are NaN where the
        files have no poses.
    times: (f,) float64, rising; in the file's unit.
    files: f tuples of c photographs, None where there is none.
    present: (f, c) bool; a photograph that is not there is black.
    sizes: (c, 2) int64, width and height of each camera's own pictures.
    lenses: f tuples of c, how each photograph came about, None where it is not there.
    masks: f tuples of c files, None where a photograph has none.
    points: (n, 3) float64, the points that the poses were found with, where the files have them.
    film: what the photographs are frames of, None where they are files.
    places: (f, 3) float64, degrees north and east and metres above the sea; NaN: not known.
    metric: the unit of length is known to be the metre.
    up_known: the world's z is known to point up.
    notes: sentences about how the files were read.
    """

    file: Path
    cameras: tuple[str, ...]
    width: int
    height: int
    intrinsics: NDArray[np.float64]
    poses: NDArray[np.float64]
    times: NDArray[np.float64]
    files: tuple[tuple[Path | None, ...], ...]
    present: NDArray[np.bool_]
    sizes: NDArray[np.int64]
    lenses: tuple[tuple[Lens | None, ...], ...]
    masks: tuple[tuple[Path | None, ...], ...]
    points: NDArray[np.float64]
    film: Film | None
    places: NDArray[np.float64]
    metric: bool = False
    up_known: bool = False
    notes: tuple[str, ...] = ()

    @property
    def distortion(self) -> NDArray[np.float64]:
        """(c, 5) float64, OpenCV's k1, k2, p1, p2, k3 of each camera's first photograph; of a
        fisheye k1 to k4 and 0, which mean something else: see ``lenses``."""
        found = np.zeros((len(self.cameras), 5))
        for camera in range(len(self.cameras)):
            lens = next((row[camera] for row in self.lenses if row[camera] is not None), None)
            coefficients = lens.coefficients if lens else ()
            found[camera, : len(coefficients)] = coefficients
        return found
