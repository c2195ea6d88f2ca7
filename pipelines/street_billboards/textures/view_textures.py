"""Textures of billboards from the photographs that see them best (4.2.1).

A texel looks into a photograph where its point is projected. Its colour counts if the depth map
of that photograph agrees with the billboard: if something nearer is there the surface is hidden and
the next-best photograph is asked; if the camera looks through, the texel is empty from there. The
paper leaves this out ("plain"), and takes the pillar in front of a wall for the wall.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numba
import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import OVERLAP, Billboards
from pipelines.street_billboards.textures.forms import EMPTY, SEEN, SIDE, UNSEEN, ViewTextures
from pipelines.street_billboards.textures.view_directions import CIRCLE, DIRECTIONS

FloatArray = NDArray[np.float64]

TRIED = 4
"""Photographs that are asked for one view."""
NEAREST = 1.0
"""Metres from the camera from which on a billboard is photographed well."""
_SIGMAS = 3.0
"""Standard deviations of a depth that still agree with the surface."""
_TOLERANCE = 0.15
"""Distance from a billboard's plane that still agrees with it, in voxel sides."""
_LEAST_TEXELS = 12
"""That a view must show."""
_LEAST_SHARE = 0.4
"""Of the texels that the billboard's best view shows; what fewer tell of the rest is a guess."""
_VIEWS = 512
"""That a thread samples at a time."""
_MOST_SAMPLES = 3
"""Of a texel's side, where the photograph is finer than the texture."""


class Photographs(NamedTuple):
    """k photographs with what is known of them."""

    pixels: NDArray[np.uint8]
    """(k, y, x, 3), sRGB."""
    depth: NDArray[np.float32]
    """(k, y, x), m along the axis; nan where it is not known, inf in the sky."""
    deviation: NDArray[np.float32]
    """(k, y, x), m, its standard deviation."""
    intrinsics: FloatArray
    """(k, 3, 3)."""
    to_world: FloatArray
    """(k, 4, 4)."""
    codes: NDArray[np.uint8]
    """(k, 256, 3), code that evens out the exposure, by the photograph's code and channel."""


def view_textures(
    billboards: Billboards,
    voxel_side: float,
    photographs: Photographs,
    *,
    plain: bool = False,
    farthest: float = 40.0,
) -> ViewTextures:
    """Sample the views of billboards, in directions in which somebody looked.

    voxel_side and farthest (from camera to billboard) in metres; plain: without occlusion, one
    photograph a view, squares of the voxel's side opaque all over, as in the paper.
    """
    chosen = _chosen(billboards, photographs, 1 if plain else TRIED, farthest)
    first, direction, pictures = _views(chosen)
    count = len(direction)
    colours = np.zeros((count, SIDE, SIDE, 3), np.uint8)
    states = np.zeros((count, SIDE, SIDE), np.uint8)
    sharpness = np.zeros(count, np.float32)
    owner = np.repeat(np.arange(len(first) - 1), np.diff(first))
    places = billboards.centre, billboards.voxel, billboards.turns
    halves = billboards.half_s.astype(np.float64), billboards.half_t.astype(np.float64)

    def sample(rows: slice) -> None:
        _sample(
            owner[rows],
            pictures[rows],
            *places,
            *halves,
            voxel_side,
            photographs.pixels,
            photographs.depth,
            photographs.deviation,
            photographs.intrinsics,
            photographs.to_world,
            photographs.codes,
            plain,
            colours[rows],
            states[rows],
            sharpness[rows],
        )

    with ThreadPoolExecutor(numba.get_num_threads()) as threads:
        list(threads.map(sample, (slice(at, at + _VIEWS) for at in range(0, count, _VIEWS))))
    seen = (states == SEEN).sum(axis=(1, 2))
    most = np.zeros(len(first) - 1, np.int64)
    np.maximum.at(most, owner, seen)
    kept = (seen >= _LEAST_TEXELS) & (seen >= _LEAST_SHARE * most[owner])
    ends = np.zeros(len(first), np.int64)
    ends[1:] = np.cumsum(np.bincount(owner[kept], minlength=len(first) - 1))
    return ViewTextures(ends, direction[kept], colours[kept], states[kept], sharpness[kept])


# ---- which photographs -----------------------------------------------------------------------


def _chosen(
    billboards: Billboards, photographs: Photographs, tried: int, farthest: float
) -> NDArray[np.int32]:
    """Photographs (b, 32, tried) for each direction, the best first, -1 where there is none."""
    _, height, width = photographs.depth.shape
    chosen = np.full((len(billboards.centre), DIRECTIONS, tried), -1, np.int32)
    _choose(
        billboards.centre,
        billboards.turns,
        np.cross(billboards.half_s, billboards.half_t).astype(np.float64),
        billboards.fan,
        photographs.intrinsics,
        photographs.to_world,
        width,
        height,
        farthest,
        chosen,
    )
    return chosen


