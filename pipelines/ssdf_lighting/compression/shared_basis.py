"""The scene's own basis: the strongest right singular vectors of all its SSDFs.

Found from the Gram matrix, so that the SSDFs are read twice, block by block, and never lie in
memory together. Clusters are found in it and compressed in it (compact.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.lowrank import right_singular_vectors
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights, weighted_gram


class SharedBasis(NamedTuple):
    """``vectors`` (D, R) orthonormal, ``sigma`` (R,): the scene's strongest; ``coordinates`` (V, R)
    of the vertices in them; ``lost``, the sum of squares that they leave out."""

    vectors: NDArray[np.float32]
    sigma: NDArray[np.float64]
    coordinates: NDArray[np.float32]
    lost: float


def shared_basis(
    read_blocks: Callable[[], Iterable[NDArray[np.float32]]],
    shape: tuple[int, int],
    rmse: float,
    progress: Callable[[float], None] = lambda fraction: None,
) -> SharedBasis:
    """The fewest vectors that leave out an error of at most ``rmse`` (radians, weighted by solid
    angle) of a matrix of this ``shape`` (V, D).

    read_blocks: gives the matrix in blocks of rows (n, D), in order; called twice.

    >>> import numpy as np
    >>> rows = np.outer(np.linspace(0.5, 1.0, 10), np.ones(64)).astype(np.float32)
    >>> basis = shared_basis(lambda: [rows[:6], rows[6:]], rows.shape, 0.001)
    >>> basis.vectors.shape, basis.coordinates.shape
    ((64, 1), (10, 1))
    """
    done = 0

    def counted() -> Iterator[NDArray[np.float32]]:
        nonlocal done
        for block in read_blocks():
            yield block
            done += len(block)
            progress(done / (2 * shape[0]))

    found = right_singular_vectors(weighted_gram(counted()), rmse**2 * (shape[0] * shape[1]))
    coordinates = np.concatenate(
        [(block * root_weights(block.shape[1])) @ found.vectors for block in counted()]
    )
    return SharedBasis(found.vectors, found.singular_values, coordinates, found.lost)
