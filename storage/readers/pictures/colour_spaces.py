"""Colour spaces of linear light to linear sRGB, by their primaries and white or by their names.

A space's white becomes sRGB's: adaptation after Bradford (ICC.1:2022, annex E). CIE XYZ itself is
taken as it stands, relative to D65: whatever white a header gives for it is a formality.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_D65 = (0.3127, 0.3290)
_ACES_WHITE = (0.32168, 0.33767)
SRGB = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, *_D65)
"""Red, green, blue and white, x and y of each."""
_CIE_XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)

_SPACES = {
    "sRGB": SRGB,
    "CIE XYZ": _CIE_XYZ,
    "ACEScg": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, *_ACES_WHITE),
    "ACES2065-1": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, *_ACES_WHITE),
    "Rec. 2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *_D65),
    "Display P3": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *_D65),
    "DCI-P3": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351),
    "Adobe RGB": (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, *_D65),
    "ProPhoto RGB": (0.7347, 0.2653, 0.1596, 0.8404, 0.0366, 0.0001, 0.3457, 0.3585),
    "Radiance's RGB": (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, 1 / 3, 1 / 3),
}
_OTHER_NAMES = {
    "sRGB": (
        *("linear", "scene linear", "role scene linear", "lin srgb", "lin srgb scene", "linsrgb"),
        *("linear srgb", "lin rec709", "lin rec709 scene", "linear rec 709", "linear rec709"),
        *("linear rec 709 srgb", "utility linear srgb", "utility linear rec 709", "raw", "data"),
        *("utility raw", "unknown", "none", ""),
    ),
    "ACEScg": ("lin ap1", "lin ap1 scene", "ap1", "aces acescg"),
    "ACES2065-1": ("lin ap0", "lin ap0 scene", "ap0", "aces", "aces aces2065 1"),
    "CIE XYZ": ("lin ciexyzd65", "lin ciexyzd65 scene", "xyz", "cie xyz d65"),
    "Rec. 2020": (
        *("lin rec2020", "lin rec2020 scene", "linear rec 2020", "linear rec2020"),
        "utility linear rec 2020",
    ),
    "Display P3": (
        *("lin p3d65", "lin p3d65 scene", "lin displayp3", "linear p3 d65"),
        "utility linear p3 d65",
    ),
    "Adobe RGB": ("lin adobergb", "lin adobergb scene", "linear adobergb", "linear adobe rgb"),
}
_BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
_SAME = 2e-3  # of a chromaticity: as many digits as headers have


class ColourSpace(NamedTuple):
    """``to_srgb``: (3, 3), of column vectors, or None where nothing is to be done."""

    name: str
    to_srgb: NDArray[np.float64] | None

    @property
    def notes(self) -> tuple[str, ...]:
        """What to say of a picture that was converted."""
        if self.to_srgb is None:
            return ()
        return (f"The colours were converted from {self.name} to linear sRGB.",)

    def converted(self, colours: NDArray[Any]) -> NDArray[Any]:
        """``colours`` (..., 3) in linear sRGB: float32, or unchanged where they are so already."""
        if self.to_srgb is None:
            return colours
        with np.errstate(over="ignore", invalid="ignore"):  # readers look at what is not finite
            return colours.astype(np.float32) @ self.to_srgb.T.astype(np.float32)


def space_of(chromaticities: Sequence[float]) -> ColourSpace:
    """The space of red, green, blue and white, x and y of each; zeros alone mean sRGB.

    Raises ValueError for what spans no space.
    """
    given = np.array(chromaticities, np.float64)
    if given.shape != (8,) or not np.isfinite(given).all():
        raise ValueError("no eight numbers")
    if not given.any():  # as Photoshop writes them
        return LINEAR_SRGB
    for name, known in _SPACES.items():
        if np.allclose(given, known, atol=_SAME):
            return _space(name, given)
    return _space("primaries " + " ".join(f"{value:.4g}" for value in given), given)


def named_space(name: str) -> ColourSpace | None:
    """A linear space by a name that programs give it, None for one that is not known."""
    words = _words(name)
    for known, given in _SPACES.items():
        if words in (_words(known), *map(_words, _OTHER_NAMES.get(known, ()))):
            return _space(known, np.array(given))
    return None


def luminance_weights(chromaticities: Sequence[float] = SRGB) -> NDArray[np.float64]:
    """(3,) shares of red, green and blue in the luminance. Raises ValueError as `space_of`."""
    return _to_xyz(np.array(chromaticities, np.float64))[1]


def srgb_of_xyz(white: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) to linear sRGB of CIE XYZ relative to a white (x, y), which becomes that of sRGB.

    Raises ValueError for a white that no eye adapts to.
    """
    adapted = _adaptation(np.array(white), np.array(_D65))
    return np.asarray(np.linalg.inv(_to_xyz(np.array(SRGB))) @ adapted, np.float64)


def _words(name: str) -> str:
    return " ".join(re.findall(r"[a-z0-9]+", name.lower()))


def _space(name: str, given: NDArray[np.float64]) -> ColourSpace:
    if name == "sRGB":
        return LINEAR_SRGB
    if name == "CIE XYZ":
        return ColourSpace(name, srgb_of_xyz(_D65))
    return ColourSpace(name, srgb_of_xyz(given[6:]) @ _to_xyz(given))


def _to_xyz(chromaticities: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) from RGB, white being of luminance 1 (SMPTE RP 177)."""
    *primaries, white = (_xyz(xy) for xy in chromaticities.reshape(4, 2))
    columns = np.stack(primaries, axis=1)
    if abs(np.linalg.det(columns)) < 1e-4 or white[1] < 1e-4:
        raise ValueError("primaries on one line")
    return columns * np.linalg.solve(columns, white / white[1])


def _xyz(xy: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([xy[0], xy[1], 1 - xy[0] - xy[1]])


def _adaptation(source: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    cones = [_BRADFORD @ (_xyz(white) / white[1]) for white in (source, target)]
    if min(cones[0]) <= 0:
        raise ValueError("a white that is none")
    return np.linalg.inv(_BRADFORD) @ np.diag(cones[1] / cones[0]) @ _BRADFORD


LINEAR_SRGB = ColourSpace("sRGB", None)
CIE_XYZ = _space("CIE XYZ", np.array(_CIE_XYZ))
