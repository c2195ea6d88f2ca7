"""OpenEXR files to linear RGB, whatever their channels are called."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.picture_sizes import check_area


class ExrPicture(NamedTuple):
    """``colours``: (height, width, 1 or 3) half or float, grey or linear RGB with the primaries of
    sRGB, the top row first. ``alpha``: (height, width), or None where there is none. ``notes``:
    sentences on what was converted, mended or left out.
    """

    colours: NDArray[np.floating]
    alpha: NDArray[np.floating] | None
    notes: tuple[str, ...]


def read_exr(file: Path) -> ExrPicture:
    """Read the picture in an OpenEXR file. Raises BadInput."""
    import OpenEXR

    with OpenEXR.File(str(file), header_only=True) as header_file:
        part = header_file.parts[0]
        # Copied: closing the file empties the header.
        primaries = part.header.get("chromaticities")
        for every in header_file.parts:  # all are decoded
            check_area(file, every.width(), every.height(), 4 * len(every.channels))
    with OpenEXR.File(str(file), separate_channels=True) as exr:
        channels = {name: channel.pixels for name, channel in exr.channels().items()}
    _check_primaries(file, primaries)
    names = _colour_channels(file, channels)
    colours = np.stack([channels[name] for name in names], axis=-1)
    return ExrPicture(colours, channels.get("A"), ())


def _colour_channels(file: Path, channels: dict[str, NDArray[Any]]) -> tuple[str, ...]:
    for names in (("R", "G", "B"), ("Y",)):
        # Luminance with subsampled chroma (Y, RY, BY) is not grey.
        if set(names) <= channels.keys() and "RY" not in channels:
            break
    else:
        found = ", ".join(sorted(channels)[:8]) or "none"
        raise BadInput(file, "channels", found, "R, G and B, or Y alone")
    types = {channels[name].dtype for name in names}
    if len({channels[name].shape for name in names}) > 1 or {t.kind for t in types} != {"f"}:
        raise BadInput(file, "channels", "not alike", "half or float channels of one size")
    return names


def _check_primaries(file: Path, found: tuple[float, ...] | None) -> None:
    """Without the attribute an EXR has the primaries of Rec. 709, which are those of sRGB."""
    rec709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
    if found is not None and not np.allclose(np.ravel(found), rec709, atol=2e-3):
        text = ", ".join(f"{value:.4g}" for value in np.ravel(found))
        raise BadInput(file, "chromaticities", text, "those of sRGB")
