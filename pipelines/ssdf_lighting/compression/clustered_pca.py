"""The paper's compression: an SVD for each cluster, the strongest m vectors kept in full.

A cluster's matrix has the SSDFs of the vertices of its triangles; a vertex on a border is in
several. Nothing is taken off before the SVD. How many are kept is a number, or follows from a
*contribution*: the share that they have of the sum of the singular values. The *cumulative error*
of the paper's table is read as the sum over clusters of |lost| / |matrix|, Frobenius norms. The
paper defines neither; with these readings its figures come out (docs/ssdf.md).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ReadRows = Callable[[NDArray[np.int64]], NDArray[np.float32]]
"""Rows (n, D) of the matrix by vertex number, ascending."""


class ClusteredPca(NamedTuple):
    """Every cluster's vectors and its vertices' weights, single precision.

    vectors: (M, D), orthonormal within a cluster; first: (K + 1,) where a cluster's begin.
    row_vertex: (rows,) the vertex of each row, cluster by cluster; row_first: (K + 1,).
    weights: (W,) row by row, as many a row as its cluster has vectors.
    relative_error: (K,) |lost| / |matrix| of each cluster.
    """

    vectors: NDArray[np.float32]
    first: NDArray[np.int64]
    row_vertex: NDArray[np.int32]
    row_first: NDArray[np.int64]
    weights: NDArray[np.float32]
    relative_error: NDArray[np.float64]

    @property
    def nbytes(self) -> int:
        """Bytes of vectors and weights, as the paper counts."""
        return self.vectors.nbytes + self.weights.nbytes


def clustered_pca(
    read: ReadRows,
    triangles: NDArray[np.integer],
    cluster: NDArray[np.integer],
    *,
    values: int | None = None,
    contribution: float | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> ClusteredPca:
    """Compress by ``values`` vectors a cluster (as many as it has rows where that is less), or by
    as many as ``contribution``, in (0, 1], takes. ``cluster`` (F,) of triangles (F, 3).

    Raises ValueError unless exactly one of the two is given.
    """
    if (values is None) == (contribution is None):
        raise ValueError("values, contribution: expected one of them.")
    wanted = 1.0 if contribution is None else contribution
    count = int(cluster.max()) + 1
    vectors, weights, rows, errors = [], [], [], []
    for number in range(count):
        members = np.unique(triangles[cluster == number]).astype(np.int64)
        matrix = read(members)
        left, sigma, right = gram_svd(matrix)
        if values is not None:
            kept = min(values, len(sigma))
        else:
            share = np.cumsum(sigma) / max(float(sigma.sum()), 1e-300)
            kept = min(int(np.searchsorted(share, wanted)) + 1, len(sigma))
        vectors.append(right[:kept])
        weights.append((left[:, :kept] * sigma[:kept]).astype(np.float32))
        rows.append(members)
        lost = matrix - weights[-1] @ right[:kept]
        norms = [float(np.linalg.norm(part.astype(np.float64))) for part in (lost, matrix)]
        errors.append(norms[0] / norms[1] if norms[1] > 0 else 0.0)
        progress((number + 1) / count)
    return ClusteredPca(
        np.concatenate(vectors),
        np.cumsum([0, *(len(part) for part in vectors)]),
        np.concatenate(rows).astype(np.int32),
        np.cumsum([0, *(len(part) for part in rows)]),
        np.concatenate([part.ravel() for part in weights]),
        np.array(errors),
    )


def gram_svd(
    matrix: NDArray[np.float32],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32]]:
    """SVD u (n, r), sigma (r,), v (r, D) of a matrix (n, D) by its smaller Gram matrix.

    Singular values that are rounding alone are left out, so r may be less than n and D.
    """
    exact = matrix.astype(np.float64)
    wide = matrix.shape[0] <= matrix.shape[1]
    values, vectors = np.linalg.eigh(exact @ exact.T if wide else exact.T @ exact)
    sigma = np.sqrt(np.maximum(values[::-1], 0.0))
    vectors = vectors[:, ::-1]
    real = sigma > 1e-7 * max(sigma[0], 1e-300)  # the rest is rounding
    sigma, vectors = sigma[real], vectors[:, real]
    if not len(sigma):  # all zero
        return np.zeros((len(matrix), 1)), np.zeros(1), np.eye(1, matrix.shape[1], dtype=np.float32)
    if wide:
        return vectors, sigma, ((exact.T @ vectors) / sigma).T.astype(np.float32)
    return (exact @ vectors) / sigma, sigma, vectors.T.astype(np.float32)
