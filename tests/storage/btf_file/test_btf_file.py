"""Files of compressed BTFs: read back, by one texel, and by a decoder written from the page."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import LATENTS
from storage.btf_file import (
    BtfFile,
    Quantised,
    read_btf_file,
    read_texel,
    section_bytes,
    values_of,
    write_btf_file,
)
from storage.btf_file.contents import Tensor, level_size
from storage.btf_file.parsing import parsed_file
from tests.storage.btf_file.page_decoder import PageFile

PAGE = Path(__file__).parents[3] / "docs" / "btf_file.md"


def symbols_of(chance: np.random.Generator, kind: str, shape: tuple[int, ...]) -> NDArray[np.int32]:
    """Whole numbers of a kind: all over, all the same, only the ends, close to 0."""
    if kind == "any":
        found = chance.integers(-127, 128, shape)
    elif kind == "equal":
        found = np.full(shape, chance.integers(-127, 128))
    elif kind == "ends":
        found = chance.choice([-127, 127], shape)
    else:
        found = np.clip(np.rint(chance.normal(0, 2, shape)), -127, 127)
    return found.astype(np.int32)


def steps_of(chance: np.random.Generator, *shape: int) -> NDArray[np.float32]:
    return np.array(chance.uniform(0.01, 1.0, shape), np.float32)


def decoder_of(
    chance: np.random.Generator, widths: list[int], kind: str, *, values: bool = False
) -> dict[str, Tensor]:
    """A decoder whose layers have these widths; ``values``: every tensor is float32."""
    found: dict[str, Tensor] = {}
    for layer, (inputs, outputs) in enumerate(itertools.pairwise(widths), 1):
        for name, shape in ((f"weight_{layer}", (outputs, inputs)), (f"bias_{layer}", (outputs,))):
            if values:
                found[name] = chance.normal(size=shape).astype(np.float32)
            else:
                found[name] = Quantised(symbols_of(chance, kind, shape), steps_of(chance))
    return found


@st.composite
def btf_files(draw: st.DrawFn) -> BtfFile:
    """Files of all forms, from one texel to some that are larger than a tile."""
    chance = np.random.default_rng(draw(st.integers(0, 2**32)))
    side = st.one_of(st.integers(1, 4), st.integers(1, 47))
    height, width, channels = draw(side), draw(side), draw(st.integers(1, 4))
    kind = draw(st.sampled_from(("any", "equal", "ends", "near")))
    texels = height * width
    k = draw(st.none() | st.integers(1, texels))
    form = draw(st.sampled_from(("symbols", "values")))
    vectors = texels if k is None else k
    latents: Tensor = chance.normal(size=(vectors, channels)).astype(np.float32)
    if form == "symbols":
        found = symbols_of(chance, kind, (vectors, channels))
        latents = Quantised(found, steps_of(chance, channels))
    coarse = steps_of(chance, channels)
    most = (max(height, width) - 1).bit_length()
    mips = tuple(
        Quantised(
            symbols_of(chance, kind, (math.prod(level_size(height, width, level)), channels)),
            coarse,
        )
        for level in range(1, 1 + draw(st.integers(0, most)))
    )
    widths = [channels + 4, *draw(st.lists(st.integers(1, 30), max_size=3)), 3]
    decoder = decoder_of(chance, widths, kind, values=draw(st.booleans()))
    if draw(st.booleans()):
        decoder["bias_1"] = values_of(decoder["bias_1"])
    return BtfFile(
        decoder,
        latents,
        height,
        width,
        draw(st.floats(0.125, 100, width=32)),
        None if k is None else chance.integers(0, k, texels).astype(np.int32),
        mips,
        chance.normal(size=(9, 2)).astype(np.float32) if draw(st.booleans()) else None,
        draw(st.sampled_from((0.0, -math.inf, -0.25))),
        draw(st.sampled_from((1.0, math.inf))),
        decoder_of(chance, [channels + 4, 5, 3], kind) if draw(st.booleans()) else {},
    )


def assert_equal(one: Tensor, other: Tensor) -> None:
    assert isinstance(one, Quantised) == isinstance(other, Quantised)
    if isinstance(one, Quantised) and isinstance(other, Quantised):
        assert other.symbols.dtype == np.int32
        np.testing.assert_array_equal(one.symbols, other.symbols)
        np.testing.assert_array_equal(one.step, other.step)
    assert values_of(other).dtype == np.float32
    np.testing.assert_array_equal(values_of(one), values_of(other))


@given(btf_files())
@settings(max_examples=30)
def test_what_was_written_is_read(btf: BtfFile) -> None:
    data = write_btf_file(btf)
    found = read_btf_file(data)
    for name in ("decoder", "student"):
        one, other = getattr(btf, name), getattr(found, name)
        assert set(one) == set(other)
        for tensor in one:
            assert_equal(one[tensor], other[tensor])
    for level, again in zip((btf.latents, *btf.mips), (found.latents, *found.mips), strict=True):
        assert_equal(level, again)
    for name in ("ids", "parallax"):
        np.testing.assert_array_equal(getattr(btf, name), getattr(found, name))
    for name in ("height", "width", "alpha", "least", "largest"):
        assert getattr(btf, name) == getattr(found, name)
    assert write_btf_file(found) == data
    assert sum(section_bytes(data).values()) == len(data)


@given(btf_files(), st.data())
@settings(max_examples=25)
def test_one_texel_is_that_of_the_whole(btf: BtfFile, data: st.DataObject) -> None:
    file = write_btf_file(btf)
    level = data.draw(st.integers(0, len(btf.mips)))
    rows, columns = level_size(btf.height, btf.width, level)
    row, column = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, columns - 1))
    number = row * columns + column
    if level == 0 and btf.ids is not None:
        number = btf.ids[number]
    tensor = (btf.latents, *btf.mips)[level]
    expected = tensor.symbols if isinstance(tensor, Quantised) else tensor
    found = read_texel(file, level, row, column)
    assert found.dtype == expected.dtype
    np.testing.assert_array_equal(found, expected[number])
    with pytest.raises(IndexError):
        read_texel(file, level, rows, column)


@given(btf_files())
@settings(max_examples=25)
def test_the_page_is_enough_to_decode_it(btf: BtfFile) -> None:
    found = PageFile(write_btf_file(btf))
    assert (found.height, found.width, found.alpha) == (btf.height, btf.width, btf.alpha)
    assert (found.least, found.largest) == (btf.least, btf.largest)
    for name in ("decoder", "student"):
        for tensor, value in getattr(btf, name).items():
            np.testing.assert_array_equal(getattr(found, name)[tensor], values_of(value))
            if isinstance(value, Quantised):
                np.testing.assert_array_equal(found.symbols[f"{name}/{tensor}"], value.symbols)
    np.testing.assert_array_equal(found.ids, btf.ids)
    np.testing.assert_array_equal(found.parallax, btf.parallax)
    for level, tensor in enumerate((btf.latents, *btf.mips)):
        values = values_of(tensor)
        if level == 0 and btf.ids is not None:
            values = values[btf.ids]
        np.testing.assert_array_equal(found.level(level).reshape(values.shape), values)


def smooth(chance: np.random.Generator, height: int, width: int, channels: int) -> NDArray:
    """Gaussian fields that repeat, of deviation 1, correlated over some three texels."""
    down, across = np.fft.fftfreq(height)[:, None], np.fft.fftfreq(width)[None]
    filter_ = np.exp(-0.5 * (down**2 + across**2) * (2 * np.pi * 1.5) ** 2)
    noise = np.fft.fft2(chance.normal(size=(height, width, channels)), axes=(0, 1))
    found = np.fft.ifft2(noise * filter_[..., None], axes=(0, 1)).real
    return found / found.std(axis=(0, 1))


def averaged_levels(finest: NDArray) -> list[NDArray]:
    """Means of two by two texels, down to one."""
    found = [finest]
    while max(found[-1].shape[:2]) > 1:
        last = np.pad(found[-1], [(0, size % 2) for size in found[-1].shape[:2]] + [(0, 0)], "edge")
        found.append((last[::2, ::2] + last[1::2, ::2] + last[::2, 1::2] + last[1::2, 1::2]) / 4)
    return found


def image_file(finest: NDArray, step: float, widths: tuple[int, ...]) -> BtfFile:
    """All levels of an image (rows, columns, C) with one step, and a decoder of noise."""
    channels = finest.shape[-1]
    steps = np.full(channels, step, np.float32)
    levels = [
        Quantised(np.rint(level / step).astype(np.int32).reshape(-1, channels), steps)
        for level in averaged_levels(finest)
    ]
    decoder = decoder_of(np.random.default_rng(5), [channels + 4, *widths, 3], "near")
    return BtfFile(decoder, levels[0], *finest.shape[:2], 1.5, mips=tuple(levels[1:]), least=-0.1)


def entropy_bytes(columns: list[NDArray]) -> float:
    """Bytes of these at their empirical entropies."""
    total = 0.0
    for column in columns:
        counts = np.unique(column, return_counts=True)[1]
        total -= float((counts * np.log2(counts / counts.sum())).sum()) / 8
    return total


def latent_columns(btf: BtfFile) -> list[NDArray]:
    """Symbols of each channel of the finest level, and of all coarser ones."""
    assert isinstance(btf.latents, Quantised)
    coarser = np.concatenate([level.symbols for level in btf.mips])
    return [*btf.latents.symbols.T, *coarser.T]


def test_a_file_is_hardly_larger_than_its_symbols_entropy() -> None:
    """Of noise, which nothing predicts: coarser levels of their own, not averages."""
    chance = np.random.default_rng(2)
    steps = np.full(8, 0.5, np.float32)
    shapes = [level_size(100, 100, level) for level in range(8)]
    levels = [Quantised(symbols_of(chance, "near", (a * b, 8)), steps) for a, b in shapes]
    decoder = decoder_of(chance, [12, 106, 106, 106, 3], "near")
    parallax = np.zeros((9, 2), np.float32)
    btf = BtfFile(decoder, levels[0], 100, 100, 1.5, None, tuple(levels[1:]), parallax)
    weights = [tensor.symbols for tensor in decoder.values() if isinstance(tensor, Quantised)]
    data = write_btf_file(btf)
    assert len(data) < 1.025 * entropy_bytes([*latent_columns(btf), *weights])
    assert section_bytes(data)["decoder"] < 1.01 * entropy_bytes(weights)


def test_neighbours_and_coarser_levels_save_bytes_where_there_is_something_to_save() -> None:
    chance = np.random.default_rng(3)
    field = smooth(chance, 64, 64, 4)
    sizes = {}
    for name, image in {
        "smooth": field,
        "shuffled": chance.permutation(field.reshape(-1, 4)).reshape(field.shape),
    }.items():
        btf = image_file(image, 0.25, (8,))
        found = section_bytes(write_btf_file(btf))
        sizes[name] = (found["latents"] + found["mips"]) / entropy_bytes(latent_columns(btf))
    assert sizes["smooth"] < 0.62
    assert sizes["shuffled"] > 0.85  # what coarser levels say of the finest is all there is


@pytest.mark.parametrize(("k", "table_1"), [(None, 417_532), (500, 153_532), (2000, 201_532)])
def test_the_papers_form_has_the_papers_bytes(k: int | None, table_1: int) -> None:
    chance = np.random.default_rng(4)
    decoder = decoder_of(chance, [12, 106, 106, 106, 3], "near", values=True)
    latents = chance.normal(size=(k or 10_000, LATENTS)).astype(np.float32)
    ids = None if k is None else chance.integers(0, k, 10_000).astype(np.int32)
    data = write_btf_file(BtfFile(decoder, latents, 100, 100, 1.0, ids))
    found = section_bytes(data)
    assert found["decoder"] + found["latents"] + found["ids"] == table_1
    assert len(data) - table_1 < 70


def test_a_texel_takes_its_tile_and_those_above_it_alone() -> None:
    btf = image_file(smooth(np.random.default_rng(6), 64, 50, 3), 0.2, (8,))
    data = write_btf_file(btf)
    assert isinstance(btf.latents, Quantised)
    file = parsed_file(data, "a.tbtf", whole=True)
    texel, needed = (41, 7), {"latents": {2 * 3}, "mips": {1 * 2, 4, 5, 6, 7, 8}}
    for section in ("decoder", "latents", "mips"):
        where = file.sections[section]
        at = where.start
        words = file.words[where.first_stream : where.first_stream + where.streams]
        for number, size in enumerate(2 * words):
            wrecked = data[:at] + bytes(size) + data[at + size :]
            at += size
            if number in needed.get(section, ()):
                with pytest.raises(ValueError, match="damaged"):
                    read_texel(wrecked, 0, *texel)
            else:
                expected = btf.latents.symbols[texel[0] * 50 + texel[1]]
                np.testing.assert_array_equal(read_texel(wrecked, 0, *texel), expected)


def test_the_page_tells_how_values_become_radiance() -> None:
    """The page's decoder against the network in torch, between texels, levels and directions."""
    chance = np.random.default_rng(7)
    image = image_file(smooth(chance, 12, 9, LATENTS), 0.25, ())
    decoder = {
        name: Quantised(tensor.symbols, np.array(0.06, np.float32))
        for name, tensor in decoder_of(chance, [12, 106, 106, 106, 3], "near").items()
        if isinstance(tensor, Quantised)
    }
    btf = BtfFile(
        decoder, image.latents, 12, 9, 1.5, None, image.mips,
        chance.normal(0, 0.5, (9, 2)).astype(np.float32), -0.2, 0.9,
    )  # fmt: skip
    data = write_btf_file(btf)
    page, found = PageFile(data), read_btf_file(data)
    compressed = CompressedBtf(
        {name: values_of(tensor) for name, tensor in found.decoder.items()},
        values_of(found.latents), found.ids, found.alpha, found.height, found.width,
        tuple(level.values() for level in found.mips), found.parallax, found.least, found.largest,
    )  # fmt: skip
    places = chance.uniform(-1, 2, (20, 2))
    light, view = (chance.normal(size=(20, 3)) * [0.5, 0.5, 0] + [0, 0, 1] for _ in range(2))
    light, view = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (light, view))
    footprint = chance.uniform(0.05, 1.2, 20)
    expected = compressed.radiance_at(places, light, view, footprint)
    asked = list(zip(places, light, view, strict=True))
    values = [page.radiance(*one, 12 * seen) for one, seen in zip(asked, footprint, strict=True)]
    np.testing.assert_allclose(values, expected, atol=2e-5)
    assert np.min(values) < 0
    assert np.std(values) > 0.1
    near = compressed.radiance_at(places, light, view)
    np.testing.assert_allclose([page.radiance(*one) for one in asked], near, atol=2e-5)
    assert np.abs(near - expected).max() > 0.05


