"""Distances rebuilt from bits of visibility: to the smoothest edges that the bits allow.

Between two directions that differ the edge crosses somewhere: nothing is known of where. Crossings
begin in the middle, and are moved along the side between both directions to where the edge bends
least, a few rounds, never beyond the side's ends.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.ssdf_lighting.distances import visible_edge
from pipelines.ssdf_lighting.distances.octahedral import (
    bilinear_taps,
    delaunay_sides,
    resolution_of,
    texel_directions,
)
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_arcs

Floats = NDArray[np.float32]

_ROUNDS = 8
_LEAST = 0.02
"""Share of a side that a crossing stays away from its ends."""


def visible_at(distances: Floats, m: int) -> NDArray[np.bool_]:
    """Visibility (P, m²) in other directions than those of d (P, n²): where d, interpolated, is
    positive."""
    taps = bilinear_taps(texel_directions(m), resolution_of(distances.shape[1]))
    shares = taps.weights.astype(np.float32)
    there = sum(shares[:, k] * distances[:, taps.texels[:, k]] for k in range(4))
    return np.asarray(there) > 0.0


def rebuilt_distances(visible: NDArray[np.bool_]) -> Floats:
    """d (P, n²) float32, radians, of visibility (P, n²); the signs are those of ``visible``.

    >>> up = texel_directions(32)[:, 2]
    >>> found = rebuilt_distances(up[None] > 0.0)[0]
    >>> float(abs(found - np.arcsin(up)).max()) < 0.05
    True
    """
    sides = delaunay_sides(resolution_of(visible.shape[1]))
    starts = visible_edge._count_crossings(visible, sides.ends)
    seen, unseen, _ = visible_edge._differing(visible, sides.ends, starts)
    arcs = visible_edge._arcs(visible, *sides, starts)
    directions = texel_directions(resolution_of(visible.shape[1])).astype(np.float32)
    after, before = np.empty(len(seen), np.int64), np.empty(len(seen), np.int64)
    after[arcs[:, 0]], before[arcs[:, 1]] = arcs[:, 1], arcs[:, 0]
    crossings = _smoothed(directions[seen], directions[unseen], after, before)
    return distances_to_arcs(visible, visible_edge.VisibleEdge(crossings, arcs, starts))


@njit(cache=True, nogil=True)
def _smoothed(
    near: Floats, far: Floats, after: NDArray[np.int64], before: NDArray[np.int64]
) -> Floats:
    """Crossings (M, 3) on sides from ``near`` to ``far`` (M, 3), in loops by both neighbours."""
    places = np.float32(0.5) * (near + far)
    for _ in range(_ROUNDS):
        for k in range(len(near)):
            one, other = before[k], after[k]
            beyond_one, beyond_other = before[one], after[other]
            along, length = np.float32(0.0), np.float32(0.0)
            # Number by number: rows as arrays take five times as long.
            for axis in range(3):
                # Where the fourth difference along the loop is 0.
                wanted = (
                    np.float32(4.0) * (places[one, axis] + places[other, axis])
                    - places[beyond_one, axis]
                    - places[beyond_other, axis]
                ) / np.float32(6.0)
                side = far[k, axis] - near[k, axis]
                along += (wanted - near[k, axis]) * side
                length += side * side
            share = min(max(along / length, np.float32(_LEAST)), np.float32(1.0 - _LEAST))
            for axis in range(3):
                places[k, axis] = near[k, axis] + share * (far[k, axis] - near[k, axis])
    for k in range(len(near)):
        places[k] /= np.sqrt((places[k] * places[k]).sum())
    return places
