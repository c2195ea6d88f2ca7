"""Some of the photographs as one AVIF picture, the others interpolated between their directions.

Measured on knit: at equal bytes AVIF (10 bits, 4:4:4) has two thirds of JPEG XL's squared error or
less, a mosaic of all photographs is as good as an AVIF sequence that predicts one from the other,
and full resolution of colour is better than half.
"""

from __future__ import annotations

import functools
import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.btf_rivals.budget import filled
from benchmarks.btf_rivals.rival import MeasuredBtf, Rival
from pipelines.drawing.colour import decode_srgb, encode_srgb
from pipelines.light.directions import stereographic, unit_vectors

_COUNTS = (1, 2, 3, 4, 5, 7, 9, 11, 13, 16, 20, 25, 32)
"""Views, and lights, that a search tries."""
_LARGEST_CODE = 1023
_SPEED = 7
_TRIED = 2
_SPARSE = 10
"""Of ten trial texels one is enough to know an error of interpolation."""
_LEVEL = 40.0
"""AVIF's quality, of 100, where the search begins."""


class _Grid(NamedTuple):
    """Photographs that are kept, and what makes all others of them."""

    views: NDArray[np.int64]
    lights: NDArray[np.int64]
    of_view: NDArray[np.float32]
    """(V, kept views), rows add up to 1."""
    of_light: NDArray[np.float32]

    @property
    def kept(self) -> int:
        """Photographs."""
        return len(self.views) * len(self.lights)

    @property
    def images(self) -> NDArray[np.int64]:
        """Numbers (view, light) of the photographs."""
        found: NDArray[np.int64] = self.views[:, None] * len(self.of_light) + self.lights
        return found

    def interpolated(self, kept: NDArray[np.float32]) -> NDArray[np.float32]:
        """ABRDFs (texel, image, 3) of those in kept photographs (texel, view, light, 3)."""
        found = np.einsum("vi,tijc,lj->tvlc", self.of_view, kept, self.of_light, optimize=True)
        return found.reshape(len(kept), -1, 3).astype(np.float32, copy=False)


class _Picture(NamedTuple):
    bytes: int
    decoded: NDArray[np.float32]
    """(texel, view, light, 3), radiance."""
    quality: int


def photographs(measured: MeasuredBtf, budget: int) -> Rival:
    """The best number of photographs and quality for ``budget`` bytes.

    Photographs are encoded in sRGB over the largest value. Three grids of views x lights are really
    coded: those that are best by their error of interpolation and an estimated error of coding.
    Raises ValueError where the budget is too small for any.
    """
    best: tuple[float, _Grid, _Picture] | None = None
    for grid in _promising(measured, budget):
        picture = filled(functools.partial(_coded, measured, grid), budget, 1.0)
        if picture is None:
            continue
        error = measured.trial_error(grid.interpolated(picture.decoded[measured.trial_texels]))
        if best is None or error < best[0]:
            best = error, grid, picture
    if best is None:
        raise ValueError(f"{budget} bytes are too few for photographs; give it more.")
    _, grid, picture = best

    def restore(first: int, last: int) -> NDArray[np.float32]:
        return grid.interpolated(picture.decoded[first:last])

    settings = {
        "views": len(grid.views),
        "lights": len(grid.lights),
        "quality": picture.quality,
        "codec": "AVIF",
    }
    return Rival("photographs", picture.bytes, settings, restore, by_texel=False)


def _promising(measured: MeasuredBtf, budget: int) -> list[_Grid]:
    """The grids with the least estimated error."""
    alone = _grid(measured, min(7, len(measured.views)), min(7, len(measured.lights)))
    seen = [_coded(measured, alone, step) for step in (0.7, 2.0)]
    wanted = _kept(measured, alone)
    bytes_each = [math.log(picture.bytes / alone.kept) for picture in seen]
    squares = [math.log(np.mean((p.decoded - wanted) ** 2) + 1e-12) for p in seen]
    slope = (squares[1] - squares[0]) / min(bytes_each[1] - bytes_each[0], -1e-3)
    few = measured.trial_abrdfs[::_SPARSE]
    estimates: list[tuple[float, _Grid]] = []
    for views, lights in itertools.product(_COUNTS, _COUNTS):
        if views > len(measured.views) or lights > len(measured.lights):
            continue
        each = math.log(budget / (views * lights))
        if not bytes_each[1] - 1.5 <= each <= bytes_each[0] + 1.5:
            continue
        grid = _grid(measured, views, lights)
        coding = math.exp(squares[0] + slope * (each - bytes_each[0]))
        step = grid.interpolated(few[:, grid.images]) - few
        estimates.append((float(np.mean(step**2)) + coding, grid))
    estimates.sort(key=lambda estimate: estimate[0])
    return [grid for _, grid in estimates[:_TRIED]]


