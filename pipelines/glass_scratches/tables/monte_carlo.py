"""The scratch BRDF by paths, as the paper makes it (section 3.1, Eq. 1).

A bounce is described by the sine of its angle to the facet's normal: light that is scattered evenly
leaves with a sine uniform in (-1, 1), whatever it came with.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_edges, bin_weights
from pipelines.glass_scratches.tables.random_numbers import next_number
from pipelines.glass_scratches.tables.walls import check_albedo

PLACES = 16
"""Parts of the opening's width for which paths are counted apart."""
_BOUNCES = 100_000
_KEPT, _LOST = -1, -2
"""In place of the bin that a path leaves into."""


class PathCounts(NamedTuple):
    """What became of the paths of each incidence bin.

    ``leaving`` (M in, places, M out): paths by the part of the opening that they entered through
    and the bin that they left into; ``squares`` (M in, M out): sum over the rays of the square of
    their number of paths into the bin; ``kept`` (M in,): paths that the walls kept; ``rays``,
    ``paths_per_ray``: how many were shot a bin.
    """

    leaving: NDArray[np.int64]
    squares: NDArray[np.int64]
    kept: NDArray[np.int64]
    rays: int
    paths_per_ray: int


def shoot_paths(
    profile: NDArray[np.float64],
    *,
    bins: int,
    rays: int,
    paths_per_ray: int,
    albedo: float,
    seed: int,
    incidence: NDArray[np.int64] | None = None,
) -> PathCounts:
    """Shoot ``rays`` rays (N) at the profile from every bin, ``paths_per_ray`` paths each (Nr).

    A ray enters at a random place of the opening, from a random direction of its bin (by the
    cosine); all its paths start there. ``incidence`` limits the bins that are shot from; the others
    count no paths. Walls keep a path with probability 1 - albedo. The result depends on the seed
    alone, not on the number of threads. Raises ValueError for an albedo outside [0, 1].
    """
    check_albedo(albedo)
    walls = _walls(profile, albedo)
    chosen = np.arange(bins) if incidence is None else incidence
    counts = PathCounts(
        np.zeros((bins, PLACES, bins), np.int64),
        np.zeros((bins, bins), np.int64),
        np.zeros(bins, np.int64),
        rays,
        paths_per_ray,
    )
    _shoot(walls, np.sin(bin_edges(bins)), chosen, seed, counts)
    return counts


class PathTable(NamedTuple):
    """``rho``, ``standard_error`` (M out, M in); ``across`` (places, M out, M in): rho by the place
    across the opening, from the left end; ``absorbed`` (M in,)."""

    rho: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    across: NDArray[np.float64]
    absorbed: NDArray[np.float64]


def table_of_counts(counts: PathCounts) -> PathTable:
    """The table of the counted paths, normalised as the exact one.

    Places are those where the *view's* ray enters: by reciprocity the counts of paths that start
    there and leave towards the light.
    """
    leaving, squares, kept, rays, each = counts
    paths = rays * each
    bins = len(leaving)
    weight = bin_weights(bins)
    mean = leaving.sum(axis=1) / paths
    # The mean over rays of the share of their paths, and its variance between rays.
    spread = np.maximum(squares / each**2 / rays - mean**2, 0.0) / max(rays - 1, 1)
    across = leaving * (PLACES * np.pi / paths) / weight
    return PathTable(
        (mean * np.pi / weight).T.copy(),
        (np.sqrt(spread) * np.pi / weight).T.copy(),
        across.transpose(1, 0, 2).copy(),
        kept / paths,
    )


