"""Photographs of material databases: depths, channels, profiles, and Radiance."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.database_files import (
    PAIRS,
    SRGB_OF_XYZ,
    case,
    codes,
    deep_png,
    files,
    is_light,
    jpeg,
    light_of,
    plain,
    png,
    radiance,
    slow_codes,
    ubo2003,
    unpacked,
    utia,
    zipped,
)

# ---- codes -----------------------------------------------------------------------------------


def _opaque(stored: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate([stored, np.full_like(stored[..., :1], np.iinfo(stored.dtype).max)], -1)


def _palette_files() -> dict[str, bytes]:
    from PIL import Image

    found = []
    for image in codes() // 128 * 255:
        stream = io.BytesIO()
        Image.fromarray(image).quantize(8, dither=Image.Dither.NONE).save(stream, "PNG")
        found.append(stream.getvalue())
    return files(found)


def _adobe_rgb() -> bytes:
    import imagecodecs

    profile: bytes = imagecodecs.cms_profile(
        "rgb",
        whitepoint=[0.3127, 0.3290, 1.0],
        primaries=[0.64, 0.33, 1.0, 0.21, 0.71, 1.0, 0.15, 0.06, 1.0],
        gamma=563 / 256,
    )
    return profile


_SRGB_OF_ADOBE = np.array([[1.39836, -0.39836, 0.0], [0.0, 1.0, 0.0], [0.0, -0.04293, 1.04293]])
"""Linear, both of D65: from the primaries."""


def _srgb_profile() -> bytes:
    from PIL import ImageCms

    return ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


def _adobe_light() -> NDArray[np.float64]:
    light = (slow_codes() / 255) ** (563 / 256) @ _SRGB_OF_ADOBE.T
    return np.asarray(np.clip(light, 0, 1))


def _with(profile: bytes, stored: NDArray[np.uint8]) -> dict[str, bytes]:
    return files([png(image, icc_profile=profile) for image in stored])


def _clear_corner() -> dict[str, bytes]:
    stored = _opaque(codes())
    stored[:, 0, 0, 3] = 128
    return files([png(image) for image in stored])


_GREY = codes(channels=1)
_CODES = (
    case(
        "16_bit.zip",
        "16 bits",
        zipped(files([deep_png(image) for image in codes(np.uint16)])),
        is_light(light_of(codes(np.uint16))),
    ),
    case(
        "16_bit_grey.zip",
        "16 bits",
        zipped(files([deep_png(image) for image in codes(np.uint16, 1)])),
        is_light(light_of(codes(np.uint16, 1))),
    ),
    case("grey.zip", "grey", zipped(files([png(i) for i in _GREY])), is_light(light_of(_GREY))),
    case(
        "grey_jpeg.zip",
        "grey",
        zipped(files([jpeg(i, "L") for i in slow_codes()], ".jpg", ubo2003)),
        is_light(
            light_of((slow_codes() @ [0.299, 0.587, 0.114])[..., None].astype(np.uint8)), 0.04
        ),
    ),
    case(
        "grey_among_colours.zip",
        "grey",
        zipped(plain() | {utia(*PAIRS[0]) + ".png": png(_GREY[0])}),
        is_light(np.concatenate([light_of(_GREY[:1]), light_of(codes()[1:])])),
    ),
    case(
        "palette.zip",
        "palettes",
        lambda path: zipped(_palette_files())(path),
        is_light(light_of(codes() // 128 * 255)),
    ),
    case(
        "opaque_alpha.zip",
        "opaque alpha",
        zipped(files([png(image) for image in _opaque(codes())])),
        is_light(light_of(codes())),
        [r"6 photographs have an opaque alpha channel"],
    ),
    case(
        "opaque_alpha_16_bit.zip",
        "opaque alpha",
        zipped(files([deep_png(image) for image in _opaque(codes(np.uint16))])),
        is_light(light_of(codes(np.uint16))),
        [r"6 photographs have an opaque alpha channel"],
    ),
    case(
        "opaque_alpha_grey.zip",
        "opaque alpha",
        zipped(files([png(image) for image in _opaque(_GREY)])),
        is_light(light_of(_GREY)),
        [r"6 photographs have an opaque alpha channel"],
    ),
    case(
        "transparent.zip",
        "transparent photographs",
        zipped(_clear_corner()),
        says=[r"alpha channel is not opaque at 3\.3%", r"crop them, or save them without alpha"],
    ),
    case(
        "srgb_profile.zip",
        "ICC profiles",
        lambda path: zipped(_with(_srgb_profile(), codes()))(path),
        is_light(light_of(codes())),
    ),
    case(
        "adobe_rgb.zip",
        "ICC profiles",
        lambda path: zipped(_with(_adobe_rgb(), slow_codes()))(path),
        is_light(_adobe_light(), 2e-3),
        [r"converted to sRGB from the ICC profile"],
    ),
    case(
        "cmyk.zip",
        "inks",
        zipped(files([jpeg(image, "CMYK") for image in slow_codes()], ".jpg")),
        says=[r"8-bit CMYK", r"save it as RGB"],
    ),
    case(
        "progressive_with_exif.zip",
        "JPEG of other kinds",
        zipped(
            files(
                [jpeg(image, progressive=True, comment=b"x" * 9000) for image in slow_codes()],
                ".jpeg",
            )
        ),
        is_light(light_of(slow_codes()), 0.04),
    ),
    case(
        "png_and_jpeg.zip",
        "formats that mix",
        zipped(dict(list(plain().items())[1:]) | {utia(*PAIRS[0]) + ".jpg": jpeg(slow_codes()[0])}),
        says=[r"format is JPEG", r"PNG as in the other files: convert it, or move it elsewhere"],
    ),
    case(
        "sizes.zip",
        "sizes that differ",
        zipped(plain() | {utia(*PAIRS[3]) + ".png": png(codes()[3][:-1])}),
        says=[r"size is 5 x 5 pixels", r"5 x 6 pixels as in the other files: cut all alike"],
    ),
    case(
        "webp_in_png.zip",
        "formats that are not read",
        zipped(plain() | {utia(*PAIRS[3]) + ".png": b"RIFF\0\0\0\0WEBPVP8 " + bytes(50)}),
        says=[r"format is unknown", r"convert all of them"],
    ),
)

# ---- Radiance --------------------------------------------------------------------------------


def _rgbe(light: NDArray[np.float64]) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """(pair, y, x, 3) as mantissas and exponents, and the light that they are (Ward)."""
    exponents = np.array([math.frexp(v)[1] for v in light.max(axis=-1).ravel()])
    exponents = exponents.reshape(light.shape[:-1])
    mantissas = (light * 256 / 2.0 ** exponents[..., None]).astype(np.uint8)
    stored = np.concatenate([mantissas, (exponents + 128).astype(np.uint8)[..., None]], -1)
    return stored, mantissas / 256 * 2.0 ** exponents[..., None]


_STORED, _LIGHT = _rgbe(radiance(30.0))


def _hdr(order: str, turn: Any, **fields: str) -> Mapping[str, bytes]:
    """``turn``: of a picture into the order that the resolution line names."""
    lines = {"FORMAT": "32-bit_rle_rgbe"} | fields
    head = "#?RADIANCE\n" + "".join(f"{k}={v}\n" for k, v in lines.items()) + f"\n{order}\n"
    return files([head.encode() + turn(i).tobytes() for i in _STORED], ".hdr", ubo2003)


_RADIANCE = (
    case(
        "hdr_columns.zip",
        "Radiance, columns first",
        zipped(_hdr("+X 5 -Y 6", lambda i: i.transpose(1, 0, 2))),
        is_light(_LIGHT),
    ),
    case("hdr_rows.zip", "Radiance", zipped(_hdr("-Y 6 +X 5", lambda i: i)), is_light(_LIGHT)),
    case(
        "hdr_upside_down.zip",
        "Radiance",
        zipped(_hdr("+Y 6 +X 5", lambda i: i[::-1])),
        is_light(_LIGHT),
    ),
    case(
        "hdr_exposed.zip",
        "Radiance",
        zipped(_hdr("-Y 6 +X 5", lambda i: i, EXPOSURE="4")),
        is_light(_LIGHT / 4),
    ),
    case(
        "hdr_photoshop.zip",
        "Radiance",
        zipped(_hdr("-Y 6 +X 5", lambda i: i, PRIMARIES="0 0 0 0 0 0 0 0")),
        is_light(_LIGHT),
    ),
    case(
        "hdr_xyze.zip",
        "Radiance in CIE XYZ",
        zipped(_hdr("-Y 6 +X 5", lambda i: i, FORMAT="32-bit_rle_xyze")),
        is_light(_LIGHT @ SRGB_OF_XYZ.T, 1e-3),
        [r"converted from CIE XYZ"],
    ),
    case(
        "hdr_cut_short",
        "Radiance that is damaged",
        unpacked({n: d[:-8] for n, d in _hdr("-Y 6 +X 5", lambda i: i).items()}),
        says=[r"truncated or damaged", r"complete Radiance"],
    ),
)

CASES: tuple[Case, ...] = (*_CODES, *_RADIANCE)
