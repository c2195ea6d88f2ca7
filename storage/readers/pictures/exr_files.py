"""OpenEXR files to linear RGB: the picture among their layers, whole and upright.

What the OpenEXR library decodes is read: scanlines and tiles (of several levels the finest), all
compressions, half and float. The picture fills the display window: what lies outside of it is cut
off, what is missing in it is black, as compositors have it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.opening import check_memory
from storage.readers.pictures import exr_layers
from storage.readers.pictures.colour_spaces import (
    CIE_XYZ,
    LINEAR_SRGB,
    SRGB,
    ColourSpace,
    luminance_weights,
    named_space,
    space_of,
)
from storage.readers.pictures.picture_sizes import MEMORY_PER_BYTE, check_area

LARGEST_HALF = 65504.0

_SPACE_ATTRIBUTES = ("colorInteropID", "oiio:ColorSpace", "colorSpace", "colorspace")
_LEAST_STORED = 0.5  # of the display window


class ExrHeader(NamedTuple):
    """What a file says of its picture before a pixel is decoded.

    ``width``, ``height`` of the display window; ``stored``, the data window's left, top, right,
    bottom within it, the ends exclusive. ``cube``: six faces, one above the other. ``weights``:
    red's, green's and blue's shares in the luminance. ``notes``: sentences on all this.
    """

    width: int
    height: int
    stored: tuple[int, int, int, int]
    layer: exr_layers.Layer
    sampling: Mapping[str, tuple[int, int]]
    origin: tuple[int, int]
    space: ColourSpace
    weights: NDArray[np.float64]
    cube: bool
    notes: tuple[str, ...]


class ExrPicture(NamedTuple):
    """``colours``: (height, width, 1 or 3) half or float, grey or linear RGB with the primaries of
    sRGB, the top row first; colours outside sRGB are negative. ``alpha``: (height, width), or None
    where there is none. ``notes``: sentences on what was converted, mended or left out.
    """

    colours: NDArray[Any]
    alpha: NDArray[Any] | None
    notes: tuple[str, ...]


def read_exr(file: Path, header: ExrHeader | None = None) -> ExrPicture:
    """Read the picture of an OpenEXR file; ``header``, where it has been read before.

    Infinite values become the half's largest, 65504. Raises BadInput as `exr_header`, for damaged
    content and for integer channels.
    """
    header = header or exr_header(file)
    layer = header.layer
    needed = [*layer.channels, layer.alpha] if layer.alpha else list(layer.channels)
    planes = [
        _full_size(plane, header.sampling[name], header)
        for name, plane in zip(needed, _planes(file, header, needed), strict=True)
    ]
    colours = np.stack(planes[: len(layer.channels)], axis=-1)
    alpha = planes[-1] if layer.alpha else None
    colours, notes = _without_infinite(colours)
    if layer.kind == exr_layers.LUMINANCE_CHROMA:
        colours = _of_luminance(colours.astype(np.float32), header.weights)
    if layer.kind != exr_layers.GREY:
        colours = header.space.converted(colours)
    if header.stored != (0, 0, header.width, header.height):
        colours = _displayed(colours, header)
        alpha = None if alpha is None else _displayed(alpha, header)
    return ExrPicture(colours, alpha, (*header.notes, *notes))


def exr_header(file: Path) -> ExrHeader:
    """Read what the header says.

    Raises BadInput where it is damaged, for deep data, for layers none of which is the picture,
    for a colour space that is none, a picture that takes too much memory, and one of which less
    than half is stored.
    """
    import OpenEXR

    try:
        with OpenEXR.File(str(file), header_only=True) as opened:
            # Copied: closing the file empties the headers.
            headers = [_copied(part.header) for part in opened.parts]
    except Exception as error:  # RuntimeError, ValueError and others by what is broken
        raise _damaged(file) from error
    if not headers:
        raise _damaged(file)
    if any("deep" in header["kind"] for header in headers):
        raise BadInput(file, "content", "deep", "flat pixels: flatten it in the compositor")
    alone = len(headers) == 1
    parts = [
        exr_layers.Part("" if alone else h.get("name", ""), h.get("view", ""), list(h["sampling"]))
        for h in headers
    ]
    views: list[str] = next((h["multiView"] for h in headers if h.get("multiView")), [])
    layer = exr_layers.picture_of(file, parts, views)
    header = headers[layer.part]
    left, top, right, bottom = header["displayWindow"]
    width, height = right - left, bottom - top
    check_area(file, width, height, 4)
    _check_all(file, headers)
    stored = _inside(file, header["dataWindow"], header["displayWindow"])
    space, weights, space_notes = _colours(file, header, headers[0])
    if layer.kind == exr_layers.XYZ:
        space = CIE_XYZ
    notes = [*layer.notes, *space_notes]
    if stored != (0, 0, width, height):
        notes.append(_window_note(stored, width, height))
    if layer.kind != exr_layers.GREY:
        notes.extend(space.notes)
    return ExrHeader(
        width=width,
        height=height,
        stored=stored,
        layer=layer,
        sampling=header["sampling"],
        origin=header["dataWindow"][:2],
        space=space,
        weights=weights,
        cube=header.get("envmap") == OpenEXR.ENVMAP_CUBE,
        notes=tuple(notes),
    )


def _copied(header: Mapping[str, Any]) -> dict[str, Any]:
    """Windows as left, top, right, bottom, the ends exclusive."""
    copied: dict[str, Any] = {
        name: value for name, value in header.items() if isinstance(value, str | int | list)
    }
    copied["envmap"] = header.get("envmap")
    copied["kind"] = str(header.get("type"))
    for name in ("dataWindow", "displayWindow"):
        (left, top), (right, bottom) = np.array(header[name], np.int64).tolist()
        copied[name] = (left, top, right + 1, bottom + 1)
    copied["sampling"] = {c.name: (int(c.xSampling), int(c.ySampling)) for c in header["channels"]}
    if "chromaticities" in header:
        copied["chromaticities"] = [float(value) for value in np.ravel(header["chromaticities"])]
    return copied


def _check_all(file: Path, headers: Sequence[Mapping[str, Any]]) -> None:
    """All parts are decoded, whatever is read of them."""
    needed = 0
    for header in headers:
        left, top, right, bottom = header["dataWindow"]
        check_area(file, right - left, bottom - top, 4)
        needed += 4 * (right - left) * (bottom - top) * len(header["sampling"])
    found = f"{sum(len(header['sampling']) for header in headers)} channels"
    check_memory(file, "size", found, needed, file.stat().st_size, MEMORY_PER_BYTE)


def _inside(
    file: Path, stored: tuple[int, int, int, int], display: tuple[int, int, int, int]
) -> tuple[int, int, int, int]:
    left, top = stored[0] - display[0], stored[1] - display[1]
    right, bottom = stored[2] - display[0], stored[3] - display[1]
    width, height = display[2] - display[0], display[3] - display[1]
    across = min(right, width) - max(left, 0)
    down = min(bottom, height) - max(top, 0)
    if min(across, down) <= 0 or across * down < _LEAST_STORED * width * height:
        raise BadInput(
            file,
            "data window",
            " ".join(map(str, (left, top, right - 1, bottom - 1))),
            f"more than half of the display window, 0 0 {width - 1} {height - 1}: save the whole "
            f"picture, or crop the canvas to it",
        )
    return left, top, right, bottom


def _window_note(stored: tuple[int, int, int, int], width: int, height: int) -> str:
    left, top, right, bottom = stored
    size = f"{width} x {height} pixels"
    if left <= 0 and top <= 0 and right >= width and bottom >= height:
        return f"What lies outside of the display window, {size}, was cut off."
    return f"What is not stored of the display window, {size}, is black."


def _colours(
    file: Path, header: Mapping[str, Any], first: Mapping[str, Any]
) -> tuple[ColourSpace, NDArray[np.float64], list[str]]:
    """Without attributes an EXR has the primaries of Rec. 709, which are those of sRGB."""
    given = header.get("chromaticities", first.get("chromaticities"))
    if given is not None:
        try:
            return space_of(given), luminance_weights(given if any(given) else SRGB), []
        except ValueError:
            text = ", ".join(f"{value:.4g}" for value in given)
            expected = "red, green, blue and white, x and y of each (without them it is sRGB)"
            raise BadInput(file, "chromaticities", text, expected) from None
    names = [header.get(name, first.get(name)) for name in _SPACE_ATTRIBUTES]
    if header.get("acesImageContainerFlag") == 1:
        names.insert(0, "ACES2065-1")
    said = [name for name in names if isinstance(name, str)]
    for name in said:
        if (space := named_space(name)) and name.lower() != "srgb":  # which is that of codes
            return space, luminance_weights(), []
    notes = [
        f"The colours, {shortened(name)!r} by the header, were taken as linear sRGB."
        for name in said[:1]
    ]
    return LINEAR_SRGB, luminance_weights(), notes


def _planes(file: Path, header: ExrHeader, names: Sequence[str]) -> list[NDArray[Any]]:
    import OpenEXR

    try:
        with OpenEXR.File(str(file), separate_channels=True) as opened:
            channels = opened.parts[header.layer.part].channels
            planes = [np.asarray(channels[name].pixels) for name in names]
    except Exception as error:  # RuntimeError, ValueError and others by what is broken
        raise _damaged(file) from error
    if any(plane.dtype.kind != "f" for plane in planes[: len(header.layer.channels)]):
        found = f"unsigned integers ({', '.join(header.layer.channels)})"
        raise BadInput(file, "channels", found, "half or float ones: save it as one of them")
    return planes


def _full_size(plane: NDArray[Any], step: tuple[int, int], header: ExrHeader) -> NDArray[Any]:
    """A channel of every second pixel or so, for every pixel: linear in between."""
    left, top, right, bottom = header.stored
    for axis, every, first, size in (
        (0, step[1], header.origin[1], bottom - top),
        (1, step[0], header.origin[0], right - left),
    ):
        if every == 1:
            continue
        at = (np.arange(size) - (-first % every)) / every
        at = at.clip(0, plane.shape[axis] - 1)
        before = np.floor(at).astype(np.int64)
        after = np.minimum(before + 1, plane.shape[axis] - 1)
        share = (at - before).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        plane = plane.take(before, axis) * (1 - share) + plane.take(after, axis) * share
    return plane


def _without_infinite(colours: NDArray[Any]) -> tuple[NDArray[Any], tuple[str, ...]]:
    infinite = np.isposinf(colours)
    count = np.count_nonzero(infinite)
    if not count:
        return colours, ()
    one = "infinite value became" if count == 1 else "infinite values became"
    largest = max(LARGEST_HALF, float(colours.max(where=~infinite, initial=0)))
    note = f"{count} {one} {largest:g}, {_what(largest)}."
    return np.where(infinite, np.array(largest, colours.dtype), colours), (note,)


def _what(largest: float) -> str:
    return "the half's largest" if largest == LARGEST_HALF else "the largest of the others"


def _of_luminance(colours: NDArray[Any], weights: NDArray[np.float64]) -> NDArray[np.float32]:
    """RGB of Y, RY = (R - Y) / Y and BY = (B - Y) / Y ("Technical Introduction to OpenEXR")."""
    luminance, red, blue = np.moveaxis(colours, -1, 0)
    red, blue = (red + 1) * luminance, (blue + 1) * luminance
    green = (luminance - weights[0] * red - weights[2] * blue) / weights[1]
    return np.stack([red, green, blue], axis=-1).astype(np.float32)


def _displayed(values: NDArray[Any], header: ExrHeader) -> NDArray[Any]:
    left, top, right, bottom = header.stored
    shown = np.zeros((header.height, header.width, *values.shape[2:]), values.dtype)
    into = np.s_[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)]
    shown[into] = values[max(-top, 0) : header.height - top, max(-left, 0) : header.width - left]
    return shown


def _damaged(file: Path) -> BadInput:
    return BadInput(file, "content", "truncated or damaged", "a complete EXR file")
