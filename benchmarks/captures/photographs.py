"""Photographs: those that were met, values that are no light, what is refused, and all others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures import (
    photograph_codecs,
    photograph_colours,
    photograph_formats,
    photograph_inks,
    photograph_tiff,
)
from benchmarks.captures.case import FILES, Case, Ending
from benchmarks.captures.photograph_files import (
    ADOBE_RGB,
    HEIGHT,
    WIDTH,
    Right,
    Writer,
    in_srgb,
    is_light,
    light_of,
    noise,
    save_png,
    save_tiff,
)
from storage.readers.photographs import read_photograph

# ---- met as files: one picture, of which the BMP holds the codes ---------------------------------


def _codes() -> NDArray[np.uint8]:
    """The pixels of the BMP: 24 bits, bottom up, rows without padding."""
    data = (FILES / "photo.bmp").read_bytes()
    pixels = np.frombuffer(data, np.uint8, 256 * 256 * 3, int.from_bytes(data[10:14], "little"))
    return pixels.reshape(256, 256, 3)[::-1, :, ::-1]


def _like(atol: float, mean: float, change: Any = None) -> Right:
    """Whether a reading is the picture, at each pixel and on average; ``change`` of its light."""

    def right(found: Any) -> bool:
        light = light_of(_codes())
        step = np.abs(found.radiance - (light if change is None else change(light)))
        return bool(step.max() <= atol and step.mean() <= mean and found.opaque is None)

    return right


def _adobe_rgb(light: NDArray[Any]) -> NDArray[Any]:
    """The codes with Adobe RGB's curve and primaries."""
    return np.clip(in_srgb((_codes() / 255) ** (563 / 256), ADOBE_RGB), 0, 1)


def _cut_out(found: Any) -> bool:
    """The left 20 columns are transparent."""
    opaque = np.ones((256, 256), bool)
    opaque[:, :20] = False
    return is_light(light_of(_codes()), opaque=opaque)(found)


def _met(file: str, kind: str, ends: Ending, right: Right, *says: str) -> Case:
    return Case(file, kind, read_photograph, ends, says, right)


_MET = (
    _met("photo.bmp", "BMP", "read", _like(1e-6, 1e-6)),
    _met("photo.webp", "WebP", "read", _like(0.3, 0.04)),
    _met("photo.avif", "AVIF", "read", _like(0.3, 0.04)),
    _met("photo.gif", "GIF", "read", _like(0.03, 1e-3)),
    _met("photo_16bit_planar.tif", "TIFF: planes, tiles, byte orders", "read", _like(1e-6, 1e-6)),
    _met(
        "photo_half_float.tif",
        "TIFF: half and double floats",
        "read",
        _like(5e-4, 5e-4, lambda _: _codes() / 255),
    ),
    _met("photo_cmyk.jpg", "inks (CMYK)", "told", _like(0.2, 0.02), "plain formula"),
    _met(
        "photo_16bit_adobergb.tif",
        "16 bits with a profile",
        "told",
        _like(2e-3, 1e-3, _adobe_rgb),
        "Adobe RGB",
    ),
    _met("photo_cutout_alpha.png", "a cut-out by alpha", "told", _cut_out, "7.81 % of the pixels"),
)

# ---- values that are no light --------------------------------------------------------------------

_LIGHT: NDArray[np.float32] = (noise(np.float32) / 4).astype(np.float32)


def _with(value: float, *places: tuple[int, int]) -> NDArray[np.float32]:
    light: NDArray[np.float32] = _LIGHT.copy()
    for row, column in places:
        light[row, column, 1] = value
    return light


def _exr(channels: dict[str, NDArray[Any]]) -> Writer:
    def write(path: Path) -> None:
        import OpenEXR

        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        whole = {name: np.ascontiguousarray(values) for name, values in channels.items()}
        with OpenEXR.File(header, whole) as file:
            file.write(str(path))

    return write


def _mended(*places: tuple[int, int]) -> Right:
    """Whether all is as it was, but for pixels that became like one beside them."""

    def right(found: Any) -> bool:
        light = _LIGHT.copy()
        for row, column in places:
            around = found.radiance[row - 1 : row + 2, column - 1 : column + 2].reshape(9, 3)
            if not (np.delete(around, 4, axis=0) == around[4]).all(axis=1).any():
                return False
            light[row, column] = around[4]
        return bool((found.radiance == light).all())

    return right


