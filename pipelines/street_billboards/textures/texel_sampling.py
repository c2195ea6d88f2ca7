"""Texels of views: whether a photograph shows the billboard's surface there, and its colour.

A texel looks into a photograph where its point is projected. If something nearer than the billboard
is there the surface is hidden (UNSEEN) and the next photograph is asked; if the camera looks
through, the texel is EMPTY from there; else it is SEEN.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import OVERLAP, Billboards
from pipelines.street_billboards.textures.photographs import Photographs
from pipelines.street_billboards.textures.texture_tables import EMPTY, SEEN, SIDE, UNSEEN

FloatArray = NDArray[np.float64]
Point = tuple[float, float, float]

_SIGMAS = 3.0
"""Standard deviations of a depth that still agree with the surface."""
_TOLERANCE = 0.15
"""Distance from a billboard's plane that still agrees with it, in voxel sides."""
_MOST_SAMPLES = 3
"""Of a texel's side, where the photograph is finer than the texture."""


class SampledViews(NamedTuple):
    """What is written of v views."""

    colours: NDArray[np.uint8]
    """(v, 32, 32, 3), sRGB."""
    states: NDArray[np.uint8]
    """(v, 32, 32), UNSEEN before."""
    sharpness: NDArray[np.float32]
    """(v,), pixels of the best photograph to a texel's side."""


class _FacingCamera(NamedTuple):
    """A billboard as it stands for one camera."""

    centre: FloatArray
    """(3,)."""
    row: FloatArray
    """(3,), half of the rectangle along a row of texels."""
    column: FloatArray
    """(3,), half of it along a column."""
    voxel: FloatArray
    """(3,), middle of the octree's leaf."""
    voxel_side: float
    turns: bool


class _Photograph(NamedTuple):
    """One of ``Photographs``."""

    pixels: NDArray[np.uint8]
    depth: NDArray[np.float32]
    deviation: NDArray[np.float32]
    intrinsics: FloatArray
    to_world: FloatArray
    exposure_lut: NDArray[np.uint8]


@njit(cache=True, nogil=True)
def sample_views(
    owner: NDArray[np.int64],
    chosen: NDArray[np.int32],
    billboards: Billboards,
    voxel_side: float,
    photographs: Photographs,
    plain: bool,
    sampled: SampledViews,
) -> None:
    """Views (v,) of billboards ``owner`` (v,) from photographs ``chosen`` (v, tried), best first.

    chosen: -1 after the last. plain: without occlusion, as in the paper.
    """
    row, column = np.empty(3), np.empty(3)
    for v in range(len(owner)):
        b = owner[v]
        for place in range(chosen.shape[1]):
            k = chosen[v, place]
            if k < 0:
                break
            photograph = _Photograph(
                photographs.pixels[k],
                photographs.depth[k],
                photographs.deviation[k],
                photographs.intrinsics[k],
                photographs.to_world[k],
                photographs.exposure_lut[k],
            )
            eye = photograph.to_world[:, 3]
            if billboards.turns[b]:
                half = np.float64(billboards.half_s[b, 0])
                _turned(billboards.centre[b], eye, half, row, column)
            else:
                row[:], column[:] = billboards.half_s[b], billboards.half_t[b]
            billboard = _FacingCamera(
                billboards.centre[b],
                row,
                column,
                billboards.voxel[b],
                voxel_side,
                billboards.turns[b],
            )
            fineness = _pixels_a_texel(billboard, photograph)
            if place == 0:
                sampled.sharpness[v] = fineness
            samples = min(max(math.ceil(fineness - 0.2), 1), _MOST_SAMPLES)
            _sample_view(
                billboard, photograph, samples, plain, sampled.colours[v], sampled.states[v]
            )


