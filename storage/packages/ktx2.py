"""Array textures as KTX 2 (Khronos' specification, version 2.0), not compressed."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from numpy.typing import NDArray

_IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
_HEADER_BYTES = 80
_LEVEL_BYTES = 24
# Of the Khronos Data Format specification: model RGBSDA, BT.709 primaries, linear.
_RGBSDA, _BT709, _LINEAR = 1, 1, 1
_SIGNED, _FLOAT = 0x40, 0x80
_CHANNEL_IDS = (0, 1, 2, 15)
_ONE_AS_FLOAT, _MINUS_ONE_AS_FLOAT = 0x3F800000, 0xBF800000


class _Format(NamedTuple):
    """Vulkan's number of a format with 1 to 4 channels, and its kind of number."""

    formats: tuple[int, int, int, int]
    is_float: bool


_FORMATS = {
    "uint8": _Format((9, 16, 23, 37), False),  # R8_UNORM … R8G8B8A8_UNORM
    "uint16": _Format((70, 77, 84, 91), False),  # R16_UNORM … R16G16B16A16_UNORM
    "float16": _Format((76, 83, 90, 97), True),  # R16_SFLOAT …
    "float32": _Format((100, 103, 106, 109), True),  # R32_SFLOAT …
}


def ktx2_bytes(layers: NDArray[Any]) -> bytes:
    """Layers (layer, y, x, channel) as the bytes of a .ktx2, one level, no supercompression.

    uint8 and uint16 are stored as normalised integers, float16 and float32 as they are. Raises
    ValueError for another dtype or more than four channels.
    """
    import numpy as np

    count, height, width, channels = layers.shape
    name = str(layers.dtype)
    if name not in _FORMATS or not 1 <= channels <= 4:
        raise ValueError(
            f"texture layers are {name} with {channels} channels; "
            f"expected 1 to 4 channels of {', '.join(_FORMATS)}."
        )
    found = _FORMATS[name]
    size = layers.dtype.itemsize
    content = np.ascontiguousarray(layers, layers.dtype.newbyteorder("<")).tobytes()
    descriptor = _descriptor(channels, size, found.is_float)
    key_values = _key_value("KTXorientation", b"rd\0") + _key_value("KTXwriter", b"Tsuya\0")
    described_at = _HEADER_BYTES + _LEVEL_BYTES
    keys_at = described_at + len(descriptor)
    alignment = math.lcm(channels * size, 4)
    start = -(-(keys_at + len(key_values)) // alignment) * alignment
    header = _IDENTIFIER + struct.pack(
        "<9I", found.formats[channels - 1], size, width, height, 0, count, 1, 1, 0
    )
    index = struct.pack(
        "<4I2Q", described_at, len(descriptor), keys_at, len(key_values), 0, 0
    ) + struct.pack("<3Q", start, len(content), len(content))
    before = header + index + descriptor + key_values
    return before + b"\0" * (start - len(before)) + content


def _descriptor(channels: int, size: int, is_float: bool) -> bytes:
    """The basic data format descriptor: a sample a channel."""
    samples = b""
    for channel in range(channels):
        kind = _CHANNEL_IDS[channel] | (_SIGNED | _FLOAT if is_float else 0)
        lower, upper = (
            (_MINUS_ONE_AS_FLOAT, _ONE_AS_FLOAT) if is_float else (0, (1 << 8 * size) - 1)
        )
        samples += struct.pack("<HBBIII", 8 * size * channel, 8 * size - 1, kind, 0, lower, upper)
    block = 24 + len(samples)
    return (
        struct.pack("<I", 4 + block)
        + struct.pack("<IHH", 0, 2, block)
        + struct.pack("<4B", _RGBSDA, _BT709, _LINEAR, 0)
        + struct.pack("<4B8B", 0, 0, 0, 0, channels * size, *(0,) * 7)
        + samples
    )


def _key_value(key: str, value: bytes) -> bytes:
    pair = key.encode() + b"\0" + value
    return struct.pack("<I", len(pair)) + pair + b"\0" * (-len(pair) % 4)
