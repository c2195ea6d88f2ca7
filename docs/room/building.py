"""Surfaces of a room: boards, boxes, turned and draped things, each with its look."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

PLAIN, BOARDS, WOOD, PLASTER, RUG, WEAVE, PAINTING, SPINE, LEAF = range(9)
"""What varies a colour over a surface: see `patterns`."""


class Look(NamedTuple):
    """Of a surface: ``colour`` (linear sRGB albedo), ``pattern``, ``gloss`` (reflectance seen
    straight, 0 for matt), ``emission`` (radiance); ``thin``: light passes as it is reflected."""

    colour: tuple[float, float, float]
    pattern: int = PLAIN
    gloss: float = 0.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    thin: bool = False


class Surfaces(NamedTuple):
    """Triangles with what they look like, one row each.

    corners, normals (T, 3, 3): positions in metres and unit normals; uv (T, 3, 2): metres along
    the surface, u with the grain; colour, emission (T, 3); pattern, seed (T,) int64; gloss (T,);
    thin (T,) bool.
    """

    corners: FloatArray
    normals: FloatArray
    uv: FloatArray
    colour: FloatArray
    emission: FloatArray
    pattern: NDArray[np.int64]
    seed: NDArray[np.int64]
    gloss: FloatArray
    thin: NDArray[np.bool_]


class Builder:
    """Collects surfaces. ``step``: longest side of a piece, metres; light is one value a piece."""

    def __init__(self, step: float, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self._step = step
        self._grids: list[tuple[FloatArray, FloatArray, FloatArray, Look, int]] = []

    def surfaces(self) -> Surfaces:
        """All of them."""
        parts = [_grid_triangles(*grid) for grid in self._grids]
        return Surfaces(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def sheet(self, points: FloatArray, uv: FloatArray, look: Look) -> None:
        """A grid of points (m, n, 3) with smooth normals; uv (m, n, 2)."""
        down, right = np.gradient(points, axis=0), np.gradient(points, axis=1)
        normals = np.cross(right, down)
        # Where a grid shrinks to a point its rows beside tell the normal.
        for row, beside in ((0, 1), (-1, -2)):
            flat = np.linalg.norm(normals[row], axis=-1) < 1e-9
            normals[row][flat] = normals[beside][flat]
        normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
        self._grids.append((points, normals, uv, look, int(self.random.integers(1 << 30))))

    def quad(self, corner: ArrayLike, one: ArrayLike, other: ArrayLike, look: Look) -> None:
        """A rectangle from a corner along two sides; it faces one x other, grain along one."""
        start, u, v = (np.asarray(each, np.float64) for each in (corner, one, other))
        lengths = np.linalg.norm(u), np.linalg.norm(v)
        counts = [max(1, int(np.ceil(length / self._step))) for length in lengths]
        a, b = (np.linspace(0.0, 1.0, count + 1) for count in counts)
        points = start + a[None, :, None] * u + b[:, None, None] * v
        uv = np.stack(np.broadcast_arrays(a[None] * lengths[0], b[:, None] * lengths[1]), axis=-1)
        normals = np.broadcast_to(np.cross(u, v) / (lengths[0] * lengths[1]), points.shape)
        self._grids.append((points, normals, uv, look, int(self.random.integers(1 << 30))))

    def box(self, low: ArrayLike, high: ArrayLike, look: Look, turn: float = 0.0) -> None:
        """A box between two corners, turned about its upright middle by ``turn`` radians."""
        least, most = np.asarray(low, np.float64), np.asarray(high, np.float64)
        size, middle = most - least, (least + most) / 2
        cosine, sine = np.cos(turn), np.sin(turn)
        turned = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        for axis in range(3):
            one, other = (axis + 1) % 3, (axis + 2) % 3
            if size[one] < size[other]:
                one, other = other, one
            for side in (-1.0, 1.0):
                u, v = np.zeros(3), np.zeros(3)
                u[one], v[other] = size[one], size[other]
                outward = np.zeros(3)
                outward[axis] = side * size[axis] / 2
                if np.dot(np.cross(u, v), outward) < 0:
                    v = -v
                corner = outward - u / 2 - v / 2
                self.quad(corner @ turned + middle, u @ turned, v @ turned, look)

    def wall(
        self,
        corner: ArrayLike,
        one: ArrayLike,
        other: ArrayLike,
        look: Look,
        holes: Sequence[_Hole],
    ) -> None:
        """A rectangle with rectangular holes, (low, high) along each side in metres."""
        start, u, v = (np.asarray(each, np.float64) for each in (corner, one, other))
        lengths = float(np.linalg.norm(u)), float(np.linalg.norm(v))
        cuts = [
            sorted({0.0, lengths[axis], *(edge for hole in holes for edge in hole[axis])})
            for axis in range(2)
        ]
        for left, right in zip(cuts[0], cuts[0][1:], strict=False):
            for low, high in zip(cuts[1], cuts[1][1:], strict=False):
                middle = (left + right) / 2, (low + high) / 2
                if any(
                    h[0][0] < middle[0] < h[0][1] and h[1][0] < middle[1] < h[1][1] for h in holes
                ):
                    continue
                at = start + u * (left / lengths[0]) + v * (low / lengths[1])
                self.quad(
                    at, u * ((right - left) / lengths[0]), v * ((high - low) / lengths[1]), look
                )

    def turned(
        self, profile: Sequence[tuple[float, float]], centre: ArrayLike, look: Look, count: int = 24
    ) -> None:
        """What a lathe makes of radii and heights, from its bottom up, around an upright axis."""
        radius, height = np.array(profile, np.float64).T
        angle = np.linspace(0.0, 2.0 * np.pi, count + 1)
        ring = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
        points = radius[:, None, None] * ring + height[:, None, None] * np.array([0.0, 0.0, 1.0])
        along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(radius), np.diff(height)))])
        uv = np.stack(np.broadcast_arrays(angle[None] * radius.max(), along[:, None]), axis=-1)
        self.sheet(points + np.asarray(centre, np.float64), uv, look)

    def ball(self, centre: ArrayLike, radius: float, look: Look) -> None:
        """A sphere."""
        theta = np.linspace(-np.pi / 2, np.pi / 2, 13)
        profile = [(max(radius * np.cos(t), 0.0), radius * np.sin(t)) for t in theta]
        self.turned(profile, centre, look)


_Hole = tuple[tuple[float, float], tuple[float, float]]


def _grid_triangles(
    points: FloatArray, normals: FloatArray, uv: FloatArray, look: Look, seed: int
) -> Surfaces:
    rows, columns = points.shape[:2]
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    corners = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    placed = points.reshape(-1, 3)[corners]
    area = np.linalg.norm(
        np.cross(placed[:, 1] - placed[:, 0], placed[:, 2] - placed[:, 0]), axis=1
    )
    corners, placed = corners[area > 1e-12], placed[area > 1e-12]
    count = len(corners)
    return Surfaces(
        placed,
        normals.reshape(-1, 3)[corners],
        uv.reshape(-1, 2)[corners],
        np.tile(look.colour, (count, 1)),
        np.tile(look.emission, (count, 1)),
        np.full(count, look.pattern),
        np.full(count, seed),
        np.full(count, look.gloss),
        np.full(count, look.thin),
    )
