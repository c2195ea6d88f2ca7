"""Values on the octahedral directions, weighted by solid angle.

Texels differ 5 : 1 in solid angle. Each column of a matrix (vertices, directions) is multiplied by
the root of its share of the sphere, so that plain sums of squares, and what minimises them,
are integrals over the sphere.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.distances.octahedral import resolution_of, solid_angles


def root_weights(directions: int) -> NDArray[np.float32]:
    """Factors (directions,) of the columns; the mean of their squares is 1."""
    areas = solid_angles(resolution_of(directions))
    return np.sqrt(areas / areas.mean()).astype(np.float32)


def weighted_gram(blocks: Iterable[NDArray[np.float32]]) -> NDArray[np.float64]:
    """Xᵀ X (directions, directions) of the weighted matrix X; blocks (rows, directions) of it."""
    gram: NDArray[np.float64] | None = None
    for block in blocks:
        weighted = block * root_weights(block.shape[1])
        part = weighted.T @ weighted
        gram = part.astype(np.float64) if gram is None else np.add(gram, part, out=gram)
    if gram is None:
        raise ValueError("blocks: found none; expected at least one.")
    return gram
