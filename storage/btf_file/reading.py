"""A compressed BTF of its bytes: whole, or one texel of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.btf_file import layout
from storage.btf_file.contents import LARGEST_SYMBOL, BtfFile, Quantised, Tensor
from storage.btf_file.layout import Layer
from storage.btf_file.parsing import ParsedFile, parsed_file
from storage.btf_file.rans import Ints, StreamDecoder, decode_sequence
from storage.btf_file.tiles import Level, decode_tiles, parents_of


def read_btf_file(data: bytes, name: str = "file.tbtf") -> BtfFile:
    """What a `.tbtf` file holds (docs/btf_file.md); ``name`` is for errors.

    Raises BadInput for a file that is cut, altered, newer, or not one.
    """
    file = parsed_file(data, name, whole=True)
    header = file.header
    decoder, student = _decoder(file, "decoder"), _decoder(file, "student")
    finest, mips = _all_levels(file)
    if finest is None:
        latents: Tensor = _vectors(file)
    else:
        latents = Quantised(finest, _steps(file, 0))
    return BtfFile(
        decoder, latents, header.height, header.width, header.alpha, _ids(file),
        tuple(Quantised(level, _steps(file, 1)) for level in mips), file.parallax,
        header.least, header.largest, student,
    )  # fmt: skip


def read_texel(
    data: bytes, level: int, row: int, column: int, name: str = "file.tbtf"
) -> NDArray[Any]:
    """Latents (C,) of one texel: int32 symbols, or float32 values of the paper's form.

    Reads the header, the tables, the tile that the texel is in and the ones above it, one of each
    coarser level; the checksum is not looked at.

    Raises BadInput as `read_btf_file` does, IndexError for a texel that is not there.
    """
    file = parsed_file(data, name, whole=False)
    header, levels = file.header, file.levels
    if not 0 <= level < len(levels):
        raise IndexError(f"level is {level}; expected 0 to {len(levels) - 1}.")
    rows, columns = levels[level].rows, levels[level].columns
    if not (0 <= row < rows and 0 <= column < columns):
        raise IndexError(f"texel is {row}, {column}; expected one of {rows} x {columns}.")
    if level == 0 and not header.predicted[0]:
        texel = row * columns + column
        return _vector(file, _id(file, texel) if header.ids else texel)
    known: Ints | None = None
    for number in range(len(levels) - 1, level - 1, -1):
        across, down = column >> (number - level), row >> (number - level)
        one = levels[number]
        tile = np.array([down // one.side * one.tile_columns + across // one.side])
        known = _tiles(file, number, tile, known)
    assert known is not None
    side = header.side
    found: NDArray[np.int32] = known[0, row % side, column % side].astype(np.int32)
    return found


def section_bytes(data: bytes, name: str = "file.tbtf") -> dict[str, int]:
    """Bytes of each section, by name; their sum is the file's size.

    ``header`` (with steps, parallax and lengths of streams), ``model`` (frequencies and
    coefficients), ``decoder``, ``student``, ``latents`` (finest level), ``mips``, ``ids``. In the
    paper's form the latter are those of its table 1. Raises BadInput.
    """
    file = parsed_file(data, name, whole=True)
    sections = {section: where.bytes for section, where in file.sections.items()}
    return {"header": len(data) - sum(sections.values()), **sections}


# ---- decoders --------------------------------------------------------------------------------


def _decoder(file: ParsedFile, section: str) -> dict[str, Tensor]:
    header = file.header
    layers: tuple[Layer, ...] = getattr(header, section)
    tensors = layout.tensors(layers)
    floats = file.floats(section)
    numbers = [np.full(math.prod(shape), table) for _, shape, table in tensors]
    every = np.concatenate([np.zeros(0, np.int64), *numbers])
    symbols = _sequence(file, section, every[every != layout.FLOAT], layout.A_STREAM)
    step = 0 if section == "decoder" else _quantised(header.decoder)
    found: dict[str, Tensor] = {}
    for name, shape, table in tensors:
        count = math.prod(shape)
        if table == layout.FLOAT:
            found[name], floats = floats[:count].reshape(shape), floats[count:]
        else:
            found[name] = Quantised(symbols[:count].reshape(shape), file.steps[step])
            symbols, step = symbols[count:], step + 1
    return found


def _quantised(layers: tuple[Layer, ...]) -> int:
    return sum(table != layout.FLOAT for *_, table in layout.tensors(layers))


def _sequence(file: ParsedFile, section: str, tables: Ints, a_stream: int) -> NDArray[np.int32]:
    if not len(tables):
        return np.zeros(0, np.int32)
    decoder = file.streams(section, np.arange(-(-len(tables) // a_stream)))
    return _checked(file, section, decoder, decode_sequence(decoder, tables, a_stream))


def _checked(
    file: ParsedFile, section: str, decoder: StreamDecoder, symbols: Ints
) -> NDArray[np.int32]:
    """The symbols, if their streams have ended where they have to."""
    if not decoder.ended() or symbols.min() < -LARGEST_SYMBOL:
        file.refuse(section, "a damaged stream")
    return symbols.astype(np.int32)


# ---- latents ---------------------------------------------------------------------------------


def _steps(file: ParsedFile, group: int) -> NDArray[np.float32]:
    """Steps (C,) of the finest level (0) or of the coarser ones (1)."""
    header = file.header
    first = _quantised(header.decoder) + _quantised(header.student)
    first += header.channels * (group and not header.float_latents)
    return file.steps[first : first + header.channels]


def _vectors(file: ParsedFile) -> Tensor:
    """The finest level's latents where they are values, or no image."""
    header = file.header
    if header.float_latents:
        return file.floats("latents").reshape(header.vectors, header.channels)
    numbers = np.tile(file.channel_tables[0], header.vectors)
    symbols = _sequence(file, "latents", numbers, header.side**2 * header.channels)
    return Quantised(symbols.reshape(-1, header.channels), _steps(file, 0))


