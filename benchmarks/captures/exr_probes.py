"""Light probes as OpenEXR files: how pixels are stored, and which channels are the picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.captures.case import FILES, Case
from benchmarks.captures.probe_files import (
    HEIGHT,
    WIDTH,
    converted,
    equals,
    exr,
    exr_parts,
    light,
    luminance_chroma,
    met,
    probe,
    rgb,
    saved,
    window,
)

_FLAT = np.full((HEIGHT, WIDTH), 0.25, np.float16)
_DIM = light() / 2

# --- Files that were met ------------------------------------------------------------------------


def _met_without_the_negative(found: Any) -> bool:
    """One blue value of the file is -1e-4."""
    import OpenEXR

    with OpenEXR.File(str(FILES / "exr_tiny_negative.exr"), separate_channels=True) as file:
        blue = np.array(file.channels()["B"].pixels)
    expected = met()
    expected[..., 2][blue < 0] = 0
    return bool((blue < 0).sum() == 1) and equals(expected)(found)


_MET = (
    probe(
        "exr_acescg.exr",
        "wide-gamut primaries",
        None,
        "told",
        ["converted from ACEScg"],
        equals(converted("ACEScg", met()), 1e-5),
    ),
    probe("exr_alpha_0999.exr", "alpha", None, "told", ["alpha.* 2048 pixels"], equals(met())),
    probe("exr_blender_multilayer.exr", "a renderer's layers", None, is_right=equals(met())),
    probe(
        "exr_multipart_depth_first.exr",
        "the picture in a later part",
        None,
        "told",
        ["left out: depth"],
        equals(met()),
    ),
    probe(
        "exr_sun_inf_half.exr",
        "an infinite sun",
        None,
        "told",
        ["12 infinite values became 65504"],
        equals(met(65504.0, np.float16)),
    ),
    probe(
        "exr_tiny_negative.exr",
        "values below 0",
        None,
        "told",
        ["1 texel was negative .*-0.0001"],
        _met_without_the_negative,
    ),
)

# --- How the pixels are stored ------------------------------------------------------------------

_COMPRESSIONS = {
    **dict.fromkeys(("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "HTJ2K256", "ZSTD"), 0.0),
    **dict.fromkeys(("B44", "B44A", "DWAA", "DWAB"), 0.02),
}
"""And how far they may change a half, relatively."""


def _near(error: float) -> Callable[[Any], bool]:
    """Around the sun, codes of blocks spread what is lost of it."""

    def is_right(found: Any) -> bool:
        close = np.isclose(found.radiance, light(), rtol=error or 1e-6)
        return bool(close.mean() > (0.8 if error else 0.999999))

    return is_right


_STORED = (
    *(
        probe(
            f"{name.lower()}.exr",
            "compressions",
            exr(compression=f"{name}_COMPRESSION"),
            is_right=_near(error),
        )
        for name, error in _COMPRESSIONS.items()
    ),
    probe("float.exr", "halfs and floats", exr(rgb(dtype=np.float32))),
    probe(
        "mixed.exr",
        "halfs and floats",
        exr(rgb() | {"G": light()[..., 1].astype(np.float32)}),
    ),
    probe("bottom_up.exr", "other orders of lines", exr(lineOrder="DECREASING_Y")),
    probe(
        "offset.exr",
        "windows that begin elsewhere",
        exr(dataWindow=window(-7, 40, WIDTH, HEIGHT), displayWindow=window(-7, 40, WIDTH, HEIGHT)),
    ),
    probe(
        "codes.exr", "integers", exr(rgb(dtype=np.uint32)), "refused", ["unsigned", "half or float"]
    ),
    probe("named.hdr", "a name of another format", exr()),
)


def _tiled(path: Path) -> None:
    import OpenEXR

    exr(type="tiledimage", tiles=OpenEXR.TileDescription())(path)


def _deep(path: Path) -> None:
    import OpenEXR

    samples = np.empty((HEIGHT, WIDTH), object)
    for row, column in np.ndindex(samples.shape):
        samples[row, column] = np.array([0.5], np.float32)
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    with OpenEXR.File(header, dict.fromkeys("RGBA", samples)) as file:
        file.write(str(path))


def _cut(path: Path) -> None:
    exr()(path)
    path.write_bytes(path.read_bytes()[:-60])


_STORED += (
    probe("tiled.exr", "tiles", _tiled),
    probe("deep.exr", "deep pixels", _deep, "refused", ["deep", "flatten it in the compositor"]),
    probe("cut.exr", "truncated", _cut, "refused", ["truncated", "a complete EXR"]),
)

# --- Which channels are the picture -------------------------------------------------------------

_NAMES = {
    "lower": rgb(names="rgb"),
    "nuke": rgb("rgba.", ("red", "green", "blue")),
    "beauty": rgb("beauty."),
    "houdini": rgb("C.", "rgb"),
    "renderman": rgb("Ci.", "rgb"),
    "underscore": rgb("beauty_"),
    "natron": rgb("Color."),
}
_AOVS = rgb("diffuse.", values=_DIM) | rgb("N.", "XYZ", values=_DIM) | {"Z": _FLAT}
_VIEWS = {"multiView": ["right", "left"]}

_LAYERS = (
    *(
        probe(f"{name}.exr", "channels by other names", exr(names))
        for name, names in _NAMES.items()
    ),
    probe(
        "aovs.exr",
        "a renderer's layers",
        exr(rgb("beauty.") | _AOVS),
        "told",
        ["left out: .*diffuse", "N", "Z"],
    ),
    probe(
        "plain_aovs.exr", "a renderer's layers", exr(rgb() | _AOVS), "told", ["diffuse", "N", "Z"]
    ),
    probe(
        "composite.exr",
        "a renderer's layers",
        exr(rgb("Composite.Combined.") | rgb("ViewLayer.Combined.", values=_DIM)),
        "told",
        ["left out: ViewLayer.Combined"],
    ),
    probe("one_layer.exr", "one layer alone", exr(rgb("probe_v2.")), "told", ["layer 'probe_v2'"]),
    probe(
        "two_layers.exr",
        "layers without a picture",
        exr(rgb("diffuse.") | rgb("specular.")),
        "refused",
        ["layers is diffuse, specular", "save the beauty alone"],
    ),
    probe(
        "depth.exr",
        "layers without a picture",
        exr({"Z": _FLAT}),
        "refused",
        ["channels is Z", "save the picture's colours as R, G, B"],
    ),
    probe(
        "views.exr",
        "stereo",
        exr(rgb() | rgb("left.", values=_DIM), **_VIEWS),
        "told",
        ["left out: left"],
    ),
    probe(
        "view_parts.exr",
        "stereo",
        exr_parts(
            ("rgba_left", rgb(), {"view": "left"}),
            ("rgba_right", rgb(values=_DIM), {"view": "right"}),
        ),
        "told",
        ["left out: rgba_right"],
    ),
    probe(
        "parts.exr",
        "the picture in a later part",
        exr_parts(
            ("albedo", rgb(values=_DIM), {}),
            ("View Layer.Combined", rgb("View Layer.Combined."), {}),
        ),
        "told",
        ["left out: albedo"],
    ),
    probe(
        "repeated_part.exr",
        "the picture in a later part",
        exr_parts(("depth", {"Y": _FLAT}, {}), ("probe", rgb(), {})),
        "told",
        ["layer 'probe'", "left out: depth"],
    ),
)


# --- Grey, luminance and chroma -----------------------------------------------------------------


def _chroma_is_right(found: Any) -> bool:
    """Where chroma is stored colours are those that were; in between, luminance is."""
    weights = np.array([0.2126, 0.7152, 0.0722])
    stored = np.allclose(found.radiance[::2, ::2], light()[::2, ::2], rtol=4e-3)
    return bool(stored) and np.allclose(found.radiance @ weights, light() @ weights, rtol=4e-3)


_GREY = np.repeat(light()[..., :1], 3, axis=2)
_LUMINANCE = (
    probe(
        "luminance_chroma.exr",
        "luminance and chroma",
        saved(luminance_chroma),
        is_right=_chroma_is_right,
    ),
    probe(
        "grey.exr",
        "luminance alone",
        exr({"Y": light()[..., 0].astype("f2")}),
        is_right=equals(_GREY),
    ),
    probe(
        "grey_alpha.exr",
        "luminance alone",
        exr({"Y": light()[..., 0].astype("f2"), "A": _FLAT}),
        "told",
        ["alpha"],
        equals(_GREY),
    ),
)

CASES: tuple[Case, ...] = (*_MET, *_STORED, *_LAYERS, *_LUMINANCE)
