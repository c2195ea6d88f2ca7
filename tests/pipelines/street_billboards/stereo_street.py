"""A small street of exact depth to measure stereo on: road, walls, a crossing wall, poles.

Ray cast, four rays a pixel in each direction; walls and road show the photographs that come with
scikit-image. The car drives along +y, 2 m above the road.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass

import numpy as np
import skimage.data
from numpy.typing import NDArray
from open3d.t.geometry import RaycastingScene
from scipy.ndimage import gaussian_filter, map_coordinates

from pipelines.drawing.colour import decode_srgb, to_8bit
from pipelines.geometry.rays import build_scene, first_hits

BASELINE = 0.8
POLES = ((-3.6, 8.0), (3.3, 9.0), (-3.4, 12.0), (3.6, 14.5), (-3.7, 17.0), (3.5, 21.0))
POLE_RADIUS = 0.06
_RAYS = 4

_ROAD, _LEFT, _RIGHT, _END, _POLE, _BLOCK = range(6)


@dataclass(frozen=True)
class Frame:
    """c cameras' photographs with what is true in them."""

    photographs: NDArray[np.uint8]
    intrinsics: NDArray[np.float64]
    poses: NDArray[np.float64]
    depth: NDArray[np.float32]
    """(c, h, w), through the middles of the pixels, metres; nan for the sky."""
    pole: NDArray[np.bool_]
    """(c, h, w), where a pole stands."""


@functools.cache
def _street() -> tuple[RaycastingScene, NDArray[np.int64]]:
    corners: list[NDArray[np.float64]] = []
    kinds: list[int] = []

    def quad(a: tuple, b: tuple, c: tuple, d: tuple, kind: int) -> None:
        corners.append(np.array([a, b, c, a, c, d], dtype=float))
        kinds.extend([kind, kind])

    quad((-7, -20, 0), (7, -20, 0), (7, 45, 0), (-7, 45, 0), _ROAD)
    quad((-7, -20, 0), (-7, 45, 0), (-7, 45, 9), (-7, -20, 9), _LEFT)
    quad((7, -20, 0), (7, 20, 0), (7, 20, 6), (7, -20, 6), _RIGHT)
    quad((9, 20, 0), (9, 45, 0), (9, 45, 8), (9, 20, 8), _RIGHT)
    quad((7, 20, 0), (9, 20, 0), (9, 20, 6), (7, 20, 6), _RIGHT)
    quad((-7, 30, 0), (9, 30, 0), (9, 30, 5), (-7, 30, 5), _END)
    # A house that stands out: what faces the car, and its side.
    quad((4.6, 15.5, 0), (7, 15.5, 0), (7, 15.5, 3.5), (4.6, 15.5, 3.5), _BLOCK)
    quad((4.6, 15.5, 0), (4.6, 18, 0), (4.6, 18, 3.5), (4.6, 15.5, 3.5), _BLOCK)
    turns = np.linspace(0, 2 * np.pi, 13)
    ring = POLE_RADIUS * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    for x, y in POLES:
        for (a, b), (c, d) in itertools.pairwise(ring):
            quad((x + a, y + b, 0), (x + c, y + d, 0), (x + c, y + d, 5), (x + a, y + b, 5), _POLE)
    vertices = np.concatenate(corners)
    scene = build_scene(vertices, np.arange(len(vertices)).reshape(-1, 3))
    return scene, np.array(kinds)


@functools.cache
def _texture(name: str) -> NDArray[np.float64]:
    linear = decode_srgb(getattr(skimage.data, name)() / 255.0)
    # Half of the grain is as large as the pixels that show it.
    coarse = gaussian_filter(linear, 3, mode="wrap")
    return 0.6 * linear + 0.4 * coarse


def _painted(points: NDArray[np.float64], kind: NDArray[np.int64]) -> NDArray[np.float64]:
    """Linear colours (n, 3) of points (n, 3)."""
    x, y, z = points.T
    answer = np.zeros((len(points), 3))
    looks = (
        (_ROAD, "gravel", x, y, 0.006, (0.5, 0.5, 0.55)),
        (_LEFT, "brick", z, y, 0.007, (1.0, 0.7, 0.55)),
        (_RIGHT, "grass", z, y, 0.008, (0.9, 0.9, 0.6)),
        (_END, "camera", z, x, 0.012, (0.8, 0.8, 0.9)),
        (_BLOCK, "brick", z, x + y, 0.006, (0.6, 0.7, 0.9)),
        (_POLE, "gravel", z, x * 3, 0.004, (0.35, 0.3, 0.3)),
    )
    for which, name, down, across, metre, tint in looks:
        here = kind == which
        where = np.stack([-down[here] / metre, across[here] / metre])
        answer[here] = (
            map_coordinates(_texture(name), where, order=1, mode="grid-wrap")[:, None] * tint
        )
    # Windows: large dark shapes as facades have them.
    wall = (kind == _LEFT) | (kind == _RIGHT)
    window = wall & (np.mod(y, 2.6) > 1.5) & (np.mod(z, 3.0) > 1.2) & (np.mod(z, 3.0) < 2.6)
    answer[window] *= 0.25
    return answer


