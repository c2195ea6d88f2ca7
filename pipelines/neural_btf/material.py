"""What a surface can be made of: a compressed BTF, measured photographs, one matt colour."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, stereographic, stereographic_of_vectors, unit_vectors
from pipelines.neural_btf.surface_lookup import dimming, held_directions

_GHOSTS = 12
_GHOST_RADIUS = 2.0
_BLOCK = 1 << 16


class Material(Protocol):
    """What has a radiance anywhere, under any light."""

    def radiance_at(
        self,
        places: NDArray[np.floating],
        light: NDArray[np.floating],
        view: NDArray[np.floating],
        footprint: NDArray[np.floating] | None = None,
    ) -> NDArray[np.float32]:
        """Radiance (n, 3) at places (n, 2) in tiles, for unit vectors (n, 3) to light and view.

        Under a directional light that would give a white Lambertian surface the cosine of its
        angle: pi times the BRDF and the cosine. ``footprint`` (n,): width of a pixel there, in
        tiles; None: what is finest.
        """


def surface_radiance(
    material: Material,
    places: NDArray[np.floating],
    light: NDArray[np.float64],
    view: NDArray[np.float64],
    footprint: NDArray[np.floating] | None = None,
) -> NDArray[np.float32]:
    """`Material.radiance_at` for all directions: held and dimmed where nothing is measured.

    >>> up, low = np.array([[0.0, 0.0, 1.0]]), np.array([[0.995, 0.0, 0.1]])
    >>> surface_radiance(FlatColour((0.5, 0.5, 0.5)), np.zeros((1, 2)), low, up).round(3).tolist()
    [[0.05000000074505806, 0.05000000074505806, 0.05000000074505806]]
    """
    found = material.radiance_at(places, held_directions(light), held_directions(view), footprint)
    return np.maximum(found, 0.0) * dimming(light[:, 2])[:, None].astype(np.float32)


class FlatColour:
    """A matt surface of one colour: what a picture of a BTF shows where nothing of it is known."""

    def __init__(self, albedo: tuple[float, float, float] | NDArray[np.floating]) -> None:
        self.albedo = np.asarray(albedo, np.float32)

    def radiance_at(
        self,
        places: NDArray[np.floating],
        light: NDArray[np.floating],
        view: NDArray[np.floating],
        footprint: NDArray[np.floating] | None = None,
    ) -> NDArray[np.float32]:
        """The albedo (3,) times the light's cosine."""
        return light[:, 2:].astype(np.float32) * self.albedo


class MeasuredBtf:
    """Photographs as they were measured: the raw BTF.

    Bilinear between texels; barycentric between measured directions, in the Delaunay triangulation
    of their places on the stereographic plane. Beyond the outermost ones the nearest count.
    """

    def __init__(self, images: NDArray[Any], pairs: Pairs) -> None:
        """``images`` (image, y, x, 3) radiance; ``pairs`` every view with every light, numbered
        view * lights + light. Raises ValueError for pairs that are not."""
        lights = int(np.all(pairs.view == pairs.view[0], axis=1).sum())
        views = len(pairs.view) // lights
        light = pairs.light[:lights]
        if views * lights != len(pairs.view) or not np.array_equal(
            np.tile(light, (views, 1)), pairs.light
        ):
            raise ValueError(
                f"pairs: found {len(pairs.view)} photographs, {lights} of the first view; "
                "expected the same lights for every view."
            )
        self._images = images
        self._lights = lights
        self._light = _Directions(light)
        self._view = _Directions(pairs.view[::lights])

    def radiance_at(
        self,
        places: NDArray[np.floating],
        light: NDArray[np.floating],
        view: NDArray[np.floating],
        footprint: NDArray[np.floating] | None = None,
    ) -> NDArray[np.float32]:
        """As `Material.radiance_at`; the footprint is not looked at."""
        result = np.zeros((len(places), 3), np.float32)
        for start in range(0, len(places), _BLOCK):
            part = slice(start, start + _BLOCK)
            seen, view_weight = self._view.around(view[part])
            lit, light_weight = self._light.around(light[part])
            pairs = seen[:, :, None] * self._lights + lit[:, None, :]
            weights = view_weight[:, :, None] * light_weight[:, None, :]
            for row, column, share in self._texels(places[part]):
                for i in range(9):
                    values = self._images[pairs[:, i // 3, i % 3], row, column]
                    weight = (weights[:, i // 3, i % 3] * share).astype(np.float32)
                    result[part] += weight[:, None] * values.astype(np.float32)
        return result

    def _texels(
        self, places: NDArray[np.floating]
    ) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]]:
        """Row, column and weight of the four texels around places (n, 2); row 0 is at v = 1."""
        height, width = self._images.shape[1:3]
        x = np.asarray(places[:, 0], np.float64) * width - 0.5
        y = -np.asarray(places[:, 1], np.float64) * height - 0.5
        left, top = np.floor(x), np.floor(y)
        for down in (0, 1):
            for right in (0, 1):
                share = np.abs(1 - right - (x - left)) * np.abs(1 - down - (y - top))
                row, column = (top + down).astype(np.int64), (left + right).astype(np.int64)
                yield row % height, column % width, share


class _Directions:
    """Measured directions (n, 2), and which of them are around another one."""

    def __init__(self, directions: NDArray[np.float64]) -> None:
        from scipy.spatial import Delaunay

        # A ring outside of all, each point of it a copy of the nearest direction: so every
        # direction is in a triangle, be there as few measured ones as there may.
        angle = np.arange(_GHOSTS) * (2 * math.pi / _GHOSTS)
        ghosts = _GHOST_RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        places = stereographic(directions)
        away = np.linalg.norm(ghosts[:, None] - places, axis=-1)
        self._own = np.concatenate([np.arange(len(directions)), away.argmin(axis=1)])
        self._net = Delaunay(np.concatenate([places, ghosts]))

    def around(
        self, vectors: NDArray[np.floating]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Numbers (m, 3) of three directions around unit vectors (m, 3), and their weights."""
        points = stereographic_of_vectors(vectors)
        triangle = self._net.find_simplex(points)
        turn = self._net.transform[triangle]
        first = np.einsum("nij,nj->ni", turn[:, :2], points - turn[:, 2])
        weights = np.concatenate([first, 1 - first.sum(axis=1, keepdims=True)], axis=1)
        return self._own[self._net.simplices[triangle]], weights


def mean_colour(images: NDArray[Any], pairs: Pairs) -> FlatColour:
    """The matt colour nearest to photographs (image, y, x, 3), by least squares."""
    cosine = unit_vectors(pairs.light)[:, 2]
    means = np.stack([image.mean(axis=(0, 1), dtype=np.float64) for image in images])
    return FlatColour((cosine @ means) / (cosine @ cosine))
