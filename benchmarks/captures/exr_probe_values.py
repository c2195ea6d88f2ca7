"""Light probes as OpenEXR files: colour spaces, windows, alpha, values that are no radiance."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.probe_files import (
    HEIGHT,
    WIDTH,
    converted,
    equals,
    exr,
    light,
    probe,
    rgb,
    window,
)

_FLAT = np.full((HEIGHT, WIDTH), 0.25, np.float16)
_CIE_XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
_AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)

# --- Colour spaces ------------------------------------------------------------------------------

_SPACES = (
    probe(
        "xyz.exr",
        "CIE XYZ",
        exr(rgb(names="XYZ")),
        "told",
        ["converted from CIE XYZ"],
        equals(converted("XYZ"), 1e-5),
    ),
    probe(
        "rgb_xyz.exr",
        "CIE XYZ",
        exr(chromaticities=_CIE_XYZ),
        "told",
        ["converted from CIE XYZ"],
        equals(converted("XYZ"), 1e-5),
    ),
    probe(
        "aces.exr",
        "wide-gamut primaries",
        exr(acesImageContainerFlag=1),
        "told",
        ["converted from ACES2065-1"],
        equals(converted("ACES2065-1"), 1e-5),
    ),
    probe(
        "interop.exr",
        "colour spaces by name",
        exr(colorInteropID="lin_ap1_scene"),
        "told",
        ["converted from ACEScg"],
        equals(converted("ACEScg"), 1e-5),
    ),
    probe(
        "oiio.exr",
        "colour spaces by name",
        exr(None, **{"oiio:ColorSpace": "lin_rec2020"}),
        "told",
        ["converted from Rec. 2020"],
        equals(converted("Rec. 2020"), 1e-5),
    ),
    probe("linear.exr", "colour spaces by name", exr(None, **{"oiio:ColorSpace": "Linear"})),
    probe(
        "encoded.exr",
        "colour spaces by name",
        exr(None, **{"oiio:ColorSpace": "sRGB"}),
        "told",
        ["'sRGB' by the header, were taken as linear"],
    ),
    probe("candela.exr", "a white's luminance", exr(whiteLuminance=100.0)),
    probe("unset.exr", "primaries that are unset", exr(chromaticities=(0.0,) * 8)),
    probe(
        "line.exr",
        "primaries that span nothing",
        exr(chromaticities=(0.3,) * 8),
        "refused",
        ["chromaticities", "without them it is sRGB"],
    ),
    probe(
        "infinite_aces.exr",
        "an infinite sun",
        exr(rgb(values=np.where(light() > 50, np.inf, light())), chromaticities=_AP1),
        "told",
        ["3 infinite values became 65504", "converted from ACEScg"],
        equals(converted("ACEScg", np.where(light() > 50, 65504, light())), 1e-4),
    ),
)

# --- Windows ------------------------------------------------------------------------------------


def _wide() -> NDArray[np.float64]:
    """The picture with two rows and four columns more on each side."""
    return np.pad(light(), ((2, 2), (4, 4), (0, 0)), constant_values=9)


def _trimmed() -> NDArray[np.float64]:
    return light()[: HEIGHT - 3]


def _black_below() -> NDArray[np.float64]:
    return np.concatenate([_trimmed(), np.zeros((3, WIDTH, 3))])


_WHOLE = window(0, 0, WIDTH, HEIGHT)
_WINDOWS = (
    probe(
        "overscan.exr",
        "more than is displayed",
        exr(
            rgb(values=_wide()),
            dataWindow=window(-4, -2, WIDTH + 8, HEIGHT + 4),
            displayWindow=_WHOLE,
        ),
        "told",
        ["outside of the display window, 32 x 16 pixels, was cut off"],
    ),
    probe(
        "trimmed.exr",
        "less than is displayed",
        exr(
            rgb(values=_trimmed()),
            dataWindow=window(0, 0, WIDTH, HEIGHT - 3),
            displayWindow=_WHOLE,
        ),
        "told",
        ["not stored of the display window, 32 x 16 pixels, is black"],
        equals(_black_below()),
    ),
    probe(
        "region.exr",
        "less than half of what is displayed",
        exr(displayWindow=window(0, 0, 2 * WIDTH, 2 * HEIGHT), dataWindow=_WHOLE),
        "refused",
        ["data window is 0 0 31 15", "save the whole picture"],
    ),
)

# --- Alpha, and values that are no radiance -----------------------------------------------------


def _with(row: int, column: int, value: float, channels: slice = slice(None)) -> NDArray[Any]:
    picture = light()
    picture[row, column, channels] = value
    return picture


def _filled(row: int, column: int) -> NDArray[np.float64]:
    """The mean of the eight around, over the picture's left edge."""
    picture = light()
    around = [
        picture[row + r, (column + c) % WIDTH] for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c
    ]
    picture[row, column] = np.mean(around, axis=0)
    return picture


def _holes(count: int) -> NDArray[Any]:
    picture = light()
    picture.reshape(-1, 3)[7 : 7 + count] = np.nan
    return picture


_GREEN = _with(9, 9, 0.0)
_GREEN[9, 9] = (0, 1, 0)
_VALUES = (
    probe("opaque.exr", "alpha", exr(rgb() | {"A": np.ones((HEIGHT, WIDTH), np.float16)})),
    probe(
        "alpha.exr",
        "alpha",
        exr(rgb() | {"A": _FLAT}),
        "told",
        ["alpha.* 512 pixels, was left out"],
    ),
    probe(
        "nan.exr",
        "texels that are no number",
        exr(rgb(values=_with(8, 0, np.nan))),
        "told",
        ["1 texel was no number and filled"],
        equals(_filled(8, 0), 1e-5),
    ),
    probe(
        "minus_infinity.exr",
        "texels that are no number",
        exr(rgb(values=_with(12, 31, -np.inf))),
        "told",
        ["1 texel was no number"],
        equals(_filled(12, 31), 1e-5),
    ),
    probe(
        "nans.exr",
        "mostly no numbers",
        exr(rgb(values=_holes(40))),
        "refused",
        ["no number in 40 of 512", "render or save it again"],
    ),
    probe(
        "negative.exr",
        "values below 0",
        exr(rgb(values=_with(9, 3, -0.5, slice(1, 2)))),
        "told",
        [r"1 texel was negative \(the least -0\.5\) and became 0"],
        equals(_with(9, 3, 0.0, slice(1, 2))),
    ),
    probe(
        "outside.exr",
        "colours outside sRGB",
        exr(rgb(values=_GREEN), **{"oiio:ColorSpace": "lin_rec2020"}),
        "told",
        ["converted from Rec. 2020", r"1 texel was negative \(the least -0\.588\)"],
        equals(np.maximum(converted("Rec. 2020", _GREEN), 0), 1e-5),
    ),
    probe(
        "signed.exr",
        "mostly below 0",
        exr(rgb(values=-light())),
        "refused",
        ["negative in 512 of 512", "radiance"],
    ),
    probe(
        "bright.exr",
        "an infinite sun",
        exr(rgb(values=np.where(light() > 50, np.inf, light()), dtype=np.float32)),
        "told",
        ["3 infinite values became 65504"],
        equals(np.where(light() > 50, 65504, light())),
    ),
)

CASES: tuple[Case, ...] = (*_SPACES, *_WINDOWS, *_VALUES)
