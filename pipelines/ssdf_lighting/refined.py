"""Distances to the refined edge of visibility, small holes included."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.distances import distances_to_arcs
from pipelines.ssdf_lighting.octahedral import texel_directions
from pipelines.ssdf_lighting.visibility import RayOrigins, visible_directions
from pipelines.ssdf_lighting.visible_edge import visible_edge

if TYPE_CHECKING:
    from open3d.t.geometry import RaycastingScene

_FINER = 4
"""Times as many directions along the square's side, where no edge was found."""


def refined_distances(
    scene: RaycastingScene, origins: RayOrigins, visible: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """d (P, n²) float32, radians, of P points whose ``visible`` (P, n²) is known.

    A point that sees nothing, or everything, may have missed a hole smaller than a texel, and its
    distances would be wrong everywhere: it looks again, with 16 times as many directions. The
    signs stay those of ``visible``.
    """
    distances = distances_to_arcs(visible, visible_edge(scene, origins.points, visible))
    alike = (visible == visible[:, :1]).all(axis=1)
    n = round(visible.shape[1] ** 0.5)
    for point in np.flatnonzero(alike & ~origins.sealed):
        one = RayOrigins(origins.points[point : point + 1], np.zeros(1, bool))
        closer = visible_directions(scene, one, texel_directions(_FINER * n))
        if closer.all() or not closer.any():
            continue
        edge = visible_edge(scene, one.points, closer)
        distances[point] = distances_to_arcs(visible[point : point + 1], edge)[0]
    return distances
