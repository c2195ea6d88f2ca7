"""Small BTF databases written by hand, from the published layouts alone.

Nothing here comes from the readers: colours are computed from the standards' definitions, files
are packed byte by byte where no other writer is at hand.
"""

from __future__ import annotations

import io
import math
import struct
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

Codes = NDArray[np.uint8]

# --- Directions and names -----------------------------------------------------------------------


def rings(*theta_count: tuple[int, int]) -> list[tuple[int, int]]:
    """Directions in whole degrees, ring by ring, from phi = 0 on."""
    return [(theta, 360 * k // n) for theta, n in theta_count for k in range(n)]


FIFTEEN = rings((0, 1), (30, 6), (60, 8))
EIGHTY_ONE = rings((0, 1), (15, 6), (30, 12), (45, 18), (60, 20), (75, 24))


def ubo_name(light: Sequence[int], view: Sequence[int], index: int = 0, suffix: str = "jpg") -> str:
    angles = f"tl{light[0]:03} pl{light[1]:03} tv{view[0]:03} pv{view[1]:03}"
    return f"UBO2003/WOOL/tv{view[0]:03}_pv{view[1]:03}/{index:05} {angles}.{suffix}"


def utia_name(light: Sequence[int], view: Sequence[int], suffix: str = "png") -> str:
    folder = f"tv{view[0]:03}_pv{view[1]:03}"
    return f"{folder}/tl{light[0]:03}_pl{light[1]:03}_{folder}.{suffix}"


def write_zip(path: Path, files: Mapping[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def write_folder(path: Path, files: Mapping[str, bytes]) -> Path:
    for name, data in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(data)
    return path


def write_ubo2003_zip(
    path: Path,
    images: NDArray[np.uint8],
    lights: Sequence[Sequence[int]],
    views: Sequence[Sequence[int]],
) -> Path:
    """A zip as UBO2003's. ``images``: (views * lights, y, x, 3) sRGB codes, view by view;
    ``lights``, ``views``: (theta, phi) in whole degrees. Members are in no useful order."""
    pairs = [(light, view) for view in views for light in lights]
    files = {
        ubo_name(light, view, index): jpeg_bytes(image)
        for index, ((light, view), image) in enumerate(zip(pairs, images, strict=True))
    }
    names = sorted(files, key=lambda name: zlib.crc32(name.encode()))
    return write_zip(path, {name: files[name] for name in names})


# --- Colours ------------------------------------------------------------------------------------


def light_of_codes(codes: Codes) -> NDArray[np.float64]:
    """IEC 61966-2-1, one value at a time."""

    def decode(code: int) -> float:
        c = code / 255
        return c / 12.92 if c <= 0.04045 else math.pow((c + 0.055) / 1.055, 2.4)

    return np.array([decode(code) for code in codes.ravel().tolist()]).reshape(codes.shape)


def xyz_of_linear_rgb() -> NDArray[np.float64]:
    """From the chromaticities of Rec. 709's primaries and of D65 (SMPTE RP 177)."""
    xy = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)]
    columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in xy]).T
    x, y = 0.3127, 0.3290
    return np.asarray(columns * np.linalg.solve(columns, [x / y, 1, (1 - x - y) / y]))


