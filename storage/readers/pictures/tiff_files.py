"""TIFF files: any layout, depth and compression that tifffile decodes, without loss.

Pillow reads what tifffile does not: luminance with subsampled colour, and fax codes.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.pictures.code_points import rgb_of_lab
from storage.readers.pictures.decoded_image import Space, StoredPicture, damaged, straight
from storage.readers.pictures.jpeg_files import frame_of
from storage.readers.pictures.picture_sizes import check_area
from storage.readers.pictures.pillow_pictures import as_alpha, load, stored_picture

if TYPE_CHECKING:
    import tifffile

_WHITE_IS_ZERO, _PALETTE, _INKS, _YCBCR, _LAB, _ICC_LAB = 0, 3, 5, 6, 8, 9
_COLOURS = {_WHITE_IS_ZERO: 1, 1: 1, 2: 3, _PALETTE: 1, _INKS: 4, _YCBCR: 3, _LAB: 3, _ICC_LAB: 3}
"""Samples of a pixel's colour by photometric interpretation."""
_RAW = (32803, 34892)  # photometric: a sensor's colour filters, linear raw
_DNG_VERSION, _PROFILE, _LAYERS, _ORIENTATION, _COLOUR_MAP = 50706, 34675, 37724, 274, 320
_JPEG = 7
_BY_PILLOW = (2, 3, 4, 6)  # fax codes, the old JPEG
_PACKED = {
    *(1, 5, 8, 32773, 32946),  # none, LZW, Deflate, PackBits
    *(34925, 34926, 50000),  # LZMA, Zstandard
}
"""Compressions that unfold to no more than the page announces."""
_ASSOCIATED, _UNASSOCIATED = 1, 2
_REDUCED, _MASK = 1, 4  # bits of the subfile type
_FRAME_WITHIN = 65536  # bytes of a JPEG, the header of its frame stands there
_MOST_PAGES = 100  # that are looked at
_WAY_OUT = "one of 8 or 16 bits, RGB or grey; save it again as such"


def read_tiff(file: Path) -> StoredPicture:
    """Read the first page of a TIFF file as it is stored. Raises BadInput, and nearly anything for
    what is damaged."""
    import tifffile

    with tifffile.TiffFile(file) as tiff:
        _refuse_raw(file, tiff.pages.first)
        page, page_notes = _whole_page(tiff)
        _check_complete(file, tiff, page)
        _check_size(file, page)
        _check_kind(file, page)
        _check_compression(file, tiff, page)
        notes = (*_left_out(page), *page_notes)
        if page.compression in _BY_PILLOW or (
            page.photometric == _YCBCR and page.compression != _JPEG
        ):
            return _with_pillow(file, notes)
        samples = _samples(file, page)
        profile = page.tags.get(_PROFILE)
        turned = page.tags.get(_ORIENTATION)
        return StoredPicture(
            samples.colours,
            samples.space,
            samples.alpha,
            bytes(profile.value) if profile and page.photometric not in (_LAB, _ICC_LAB) else None,
            turned.value if turned else 1,
            (*notes, *samples.notes),
        )


# --- What is looked at before it is decoded -----------------------------------------------------


def _refuse_raw(file: Path, page: tifffile.TiffPage) -> None:
    with file.open("rb") as stream:
        is_raw = stream.read(10)[8:] == b"CR" or _DNG_VERSION in page.tags
    is_raw |= any(each.photometric in _RAW for each in (page, *_pages_below(page)))
    if is_raw:
        raise BadInput(
            file,
            "format",
            "a camera's raw file",
            "a photograph developed from it; export it as a 16-bit TIFF or a JPEG",
        )


def _pages_below(page: tifffile.TiffPage) -> list[Any]:
    if not page.subifds:
        return []
    try:
        return list(page.pages or ())
    except Exception:  # a broken page below is no reason to refuse this one
        return []


def _check_complete(file: Path, tiff: tifffile.TiffFile, page: tifffile.TiffPage) -> None:
    """tifffile leaves out, with no more than a line in the log, tags whose values lie beyond the
    file's end, and fills segments that are not there with zeros."""
    ends = [a + b for a, b in zip(page.dataoffsets, page.databytecounts, strict=True)]
    tiff.filehandle.seek(page.offset)
    announced = struct.unpack(tiff.tiff.tagnoformat, tiff.filehandle.read(tiff.tiff.tagnosize))[0]
    complete = max(ends) <= file.stat().st_size and len(page.tags) == announced
    if page.is_contiguous:
        complete &= sum(page.databytecounts) >= page.nbytes
    else:
        complete &= len(ends) >= math.prod(page.chunked)
    if not complete or min(page.databytecounts) == 0:
        raise damaged(file, "TIFF")


