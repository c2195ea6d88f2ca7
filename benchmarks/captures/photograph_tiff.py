"""Photographs in TIFF: layouts, depths, compressions, pages, and what else lies in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.photograph_files import (
    HEIGHT,
    WIDTH,
    Writer,
    is_light,
    light_of,
    noise,
    photo_case,
    save_tiff,
    slope,
    stored_as,
    thrice,
    tiff,
)

_PLAIN, _DEEP, _GREY = noise(), noise(np.uint16), noise(channels=1)
_LAYOUT = "TIFF: planes, tiles, byte orders"
_PACKED = "TIFF: compressions and predictors"
_BITS = "TIFF: any number of bits"
_FLOATS = "TIFF: half and double floats"
_ALPHA = "TIFF: alpha, and channels that are none"
_PAGES = "TIFF: several pages"
_REFUSED = "TIFF that holds no plain light"


# ---- layouts and compressions ------------------------------------------------------------------

_planes = np.moveaxis(_PLAIN, -1, 0)
_LAYOUTS = (
    photo_case(
        "planes.tif", _LAYOUT, is_light(light_of(_PLAIN)), save_tiff(_planes, planarconfig=2)
    ),
    photo_case(
        "planes_tiles.tif",
        _LAYOUT,
        is_light(light_of(_PLAIN)),
        save_tiff(_planes, planarconfig=2, tile=(32, 16), compression="zlib"),
    ),
    photo_case(
        "tiles_big_endian.tif",
        _LAYOUT,
        is_light(light_of(_DEEP)),
        save_tiff(_DEEP, tile=(16, 48), byteorder=">"),
    ),
    photo_case("bigtiff.tif", _LAYOUT, is_light(light_of(_DEEP)), save_tiff(_DEEP, bigtiff=True)),
    photo_case("strips.tif", _LAYOUT, is_light(light_of(_DEEP)), save_tiff(_DEEP, rowsperstrip=5)),
    *(
        photo_case(
            f"{name}.tif",
            _PACKED,
            is_light(light_of(_DEEP)),
            save_tiff(_DEEP, compression=name, predictor=predictor),
        )
        for name, predictor in (
            ("lzw", True),
            ("zlib", True),
            ("packbits", False),
            ("lzma", False),
            ("zstd", True),
        )
    ),
    photo_case(
        "float_predictor.tif",
        _PACKED,
        is_light(noise(np.float32)),
        save_tiff(noise(np.float32), compression="zlib", predictor=3),
    ),
    photo_case(
        "jpeg_in_tiff.tif",
        _PACKED,
        is_light(light_of(slope()), 0.02),
        save_tiff(slope(), compression="jpeg", compressionargs={"level": 98}),
    ),
    *(
        photo_case(
            f"{name}_in_tiff.tif",
            "TIFF: compressions that unfold to anything",
            None,
            save_tiff(_PLAIN, compression=name),
            name,
            "save it again",
            ends="refused",
        )
        for name in ("webp", "jpegxl", "lerc")
    ),
)


# ---- samples -----------------------------------------------------------------------------------


def _packed(codes: NDArray[Any], bits: int) -> Writer:
    """Grey or RGB samples of any number of bits, rows padded to whole bytes."""
    planes = (codes[..., None] >> np.arange(bits)[::-1].astype(codes.dtype)) & 1
    rows = np.packbits(planes.reshape(len(codes), -1).astype(np.uint8), axis=1)
    colour = 2 if codes.shape[2] == 3 else 1
    tags: dict[int, tuple[int, list[int]]] = {
        257: (4, [codes.shape[0]]),
        256: (4, [codes.shape[1]]),
        258: (3, [bits] * codes.shape[2]),
        262: (3, [colour]),
        277: (3, [codes.shape[2]]),
    }
    return lambda path: path.write_bytes(tiff(rows[..., None], tags))


def _bits_case(bits: int, channels: int) -> Case:
    codes = noise(np.uint16, channels, bits)
    right = is_light(light_of(codes, (1 << bits) - 1), 2e-3 if bits < 8 else 2e-5)
    name = f"bits_{bits}_{'rgb' if channels == 3 else 'grey'}.tif"
    return photo_case(name, _BITS, right, _packed(codes, bits))


def _palette(scale: int) -> Writer:
    colours = np.random.default_rng(5).integers(0, 256, (3, 256)) * scale
    tags: dict[int, tuple[int, list[int]]] = {
        258: (3, [8]),
        262: (3, [3]),
        320: (3, colours.ravel().tolist()),
    }
    return lambda path: path.write_bytes(tiff(_GREY, tags))


_BY_PALETTE = light_of(np.random.default_rng(5).integers(0, 256, (3, 256)).T[_GREY[..., 0]], 255)
_SAMPLES = (
    *(_bits_case(bits, channels) for bits, channels in ((1, 1), (2, 1), (4, 1), (10, 3), (12, 3))),
    photo_case(
        "uint32.tif",
        _BITS,
        is_light(light_of(noise(np.uint32)), 2e-5),
        save_tiff(noise(np.uint32)),
    ),
    photo_case("palette.tif", "TIFF: palettes", is_light(_BY_PALETTE, 1e-6), _palette(257)),
    photo_case("palette_of_bytes.tif", "TIFF: palettes", is_light(_BY_PALETTE, 1e-6), _palette(1)),
    photo_case(
        "white_is_zero.tif",
        "TIFF: white is zero",
        is_light(light_of(65535 - noise(np.uint16, 1))),
        save_tiff(noise(np.uint16, 1)[..., 0], photometric="miniswhite"),
    ),
    photo_case(
        "half.tif", _FLOATS, is_light(noise(np.float16), 1e-7), save_tiff(noise(np.float16))
    ),
    photo_case(
        "half_grey.tif",
        _FLOATS,
        is_light(thrice(noise(np.float16, 1))),
        save_tiff(noise(np.float16, 1)[..., 0], photometric="minisblack"),
    ),
    photo_case("double.tif", _FLOATS, is_light(noise(np.float64)), save_tiff(noise(np.float64))),
    photo_case(
        "ycbcr.tif",
        "TIFF: luminance and colour differences",
        is_light(light_of(slope()), 0.03),
        lambda path: _save_ycbcr(path),
    ),
)


def _save_ycbcr(path: Path) -> None:
    """Without compression; CCIR 601 as in TIFF 6.0, section 21."""
    rgb = slope().astype(float)
    y = rgb @ [0.299, 0.587, 0.114]
    cb, cr = (rgb[..., 2] - y) / 1.772 + 128, (rgb[..., 0] - y) / 1.402 + 128
    codes = np.rint(np.dstack([y, cb, cr])).astype(np.uint8)
    tags: dict[int, tuple[int, list[int]]] = {
        258: (3, [8, 8, 8]),
        262: (3, [6]),
        530: (3, [1, 1]),
    }
    path.write_bytes(tiff(codes, tags))


# ---- alpha, pages, other contents --------------------------------------------------------------

_alpha = np.zeros((HEIGHT, WIDTH), np.uint16)
_alpha[10:, 5:40] = 65535
_alpha[:10] = 40000
_opaque = _alpha >= 32768
_associated = np.rint(_DEEP * (_alpha / 65535)[..., None]).astype(np.uint16)


def _pages(path: Path, *pages: tuple[NDArray[Any], dict[str, Any]]) -> None:
    import tifffile

    with tifffile.TiffWriter(path) as writer:
        for values, options in pages:
            writer.write(values, **{"photometric": "rgb"} | options)


def _preview() -> NDArray[np.uint8]:
    return np.full((16, 16, 3), 99, np.uint8)


_CONTENTS = (
    photo_case(
        "alpha_straight.tif",
        _ALPHA,
        is_light(light_of(_DEEP), opaque=_opaque),
        save_tiff(np.dstack([_DEEP, _alpha]), extrasamples=["unassalpha"]),
        "transparent and were left out",
        "partly transparent",
    ),
    photo_case(
        "alpha_associated.tif",
        _ALPHA,
        is_light(light_of(_DEEP), 1e-4, opaque=_opaque),
        save_tiff(np.dstack([_associated, _alpha]), extrasamples=["assocalpha"]),
        "transparent and were left out",
    ),
    photo_case(
        "alpha_grey.tif",
        _ALPHA,
        is_light(light_of(_DEEP[..., :1]), opaque=_opaque),
        save_tiff(
            np.dstack([_DEEP[..., :1], _alpha]),
            photometric="minisblack",
            planarconfig="contig",
            extrasamples=["unassalpha"],
        ),
        "transparent",
    ),
    photo_case(
        "channel_unspecified.tif",
        _ALPHA,
        is_light(light_of(_DEEP)),
        save_tiff(np.dstack([_DEEP, _alpha]), extrasamples=["unspecified"]),
        "1 extra channel",
    ),
    photo_case(
        "spot_inks.tif",
        _ALPHA,
        is_light(light_of(_PLAIN)),
        save_tiff(np.dstack([_PLAIN, _PLAIN]), extrasamples=["unspecified"] * 3),
        "3 extra channels",
    ),
    photo_case(
        "photoshop_layers.tif",
        "TIFF: layers of Photoshop",
        is_light(light_of(_PLAIN)),
        save_tiff(_PLAIN, extratags=[(37724, 7, None, b"Adobe Photoshop Document Data", True)]),
        "layers of Photoshop",
    ),
    photo_case(
        "pages.tif",
        _PAGES,
        is_light(light_of(_PLAIN)),
        lambda path: _pages(path, (_PLAIN, {}), (255 - _PLAIN, {}), (_PLAIN // 2, {})),
        "first of 3 pages",
    ),
    photo_case(
        "preview_last.tif",
        "TIFF: previews beside the picture",
        is_light(light_of(_PLAIN)),
        lambda path: _pages(path, (_PLAIN, {}), (_preview(), {"subfiletype": 1})),
    ),
    photo_case(
        "preview_first.tif",
        "TIFF: previews beside the picture",
        is_light(light_of(_PLAIN)),
        lambda path: _pages(path, (_preview(), {"subfiletype": 1}), (_PLAIN, {})),
    ),
    photo_case(
        "page_below.tif",
        _PAGES,
        is_light(light_of(_PLAIN)),
        lambda path: _save_below(path),
        "pages below",
    ),
    photo_case(
        "imagej_stack.tif",
        _PAGES,
        is_light(light_of(_GREY)),
        lambda path: _save_imagej(path),
        "first of 4 pages",
    ),
    *(
        photo_case(
            f"turned_{orientation}.tif",
            "turned upright: TIFF",
            is_light(light_of(_DEEP)),
            save_tiff(stored_as(_DEEP, orientation), extratags=[(274, 3, 1, orientation, True)]),
        )
        for orientation in (2, 5, 6, 7)
    ),
)


def _save_below(path: Path) -> None:
    import tifffile

    with tifffile.TiffWriter(path) as writer:
        writer.write(_PLAIN, photometric="rgb", subifds=1)
        writer.write(_PLAIN[::2, ::2], photometric="rgb", subfiletype=0)


def _save_imagej(path: Path) -> None:
    import tifffile

    tifffile.imwrite(path, np.stack([_GREY[..., 0]] + [_GREY[..., 0] // 2] * 3), imagej=True)


_Tags = dict[int, tuple[int, list[int]]]
_DNG: _Tags = {258: (3, [16]), 262: (3, [32803]), 50706: (1, [1, 4, 0, 0])}
_REFUSALS = (
    photo_case(
        "sensor.dng",
        "camera raw",
        None,
        lambda path: path.write_bytes(tiff(noise(np.uint16, 1), _DNG)),
        "camera's raw file",
        "export it as a 16-bit TIFF",
        ends="refused",
    ),
    photo_case(
        "sensor_below.nef",
        "camera raw",
        None,
        lambda path: _save_nef(path),
        "camera's raw file",
        "export it as a 16-bit TIFF",
        ends="refused",
    ),
    photo_case(
        "signed.tif",
        _REFUSED,
        None,
        save_tiff(noise(np.int16)),
        "int16",
        "save it again",
        ends="refused",
    ),
    photo_case(
        "uint64.tif", _REFUSED, None, save_tiff(noise(np.uint64)), "save it again", ends="refused"
    ),
    photo_case(
        "complex.tif",
        _REFUSED,
        None,
        save_tiff(noise(np.float32).astype(np.complex64)[..., 0], photometric="minisblack"),
        "complex64",
        "save it again",
        ends="refused",
    ),
    photo_case(
        "logluv.tif",
        _REFUSED,
        None,
        lambda path: path.write_bytes(tiff(_DEEP, {258: (3, [16] * 3), 262: (3, [32845])})),
        "LOGLUV",
        "save it again",
        ends="refused",
    ),
    photo_case(
        "volume.tif",
        _REFUSED,
        None,
        save_tiff(
            np.stack([_PLAIN] * 16)[..., 0],
            photometric="minisblack",
            volumetric=True,
            tile=(16, 16, 16),
        ),
        "16 pictures in one",
        "save it again",
        ends="refused",
    ),
)


def _save_nef(path: Path) -> None:
    """A preview, with the sensor's values in a page below."""
    import tifffile

    with tifffile.TiffWriter(path) as writer:
        writer.write(_PLAIN, photometric="rgb", subifds=1, subfiletype=1)
        writer.write(noise(np.uint16, 1)[..., 0], photometric="cfa", subfiletype=0)


CASES = (*_LAYOUTS, *_SAMPLES, *_CONTENTS, *_REFUSALS)