def yuv_of_rgb(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """BT.601's luminance; U and V scaled to 0.436 and 0.615."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    y = 0.299 * red + 0.587 * green + 0.114 * blue
    return np.stack([y, 0.436 * (blue - y) / (1 - 0.114), 0.615 * (red - y) / (1 - 0.299)], -1)


# --- Pictures -----------------------------------------------------------------------------------


def jpeg_bytes(codes: Codes, **options: Any) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(codes).save(stream, "JPEG", **{"quality": 95, "subsampling": 0} | options)
    return stream.getvalue()


def png_bytes(pixels: NDArray[Any], colour_type: int = 2, *chunks: tuple[bytes, bytes]) -> bytes:
    """One IDAT, no filters."""

    def chunk(name: bytes, data: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(name + data))
        return struct.pack(">I", len(data)) + name + data + check

    height, width = pixels.shape[:2]
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.dtype.itemsize, colour_type, 0, 0, 0)
    rows = b"".join(b"\0" + row.astype(pixels.dtype.newbyteorder(">")).tobytes() for row in pixels)
    body = chunk(b"IHDR", header) + b"".join(chunk(*c) for c in chunks)
    body += chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def exr_bytes(channels: Mapping[str, NDArray[Any]], **header: Any) -> bytes:
    """Uncompressed scanlines in one part, after the OpenEXR file layout."""

    def attribute(name: str, kind: str, value: bytes) -> bytes:
        return f"{name}\0{kind}\0".encode() + struct.pack("<I", len(value)) + value

    names = sorted(channels)
    height, width = channels[names[0]].shape
    types = {np.dtype(np.uint32): 0, np.dtype(np.float16): 1, np.dtype(np.float32): 2}
    chlist = b"".join(
        name.encode() + struct.pack("<xiB3xii", types[channels[name].dtype], 0, 1, 1)
        for name in names
    )
    # A data window that does not begin at 0: sizes are differences.
    window = struct.pack("<4i", 2, 5, 2 + width - 1, 5 + height - 1)
    head = b"\x76\x2f\x31\x01\x02\0\0\0"
    head += attribute("channels", "chlist", chlist + b"\0")
    head += attribute("compression", "compression", b"\0")
    head += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    head += attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    if "chromaticities" in header:
        head += attribute(
            "chromaticities", "chromaticities", struct.pack("<8f", *header["chromaticities"])
        )
    head += b"\0"
    lines = []
    for y in range(height):
        data = b"".join(
            channels[name][y].astype(channels[name].dtype.newbyteorder("<")).tobytes()
            for name in names
        )
        lines.append(struct.pack("<iI", 5 + y, len(data)) + data)
    at, table = len(head) + 8 * height, b""
    for line in lines:
        table += struct.pack("<Q", at)
        at += len(line)
    return head + table + b"".join(lines)


def rgbe_of(light: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(y, x, 3) to mantissas and a common exponent, cut off (Ward, Graphics Gems II.5)."""
    rgbe = np.zeros((*light.shape[:2], 4), np.uint8)
    for row, column in np.ndindex(light.shape[:2]):
        colour = light[row, column]
        if colour.max() > 1e-32:
            _, exponent = math.frexp(colour.max())
            rgbe[row, column, :3] = [int(c * 256 / 2.0**exponent) for c in colour]
            rgbe[row, column, 3] = exponent + 128
    return rgbe


def light_of_rgbe(rgbe: NDArray[np.uint8]) -> NDArray[np.float64]:
    light = np.zeros((*rgbe.shape[:2], 3))
    for row, column in np.ndindex(rgbe.shape[:2]):
        *mantissas, exponent = rgbe[row, column].tolist()
        if exponent:
            light[row, column] = [m / 256 * 2.0 ** (exponent - 128) for m in mantissas]
    return light


def hdr_bytes(
    rgbe: NDArray[np.uint8],
    order: str = "-Y +X",
    runs: bool = True,
    lines: Sequence[str] = ("FORMAT=32-bit_rle_rgbe",),
    signature: str = "#?RADIANCE",
) -> bytes:
    """A Radiance picture of (y, x, 4), in one of the eight orders of its resolution line."""
    height, width = rgbe.shape[:2]
    first, second = order.split()
    stored = rgbe
    if "-X" in order:
        stored = stored[:, ::-1]
    if "+Y" in order:
        stored = stored[::-1]
    if first.endswith("X"):
        stored = stored.transpose(1, 0, 2)
    sizes = {"X": width, "Y": height}
    head = "\n".join([signature, *lines, "", f"{first} {sizes[first[1]]} {second} "])
    return f"{head}{sizes[second[1]]}\n".encode() + b"".join(
        _scanline(line) if runs else line.tobytes() for line in stored
    )


def _scanline(line: NDArray[np.uint8]) -> bytes:
    """Four channels, each in runs (128 + length, value) and literals (length, values)."""
    coded = bytes([2, 2, len(line) >> 8, len(line) & 255])
    for channel in line.T.tolist():
        at = 0
        while at < len(channel):
            run = 1
            while at + run < len(channel) and channel[at + run] == channel[at] and run < 127:
                run += 1
            if run > 2:
                coded += bytes([128 + run, channel[at]])
                at += run
            else:
                literal = channel[at : at + 5]
                coded += bytes([len(literal), *literal])
                at += len(literal)
    return coded


# --- UBO2014 ------------------------------------------------------------------------------------


def btf_bytes(
    matrices: Sequence[NDArray[np.float64]],
    views: ArrayLike,
    lights: ArrayLike,
    size: tuple[int, int],
    *,
    version: int = 4,
    cosine_flag: int = 1,
    scalar: str = "<f2",
    model: int = 11,
    rotations: int | None = 2,
    xml: bytes = b"<measurement/>",
    channel_names: Sequence[bytes] = (b"R", b"G", b"B"),
    signature: bytes | None = None,
    header_size: int | None = None,
) -> tuple[bytes, list[NDArray[np.float64]]]:
    """A ``.btf`` of three matrices, images x pixels, each factored by an SVD of full rank.

    ``views``: (V, 2), ``lights``: (V, L, 2), radians; ``size``: width, height; ``rotations``:
    how many, None for the signature without R. Also returns the matrices that the rounded
    factors multiply to.
    """
    views, lights = np.asarray(views, float), np.asarray(lights, float)
    measurement = b"".join(text.ljust(80, b"\0") for text in (b"dome", b"camera", b"flash"))
    measurement += struct.pack("<f3f", 12.5, 3, 4, 5)
    if version > 1:
        measurement += struct.pack("<I", cosine_flag)
    if version > 2:
        measurement += struct.pack("<I", len(xml)) + xml
    if version > 3:
        measurement += struct.pack("<I", len(channel_names))
        for name in channel_names:
            measurement += struct.pack("<I", len(name)) + name
    out = signature or (b"!DFMF08FC" if rotations is None else b"!DFMF08FCR")
    out += struct.pack("<II", header_size or 8 + len(measurement), version) + measurement
    out += struct.pack("<I", len(views))
    for view, its_lights in zip(views, lights, strict=True):
        out += struct.pack("<2fI", *view, len(its_lights)) + its_lights.astype("<f4").tobytes()
    out += struct.pack("<II", *size)
    if rotations is not None:
        out += struct.pack("<I", rotations) + np.tile(np.eye(3, dtype="<f4"), rotations).tobytes()
    out += struct.pack("<Ii3f", max(map(min, (m.shape for m in matrices))), model, 9, 9, 9)
    out += np.full(9, 7, "<f4").tobytes()
    rounded = []
    for matrix in matrices:
        u, s, vt = np.linalg.svd(matrix, full_matrices=False)
        left, right = u.astype(scalar), (vt.T * s).astype(scalar)
        rounded.append(left.astype(float) @ right.astype(float).T)
        out += struct.pack("<BIII", np.dtype(scalar).itemsize, len(s), len(left), len(right))
        out += s.astype(scalar).tobytes() + left.tobytes() + right.tobytes()
    return out, rounded


def log_yuv_matrices(light: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """(image, y, x, 3) linear RGB to the three matrices of colour model 11."""
    y, u, v = np.moveaxis(yuv_of_rgb(light.reshape(len(light), -1, 3)), -1, 0)
    return [np.log(y + 1e-5), u / (y + 1e-5), v / (y + 1e-5)]
