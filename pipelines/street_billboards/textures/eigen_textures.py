"""Billboards' views compressed as eigen-textures (4.2, Eq. 1), and the paper's own form of them.

`compress_views` spends bytes where they take off most error: luma in full and chroma in half
resolution, for each billboard and channel as many planes as pay. One Lagrange multiplier, squared
error for bytes, holds for all of them, searched until the error asked for is met.

`compress_views_as_paper` is what section 4.2 says: R, G and B, 32 directions, r planes each.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import numba
import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.textures.coded_arrays import CodedArrays, as_textures, grey_arrays
from pipelines.street_billboards.textures.decoding import decodable, squared_errors_of_seen
from pipelines.street_billboards.textures.eigen_kernels import (
    LUMA_CHROMA_WEIGHTS,
    ViewsToFit,
    code_billboards,
    rank_errors,
)
from pipelines.street_billboards.textures.low_rank_fit import RIDGE
from pipelines.street_billboards.textures.masks import opacity_masks
from pipelines.street_billboards.textures.paper_form import (
    code_paper_form,
    masks_of_directions,
    nearest_views,
    ranks_for_contribution,
    squared_singular_values,
)
from pipelines.street_billboards.textures.rank_allocation import allocate_ranks
from pipelines.street_billboards.textures.texture_tables import (
    SEEN,
    SIDE,
    CompressedTextures,
    ViewTextures,
)
from pipelines.street_billboards.textures.view_directions import DIRECTIONS

_SIDES = (4, 8, 16, 32)
_SCALE_BYTES = 4
_CURVE_SWEEPS, _SWEEPS = 4, 10
_NEGLIGIBLE = 0.02
"""Of the squared error asked for: what is left below that ends a billboard's curve."""
_PASSES = 4
_AIM, _NEAR = 0.995, 0.99
"""Of the squared error asked for: what is aimed at, and what is near enough."""


