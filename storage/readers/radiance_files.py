"""Radiance pictures (``.hdr``): light probes, and the photographs of ATRIUM's HDR part.

Written after Ward's "Radiance File Formats" and the resolution lines of Radiance's ``resolu.h``:
true x grows to the right, true y upwards; the resolution line names the slow axis first, each
axis with the sign of its growth in the file. ``-Y 256 +X 256`` is the order of text; ATRIUM's
``+X 256 -Y 256`` is column after column, each from the top. OpenCV knows the first line only, so
it gets the pixels under a plain header, and the array is turned here.

OpenCV takes a pixel's mantissas as they are (Radiance itself adds half a step, less than 0.4 %).
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput

SIGNATURE = b"#?"

_RESOLUTION = re.compile(rb"([+-])([XY]) (\d{1,6}) ([+-])([XY]) (\d{1,6})\s*")
_RGBE = b"32-bit_rle_rgbe"
_SRGB_PRIMARIES = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


class RadianceHeader(NamedTuple):
    """Upright size, what to divide by, and how the pixels are stored.

    ``exposure``: per channel. ``columns``: scanlines are columns. ``mirrored``, ``upside_down``:
    x falls, y grows in the file. ``pixels_at``: where in the file they begin.
    """

    width: int
    height: int
    exposure: tuple[float, float, float]
    columns: bool
    mirrored: bool
    upside_down: bool
    pixels_at: int


def radiance_header(file: Path, data: bytes) -> RadianceHeader:
    """Read a header from a file's first bytes.

    Raises IndexError where it does not end in them, BadInput where the pixels are not RGB or the
    size is not understood.
    """
    exposure = np.ones(3)
    at = 0
    while True:
        line, at = _line(data, at)
        if not line.strip():
            break
        key, _, value = line.partition(b"=")
        if key == b"FORMAT" and value.strip() != _RGBE:
            raise BadInput(file, "FORMAT", _text(value), _RGBE.decode())
        if key == b"EXPOSURE":
            exposure *= _positive_numbers(file, key, value, 1)
        if key == b"COLORCORR":
            exposure *= _positive_numbers(file, key, value, 3)
        if key == b"PRIMARIES":
            _check_primaries(file, value)
    line, at = _line(data, at)
    match = _RESOLUTION.fullmatch(line)
    if match is None or match[2] == match[5]:
        raise BadInput(file, "resolution line", repr(_text(line)), "one like -Y 256 +X 256")
    signs = {match[2]: match[1], match[5]: match[4]}
    sizes = {match[2]: int(match[3]), match[5]: int(match[6])}
    return RadianceHeader(
        width=sizes[b"X"],
        height=sizes[b"Y"],
        exposure=(float(exposure[0]), float(exposure[1]), float(exposure[2])),
        columns=match[2] == b"X",
        mirrored=signs[b"X"] == b"-",
        upside_down=signs[b"Y"] == b"+",
        pixels_at=at,
    )


def radiance_pixels(file: Path, data: bytes) -> NDArray[np.float32]:
    """Decode a whole picture: (y, x, 3) float32 linear RGB, the top row first.

    Exposures are divided out. Raises BadInput for truncated or damaged content.
    """
    try:
        header = radiance_header(file, data)
    except IndexError:
        raise _damaged(file) from None
    lines, length = header.height, header.width
    if header.columns:
        lines, length = length, lines
    stored = data[header.pixels_at :]
    if _run_lengths(stored, length):
        light = _decoded_by_opencv(file, stored, lines, length)
    else:
        light = _decoded_flat(file, stored, lines, length)
    if header.columns:
        light = light.swapaxes(0, 1)
    if header.mirrored:
        light = light[:, ::-1]
    if header.upside_down:
        light = light[::-1]
    if header.exposure != (1.0, 1.0, 1.0):
        with np.errstate(over="ignore"):
            light = (light / np.array(header.exposure)).astype(np.float32)
    return light


def _line(data: bytes, at: int) -> tuple[bytes, int]:
    end = data.find(b"\n", at)
    if end < 0:
        raise IndexError("the header does not end here")
    return data[at:end], end + 1


def _text(value: bytes) -> str:
    return value.decode("ascii", "replace").strip()


def _positive_numbers(file: Path, key: bytes, value: bytes, count: int) -> NDArray[np.float64]:
    try:
        numbers = np.array([float(word) for word in value.split()])
    except ValueError:
        numbers = np.array([])
    if len(numbers) != count or not (np.isfinite(numbers) & (numbers > 0)).all():
        expected = "a positive number" if count == 1 else f"{count} positive numbers"
        raise BadInput(file, key.decode(), repr(_text(value)), expected)
    return numbers


def _check_primaries(file: Path, value: bytes) -> None:
    """A header without the line is taken as sRGB: that is what photographs' HDR software means."""
    try:
        primaries = [float(word) for word in value.split()]
    except ValueError:
        primaries = []
    if len(primaries) != 8 or not np.allclose(primaries, _SRGB_PRIMARIES, atol=2e-3):
        raise BadInput(file, "PRIMARIES", repr(_text(value)), "those of sRGB")


def _run_lengths(stored: bytes, length: int) -> bool:
    """Whether scanlines are run-length encoded by channel: each begins 2, 2, its length."""
    return 8 <= length < 32768 and stored[:4] == bytes([2, 2, length >> 8, length & 255])


def _decoded_by_opencv(file: Path, stored: bytes, lines: int, length: int) -> NDArray[np.float32]:
    import cv2

    plain = b"#?RADIANCE\nFORMAT=%s\n\n-Y %d +X %d\n" % (_RGBE, lines, length)
    try:
        light = cv2.imdecode(np.frombuffer(plain + stored, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        light = None
    if light is None or light.shape != (lines, length, 3) or light.dtype != np.float32:
        raise _damaged(file)
    return np.asarray(light, dtype=np.float32)[..., ::-1]  # OpenCV's channels are BGR


def _decoded_flat(file: Path, stored: bytes, lines: int, length: int) -> NDArray[np.float32]:
    if len(stored) != 4 * lines * length:
        # Radiance's first run-length code (before 1991) ends up here as well.
        raise BadInput(
            file,
            "content",
            f"{len(stored)} bytes of pixels",
            f"{4 * lines * length} bytes, or scanlines run-length encoded by channel",
        )
    rgbe = np.frombuffer(stored, np.uint8).reshape(lines, length, 4)
    exponents = rgbe[..., 3:].astype(np.int32)
    scale = np.ldexp(1.0, exponents - 136) * (exponents > 0)  # exponent 0 is black
    light: NDArray[np.float32] = (rgbe[..., :3] * scale).astype(np.float32)
    return light


def _damaged(file: Path) -> BadInput:
    return BadInput(file, "content", "truncated or damaged", "a complete Radiance picture")