@njit(cache=True, nogil=True)
def _choose(
    centre: FloatArray,
    turns: NDArray[np.bool_],
    normal: FloatArray,
    fan: NDArray[np.int32],
    intrinsics: FloatArray,
    to_world: FloatArray,
    width: int,
    height: int,
    farthest: float,
    chosen: NDArray[np.int32],
) -> None:
    tried = chosen.shape[2]
    scores = np.empty((DIRECTIONS, tried))
    for b in range(len(centre)):
        scores[:] = 0.0
        for k in range(len(to_world)):
            ox = to_world[k, 0, 3] - centre[b, 0]
            oy = to_world[k, 1, 3] - centre[b, 1]
            oz = to_world[k, 2, 3] - centre[b, 2]
            away = math.sqrt(ox * ox + oy * oy + oz * oz)
            if away > farthest or away < NEAREST:
                continue
            x = -(ox * to_world[k, 0, 0] + oy * to_world[k, 1, 0] + oz * to_world[k, 2, 0])
            y = -(ox * to_world[k, 0, 1] + oy * to_world[k, 1, 1] + oz * to_world[k, 2, 1])
            z = -(ox * to_world[k, 0, 2] + oy * to_world[k, 1, 2] + oz * to_world[k, 2, 2])
            if z < 0.5 * NEAREST:
                continue
            across = intrinsics[k, 0, 0] * x / z + intrinsics[k, 0, 2]
            down = intrinsics[k, 1, 1] * y / z + intrinsics[k, 1, 2]
            if not (-0.5 <= across <= width - 0.5 and -0.5 <= down <= height - 0.5):
                continue
            facing = 1.0
            if not turns[b]:
                length = math.sqrt(normal[b, 0] ** 2 + normal[b, 1] ** 2 + normal[b, 2] ** 2)
                along = ox * normal[b, 0] + oy * normal[b, 1] + oz * normal[b, 2]
                facing = along / (length * away)
                if facing < 0.02:
                    continue
            position = math.degrees(math.atan2(oy, ox)) * CIRCLE / 360.0 - fan[b]
            outside = (CIRCLE - DIRECTIONS + 1) / 2
            position = (position + outside) % CIRCLE - outside
            if position < -0.5 or position > DIRECTIONS - 0.5:
                continue
            d = min(max(round(position), 0), DIRECTIONS - 1)
            # Pixels that a metre of it covers, fewer the farther from the view's own direction.
            score = intrinsics[k, 0, 0] / away * (1.0 - 0.5 * abs(position - d))
            for place in range(tried):
                if score > scores[d, place]:
                    for later in range(tried - 1, place, -1):
                        scores[d, later] = scores[d, later - 1]
                        chosen[b, d, later] = chosen[b, d, later - 1]
                    scores[d, place] = score
                    chosen[b, d, place] = k
                    break


def _views(
    chosen: NDArray[np.int32],
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.int32]]:
    """The ragged table: where a billboard's rows begin, directions, photographs (v, tried)."""
    some = chosen[..., 0] >= 0
    first = np.concatenate([[0], np.cumsum(some.sum(axis=1))]).astype(np.int64)
    _, direction = np.nonzero(some)
    return first, direction.astype(np.uint8), chosen[some]


# ---- sampling --------------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def _sample(
    owner: NDArray[np.int64],
    pictures: NDArray[np.int32],
    centre: FloatArray,
    voxel: FloatArray,
    turns: NDArray[np.bool_],
    half_s: FloatArray,
    half_t: FloatArray,
    voxel_side: float,
    pixels: NDArray[np.uint8],
    depth: NDArray[np.float32],
    deviation: NDArray[np.float32],
    intrinsics: FloatArray,
    to_world: FloatArray,
    codes: NDArray[np.uint8],
    plain: bool,
    colours: NDArray[np.uint8],
    states: NDArray[np.uint8],
    sharpness: NDArray[np.float32],
) -> None:
    row, column = np.empty(3), np.empty(3)
    found = np.empty(3)
    for v in range(len(owner)):
        b = owner[v]
        for place in range(pictures.shape[1]):
            k = pictures[v, place]
            if k < 0:
                break
            eye = to_world[k, :, 3]
            if turns[b]:
                _turned(centre[b], eye, half_s[b, 0], row, column)
            else:
                row[:], column[:] = half_s[b], half_t[b]
            away = math.sqrt(
                (eye[0] - centre[b, 0]) ** 2
                + (eye[1] - centre[b, 1]) ** 2
                + (eye[2] - centre[b, 2]) ** 2
            )
            texel = 2.0 * math.sqrt(max((row * row).sum(), (column * column).sum())) / SIDE
            fineness = intrinsics[k, 0, 0] / away * texel
            if place == 0:
                sharpness[v] = fineness
            samples = min(max(math.ceil(fineness - 0.2), 1), _MOST_SAMPLES)
            for y in range(SIDE):
                for x in range(SIDE):
                    if states[v, y, x] != UNSEEN:
                        continue
                    s = (2.0 * x + 1.0) / SIDE - 1.0
                    t = 1.0 - (2.0 * y + 1.0) / SIDE
                    state = _state(
                        centre[b],
                        voxel[b],
                        voxel_side,
                        turns[b],
                        row,
                        column,
                        s,
                        t,
                        intrinsics[k],
                        to_world[k],
                        depth[k],
                        deviation[k],
                        plain,
                    )
                    states[v, y, x] = state
                    if state == SEEN:
                        _colour(
                            centre[b],
                            row,
                            column,
                            s,
                            t,
                            samples,
                            intrinsics[k],
                            to_world[k],
                            pixels[k],
                            codes[k],
                            found,
                        )
                        for c in range(3):
                            colours[v, y, x, c] = np.uint8(found[c] + 0.5)


