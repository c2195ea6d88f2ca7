"""Radiance pictures (``.hdr``): light probes, and the photographs of ATRIUM's HDR part.

Written after Ward's "Radiance File Formats" and the resolution lines of Radiance's ``resolu.h``:
true x grows to the right, true y upwards; the resolution line names the slow axis first, each
axis with the sign of its growth in the file. ``-Y 256 +X 256`` is the order of text; ATRIUM's
``+X 256 -Y 256`` is column after column, each from the top.

A pixel's mantissas are taken as they are (Radiance itself adds half a step, less than 0.4 %).
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import number
from storage.readers.pictures.colour_spaces import (
    CIE_XYZ,
    LINEAR_SRGB,
    ColourSpace,
    named_space,
    space_of,
)
from storage.readers.pictures.radiance_runs import decoded_lines

SIGNATURE = b"#?"

_RESOLUTION = re.compile(rb"\s*([+-])([XY])\s+(\d{1,6})\s+([+-])([XY])\s+(\d{1,6})\s*")
_MOST_LINES = 10_000
_FORMATS = {b"32-bit_rle_rgbe": LINEAR_SRGB, b"32-bit_rle_xyze": CIE_XYZ}
_DIVISORS = {b"EXPOSURE": 1, b"COLORCORR": 3}


class RadianceHeader(NamedTuple):
    """Upright size, what the values mean, and how the pixels are stored.

    ``exposure``: per channel, to divide by. ``gamma``: the power that makes values linear.
    ``space``: of the colours. ``columns``: scanlines are columns. ``mirrored``, ``upside_down``:
    x falls, y grows in the file. ``pixels_at``: where in the file they begin. ``notes``: sentences
    on what is converted or left out.
    """

    width: int
    height: int
    exposure: tuple[float, float, float]
    gamma: float
    space: ColourSpace
    columns: bool
    mirrored: bool
    upside_down: bool
    pixels_at: int
    notes: tuple[str, ...]


def radiance_header(file: Path, data: bytes) -> RadianceHeader:
    """Read a header from a file's first bytes.

    Raises IndexError where it does not end in them, BadInput where the pixels are none of RGB or
    XYZ, the primaries span no space or the size is not understood.
    """
    fields, line, at = _fields(data)
    match = _RESOLUTION.fullmatch(line)
    if match is None or match[2] == match[5]:
        raise BadInput(file, "resolution line", repr(_text(line)), "one like -Y 256 +X 256")
    exposure, notes = np.ones(3), []
    gamma, space, primaries = 1.0, LINEAR_SRGB, LINEAR_SRGB
    for key, value in fields:
        if key in _DIVISORS:
            divisor = _positive_numbers(value, _DIVISORS[key])
            if divisor is None:
                notes.append(f"{key.decode()}={_text(value)!r} is nothing to divide by: left out.")
            else:
                exposure *= divisor
        elif key == b"GAMMA":
            given = _positive_numbers(value, 1)
            gamma = 1.0 if given is None else float(given[0])
        elif key == b"PRIMARIES":
            primaries = _primaries(file, value)
        elif key == b"FORMAT":
            if value not in _FORMATS:
                expected = " or ".join(name.decode() for name in _FORMATS)
                raise BadInput(file, "FORMAT", _text(value), f"{expected}: save it as one of them")
            space = _FORMATS[value]
    if space is LINEAR_SRGB:
        space = primaries
    if gamma != 1:
        notes.append(f"The values were raised to the power of {gamma:g}, the header's gamma.")
    signs = {match[2]: match[1], match[5]: match[4]}
    sizes = {match[2]: int(match[3]), match[5]: int(match[6])}
    return RadianceHeader(
        width=sizes[b"X"],
        height=sizes[b"Y"],
        exposure=(float(exposure[0]), float(exposure[1]), float(exposure[2])),
        gamma=gamma,
        space=space,
        columns=match[2] == b"X",
        mirrored=signs[b"X"] == b"-",
        upside_down=signs[b"Y"] == b"+",
        pixels_at=at,
        notes=(*notes, *space.notes),
    )


def radiance_pixels(file: Path, data: bytes) -> NDArray[np.float32]:
    """Decode a whole picture: (y, x, 3) float32 linear sRGB, the top row first.

    Exposures are divided out, other colours converted, as the header's ``notes`` say; colours
    outside sRGB are negative. Raises BadInput for truncated or damaged content.
    """
    try:
        header = radiance_header(file, data)
    except IndexError:
        raise _damaged(file) from None
    lines, length = header.height, header.width
    if header.columns:
        lines, length = length, lines
    light = _light(_rgbe(file, data, header.pixels_at, lines, length))
    if header.columns:
        light = light.swapaxes(0, 1)
    if header.mirrored:
        light = light[:, ::-1]
    if header.upside_down:
        light = light[::-1]
    with np.errstate(over="ignore"):
        if header.exposure != (1.0, 1.0, 1.0):
            light = (light / np.array(header.exposure)).astype(np.float32)
        if header.gamma != 1:
            light = light ** np.float32(header.gamma)
    converted: NDArray[np.float32] = header.space.converted(light)
    return converted


def _fields(data: bytes) -> tuple[list[tuple[bytes, bytes]], bytes, int]:
    """Keys and values, the resolution line, and where the pixels begin.

    The empty line between may be missing, or be several.
    """
    fields: list[tuple[bytes, bytes]] = []
    at = 0
    ended = False
    for _ in range(_MOST_LINES):
        line, at = _line(data, at)
        if (ended and line.strip()) or _RESOLUTION.fullmatch(line):
            return fields, line, at
        ended = ended or not line.strip()
        key, _, value = line.partition(b"=")
        fields.append((key.strip(), value.strip()))
    raise IndexError("the header does not end")


def _line(data: bytes, at: int) -> tuple[bytes, int]:
    end = data.find(b"\n", at)
    if end < 0:
        raise IndexError("the header does not end here")
    return data[at:end], end + 1


def _text(value: bytes) -> str:
    return value.decode("ascii", "replace").strip()[:60]


def _positive_numbers(value: bytes, count: int) -> NDArray[np.float64] | None:
    numbers = _numbers(value)
    if len(numbers) != count or not (np.isfinite(numbers) & (numbers > 0)).all():
        return None
    return numbers


def _numbers(value: bytes) -> NDArray[np.float64]:
    try:
        return np.array([number(word) for word in value.split()])
    except ValueError:
        return np.array([])


def _primaries(file: Path, value: bytes) -> ColourSpace:
    """A header without the line is taken as sRGB: that is what photographs' HDR software means."""
    space = named_space(_text(value))
    try:
        return space or space_of(_numbers(value).tolist())
    except ValueError:
        expected = "red, green, blue and white, x and y of each (without the line it is sRGB)"
        raise BadInput(file, "PRIMARIES", repr(_text(value)), expected) from None


def _rgbe(file: Path, data: bytes, at: int, lines: int, length: int) -> NDArray[np.uint8]:
    by_channel = bytes([2, 2, length >> 8 & 255, length & 255])
    if len(data) - at == 4 * lines * length and not data.startswith(by_channel, at):
        # Flat, whatever pixels look like runs.
        return np.frombuffer(data, np.uint8, offset=at).reshape(lines, length, 4)
    pixels = decoded_lines(data, at, lines, length)
    if pixels is None:
        raise _damaged(file)
    return pixels


def _light(rgbe: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Mantissas are 256ths of two to the exponent's excess over 128; exponent 0 is black."""
    exponents = np.arange(256)
    scale = np.where(exponents > 0, np.ldexp(1.0, exponents - 136), 0).astype(np.float32)
    return rgbe[..., :3] * scale[rgbe[..., 3:]]


def _damaged(file: Path) -> BadInput:
    return BadInput(file, "content", "truncated or damaged", "a complete Radiance picture")
