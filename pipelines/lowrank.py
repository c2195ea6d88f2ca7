"""Low-rank factorisation of matrices too large to hold: principal components, block by block."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ColumnBlocks = Callable[[], Iterable[NDArray[np.floating]]]
"""Starts a pass over a matrix (rows, columns): blocks (rows, some of the columns) from the left."""

_OVERSAMPLING = 8


class PrincipalComponents(NamedTuple):
    """A matrix (rows, columns), its columns' means taken off, is about ``scores @ loadings.T``."""

    scores: NDArray[np.float32]
    """(rows, rank), orthogonal; the most important first."""
    loadings: NDArray[np.float32]
    """(columns, rank), orthonormal."""
    singular_values: NDArray[np.float64]
    """(rank,), the lengths of the scores."""


def principal_components(
    blocks: ColumnBlocks, rank: int, *, iterations: int = 2, seed: int = 0
) -> PrincipalComponents:
    """The ``rank`` largest principal components of the rows, in ``iterations + 2`` passes.

    Randomised subspace iteration (Halko, Martinsson, Tropp 2011, algorithm 4.4) over blocks of
    columns: memory is one block and a few (rows, rank) arrays. Two iterations find singular values
    that decay to a fraction of a per cent, those of noise (no decay) to some two per cent. A matrix
    of lower rank gives components of length 0. Signs are fixed: the largest entry of every loading
    is positive.

    Raises ValueError where ``rank`` is not between 1 and the number of rows or columns.

    >>> matrix = np.outer([1.0, -1.0, 2.0, -2.0], [3.0, 0.0, 4.0])  # rank 1, columns of mean 0
    >>> found = principal_components(lambda: [matrix[:, :2], matrix[:, 2:]], 1)
    >>> found.scores.shape, found.loadings[:, 0].astype(float).round(4).tolist()
    ((4, 1), [0.6, 0.0, 0.8])
    """
    random = np.random.default_rng(seed)
    rows = columns = 0
    sketch: NDArray[np.float64] | None = None
    for block in blocks():
        centred = _centred(block)
        rows, columns = len(block), columns + block.shape[1]
        width = min(rank + _OVERSAMPLING, rows)
        directions = random.standard_normal((block.shape[1], width), dtype=np.float32)
        part = (centred @ directions).astype(np.float64)
        sketch = part if sketch is None else sketch + part
    if sketch is None or not 1 <= rank <= min(rows, columns):
        raise ValueError(
            f"rank is {rank}; expected 1 to {min(rows, columns)} for a {rows} x {columns} matrix."
        )
    for _ in range(iterations):
        basis = _orthonormal(sketch)
        sketch = np.zeros_like(sketch)
        for block in blocks():
            centred = _centred(block)
            sketch += centred @ (centred.T @ basis)
    basis = _orthonormal(sketch)
    projected = np.concatenate([_centred(block).T @ basis for block in blocks()])
    left, lengths, right = np.linalg.svd(projected.astype(np.float64), full_matrices=False)
    loadings, turned = left[:, :rank], right[:rank].T
    signs = np.sign(loadings[np.abs(loadings).argmax(axis=0), np.arange(rank)])
    signs[signs == 0] = 1.0
    scores = (basis @ turned) * (lengths[:rank] * signs)
    return PrincipalComponents(
        scores.astype(np.float32), (loadings * signs).astype(np.float32), lengths[:rank]
    )


def _centred(block: NDArray[np.floating]) -> NDArray[np.float32]:
    values = block.astype(np.float32)
    values -= values.mean(axis=0, dtype=np.float64).astype(np.float32)
    return values


def _orthonormal(columns: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.linalg.qr(columns)[0].astype(np.float32)


class RightSingularVectors(NamedTuple):
    """A matrix (rows, columns), nothing taken off, is about ``(matrix @ vectors) @ vectors.T``."""

    vectors: NDArray[np.float32]
    """(columns, rank), orthonormal; the most important first."""
    singular_values: NDArray[np.float64]
    """(rank,)."""
    lost: float
    """Sum of the squares of what is left out."""


def right_singular_vectors(gram: NDArray[np.float64], lost: float) -> RightSingularVectors:
    """The fewest right singular vectors that leave out at most ``lost``, a sum of squares.

    ``gram`` (columns, columns) is the matrix' transpose times the matrix: summed over blocks of
    rows it has one size whatever their number. Subspace iteration, its rank doubled until it is
    enough; where that comes near to all of them, a complete eigendecomposition.
    """
    columns = len(gram)
    total = float(np.trace(gram))
    single = gram.astype(np.float32)
    random = np.random.default_rng(0)
    basis = random.standard_normal((columns, 0), dtype=np.float32)
    width = 128
    while True:
        if 2 * width >= columns:
            values, vectors = np.linalg.eigh(gram)
            break
        more = random.standard_normal((columns, width - basis.shape[1]), dtype=np.float32)
        basis = _orthonormal(np.concatenate([basis, more], axis=1))
        for _ in range(4):
            basis = _orthonormal(single @ basis)
        values, turned = np.linalg.eigh(basis.T.astype(np.float64) @ gram @ basis)
        vectors = basis @ turned
        # The last few of the subspace are not its matrix' own yet.
        values, vectors = values[_OVERSAMPLING:], vectors[:, _OVERSAMPLING:]
        if total - float(values.sum()) <= lost:
            break
        width *= 2
    squares = np.maximum(values[::-1], 0.0)
    left = np.maximum(total - np.cumsum(squares), 0.0)
    rank = min(int(np.searchsorted(-left, -lost)) + 1, len(squares))
    signed = vectors[:, ::-1][:, :rank]
    signed = signed * np.where(signed[np.abs(signed).argmax(axis=0), np.arange(rank)] < 0, -1, 1)
    return RightSingularVectors(
        signed.astype(np.float32), np.sqrt(squares[:rank]), float(left[rank - 1])
    )
