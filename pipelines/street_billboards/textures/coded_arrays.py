"""The arrays of compressed textures while kernels write them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.textures.texture_tables import CompressedTextures

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Floats = NDArray[np.float32]


class CodedArrays(NamedTuple):
    """See CompressedTextures; by channel where there are three."""

    ranks: Bytes
    """(b, 3)."""
    first_plane: tuple[Ints, Ints, Ints]
    """(b + 1,), of planes and scales."""
    first_weight: tuple[Ints, Ints, Ints]
    """(b + 1,)."""
    means: Bytes
    """(v, 3)."""
    planes: tuple[Bytes, Bytes, Bytes]
    """(r, side²)."""
    scales: tuple[Floats, Floats, Floats]
    weights: tuple[Bytes, Bytes, Bytes]


def offsets(counts: NDArray[np.integer]) -> Ints:
    """(b + 1,): where each of groups of so many (b,) begins."""
    return np.concatenate([np.zeros(1, np.int64), np.cumsum(counts, dtype=np.int64)])


def grey_arrays(ranks: Bytes, views: Ints, sides: Ints) -> CodedArrays:
    """Arrays that stand for grey: ranks (b, 3), views (b,) of each billboard, sides (3,)."""
    many = ranks.astype(np.int64)
    first_plane = (offsets(many[:, 0]), offsets(many[:, 1]), offsets(many[:, 2]))
    each = many * views[:, None]
    first_weight = (offsets(each[:, 0]), offsets(each[:, 1]), offsets(each[:, 2]))

    def grey(*shape: int) -> Bytes:
        return np.full(shape, 128, np.uint8)

    counts = [int(first[-1]) for first in first_plane]
    sizes = [int(first[-1]) for first in first_weight]
    squares = [int(side) ** 2 for side in sides]
    return CodedArrays(
        ranks,
        first_plane,
        first_weight,
        grey(int(views.sum()), 3),
        (grey(counts[0], squares[0]), grey(counts[1], squares[1]), grey(counts[2], squares[2])),
        (
            np.zeros(counts[0], np.float32),
            np.zeros(counts[1], np.float32),
            np.zeros(counts[2], np.float32),
        ),
        (grey(sizes[0]), grey(sizes[1]), grey(sizes[2])),
    )


def as_textures(
    arrays: CodedArrays,
    *,
    colour: str,
    first: Ints,
    direction: Bytes,
    sides: Ints,
    first_mask: Ints,
    masks: Bytes,
) -> CompressedTextures:
    """The same, with what else there is to know; sides (3,) of planes."""
    luma, orange, green = (
        planes.reshape(-1, side, side) for planes, side in zip(arrays.planes, sides, strict=True)
    )
    return CompressedTextures(
        colour,
        first,
        direction,
        arrays.means,
        arrays.ranks,
        (luma, orange, green),
        arrays.scales,
        arrays.weights,
        first_mask,
        masks,
    )
