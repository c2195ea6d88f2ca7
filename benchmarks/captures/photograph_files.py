"""What the cases of photographs are written with: pictures, their light in closed form, files."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case, Ending
from storage.readers.photographs import read_photograph

HEIGHT, WIDTH = 66, 70
Right = Callable[[Any], bool]
Writer = Callable[[Path], object]


def photo_case(
    name: str,
    kind: str,
    right: Right | None,
    write: Writer,
    *says: str,
    ends: Ending | None = None,
) -> Case:
    """A photograph; told where something is to be said of it, else read without a word."""
    ending: Ending = ends or ("told" if says else "read")
    return Case(f"photo_{name}", kind, read_photograph, ending, says, right, write)


def noise(dtype: Any = np.uint8, channels: int = 3, bits: int | None = None) -> NDArray[Any]:
    """Codes of any value, (y, x, channels); floats from 0 to 4."""
    values = np.random.default_rng(7).random((HEIGHT, WIDTH, channels))
    if np.issubdtype(dtype, np.floating):
        return (4 * values).astype(dtype)
    most = (1 << bits) if bits else np.iinfo(dtype).max + 1
    return (values * most).astype(dtype)


def slope(dtype: Any = np.uint8) -> NDArray[Any]:
    """Codes that change slowly, (y, x, 3): lossy codecs keep them."""
    across, down = np.meshgrid(np.linspace(0.2, 0.8, WIDTH), np.linspace(0.25, 0.6, HEIGHT))
    values = np.dstack([across, down, 0.75 * across + 0.1])
    return np.rint(values * np.iinfo(dtype).max).astype(dtype)


def light_of(codes: NDArray[Any], most: float | None = None) -> NDArray[np.float64]:
    """The sRGB curve of IEC 61966-2-1, of codes up to ``most``; grey thrice."""
    encoded = codes.astype(np.float64) / (np.iinfo(codes.dtype).max if most is None else most)
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return thrice(light)


def thrice(light: NDArray[Any]) -> NDArray[np.float64]:
    """Grey (y, x) or (y, x, 1) as three channels."""
    whole = light[..., None] if light.ndim == 2 else light
    return np.array(np.broadcast_to(whole, (*whole.shape[:2], 3)), np.float64)


def is_light(expected: NDArray[Any], atol: float = 1e-6, opaque: Any = None) -> Right:
    """Whether the radiance is the expected one, and what is opaque."""

    def right(found: Any) -> bool:
        if (opaque is None) != (found.opaque is None) or found.radiance.shape != expected.shape:
            return False
        if opaque is None:
            return bool(np.abs(found.radiance - expected).max() <= atol)
        step = np.abs(found.radiance - expected)[opaque]
        empty = found.radiance[~opaque]
        return bool((found.opaque == opaque).all() and step.max() <= atol and not empty.any())

    return right


# ---- colour ------------------------------------------------------------------------------------

SRGB = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
DISPLAY_P3 = ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06))
ADOBE_RGB = ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06))
REC_2020 = ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046))
D65 = (0.3127, 0.3290)
D50 = (0.9642, 1.0, 0.8249)


def to_xyz(primaries: Any) -> NDArray[np.float64]:
    """Linear RGB to XYZ under D65."""
    xy = np.array([*primaries])
    columns = np.stack([xy[:, 0] / xy[:, 1], np.ones(3), (1 - xy.sum(1)) / xy[:, 1]])
    white = np.array([D65[0] / D65[1], 1, (1 - sum(D65)) / D65[1]])
    return np.array(columns * np.linalg.solve(columns, white))


def bradford() -> NDArray[np.float64]:
    """XYZ under D65 to XYZ under D50."""
    cone = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.03]])
    cone[2, 2] = 1.0296
    white = np.array([D65[0] / D65[1], 1, (1 - sum(D65)) / D65[1]])
    scale = np.diag(cone @ np.array(D50) / (cone @ white))
    return np.array(np.linalg.inv(cone) @ scale @ cone)


def in_srgb(light: NDArray[Any], primaries: Any) -> NDArray[np.float64]:
    """Linear RGB of other primaries (white D65) in those of sRGB, clipped below."""
    matrix = np.linalg.inv(to_xyz(SRGB)) @ to_xyz(primaries)
    return np.maximum(light @ matrix.T, 0)


def rgb_of_lab(lab: NDArray[Any]) -> NDArray[np.float64]:
    """Linear sRGB in [0, 1] of L*, a*, b* under D50 (CIE 15)."""
    fy = (lab[..., 0] + 16) / 116
    f = np.stack([fy + lab[..., 1] / 500, fy, fy - lab[..., 2] / 200], axis=-1)
    xyz = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * np.array(D50)
    return np.clip(xyz @ np.linalg.inv(bradford() @ to_xyz(SRGB)).T, 0, 1)


def _fixed(*values: float) -> bytes:
    return b"".join(struct.pack(">i", round(value * 65536)) for value in values)


def icc(space: bytes, tags: dict[bytes, bytes], pcs: bytes = b"XYZ ") -> bytes:
    """A profile of version 2 by hand (ICC.1:2001-04)."""
    name = b"made by hand"
    desc = b"desc" + bytes(4) + struct.pack(">I", len(name) + 1) + name + bytes(1 + 8 + 3 + 67)
    tags = {b"desc": desc, b"wtpt": b"XYZ " + bytes(4) + _fixed(*D50)} | tags
    table, body = struct.pack(">I", len(tags)), b""
    for tag, data in tags.items():
        table += tag + struct.pack(">II", 132 + 12 * len(tags) + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    kind = b"prtr" if space == b"CMYK" else b"mntr"
    header = struct.pack(">I4xI4s4s4s", 128 + len(table + body), 0x02400000, kind, space, pcs)
    header += bytes(12) + b"acsp" + bytes(28) + _fixed(*D50)
    return header.ljust(128, b"\0") + table + body


def _gamma(value: float) -> bytes:
    return b"curv" + bytes(4) + struct.pack(">IH", 1, round(value * 256))


def rgb_profile(primaries: Any, gamma: float) -> bytes:
    """A matrix profile."""
    columns = (bradford() @ to_xyz(primaries)).T
    names = zip((b"rXYZ", b"gXYZ", b"bXYZ"), columns, strict=True)
    colours = {name: b"XYZ " + bytes(4) + _fixed(*column) for name, column in names}
    return icc(b"RGB ", colours | dict.fromkeys((b"rTRC", b"gTRC", b"bTRC"), _gamma(gamma)))


def grey_profile(gamma: float) -> bytes:
    """One curve."""
    return icc(b"GRAY", {b"kTRC": _gamma(gamma)})


def lab_of_inks(inks: NDArray[Any]) -> NDArray[np.float64]:
    """What ``ink_profile`` has at its 16 corners: inks (..., 4) of 0 or 1 to L*, a*, b*."""
    c, m, y, k = np.moveaxis(inks, -1, 0)
    light = 90 * (1 - 0.8 * k) * (1 - 0.25 * (c + m + y) / 1.5)
    return np.stack([light, (10 * m - 8 * c) * (1 - k), (12 * y - 9 * c) * (1 - k)], axis=-1)


def ink_profile() -> bytes:
    """A profile for CMYK by a table."""
    return _table_profile(b"CMYK", 4, lab_of_inks)


def scanner_profile() -> bytes:
    """A profile for RGB by a table: of red, green and blue as of the other inks."""
    return _table_profile(b"RGB ", 3, lab_of_scanner)


def lab_of_scanner(light: NDArray[Any]) -> NDArray[np.float64]:
    """What ``scanner_profile`` has at its 8 corners, of R, G and B of 0 or 1."""
    inks = np.concatenate([1 - light, np.zeros((*light.shape[:-1], 1))], axis=-1)
    return lab_of_inks(inks)


def _table_profile(space: bytes, channels: int, lab_of: Any) -> bytes:
    """A table of two steps a channel (`mft2`), of which the corners are exact."""
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * channels, indexing="ij"), axis=-1)
    lab = lab_of(corners.reshape(-1, channels))
    codes = np.rint(np.column_stack([lab[:, 0] * 652.8, (lab[:, 1:] + 128) * 256]))
    straight = struct.pack(">HH", 0, 65535)
    data = b"mft2" + bytes(4) + bytes([channels, 3, 2, 0]) + _fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
    data += struct.pack(">HH", 2, 2) + straight * channels
    data += codes.astype(">u2").tobytes() + straight * 3
    return icc(space, {b"A2B0": data}, b"Lab ")


# ---- files -------------------------------------------------------------------------------------


def png_chunk(name: bytes, data: bytes) -> bytes:
    """One chunk with its checksum."""
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(
    codes: NDArray[Any], kind: int, *chunks: tuple[bytes, bytes], bits: int | None = None
) -> bytes:
    """A PNG by hand, without filters; ``kind`` is its colour type; chunks before the pixels."""
    height, width = codes.shape[:2]
    depth = bits or 8 * codes.dtype.itemsize
    if depth < 8:
        planes = np.unpackbits(codes[..., 0][..., None], axis=2)[..., 8 - depth :]
        rows = [np.packbits(row.ravel()).tobytes() for row in planes]
    else:
        rows = [row.astype(codes.dtype.newbyteorder(">")).tobytes() for row in codes]
    header = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)
    parts = [png_chunk(b"IHDR", header), *(png_chunk(*each) for each in chunks)]
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows), 1)
    parts += [png_chunk(b"IDAT", pixels), png_chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def save_png(codes: NDArray[Any], kind: int, *chunks: tuple[bytes, bytes], **more: Any) -> Writer:
    """Write one."""
    return lambda path: path.write_bytes(png(codes, kind, *chunks, **more))


def iccp(profile: bytes) -> tuple[bytes, bytes]:
    """A profile's chunk in a PNG."""
    return b"iCCP", b"any\0\0" + zlib.compress(profile)


