"""Photographs in PNG and JPEG: cut-outs, palettes, codings, and what phones add."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.photograph_files import (
    ADOBE_RGB,
    HEIGHT,
    WIDTH,
    Writer,
    exif,
    in_srgb,
    is_light,
    light_of,
    noise,
    photo_case,
    png,
    png_chunk,
    save_png,
    slope,
    stored_as,
)

_PLAIN, _DEEP, _GREY, _SLOPE = noise(), noise(np.uint16), noise(channels=1), slope()
_LOSSY = 0.03
_CUT_OUT = "a cut-out by alpha"
_ANIMATION = "an animation: its first picture"
_PHONE = "what phones add to a JPEG"


def _save(data: bytes) -> Writer:
    return lambda path: path.write_bytes(data)


# ---- PNG ---------------------------------------------------------------------------------------

_alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
_alpha[10:, 5:40] = 255
_opaque = _alpha > 127
_soft = np.where(_opaque, 200, 90).astype(np.uint8)
_HOLES = ("transparent and were left out",)


def _keyed(codes: NDArray[Any]) -> tuple[NDArray[np.bool_], tuple[bytes, bytes]]:
    """Where a colour is not that of the pixel at 3, 3, and the chunk that names it."""
    key = codes[3, 3]
    return (codes != key).any(axis=2), (b"tRNS", key.astype(">u2").tobytes())


_grey_key, _deep_key = _keyed(_GREY), _keyed(_DEEP)
_numbers = noise(channels=1, bits=4)
_colours = np.random.default_rng(4).integers(0, 256, (16, 3)).astype(np.uint8)
_plte = (b"PLTE", _colours.tobytes())
_PNGS = (
    photo_case(
        "cutout_16.png",
        _CUT_OUT,
        is_light(light_of(_DEEP), opaque=_opaque),
        save_png(np.dstack([_DEEP, _alpha.astype(np.uint16) * 257]), 6),
        *_HOLES,
    ),
    photo_case(
        "cutout_grey.png",
        _CUT_OUT,
        is_light(light_of(_GREY), opaque=_opaque),
        save_png(np.dstack([_GREY, _alpha]), 4),
        *_HOLES,
    ),
    photo_case(
        "cutout_soft.png",
        "partly transparent pixels",
        is_light(light_of(_PLAIN), opaque=_opaque),
        save_png(np.dstack([_PLAIN, _soft]), 6),
        *_HOLES,
        "100 % of the pixels are partly transparent",
    ),
    photo_case(
        "nearly_opaque.png",
        "partly transparent pixels",
        is_light(light_of(_PLAIN)),
        save_png(np.dstack([_PLAIN, np.maximum(_soft, 250)]), 6),
        "partly transparent",
    ),
    photo_case(
        "all_transparent.png",
        "a picture that is all transparent",
        None,
        save_png(np.dstack([_PLAIN, _alpha // 255]), 6),
        "transparent in 100 % of the pixels",
        "save it without its alpha",
        ends="refused",
    ),
    photo_case(
        "opaque_alpha.png",
        "alpha that is opaque",
        is_light(light_of(_DEEP)),
        save_png(np.dstack([_DEEP, np.full_like(_DEEP[..., 0], 65535)]), 6),
    ),
    photo_case(
        "key_grey.png",
        "a colour that stands for holes",
        is_light(light_of(_GREY), opaque=_grey_key[0]),
        save_png(_GREY, 0, _grey_key[1]),
        *_HOLES,
    ),
    photo_case(
        "key_16.png",
        "a colour that stands for holes",
        is_light(light_of(_DEEP), opaque=_deep_key[0]),
        save_png(_DEEP, 2, _deep_key[1]),
        "less than 0.1 % of the pixels are transparent",
    ),
    photo_case(
        "palette.png",
        "palettes",
        is_light(light_of(_colours[_numbers[..., 0]])),
        save_png(_numbers, 3, _plte, bits=4),
    ),
    photo_case(
        "palette_holes.png",
        "palettes",
        is_light(light_of(_colours[_numbers[..., 0]]), opaque=_numbers[..., 0] != 2),
        save_png(_numbers, 3, _plte, (b"tRNS", b"\xff\xff\0"), bits=4),
        *_HOLES,
    ),
    *(
        photo_case(
            f"grey_{bits}.png",
            "PNG: less than 8 bits",
            is_light(light_of(noise(channels=1, bits=bits), (1 << bits) - 1), 3e-3),
            save_png(noise(channels=1, bits=bits), 0, bits=bits),
        )
        for bits in (1, 2, 4)
    ),
    photo_case(
        "significant_bits.png",
        "PNG: significant bits",
        is_light(light_of(_DEEP)),
        save_png(_DEEP, 2, (b"sBIT", b"\x0a\x0a\x0a")),
    ),
    photo_case(
        "text_damaged.png",
        "PNG: a chunk beside the picture is damaged",
        is_light(light_of(_PLAIN)),
        _save(png(_PLAIN, 2, (b"tEXt", b"a\0bcd")).replace(b"a\0bcd", b"a\0bXd")),
        "checksum were left out: tEXt",
    ),
    photo_case(
        "interlaced.png",
        "PNG: interlaced",
        is_light(light_of(_PLAIN)),
        lambda path: _save(_interlaced(_PLAIN))(path),
    ),
    photo_case(
        "animated.png",
        _ANIMATION,
        is_light(light_of(_PLAIN)),
        lambda path: _save_frames(path),
        "animation",
    ),
    *(
        photo_case(
            f"turned_{orientation}.png",
            "turned upright: PNG",
            is_light(light_of(codes)),
            save_png(stored_as(codes, orientation), 2, (b"eXIf", exif(orientation))),
        )
        for orientation, codes in ((3, _DEEP), (8, _PLAIN))
    ),
    photo_case(
        "turned_cutout.png",
        "turned upright: PNG",
        is_light(light_of(_PLAIN), opaque=_opaque),
        save_png(stored_as(np.dstack([_PLAIN, _alpha]), 6), 6, (b"eXIf", exif(6))),
        *_HOLES,
    ),
)


def _interlaced(codes: NDArray[np.uint8]) -> bytes:
    """Seven pictures of every so manieth pixel (PNG, third edition, 8)."""
    passes = [(0, 8, 0, 8), (0, 8, 4, 8), (4, 8, 0, 4), (0, 4, 2, 4), (2, 4, 0, 2), (0, 2, 1, 2)]
    rows = b"".join(
        b"\0" + row.tobytes()
        for top, down, left, across in [*passes, (1, 2, 0, 1)]
        for row in codes[top::down, left::across]
    )
    header = struct.pack(">IIBBBBB", codes.shape[1], codes.shape[0], 8, 2, 0, 0, 1)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(png_chunk(*part) for part in parts)


def _save_frames(path: Path, **options: Any) -> None:
    from PIL import Image

    frames = [Image.fromarray(codes) for codes in (_PLAIN, 255 - _PLAIN, _PLAIN // 2)]
    frames[0].save(path, save_all=True, append_images=frames[1:], **options)


# ---- JPEG --------------------------------------------------------------------------------------


def _jpeg(codes: NDArray[Any] = _SLOPE, mode: str | None = None, **options: Any) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    flat = codes[..., 0] if codes.shape[2] == 1 else codes
    Image.fromarray(flat, mode).save(stream, "JPEG", **{"quality": 97, "subsampling": 0} | options)
    return stream.getvalue()


def _with_segment(marker: int, content: bytes, behind: bytes = b"") -> Writer:
    """A segment behind the first two bytes, and bytes behind the picture."""

    def write(path: Path) -> None:
        data = _jpeg()
        head = struct.pack(">BBH", 0xFF, marker, len(content) + 2) + content
        path.write_bytes(data[:2] + head + data[2:] + behind)

    return write


def _xmp(text: str) -> bytes:
    return b"http://ns.adobe.com/xap/1.0/\0" + text.encode()


def _mpf(kinds: list[int]) -> bytes:
    """An index of pictures (CIPA DC-007) of these types, the first being the picture itself."""
    entries = b"".join(
        struct.pack(">IIIHH", kind, 100, 0 if number == 0 else 5000, 0, 0)
        for number, kind in enumerate(kinds)
    )
    fields = struct.pack(">HHI4s", 0xB000, 7, 4, b"0100")
    fields += struct.pack(">HHII", 0xB001, 4, 1, len(kinds))
    fields += struct.pack(">HHII", 0xB002, 7, len(entries), 8 + 2 + 36 + 4)
    return b"MPF\0MM\0*" + struct.pack(">IH", 8, 3) + fields + bytes(4) + entries


def _interoperability(index: bytes) -> bytes:
    """EXIF with the index in a directory of the directory of EXIF's own tags (DCF 2.0)."""
    first = struct.pack(">HHHIII", 1, 0x8769, 4, 1, 26, 0)
    second = struct.pack(">HHHIII", 1, 0xA005, 4, 1, 44, 0)
    third = struct.pack(">HHHI4sI", 1, 1, 2, 4, index, 0)
    return b"MM\0*\0\0\0\x08" + first + second + third


