"""Billboards' views compressed as eigen-textures (4.2, Eq. 1), and the paper's own form of them.

`compressed` spends bytes where they take off most error: luma in full and chroma in half
resolution, for each billboard and channel as many planes as pay. One exchange rate of squared error
for bytes holds for all of them (a Lagrange multiplier), searched until the error asked for is met.

`compressed_paper` is what section 4.2 says: R, G and B, 32 directions, r planes each.
"""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import numba
import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.decoding import decodable, seen_errors, starts
from pipelines.street_billboards.eigen_kernels import (
    LUMA_CHROMA_WEIGHTS,
    code_billboards,
    rank_errors,
)
from pipelines.street_billboards.low_rank_fit import RIDGE
from pipelines.street_billboards.paper_kernels import code_paper, paper_squares
from pipelines.street_billboards.texture_masks import masks_of
from pipelines.street_billboards.textures import SEEN, SIDE, CompressedTextures, ViewTextures
from pipelines.street_billboards.view_directions import DIRECTIONS

_SCALE_BYTES = 4
_CURVE_SWEEPS, _SWEEPS = 4, 10
_NEGLIGIBLE = 0.02
"""Of the squared error asked for: what is left below that ends a billboard's curve."""
_PASSES = 4
_NEAR = 0.99


def compressed(
    views: ViewTextures,
    turns: NDArray[np.bool_],
    *,
    error: float,
    colour: Literal["ycocg", "rgb"] = "ycocg",
    chroma_side: int = 16,
    most_ranks: tuple[int, int, int] = (8, 4, 4),
    view_weights: NDArray[np.floating] | None = None,
) -> CompressedTextures:
    """The fewest bytes whose RMSE over all SEEN texels is about ``error`` codes, or less.

    turns (b,): see `masks_of`. chroma_side: 8, 16 or 32, of Co and Cg, which are in full where
    colour is "rgb". most_ranks: planes a billboard and channel, at most; never more than views that
    saw anything, and there may be none, only mean colours. view_weights (v,): how much each view
    counts in fits. Where the error is out of reach, the most planes allowed.

    Raises ValueError where an option is none of these.
    """
    _check(views, turns, error, colour, chroma_side)
    sides = np.array([SIDE, chroma_side, chroma_side] if colour == "ycocg" else [SIDE] * 3)
    importance = LUMA_CHROMA_WEIGHTS if colour == "ycocg" else np.ones(3)
    coder = _Coder(views, turns, colour == "ycocg", sides, view_weights)
    squares = coder.rank_errors(np.array(most_ranks), _NEGLIGIBLE * error**2)
    squares *= importance[:, None]
    sizes = np.diff(views.first)[:, None] + (sides**2 + _SCALE_BYTES)[None, :]
    costs = sizes[:, :, None] * np.arange(squares.shape[2])
    allowed = error**2 * 3.0 * float((views.states == SEEN).sum())
    # Rounding to 8 bit adds a little to what the curves foretell: aim lower by what it added.
    aim = allowed
    best: CompressedTextures | None = None
    for _ in range(_PASSES):
        ranks = _chosen(squares, costs, aim)
        made = coder.coded(ranks)
        total = _squared_errors(views, made).sum()
        if total <= allowed or best is None:
            best = made
        if _NEAR * allowed <= total <= allowed:
            break
        foretold = np.take_along_axis(squares, ranks[:, :, None].astype(np.int64), 2).sum()
        lower = allowed - (total - foretold)
        if lower <= 0.0 or ranks.sum() == 0:
            break
        aim = lower
    assert best is not None
    return best


