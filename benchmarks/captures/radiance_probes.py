"""Light probes as Radiance pictures: how pixels are stored, and what headers say."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.probe_files import (
    FORMAT,
    HEIGHT,
    WIDTH,
    by_channel,
    by_pixel,
    converted,
    equals,
    hdr,
    light,
    met,
    probe,
    radiance_of,
    rgbe,
    saved,
)


class _Photograph(NamedTuple):
    radiance: NDArray[np.float32]
    notes: tuple[str, ...]


def _read_photograph(path: Path) -> _Photograph:
    """As BTFs read a Radiance picture, of whatever size."""
    from storage.readers.pictures.radiance_files import radiance_header, radiance_pixels

    data = path.read_bytes()
    return _Photograph(radiance_pixels(path, data), radiance_header(path, data).notes)


# --- Files that were met ------------------------------------------------------------------------


def _met_as_rgbe() -> NDArray[Any]:
    """Mantissas of the largest channel's exponent, cut off."""
    picture = met()
    step = 2.0 ** (np.frexp(picture.max(axis=2, keepdims=True))[1] - 8)
    whole: NDArray[Any] = np.floor(picture / step) * step
    return whole


_MET = (
    probe("hdr_old_rle.hdr", "run lengths before 1991", None, "read", (), equals(_met_as_rgbe())),
    probe(
        "hdr_photoshop_primaries_zero.hdr",
        "primaries that are unset",
        None,
        "read",
        (),
        equals(_met_as_rgbe()),
    ),
    probe(
        "hdr_primaries_acescg.hdr",
        "wide-gamut primaries",
        None,
        "told",
        ["converted from ACEScg to linear sRGB"],
        equals(converted("ACEScg", _met_as_rgbe()), 1e-5),
    ),
)

# --- How the pixels are stored ------------------------------------------------------------------

_ORDERS: dict[str, Callable[[NDArray[Any]], NDArray[Any]]] = {
    f"-Y {HEIGHT} +X {WIDTH}": lambda a: a,
    f"-Y {HEIGHT} -X {WIDTH}": lambda a: a[:, ::-1],
    f"+Y {HEIGHT} +X {WIDTH}": lambda a: a[::-1],
    f"+Y {HEIGHT} -X {WIDTH}": lambda a: a[::-1, ::-1],
    f"+X {WIDTH} -Y {HEIGHT}": lambda a: a.swapaxes(0, 1),
    f"-X {WIDTH} -Y {HEIGHT}": lambda a: a[:, ::-1].swapaxes(0, 1),
    f"+X {WIDTH} +Y {HEIGHT}": lambda a: a[::-1].swapaxes(0, 1),
    f"-X {WIDTH} +Y {HEIGHT}": lambda a: a[::-1, ::-1].swapaxes(0, 1),
}
"""Where a pixel goes; the slow axis first (Radiance's ``resolu.h``)."""


def _long_runs() -> NDArray[np.uint8]:
    """A line longer than the newer code may be, with a run that takes two bytes of its count."""
    line = np.empty((2, 40_000, 4), np.uint8)
    line[0], line[1] = (200, 100, 50, 129), (50, 100, 200, 128)
    line[:, 39_000:] = (90, 80, 170, 130)
    return line


_STORED = (
    *(
        probe(
            f"order{number}.hdr",
            "scanlines in every order",
            hdr(size=size, pixels=b"".join(map(by_channel, turned(rgbe())))),
        )
        for number, (size, turned) in enumerate(_ORDERS.items())
    ),
    probe("flat.hdr", "flat pixels", hdr()),
    probe("flat_behind.hdr", "bytes behind the picture", hdr() + b"\0" * 37),
    probe(
        "runs_behind.hdr",
        "bytes behind the picture",
        hdr(pixels=b"".join(map(by_channel, rgbe())) + b"\n"),
    ),
    probe("pixels.hdr", "run lengths before 1991", hdr(pixels=b"".join(map(by_pixel, rgbe())))),
    probe(
        "mixed.hdr",
        "scanlines of several codes",
        hdr(
            pixels=b"".join(
                (by_channel, by_pixel, lambda line: line.tobytes())[row % 3](line)
                for row, line in enumerate(rgbe())
            )
        ),
    ),
    Case(
        "long.rgbe",
        "lines longer than the newer code",
        _read_photograph,
        "read",
        (),
        equals(radiance_of(_long_runs())),
        saved(hdr(size="-Y 2 +X 40000", pixels=b"".join(map(by_pixel, _long_runs())))),
    ),
    Case(
        "short.rgbe",
        "lines shorter than the newer code",
        _read_photograph,
        "read",
        (),
        equals(light()[:, :7]),
        saved(hdr(size=f"-Y {HEIGHT} +X 7", pixels=rgbe()[:, :7].tobytes())),
    ),
    probe(
        "cut.hdr",
        "truncated",
        hdr(pixels=b"".join(map(by_channel, rgbe()))[:-20]),
        "refused",
        ["truncated", "a complete Radiance"],
    ),
)

# --- What headers say ---------------------------------------------------------------------------

