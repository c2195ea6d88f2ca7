"""Scratched glass by path tracing (section 3.3): rays by Embree, compiled kernels for the rest.

Glass is smooth where there is no scratch: a path is reflected or refracted by Fresnel's equations,
total reflection included. Where there is one, its table says where light goes, on both sides of the
surface (`tables.sampling`), with samples of table and environment combined (Eq. 5; multiple
importance sampling, balance heuristic). So a scratched solid in a uniform environment is as bright
as that, and never brighter.

Radiance is kept divided by the square of the index around it, which is the same everywhere along an
unscattered path.

Scratches are laid on the surface from the three axes (box projection): the one that the normal
lies along, or two or three at random where it lies between, so that there are no seams. Where
several layers have a scratch one of them is taken at random. Close up the features themselves are
asked; where a pixel is wider than a texel, the layers' coverage averaged over the pixel is the
chance that there is a scratch.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.rays import FirstHits, build_scene, first_hits, occluded
from pipelines.glass_scratches.drawing.path_events import DEEPEST, advance_paths
from pipelines.glass_scratches.drawing.path_numbers import jitter_pixels
from pipelines.glass_scratches.drawing.path_state import (
    EventResults,
    Faces,
    Paths,
    ScratchedSurface,
    TracedGlass,
)
from pipelines.glass_scratches.layers.coverage import flatten_mips, mip_pyramid
from pipelines.glass_scratches.layers.feature_search import LayerArrays
from pipelines.glass_scratches.tables.lobe import Lobe
from pipelines.light.environment_sampling import EnvironmentSampler

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

    from pipelines.drawing.stage import Camera
    from pipelines.geometry.solids import Solid

Strategy = Literal["importance", "uniform"]
"""How a scratch's lights are drawn: by table and environment, or evenly over the hemisphere."""
_BLOCK = 1 << 17
_OFFSET = 2e-4
_MOST_FLATS = 4


class TracedPicture(NamedTuple):
    """A picture, and what a denoiser wants to know of it.

    ``radiance`` (H, W, 3) float32 linear; ``variance`` (H, W) float32 of its mean over the
    channels; ``scratched`` (H, W) float32: share of the paths that met a scratch; ``smooth``
    (H, W, 3) float32: the part of the radiance that came by paths that met none; ``normal``
    (H, W, 3) float32: mean of the unit normals that are seen first, 0 beside the object; ``rays``
    that it took; ``samples``: paths a pixel.
    """

    radiance: NDArray[np.float32]
    variance: NDArray[np.float32]
    scratched: NDArray[np.float32]
    smooth: NDArray[np.float32]
    normal: NDArray[np.float32]
    rays: int
    samples: int


def make_scratched_surface(
    layers: LayerArrays, coverage: NDArray[np.float32], lobe: Lobe, *, tile: float
) -> ScratchedSurface:
    """Put layers with their coverage (L, R, R) and the lobe of their scratches together.

    Raises ValueError for a tile that is not positive, and an R that is no power of two.
    """
    if not tile > 0:
        raise ValueError(f"tile is {tile:g}; expected more than 0 scene units.")
    flat, offsets = flatten_mips(mip_pyramid(coverage))
    return ScratchedSurface(layers, flat, offsets, coverage.shape[1], tile, lobe)