def compressed_paper(
    views: ViewTextures,
    turns: NDArray[np.bool_],
    *,
    rank: int | None = 16,
    contribution: float | None = None,
) -> CompressedTextures:
    """The paper's: R, G, B in 32 x 32 texels, all 32 directions, ``rank`` planes a channel.

    Directions that nobody observed are as the nearest observed one (the lower of two). Planes
    beyond the rank that exists are zero but stored. With ``contribution`` (0 to 1], instead, as
    many planes as reach this share of the singular values' squares, up to ``rank`` unless None.

    Raises ValueError where neither is given, or out of range.
    """
    _check(views, turns, 1.0, "rgb", SIDE)
    if rank is None and contribution is None:
        raise ValueError("rank and contribution are None; expected one of them.")
    if rank is not None and not 0 <= rank <= DIRECTIONS:
        raise ValueError(f"rank is {rank}; expected 0 to {DIRECTIONS}.")
    if contribution is not None and not 0.0 < contribution <= 1.0:
        raise ValueError(f"contribution is {contribution}; expected more than 0, 1 at most.")
    count = len(turns)
    nearest = _nearest_views(views)
    shares = np.bincount(nearest[nearest >= 0], minlength=len(views.direction))
    data = (views.first, views.colours, views.states, shares.astype(np.float32))
    if contribution is None:
        ranks = np.full((count, 3), rank, np.uint8)
    else:
        squares = np.zeros((count, 3, DIRECTIONS))
        paper_squares(*data, squares)
        ranks = _reaching(squares, contribution)
        if rank is not None:
            ranks = np.minimum(ranks, np.uint8(rank))
    stored = ranks.astype(np.int64)
    first_plane = [starts(stored[:, c]) for c in range(3)]
    first_weight = [starts(DIRECTIONS * stored[:, c]) for c in range(3)]
    means = np.full((count * DIRECTIONS, 3), 128, np.uint8)
    planes = [np.full((f[-1], SIDE * SIDE), 128, np.uint8) for f in first_plane]
    scales = [np.zeros(f[-1], np.float32) for f in first_plane]
    weights = [np.full(f[-1], 128, np.uint8) for f in first_weight]
    code_paper(
        *data,
        nearest,
        ranks,
        tuple(first_plane),
        tuple(first_weight),
        means,
        tuple(planes),
        tuple(scales),
        tuple(weights),
    )
    first_mask, masks = _masks_of_directions(views, turns, nearest)
    shaped = [p.reshape(-1, SIDE, SIDE) for p in planes]
    return CompressedTextures(
        "rgb",
        np.arange(count + 1) * DIRECTIONS,
        np.tile(np.arange(DIRECTIONS, dtype=np.uint8), count),
        means,
        ranks,
        (shaped[0], shaped[1], shaped[2]),
        (scales[0], scales[1], scales[2]),
        (weights[0], weights[1], weights[2]),
        first_mask,
        masks,
    )


def _nearest_views(views: ViewTextures) -> NDArray[np.int64]:
    """(b, 32) rows of the views nearest to each direction, -1 for a billboard without any."""
    counts = np.diff(views.first)
    owner = np.repeat(np.arange(len(counts)), counts)
    apart = np.full((len(counts), DIRECTIONS), 2 * DIRECTIONS)
    nearest = np.full((len(counts), DIRECTIONS), -1, np.int64)
    # The n-th view of every billboard that has as many; the first of two that are as near stays.
    for n in range(int(counts.max(initial=0))):
        rows = (views.first[:-1] + n)[counts > n]
        far = np.abs(views.direction[rows, None].astype(np.int64) - np.arange(DIRECTIONS))
        better = far < apart[owner[rows]]
        nearest[owner[rows]] = np.where(better, rows[:, None], nearest[owner[rows]])
        apart[owner[rows]] = np.where(better, far, apart[owner[rows]])
    return nearest


def _reaching(squares: NDArray[np.float64], contribution: float) -> NDArray[np.uint8]:
    """How many of squared singular values (b, 3, 32), falling, add up to a share of all."""
    total = squares.sum(axis=2, keepdims=True)
    # A hair less, so that the share 1 does not hang on rounding.
    short = np.cumsum(squares, axis=2) < contribution * (1.0 - 1e-6) * total
    return np.where(total[..., 0] > 0.0, short.sum(axis=2) + 1, 0).astype(np.uint8)