def intrinsics_of(width: int, height: int, field: float = 75.0) -> NDArray[np.float64]:
    """K of a camera of the given horizontal field of view in degrees."""
    focal = width / 2 / np.tan(np.radians(field) / 2)
    return np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])


def turned(x: float, y: float, z: float) -> NDArray[np.float64]:
    """A rotation (3, 3) by degrees about the camera's x, then y, then z."""
    answer = np.eye(3)
    for axis, angle in enumerate((x, y, z)):
        s, c = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        one = np.eye(3)
        one[i, i] = one[j, j] = c
        one[i, j], one[j, i] = -s, s
        answer = one @ answer
    return answer


_FORWARD = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # camera axes as columns


@functools.cache
def frame_at(
    y: float,
    width: int = 320,
    height: int = 200,
    *,
    crooked: bool = False,
    exposure: tuple[float, ...] = (1.0, 1.0, 1.0),
    heading: float = 0.0,
) -> Frame:
    """Three cameras when the car is at y; ``crooked``: each turned by a degree or two."""
    scene, kinds = _street()
    tilts = ((0.7, 1.1, -0.6), (-0.5, -0.3, 0.4), (0.3, -1.3, 0.9))
    poses = np.tile(np.eye(4), (3, 1, 1))
    spin = turned(0, heading, 0)
    for i in range(3):
        tilt = turned(*tilts[i]) if crooked else np.eye(3)
        poses[i, :3, :3] = _FORWARD @ spin @ tilt
        poses[i, :3, 3] = _FORWARD @ spin @ [(i - 1) * BASELINE, 0, 0] + [0.2, y, 2.0]
    lens = intrinsics_of(width, height)
    photographs = np.zeros((3, height, width, 3), np.uint8)
    depth = np.full((3, height, width), np.nan, np.float32)
    pole = np.zeros((3, height, width), bool)
    noise = np.random.default_rng(int(1000 * y))
    offsets = (np.arange(_RAYS) + 0.5) / _RAYS - 0.5
    for i in range(3):
        fine_x = (np.arange(width)[:, None] + offsets).ravel()
        fine_y = (np.arange(height)[:, None] + offsets).ravel()
        _, _, colour = _cast(scene, kinds, lens, poses[i], fine_x, fine_y, painted=True)
        colour = colour.reshape(height, _RAYS, width, _RAYS, 3).mean(axis=(1, 3)) * exposure[i]
        grain = noise.normal(0, 1.2, colour.shape)
        photographs[i] = np.clip(np.rint(to_8bit(colour) + grain), 0, 255)
        z, kind, _ = _cast(
            scene, kinds, lens, poses[i], np.arange(width), np.arange(height), painted=False
        )
        depth[i], pole[i] = z, kind == _POLE
    return Frame(photographs, np.tile(lens, (3, 1, 1)), poses, depth, pole)


def _cast(scene, kinds, lens, pose, across, down, *, painted):  # type: ignore[no-untyped-def]
    x = (across - lens[0, 2]) / lens[0, 0]
    y = (down - lens[1, 2]) / lens[1, 1]
    rays = np.stack([*np.broadcast_arrays(x[None, :], y[:, None]), np.ones((len(y), len(x)))], -1)
    ways = rays.reshape(-1, 3) @ pose[:3, :3].T
    hits = first_hits(scene, pose[:3, 3], ways)
    met = hits.triangle >= 0
    kind = np.where(met, kinds[hits.triangle], -1)
    colour = np.tile([0.45, 0.6, 0.9], (len(ways), 1))
    if painted:
        points = pose[:3, 3] + ways[met] * hits.distance[met, None]
        colour[met] = _painted(points, kind[met])
    depth = np.where(met, hits.distance, np.nan).astype(np.float32)
    return depth.reshape(rays.shape[:2]), kind.reshape(rays.shape[:2]), colour


def distances_to_street(points: NDArray[np.float64]) -> NDArray[np.float32]:
    """How far points (n, 3) are from the true surfaces, metres (n,)."""
    import open3d as o3d

    scene, _ = _street()
    queries = o3d.core.Tensor.from_numpy(np.ascontiguousarray(points, dtype=np.float32))
    return scene.compute_distance(queries).numpy()