def _check_size(file: Path, page: tifffile.TiffPage) -> None:
    pixel_bytes = (page.dtype.itemsize if page.dtype else 1) * max(page.samplesperpixel, 4)
    check_area(file, int(page.imagewidth), int(page.imagelength), pixel_bytes)
    if page.is_tiled:
        check_area(file, int(page.tilewidth), int(page.tilelength), pixel_bytes)
    if page.imagedepth != 1:
        raise BadInput(file, "depth", f"{page.imagedepth} pictures in one", _WAY_OUT)


def _check_kind(file: Path, page: tifffile.TiffPage) -> None:
    known = _COLOURS.get(int(page.photometric))
    name = str(getattr(page.photometric, "name", page.photometric))
    if known is None:
        raise BadInput(file, "colour space", name, _WAY_OUT)
    if page.samplesperpixel < known:
        raise BadInput(
            file, "samples per pixel", f"{page.samplesperpixel} of {name}", f"{known} or more"
        )
    kind = "unknown" if page.dtype is None else page.dtype.name
    is_known = kind in ("bool", "uint8", "uint16", "uint32", "float16", "float32", "float64")
    only_codes = page.photometric in (_PALETTE, _INKS, _YCBCR, _LAB, _ICC_LAB)
    if not is_known or (only_codes and kind not in ("bool", "uint8", "uint16")):
        found = f"{page.bitspersample} bit" if page.dtype is None else f"{kind} ({name})"
        raise BadInput(file, "sample type", found, f"unsigned integers or floats: {_WAY_OUT}")


def _check_compression(file: Path, tiff: tifffile.TiffFile, page: tifffile.TiffPage) -> None:
    """Raise BadInput for compressions that may unfold to anything, whatever the page announces."""
    name = str(getattr(page.compression, "name", page.compression))
    if page.compression != _JPEG:
        if page.compression not in (*_PACKED, *_BY_PILLOW):
            expected = "none, LZW, Deflate, PackBits, LZMA, Zstandard or JPEG; save it again"
            raise BadInput(file, "compression", name, expected)
        return
    rows, columns = min(page.rowsperstrip, page.imagelength), page.imagewidth
    if page.is_tiled:
        rows, columns = page.tilelength, page.tilewidth
    most = 2 * rows * columns + 65536
    for begin, count in zip(page.dataoffsets, page.databytecounts, strict=True):
        tiff.filehandle.seek(begin)
        start = tiff.filehandle.read(min(count, _FRAME_WITHIN))
        frame = frame_of(start)
        if frame is None or frame.width * frame.height > most:
            raise damaged(file, "TIFF")


def _left_out(page: tifffile.TiffPage) -> list[str]:
    notes = []
    if _LAYERS in page.tags:
        notes.append("Layers of Photoshop were left out: the flattened picture was read.")
    if any(not below.subfiletype & (_REDUCED | _MASK) for below in _pages_below(page)):
        notes.append("Pages below the first were left out.")
    extra = page.samplesperpixel - _COLOURS[int(page.photometric)]
    alphas = sum(kind in (_ASSOCIATED, _UNASSOCIATED) for kind in page.extrasamples[:1])
    if extra > alphas:
        are = (
            "1 extra channel was"
            if extra - alphas == 1
            else f"{extra - alphas} extra channels were"
        )
        notes.append(f"{are} left out, as none is said to be transparency.")
    return notes


def _whole_page(tiff: tifffile.TiffFile) -> tuple[tifffile.TiffPage, list[str]]:
    """The first page that is no preview and no mask, and what is to be said of others like it."""
    try:
        count = len(tiff.pages)
        pages: list[Any] = [tiff.pages.get(index) for index in range(min(count, _MOST_PAGES))]
    except Exception:  # of a page behind the first
        return tiff.pages.first, ["Pages behind the first are damaged and were left out."]
    whole = [page for page in pages if not page.subfiletype & (_REDUCED | _MASK)]
    count += len(whole) - len(pages)
    notes = []
    if any(page.subfiletype & _MASK for page in pages):
        notes.append("A page that is a mask was left out.")
    if tiff.is_imagej:  # one page stands for all
        count = max(count, int((tiff.imagej_metadata or {}).get("images", 1)))
    if count > 1:
        notes.append(f"The first of {count} pages was read, the others were left out.")
    return whole[0] if whole else tiff.pages.first, notes


