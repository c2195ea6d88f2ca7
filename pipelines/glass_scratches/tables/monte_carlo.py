"""The scratch BRDF by paths, as the paper makes it (section 3.1, Eq. 1), for any roughness.

A bounce is described by the sine of its angle to the facet's normal. Light that is scattered evenly
leaves with a sine uniform in (-1, 1), whatever it came with; a mirror keeps the sine. Between the
two (which the paper leaves open) the sine of the mirror is blurred by a Gaussian, folded back at
+-1: a kernel that is symmetric and loses nothing, so reciprocity and the white furnace hold for
every roughness, with Lambert's law and the mirror as its ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_edges, bin_weights
from pipelines.glass_scratches.tables.exact import check_albedo

PLACES = 16
"""Parts of the opening's width for which paths are counted apart."""
_BOUNCES = 100_000


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


def blur_of(roughness: float) -> float:
    """Standard deviation of the blurred sine: 0 for a mirror, infinite for Lambert's law.

    Raises ValueError for a roughness outside [0, 1].
    """
    if not 0.0 <= roughness <= 1.0:
        raise ValueError(f"roughness is {roughness:g}; expected 0 (mirror) to 1 (diffuse).")
    return np.inf if roughness == 1.0 else roughness / (1.0 - roughness)


def shoot(
    profile: NDArray[np.float64],
    *,
    bins: int,
    rays: int,
    paths_per_ray: int,
    albedo: float,
    roughness: float,
    seed: int,
    incidence: NDArray[np.int64] | None = None,
) -> PathCounts:
    """Shoot ``rays`` rays (N) at the profile from every bin, ``paths_per_ray`` paths each (Nr).

    A ray enters at a random place of the opening, from a random direction of its bin (by the
    cosine); all its paths start there. ``incidence`` limits the bins that are shot from; the others
    count no paths. Walls keep a path with probability 1 - albedo. The result depends on the seed
    alone, not on the number of threads. Raises ValueError as :func:`blur_of`, ``check_albedo``.
    """
    check_albedo(albedo)
    blur = blur_of(roughness)
    edges = bin_edges(bins)
    chosen = np.arange(bins) if incidence is None else incidence
    leaving = np.zeros((bins, PLACES, bins), np.int64)
    squares = np.zeros((bins, bins), np.int64)
    kept = np.zeros(bins, np.int64)
    sines = np.sin(edges)
    _shoot(profile, sines, chosen, rays, paths_per_ray, albedo, blur, seed, leaving, squares, kept)
    return PathCounts(leaving, squares, kept, rays, paths_per_ray)


class PathTable(NamedTuple):
    """``rho``, ``standard_error`` (M out, M in); ``across`` (places, M out, M in): rho by the place
    across the opening, from the left end; ``absorbed`` (M in,)."""

    rho: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    across: NDArray[np.float64]
    absorbed: NDArray[np.float64]


def table(counts: PathCounts) -> PathTable:
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


@njit(cache=True, inline="always")
def _next(state):  # type: ignore[no-untyped-def]
    """One step of splitmix64: new state, and a double in [0, 1)."""
    state = state + np.uint64(0x9E3779B97F4A7C15)
    z = state
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return state, np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@njit(cache=True, inline="always")
def _folded(sine):  # type: ignore[no-untyped-def]
    """A number reflected at -1 and 1 until it lies between."""
    turn = np.fmod(sine + 1.0, 4.0)
    if turn < 0.0:
        turn += 4.0
    return turn - 1.0 if turn <= 2.0 else 3.0 - turn


