"""The first bytes of a photograph's file: format, size, depth and channels, no pixel decoded.

Read by hand, after PNG (third edition) 5.6 and 11.2.2, JPEG (ITU-T T.81) B.2 and the OpenEXR file
layout: 6561 headers take a second so.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from storage.readers.bad_input import BadInput
from storage.readers.btf_archives import Members
from storage.readers.btf_measured import check_area
from storage.readers.opening import check_memory
from storage.readers.pictures.picture_sizes import MEMORY_PER_BYTE
from storage.readers.pictures.radiance_files import SIGNATURE, radiance_header

_PNG_CHANNELS = {0: "grey", 2: "RGB", 3: "palette", 4: "grey with alpha", 6: "RGB with alpha"}
_JPEG_CHANNELS = {1: "grey", 3: "RGB", 4: "CMYK"}
_JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # SOF0 ... SOF15
_EXR_TYPES = {0: "unsigned", 1: "half", 2: "float"}
_EXR_NOT_FLAT = 0x800  # deep data
_LONGEST_HEADER = 8_000_000  # bytes
_MOST_BLOCKS = 10_000
_PIXEL_BYTES = 40  # of one photograph while it is decoded


class Header(NamedTuple):
    """``format``: PNG, JPEG, EXR or HDR. ``pixels``: depth and channels in words, as in "8-bit RGB"
    or "half". ``planes``: an EXR's channels in the order of its colours; ``chromaticities``: an
    EXR's, where it says them. ``notes``: sentences on what is converted or left out.
    """

    format: str
    width: int
    height: int
    pixels: str
    planes: tuple[str, ...] = ()
    chromaticities: tuple[float, ...] | None = None
    has_alpha: bool = False
    has_profile: bool = False
    notes: tuple[str, ...] = ()


def common_header(members: Members, names: Sequence[str]) -> tuple[Header, tuple[str, ...]]:
    """Read every photograph's header and return the one that all share, and what is to be said.

    JPEG and PNG may be of any depth and channels each: ``pixels`` are then those of the most of
    them, ``has_alpha`` and ``has_profile`` of any. Raises BadInput naming the first file that
    differs from the others (from the most of them), or that cannot be read.
    """
    headers = [_header(members, name) for name in names]
    common = Counter(headers).most_common(1)[0][0]
    for name, header in zip(names, headers, strict=True):
        _check_alike(members.path / name, header, common)
    file, pixels = members.path / names[0], common.width * common.height
    check_area(file, common.width, common.height)
    found = f"{common.width} x {common.height} pixels"
    smallest = min(members.size(name) for name in names)
    check_memory(file, "size", found, _PIXEL_BYTES * pixels, smallest, MEMORY_PER_BYTE)
    notes = list(dict.fromkeys(note for header in headers for note in header.notes))
    with_alpha = sum(header.has_alpha for header in headers)
    if with_alpha:
        notes.append(f"{with_alpha} photographs have an opaque alpha channel, which was left out.")
    shared = common._replace(
        has_alpha=with_alpha > 0, has_profile=any(header.has_profile for header in headers)
    )
    return shared, tuple(notes)


def _check_alike(file: Path, header: Header, common: Header) -> None:
    if header.format != common.format:
        expected = f"{common.format} as in the other files: convert it, or move it elsewhere"
        raise BadInput(file, "format", header.format, expected)
    if (header.planes, header.chromaticities) != (common.planes, common.chromaticities):
        names = ", ".join(common.planes)
        expected = f"{names} of the same chromaticities as in the other files: save all alike"
        raise BadInput(file, "colour", ", ".join(header.planes), expected)
    if (header.width, header.height) != (common.width, common.height):
        raise BadInput(
            file,
            "size",
            f"{header.width} x {header.height} pixels",
            f"{common.width} x {common.height} pixels as in the other files: cut all alike",
        )


def header_of(file: Path, data: bytes) -> Header:
    """The header in a file's first bytes.

    Raises IndexError or struct.error where they do not reach, BadInput for other formats.
    """
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return _png(data)
    if data.startswith(b"\xff\xd8\xff"):
        return _jpeg(file, data)
    if data.startswith(b"\x76\x2f\x31\x01"):
        return _exr(file, data)
    if data.startswith(SIGNATURE):
        found = radiance_header(file, data)
        return Header("HDR", found.width, found.height, "Radiance RGBE", notes=found.notes)
    raise BadInput(
        file,
        "format",
        "unknown" if data else "unknown (the file is empty)",
        "a JPEG, PNG, EXR or Radiance photograph: convert all of them",
    )


def _header(members: Members, name: str) -> Header:
    size = members.size(name)
    for count in (4096, 1_000_000, _LONGEST_HEADER):  # with a thumbnail or a profile it is longer
        try:
            return header_of(members.path / name, members.start(name, count))
        except (IndexError, struct.error):
            if count >= size:
                break
    raise BadInput(members.path / name, "content", "truncated or damaged", "a complete photograph")


def _png(data: bytes) -> Header:
    length, kind, width, height, depth, colour = struct.unpack_from(">I4sIIBB", data, 8)
    if kind != b"IHDR":
        raise IndexError("a PNG begins with its header chunk")
    pixels = f"{depth}-bit {_PNG_CHANNELS.get(colour, 'unknown')}"
    kinds = set()
    at = 8
    blocks = 0
    while kind != b"IDAT":
        blocks = _counted(blocks)
        at += 12 + length
        length, kind = struct.unpack_from(">I4s", data, at)
        kinds.add(kind)
    has_alpha = "alpha" in pixels or b"tRNS" in kinds
    return Header("PNG", width, height, pixels, has_alpha=has_alpha, has_profile=b"iCCP" in kinds)


def _jpeg(file: Path, data: bytes) -> Header:
    at = 2
    has_profile = False
    blocks = 0
    while True:
        blocks = _counted(blocks)
        if data[at] != 0xFF:
            raise IndexError("a marker is missing")
        marker = data[at + 1]
        if marker == 0xFF:  # padding
            at += 1
            continue
        (length,) = struct.unpack_from(">H", data, at + 2)
        if marker in _JPEG_FRAMES:
            depth, height, width, channels = struct.unpack_from(">BHHB", data, at + 4)
            pixels = f"{depth}-bit {_JPEG_CHANNELS.get(channels, f'{channels} channels')}"
            if depth != 8 or channels not in (1, 3):
                expected = "8-bit grey or RGB: save it as RGB"
                raise BadInput(file, "pixel format", pixels, expected)
            return Header("JPEG", width, height, pixels, has_profile=has_profile)
        if marker in (0xD9, 0xDA):  # end, or the scan: the frame had to come before
            raise IndexError("a frame is missing")
        has_profile |= marker == 0xE2 and data[at + 4 : at + 16] == b"ICC_PROFILE\0"
        at += 2 + length


def _exr(file: Path, data: bytes) -> Header:
    """Of a file with several parts the first."""
    (flags,) = struct.unpack_from("<I", data, 4)
    if flags & _EXR_NOT_FLAT:
        raise BadInput(file, "pixel format", "deep", "flat pixels: save it flattened")
    attributes: dict[bytes, bytes] = {}
    at = 8
    blocks = 0
    while data[at]:
        blocks = _counted(blocks)
        name, at = _exr_text(data, at)
        _, at = _exr_text(data, at)
        (size,) = struct.unpack_from("<I", data, at)
        at += 4 + size
        if at >= len(data):
            raise IndexError("the header goes on")
        attributes[name] = data[at - size : at]
    left, top, right, bottom = struct.unpack("<4i", attributes.get(b"dataWindow", b""))
    planes, kind, others = _exr_channels(file, attributes.get(b"channels", b""))
    given = attributes.get(b"chromaticities")
    return Header(
        "EXR",
        max(right - left + 1, 0),
        max(bottom - top + 1, 0),
        kind,
        planes,
        None if given is None or not any(given) else struct.unpack("<8f", given),
        notes=(f"Other channels were left out: {', '.join(others)}.",) if others else (),
    )


def _counted(blocks: int) -> int:
    """One block of a header more; a file of nothing but empty ones would take for ever."""
    if blocks == _MOST_BLOCKS:
        raise IndexError("the header does not end")
    return blocks + 1


def _exr_text(data: bytes, at: int) -> tuple[bytes, int]:
    end = data.index(b"\0", at) if b"\0" in data[at : at + 256] else -1
    if end < 0:
        raise IndexError("a name does not end")
    return data[at:end], end + 1


def _exr_channels(file: Path, chlist: bytes) -> tuple[tuple[str, ...], str, list[str]]:
    """Those of the colours, their type, and the others."""
    found: dict[str, tuple[int, int, int]] = {}
    at = 0
    while chlist[at]:
        name, at = _exr_text(chlist, at)
        sample_type, across, down = struct.unpack_from("<i4xii", chlist, at)
        found[name.decode("latin-1")] = (sample_type, across, down)
        at += 16
    by_name = {name.upper(): name for name in found}
    for names in (("X", "Y", "Z"), ("R", "G", "B")):
        if set(names) <= by_name.keys():
            break
    else:
        listed = ", ".join(sorted(found)[:8]) or "none"
        expected = "R, G, B or X, Y, Z: save the picture's layer alone, spectra as RGB"
        raise BadInput(file, "channels", listed, expected)
    planes = tuple(by_name[name] for name in names)
    kinds = {found[name] for name in planes}
    if kinds not in ({(1, 1, 1)}, {(2, 1, 1)}):
        types = ", ".join(sorted(_EXR_TYPES.get(kind[0], "unknown") for kind in kinds))
        expected = "half or float channels of one type and size: save them as half"
        raise BadInput(file, "channels", f"not alike or {types}", expected)
    others = sorted(found.keys() - set(planes))
    return planes, _EXR_TYPES[kinds.pop()[0]], others
