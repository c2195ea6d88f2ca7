"""Photographs of material databases as EXR: what their channels are."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.database_files import (
    PAIRS,
    SRGB_OF_XYZ,
    Writer,
    case,
    is_light,
    radiance,
    read_database,
    utia,
)

_SRGB = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
_XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
_ACESCG = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
_SRGB_OF_ACESCG = np.array(
    [[1.705051, -0.621792, -0.083258], [-0.130256, 1.140804, -0.010548],
     [-0.024003, -0.128968, 1.152971]]
)  # fmt: skip
"""Published with ACES, adapted after Bradford."""


def _exr(
    names: Sequence[str], types: Any = np.float16, stored: NDArray[Any] | None = None, **header: Any
) -> Writer:
    """A folder of EXR by OpenEXR; the last channel again for every further name."""

    def write(path: Path) -> None:
        import OpenEXR

        values = radiance() if stored is None else stored
        for (light, view), image in zip(PAIRS, values, strict=True):
            file = path / f"{utia(light, view)}.exr"
            file.parent.mkdir(parents=True, exist_ok=True)
            channels = {
                name: np.ascontiguousarray(image[..., min(k, 2)]).astype(types)
                for k, name in enumerate(names)
            }
            compression = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
            OpenEXR.File(compression | header, channels).write(str(file))

    return write


def _half(values: NDArray[Any]) -> NDArray[np.float64]:
    return values.astype(np.float16).astype(np.float64)


_IN_XYZ = radiance() @ np.linalg.inv(SRGB_OF_XYZ).T
_FROM_XYZ = is_light(_half(_IN_XYZ) @ SRGB_OF_XYZ.T, 1e-4)
_STRONG = radiance() * [1.0, 0.05, 0.02]
_AS_STORED = is_light(_half(radiance()))


def _mixed(path: Path) -> None:
    _exr("RGB", np.float16, chromaticities=_SRGB)(path)
    _exr("RGB", np.float32, chromaticities=_SRGB)(path.parent / "floats")
    name = utia(*PAIRS[0]) + ".exr"
    (path.parent / "floats" / name).replace(path / name)


def _half_and_float() -> NDArray[np.float64]:
    expected = _half(radiance())
    expected[0] = radiance()[0]
    return expected


CASES: tuple[Case, ...] = (
    case("exr_xyz", "EXR in CIE XYZ", _exr("XYZ", stored=_IN_XYZ), _FROM_XYZ),
    case(
        "exr_rgb_is_xyz",
        "EXR in CIE XYZ",
        _exr("RGB", stored=_IN_XYZ, chromaticities=_XYZ),
        _FROM_XYZ,
    ),
    case(
        "exr_rgb_unsaid",
        "EXR that do not say what R, G, B are",
        _exr("RGB", stored=_IN_XYZ),
        _FROM_XYZ,
        [r"taken as CIE XYZ, as UTIA", r"set exr_colours to rgb"],
    ),
    case(
        "exr_rgb_unsaid_strong",
        "EXR that do not say what R, G, B are",
        _exr("RGB", stored=_STRONG),
        is_light(_half(_STRONG)),
        [r"taken as linear sRGB, as no colours", r"set exr_colours to xyz"],
    ),
    case(
        "exr_rgb_by_setting",
        "EXR by the setting",
        _exr("RGB"),
        _AS_STORED,
        read=functools.partial(read_database, exr_colours="rgb"),
    ),
    case(
        "exr_xyz_by_setting",
        "EXR by the setting",
        _exr("RGB", stored=_IN_XYZ, chromaticities=_SRGB),
        _FROM_XYZ,
        read=functools.partial(read_database, exr_colours="xyz"),
    ),
    case("exr_srgb", "EXR in sRGB", _exr("RGB", chromaticities=_SRGB), _AS_STORED),
    case("exr_lower_case", "EXR in sRGB", _exr("rgb", chromaticities=_SRGB), _AS_STORED),
    case(
        "exr_float",
        "EXR in sRGB",
        _exr("RGB", np.float32, chromaticities=_SRGB),
        is_light(radiance()),
    ),
    case("exr_half_and_float", "EXR in sRGB", _mixed, is_light(_half_and_float())),
    case(
        "exr_acescg",
        "EXR in another space",
        _exr("RGB", chromaticities=_ACESCG),
        is_light(_half(radiance()) @ _SRGB_OF_ACESCG.T, 3e-4),
    ),
    case(
        "exr_alpha_and_depth",
        "EXR with more channels",
        _exr(["R", "G", "B", "A", "Z"], chromaticities=_SRGB),
        _AS_STORED,
        [r"Other channels were left out: A, Z"],
    ),
    case(
        "exr_spectral",
        "EXR of other channels",
        _exr(["400nm", "500nm", "600nm"]),
        says=[r"400nm, 500nm, 600nm", r"save the picture's layer alone, spectra as RGB"],
    ),
    case(
        "exr_unsigned",
        "EXR of other channels",
        _exr("RGB", np.uint32),
        says=[r"unsigned", r"save them as half"],
    ),
    case(
        "exr_infinite",
        "values that are none",
        _exr("RGB", stored=np.where(radiance() < 2.9, radiance(), np.inf), chromaticities=_SRGB),
        says=[r"is inf", r"leave the pixel out by a crop"],
    ),
)
