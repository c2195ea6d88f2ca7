"""Bits as a file: nothing is lost, a second reader agrees, and distances come back from them."""

from __future__ import annotations

import functools
import lzma

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.ssdf_lighting.compression import visibility_bits as coder
from pipelines.ssdf_lighting.compression.bits_file import (
    CodedBits,
    bits_from_bytes,
    bits_to_bytes,
    resident_of_bits,
    rows_of_bits,
)
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.lookup import matrix_along, resident_along
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.rebuilt import rebuilt_distances, visible_at
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
from tests.reference import ssdf_page_decoder as page

GRID = 10


def grid() -> NDArray[np.int64]:
    i, j = np.meshgrid(np.arange(GRID - 1), np.arange(GRID - 1), indexing="ij")
    a = (i * GRID + j).ravel()
    return np.stack([a, a + 1, a + GRID, a + 1, a + GRID + 1, a + GRID], -1).reshape(-1, 3)


def under_a_ball(n: int) -> NDArray[np.float64]:
    """Exact d (V, n²) of a grid of vertices in the whole sphere but a ball near to it."""
    place = np.linspace(-1.0, 1.0, GRID)
    x, y = np.meshgrid(place, place)
    ball = np.stack([-x.ravel(), -y.ravel(), np.full(x.size, 0.7)], axis=1)
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    return np.arccos(np.clip(ball @ texel_directions(n).T, -1.0, 1.0)) - 0.6


