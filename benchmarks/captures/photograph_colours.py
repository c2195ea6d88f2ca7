"""Photographs in other colours than codes of sRGB: profiles, gammas, code points."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case, Ending
from benchmarks.captures.photograph_files import (
    ADOBE_RGB,
    DISPLAY_P3,
    REC_2020,
    SRGB,
    grey_profile,
    iccp,
    in_srgb,
    ink_profile,
    is_light,
    lab_of_scanner,
    light_of,
    noise,
    rgb_of_lab,
    rgb_profile,
    save_pillow,
    save_png,
    save_tiff,
    scanner_profile,
    slope,
    thrice,
)
from storage.readers.photographs import read_photograph

_PROFILE_16 = "16 bits with a profile"
_PROFILE_8 = "8 bits with another profile than sRGB's"
_CODE_POINTS = "colours by code points (PNG cICP)"
_GAMMA = "PNG with a gamma of its own"


def _clipped(light: NDArray[Any]) -> NDArray[np.float64]:
    return np.clip(light, 0, 1)


def _by_profile(codes: NDArray[Any], primaries: Any, gamma: float) -> NDArray[np.float64]:
    share = codes / (1 if codes.dtype.kind == "f" else np.iinfo(codes.dtype).max)
    return in_srgb(share**gamma, primaries)


# ---- profiles ----------------------------------------------------------------------------------

_DEEP, _PLAIN, _GREY = noise(np.uint16), noise(), noise(np.uint16, 1)
_EXTREME = (_PLAIN > 127).astype(np.uint8) * 255
_FLOAT = noise(np.float32) / 4
_G18 = round(1.8 * 256) / 256
_PROFILES = (
    Case(
        "photo_p3_16.png",
        _PROFILE_16,
        read_photograph,
        "told",
        ["made by hand", "outside of it"],
        is_light(_clipped(_by_profile(_DEEP, DISPLAY_P3, 2.2)), 2e-3),
        save_png(_DEEP, 2, iccp(rgb_profile(DISPLAY_P3, 2.2))),
    ),
    Case(
        "photo_rec2020_16.tif",
        _PROFILE_16,
        read_photograph,
        "told",
        ["made by hand"],
        is_light(_clipped(_by_profile(_DEEP, REC_2020, 2.4)), 2e-3),
        save_tiff(_DEEP, extratags=[(34675, 7, None, rgb_profile(REC_2020, 2.4), True)]),
    ),
    Case(
        "photo_grey_gamma_16.png",
        "grey with a profile",
        read_photograph,
        "told",
        ["profile 'made by hand'"],
        is_light(thrice((_GREY / 65535) ** _G18), 1e-4),
        save_png(_GREY, 0, iccp(grey_profile(1.8))),
    ),
    Case(
        "photo_grey_rgb_profile.png",
        "grey with a profile for RGB",
        read_photograph,
        "told",
        ["profile 'made by hand'"],
        is_light(thrice((_GREY / 65535) ** _G18), 1e-3),
        save_png(_GREY, 0, iccp(rgb_profile(SRGB, 1.8))),
    ),
    *(
        Case(
            f"photo_adobergb.{ending}",
            _PROFILE_8,
            read_photograph,
            "told",
            ["ICC profile 'made by hand'"],
            is_light(_clipped(_by_profile(codes, ADOBE_RGB, 2.2)), atol),
            save_pillow(codes, icc_profile=rgb_profile(ADOBE_RGB, 2.2), **options),
        )
        for ending, codes, atol, options in (
            ("png", _PLAIN, 2e-3, {}),
            ("tiff", _PLAIN, 2e-3, {}),
            ("jpg", slope(), 0.02, {"quality": 98, "subsampling": 0}),
            ("webp", _PLAIN, 2e-3, {"lossless": True}),
            ("avif", slope(), 0.03, {"quality": 95, "subsampling": "4:4:4"}),
        )
    ),
    Case(
        "photo_scanner.png",
        "a profile by tables",
        read_photograph,
        "told",
        ["profile 'made by hand'"],
        is_light(rgb_of_lab(lab_of_scanner(_EXTREME / 255)), 2e-3),
        save_png(_EXTREME, 2, iccp(scanner_profile())),
    ),
    Case(
        "photo_float_gamma.tif",
        "floats with a profile that is not linear",
        read_photograph,
        "told",
        ["profile 'made by hand'"],
        is_light(_FLOAT.astype(float) ** 2.2, 2e-3),
        save_tiff(_FLOAT, extratags=[(34675, 7, None, rgb_profile(SRGB, 2.2), True)]),
    ),
    Case(
        "photo_float_linear.tif",
        "a profile that says what is taken for granted",
        read_photograph,
        "read",
        (),
        is_light(_FLOAT),
        save_tiff(_FLOAT, extratags=[(34675, 7, None, rgb_profile(SRGB, 1.0), True)]),
    ),
    Case(
        "photo_broken_profile.png",
        "a profile that is damaged",
        read_photograph,
        "told",
        ["profile is damaged", "taken as sRGB"],
        is_light(light_of(_PLAIN)),
        save_png(_PLAIN, 2, iccp(rgb_profile(ADOBE_RGB, 2.2)[:140])),
    ),
    Case(
        "photo_ink_profile.png",
        "a profile for another kind of picture",
        read_photograph,
        "told",
        ["for another kind of picture"],
        is_light(light_of(_PLAIN)),
        save_png(_PLAIN, 2, iccp(ink_profile())),
    ),
)

# ---- gammas and code points --------------------------------------------------------------------


def _chrm(white: Any, primaries: Any) -> tuple[bytes, bytes]:
    values = np.round(np.array([white, *primaries]).ravel() * 100_000).astype(">u4")
    return b"cHRM", values.tobytes()


def _gama(gamma: float) -> tuple[bytes, bytes]:
    return b"gAMA", round(gamma * 100_000).to_bytes(4, "big")


def _pq(codes: NDArray[Any]) -> NDArray[np.float64]:
    """SMPTE ST 2084; 203 candela per square metre are 1 (ITU-R BT.2408)."""
    m1, m2, c1, c2, c3 = 0.1593017578125, 78.84375, 0.8359375, 18.8515625, 18.6875
    root = (codes / np.iinfo(codes.dtype).max) ** (1 / m2)
    return 10000 * (np.maximum(root - c1, 0) / (c2 - c3 * root)) ** (1 / m1) / 203


def _hlg(codes: NDArray[Any]) -> NDArray[np.float64]:
    """ARIB STD-B67 shown at 1000 candela per square metre with a system gamma of 1.2."""
    value = codes / np.iinfo(codes.dtype).max
    a = 0.17883277
    b, c = 1 - 4 * a, 0.5 - a * np.log(4 * a)
    scene = np.where(value <= 0.5, value**2 / 3, (np.exp((value - c) / a) + b) / 12)
    luminance = scene @ [0.2627, 0.6780, 0.0593]
    return np.array(1000 / 203 * scene * luminance[..., None] ** 0.2)


_CICP: tuple[tuple[str, tuple[int, ...], Ending, list[str], NDArray[Any]], ...] = (
    ("srgb", (1, 13, 0, 1), "read", [], light_of(_DEEP)),
    ("p3", (12, 13, 0, 1), "told", ["Display P3"], in_srgb(light_of(_DEEP), DISPLAY_P3)),
    ("linear", (1, 8, 0, 1), "told", ["linear"], _DEEP / 65535),
    ("pq", (9, 16, 0, 1), "told", ["PQ"], in_srgb(_pq(_DEEP), REC_2020)),
    ("hlg", (9, 18, 0, 1), "told", ["HLG"], in_srgb(_hlg(_DEEP), REC_2020)),
    ("log", (9, 10, 0, 1), "refused", ["transfer 10", "export it as sRGB"], _DEEP),
)
_CODED = (
    Case(
        "photo_gamma_linear.png",
        _GAMMA,
        read_photograph,
        "told",
        ["gamma 1"],
        is_light(_PLAIN / 255),
        save_png(_PLAIN, 2, _gama(1)),
    ),
    Case(
        "photo_gamma_primaries.png",
        _GAMMA,
        read_photograph,
        "told",
        ["gamma 0.5", "primaries"],
        is_light(_clipped(_by_profile(_DEEP, ADOBE_RGB, 2)), 1e-4),
        save_png(_DEEP, 2, _gama(0.5), _chrm((0.3127, 0.3290), ADOBE_RGB)),
    ),
    Case(
        "photo_gamma_usual.png",
        "chunks that say sRGB",
        read_photograph,
        "read",
        (),
        is_light(light_of(_PLAIN)),
        save_png(_PLAIN, 2, _gama(0.45455), _chrm((0.3127, 0.3290), SRGB)),
    ),
    Case(
        "photo_srgb_chunk.png",
        "chunks that say sRGB",
        read_photograph,
        "read",
        (),
        is_light(light_of(_PLAIN)),
        save_png(_PLAIN, 2, (b"sRGB", b"\0"), _gama(1.0)),
    ),
    *(
        Case(
            f"photo_cicp_{name}.png",
            _CODE_POINTS,
            read_photograph,
            ends,
            says,
            is_light(expected, 1e-4) if ends != "refused" else None,
            save_png(_DEEP, 2, (b"cICP", bytes(points))),
        )
        for name, points, ends, says, expected in _CICP
    ),
    Case(
        "photo_cicp_over_profile.png",
        _CODE_POINTS,
        read_photograph,
        "read",
        (),
        is_light(light_of(_PLAIN)),
        save_png(_PLAIN, 2, (b"cICP", bytes((1, 13, 0, 1))), iccp(rgb_profile(ADOBE_RGB, 2.2))),
    ),
)

CASES = (*_PROFILES, *_CODED)