def _with_pillow(file: Path, notes: tuple[str, ...]) -> StoredPicture:
    from PIL import TiffImagePlugin

    with file.open("rb") as stream:
        image = load(file, TiffImagePlugin.TiffImageFile, stream)
        # Pillow turns TIFF files upright by itself, unlike the other formats.
        return stored_picture(image, notes=notes)._replace(orientation=1)


# --- Samples to colours -------------------------------------------------------------------------


class _Samples(NamedTuple):
    colours: NDArray[Any]
    space: Space
    alpha: NDArray[np.float32] | None
    notes: tuple[str, ...] = ()


def _samples(file: Path, page: tifffile.TiffPage) -> _Samples:
    planes = page.asarray(squeeze=False, maxworkers=1)[:, 0]
    # (planes, y, x, samples), of which one is 1.
    values = np.moveaxis(planes, 0, -1).reshape(*planes.shape[1:3], -1)
    photometric = int(page.photometric)
    count = _COLOURS[photometric]
    kind = page.extrasamples[0] if page.extrasamples else 0
    if photometric == _PALETTE:
        return _Samples(_by_palette(file, page, values[..., 0]), "RGB", None)
    if photometric in (_LAB, _ICC_LAB):
        lab = _lab(values[..., :3], is_icc=photometric == _ICC_LAB)
        note = "The colours were converted to sRGB from CIE L*a*b*."
        return _Samples(rgb_of_lab(lab), "RGB", None, (note,))
    values = _whole_range(values, page.bitspersample)
    colours, alpha = values[..., :count], None
    if photometric == _WHITE_IS_ZERO:
        colours = (1 if values.dtype.kind == "f" else np.iinfo(values.dtype).max) - colours
    if kind in (_ASSOCIATED, _UNASSOCIATED) and values.shape[2] > count:
        alpha = values[..., count]
        alpha = alpha.astype(np.float32) if alpha.dtype.kind == "f" else as_alpha(alpha)
        if kind == _ASSOCIATED:
            colours = straight(colours, alpha)
    space: Space = "CMYK" if count == 4 else "RGB" if count == 3 else "grey"
    return _Samples(colours, space, alpha)


def _whole_range(values: NDArray[Any], bits: int) -> NDArray[Any]:
    """Samples of any number of bits as 8 or 16, from 0 to the most; floats as they are."""
    if values.dtype.kind == "f":
        return values
    if values.dtype.kind == "b":
        return values.astype(np.uint8) * 255
    if values.dtype == np.uint32:
        return ((values.astype(np.uint64) * 65535 + (1 << 31)) >> 32).astype(np.uint16)
    full = 255 if bits <= 8 else 65535
    most = (1 << bits) - 1
    if most == full:
        return values
    scaled = (values.astype(np.uint32) * full + most // 2) // most
    return scaled.astype(np.uint8 if full == 255 else np.uint16)


def _by_palette(file: Path, page: tifffile.TiffPage, numbers: NDArray[Any]) -> NDArray[np.uint16]:
    palette = np.asarray(page.tags[_COLOUR_MAP].value, np.uint16).reshape(3, -1).T
    if palette.max() < 256:  # as 8 bits, by a mistake that is so common that libtiff mends it
        palette = palette * 257
    if int(numbers.max()) >= len(palette):
        raise damaged(file, "TIFF")
    return palette[numbers.astype(np.intp)]


def _lab(values: Any, *, is_icc: bool) -> NDArray[np.float32]:
    """L*, a* and b* of samples of 8 or 16 bits: TIFF 6.0, section 23; Adobe's technical notes."""
    deep = values.dtype == np.uint16
    step = 256 if deep else 1
    most = 65535.0 if deep else 255.0
    if is_icc:  # a* and b* about 128; L* of 16 bits up to 0xFF00
        opponents = values[..., 1:] / step - 128
        most = 65280.0 if deep else 255.0
    else:
        opponents = values[..., 1:].astype(np.int16 if deep else np.int8) / step
    return np.dstack([values[..., :1] * (100 / most), opponents]).astype(np.float32)
