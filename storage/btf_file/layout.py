"""The header of a `.tbtf` file and what follows from it: which sections there are, and where."""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass

HEADER = struct.Struct("<4s4B2I2HI3f4B")
"""Magic, version, flags, channels, coarser levels, length, CRC-32, height, width, vectors, alpha,
least, largest, side of a tile, layers, layers of the student, tables."""
LAYER = struct.Struct("<H2B")
"""Outputs, the table of the weights, that of the biases."""
MAGIC = b"TBTF"
VERSION = 1
CRC_AT = 12
FLOAT = 255
"""Instead of a table's number: float32 values."""
FLAGS = {"float_latents": 1, "ids": 2, "parallax": 4}
DIRECTIONS = 4
"""Inputs of a decoder behind the latents."""
COLOURS = 3
PARALLAX = 18
"""Numbers of the parallax, (9, 2)."""
A_STREAM = 2048
"""Symbols of a decoder's streams."""

MOST_LATENTS = 1 << 23
"""Of the finest level: 1024 x 1024 texels of 8."""
MOST_CHANNELS = 32
MOST_LAYERS = 16
MOST_WIDTH = 4096
MOST_WEIGHTS = 1 << 23
MOST_SIDE = 32
MOST_TABLES = 254


@dataclass(frozen=True)
class Layer:
    """A layer of a decoder."""

    inputs: int
    outputs: int
    weight_table: int
    bias_table: int

    def tensors(self, number: int) -> list[tuple[str, tuple[int, ...], int]]:
        """Name, shape and table (or 255) of weights and biases of the layer with this number."""
        return [
            (f"weight_{number}", (self.outputs, self.inputs), self.weight_table),
            (f"bias_{number}", (self.outputs,), self.bias_table),
        ]


@dataclass(frozen=True)
class Header:
    """What stands in the first bytes, without length and checksum."""

    channels: int
    coarser: int
    height: int
    width: int
    vectors: int
    alpha: float
    least: float
    largest: float
    side: int
    decoder: tuple[Layer, ...]
    student: tuple[Layer, ...]
    tables: int
    float_latents: bool
    ids: bool
    parallax: bool

    @property
    def id_bits(self) -> int:
        """Of each cluster number: whole int32 beside float latents, else as few as will do."""
        return 32 if self.float_latents else (self.vectors - 1).bit_length()

    @property
    def predicted(self) -> tuple[bool, bool]:
        """Whether the finest level, and the coarser ones, are images of symbols."""
        return not (self.float_latents or self.ids), self.coarser > 0

    def packed(self) -> bytes:
        """Header and layers, length and checksum still 0."""
        flags = sum(bit for name, bit in FLAGS.items() if getattr(self, name))
        layers = self.decoder + self.student
        return HEADER.pack(
            MAGIC, VERSION, flags, self.channels, self.coarser, 0, 0,
            self.height, self.width, self.vectors, self.alpha, self.least, self.largest,
            self.side, len(self.decoder), len(self.student), self.tables,
        ) + b"".join(
            LAYER.pack(layer.outputs, layer.weight_table, layer.bias_table) for layer in layers
        )  # fmt: skip


def tensors(layers: tuple[Layer, ...]) -> list[tuple[str, tuple[int, ...], int]]:
    """Name, shape and table (or 255) of a decoder's tensors, in the file's order."""
    return [tensor for number, layer in enumerate(layers, 1) for tensor in layer.tensors(number)]


def symbol_count(layers: tuple[Layer, ...]) -> int:
    """Symbols of a decoder."""
    return sum(math.prod(shape) for _, shape, table in tensors(layers) if table != FLOAT)


def float_count(layers: tuple[Layer, ...]) -> int:
    """Float32 values of a decoder."""
    return sum(math.prod(shape) for _, shape, table in tensors(layers) if table == FLOAT)


def sealed(data: bytes) -> bytes:
    """A whole file with its length and checksum put in."""
    out = bytearray(data)
    struct.pack_into("<I", out, CRC_AT - 4, len(out))
    struct.pack_into("<I", out, CRC_AT, checksum(out))
    return bytes(out)


def checksum(data: bytes | bytearray) -> int:
    """CRC-32 (zlib's) of all bytes but the checksum's own four."""
    return zlib.crc32(memoryview(data)[CRC_AT + 4 :], zlib.crc32(memoryview(data)[:CRC_AT]))