@njit(cache=True, parallel=True)
def _shoot(  # type: ignore[no-untyped-def]
    profile, sines, chosen, rays, paths, albedo, blur, seed, leaving, squares, kept
):
    pieces = len(profile) - 1
    bins = len(sines) - 1
    left, width = profile[0, 0], profile[-1, 0] - profile[0, 0]
    length = np.empty(pieces)
    tx, ty = np.empty(pieces), np.empty(pieces)
    for piece in range(pieces):
        dx = profile[piece + 1, 0] - profile[piece, 0]
        dy = profile[piece + 1, 1] - profile[piece, 1]
        length[piece] = np.sqrt(dx * dx + dy * dy)
        tx[piece], ty[piece] = dx / length[piece], dy / length[piece]
    lambert = np.isinf(blur)
    for number in prange(len(chosen)):
        bin_in = chosen[number]
        state = np.uint64(seed) * np.uint64(0xD1342543DE82EF95) + np.uint64(bin_in + 1) * np.uint64(
            0xAF251AF3B0F025B5
        )
        state, _ = _next(state)
        own = np.zeros(bins, np.int64)
        touched = np.empty(paths, np.int64)
        for _ray in range(rays):
            state, u = _next(state)
            place = min(int(u * leaving.shape[1]), leaving.shape[1] - 1)
            x0 = left + width * u
            state, u = _next(state)
            sine = sines[bin_in] + u * (sines[bin_in + 1] - sines[bin_in])
            dx0, dy0 = -sine, -np.sqrt(max(1.0 - sine * sine, 0.0))
            first = _hit(profile, tx, ty, length, pieces, -1, x0, 0.0, dx0, dy0)
            reached = 0
            for _path in range(paths):
                if first[0] < 0:  # along the opening, between the two ends: leaves as it came
                    break
                piece, along = first
                dx, dy = dx0, dy0
                for _bounce in range(_BOUNCES):
                    state, u = _next(state)
                    if u >= albedo:
                        kept[bin_in] += 1
                        break
                    state, u = _next(state)
                    if lambert:
                        s = 2.0 * u - 1.0
                    else:
                        s = dx * tx[piece] + dy * ty[piece]
                        if blur > 0.0:
                            state, v = _next(state)
                            normal = np.sqrt(-2.0 * np.log(1.0 - u)) * np.cos(2.0 * np.pi * v)
                            s = _folded(s + blur * normal)
                    c = np.sqrt(max(1.0 - s * s, 0.0))
                    x = profile[piece, 0] + along * tx[piece]
                    y = profile[piece, 1] + along * ty[piece]
                    dx = s * tx[piece] - c * ty[piece]
                    dy = s * ty[piece] + c * tx[piece]
                    piece, along = _hit(profile, tx, ty, length, pieces, piece, x, y, dx, dy)
                    if piece < 0:
                        angle = np.arctan2(dx, max(dy, 0.0))
                        out = int((angle / np.pi + 0.5) * bins)
                        out = min(max(out, 0), bins - 1)
                        leaving[bin_in, place, out] += 1
                        if own[out] == 0:
                            touched[reached] = out
                            reached += 1
                        own[out] += 1
                        break
            for index in range(reached):
                out = touched[index]
                squares[bin_in, out] += own[out] * own[out]
                own[out] = 0


@njit(cache=True, inline="always")
def _hit(profile, tx, ty, length, pieces, own, x, y, dx, dy):  # type: ignore[no-untyped-def]
    """The piece that a ray meets first from its inner side, and how far along; -1 for none."""
    nearest, found, where = np.inf, -1, 0.0
    for piece in range(pieces):
        facing = dx * ty[piece] - dy * tx[piece]
        if piece == own or facing <= 0.0:
            continue
        ox, oy = profile[piece, 0] - x, profile[piece, 1] - y
        distance = (ox * ty[piece] - oy * tx[piece]) / facing
        along = (ox * dy - oy * dx) / facing
        # A hair more than the piece: no ray slips through where two of them meet.
        slack = 1e-12 * length[piece]
        if distance >= 0.0 and -slack <= along <= length[piece] + slack and distance < nearest:
            nearest, found, where = distance, piece, min(max(along, 0.0), length[piece])
    return found, where