class _Walls(NamedTuple):
    """The pieces of a profile (P,): where each begins, its direction, its length; and what they do
    to light: the part that they give back."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    along_x: NDArray[np.float64]
    along_y: NDArray[np.float64]
    length: NDArray[np.float64]
    opening: float
    albedo: float


class _Ray(NamedTuple):
    """From a point, in a direction; ``piece``: the one that it starts from, or -1."""

    piece: int
    x: float
    y: float
    dx: float
    dy: float


def _walls(profile: NDArray[np.float64], albedo: float) -> _Walls:
    dx, dy = np.diff(profile, axis=0).T
    length = np.sqrt(dx * dx + dy * dy)
    x, y = profile[:-1].T.copy()
    opening = float(profile[-1, 0] - profile[0, 0])
    return _Walls(x, y, dx / length, dy / length, length, opening, albedo)


@njit(cache=True, nogil=True, parallel=True)
def _shoot(walls, sines, chosen, seed, counts):  # type: ignore[no-untyped-def]
    for number in prange(len(chosen)):
        _shoot_from(walls, sines, chosen[number], seed, counts)


@njit(cache=True, nogil=True)
def _shoot_from(walls, sines, bin_in, seed, counts):  # type: ignore[no-untyped-def]
    """Count the paths of all rays from one bin."""
    state = np.uint64(seed) * np.uint64(0xD1342543DE82EF95) + np.uint64(bin_in + 1) * np.uint64(
        0xAF251AF3B0F025B5
    )
    state, _ = next_number(state)
    leaving, squares = counts.leaving[bin_in], counts.squares[bin_in]
    own = np.zeros(len(squares), np.int64)  # of the ray's paths, by the bin that they leave into
    touched = np.empty(counts.paths_per_ray, np.int64)
    for _ray in range(counts.rays):
        state, u = next_number(state)
        place = min(int(u * len(leaving)), len(leaving) - 1)
        x = walls.x[0] + walls.opening * u
        state, u = next_number(state)
        sine = sines[bin_in] + u * (sines[bin_in + 1] - sines[bin_in])
        ray = _Ray(-1, x, 0.0, -sine, -np.sqrt(max(1.0 - sine * sine, 0.0)))
        piece, along = _hit(walls, ray)
        if piece < 0:  # along the opening, between the two ends: leaves as it came
            continue
        reached = 0
        for _path in range(counts.paths_per_ray):
            state, out = _bin_of_path(walls, ray, piece, along, state, len(squares))
            if out == _KEPT:
                counts.kept[bin_in] += 1
            elif out >= 0:
                leaving[place, out] += 1
                if own[out] == 0:
                    touched[reached] = out
                    reached += 1
                own[out] += 1
        for index in range(reached):
            out = touched[index]
            squares[out] += own[out] * own[out]
            own[out] = 0


@njit(cache=True, nogil=True, inline="always")
def _bin_of_path(walls, ray, piece, along, state, bins):  # type: ignore[no-untyped-def]
    """Follow a path that meets a piece so far along: random state, and the bin that it leaves into.

    ``_KEPT`` where the walls keep it, ``_LOST`` where it bounces for ever.
    """
    dx, dy = ray.dx, ray.dy
    for _bounce in range(_BOUNCES):
        state, u = next_number(state)
        if u >= walls.albedo:
            return state, _KEPT
        state, u = next_number(state)
        bounced = _bounced_ray(walls, piece, along, 2.0 * u - 1.0)
        piece, along = _hit(walls, bounced)
        dx, dy = bounced.dx, bounced.dy
        if piece < 0:
            angle = np.arctan2(dx, max(dy, 0.0))
            return state, min(max(int((angle / np.pi + 0.5) * bins), 0), bins - 1)
    return state, _LOST


@njit(cache=True, nogil=True, inline="always")
def _bounced_ray(walls, piece, along, sine):  # type: ignore[no-untyped-def]
    """The ray that leaves a piece, so far along it, by the sine of its angle to the normal."""
    tx, ty = walls.along_x[piece], walls.along_y[piece]
    cosine = np.sqrt(max(1.0 - sine * sine, 0.0))
    return _Ray(
        piece,
        walls.x[piece] + along * tx,
        walls.y[piece] + along * ty,
        sine * tx - cosine * ty,
        sine * ty + cosine * tx,
    )


@njit(cache=True, nogil=True, inline="always")
def _hit(walls, ray):  # type: ignore[no-untyped-def]
    """The piece that a ray meets first from its inner side, and how far along; -1 for none."""
    nearest, found, where = np.inf, -1, 0.0
    for piece in range(len(walls.x)):
        tx, ty, length = walls.along_x[piece], walls.along_y[piece], walls.length[piece]
        facing = ray.dx * ty - ray.dy * tx
        if piece == ray.piece or facing <= 0.0:
            continue
        ox, oy = walls.x[piece] - ray.x, walls.y[piece] - ray.y
        distance = (ox * ty - oy * tx) / facing
        along = (ox * ray.dy - oy * ray.dx) / facing
        # A hair more than the piece: no ray slips through where two of them meet.
        slack = 1e-12 * length
        if distance >= 0.0 and -slack <= along <= length + slack and distance < nearest:
            nearest, found, where = distance, piece, min(max(along, 0.0), length)
    return found, where