_alpha = np.zeros((HEIGHT, WIDTH), np.float32)
_alpha[10:, 5:40] = 1
_alpha[10:, 38:40] = 0.75  # a soft rim
_VALUES = (
    Case(
        "photo_tiny_negative.tif",
        "light a little below 0",
        read_photograph,
        "told",
        ["2 pixels were negative and became 0"],
        is_light(_with(0, (3, 4), (9, 60))),
        save_tiff(_with(-1e-4, (3, 4), (9, 60))),
    ),
    Case(
        "photo_single_nan.tif",
        "single values that are no number",
        read_photograph,
        "told",
        ["1 pixel was no number"],
        _mended((7, 5)),
        save_tiff(_with(np.nan, (7, 5))),
    ),
    Case(
        "photo_infinite.exr",
        "single values that are infinite",
        read_photograph,
        "told",
        ["1 .* 65504"],
        is_light(_with(65504, (7, 5)), 1e-2),
        _exr({"RGB": _with(np.inf, (7, 5))}),
    ),
    Case(
        "photo_many_nan.tif",
        "light that is no number",
        read_photograph,
        "refused",
        ["not finite, first at column 0, row 0", "save it anew"],
        None,
        save_tiff(_with(np.nan, *((0, column) for column in range(WIDTH)))),
    ),
    Case(
        "photo_difference.tif",
        "a difference of pictures",
        read_photograph,
        "refused",
        ["negative in", "save a photograph"],
        None,
        save_tiff(_LIGHT - np.float32(0.5)),
    ),
    Case(
        "photo_bright.exr",
        "light above 1",
        read_photograph,
        "read",
        (),
        is_light(noise(np.float16)),
        _exr({"RGB": noise(np.float16)}),
    ),
    Case(
        "photo_associated.exr",
        "EXR: colours multiplied with alpha",
        read_photograph,
        "told",
        ["transparent and were left out", "partly transparent"],
        is_light(_LIGHT, 1e-5, opaque=_alpha >= 0.5),
        _exr({"RGBA": np.dstack([_LIGHT * _alpha[..., None], _alpha])}),
    ),
)

# ---- what is refused -----------------------------------------------------------------------------

_EXPORT = "export it as a 16-bit TIFF"
_NAMED = (
    ("live.heic", "HEIC", b"\0\0\0\x28ftypheic\0\0\0\0mif1MiHE", "HEIC"),
    ("as_jpeg_named.jpg", "HEIC", b"\0\0\0\x24ftypmif1\0\0\0\0mif1heic", "HEIC"),
    ("canon.cr3", "camera raw", b"\0\0\0\x18ftypcrx \0\0\0\1crx isom", "raw file"),
    ("canon.cr2", "camera raw", None, "raw file"),
    ("fuji.raf", "camera raw", b"FUJIFILMCCD-RAW 0201FF389501", "raw file"),
    ("olympus.orf", "camera raw", b"IIRO\x08\0\0\0", "raw file"),
    ("panasonic.rw2", "camera raw", b"IIU\0\x18\0\0\0", "raw file"),
    ("film.mov", "other formats by their name", b"\0\0\0\x14ftypqt  \0\0\0\0qt  ", "film"),
    ("layers.psd", "other formats by their name", b"8BPS\0\1" + bytes(20), "Photoshop"),
    ("layers.xcf", "other formats by their name", b"gimp xcf v011\0", "GIMP"),
    ("photo.jxl", "other formats by their name", b"\xff\x0a\xfa\x1f\x01", "JPEG XL"),
    ("probe.hdr", "other formats by their name", b"#?RADIANCE\n", "Radiance"),
    ("page.pdf", "other formats by their name", b"%PDF-1.7\n", "PDF"),
    ("drawing.svg", "other formats by their name", b"<svg xmlns=''/>", "SVG"),
    ("plain.ppm", "other formats by their name", b"P6 64 64 255\n", "PNM"),
)


def _save_bytes(data: bytes | None) -> Writer:
    cr2 = b"II*\0\x10\0\0\0CR\2\0" + bytes(4)  # and the first page
    cr2 += b"\x01\0" + b"\0\x01\x04\0\1\0\0\0\x40\0\0\0" + bytes(4)
    return lambda path: path.write_bytes(cr2 if data is None else data.ljust(400, b"\0"))


def _refused(name: str, kind: str, write: Writer, *says: str) -> Case:
    return Case(f"photo_{name}", kind, read_photograph, "refused", says, None, write)


_REFUSED = (
    *(_refused(name, kind, _save_bytes(data), said, _EXPORT) for name, kind, data, said in _NAMED),
    _refused(
        "small.png",
        "too small",
        save_png(noise()[:40, :40], 2),
        "width is 40 pixels",
        "at least 64 pixels",
    ),
    _refused(
        "one_colour.png",
        "nothing to see",
        save_png(np.full((70, 70, 3), 90, np.uint8), 2),
        "all of one colour",
        "light and dark",
    ),
    _refused(
        "black.png",
        "nothing to see",
        save_png(np.zeros((70, 70, 3), np.uint16), 2),
        "all black",
        "light and dark",
    ),
)

CASES = (
    *_MET,
    *_VALUES,
    *photograph_colours.CASES,
    *photograph_inks.CASES,
    *photograph_tiff.CASES,
    *photograph_formats.CASES,
    *photograph_codecs.CASES,
    *_REFUSED,
)
