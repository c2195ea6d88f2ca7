"""Compressed textures: errors asked for, bytes, masks, the paper's form, on real photographs."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from skimage import data
from skimage.transform import resize

from pipelines.street_billboards.textures.eigen_textures import (
    byte_counts,
    compress_views,
    compress_views_as_paper,
    decode_billboard,
    decode_error,
    unpack_masks,
)
from pipelines.street_billboards.textures.masks import opacity_masks
from pipelines.street_billboards.textures.texture_tables import (
    EMPTY,
    SEEN,
    SIDE,
    UNSEEN,
    ViewTextures,
)

BLOCK_BYTES = 512
"""Of a view in BC1."""


def views_from(
    textures: list[NDArray[np.uint8]],
    states: list[NDArray[np.uint8]],
    directions: list[list[int]] | None = None,
) -> ViewTextures:
    counts = [len(part) for part in textures]
    found = directions or [list(range(3, 3 + 2 * count, 2)) for count in counts]
    return ViewTextures(
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        np.concatenate([np.array(d, np.uint8) for d in found]),
        np.concatenate(textures),
        np.concatenate(states),
        np.ones(sum(counts), np.float32),
    )


@functools.cache
def photographed(count: int = 60, views: int = 5) -> tuple[ViewTextures, NDArray[np.bool_]]:
    """Patches of photographs with other exposures, blur, noise, gaps; every sixth is sheared."""
    random = np.random.default_rng(0)
    pictures = [data.brick(), data.gravel(), data.coffee(), data.astronaut(), data.rocket()]
    turns = np.arange(count) % 6 == 5
    textures, states = [], []
    for b in range(count):
        picture = pictures[b % len(pictures)]
        picture = picture if picture.ndim == 3 else np.stack([picture] * 3, axis=-1)
        size = int(random.integers(64, 160))
        y = random.integers(0, picture.shape[0] - size)
        x = random.integers(0, picture.shape[1] - size)
        patch = resize(
            picture[y : y + size, x : x + size] / 255.0, (SIDE, SIDE), anti_aliasing=True
        )
        mirrored = np.roll(patch[::-1], 7, axis=1)
        own, seen = [], []
        for i in range(views):
            view = patch * random.uniform(0.97, 1.03)
            view = gaussian_filter(view, (0.3 * i, 0.3 * i, 0))
            if b % 4 == 3:
                view = view + 0.1 * np.roll(mirrored, 5 * i, axis=1)
            if turns[b]:
                view = np.stack([np.roll(row, (r - 16) * i // 12, 0) for r, row in enumerate(view)])
            view = view * 255 + random.normal(scale=1.5, size=view.shape)
            own.append(np.clip(np.rint(view), 0, 255).astype(np.uint8))
            state = np.full((SIDE, SIDE), SEEN, np.uint8)
            if random.random() < 0.5:
                a, c = random.integers(0, 24, 2)
                state[a : a + 14, c : c + 14] = UNSEEN
            seen.append(state)
        textures.append(np.stack(own))
        states.append(np.stack(seen))
    return views_from(textures, states), turns


def flat(colour: tuple[int, int, int], views: int = 3) -> NDArray[np.uint8]:
    return np.broadcast_to(np.array(colour, np.uint8), (views, SIDE, SIDE, 3)).copy()


def all_seen(views: int = 3) -> NDArray[np.uint8]:
    return np.full((views, SIDE, SIDE), SEEN, np.uint8)


# ---- the compact form --------------------------------------------------------------------------


@pytest.mark.parametrize("error", [2.0, 3.0, 4.5])
def test_the_error_asked_for_is_met_in_few_bytes(error: float) -> None:
    views, turns = photographed()
    made = compress_views(views, turns, error=error)
    rmse, psnr = decode_error(views, made)
    assert 0.95 * error < rmse <= error
    assert psnr == pytest.approx(20 * np.log10(255 / rmse))
    # BC1 leaves 4.6 codes of these.
    rival = BLOCK_BYTES * len(views.direction) + made.masks.nbytes
    assert error < 4.5 or byte_counts(made)["total"] < 0.72 * rival


def test_one_number_of_planes_for_all_costs_more() -> None:
    views, turns = photographed()
    even = compress_views(views, turns, error=1e-3, most_ranks=(2, 1, 1))
    assert (even.ranks == [2, 1, 1]).all()
    made = compress_views(views, turns, error=decode_error(views, even)[0])
    assert byte_counts(made)["total"] < 0.9 * byte_counts(even)["total"]


def test_decode_error_is_that_of_numpy() -> None:
    views, turns = photographed()
    made = compress_views(views, turns, error=4.0)
    pictures = np.concatenate([decode_billboard(made, b) for b in range(len(turns))])
    off = np.rint(pictures).astype(float) - views.colours
    rmse = np.sqrt((off[views.states == SEEN] ** 2).mean())
    assert decode_error(views, made)[0] == pytest.approx(rmse, rel=1e-3)


def test_what_nobody_saw_does_not_matter() -> None:
    views, turns = photographed()
    noise = np.random.default_rng(5).integers(0, 256, views.colours.shape, dtype=np.uint8)
    colours = np.where((views.states == SEEN)[..., None], views.colours, noise)
    one = compress_views(views, turns, error=4.0)
    other = compress_views(views._replace(colours=colours), turns, error=4.0)
    for a, b in zip(one.planes + one.weights, other.planes + other.weights, strict=True):
        assert (a == b).all()


def test_gaps_are_filled_with_what_other_views_saw() -> None:
    brick = resize(data.brick()[:128, :128] / 255.0, (SIDE, SIDE), anti_aliasing=True)
    texture = np.stack([np.rint(brick * 255)] * 3, axis=-1).astype(np.uint8)
    textures = np.stack([texture] * 4)
    states = all_seen(4)
    for i in range(4):
        states[i, 8 * i : 8 * i + 8] = UNSEEN
    made = compress_views(views_from([textures], [states]), np.zeros(1, np.bool_), error=0.5)
    off = decode_billboard(made, 0) - textures
    assert np.sqrt((off**2).mean()) < 1.5


def test_holes_take_the_colours_around_them() -> None:
    texture = flat((40, 40, 40))
    texture[:, :, 16:] = 200
    states = all_seen()
    states[:, 10:12, 24:26] = UNSEEN
    made = compress_views(views_from([texture], [states]), np.zeros(1, np.bool_), error=1.0)
    assert np.abs(decode_billboard(made, 0)[:, 10:12, 24:26] - 200.0).max() < 5.0
    assert unpack_masks(made, 0)[0, 10:12, 24:26].all()


def test_flat_billboards_have_no_planes() -> None:
    made = compress_views(
        views_from([flat((200, 100, 50))], [all_seen()]), np.zeros(1, np.bool_), error=1.0
    )
    assert (made.ranks == 0).all()
    assert np.abs(decode_billboard(made, 0) - [200, 100, 50]).max() <= 2.0


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 10_000), side=st.sampled_from([8, 16, 32]))
def test_ranks_never_exceed_views_and_rounding_is_small(seed: int, side: int) -> None:
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 4))
    textures = random.integers(0, 256, (count, SIDE, SIDE, 3), dtype=np.uint8)
    views = views_from([textures], [all_seen(count)])
    made = compress_views(views, np.zeros(1, np.bool_), error=0.5, colour="rgb", chroma_side=side)
    assert (made.ranks <= count).all()
    # Noise needs every component. Then all error is rounding: of planes, weights and means.
    steps = sum(float(scales.max(initial=0)) for scales in made.scales) / 127.0
    assert decode_error(views, made)[0] < 0.5 + count * steps


@pytest.mark.parametrize("turning", [False, True])
def test_empty_billboards_and_views_are_harmless(turning: bool) -> None:
    nothing = np.zeros((0, SIDE, SIDE, 3), np.uint8)
    views = views_from(
        [nothing, flat((9, 9, 9), 2)], [nothing[..., 0], np.full((2, SIDE, SIDE), EMPTY, np.uint8)]
    )
    turns = np.full(2, turning)
    for made in (
        compress_views(views, turns, error=4.0),
        compress_views_as_paper(views, turns, rank=2),
    ):
        assert not made.masks.any()
        assert decode_error(views, made)[0] == 0.0


def test_permuted_billboards_give_permuted_results() -> None:
    views, turns = photographed(20)
    order = np.random.default_rng(1).permutation(20)
    rows = [slice(views.first[b], views.first[b + 1]) for b in order]
    moved = views_from(
        [views.colours[r] for r in rows],
        [views.states[r] for r in rows],
        [list(views.direction[r]) for r in rows],
    )
    one, other = (
        compress_views(views, turns, error=4.0),
        compress_views(moved, turns[order], error=4.0),
    )
    assert (one.ranks[order] == other.ranks).all()
    for place, b in enumerate(order):
        assert (decode_billboard(one, int(b)) == decode_billboard(other, place)).all()


def test_views_can_count_more() -> None:
    views, turns = photographed()
    weights = np.where(np.arange(len(views.direction)) % 5 == 0, 30.0, 1.0)
    pictures = [
        np.concatenate([decode_billboard(made, b) for b in range(len(turns))])[::5]
        for made in (
            compress_views(views, turns, error=1e-3, most_ranks=(1, 1, 1)),
            compress_views(views, turns, error=1e-3, most_ranks=(1, 1, 1), view_weights=weights),
        )
    ]
    seen = views.states[::5] == SEEN
    plain, weighted = (((p - views.colours[::5])[seen] ** 2).mean() for p in pictures)
    assert weighted < 0.8 * plain


def test_options_that_do_not_exist_are_refused() -> None:
    views, turns = photographed(20)
    with pytest.raises(ValueError, match="chroma_side is 12"):
        compress_views(views, turns, error=4.0, chroma_side=12)
    with pytest.raises(ValueError, match='colour is "hsv"'):
        compress_views(views, turns, error=4.0, colour="hsv")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="error is 0"):
        compress_views(views, turns, error=0.0)
    with pytest.raises(ValueError, match="turns has 19 entries; expected 20"):
        compress_views(views, turns[1:], error=4.0)
    with pytest.raises(ValueError, match="rank and contribution are None"):
        compress_views_as_paper(views, turns, rank=None)
    with pytest.raises(ValueError, match="rank is 33"):
        compress_views_as_paper(views, turns, rank=33)
    with pytest.raises(ValueError, match=r"contribution is 1\.5"):
        compress_views_as_paper(views, turns, contribution=1.5)


# ---- bytes -------------------------------------------------------------------------------------


def test_bytes_add_up_to_the_arrays() -> None:
    views, turns = photographed()
    made = compress_views(views, turns, error=4.0)
    counts = byte_counts(made)
    codes = [made.direction, made.means, made.masks, *made.planes, *made.weights]
    stored = sum(array.nbytes for array in codes) + sum(one.nbytes for one in made.scales)
    assert counts["total"] == stored
    assert counts["total"] == sum(n for part, n in counts.items() if part != "total")
    ranks = made.ranks.sum(axis=0, dtype=np.int64)
    assert counts["eigen"] == 1024 * ranks[0] + 256 * (ranks[1] + ranks[2])
    assert counts["weights"] == (np.diff(made.first)[:, None] * made.ranks.astype(int)).sum()


def test_the_papers_bytes() -> None:
    views, turns = photographed(20)
    made = compress_views_as_paper(views, turns)
    counts = byte_counts(made)
    assert counts["eigen"] == 20 * 49_152
    assert counts["weights"] == 20 * 1536
    assert counts["means"] == 20 * 96
    assert counts["eigen"] + counts["weights"] + counts["means"] == 20 * 50_784
    assert counts["scales"] <= 20 * 512


# ---- the paper's form --------------------------------------------------------------------------


def test_the_papers_form_holds_all_views_where_planes_suffice() -> None:
    views, turns = photographed(20)
    made = compress_views_as_paper(views, turns, rank=5)
    assert decode_error(views, made)[0] < 1.0
    assert (made.direction.reshape(20, 32) == np.arange(32)).all()


def test_directions_without_a_view_are_as_the_nearest() -> None:
    views, turns = photographed(20)
    pictures = decode_billboard(compress_views_as_paper(views, turns, rank=5), 2)
    # Observed are 3, 5, 7, 9, 11.
    assert (pictures[0] == pictures[3]).all()
    assert (pictures[4] == pictures[3]).all()
    assert (pictures[31] == pictures[11]).all()
    assert (pictures[5] != pictures[3]).any()


def test_contribution_chooses_ranks_as_numpy_would() -> None:
    views, turns = photographed(20)
    views = views._replace(states=np.full_like(views.states, SEEN))
    made = compress_views_as_paper(views, turns, rank=None, contribution=0.97)
    nearest = np.abs(np.arange(32)[:, None] - views.direction[:5].astype(int)).argmin(axis=1)
    for b in range(20):
        for c in range(3):
            rows = views.colours[5 * b : 5 * b + 5, ..., c].reshape(5, -1)[nearest].astype(float)
            rows -= rows.mean(axis=1, keepdims=True)
            lengths = np.linalg.svd(rows, compute_uv=False)
            share = np.cumsum(lengths**2) / (lengths**2).sum()
            assert made.ranks[b, c] == np.argmax(share >= 0.97) + 1
    fewer = compress_views_as_paper(views, turns, rank=1, contribution=0.999)
    assert fewer.ranks.max() == 1


# ---- masks -------------------------------------------------------------------------------------


def mask_of(states: NDArray[np.uint8], *, turning: bool = False) -> NDArray[np.bool_]:
    views = views_from([flat((0, 0, 0), len(states))], [states])
    first, masks = opacity_masks(views, np.array([turning]))
    assert first[-1] == len(masks) == (len(states) if turning else 1)
    return np.unpackbits(masks, axis=-1).astype(np.bool_)


def test_views_vote_for_what_stands_still() -> None:
    states = all_seen(3)
    states[:, 0, 0] = [SEEN, EMPTY, UNSEEN]
    states[:, 0, 1] = [SEEN, EMPTY, EMPTY]
    states[:, 0, 2] = [UNSEEN, UNSEEN, SEEN]
    states[:, 20, 20] = UNSEEN
    states[:, :10, 20:] = UNSEEN
    mask = mask_of(states)[0]
    assert mask[0, :3].tolist() == [True, False, True]
    assert mask[20, 20]
    assert not mask[:8, 22:].any()


def test_turning_billboards_have_a_mask_a_view() -> None:
    states = np.full((3, SIDE, SIDE), EMPTY, np.uint8)
    for i in range(3):
        states[i, :, 10 + i : 14 + i] = SEEN
    states[1, :16] = UNSEEN
    states[2, 5, 25] = SEEN
    mask = mask_of(states, turning=True)
    assert (mask[0] == (states[0] == SEEN)).all()
    # The first and the last are as near: the first decides.
    assert (mask[1, :16] == mask[0, :16]).all()
    assert (mask[1, 16:] == (states[1, 16:] == SEEN)).all()
    assert not mask[2, 5, 25]


def test_masks_are_the_bits_from_the_left() -> None:
    states = np.full((1, SIDE, SIDE), EMPTY, np.uint8)
    states[0, 0, :9] = SEEN
    views = views_from([flat((0, 0, 0), 1)], [states])
    made = compress_views(views, np.zeros(1, np.bool_), error=4.0)
    assert made.masks[0, 0].tolist() == [255, 128, 0, 0]
    assert unpack_masks(made, 0).sum() == 9