def trace_picture(
    solid: Solid,
    surface: ScratchedSurface,
    environment: EnvironmentSampler,
    camera: Camera,
    *,
    width: int,
    height: int,
    samples: int,
    seed: int = 0,
    strategy: Strategy = "importance",
    progress: Callable[[float], None] = lambda fraction: None,
) -> TracedPicture:
    """Trace ``samples`` paths a pixel through a picture of width x height pixels.

    Positions in the pixel and the numbers of the first scatterings are stratified (the R2
    sequence, shifted at random for each pixel). The result depends on the seed alone.
    """
    scene = build_scene(solid.vertices, solid.triangles)
    size = float(np.linalg.norm(np.ptp(np.asarray(solid.vertices), axis=0)))
    glass = TracedGlass(
        _faces(solid), surface, environment, samples, _OFFSET * size, strategy == "uniform"
    )
    view = _view(camera, width, height)
    pixels_a_block = max(1, _BLOCK // samples)
    total = width * height
    radiance = np.empty((total, 3), np.float32)
    variance = np.empty(total, np.float32)
    scratched = np.empty(total, np.float32)
    smooth, normal = np.empty((total, 3), np.float32), np.empty((total, 3), np.float32)
    rays = 0
    for first in range(0, total, pixels_a_block):
        progress(first / total)
        pixels = np.arange(first, min(first + pixels_a_block, total))
        paths = _start(view, pixels, width, samples, seed)
        gathered, met, facing, cast = _trace_block(scene, glass, paths)
        rays += cast
        parts = gathered.reshape(len(pixels), samples, 3)
        smooth[pixels] = np.where(met[:, None], 0.0, gathered).reshape(parts.shape).mean(axis=1)
        normal[pixels] = facing.reshape(parts.shape).mean(axis=1)
        radiance[pixels] = parts.mean(axis=1)
        variance[pixels] = parts.mean(axis=2).var(axis=1) / max(samples - 1, 1)
        scratched[pixels] = met.reshape(len(pixels), samples).mean(axis=1)
    progress(1.0)
    grid = (height, width)
    return TracedPicture(
        radiance.reshape(*grid, 3),
        variance.reshape(grid),
        scratched.reshape(grid),
        smooth.reshape(*grid, 3),
        normal.reshape(*grid, 3),
        rays,
        samples,
    )


def _faces(solid: Solid) -> Faces:
    corners = np.asarray(solid.vertices)[solid.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    normals /= areas[:, None]
    return Faces(
        normals.astype(np.float32), solid.corner_normals.astype(np.float32), _flats(normals, areas)
    )


def _flats(normals: NDArray[np.float64], areas: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axes (K, 3) along which at least a hundredth of the area faces, within a degree."""
    free, found = np.ones(len(normals), np.bool_), []
    for face in np.argsort(-areas)[:64]:
        if free[face]:
            alike = free & (np.abs(normals @ normals[face]) > np.cos(np.radians(1.0)))
            free &= ~alike
            if areas[alike].sum() > 0.01 * areas.sum():
                found.append(normals[face])
    return np.array(found[:_MOST_FLATS]).reshape(-1, 3)


class _View(NamedTuple):
    """A camera as vectors: ``right`` and ``up`` step one pixel on the plane at distance 1 (or, of
    an orthographic one, in the scene)."""

    position: NDArray[np.float64]
    forward: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    pixel: float
    parallel: bool


def _view(camera: Camera, width: int, height: int) -> _View:
    position, target, up = (
        np.array(v, np.float64) for v in (camera.position, camera.target, camera.up)
    )
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    upward = np.cross(right, forward)
    parallel = camera.height is not None
    pixel = (
        camera.height / height
        if camera.height is not None
        else 2 * np.tan(np.radians(camera.view_angle) / 2) / height
    )
    corner = -(width - 1) / 2, (height - 1) / 2
    start = forward + pixel * (corner[0] * right + corner[1] * upward)
    if parallel:
        position = position + pixel * (corner[0] * right + corner[1] * upward)
        start = forward
    return _View(position, start, pixel * right, -pixel * upward, pixel, parallel)


def _start(view: _View, pixels: NDArray[np.int64], width: int, samples: int, seed: int) -> Paths:
    count = len(pixels) * samples
    jitter = np.empty((count, 2))
    seeds = np.empty(count, np.uint64)
    jitter_pixels(pixels, samples, seed, jitter, seeds)
    column = np.repeat(pixels % width, samples) + jitter[:, 0] - 0.5
    row = np.repeat(pixels // width, samples) + jitter[:, 1] - 0.5
    step = column[:, None] * view.right + row[:, None] * view.up
    origin = np.tile(view.position, (count, 1))
    way = np.tile(view.forward, (count, 1))
    if view.parallel:
        origin += step
    else:
        way += step
        way /= np.linalg.norm(way, axis=1, keepdims=True)
    return Paths(
        np.arange(count),
        origin,
        way,
        np.ones((count, 3)),
        np.zeros(count),
        np.full(count, view.pixel if view.parallel else 0.0),
        np.full(count, 0.0 if view.parallel else view.pixel),
        seeds,
    )


def _trace_block(
    scene: RaycastingScene, glass: TracedGlass, paths: Paths
) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.float32], int]:
    """Radiance (N, 3) of paths, whether they met a scratch (N,), the normals (N, 3) that they met
    first, and the rays that it took."""
    count = len(paths.number)
    radiance, met_scratch = np.zeros((count, 3)), np.zeros(count, np.bool_)
    normals = np.zeros((count, 3), np.float32)
    rays = 0
    for depth in range(DEEPEST):
        hits = first_hits(scene, paths.origin, paths.direction)
        if depth == 0:
            normals = _met_normals(glass.faces, hits)
        left = len(paths.number)
        rays += left
        alive = np.zeros(left, np.bool_)
        results = EventResults(
            radiance, met_scratch, alive, *(np.zeros((left, 3)) for _ in range(3))
        )
        _in_threads(left, glass, paths, hits, depth, results)
        asked = np.flatnonzero(results.shadow_radiance.any(axis=1))
        if len(asked):
            rays += len(asked)
            starts, towards = results.shadow_origin[asked], results.shadow_direction[asked]
            lit = asked[~occluded(scene, starts, towards)]
            radiance[paths.number[lit]] += results.shadow_radiance[lit]
        if not alive.any():
            break
        paths = Paths._make(array[alive] for array in paths)
    return radiance, met_scratch, normals, rays


def _met_normals(faces: Faces, hits: FirstHits) -> NDArray[np.float32]:
    """Interpolated unit normals (N, 3) where rays meet the surface; 0 where they do not."""
    met = hits.triangle >= 0
    normals = np.zeros((len(met), 3), np.float32)
    corners = faces.corner_normals[hits.triangle[met]]
    mixed = np.einsum("ij,ijk->ik", hits.barycentric[met], corners)
    normals[met] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return normals


def _in_threads(count: int, *arguments: Any) -> None:
    """Advance paths 0 to count, a part in each thread: numba's own parallel loops take no nested
    tuples."""
    workers = numba.get_num_threads()
    borders = np.linspace(0, count, workers + 1).astype(np.int64)
    with ThreadPoolExecutor(workers) as threads:
        parts = [
            threads.submit(advance_paths, first, last, *arguments)
            for first, last in itertools.pairwise(borders)
        ]
        for part in parts:
            part.result()