@njit(cache=True, nogil=True)
def _turned(
    centre: FloatArray, eye: FloatArray, half: float, row: FloatArray, column: FloatArray
) -> None:
    """``billboards.turned_axes`` times ``half``."""
    nx, ny, nz = eye[0] - centre[0], eye[1] - centre[1], eye[2] - centre[2]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    level = max(math.sqrt(nx * nx + ny * ny), 1e-12)
    rx, ry = -ny / level, nx / level
    row[0], row[1], row[2] = half * rx, half * ry, 0.0
    column[0], column[1], column[2] = -half * nz * ry, half * nz * rx, half * (nx * ry - ny * rx)


@njit(cache=True, nogil=True)
def _pixel(point: FloatArray, k: FloatArray, to_world: FloatArray) -> tuple[float, float, float]:
    ox, oy, oz = point[0] - to_world[0, 3], point[1] - to_world[1, 3], point[2] - to_world[2, 3]
    x = ox * to_world[0, 0] + oy * to_world[1, 0] + oz * to_world[2, 0]
    y = ox * to_world[0, 1] + oy * to_world[1, 1] + oz * to_world[2, 1]
    z = ox * to_world[0, 2] + oy * to_world[1, 2] + oz * to_world[2, 2]
    if z < 1e-3:
        return -1e9, -1e9, z
    return k[0, 0] * x / z + k[0, 2], k[1, 1] * y / z + k[1, 2], z


@njit(cache=True, nogil=True)
def _state(
    centre: FloatArray,
    voxel: FloatArray,
    voxel_side: float,
    turning: bool,
    row: FloatArray,
    column: FloatArray,
    s: float,
    t: float,
    k: FloatArray,
    to_world: FloatArray,
    depth: NDArray[np.float32],
    deviation: NDArray[np.float32],
    plain: bool,
) -> int:
    """Whether a photograph shows the billboard's surface at a texel."""
    point = centre + s * row + t * column
    across, down, z = _pixel(point, k, to_world)
    height, width = depth.shape
    x, y = math.floor(across + 0.5), math.floor(down + 0.5)
    if not (0 <= x < width and 0 <= y < height):
        return UNSEEN
    half = voxel_side * (0.5 + OVERLAP)
    near, far = z, z
    if turning:
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
        return UNSEEN if turning else SEEN
    # Points of the voxel lie inside it: for one that turns, the depth's own deviation is all there
    # is to allow. From a plane they may be off by a distance, which a grazing look makes long.
    tolerance = 0.0 if math.isinf(there) else _SIGMAS * deviation[y, x]
    if not turning:
        off = _TOLERANCE * voxel_side / max(_steepness(row, column, point, to_world, z), 1e-3)
        tolerance = max(tolerance, min(off, voxel_side))
    # Colours of a nearer thing bleed over its outline.
    for beside in range(9):
        px, py = x + beside % 3 - 1, y + beside // 3 - 1
        if 0 <= px < width and 0 <= py < height and depth[py, px] < near - tolerance:
            return UNSEEN
    return EMPTY if there > far + tolerance else SEEN


@njit(cache=True, nogil=True)
def _steepness(
    row: FloatArray, column: FloatArray, point: FloatArray, to_world: FloatArray, z: float
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
def _through(
    voxel: FloatArray, half: float, eye: FloatArray, point: FloatArray
) -> tuple[float, float]:
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
    centre: FloatArray,
    row: FloatArray,
    column: FloatArray,
    s: float,
    t: float,
    samples: int,
    k: FloatArray,
    to_world: FloatArray,
    pixels: NDArray[np.uint8],
    codes: NDArray[np.uint8],
    found: FloatArray,
) -> None:
    """Mean of bilinear samples of a photograph inside a texel, evened out, in codes."""
    height, width = pixels.shape[:2]
    found[:] = 0.0
    step = 2.0 / (SIDE * samples)
    for number in range(samples * samples):
        ds = (number % samples - 0.5 * (samples - 1)) * step
        dt = (number // samples - 0.5 * (samples - 1)) * step
        across, down, _ = _pixel(centre + (s + ds) * row + (t + dt) * column, k, to_world)
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