def save_tiff(values: NDArray[Any], **options: Any) -> Writer:
    """By tifffile."""

    def write(path: Path) -> None:
        import tifffile

        tifffile.imwrite(path, values, **{"photometric": "rgb"} | options)

    return write


def tiff(values: NDArray[Any], tags: dict[int, tuple[int, list[int]]]) -> bytes:
    """A TIFF by hand, one strip, little endian; ``tags``: type and values by number."""
    data = values.astype(values.dtype.newbyteorder("<")).tobytes()
    height, width = values.shape[:2]
    whole: dict[int, tuple[int, list[int]]] = {
        256: (4, [width]),
        257: (4, [height]),
        259: (3, [1]),
        273: (4, [8]),
        277: (3, [values.shape[2]]),
        278: (4, [height]),
        279: (4, [len(data)]),
    }
    whole |= tags
    at = 8 + len(data) + len(data) % 2
    more_at = at + 2 + 12 * len(whole) + 4
    entries, more = b"", b""
    for number in sorted(whole):
        kind, content = whole[number]
        packed = struct.pack(f"<{len(content)}{'_BBHI'[kind]}", *content)
        entries += struct.pack("<HHI", number, kind, len(content))
        if len(packed) <= 4:
            entries += packed.ljust(4, b"\0")
        else:
            entries += struct.pack("<I", more_at + len(more))
            more += packed + bytes(len(packed) % 2)
    head = b"II*\0" + struct.pack("<I", at) + data + bytes(len(data) % 2)
    return head + struct.pack("<H", len(whole)) + entries + bytes(4) + more