def _vector(file: ParsedFile, number: int) -> NDArray[Any]:
    """One of them."""
    header = file.header
    if header.float_latents:
        start = file.sections["latents"].start + 4 * header.channels * number
        return np.frombuffer(file.data, "<f4", header.channels, start).astype(np.float32)
    stream, place = divmod(number, header.side**2)
    vectors = min(header.side**2, header.vectors - stream * header.side**2)
    numbers = np.tile(file.channel_tables[0], vectors)
    decoder = file.streams("latents", np.array([stream]))
    found = decode_sequence(decoder, numbers, len(numbers)).reshape(-1, header.channels)
    return _checked(file, "latents", decoder, found)[place]


def _tiles(file: ParsedFile, level: int, tiles: Ints, coarser: Ints | None) -> Ints:
    """Symbols (tile, row, column, C) of tiles of a level, ``coarser`` those of the level above."""
    levels, group = file.levels, int(level > 0)
    before = sum(one.tiles for one in levels[1:level])
    section = "mips" if level else "latents"
    decoder = file.streams(section, before + tiles)
    one = levels[level]
    parents = None if coarser is None else parents_of(one, tiles, levels[level + 1], coarser)
    found = decode_tiles(
        decoder, one, tiles, parents, file.coefficients[group], file.channel_tables[group]
    )
    _checked(file, section, decoder, found)
    return found


def _all_levels(
    file: ParsedFile,
) -> tuple[NDArray[np.int32] | None, list[NDArray[np.int32]]]:
    """Symbols (n, C) of the finest level, if it is an image of symbols, and of coarser ones."""
    channels = file.header.channels
    found: list[NDArray[np.int32]] = []
    known: Ints | None = None
    lowest = 0 if file.header.predicted[0] else 1
    for number in range(len(file.levels) - 1, lowest - 1, -1):
        one: Level = file.levels[number]
        known = _tiles(file, number, np.arange(one.tiles), known)
        found.insert(0, one.joined(known).reshape(-1, channels).astype(np.int32))
    return (None, found) if lowest else (found[0], found[1:])


# ---- cluster numbers -------------------------------------------------------------------------


def _ids(file: ParsedFile) -> NDArray[np.int32] | None:
    header, where = file.header, file.sections["ids"]
    if not header.ids:
        return None
    texels, bits = header.height * header.width, header.id_bits
    packed = np.frombuffer(file.data, np.uint8, where.bytes, where.start)
    if bits == 32:
        found = packed.view("<i4").astype(np.int64)
    else:
        each = np.unpackbits(packed, bitorder="little", count=texels * bits).reshape(texels, bits)
        found = each @ (1 << np.arange(bits, dtype=np.int64))
    if found.min() < 0 or found.max() >= header.vectors:
        file.refuse("ids", f"{found.min()} to {found.max()}", f"0 to {header.vectors - 1}")
    return found.astype(np.int32)


def _id(file: ParsedFile, texel: int) -> int:
    """The latent vector of one texel."""
    header, where = file.header, file.sections["ids"]
    first = texel * header.id_bits
    part = file.data[where.start + first // 8 : where.start + -(-(first + header.id_bits) // 8)]
    found = int.from_bytes(part, "little") >> first % 8 & (1 << header.id_bits) - 1
    if found >= header.vectors:
        file.refuse("ids", f"{found}", f"0 to {header.vectors - 1}")
    return found
