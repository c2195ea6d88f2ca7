"""Levels cut into tiles, and symbols predicted from those that were decoded before.

A symbol is predicted from five: left, above, above left and above right in its own tile, and the
one above it in the next coarser level. What is coded is the difference, in 8 bits that wrap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from storage.btf_file.contents import level_size
from storage.btf_file.rans import Ints, StreamDecoder
from storage.btf_file.tables import LARGEST, LEAST

PREDICTORS = 5
"""Left, above, above left, above right, parent."""
PHASES = 4
"""2 (row mod 2) + column mod 2: where a texel lies in its parent."""
_FRACTION = 5
"""Bits of a coefficient behind the point."""


@dataclass(frozen=True)
class Level:
    """A level of latents in tiles of ``side`` x ``side`` texels, row by row; ``side`` is even."""

    rows: int
    columns: int
    side: int

    @property
    def largest(self) -> tuple[int, int]:
        """Rows and columns of the largest tile."""
        return min(self.side, self.rows), min(self.side, self.columns)

    @property
    def tile_columns(self) -> int:
        """Tiles side by side."""
        return -(-self.columns // self.side)

    @property
    def tiles(self) -> int:
        """All tiles."""
        return -(-self.rows // self.side) * self.tile_columns

    def sizes(self, tiles: Ints) -> tuple[Ints, Ints]:
        """Rows and columns of these tiles; the last ones are smaller."""
        down, across = np.divmod(tiles, self.tile_columns)
        rows = np.minimum(self.side, self.rows - down * self.side)
        return rows, np.minimum(self.side, self.columns - across * self.side)

    def cut(self, texels: Ints) -> list[Ints]:
        """Values (rows, columns, C) as each tile's, one behind the other: (n,)."""
        side = self.side
        return [
            texels[row : row + side, column : column + side].reshape(-1)
            for row in range(0, self.rows, side)
            for column in range(0, self.columns, side)
        ]

    def joined(self, tiles: Ints) -> Ints:
        """Texels (rows, columns, C) of all tiles (tile, row, column, C) of the largest's size."""
        rows, columns = self.largest
        across, channels = self.tile_columns, tiles.shape[-1]
        grid = tiles.reshape(-1, across, rows, columns, channels).swapaxes(1, 2)
        whole = grid.reshape(-1, across * columns, channels)
        return whole[: self.rows, : self.columns]


def levels_of(height: int, width: int, coarser: int, side: int) -> list[Level]:
    """The finest level and the coarser ones."""
    return [Level(*level_size(height, width, level), side) for level in range(coarser + 1)]


def differences(found: Ints, predicted: Ints) -> Ints:
    """What is coded of symbols, -128 to 127."""
    return (found - predicted - LEAST & 255) + LEAST


def predicted(around: Ints, coefficients: Ints) -> Ints:
    """The prediction (…) of the five around it (…, 5) and their coefficients (…, 5), in 1/32."""
    found = np.einsum("...i,...i", around, coefficients) + (1 << (_FRACTION - 1)) >> _FRACTION
    return np.minimum(np.maximum(found, LEAST), LARGEST)


