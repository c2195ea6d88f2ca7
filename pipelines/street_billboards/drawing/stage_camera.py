"""The stage's camera that sees what a photograph's camera saw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera


def stage_camera(
    intrinsics: NDArray[np.floating], to_world: NDArray[np.floating], height: int
) -> Camera:
    """The stage's camera that takes the photograph of a camera (K (3, 3), to_world (4, 4)).

    height: of the photograph, in pixels; the stage has to be as wide as it. Raises ValueError for
    pixels that are not square and a principal point that is not in the picture's middle.
    """
    across, down = float(intrinsics[0, 0]), float(intrinsics[1, 1])
    if abs(across - down) > 1e-6 * down:
        raise ValueError(f"intrinsics: found focal lengths {across} and {down}; expected equal.")
    check_middle("row", float(intrinsics[1, 2]), height)
    place, forward, up = to_world[:3, 3], to_world[:3, 2], -to_world[:3, 1]
    x, y, z = (float(value) for value in place)
    target_x, target_y, target_z = (float(value) for value in place + forward)
    up_x, up_y, up_z = (float(value) for value in up)
    return Camera(
        position=(x, y, z),
        target=(target_x, target_y, target_z),
        up=(up_x, up_y, up_z),
        view_angle=float(np.degrees(2 * np.arctan(height / 2 / down))),
    )


def check_middle(name: str, found: float, count: int) -> None:
    """Raises ValueError unless the principal point is in the middle of ``count`` rows or columns.

    name: row or column. found: where the principal point is, in pixels.
    """
    if abs(found - (count - 1) / 2) > 1e-3:
        raise ValueError(
            f"intrinsics: the principal point is in {name} {found}; expected "
            f"{(count - 1) / 2}, the middle of {count}."
        )