def _masks_of_directions(
    views: ViewTextures, turns: NDArray[np.bool_], nearest: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Masks of the observed views, for all 32 directions of what turns."""
    first, masks = masks_of(views, turns)
    first_mask = starts(np.where(turns, DIRECTIONS, 1))
    result = np.zeros((first_mask[-1], SIDE, SIDE // 8), np.uint8)
    result[first_mask[:-1][~turns]] = masks[first[:-1][~turns]]
    observed = turns & (np.diff(views.first) > 0)
    rows = nearest[observed] + (first[:-1] - views.first[:-1])[observed, None]
    result[first_mask[:-1][observed, None] + np.arange(DIRECTIONS)] = masks[rows]
    return first_mask, result


class _Coder:
    """Kernels over all billboards, shared out among threads."""

    def __init__(
        self,
        views: ViewTextures,
        turns: NDArray[np.bool_],
        luma_chroma: bool,
        sides: NDArray[np.int64],
        view_weights: NDArray[np.floating] | None,
    ) -> None:
        self.views = views
        self.luma_chroma = luma_chroma
        self.sides = sides
        self.count = len(views.first) - 1
        self.first_mask, self.masks = masks_of(views, turns)
        weights = np.ones(len(views.direction)) if view_weights is None else view_weights
        self.view_weights = np.asarray(weights, np.float32)

    def _parts(self) -> list[slice]:
        workers = min(numba.get_num_threads(), max(self.count, 1))
        edges = np.linspace(0, self.count, workers + 1).astype(int)
        return [slice(a, b) for a, b in itertools.pairwise(edges)]

    def _arguments(self, part: slice) -> tuple[Any, ...]:
        return (
            self.views.first[part.start : part.stop + 1],
            self.views.colours,
            self.views.states,
            self.view_weights,
            self.luma_chroma,
            self.sides,
        )

    def rank_errors(self, most: NDArray[np.int64], enough: float) -> NDArray[np.float64]:
        """(b, 3, most + 1) sums of squares that ranks would leave, infinity where there is none."""
        errors = np.empty((self.count, 3, int(most.max()) + 1))

        def work(part: slice) -> None:
            rank_errors(*self._arguments(part), most, enough, RIDGE, _CURVE_SWEEPS, errors[part])

        with ThreadPoolExecutor() as pool:
            list(pool.map(work, self._parts()))
        return errors

    def coded(self, ranks: NDArray[np.uint8]) -> CompressedTextures:
        """Everything fitted and coded with these ranks (b, 3)."""
        counts = np.diff(self.views.first)
        many = ranks.astype(np.int64)
        first_plane = [starts(many[:, c]) for c in range(3)]
        first_weight = [starts(many[:, c] * counts) for c in range(3)]
        means = np.zeros((len(self.views.direction), 3), np.uint8)
        planes = [
            np.empty((f[-1], side * side), np.uint8)
            for f, side in zip(first_plane, self.sides, strict=True)
        ]
        scales = [np.empty(f[-1], np.float32) for f in first_plane]
        weights = [np.empty(f[-1], np.uint8) for f in first_weight]

        def work(part: slice) -> None:
            edges = slice(part.start, part.stop + 1)
            code_billboards(
                *self._arguments(part),
                RIDGE,
                _SWEEPS,
                ranks[part],
                tuple(f[edges] for f in first_plane),
                tuple(f[edges] for f in first_weight),
                means,
                tuple(planes),
                tuple(scales),
                tuple(weights),
            )

        with ThreadPoolExecutor() as pool:
            list(pool.map(work, self._parts()))
        shaped = [p.reshape(-1, s, s) for p, s in zip(planes, self.sides, strict=True)]
        return CompressedTextures(
            "ycocg" if self.luma_chroma else "rgb",
            self.views.first.astype(np.int64),
            self.views.direction,
            means,
            ranks,
            (shaped[0], shaped[1], shaped[2]),
            (scales[0], scales[1], scales[2]),
            (weights[0], weights[1], weights[2]),
            self.first_mask,
            self.masks,
        )


def _chosen(
    squares: NDArray[np.float64], costs: NDArray[np.float64], allowed: float
) -> NDArray[np.uint8]:
    """Ranks (b, 3) of the fewest bytes whose sum of squares is ``allowed`` at most, on hulls.

    squares, costs (b, 3, ranks). The exchange rate is found by bisection, so the result does not
    depend on the order of billboards.
    """

    def ranks_at(rate: float) -> NDArray[np.int64]:
        return (squares + rate * costs).argmin(axis=2)

    def left(ranks: NDArray[np.int64]) -> float:
        return float(np.take_along_axis(squares, ranks[:, :, None], 2).sum())

    low, high = -20.0, 40.0
    if left(ranks_at(2.0**low)) > allowed:
        return ranks_at(0.0).astype(np.uint8)
    for _ in range(50):
        middle = 0.5 * (low + high)
        if left(ranks_at(2.0**middle)) <= allowed:
            low = middle
        else:
            high = middle
    return ranks_at(2.0**low).astype(np.uint8)


def _check(
    views: ViewTextures, turns: NDArray[np.bool_], error: float, colour: str, chroma_side: int
) -> None:
    if len(turns) != len(views.first) - 1:
        raise ValueError(f"turns has {len(turns)} entries; expected {len(views.first) - 1}.")
    if colour not in ("ycocg", "rgb"):
        raise ValueError(f'colour is "{colour}"; expected "ycocg" or "rgb".')
    if chroma_side not in (8, 16, 32):
        raise ValueError(f"chroma_side is {chroma_side}; expected 8, 16 or 32.")
    if not error > 0.0:
        raise ValueError(f"error is {error}; expected more than 0 codes.")


# ---- what the codes mean -----------------------------------------------------------------------


def decoded(textures: CompressedTextures, billboard: int) -> NDArray[np.float32]:
    """All views (n, 32, 32, 3) of a billboard by NumPy, in codes of 0 to 255, not rounded."""
    begin, end = (int(row) for row in textures.first[billboard : billboard + 2])
    channels = []
    for c in range(3):
        rank = int(textures.ranks[billboard, c])
        plane = int(textures.ranks[:billboard, c].sum(dtype=np.int64))
        views = np.diff(textures.first[: billboard + 1])
        start = int((textures.ranks[:billboard, c] * views).sum(dtype=np.int64))
        planes = textures.planes[c][plane : plane + rank].astype(np.float64) - 128.0
        weights = textures.weights[c][start : start + rank * (end - begin)].astype(np.float64)
        amounts = (weights.reshape(end - begin, rank) - 128.0) * (
            textures.scales[c][plane : plane + rank] / 127.0**2
        )
        grid = _sampling(planes.shape[-1])
        large = np.einsum("yv,kvu,xu->kyx", grid, planes, grid)
        means = textures.means[begin:end, c, None, None].astype(np.float64)
        channels.append(means + np.einsum("ik,kyx->iyx", amounts, large))
    if textures.colour == "ycocg":
        luma, orange, green = channels[0], channels[1] - 128.0, channels[2] - 128.0
        channels = [luma + orange - green, luma + green, luma - orange - green]
    return np.clip(np.stack(channels, axis=-1), 0.0, 255.0).astype(np.float32)


def _sampling(side: int) -> NDArray[np.float64]:
    """(32, side): how texels of a texture are mixed of a plane's."""
    places = np.clip((np.arange(SIDE) + 0.5) / SIDE * side - 0.5, 0.0, side - 1.0)
    return np.maximum(1.0 - np.abs(places[:, None] - np.arange(side)), 0.0)


def alpha(textures: CompressedTextures, billboard: int) -> NDArray[np.bool_]:
    """Opaque texels (1 or n, 32, 32) of a billboard that stands still, or turns."""
    rows = slice(*textures.first_mask[billboard : billboard + 2])
    return np.unpackbits(textures.masks[rows], axis=-1).astype(np.bool_)


def byte_counts(textures: CompressedTextures) -> dict[str, int]:
    """Bytes of all billboards by part, and in total.

    Where each one's part begins follows from ranks and numbers of views; what else is known of it
    (centre, axes, fan) is billboards.HEADER_BYTES.
    """
    counts = {
        "eigen": sum(planes.nbytes for planes in textures.planes),
        "weights": sum(weights.nbytes for weights in textures.weights),
        "means": textures.means.nbytes,
        "scales": sum(scales.nbytes for scales in textures.scales),
        "directions": textures.direction.nbytes,
        "alpha": textures.masks.nbytes,
    }
    return {**counts, "total": sum(counts.values())}


def decode_error(views: ViewTextures, textures: CompressedTextures) -> tuple[float, float]:
    """RMSE in codes over all SEEN texels, colours rounded to 8 bit; and PSNR in dB."""
    count = 3 * int((views.states == SEEN).sum())
    rmse = float(np.sqrt(_squared_errors(views, textures).sum() / max(count, 1)))
    return rmse, float(20.0 * np.log10(255.0 / rmse)) if rmse > 0.0 else float("inf")


def _squared_errors(views: ViewTextures, textures: CompressedTextures) -> NDArray[np.float64]:
    """(b,) sums over SEEN texels and R, G, B."""
    total = np.zeros(len(views.first) - 1)
    seen_errors(
        decodable(textures),
        views.first,
        views.direction,
        views.colours,
        views.states,
        SEEN,
        total,
        np.zeros(len(total), np.int64),
    )
    return total
