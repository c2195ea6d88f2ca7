"""Bytes of a compressed BTF."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.btf_file import layout
from storage.btf_file.checking import check_contents
from storage.btf_file.contents import BtfFile, Quantised, Tensor
from storage.btf_file.layout import Header, Layer
from storage.btf_file.rans import Ints, encode_streams
from storage.btf_file.tables import ENTRY_TABLE, counts_of, shared_tables
from storage.btf_file.tiles import fitted_coefficients, levels_of

TILE_SIDE = 20
"""Texels: a smaller tile reads less for one texel, a larger one takes fewer bytes in all."""


class _Kind(NamedTuple):
    """Symbols that have one table: a tensor's, or a channel's of some levels."""

    step: NDArray[np.float32]
    counts: NDArray[np.int64]


class _Latents(NamedTuple):
    """Levels as they are coded."""

    finest: list[Ints]
    """Each stream's symbols (n, C), or nothing where they are values."""
    coarser: list[Ints]
    coefficients: list[Ints]
    """(C, 4, 5) of the levels that are predicted."""


def write_btf_file(btf: BtfFile) -> bytes:
    """The bytes of a `.tbtf` file (docs/btf_file.md); equal contents make equal bytes.

    Raises ValueError, one sentence, for contents that no file can hold.

    >>> btf = BtfFile(
    ...     {"weight_1": np.ones((3, 6), np.float32), "bias_1": np.zeros(3, np.float32)},
    ...     Quantised(np.array([[1, -2]] * 12, np.int32), np.float32([0.5, 0.25])),
    ...     height=3, width=4, alpha=1.5,
    ... )
    >>> data = write_btf_file(btf)
    >>> from storage.btf_file import read_btf_file, read_texel
    >>> read_btf_file(data).latents.values()[0].tolist(), read_texel(data, 0, 2, 3).tolist()
    ([0.5, -0.5], [1, -2])
    """
    check_contents(btf)
    decoders = [btf.decoder, btf.student]
    latents = _coded_latents(btf)
    kinds = _kinds(btf, latents)
    tables, numbers = shared_tables([kind.counts for kind in kinds])
    left = iter(numbers)
    layers = [_layers(decoder, left) for decoder in decoders]
    channel_tables = list(left)
    channels = _channels(btf)
    entries = [entry for table in tables for entry in table.entries()]
    for coefficients in latents.coefficients:
        entries += np.diff(coefficients, axis=0, prepend=0).ravel().tolist()
    model = np.array(entries, np.int64)
    streams = [encode_streams([model], [np.zeros_like(model)], [ENTRY_TABLE])]
    for decoder, form in zip(decoders, layers, strict=True):
        symbols, which = _decoder_symbols(decoder, form)
        cuts = np.arange(layout.A_STREAM, len(symbols), layout.A_STREAM)
        parts = (np.split(values, cuts) if len(symbols) else [] for values in (symbols, which))
        streams.append(encode_streams(next(parts), next(parts), tables))
    given = iter(np.array(channel_tables, np.int64).reshape(-1, channels))
    for group in (latents.finest, latents.coarser):
        which = next(given) if group else np.zeros(0, np.int64)
        each = [np.tile(which, len(symbols)) for symbols in group]
        streams.append(encode_streams([symbols.reshape(-1) for symbols in group], each, tables))
    header = _header(btf, layers[0], layers[1], len(tables))
    steps = np.array([kind.step for kind in kinds], "<f4")
    lengths = np.array([len(stream) // 2 for group in streams for stream in group], "<u2")
    coded = [b"".join(group) for group in streams]
    preamble = header.packed() + bytes(channel_tables) + steps.tobytes()
    preamble += b"" if btf.parallax is None else btf.parallax.astype("<f4").tobytes()
    return layout.sealed(
        preamble + lengths.tobytes() + coded[0]
        + _floats(btf.decoder) + coded[1]
        + _floats(btf.student) + coded[2]
        + _floats({"latents": btf.latents}) + coded[3] + coded[4]
        + _packed_ids(btf.ids, header.id_bits)
    )  # fmt: skip


def _channels(btf: BtfFile) -> int:
    return int(_array(btf.latents).shape[1])


def _array(tensor: Tensor) -> NDArray[np.generic]:
    return tensor.symbols if isinstance(tensor, Quantised) else tensor


def _header(
    btf: BtfFile, decoder: tuple[Layer, ...], student: tuple[Layer, ...], tables: int
) -> Header:
    return Header(
        _channels(btf), len(btf.mips), btf.height, btf.width, len(_array(btf.latents)),
        btf.alpha, btf.least, btf.largest, TILE_SIDE, decoder, student, tables,
        not isinstance(btf.latents, Quantised), btf.ids is not None, btf.parallax is not None,
    )  # fmt: skip


def _kinds(btf: BtfFile, latents: _Latents) -> list[_Kind]:
    """In the order of the file: the decoders' tensors, channels of the finest level, of coarser."""
    found = [
        _Kind(tensor.step, counts_of(tensor.symbols))
        for decoder in (btf.decoder, btf.student)
        for tensor in _in_order(decoder)
        if isinstance(tensor, Quantised)
    ]
    groups = []
    if isinstance(btf.latents, Quantised):
        groups.append((btf.latents.step, latents.finest))
    if btf.mips:
        groups.append((btf.mips[0].step, latents.coarser))
    for step, streams in groups:
        symbols = np.concatenate(streams)
        found += [_Kind(s, counts_of(column)) for s, column in zip(step, symbols.T, strict=True)]
    return found


def _in_order(decoder: Mapping[str, Tensor]) -> list[Tensor]:
    layers = range(1, len(decoder) // 2 + 1)
    return [decoder[f"{kind}_{layer}"] for layer in layers for kind in ("weight", "bias")]


def _layers(decoder: Mapping[str, Tensor], numbers: Iterator[int]) -> tuple[Layer, ...]:
    tensors = _in_order(decoder)
    found = []
    for weight, bias in zip(tensors[::2], tensors[1::2], strict=True):
        outputs, inputs = _array(weight).shape
        first, second = (
            next(numbers) if isinstance(tensor, Quantised) else layout.FLOAT
            for tensor in (weight, bias)
        )
        found.append(Layer(inputs, outputs, first, second))
    return tuple(found)


def _decoder_symbols(decoder: Mapping[str, Tensor], layers: tuple[Layer, ...]) -> tuple[Ints, Ints]:
    """All symbols of a decoder, and the table of each."""
    symbols, tables = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for name, _, table in layout.tensors(layers):
        tensor = decoder[name]
        if isinstance(tensor, Quantised):
            symbols.append(tensor.symbols.ravel().astype(np.int64))
            tables.append(np.full(tensor.symbols.size, table))
    return np.concatenate(symbols), np.concatenate(tables)


def _coded_latents(btf: BtfFile) -> _Latents:
    channels = _channels(btf)
    levels = levels_of(btf.height, btf.width, len(btf.mips), TILE_SIDE)
    groups: list[list[Ints]] = [[], []]
    coefficients = []
    images: list[Ints | None] = [None] * (len(levels) + 1)
    for number, tensor in enumerate((btf.latents, *btf.mips)):
        if isinstance(tensor, Quantised) and (number or btf.ids is None):
            shape = levels[number].rows, levels[number].columns, channels
            images[number] = tensor.symbols.reshape(shape).astype(np.int64)
        elif isinstance(tensor, Quantised):
            symbols, size = tensor.symbols.astype(np.int64), TILE_SIDE**2
            groups[0] = [symbols[n : n + size] for n in range(0, len(symbols), size)]
    for group, part in enumerate((slice(0, 1), slice(1, len(levels)))):
        inside = [image for image in images[part] if image is not None]
        if inside:
            above = images[part.start + 1 : part.stop + 1]
            found, differences = fitted_coefficients(levels[part], inside, above)
            coefficients.append(found.transpose(1, 0, 2))
            for level, values in zip(levels[part], differences, strict=True):
                groups[group] += [tile.reshape(-1, channels) for tile in level.cut(values)]
    return _Latents(groups[0], groups[1], coefficients)


def _floats(tensors: Mapping[str, Tensor]) -> bytes:
    values = [tensors["latents"]] if "latents" in tensors else _in_order(tensors)
    return b"".join(
        tensor.astype("<f4").tobytes() for tensor in values if not isinstance(tensor, Quantised)
    )


def _packed_ids(ids: NDArray[np.int32] | None, bits: int) -> bytes:
    if ids is None:
        return b""
    if bits == 32:
        return ids.astype("<i4").tobytes()
    each = ids.astype(np.int64)[:, None] >> np.arange(bits) & 1
    return np.packbits(each.astype(np.uint8), bitorder="little").tobytes()