def save_pillow(codes: NDArray[Any], mode: str | None = None, **options: Any) -> Writer:
    """By Pillow."""

    def write(path: Path) -> None:
        from PIL import Image

        flat = codes[..., 0] if codes.shape[2] == 1 else codes
        Image.fromarray(flat, mode).save(path, **options)

    return write


def exif(orientation: int) -> bytes:
    """A block of EXIF with nothing but the orientation."""
    return b"MM\0*\0\0\0\x08" + struct.pack(">HHHIHHI", 1, 274, 3, 1, orientation, 0, 0)


def stored_as(upright: NDArray[Any], orientation: int) -> NDArray[Any]:
    """How an upright picture is stored, by the words of EXIF 2.32 on where row and column 0 are."""
    across = np.swapaxes(upright, 0, 1)
    stored: dict[int, NDArray[Any]] = {
        1: upright,  # row: top, column: left
        2: np.fliplr(upright),  # top, right
        3: np.flipud(np.fliplr(upright)),  # bottom, right
        4: np.flipud(upright),  # bottom, left
        5: across,  # left, top
        6: np.flipud(across),  # right, top
        7: np.flipud(np.fliplr(across)),  # right, bottom
        8: np.fliplr(across),  # left, bottom
    }
    return np.ascontiguousarray(stored[orientation])