def page_example() -> BtfFile:
    row, column = np.divmod(np.arange(15), 5)
    latents = np.stack([row - column, row * column % 3 - 1], axis=1).astype(np.int32)
    coarse = np.stack([np.arange(6) % 3 - 1, np.arange(6) // 3], axis=1).astype(np.int32)
    weights = (np.arange(18) % 5 - 2).reshape(3, 6).astype(np.int32)
    return BtfFile(
        {
            "weight_1": Quantised(weights, np.array(0.25, np.float32)),
            "bias_1": np.array([0.5, 0.25, 0.125], np.float32),
        },
        Quantised(latents, np.array([0.5, 0.25], np.float32)),
        height=3, width=5, alpha=1.5,
        mips=(Quantised(coarse, np.array([0.5, 0.5], np.float32)),),
    )  # fmt: skip


def test_the_pages_example_is_what_is_written() -> None:
    lines = re.findall(r"^    ([0-9a-f]{4})  ([0-9a-f ]+?)(?:   .*)?$", PAGE.read_text(), re.M)
    dump = b"".join(bytes.fromhex(text) for _, text in lines)
    assert len(lines) >= 9
    assert dump.hex(" ") == write_btf_file(page_example()).hex(" ")
    found = PageFile(dump)
    assert found.level(0)[:, :, 0].tolist() == [
        [0.0, -0.5, -1.0, -1.5, -2.0],
        [0.5, 0.0, -0.5, -1.0, -1.5],
        [1.0, 0.5, 0.0, -0.5, -1.0],
    ]