@njit(cache=True, nogil=True)
def _sample_view(
    billboard: _FacingCamera,
    photograph: _Photograph,
    samples: int,
    plain: bool,
    colours: NDArray[np.uint8],
    states: NDArray[np.uint8],
) -> None:
    """Give a view's UNSEEN texels what one photograph shows there."""
    found = np.empty(3)
    for y in range(SIDE):
        for x in range(SIDE):
            if states[y, x] != UNSEEN:
                continue
            s = (2.0 * x + 1.0) / SIDE - 1.0
            t = 1.0 - (2.0 * y + 1.0) / SIDE
            states[y, x] = _state(billboard, s, t, photograph, plain)
            if states[y, x] == SEEN:
                _colour(billboard, s, t, samples, photograph, found)
                for c in range(3):
                    colours[y, x, c] = np.uint8(found[c] + 0.5)


@njit(cache=True, nogil=True)
def _pixels_a_texel(billboard: _FacingCamera, photograph: _Photograph) -> float:
    centre, eye = billboard.centre, photograph.to_world[:, 3]
    row, column = billboard.row, billboard.column
    away = math.sqrt(
        (eye[0] - centre[0]) ** 2 + (eye[1] - centre[1]) ** 2 + (eye[2] - centre[2]) ** 2
    )
    texel = 2.0 * math.sqrt(max((row * row).sum(), (column * column).sum())) / SIDE
    return photograph.intrinsics[0, 0] / away * texel


@njit(cache=True, nogil=True)
def _turned(
    centre: FloatArray, eye: FloatArray, half: float, row: FloatArray, column: FloatArray
) -> None:
    """``billboards.axes_facing`` times ``half``."""
    nx, ny, nz = eye[0] - centre[0], eye[1] - centre[1], eye[2] - centre[2]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    level = max(math.sqrt(nx * nx + ny * ny), 1e-12)
    rx, ry = -ny / level, nx / level
    row[0], row[1], row[2] = half * rx, half * ry, 0.0
    column[0], column[1], column[2] = -half * nz * ry, half * nz * rx, half * (nx * ry - ny * rx)


@njit(cache=True, nogil=True)
def _point(billboard: _FacingCamera, s: float, t: float) -> Point:
    """Where texture coordinates are in the world, m."""
    centre, row, column = billboard.centre, billboard.row, billboard.column
    return (
        centre[0] + s * row[0] + t * column[0],
        centre[1] + s * row[1] + t * column[1],
        centre[2] + s * row[2] + t * column[2],
    )


@njit(cache=True, nogil=True)
def _pixel(point: Point, k: FloatArray, to_world: FloatArray) -> tuple[float, float, float]:
    ox, oy, oz = point[0] - to_world[0, 3], point[1] - to_world[1, 3], point[2] - to_world[2, 3]
    x = ox * to_world[0, 0] + oy * to_world[1, 0] + oz * to_world[2, 0]
    y = ox * to_world[0, 1] + oy * to_world[1, 1] + oz * to_world[2, 1]
    z = ox * to_world[0, 2] + oy * to_world[1, 2] + oz * to_world[2, 2]
    if z < 1e-3:
        return -1e9, -1e9, z
    return k[0, 0] * x / z + k[0, 2], k[1, 1] * y / z + k[1, 2], z


