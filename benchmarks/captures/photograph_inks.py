"""Photographs in inks and in L*a*b*."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.photograph_files import (
    HEIGHT,
    WIDTH,
    ink_profile,
    is_light,
    lab_of_inks,
    light_of,
    noise,
    rgb_of_lab,
    save_pillow,
    save_tiff,
    tiff,
)
from storage.readers.photographs import read_photograph

_CMYK = "inks (CMYK)"
_INKS = noise(channels=4)
_CORNERS = (_INKS > 127).astype(np.uint8) * 255
_PLAIN_FORMULA = "no profile: a plain formula"


def _without_profile(inks: NDArray[Any]) -> NDArray[np.float64]:
    share = 1 - inks / np.iinfo(inks.dtype).max
    codes = share[..., :3] * share[..., 3:]
    return light_of(codes, 1)


def _smooth_inks() -> NDArray[np.uint8]:
    across, down = np.meshgrid(np.linspace(20, 200, WIDTH), np.linspace(30, 160, HEIGHT))
    return np.dstack([across, down, across / 2, down / 3]).astype(np.uint8)


_INK_CASES = (
    Case(
        "photo_cmyk_adobe.jpg",
        _CMYK,
        read_photograph,
        "told",
        [_PLAIN_FORMULA],
        is_light(_without_profile(_smooth_inks()), 0.03),
        save_pillow(_smooth_inks(), "CMYK", quality=98, subsampling=0),
    ),
    Case(
        "photo_cmyk_8.tif",
        _CMYK,
        read_photograph,
        "told",
        [_PLAIN_FORMULA],
        is_light(_without_profile(_INKS), 0.01),
        save_tiff(_INKS, photometric="separated"),
    ),
    Case(
        "photo_cmyk_16.tif",
        _CMYK,
        read_photograph,
        "told",
        [_PLAIN_FORMULA],
        is_light(_without_profile(noise(np.uint16, 4)), 1e-4),
        save_tiff(noise(np.uint16, 4), photometric="separated"),
    ),
    Case(
        "photo_cmyk_profile.tif",
        "inks with a profile",
        read_photograph,
        "told",
        ["converted to sRGB from the ICC profile 'made by hand'"],
        is_light(rgb_of_lab(lab_of_inks(_CORNERS / 255)), 2e-3),
        save_tiff(
            _CORNERS,
            photometric="separated",
            extratags=[(34675, 7, None, ink_profile(), True)],
        ),
    ),
)


def _lab_codes(dtype: Any, *, is_icc: bool) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Samples, and what they mean."""
    step = 256 if dtype == np.uint16 else 1
    random = np.random.default_rng(3)
    signed = np.int16 if dtype == np.uint16 else np.int8
    opponents: Any = (random.integers(-40, 40, (HEIGHT, WIDTH, 2)) * step).astype(signed)
    most = np.iinfo(dtype).max if not (is_icc and step > 1) else 65280
    light: Any = random.integers(most // 5, most, (HEIGHT, WIDTH, 1)).astype(dtype)
    lab = np.dstack([light * (100 / most), opponents / step])
    stored = opponents.view(dtype) + dtype(128 * step if is_icc else 0)
    return np.dstack([light, stored]), lab


def _save_lab(codes: NDArray[Any], photometric: int) -> Any:
    bits = 8 * codes.dtype.itemsize
    tags = {258: (3, [bits] * 3), 262: (3, [photometric])}
    return lambda path: path.write_bytes(tiff(codes, tags))


def _lab_case(name: str, dtype: Any, photometric: int) -> Case:
    codes, lab = _lab_codes(dtype, is_icc=photometric == 9)
    return Case(
        name,
        "CIE L*a*b*",
        read_photograph,
        "told",
        [r"L\*a\*b\*"],
        is_light(rgb_of_lab(lab), 1e-4),
        _save_lab(codes, photometric),
    )


_LAB_CASES = (
    _lab_case("photo_lab_8.tif", np.uint8, 8),
    _lab_case("photo_lab_16.tif", np.uint16, 8),
    _lab_case("photo_icclab_8.tif", np.uint8, 9),
    _lab_case("photo_icclab_16.tif", np.uint16, 9),
)

CASES = (*_INK_CASES, *_LAB_CASES)