_CHROMATICITIES = {
    "Rec. 2020": "0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290",
    "Display P3": "0.680 0.320 0.265 0.690 0.150 0.060 0.3127 0.3290",
    "ACES2065-1": "0.7347 0.2653 0.0 1.0 0.0001 -0.077 0.32168 0.33767",
}
_RADIANCE_PRIMARIES = "0.640 0.330 0.290 0.600 0.150 0.060 0.3333 0.3333"
_RPICT = (
    "rpict -vtv -vp 0 0 0 -vd 0 1 0 -vu 0 0 1 -x 32 -y 16 room.oct",
    "\tpfilt -1 -x /2 -y /2",
    "SOFTWARE= RADIANCE 6.0a official release",
    "VIEW= -vta -vp 0 0 0 -vd 0 1 0 -vh 360 -vv 180",
    "CAPDATE= 2026:03:01 12:00:00",
    "GMT= 2026:03:01 11:00:00",
    "PIXASPECT=0.5",
)


def _neutral_stays(found: Any) -> bool:
    """A grey of Radiance's white is sRGB's grey; its green lies a little outside sRGB."""
    grey, green, black = found.radiance[0, 0], found.radiance[0, 1], found.radiance[1:]
    return bool(
        np.allclose(grey, 1, atol=1e-4)
        and green[0] == 0
        and np.allclose(green[1:], (0.993, 0.018), atol=2e-3)
        and not black.any()
    )


def _grey_and_green() -> bytes:
    pixels = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    pixels[0, 0], pixels[0, 1] = (128, 128, 128, 129), (0, 128, 0, 129)
    return pixels.tobytes()


_HEADERS = (
    probe("no_format.hdr", "a header without format", hdr(lines=[])),
    probe("rgbe.hdr", "other first lines", hdr(signature="#?RGBE")),
    probe("autopano.hdr", "other first lines", hdr(signature="#?AUTOPANO")),
    probe("no_first_line.hdr", "other first lines", hdr(signature="")),
    probe("crlf.hdr", "line ends of DOS", hdr(end="\r\n")),
    probe("no_gap.hdr", "no empty line", hdr(gap=0)),
    probe("gaps.hdr", "several empty lines", hdr(gap=3)),
    probe("spaces.hdr", "blanks", hdr([f" {FORMAT}  "], size=f" -Y  {HEIGHT}   +X {WIDTH}  ")),
    probe("rpict.hdr", "what Radiance's programs write", hdr([*_RPICT, FORMAT])),
    probe("gamma1.hdr", "a gamma", hdr(["GAMMA=1.0", FORMAT])),
    probe(
        "gamma.hdr",
        "a gamma",
        hdr(["GAMMA=2.2", FORMAT]),
        "told",
        [r"to the power of 2\.2"],
        equals(light() ** 2.2, 1e-5),
    ),
    probe(
        "exposures.hdr",
        "exposures",
        hdr(["EXPOSURE=4", FORMAT, "EXPOSURE= 0.5", "COLORCORR= 1 2 0.25"]),
        is_right=equals(light() / [2, 4, 0.5]),
    ),
    probe(
        "no_exposure.hdr",
        "an exposure that is none",
        hdr(["EXPOSURE=0", FORMAT]),
        "told",
        ["EXPOSURE='0' .* left out"],
    ),
    probe(
        "xyze.hdr",
        "CIE XYZ",
        hdr(["FORMAT=32-bit_rle_xyze"]),
        "told",
        ["converted from CIE XYZ"],
        equals(converted("XYZ"), 1e-5),
    ),
    *(
        probe(
            f"{space.split()[0].lower()}.hdr",
            "wide-gamut primaries",
            hdr([f"PRIMARIES={given}", FORMAT]),
            "told",
            [f"converted from {space}"],
            equals(converted(space), 1e-5),
        )
        for space, given in _CHROMATICITIES.items()
    ),
    probe(
        "radiance_primaries.hdr",
        "Radiance's own primaries",
        hdr([f"PRIMARIES= {_RADIANCE_PRIMARIES}", FORMAT], _grey_and_green()),
        "told",
        ["converted from Radiance's RGB", "negative"],
        _neutral_stays,
    ),
    probe(
        "srgb_primaries.hdr",
        "sRGB's primaries",
        hdr(["PRIMARIES=0.640 0.330 0.300 0.600 0.150 0.060 0.3127 0.329", FORMAT]),
    ),
    probe(
        "line_primaries.hdr",
        "primaries that span nothing",
        hdr(["PRIMARIES=0.3 0.3 0.3 0.3 0.3 0.3 0.3 0.3", FORMAT]),
        "refused",
        ["PRIMARIES is .*0.3", "without the line it is sRGB"],
    ),
    probe(
        "floats.hdr",
        "another pixel format",
        hdr(["FORMAT=96-bit_float"]),
        "refused",
        ["FORMAT is 96-bit_float", "32-bit_rle_rgbe or 32-bit_rle_xyze: save it"],
    ),
)

CASES: tuple[Case, ...] = (*_MET, *_STORED, *_HEADERS)