@njit(cache=True, nogil=True)
def _state(
    billboard: _FacingCamera, s: float, t: float, photograph: _Photograph, plain: bool
) -> int:
    """Whether a photograph shows the billboard's surface at a texel."""
    row, column, voxel = billboard.row, billboard.column, billboard.voxel
    depth, to_world = photograph.depth, photograph.to_world
    point = _point(billboard, s, t)
    across, down, z = _pixel(point, photograph.intrinsics, to_world)
    height, width = depth.shape
    x, y = math.floor(across + 0.5), math.floor(down + 0.5)
    if not (0 <= x < width and 0 <= y < height):
        return UNSEEN
    half = billboard.voxel_side * (0.5 + OVERLAP)
    near, far = z, z
    if billboard.turns:
        if plain:  # a square of the voxel's side
            inside = max(abs(s), abs(t)) * math.sqrt((row * row).sum()) <= half
            return SEEN if inside else EMPTY
        enter, leave = _through(voxel, half, to_world[:, 3], point)
        if enter > leave:
            return EMPTY
        near, far = z * enter, z * leave
    else:
        for axis in range(3):
            if abs(point[axis] - voxel[axis]) > half * 1.0001:
                return EMPTY
        if plain:
            return SEEN
    there = depth[y, x]
    if math.isnan(there):
        return UNSEEN if billboard.turns else SEEN
    # Points of the voxel lie inside it: for one that turns, the depth's own deviation is all there
    # is to allow. From a plane they may be off by a distance, which a grazing look makes long.
    tolerance = 0.0 if math.isinf(there) else _SIGMAS * photograph.deviation[y, x]
    if not billboard.turns:
        steepness = _steepness(row, column, point, to_world, z)
        off = _TOLERANCE * billboard.voxel_side / max(steepness, 1e-3)
        tolerance = max(tolerance, min(off, billboard.voxel_side))
    # Colours of a nearer thing bleed over its outline.
    for beside in range(9):
        px, py = x + beside % 3 - 1, y + beside // 3 - 1
        if 0 <= px < width and 0 <= py < height and depth[py, px] < near - tolerance:
            return UNSEEN
    return EMPTY if there > far + tolerance else SEEN


@njit(cache=True, nogil=True)
def _steepness(
    row: FloatArray, column: FloatArray, point: Point, to_world: FloatArray, z: float
) -> float:
    """Distance from the plane of what is a metre of depth from it, m."""
    nx = row[1] * column[2] - row[2] * column[1]
    ny = row[2] * column[0] - row[0] * column[2]
    nz = row[0] * column[1] - row[1] * column[0]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    along = (
        nx * (point[0] - to_world[0, 3])
        + ny * (point[1] - to_world[1, 3])
        + nz * (point[2] - to_world[2, 3])
    )
    return abs(along) / (length * z)


@njit(cache=True, nogil=True)
def _through(voxel: FloatArray, half: float, eye: FloatArray, point: Point) -> tuple[float, float]:
    """Where the ray from the eye enters and leaves the voxel; 1 is at the point."""
    enter, leave = 0.0, 1e9
    for axis in range(3):
        way = point[axis] - eye[axis]
        offset = voxel[axis] - eye[axis]
        if abs(way) < 1e-12:
            if abs(offset) > half:
                return 1.0, 0.0
            continue
        first, second = (offset - half) / way, (offset + half) / way
        enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
    return enter, leave


@njit(cache=True, nogil=True)
def _colour(
    billboard: _FacingCamera,
    s: float,
    t: float,
    samples: int,
    photograph: _Photograph,
    found: FloatArray,
) -> None:
    """Mean of bilinear samples of a photograph inside a texel, evened out, in codes."""
    pixels, codes = photograph.pixels, photograph.exposure_lut
    height, width = pixels.shape[:2]
    found[:] = 0.0
    step = 2.0 / (SIDE * samples)
    for number in range(samples * samples):
        ds = (number % samples - 0.5 * (samples - 1)) * step
        dt = (number // samples - 0.5 * (samples - 1)) * step
        point = _point(billboard, s + ds, t + dt)
        across, down, _ = _pixel(point, photograph.intrinsics, photograph.to_world)
        across = min(max(across, 0.0), width - 1.0)
        down = min(max(down, 0.0), height - 1.0)
        x, y = min(int(across), width - 2), min(int(down), height - 2)
        fx, fy = across - x, down - y
        for c in range(3):
            above = codes[pixels[y, x, c], c] * (1 - fx) + codes[pixels[y, x + 1, c], c] * fx
            below = (
                codes[pixels[y + 1, x, c], c] * (1 - fx) + codes[pixels[y + 1, x + 1, c], c] * fx
            )
            found[c] += above * (1 - fy) + below * fy
    found /= samples * samples
