"""A file's header and tables, each believed only once it is known to be possible."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from storage.btf_file import layout
from storage.btf_file.layout import FLOAT, HEADER, LAYER, Header, Layer
from storage.btf_file.rans import Ints, StreamDecoder
from storage.btf_file.tables import ENTRY_TABLE, Table, table_of_entries
from storage.btf_file.tiles import PHASES, PREDICTORS, Level, levels_of
from storage.readers.bad_input import BadInput

_AGAIN = "the whole file: copy it again, or have it made again"


@dataclass(frozen=True)
class Section:
    """Float32 values, then streams."""

    start: int
    floats: int
    first_stream: int
    streams: int
    bytes: int


@dataclass(frozen=True)
class ParsedFile:
    """Everything but symbols and values."""

    name: str
    data: bytes
    header: Header
    channel_tables: Ints
    """(2, C) of the finest level and of the coarser ones; -1 where there is no such symbol."""
    steps: NDArray[np.float32]
    """One a tensor of symbols, then C of the finest level, then C of the coarser ones."""
    parallax: NDArray[np.float32] | None
    words: Ints
    """Of each stream."""
    sections: dict[str, Section]
    tables: list[Table]
    coefficients: tuple[Ints, Ints]
    """(4, C, 5) of the finest level and of the coarser ones, 0 where nothing is predicted."""

    @property
    def levels(self) -> list[Level]:
        """Finest first."""
        header = self.header
        return levels_of(header.height, header.width, header.coarser, header.side)

    def streams(self, section: str, numbers: Ints) -> StreamDecoder:
        """A decoder of these streams of a section, which are numbered from 0 there."""
        where = self.sections[section]
        words = self.words[where.first_stream : where.first_stream + where.streams]
        starts = where.start + 4 * where.floats + 2 * (np.cumsum(words) - words)
        parts = [
            np.frombuffer(self.data, "<u2", count, start)
            for count, start in zip(words[numbers].tolist(), starts[numbers].tolist(), strict=True)
        ]
        return StreamDecoder(np.concatenate(parts), words[numbers], self.tables)

    def floats(self, section: str) -> NDArray[np.float32]:
        """A section's float32 values; BadInput where one is not finite."""
        where = self.sections[section]
        found = np.frombuffer(self.data, "<f4", where.floats, where.start).astype(np.float32)
        if not np.isfinite(found).all():
            self.refuse(section, "a value that is not finite", "finite values")
        return found

    def refuse(self, field: str, found: str, expected: str = _AGAIN) -> NoReturn:
        """Raise BadInput."""
        raise BadInput(self.name, field, found, expected)


def parsed_file(data: bytes, name: str, *, whole: bool) -> ParsedFile:
    """Header and tables of a file; ``whole``: its checksum has to be right, too.

    Raises BadInput.
    """
    header = _header(data, name, whole=whole)
    at = HEADER.size + LAYER.size * len(header.decoder + header.student)
    kinds = [not header.float_latents, header.coarser > 0]
    tensors = layout.tensors(header.decoder) + layout.tensors(header.student)
    quantised = sum(table != FLOAT for *_, table in tensors)
    counts = {
        "channel tables": ("u1", header.channels * sum(kinds)),
        "steps": ("<f4", quantised + header.channels * sum(kinds)),
        "parallax": ("<f4", layout.PARALLAX * header.parallax),
        "lengths of streams": ("<u2", sum(streams for _, streams in _contents(header).values())),
    }
    found = {}
    for field, (dtype, count) in counts.items():
        size = count * np.dtype(dtype).itemsize
        if at + size > len(data):
            raise BadInput(name, field, f"cut: {size} bytes, {len(data) - at} are there", _AGAIN)
        found[field] = np.frombuffer(data, dtype, count, at)
        at += size
    _check(found, header, name)
    given = iter(found["channel tables"].astype(np.int64).reshape(-1, header.channels))
    nothing = np.full(header.channels, -1, np.int64)
    words = found["lengths of streams"].astype(np.int64)
    sections = _sections(header, words, at, len(data), name)
    tables, coefficients = _model(header, data, words, sections["model"], name)
    return ParsedFile(
        name, data, header, np.stack([next(given) if kind else nothing for kind in kinds]),
        found["steps"].astype(np.float32),
        found["parallax"].astype(np.float32).reshape(9, 2) if header.parallax else None,
        words, sections, tables, coefficients,
    )  # fmt: skip