def surroundings(level: Level, texels: Ints, coarser: Ints | None) -> Ints:
    """The five around each symbol, (rows, columns, C, 5), when all symbols are known.

    Outside the tile: in its first row, those above are the left one; in its first column, those to
    the left are the one above; above right of its last column is the one above; left of and above
    its first texel are 0. The parent is 0 where there is no coarser level.
    """
    row, column = np.indices((level.rows, level.columns))
    inside_row, inside_column = row % level.side, column % level.side
    first_row, first_column = (inside_row == 0)[..., None], (inside_column == 0)[..., None]
    padded = np.pad(texels, ((1, 0), (1, 1), (0, 0)))
    left, above = padded[1:, :-2], padded[:-1, 1:-1]
    last = (inside_column == level.side - 1) | (column == level.columns - 1)
    above_right = np.where(last[..., None], above, padded[:-1, 2:])
    left = np.where(first_column, np.where(first_row, 0, above), left)
    above_left = np.where(first_column, above, padded[:-1, :-2])
    parent = np.zeros_like(texels) if coarser is None else coarser[row // 2, column // 2]
    above, above_left, above_right = (
        np.where(first_row, left, other) for other in (above, above_left, above_right)
    )
    return np.stack([left, above, above_left, above_right, parent], axis=-1)


def phases(level: Level) -> Ints:
    """The phase of each texel, (rows, columns)."""
    row, column = np.indices((level.rows, level.columns))
    return 2 * (row % 2) + column % 2


def decode_tiles(
    decoder: StreamDecoder,
    level: Level,
    tiles: Ints,
    parents: Ints | None,
    coefficients: Ints,
    numbers: Ints,
) -> Ints:
    """Symbols (tile, row, column, C) of these tiles of a level, 0 outside the level.

    ``decoder``: their streams; ``parents`` (tile, side / 2, side / 2, C): the part of the coarser
    level above each; ``coefficients`` (4, C, 5) by phase; ``numbers`` (C,): each channel's table.
    """
    rows, columns = level.sizes(tiles)
    channels = len(numbers)
    found = np.zeros((len(tiles), *level.largest, channels), np.int64)
    for row in range(int(rows.max())):
        for column in range(int(columns.max())):
            lanes = np.flatnonzero((rows > row) & (columns > column))
            around = np.zeros((len(lanes), channels, PREDICTORS), np.int64)
            if row and column:
                around[..., 0] = found[lanes, row, column - 1]
                around[..., 1] = found[lanes, row - 1, column]
                around[..., 2] = found[lanes, row - 1, column - 1]
                right = np.minimum(column + 1, columns[lanes] - 1)
                around[..., 3] = found[lanes, row - 1, right]
            elif row:
                around[..., :3] = found[lanes, row - 1, 0][..., None]
                right = np.minimum(1, columns[lanes] - 1)
                around[..., 3] = found[lanes, row - 1, right]
            elif column:
                around[..., :4] = found[lanes, 0, column - 1][..., None]
            if parents is not None:
                around[..., 4] = parents[lanes, row // 2, column // 2]
            guess = predicted(around, coefficients[2 * (row % 2) + column % 2])
            coded = decoder.take(lanes, numbers[None])
            found[lanes, row, column] = (guess + coded - LEAST & 255) + LEAST
    return found


def parents_of(level: Level, tiles: Ints, coarser: Level, known: Ints) -> Ints:
    """What lies above these tiles, (tile, side / 2, side / 2, C), of tiles of the coarser level.

    ``known`` (tile, row, column, C): all tiles of the coarser level, or the one that is above.
    """
    down, across = np.divmod(tiles, level.tile_columns)
    above = down // 2 * coarser.tile_columns + across // 2 if len(known) > 1 else 0 * tiles
    half = level.side // 2
    row, column = (
        np.minimum((place % 2 * half)[:, None] + np.arange(half), most - 1)
        for place, most in zip((down, across), coarser.largest, strict=True)
    )
    return known[above[:, None, None], row[:, :, None], column[:, None, :]]


def fitted_coefficients(
    levels: list[Level], texels: list[Ints], coarser: list[Ints | None]
) -> tuple[Ints, list[Ints]]:
    """Least squares coefficients (4, C, 5) for these levels, and each level's differences.

    A channel in which a prediction does not pay has coefficients of 0.
    """
    channels = texels[0].shape[-1]
    around = [surroundings(*three) for three in zip(levels, texels, coarser, strict=True)]
    known = np.concatenate([values.reshape(-1, channels, PREDICTORS) for values in around])
    wanted = np.concatenate([values.reshape(-1, channels) for values in texels])
    phase = np.concatenate([phases(level).reshape(-1) for level in levels])
    found = np.zeros((PHASES, channels, PREDICTORS), np.int64)
    for which in range(PHASES):
        here = phase == which
        for channel in range(channels):
            columns, target = known[here, channel].astype(float), wanted[here, channel]
            best = np.linalg.lstsq(columns, target, rcond=1e-6)[0] * (1 << _FRACTION)
            found[which, channel] = np.clip(np.rint(best), -LARGEST, LARGEST)
    for channel in range(channels):
        errors = wanted[:, channel] - predicted(known[:, channel], found[phase, channel])
        # Five coefficients a phase take some 15 bytes: on a few texels nothing is gained.
        gain = 0.5 * len(errors) * np.log2(_spread(wanted[:, channel]) / _spread(errors))
        if gain < 8 * PHASES * PREDICTORS:
            found[:, channel] = 0
    return found, [
        differences(values, predicted(near, found[phases(level)]))
        for level, values, near in zip(levels, texels, around, strict=True)
    ]


def _spread(values: Ints) -> float:
    """Variance of whole numbers, with that of what was rounded away."""
    return float(np.mean(values.astype(float) ** 2)) + 1.0 / 12.0