def _kept(measured: MeasuredBtf, grid: _Grid) -> NDArray[np.float32]:
    """The kept photographs as they were measured, (texel, view, light, 3)."""
    return measured.abrdfs[:, grid.images].astype(np.float32)


def _coded(measured: MeasuredBtf, grid: _Grid, step: float) -> _Picture:
    """One picture of all kept photographs; a finer step is a higher quality.

    AVIF's quality is a whole number; codes between two of them come from darkening the picture.
    """
    from imagecodecs import avif_decode, avif_encode

    level = min(max(_LEVEL - 22.0 * math.log(step), 0.0), 100.0)
    quality = math.ceil(level)
    gain = 1.0 - 0.16 * (quality - level)
    rows, columns = measured.size
    views, lights = len(grid.views), len(grid.lights)
    codes = encode_srgb(_kept(measured, grid) / measured.alpha) * (gain * _LARGEST_CODE)
    tiles = np.rint(codes).astype(np.uint16).reshape(rows, columns, views, lights, 3)
    mosaic = tiles.transpose(2, 0, 3, 1, 4).reshape(views * rows, lights * columns, 3)
    data = avif_encode(
        np.ascontiguousarray(mosaic),
        level=quality,
        speed=_SPEED,
        bitspersample=10,
        pixelformat="444",
        numthreads=1,
    )
    decoded = avif_decode(data).reshape(views, rows, lights, columns, 3)
    radiance = decode_srgb(decoded / (gain * _LARGEST_CODE)) * measured.alpha
    ordered = radiance.transpose(1, 3, 0, 2, 4).reshape(-1, views, lights, 3)
    return _Picture(len(data) + 8, ordered.astype(np.float32), quality)


# ---- directions ------------------------------------------------------------------------------


def _grid(measured: MeasuredBtf, views: int, lights: int) -> _Grid:
    kept_views = spread_directions(measured.views, views)
    kept_lights = spread_directions(measured.lights, lights)
    return _Grid(
        kept_views,
        kept_lights,
        barycentric_weights(measured.views[kept_views], measured.views),
        barycentric_weights(measured.lights[kept_lights], measured.lights),
    )


def spread_directions(table: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Numbers of ``count`` directions (n, 2) far from one another.

    The first is the nearest to the normal, each other the farthest from all before it.
    """
    vectors = unit_vectors(table)
    chosen = [int(np.argmax(vectors[:, 2]))]
    distances = np.full(len(table), np.inf)
    while len(chosen) < count:
        distances = np.minimum(distances, np.sum((vectors - vectors[chosen[-1]]) ** 2, axis=1))
        chosen.append(int(np.argmax(distances)))
    return np.array(chosen)


def barycentric_weights(
    known: NDArray[np.float64], wanted: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Weights (wanted, known) of directions (n, 2) that interpolate between three known ones.

    Triangles are Delaunay's on the stereographic plane. Outside of all of them the nearest point of
    the outline is taken, between two; of one or two known directions the same is done.
    """
    from scipy.spatial import Delaunay

    points, places = stereographic(known), stereographic(wanted)
    weights = np.zeros((len(places), len(points)))
    inside = np.zeros(len(places), bool)
    if len(points) > 2 and np.linalg.matrix_rank(points[1:] - points[0], tol=1e-6) == 2:
        mesh = Delaunay(points)
        owner = mesh.find_simplex(places, tol=1e-9)
        inside = owner >= 0
        affine = mesh.transform[owner[inside]]
        first = np.einsum("nij,nj->ni", affine[:, :2], places[inside] - affine[:, 2])
        shares = np.column_stack([first, 1.0 - first.sum(axis=1)])
        weights[np.flatnonzero(inside)[:, None], mesh.simplices[owner[inside]]] = shares
        edges = mesh.convex_hull
    else:
        edges = np.array(list(itertools.combinations(range(len(points)), 2)) or [(0, 0)])
    for place in np.flatnonzero(~inside):
        weights[place] = _on_outline(points, edges, places[place])
    return weights.astype(np.float32)


def _on_outline(
    points: NDArray[np.float64], edges: NDArray[np.int64], place: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Weights (known,) of the point nearest to a place on edges (n, 2) between points."""
    start, along = points[edges[:, 0]], points[edges[:, 1]] - points[edges[:, 0]]
    lengths = np.maximum(np.sum(along**2, axis=1), 1e-30)
    share = np.clip(np.sum((place - start) * along, axis=1) / lengths, 0.0, 1.0)
    nearest = int(np.argmin(np.sum((start + share[:, None] * along - place) ** 2, axis=1)))
    weights = np.zeros(len(points))
    weights[edges[nearest, 0]] += 1.0 - share[nearest]
    weights[edges[nearest, 1]] += share[nearest]
    return weights