def _header(data: bytes, name: str, *, whole: bool) -> Header:
    if data[:4] != layout.MAGIC:
        raise BadInput(name, "beginning", repr(data[:4])[1:], "'TBTF': a compressed BTF")
    if len(data) > 4 and data[4] != layout.VERSION:
        expected = f"{layout.VERSION}: have the file made again, or use a newer release"
        raise BadInput(name, "version", f"{data[4]}", expected)
    if len(data) < HEADER.size:
        raise BadInput(name, "length", f"{len(data)} bytes", _AGAIN)
    (
        _, _, flags, channels, coarser, length, crc, height, width, vectors, alpha, least, largest,
        side, layers, student, tables,
    ) = HEADER.unpack_from(data)  # fmt: skip
    if length != len(data):
        raise BadInput(
            name, "length", f"{len(data)} bytes", f"{length}, as its header says: {_AGAIN}"
        )
    if whole and crc != layout.checksum(data):
        raise BadInput(name, "checksum", f"{layout.checksum(data):08x}", f"{crc:08x}: {_AGAIN}")
    known = {key: bool(flags & bit) for key, bit in layout.FLAGS.items()}
    limits = {
        "flags": (flags, 0, sum(layout.FLAGS.values())),
        "channels": (channels, 1, layout.MOST_CHANNELS),
        "height": (height, 1, 65535),
        "width": (width, 1, 65535),
        "coarser levels": (coarser, 0, max((max(height, width) - 1).bit_length(), 0)),
        "latents": (height * width * channels, 1, layout.MOST_LATENTS),
        "latent vectors": (vectors, 1, height * width),
        "side of a tile": (side, 2, layout.MOST_SIDE),
        "layers": (layers, 1, layout.MOST_LAYERS),
        "layers of the student": (student, 0, layout.MOST_LAYERS),
        "tables": (tables, 0, layout.MOST_TABLES),
    }
    for field, (value, lowest, highest) in limits.items():
        if not lowest <= value <= highest:
            raise BadInput(name, field, f"{value}", f"{lowest} to {highest}")
    if side % 2:
        raise BadInput(name, "side of a tile", f"{side}", "an even number")
    if not known["ids"] and vectors != height * width:
        raise BadInput(name, "latent vectors", f"{vectors}", f"{height * width}, one a texel")
    if not (0 < alpha < math.inf and least <= largest):
        found = f"{alpha:g}, {least:g}, {largest:g}"
        raise BadInput(name, "alpha, least, largest", found, "above 0, and two in order")
    if len(data) < HEADER.size + LAYER.size * (layers + student):
        raise BadInput(name, "layers", "cut", _AGAIN)
    decoder, second = (
        _layers(data, HEADER.size + LAYER.size * first, count, channels, tables, name)
        for first, count in ((0, layers), (layers, student))
    )
    return Header(
        channels, coarser, height, width, vectors, alpha, least, largest, side, decoder, second,
        tables, known["float_latents"], known["ids"], known["parallax"],
    )  # fmt: skip


