"""Colours that a few numbers describe: primaries with a gamma, or code points of ITU-T H.273.

PNG (`gAMA`, `cHRM`, `cICP`) and AVIF (`colr` of type `nclx`) have these instead of a profile.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.pictures.colour_spaces import SRGB, space_of, srgb_of_xyz
from storage.readers.pictures.srgb_curve import light_of_srgb

Primaries = tuple[float, float, float, float, float, float, float, float]
"""Chromaticities x, y of red, green, blue and white."""

_PRIMARIES: dict[int, Primaries] = {
    1: SRGB,
    2: SRGB,  # not said
    4: (0.67, 0.33, 0.21, 0.71, 0.14, 0.08, 0.310, 0.316),
    5: (0.64, 0.33, 0.29, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    6: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, 0.3127, 0.3290),
    7: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, 0.3127, 0.3290),
    9: (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    11: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351),
    12: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290),
}  # ITU-T H.273, table 2
_NAMES = {9: "BT.2020", 11: "DCI-P3", 12: "Display P3"}
_SRGB_LIKE = (1, 2, 6, 13, 14, 15)
"""Camera curves of television (1, 6, 14, 15) are shown like sRGB's, as by all browsers."""
_WHITE = 203.0
"""Candela per square metre of diffuse white in HDR (ITU-R BT.2408): 1 here."""
_ROWS = 64  # that are converted at a time

_D50 = (0.9642, 1.0, 0.8249)
"""X, Y and Z of the white of L*a*b* in files and of profiles."""


class CodePoints(NamedTuple):
    """Numbers of ITU-T H.273: of the primaries (table 2) and of the transfer curve (table 3)."""

    primaries: int
    transfer: int

    @property
    def are_known(self) -> bool:
        """Whether :func:`light_of_code_points` converts them."""
        return self.primaries in _PRIMARIES and self.transfer in (*_SRGB_LIKE, 4, 5, 8, 16, 18)

    @property
    def are_srgb(self) -> bool:
        """Whether codes are those of sRGB."""
        return self.transfer in _SRGB_LIKE and _PRIMARIES.get(self.primaries) == SRGB

    @property
    def name(self) -> str:
        """For a sentence."""
        curve = {8: "linear", 16: "PQ", 18: "HLG", 4: "gamma 2.2", 5: "gamma 2.8"}
        parts = (_NAMES.get(self.primaries), curve.get(self.transfer))
        return ", ".join(part for part in parts if part) or f"code points {tuple(self)}"


def light_of_code_points(codes: NDArray[np.unsignedinteger], points: CodePoints) -> NDArray[Any]:
    """Linear light with the primaries of sRGB, float32, 0 and more, of codes (y, x, 1 or 3).

    Diffuse white is 1, and what is brighter in HDR (PQ, HLG) is more.
    """
    curve = _CURVES.get(points.transfer, light_of_srgb)
    light = np.empty(codes.shape, np.float32)
    for top in range(0, len(codes), _ROWS):
        encoded = codes[top : top + _ROWS] / float(np.iinfo(codes.dtype).max)
        light[top : top + _ROWS] = in_srgb(curve(encoded), _PRIMARIES[points.primaries])
    return light


def in_srgb(light: NDArray[np.floating], primaries: Primaries) -> NDArray[np.float32]:
    """Linear RGB (y, x, 1 or 3) of other primaries in those of sRGB, 0 and more; another white
    becomes that of sRGB (Bradford). Raises ValueError for primaries that span no colours."""
    if light.shape[2] == 1:
        return light.astype(np.float32)
    return np.maximum(space_of(primaries).converted(light).astype(np.float32), 0)


def rgb_of_lab(lab: NDArray[np.floating]) -> NDArray[np.float32]:
    """Linear RGB (y, x, 3) in [0, 1] with the primaries of sRGB, of CIE L*, a*, b* (y, x, 3) under
    D50, whose white becomes that of sRGB (Bradford)."""
    fy = (lab[..., 0] + 16) / 116
    f = np.stack([fy + lab[..., 1] / 500, fy, fy - lab[..., 2] / 200], axis=-1)
    share = np.where(f > 6 / 29, f**3, (f - 4 / 29) * 3 * (6 / 29) ** 2)
    x, y, _ = np.array(_D50) / sum(_D50)
    return np.clip(share * _D50 @ srgb_of_xyz((x, y)).T, 0, 1).astype(np.float32)


def _pq(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """ITU-R BT.2100, table 4: the display's light."""
    root = encoded ** (32 / 2523)
    above = np.maximum(root - 3424 / 4096, 0)
    return 10000 / _WHITE * (above / (2413 / 128 - 2392 / 128 * root)) ** (16384 / 2610)


def _hlg(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """ITU-R BT.2100, table 5: the light of a display of 1000 candela per square metre."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    scene = np.where(encoded <= 0.5, encoded**2 / 3, (np.exp((encoded - c) / a) + b) / 12)
    weights = [1.0] if encoded.shape[2] == 1 else [0.2627, 0.6780, 0.0593]
    return 1000 / _WHITE * (scene @ np.array(weights))[..., None] ** 0.2 * scene


_CURVES = {
    4: lambda encoded: encoded**2.2,
    5: lambda encoded: encoded**2.8,
    8: lambda encoded: encoded,
    16: _pq,
    18: _hlg,
}