@pytest.fixture(scope="module")
def coded() -> CodedBits:
    cluster = (np.arange(GRID * GRID) // (GRID * 2)).astype(np.int32)
    return CodedBits(under_a_ball(16) > 0, cluster)


def noise(count: int, n: int) -> NDArray[np.bool_]:
    return np.random.default_rng(0).random((count, n * n)) < 0.5


def test_bits_come_back_without_loss_in_fewer_bytes_than_of_a_general_coder() -> None:
    visible = under_a_ball(32) > 0
    before, code = coder.encode_visibility(visible, grid())
    assert np.array_equal(coder.decode_visibility(before, code, len(visible), 32), visible)
    packed = np.packbits(visible, axis=1).tobytes()
    assert len(before) + len(code) < 0.6 * len(lzma.compress(packed, preset=9))


def test_noise_costs_what_it_holds() -> None:
    visible = noise(GRID * GRID, 16)
    before, code = coder.encode_visibility(visible, grid())
    assert np.array_equal(coder.decode_visibility(before, code, len(visible), 16), visible)
    assert 0.99 * visible.size / 8 < len(code) < 1.2 * visible.size / 8


def test_no_entry_of_the_tables_is_near_to_a_tie() -> None:
    places = (np.arange(4096) + 0.5) / 4096.0
    for values in (
        256.0 * np.log(places / (1.0 - places)),
        65536.0 / (1.0 + np.exp(-np.arange(-2047, 2048) / 256.0)),
    ):
        # Doubles are right to 1e-11 here: every machine rounds to the same whole numbers.
        assert np.abs(values - np.floor(values) - 0.5).min() > 1e-7


@pytest.mark.parametrize("n", [8, 16])
@pytest.mark.parametrize("kind", ["ball", "noise"])
def test_a_reader_written_from_the_page_finds_the_same(n: int, kind: str) -> None:
    visible = under_a_ball(n) > 0 if kind == "ball" else noise(GRID * GRID, n)
    cluster = (np.arange(len(visible)) % 7).astype(np.int32)
    file = bits_to_bytes(CodedBits(visible, cluster), grid())
    found = page.bits_of(file)
    assert np.array_equal(np.array(found.bits).reshape(visible.shape), visible)
    assert found.cluster == cluster.tolist()


def test_an_altered_byte_or_constant_is_found(
    coded: CodedBits, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = bits_to_bytes(coded, grid())
    # What is read wrongly asks for more bytes than there were.
    altered = bytearray(file + bytes(4096))
    altered[len(file) - 40] ^= 64
    found = np.array(page.bits_of(bytes(altered)).bits).reshape(coded.visible.shape)
    assert (found != coded.visible).sum() > 20
    assert np.array_equal(bits_from_bytes(bytes(altered)).visible, found)
    monkeypatch.setattr(page, "squash", lambda mixed: 40000)
    wrong = np.array(page.bits_of(file + bytes(4096)).bits)
    wrong = wrong.reshape(coded.visible.shape) != coded.visible
    assert wrong.sum() > 20


def test_a_file_that_is_none_is_refused_by_both(coded: CodedBits) -> None:
    file = bits_to_bytes(coded, grid())
    wrong = [
        b"TSUYASDG" + file[8:],
        file[:8] + b"\1" + file[9:],
        file[:10] + b"\3" + file[11:],
        file[:14] + b"\xff" + file[15:],
        file[:16] + bytes(4) + file[20:],
        file[: len(file) // 2],
        file[:20],
    ]
    for data in wrong:
        for read in (page.bits_of, bits_from_bytes):
            with pytest.raises(ValueError, match=r"."):
                read(data)


def test_smooth_edges_are_nearer_to_the_truth_than_samples() -> None:
    n = 32
    exact = under_a_ball(n)
    errors = [
        np.sqrt(((found - exact) ** 2).mean())
        for found in (rebuilt_distances(exact > 0), distances_to_samples(exact > 0))
    ]
    assert errors[0] < 0.6 * errors[1]
    assert np.array_equal(rebuilt_distances(exact > 0) > 0, exact > 0)


def test_other_directions_have_the_sign_of_what_lies_between() -> None:
    found = visible_at(under_a_ball(32).astype(np.float32), 24)
    exact = under_a_ball(24)
    assert np.array_equal(found[np.abs(exact) > 0.02], exact[np.abs(exact) > 0.02] > 0)
    assert (found[1:] != (exact[:-1] > 0)).mean() > 0.01  # a null: the vertex before


def test_what_is_resident_gives_the_distances(coded: CodedBits) -> None:
    matrix = rows_of_bits(coded)(np.arange(len(coded.cluster)))
    tables = resident_of_bits(coded)
    axes = np.random.default_rng(0).normal(size=(len(matrix), 6, 3)).astype(np.float32)
    every = np.arange(len(matrix))
    along = functools.partial(matrix_along, matrix)(every, axes)
    off = resident_along(tables, every, axes) - along
    assert np.sqrt((off**2).mean()) < 0.02
    assert np.sqrt(((resident_along(tables, every[::-1], axes) - along) ** 2).mean()) > 0.1
    # What a mesh knows better is taken in.
    nearer = resident_of_bits(coded, lambda vertices, rows: rows - 0.1)
    assert np.abs(resident_along(nearer, every, axes) - along + 0.1).mean() < 0.02


def test_a_decoder_reads_either_version_and_draws_what_it_tells(coded: CodedBits) -> None:
    decoder = Decoder.of_file(bits_to_bytes(coded, grid()))
    every, n = np.arange(len(coded.cluster)), coded.resolution
    ways = texel_directions(n).astype(np.float32)
    axes = np.broadcast_to(ways, (len(every), *ways.shape))
    rows = decoder.distances(every)
    np.testing.assert_allclose(decoder.distances_along(every, axes), rows, atol=1e-4)
    exact = under_a_ball(n)
    assert np.sqrt(((rows - exact) ** 2).mean()) < 0.06
    assert np.sqrt(((rows[1:] - exact[:-1]) ** 2).mean()) > 0.1  # a null: the vertex before
    # Other directions than the file's lie between its own.
    finer = decoder.distances_in(every, 24)
    assert np.sqrt(((finer - under_a_ball(24)) ** 2).mean()) < 0.06
    np.testing.assert_array_equal(decoder.distances_in(every, n), rows)


@pytest.mark.parametrize("share", [0.03, 0.1, 0.5])
def test_a_decoder_refuses_a_cut_file_of_bits(coded: CodedBits, share: float) -> None:
    file = bits_to_bytes(coded, grid())
    decoder = Decoder.of_file(file[: int(share * len(file))])
    with pytest.raises(ValueError, match=r"file|ends"):
        decoder.distances_along(np.arange(1), np.ones((1, 1, 3), np.float32))