def _layers(
    data: bytes, at: int, count: int, channels: int, tables: int, name: str
) -> tuple[Layer, ...]:
    found: list[Layer] = []
    inputs = channels + layout.DIRECTIONS
    for outputs, *numbers in LAYER.iter_unpack(data[at : at + LAYER.size * count]):
        if not 1 <= outputs <= layout.MOST_WIDTH:
            raise BadInput(name, "outputs of a layer", f"{outputs}", f"1 to {layout.MOST_WIDTH}")
        for number in numbers:
            if tables <= number != FLOAT:
                raise BadInput(name, "table of a layer", f"{number}", f"below {tables}, or {FLOAT}")
        found.append(Layer(inputs, outputs, *numbers))
        inputs = outputs
    if count and inputs != layout.COLOURS:
        raise BadInput(name, "outputs of the last layer", f"{inputs}", f"{layout.COLOURS} colours")
    weights = sum(layer.outputs * (layer.inputs + 1) for layer in found)
    if weights > layout.MOST_WEIGHTS:
        raise BadInput(name, "weights", f"{weights}", f"at most {layout.MOST_WEIGHTS}")
    return tuple(found)


def _contents(header: Header) -> dict[str, tuple[int, int]]:
    """Float32 values and streams of each section but the ids."""
    finest, *coarser = levels_of(header.height, header.width, header.coarser, header.side)
    latents = (header.channels * header.vectors, 0)
    if not header.float_latents:
        latents = (0, -(-header.vectors // header.side**2) if header.ids else finest.tiles)
    found = {"model": (0, 1)}
    for section, layers in (("decoder", header.decoder), ("student", header.student)):
        streams = -(-layout.symbol_count(layers) // layout.A_STREAM)
        found[section] = (layout.float_count(layers), streams)
    return found | {"latents": latents, "mips": (0, sum(level.tiles for level in coarser))}


def _check(found: dict[str, NDArray[np.generic]], header: Header, name: str) -> None:
    if (found["channel tables"].astype(int) >= header.tables).any():
        raise BadInput(name, "table of a channel", "one that is not there", _AGAIN)
    steps, parallax = (found[field].astype(np.float64) for field in ("steps", "parallax"))
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        raise BadInput(name, "steps", "not finite, or not above 0", _AGAIN)
    if not np.isfinite(parallax).all():
        raise BadInput(name, "parallax", "not finite", _AGAIN)
    if (found["lengths of streams"].astype(int) < 2).any():
        raise BadInput(name, "lengths of streams", "less than two words", _AGAIN)


def _sections(header: Header, words: Ints, at: int, length: int, name: str) -> dict[str, Section]:
    found = {}
    first = 0
    for section, (floats, streams) in _contents(header).items():
        size = 4 * floats + 2 * int(words[first : first + streams].sum())
        found[section] = Section(at, floats, first, streams, size)
        first, at = first + streams, at + size
    ids = -(-header.id_bits * header.height * header.width // 8) if header.ids else 0
    found["ids"] = Section(at, 0, first, 0, ids)
    if at + ids != length:
        raise BadInput(name, "length", f"{length} bytes", f"{at + ids}, of all sections: {_AGAIN}")
    return found


def _model(
    header: Header, data: bytes, words: Ints, section: Section, name: str
) -> tuple[list[Table], tuple[Ints, Ints]]:
    found = np.frombuffer(data, "<u2", section.bytes // 2, section.start)
    decoder = StreamDecoder(found, words[:1], [ENTRY_TABLE])
    only = np.zeros((1, 1), np.int64)
    entries = iter(lambda: int(decoder.take(slice(None), only)[0, 0]), None)
    try:
        tables = [table_of_entries(entries) for _ in range(header.tables)]
    except ValueError as error:
        raise BadInput(name, "table", str(error), _AGAIN) from None
    both = []
    for predicted in header.predicted:
        differences = np.zeros((header.channels, PHASES, PREDICTORS), np.int64)
        if predicted:
            for place in np.ndindex(differences.shape):
                differences[place] = next(entries)
        coefficients = np.cumsum(differences, axis=0)
        if np.abs(coefficients).max() > 127:
            raise BadInput(name, "coefficients", "beyond 127", _AGAIN)
        both.append(coefficients.transpose(1, 0, 2))
    if not decoder.ended():
        raise BadInput(name, "tables", "damaged", _AGAIN)
    return tables, (both[0], both[1])
