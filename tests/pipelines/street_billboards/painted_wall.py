"""A painted wall before cameras, with a pole or an end, and exact depth: all in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.street_billboards.billboards import OVERLAP, Billboards
from pipelines.street_billboards.textures.photographs import Photographs
from tests.pipelines.street_billboards.compressed_street import placed_camera

FloatArray = NDArray[np.float64]

VOXEL = 1.0
FAN = 30
"""Around the direction -y, in which the cameras stand."""
POLE = (200, 10, 10)
IDENTITY = np.tile(np.arange(256, dtype=np.uint8)[:, None], (1, 3))


def painting(points: FloatArray) -> FloatArray:
    """Codes (…, 3) of points on the wall y = 0; nowhere like the pole's."""
    x, z = points[..., 0], points[..., 2]
    return np.stack(
        [60 + 30 * np.sin(3 * x + 1), 140 + 60 * np.sin(2 * x - z), 150 + 70 * np.cos(3 * z)],
        axis=-1,
    )


@dataclass(frozen=True)
class Scene:
    """The wall y = 0 up to x = ``end``; a vertical pole (x, y, radius) before it."""

    end: float = np.inf
    pole: tuple[float, float, float] | None = None

    def seen(
        self, lens: FloatArray, pose: FloatArray, width: int, height: int
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.bool_]]:
        """Codes (y, x, 3), depth (y, x) in m, inf beside the wall; where the pole is."""
        y, x = np.mgrid[:height, :width]
        rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(lens).T
        rays = rays @ pose[:3, :3].T
        eye = pose[:3, 3]
        depth = -eye[1] / rays[..., 1]
        points = eye + rays * depth[..., None]
        codes = np.rint(painting(points))
        open_air = points[..., 0] > self.end
        depth[open_air] = np.inf
        codes[open_air] = (240, 245, 250)
        is_pole = np.zeros(depth.shape, bool)
        if self.pole is not None:
            offset = eye[:2] - self.pole[:2]
            a = (rays[..., :2] ** 2).sum(axis=-1)
            b = rays[..., :2] @ offset
            root = b**2 - a * (offset @ offset - self.pole[2] ** 2)
            near = (-b - np.sqrt(np.maximum(root, 0))) / a
            is_pole = (root > 0) & (near > 0) & (near < depth)
            depth = np.where(is_pole, near, depth)
            codes[is_pole] = POLE
        return codes.astype(np.uint8), depth.astype(np.float32), is_pole

    def photographs(
        self,
        spots: ArrayLike,
        *,
        focal: float = 120.0,
        size: tuple[int, int] = (96, 80),
        target: ArrayLike = (0.0, 0.0, 0.0),
        deviation: float = 0.02,
    ) -> Photographs:
        """Cameras at places (k, 3) that look at ``target``."""
        made = [placed_camera(spot, target, size, focal) for spot in np.asarray(spots)]
        shots = [self.seen(lens, pose, *size) for lens, pose in made]
        depth = np.stack([shot[1] for shot in shots])
        return Photographs(
            np.stack([shot[0] for shot in shots]),
            depth,
            np.full(depth.shape, deviation, np.float32),
            np.stack([one[0] for one in made]),
            np.stack([one[1] for one in made]),
            np.tile(IDENTITY, (len(made), 1, 1)),
        )


def on_the_wall(centres: ArrayLike = ((0.0, 0.0, 0.0),), *, turns: bool = False) -> Billboards:
    """A square in the wall for each voxel, or one that turns."""
    centre = np.asarray(centres, np.float64)
    half = VOXEL * (0.5 + OVERLAP) * (np.sqrt(3.0) if turns else 1.0)
    return Billboards(
        centre,
        centre,
        np.full(len(centre), turns),
        np.tile(np.array([half, 0, 0], np.float32), (len(centre), 1)),
        np.tile(np.array([0, 0, half], np.float32), (len(centre), 1)),
        np.full(len(centre), FAN, np.int32),
    )


def texel_points(billboards: Billboards, number: int) -> FloatArray:
    """World points (32, 32, 3) of the texels of one that stands still."""
    steps = (np.arange(32) + 0.5) / 16 - 1
    s, t = np.meshgrid(steps, -steps)
    return (
        billboards.centre[number]
        + s[..., None] * billboards.half_s[number]
        + t[..., None] * billboards.half_t[number]
    )
