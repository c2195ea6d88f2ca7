"""The compiled decoder against NumPy, between views, and at the ends of fans."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.street_billboards.textures.decoding import (
    ViewPair,
    decodable,
    decode_colours,
    decode_views,
    view_pair,
)
from pipelines.street_billboards.textures.eigen_textures import decode_billboard, unpack_masks
from pipelines.street_billboards.textures.texture_tables import SIDE, CompressedTextures


def random_textures(
    seed: int = 0, colour: str = "ycocg", sides: tuple[int, int, int] = (32, 16, 16)
) -> CompressedTextures:
    """Ten billboards of one to four views; every other one has a mask a view."""
    random = np.random.default_rng(seed)
    counts = random.integers(1, 5, 10)
    ranks = np.minimum(random.integers(0, 4, (10, 3)), counts[:, None]).astype(np.uint8)
    directions = [np.sort(random.choice(32, n, replace=False)) for n in counts]
    masks = np.where(np.arange(10) % 2, counts, 1)

    def codes(*shape: int) -> NDArray[np.uint8]:
        return random.integers(1, 256, shape, dtype=np.uint8)

    planes, scales, weights = [], [], []
    for c, side in enumerate(sides):
        planes.append(codes(int(ranks[:, c].sum()), side, side))
        scales.append(random.uniform(0, 60, len(planes[-1])).astype(np.float32))
        weights.append(codes(int((counts * ranks[:, c]).sum())))
    return CompressedTextures(
        colour,
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        np.concatenate(directions).astype(np.uint8),
        codes(int(counts.sum()), 3),
        ranks,
        (planes[0], planes[1], planes[2]),
        (scales[0], scales[1], scales[2]),
        (weights[0], weights[1], weights[2]),
        np.concatenate([[0], np.cumsum(masks)]).astype(np.int64),
        codes(int(masks.sum()), SIDE, 4),
    )


def by_kernel(
    textures: CompressedTextures, billboard: int, lower: int, upper: int, fraction: float
) -> NDArray[np.float32]:
    out = np.empty((3, SIDE, SIDE), np.float32)
    decode_colours(decodable(textures), billboard, ViewPair(lower, upper, fraction), out)
    return out.transpose(1, 2, 0)


@settings(deadline=None, max_examples=20)
@given(
    seed=st.integers(0, 1000),
    colour=st.sampled_from(["ycocg", "rgb"]),
    side=st.sampled_from([8, 16, 32]),
)
def test_views_are_decoded_as_by_numpy(seed: int, colour: str, side: int) -> None:
    textures = random_textures(seed, colour, (32, side, side))
    for b in range(10):
        expected = decode_billboard(textures, b)
        begin = textures.first[b]
        for i in range(len(expected)):
            np.testing.assert_allclose(by_kernel(textures, b, i, i, 0.0), expected[i], atol=0.01)
            out = np.empty((1, SIDE, SIDE, 4), np.uint8)
            position = np.array([float(textures.direction[begin + i])])
            decode_views(textures, np.array([b]), position, out)
            assert np.abs(out[0, ..., :3] - expected[i]).max() <= 0.51
            masks = unpack_masks(textures, b)
            assert ((out[0, ..., 3] == 255) == masks[i if len(masks) > 1 else 0]).all()


def test_views_between_are_interpolated() -> None:
    textures = random_textures(3)
    # Small amplitudes: what is not clamped is linear.
    quiet = [np.float32(0.05) * scales for scales in textures.scales]
    means = np.tile(np.array([120, 128, 128], np.uint8), (len(textures.means), 1))
    means[::2] += np.uint8(9)
    textures = textures._replace(scales=(quiet[0], quiet[1], quiet[2]), means=means)
    for b in np.flatnonzero(np.diff(textures.first) > 1):
        views = decode_billboard(textures, int(b))
        low, high = textures.direction[textures.first[b] :][:2].astype(float)
        for fraction in (0.25, 0.5, 0.9):
            expected = (1 - fraction) * views[0] + fraction * views[1]
            np.testing.assert_allclose(
                by_kernel(textures, int(b), 0, 1, fraction), expected, atol=0.01
            )
            out = np.empty((1, SIDE, SIDE, 4), np.uint8)
            position = np.array([low + fraction * (high - low)])
            decode_views(textures, np.array([b]), position, out)
            assert np.abs(out[0, ..., :3] - expected).max() <= 0.51


def test_masks_of_what_turns_are_blended() -> None:
    textures = random_textures(3)
    b = next(n for n in range(1, 10, 2) if np.diff(textures.first)[n] > 1)
    low, high = textures.direction[textures.first[b] :][:2].astype(float)
    masks = unpack_masks(textures, b)
    for fraction in (0.0, 0.4, 0.5, 0.6, 1.0):
        out = np.empty((1, SIDE, SIDE, 4), np.uint8)
        decode_views(textures, np.array([b]), np.array([low + fraction * (high - low)]), out)
        blend = (1 - fraction) * masks[0] + fraction * masks[1]
        assert ((out[0, ..., 3] == 255) == (blend >= 0.5)).all()


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        (-14.5, (0, 0, 0.0)),
        (4.0, (0, 0, 0.0)),
        (5.0, (0, 1, 0.25)),
        (8.0, (1, 2, 0.0)),
        (8.5, (1, 2, 0.5)),
        (9.0, (2, 2, 0.0)),
        (45.0, (2, 2, 0.0)),
    ],
)
def test_the_two_views_around_a_viewer(position: float, expected: tuple[int, int, float]) -> None:
    assert view_pair(np.array([4, 8, 9], np.uint8), position) == pytest.approx(expected)


def test_many_are_decoded_in_any_order() -> None:
    textures = random_textures(7)
    chosen = np.array([9, 0, 4, 4])
    position = np.array([3.3, 12.0, 40.0, 15.5])
    many = np.empty((4, SIDE, SIDE, 4), np.uint8)
    decode_views(decodable(textures), chosen, position, many)
    for j in range(4):
        one = np.empty((1, SIDE, SIDE, 4), np.uint8)
        decode_views(textures, chosen[j : j + 1], position[j : j + 1], one)
        assert (one[0] == many[j]).all()


def test_billboards_without_views_are_transparent() -> None:
    textures = random_textures(1)
    first = np.append(textures.first, textures.first[-1])
    ranks = np.concatenate([textures.ranks, np.zeros((1, 3), np.uint8)])
    first_mask = np.append(textures.first_mask, textures.first_mask[-1])
    out = np.full((1, SIDE, SIDE, 4), 9, np.uint8)
    empty = textures._replace(first=first, ranks=ranks, first_mask=first_mask)
    decode_views(empty, np.array([10]), np.array([1.0]), out)
    assert not out.any()
