"""A profile cut into facets, and the lengths of strings drawn taut between them.

In a plane, what two facets send each other is (crossed - uncrossed strings) / 2 (Hottel). Between
facets that see each other only in part the strings run around what stands between them: they are
the shortest paths inside the profile. And for light from a direction the string simply goes on
to infinity. So all factors of a scratch of any shape follow, without quadrature, from the lengths
of shortest paths between the ends of its facets, and their sums are right to the last bits: lengths
cancel in pairs.

The interior is on the left of the profile as it runs from the left to the right end.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

_CORNER = np.radians(20.0)


class Strings(NamedTuple):
    """Lengths of shortest paths inside a profile with V = facets + 1 vertices.

    ``between`` (V, V): from vertex to vertex. ``beyond`` (V, K): from vertex to infinity in each of
    K directions, less the distance of infinity from the origin.
    """

    between: NDArray[np.float64]
    beyond: NDArray[np.float64]


def facet_ends(profile: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Cut a profile (P, 2) into about ``count`` straight facets; their ends (facets + 1, 2).

    The points of the profile are kept. Facets grow finer towards the opening's ends and towards
    corners, where radiosity changes fast: they are spaced as the cosine of equal angles.
    """
    steps = np.diff(profile, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs((np.diff(headings) + np.pi) % (2 * np.pi) - np.pi)
    corners = [0, *(np.flatnonzero(turns > _CORNER) + 1), len(steps)]
    ends = [profile[:1]]
    for first, last in itertools.pairwise(corners):
        reached = np.concatenate([[0.0], np.cumsum(lengths[first:last])])
        share = max(1.0, count * reached[-1] / lengths.sum())
        angles = np.arccos(1 - 2 * np.clip(reached / reached[-1], 0.0, 1.0)) / np.pi
        for piece in range(last - first):
            pieces = max(1, round(share * (angles[piece + 1] - angles[piece])))
            angle = np.linspace(angles[piece], angles[piece + 1], pieces + 1)[1:]
            along = (1 - np.cos(np.pi * angle)) / 2 * reached[-1] - reached[piece]
            along[-1] = lengths[first + piece]
            way = steps[first + piece] / lengths[first + piece]
            cut = profile[first + piece] + along[:, None] * way
            cut[-1] = profile[first + piece + 1]
            ends.append(cut)
    return np.concatenate(ends)


def taut_strings(
    profile: NDArray[np.float64], ends: NDArray[np.float64], angles: NDArray[np.float64]
) -> Strings:
    """Shortest paths between the facets' ends (V, 2), and from them into directions.

    ``angles`` (K,) in [-pi/2, pi/2] from n towards v. Brute force over the profile's points, which
    are few: O(V² P) and O(V K P).
    """
    # Where strings can bend: points of the profile that stick out into the scratch, and its ends.
    before, after = np.diff(profile, axis=0)[:-1], np.diff(profile, axis=0)[1:]
    outward = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < 0
    bends = np.vstack([profile[:1], profile[1:-1][outward], profile[-1:]])
    inner = np.array([int(np.argmin(np.hypot(*(ends - bend).T))) for bend in bends], dtype=np.int64)
    seen = _seen(ends, profile)
    direct = np.where(seen, _distances(ends), np.inf)
    among = direct[np.ix_(inner, inner)]
    for middle in range(len(inner)):  # shortest paths over all bends (Floyd, Warshall)
        among = np.minimum(among, among[:, middle, None] + among[None, middle])
    to_bends = _least_sum(np.ascontiguousarray(direct[:, inner]), among)
    around = _least_sum(np.ascontiguousarray(direct[:, inner]), np.ascontiguousarray(to_bends.T))
    between = np.where(seen, direct, around)
    ways = np.stack([np.sin(angles), np.cos(angles)], axis=-1)
    return Strings((between + between.T) / 2, _beyond(ends, inner, to_bends, ways, profile))


def _distances(points: NDArray[np.float64]) -> NDArray[np.float64]:
    step = points[:, None] - points[None]
    return np.hypot(step[..., 0], step[..., 1])


@njit(cache=True, nogil=True)
def _turn(ax, ay, bx, by, cx, cy):  # type: ignore[no-untyped-def]
    """Twice the area of a triangle: positive where c lies left of the line from a to b."""
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


@njit(cache=True, nogil=True)
def _leaves_inwards(ends, vertex, wx, wy, tolerance):  # type: ignore[no-untyped-def]
    """Whether a step (wx, wy) from a vertex of the profile goes into the scratch, or along it."""
    last = len(ends) - 1
    left_of_next = left_of_before = True
    convex = True
    if vertex < last:
        nx, ny = ends[vertex + 1, 0] - ends[vertex, 0], ends[vertex + 1, 1] - ends[vertex, 1]
        left_of_next = nx * wy - ny * wx >= -tolerance
    if vertex > 0:
        bx, by = ends[vertex, 0] - ends[vertex - 1, 0], ends[vertex, 1] - ends[vertex - 1, 1]
        left_of_before = bx * wy - by * wx >= -tolerance
    if 0 < vertex < last:
        convex = bx * ny - by * nx >= 0
    if convex:
        return left_of_next and left_of_before
    return left_of_next or left_of_before


@njit(cache=True, nogil=True)
def _blocked(profile, ax, ay, bx, by, tolerance):  # type: ignore[no-untyped-def]
    """Whether the line from a to b leaves the scratch between its ends: by properly crossing a
    piece of the profile, or through one of its points, where that is not just grazed."""
    last = len(profile) - 1
    px, py = profile[0, 0], profile[0, 1]
    one = _turn(ax, ay, bx, by, px, py)
    for e in range(last):
        qx, qy = profile[e + 1, 0], profile[e + 1, 1]
        other = _turn(ax, ay, bx, by, qx, qy)
        if (one > tolerance and other < -tolerance) or (one < -tolerance and other > tolerance):
            from_a = _turn(px, py, qx, qy, ax, ay)
            from_b = _turn(px, py, qx, qy, bx, by)
            if (from_a > tolerance and from_b < -tolerance) or (
                from_a < -tolerance and from_b > tolerance
            ):
                return True
        if e + 1 < last and -tolerance <= other <= tolerance:
            wx, wy = bx - ax, by - ay
            along = (qx - ax) * wx + (qy - ay) * wy
            if tolerance < along < wx * wx + wy * wy - tolerance and not (
                _leaves_inwards(profile, e + 1, wx, wy, tolerance)
                and _leaves_inwards(profile, e + 1, -wx, -wy, tolerance)
            ):
                return True
        px, py, one = qx, qy, other
    return False


@njit(cache=True, nogil=True, parallel=True)
def _seen(ends, profile):  # type: ignore[no-untyped-def]
    """(V, V) bool: whether the straight line between two vertices stays inside."""
    count = len(ends)
    scale = np.abs(ends).max()
    tolerance = 1e-13 * scale * scale
    seen = np.ones((count, count), np.bool_)
    for a in prange(count):
        for b in range(a + 1, count):
            ax, ay, bx, by = ends[a, 0], ends[a, 1], ends[b, 0], ends[b, 1]
            free = (
                _leaves_inwards(ends, a, bx - ax, by - ay, tolerance)
                and _leaves_inwards(ends, b, ax - bx, ay - by, tolerance)
                and not _blocked(profile, ax, ay, bx, by, tolerance)
            )
            seen[a, b] = free
    for a in prange(count):
        for b in range(a):
            seen[a, b] = seen[b, a]
    return seen


@njit(cache=True, nogil=True, parallel=True)
def _least_sum(left, right):  # type: ignore[no-untyped-def]
    """Matrix product with + for times and the minimum for the sum."""
    rows, inner = left.shape
    columns = right.shape[1]
    least = np.full((rows, columns), np.inf)
    for row in prange(rows):
        for middle in range(inner):
            start = left[row, middle]
            if start < np.inf:
                for column in range(columns):
                    value = start + right[middle, column]
                    if value < least[row, column]:
                        least[row, column] = value
    return least


@njit(cache=True, nogil=True, parallel=True)
def _beyond(ends, inner, to_bends, ways, profile):  # type: ignore[no-untyped-def]
    """(V, K): least, over the places where the string may leave for infinity, of its length."""
    count, directions = len(ends), len(ways)
    scale = np.abs(ends).max()
    tolerance = 1e-13 * scale * scale
    far = 8.0 * scale
    lengths = np.empty((count, directions))
    for k in prange(directions):
        wx, wy = ways[k, 0] * far, ways[k, 1] * far
        leaving = np.full(len(inner), np.inf)
        for bend in range(len(inner)):
            x, y = ends[inner[bend], 0], ends[inner[bend], 1]
            at_end = bend == 0 or bend == len(inner) - 1
            if at_end or (
                _leaves_inwards(ends, inner[bend], wx, wy, tolerance)
                and not _blocked(profile, x, y, x + wx, y + wy, tolerance)
            ):
                leaving[bend] = -(x * ways[k, 0] + y * ways[k, 1])
        for vertex in range(count):
            x, y = ends[vertex, 0], ends[vertex, 1]
            if _leaves_inwards(ends, vertex, wx, wy, tolerance) and not _blocked(
                profile, x, y, x + wx, y + wy, tolerance
            ):
                lengths[vertex, k] = -(x * ways[k, 0] + y * ways[k, 1])
            else:
                least = np.inf
                for bend in range(len(inner)):
                    value = to_bends[vertex, bend] + leaving[bend]
                    if value < least:
                        least = value
                lengths[vertex, k] = least
    return lengths