def compress_views(
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

    turns (b,): see `opacity_masks`. chroma_side: 8, 16 or 32, of Co and Cg, which are in full where
    colour is "rgb". most_ranks: planes a billboard and channel, at most; never more than views that
    saw anything, and there may be none, only mean colours. view_weights (v,): how much each view
    counts in fits. Where the error is out of reach, the most planes allowed.

    Raises ValueError where an option is none of these.
    """
    luma_chroma = colour == "ycocg"
    sides = np.array([SIDE, *[chroma_side if luma_chroma else SIDE] * 2])
    _check(views, turns, error, colour, sides)
    importance = LUMA_CHROMA_WEIGHTS if luma_chroma else np.ones(3)
    weights = np.ones(len(views.direction)) if view_weights is None else view_weights
    data = _sampled(views, np.asarray(weights, np.float32), luma_chroma, sides)
    squares = _rank_errors(data, np.array(most_ranks), _NEGLIGIBLE * error**2)
    squares *= importance[:, None]
    plane_bytes = np.diff(data.first)[:, None] + sides**2 + _SCALE_BYTES
    costs = plane_bytes[:, :, None] * np.arange(squares.shape[2])
    first_mask, masks = opacity_masks(views, turns)
    allowed = error**2 * 3.0 * float((views.states == SEEN).sum())
    aim, least = _AIM * allowed, np.inf
    for _ in range(_PASSES):
        choice = allocate_ranks(squares, costs, aim)
        made = as_textures(
            _coded(data, choice.ranks),
            colour=colour,
            first=data.first,
            direction=views.direction,
            sides=sides,
            first_mask=first_mask,
            masks=masks,
        )
        total = float(_squared_errors(views, made).sum())
        if total <= max(allowed, least):
            found, least = made, total
        if _NEAR * allowed <= total <= allowed:
            break
        # Rounding to 8 bit adds a little to what the curves foretell: aim lower by as much.
        aim = _AIM * allowed - (total - choice.squares)
        if aim <= 0.0:
            break
    return found


def _sampled(
    views: ViewTextures,
    weights: NDArray[np.float32],
    luma_chroma: bool,
    sides: NDArray[np.int64],
) -> ViewsToFit:
    first = views.first.astype(np.int64)
    return ViewsToFit(first, views.colours, views.states, weights, luma_chroma, sides)


def compress_views_as_paper(
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
    _check(views, turns, 1.0, "rgb", np.array([SIDE] * 3))
    if rank is None and contribution is None:
        raise ValueError("rank and contribution are None; expected one of them.")
    if rank is not None and not 0 <= rank <= DIRECTIONS:
        raise ValueError(f"rank is {rank}; expected 0 to {DIRECTIONS}.")
    if contribution is not None and not 0.0 < contribution <= 1.0:
        raise ValueError(f"contribution is {contribution}; expected more than 0, 1 at most.")
    count = len(turns)
    nearest = nearest_views(views)
    shares = np.bincount(nearest[nearest >= 0], minlength=len(views.direction)).astype(np.float32)
    if contribution is None:
        ranks = np.full((count, 3), rank, np.uint8)
    else:
        squares = np.zeros((count, 3, DIRECTIONS))
        squared_singular_values(views, shares, squares)
        ranks = ranks_for_contribution(squares, contribution)
        if rank is not None:
            ranks = np.minimum(ranks, np.uint8(rank))
    sides = np.full(3, SIDE)
    arrays = grey_arrays(ranks, np.full(count, DIRECTIONS), sides)
    code_paper_form(views, shares, nearest, arrays)
    first_mask, masks = masks_of_directions(views, turns, nearest)
    return as_textures(
        arrays,
        colour="rgb",
        first=np.arange(count + 1) * DIRECTIONS,
        direction=np.tile(np.arange(DIRECTIONS, dtype=np.uint8), count),
        sides=sides,
        first_mask=first_mask,
        masks=masks,
    )


def _in_parts(work: Callable[[slice], None], count: int) -> None:
    """``work`` on parts of so many billboards, one for each thread that numba may use."""
    workers = min(numba.get_num_threads(), max(count, 1))
    edges = np.linspace(0, count, workers + 1).astype(int)
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, [slice(a, b) for a, b in itertools.pairwise(edges)]))


def _rank_errors(data: ViewsToFit, most: NDArray[np.int64], enough: float) -> NDArray[np.float64]:
    """(b, 3, most + 1) sums of squares that ranks would leave, infinity where there is none."""
    errors = np.empty((len(data.first) - 1, 3, int(most.max()) + 1))

    def work(part: slice) -> None:
        own = data._replace(first=data.first[part.start : part.stop + 1])
        rank_errors(own, most, enough, RIDGE, _CURVE_SWEEPS, errors[part])

    _in_parts(work, len(errors))
    return errors


def _coded(data: ViewsToFit, ranks: NDArray[np.uint8]) -> CodedArrays:
    """Everything fitted and coded with these ranks (b, 3)."""
    arrays = grey_arrays(ranks, np.diff(data.first), data.sides)

    def work(part: slice) -> None:
        code_billboards(data, arrays, part.start, part.stop, RIDGE, _SWEEPS)

    _in_parts(work, len(ranks))
    return arrays


def _check(
    views: ViewTextures,
    turns: NDArray[np.bool_],
    error: float,
    colour: str,
    sides: NDArray[np.int64],
) -> None:
    if len(turns) != len(views.first) - 1:
        raise ValueError(f"turns has {len(turns)} entries; expected {len(views.first) - 1}.")
    if colour not in ("ycocg", "rgb"):
        raise ValueError(f'colour is "{colour}"; expected "ycocg" or "rgb".')
    if not set(sides) <= set(_SIDES):
        raise ValueError(f"chroma_side is {sides[-1]}; expected 4, 8, 16 or 32 texels.")
    if not error > 0.0:
        raise ValueError(f"error is {error}; expected more than 0 codes.")


# ---- what the codes mean -----------------------------------------------------------------------


def decode_billboard(textures: CompressedTextures, billboard: int) -> NDArray[np.float32]:
    """All views (n, 32, 32, 3) of a billboard by NumPy, in codes of 0 to 255, not rounded.

    >>> none = np.zeros((3, 0, 32, 32), np.uint8)
    >>> grey = CompressedTextures(
    ...     "rgb", np.array([0, 2]), np.uint8([14, 15]), np.uint8([[90, 95, 90], [80, 85, 80]]),
    ...     np.uint8([[0, 0, 0]]), tuple(none), (np.zeros(0, np.float32),) * 3,
    ...     tuple(none[..., 0, 0]), np.array([0, 1]), np.full((1, 32, 4), 255, np.uint8),
    ... )
    >>> decode_billboard(grey, 0)[:, 7, 7].tolist()
    [[90.0, 95.0, 90.0], [80.0, 85.0, 80.0]]
    """
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


def unpack_masks(textures: CompressedTextures, billboard: int) -> NDArray[np.bool_]:
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
    squared_errors_of_seen(decodable(textures), views, total)
    return total