_SMOOTH = is_light(light_of(_SLOPE), _LOSSY)
_JPEGS = (
    photo_case(
        "progressive.jpg",
        "JPEG: codings",
        _SMOOTH,
        _save(_jpeg(progressive=True)),
    ),
    photo_case(
        "grey.jpg",
        "JPEG: codings",
        is_light(light_of(_SLOPE[..., 1:2]), _LOSSY),
        _save(_jpeg(_SLOPE[..., 1:2])),
    ),
    photo_case(
        "rgb.jpg",
        "JPEG: codings",
        _SMOOTH,
        _save(_jpeg(keep_rgb=True)),
    ),
    photo_case(
        "bits_12.jpg",
        "JPEG: 12 bits, lossless",
        None,
        lambda path: _save_jpeg12(path),
        "12 bit",
        "16-bit TIFF",
        ends="refused",
    ),
    photo_case(
        "lossless.jpg",
        "JPEG: 12 bits, lossless",
        None,
        lambda path: _save_lossless(path),
        "lossless",
        "a usual JPEG",
        ends="refused",
    ),
    *(
        photo_case(
            f"turned_{orientation}.jpg",
            "turned upright: JPEG",
            _SMOOTH,
            _save(_jpeg(stored_as(_SLOPE, orientation), exif=b"Exif\0\0" + exif(orientation))),
        )
        for orientation in (3, 6, 8)
    ),
    photo_case(
        "turned_by_xmp.jpg",
        "turned upright: JPEG",
        is_light(light_of(stored_as(_SLOPE, 3)), _LOSSY),
        _with_segment(0xE1, _xmp('<x tiff:Orientation="3"/>')),
    ),
    photo_case(
        "adobergb_by_exif.jpg",
        "a colour space named in EXIF alone",
        is_light(np.clip(in_srgb((_SLOPE / 255) ** (563 / 256), ADOBE_RGB), 0, 1), _LOSSY),
        _with_segment(0xE1, b"Exif\0\0" + _interoperability(b"R03\0")),
        "Adobe RGB",
    ),
    photo_case(
        "srgb_by_exif.jpg",
        "a colour space named in EXIF alone",
        _SMOOTH,
        _with_segment(0xE1, b"Exif\0\0" + _interoperability(b"R98\0")),
    ),
    photo_case(
        "exif_damaged.jpg",
        "a damaged EXIF block",
        _SMOOTH,
        _with_segment(0xE1, b"Exif\0\0II*\0\xff\xff\xff\x7f"),
        "EXIF block is damaged",
    ),
    photo_case(
        "gain_map.jpg",
        _PHONE,
        _SMOOTH,
        _with_segment(0xE1, _xmp('<x hdrgm:Version="1.0"/>'), _jpeg(_SLOPE[..., :1])),
        "gain map",
    ),
    photo_case(
        "depth_map.jpg",
        _PHONE,
        _SMOOTH,
        _with_segment(0xE1, _xmp('<x GDepth:Format="RangeInverse" GDepth:Near="1"/>')),
        "depth map",
    ),
    photo_case(
        "motion.jpg",
        _PHONE,
        _SMOOTH,
        _with_segment(0xE1, _xmp('<x GCamera:MotionPhoto="1"/>'), b"\0\0\0\x18ftypmp42"),
        "film",
    ),
    photo_case(
        "second_view.jpg",
        _PHONE,
        _SMOOTH,
        _with_segment(0xE2, _mpf([0x030000, 0x020002]), _jpeg()),
        "1 more picture",
    ),
    photo_case(
        "large_preview.jpg",
        "previews inside a JPEG",
        _SMOOTH,
        _with_segment(0xE2, _mpf([0x030000, 0x010002]), _jpeg()),
    ),
    photo_case(
        "truncated.jpg",
        "a truncated file",
        None,
        _save(_jpeg()[:-700]),
        "truncated or damaged",
        "copy or save it again",
        ends="refused",
    ),
)


def _save_jpeg12(path: Path) -> None:
    import imagecodecs

    path.write_bytes(imagecodecs.jpeg8_encode(_DEEP >> 4, bitspersample=12))


def _save_lossless(path: Path) -> None:
    import imagecodecs

    path.write_bytes(imagecodecs.jpeg8_encode(_GREY[..., 0], lossless=True))


CASES = (*_PNGS, *_JPEGS)
