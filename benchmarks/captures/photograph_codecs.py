"""Photographs in AVIF, WebP, BMP, GIF and JPEG 2000."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.photograph_files import (
    DISPLAY_P3,
    HEIGHT,
    REC_2020,
    SRGB,
    WIDTH,
    Writer,
    exif,
    in_srgb,
    is_light,
    light_of,
    noise,
    photo_case,
    rgb_profile,
    save_pillow,
    slope,
    stored_as,
)

_PLAIN, _DEEP, _GREY, _SLOPE = noise(), noise(np.uint16), noise(channels=1), slope()
_LOSSY = 0.03
_CUT_OUT = "a cut-out by alpha"
_ANIMATION = "an animation: its first picture"
_PHONE = "what phones add to a JPEG"


_alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
_alpha[10:, 5:40] = 255
_opaque = _alpha > 127
_HOLES = ("transparent and were left out",)
_numbers = noise(channels=1, bits=4)
_colours = np.random.default_rng(4).integers(0, 256, (16, 3)).astype(np.uint8)


def _save_frames(path: Path, **options: Any) -> None:
    from PIL import Image

    frames = [Image.fromarray(codes) for codes in (_PLAIN, 255 - _PLAIN, _PLAIN // 2)]
    frames[0].save(path, save_all=True, append_images=frames[1:], **options)


# ---- AVIF and WebP ------------------------------------------------------------------------------


def _save_avif(bits: int, codes: NDArray[Any], primaries: int, transfer: int) -> Writer:
    """Lossless, by libavif."""

    def write(path: Path) -> None:
        import imagecodecs

        data = imagecodecs.avif_encode(
            codes,
            level=100,
            speed=8,
            bitspersample=bits,
            primaries=primaries,
            transfer=transfer,
            matrix=0,
        )
        path.write_bytes(data)

    return write


def _pq(share: NDArray[Any]) -> NDArray[np.float64]:
    root = share ** (1 / 78.84375)
    above = np.maximum(root - 0.8359375, 0) / (18.8515625 - 18.6875 * root)
    return np.array(10000 * above ** (1 / 0.1593017578125) / 203)


_ten, _twelve = noise(np.uint16, bits=10), noise(np.uint16, bits=12)
_AVIFS = (
    photo_case(
        "10_bits.avif",
        "AVIF: 10 and 12 bits",
        is_light(light_of(_ten, 1023), 1e-4),
        _save_avif(10, _ten, 1, 13),
    ),
    photo_case(
        "12_bits.avif",
        "AVIF: 10 and 12 bits",
        is_light(light_of(_twelve, 4095), 1e-4),
        _save_avif(12, _twelve, 1, 13),
    ),
    photo_case(
        "p3.avif",
        "AVIF: colours by code points",
        is_light(in_srgb(light_of(_PLAIN), DISPLAY_P3), 1e-4),
        _save_avif(8, _PLAIN, 12, 13),
        "Display P3",
    ),
    photo_case(
        "pq.avif",
        "AVIF: colours by code points",
        is_light(in_srgb(_pq(_ten / 1023), REC_2020), 0.02),
        _save_avif(10, _ten, 9, 16),
        "BT.2020, PQ",
    ),
    *(
        photo_case(
            f"turned_{orientation}.avif",
            "turned upright: AVIF, WebP",
            is_light(light_of(_SLOPE), _LOSSY),
            save_pillow(
                stored_as(_SLOPE, orientation),
                exif=exif(orientation),
                quality=95,
                subsampling="4:4:4",
            ),
        )
        for orientation in (2, 5, 6, 8)
    ),
    photo_case(
        "cutout.avif",
        _CUT_OUT,
        is_light(light_of(_SLOPE), _LOSSY, opaque=_opaque),
        save_pillow(np.dstack([_SLOPE, _alpha]), quality=100, subsampling="4:4:4"),
        *_HOLES,
    ),
    photo_case(
        "sequence.avif",
        _ANIMATION,
        is_light(light_of(_PLAIN), 0.25),
        lambda path: _save_frames(path, quality=100, subsampling="4:4:4"),
        "animation",
    ),
)
_WEBPS = (
    photo_case(
        "lossy.webp", "WebP", is_light(light_of(_SLOPE), 0.05), save_pillow(_SLOPE, quality=95)
    ),
    photo_case(
        "lossless.webp", "WebP", is_light(light_of(_PLAIN)), save_pillow(_PLAIN, lossless=True)
    ),
    photo_case(
        "cutout.webp",
        _CUT_OUT,
        is_light(light_of(_PLAIN), opaque=_opaque),
        save_pillow(np.dstack([_PLAIN, _alpha]), lossless=True, exact=True),
        *_HOLES,
    ),
    photo_case(
        "animated.webp",
        _ANIMATION,
        is_light(light_of(_PLAIN)),
        lambda path: _save_frames(path, lossless=True),
        "animation",
    ),
    photo_case(
        "turned_7.webp",
        "turned upright: AVIF, WebP",
        is_light(light_of(_PLAIN)),
        save_pillow(stored_as(_PLAIN, 7), lossless=True, exif=exif(7)),
    ),
)


# ---- BMP, GIF, JPEG 2000 ------------------------------------------------------------------------


def _bmp(
    pixels: bytes,
    bits: int,
    *,
    height: int = HEIGHT,
    compression: int = 0,
    palette: bytes = b"",
    masks: Sequence[int] = (),
    profile: bytes = b"",
) -> Writer:
    """By hand: a header of 40 bytes, or of 124 where there are masks or a profile."""
    size = 124 if masks or profile else 40
    at = 14 + size + len(palette)
    info = struct.pack("<IiiHHIIiiII", size, WIDTH, height, 1, bits, compression, len(pixels),
                       2835, 2835, len(palette) // 4, 0)  # fmt: skip
    if size == 124:
        info += struct.pack("<4I", *masks or (0,) * 4)
        info += b"DEBM" if profile else b"BGRs"
        profile_at = size + len(palette) + len(pixels)
        info += bytes(48) + struct.pack("<4I", 4, profile_at, len(profile), 0)
    head = struct.pack("<2sIHHI", b"BM", at + len(pixels) + len(profile), 0, 0, at)
    return lambda path: path.write_bytes(head + info + palette + pixels + profile)


def _rows(codes: NDArray[Any], *, bottom_up: bool = True) -> bytes:
    """Rows padded to four bytes."""
    flat = (codes[::-1] if bottom_up else codes).reshape(len(codes), -1)
    raw = np.ascontiguousarray(flat).view(np.uint8).reshape(len(codes), -1)
    return np.pad(raw, ((0, 0), (0, -raw.shape[1] % 4))).tobytes()


_bgr = _PLAIN[..., ::-1]
_five = _PLAIN >> 3
_six = np.dstack([_five[..., 0], _PLAIN[..., 1] >> 2, _five[..., 2]]).astype(np.uint16)
_565 = _six[..., 0] << 11 | _six[..., 1] << 5 | _six[..., 2]
_bgra_palette = np.dstack([_colours[None, :, ::-1], np.zeros((1, 16), np.uint8)]).tobytes()
_nibbles = (_numbers[:, ::2, 0] << 4 | _numbers[:, 1::2, 0]).astype(np.uint8)
_runs = b"".join(
    b"".join(bytes((1, value)) for value in row) + b"\0\0" for row in _GREY[::-1, :, 0]
)
_greys = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 4, axis=1).tobytes()
_BGRA = (0xFF0000, 0xFF00, 0xFF, 0xFF000000)
_BMPS = (
    photo_case("24.bmp", "BMP", is_light(light_of(_PLAIN)), _bmp(_rows(_bgr), 24)),
    photo_case(
        "top_down.bmp",
        "BMP",
        is_light(light_of(_PLAIN)),
        _bmp(_rows(_bgr, bottom_up=False), 24, height=-HEIGHT),
    ),
    photo_case(
        "16.bmp",
        "BMP",
        is_light(light_of(_six / np.array([31, 63, 31]), 1), 0.01),
        _bmp(_rows(_565), 16, compression=3, masks=(0xF800, 0x07E0, 0x1F, 0)),
    ),
    photo_case(
        "4.bmp",
        "palettes",
        is_light(light_of(_colours[_numbers[..., 0]])),
        _bmp(_rows(_nibbles), 4, palette=_bgra_palette),
    ),
    photo_case(
        "runs.bmp",
        "BMP",
        is_light(light_of(_GREY)),
        _bmp(_runs + b"\0\1", 8, compression=1, palette=_greys),
    ),
    photo_case(
        "32.bmp",
        "BMP",
        is_light(light_of(_PLAIN)),
        _bmp(_rows(np.dstack([_bgr, _alpha])), 32),
    ),
    photo_case(
        "cutout.bmp",
        _CUT_OUT,
        is_light(light_of(_PLAIN), opaque=_opaque),
        _bmp(_rows(np.dstack([_bgr, _alpha])), 32, compression=3, masks=_BGRA),
        *_HOLES,
    ),
    photo_case(
        "alpha_unused.bmp",
        "alpha that nobody filled in",
        is_light(light_of(_PLAIN)),
        _bmp(_rows(np.dstack([_bgr, _alpha * 0])), 32, compression=3, masks=_BGRA),
    ),
    photo_case(
        "profile.bmp",
        "8 bits with another profile than sRGB's",
        is_light((_PLAIN / 255) ** (461 / 256), 1e-3),
        _bmp(_rows(_bgr), 24, profile=rgb_profile(SRGB, 1.8)),
        "made by hand",
    ),
)
_GIFS = (
    photo_case(
        "animated.gif",
        _ANIMATION,
        is_light(light_of(_GREY)),
        lambda path: _save_gif(path, more=2),
        "animation",
    ),
    photo_case("still.gif", "GIF", is_light(light_of(_GREY)), lambda path: _save_gif(path)),
    photo_case(
        "holes.gif",
        _CUT_OUT,
        is_light(light_of(_GREY), opaque=_GREY[..., 0] > 30),
        lambda path: _save_gif(path, transparent=True),
        *_HOLES,
    ),
)


def _save_gif(path: Path, *, more: int = 0, transparent: bool = False) -> None:
    from PIL import Image

    codes = np.where(_GREY > 30, _GREY, 9)[..., 0] if transparent else _GREY[..., 0]
    frames = [Image.fromarray(codes)] + [Image.fromarray(255 - codes >> n) for n in range(more)]
    options: dict[str, Any] = {"transparency": 9} if transparent else {}
    frames[0].save(path, save_all=more > 0, append_images=frames[1:], optimize=False, **options)


_JPEG2000S = (
    photo_case("8.jp2", "JPEG 2000", is_light(light_of(_PLAIN)), save_pillow(_PLAIN)),
    photo_case("stream.j2k", "JPEG 2000", is_light(light_of(_PLAIN)), save_pillow(_PLAIN)),
    photo_case(
        "16.jp2",
        "JPEG 2000",
        is_light(light_of(_DEEP)),
        lambda path: _save_jpeg2000(path, _DEEP),
    ),
    photo_case(
        "cutout.jp2",
        _CUT_OUT,
        is_light(light_of(_PLAIN), opaque=_opaque),
        save_pillow(np.dstack([_PLAIN, _alpha])),
        *_HOLES,
    ),
)


def _save_jpeg2000(path: Path, codes: NDArray[Any]) -> None:
    import imagecodecs

    path.write_bytes(imagecodecs.jpeg2k_encode(codes, codecformat="jp2"))


CASES = (*_AVIFS, *_WEBPS, *_BMPS, *_GIFS, *_JPEG2000S)
