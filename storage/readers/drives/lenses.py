"""Photographs of any lens as a pinhole would have taken them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.drives.headers import check_size
from storage.readers.drives.recordings import FISHEYE, PANORAMA, PINHOLE, Frame, Lens

AZIMUTHS = (0, 90, 180, 270)
"""Degrees to the right, of the views that a panorama is cut into; each is 90 degrees wide."""


def pinhole_of(lens: Lens) -> tuple[NDArray[np.float64], int, int]:
    """K (3, 3) and the size in pixels of the picture that stands for a photograph: of a pinhole and
    of a fisheye the same focal lengths, principal point and size; of a panorama a square with as
    many pixels a radian in its middle."""
    if lens.model == PANORAMA:
        side = max(round(lens.w / np.pi), 2)
        middle = (side - 1) / 2
        return np.array([[side / 2, 0, middle], [0, side / 2, middle], [0, 0, 1]]), side, side
    return np.array([[lens.fl_x, 0, lens.cx], [0, lens.fl_y, lens.cy], [0, 0, 1]]), lens.w, lens.h


def fitted_lens(photograph: Path, lens: Lens, size: tuple[int, int]) -> Lens:
    """The lens of a photograph of another ``size`` (width, height) than it says: scaled, where the
    shape is the same to a pixel. Raises BadInput for another shape."""
    if size == (lens.w, lens.h):
        return lens
    cut = size[0] == lens.w or size[1] == lens.h
    if cut or abs(size[0] * lens.h - size[1] * lens.w) > max(lens.w, lens.h):
        check_size(photograph, size, (lens.w, lens.h))
    across, down = size[0] / lens.w, size[1] / lens.h
    centre = (lens.cx + 0.5) * across - 0.5, (lens.cy + 0.5) * down - 0.5
    focal = lens.fl_x * across, lens.fl_y * down
    return Lens(lens.model, *size, *focal, *centre, lens.coefficients, lens.azimuth)


def panorama_views(frame: Frame) -> list[Frame]:
    """A panorama as the photographs of four cameras at its place; any other one as it is."""
    if frame.lens is None or frame.lens.model != PANORAMA:
        return [frame]
    views = []
    for azimuth in AZIMUTHS:
        pose = frame.pose
        if pose is not None:
            pose = pose.copy()
            pose[:3, :3] = pose[:3, :3] @ _to_the_right(azimuth)
        lens = frame.lens._replace(azimuth=float(azimuth))
        name = f"{frame.camera}-{azimuth:03d}"
        views.append(frame._replace(camera=name, pose=pose, lens=lens))
    return views


def as_pinhole(
    codes: NDArray[Any],
    lens: Lens,
    intrinsics: NDArray[np.float64],
    width: int,
    height: int,
    *,
    nearest: bool = False,
) -> NDArray[Any]:
    """A photograph (h, w, channels), uint8 or uint16, as a pinhole of K ``intrinsics`` takes it:
    (height, width, channels), looked up between pixels or at the ``nearest`` one, black outside of
    what was photographed. What has that K, that size and no distortion comes back as it is.
    """
    own, *size = pinhole_of(lens)
    same = size == [width, height] and np.array_equal(own, intrinsics, equal_nan=True)
    if lens.model == PINHOLE and same and not any(lens.coefficients):
        return codes
    import cv2

    across, down = _places(lens, intrinsics, width, height)
    wraps = lens.model == PANORAMA
    seen = cv2.remap(
        np.ascontiguousarray(codes),
        across,
        down,
        cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_WRAP if wraps else cv2.BORDER_CONSTANT,
    )
    # OpenCV leaves out the last axis of a grey picture.
    return seen.reshape(height, width, codes.shape[2])


def _places(
    lens: Lens, intrinsics: NDArray[np.float64], width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Where the photograph has each pixel of the pinhole's picture: (height, width) twice."""
    import cv2

    if lens.model == PANORAMA:
        return _panorama_places(lens, intrinsics, width, height)
    own, _, _ = pinhole_of(lens)
    coefficients = np.array(lens.coefficients or (0.0, 0.0, 0.0, 0.0))
    room: Any = cv2.fisheye if lens.model == FISHEYE else cv2
    across, down = room.initUndistortRectifyMap(
        own, coefficients, np.eye(3), intrinsics, (width, height), cv2.CV_32FC1
    )
    return across, down


def _panorama_places(
    lens: Lens, intrinsics: NDArray[np.float64], width: int, height: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    right = (np.arange(width) - intrinsics[0, 2]) / intrinsics[0, 0]
    below = (np.arange(height) - intrinsics[1, 2]) / intrinsics[1, 1]
    longitude = np.arctan(right) + np.radians(lens.azimuth)
    latitude = np.arctan2(below[:, None], np.hypot(right, 1))
    across = (longitude / (2 * np.pi) + 0.5) * lens.w - 0.5
    down = (latitude / np.pi + 0.5) * lens.h - 0.5
    across = np.broadcast_to(across.astype(np.float32), (height, width))
    return np.ascontiguousarray(across), down.astype(np.float32)


def _to_the_right(azimuth: float) -> NDArray[np.float64]:
    """Axes (columns) of a camera that is turned to the right, y being down."""
    sine, cosine = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    return np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
