"""BTF databases that are one file a photograph: UBO2003, ATRIUM and UTIA, zipped or in a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.btf_archives import Members, folder_members, zip_members
from storage.readers.btf_headers import Header, common_header
from storage.readers.btf_measured import Crop, MeasuredBTF, checked_crop
from storage.readers.btf_names import UBO2003, UTIA, ordered_photographs
from storage.readers.btf_pixels import colour_of, exr_pixels, linear_light
from storage.readers.pictures.colour_spaces import CIE_XYZ, LINEAR_SRGB, ColourSpace, space_of

ExrColours = Literal["auto", "rgb", "xyz"]

_IMPOSSIBLE = 0.02  # share of the values that no real colour in CIE XYZ has


@dataclass(frozen=True)
class PhotographFiles:
    """Photographs in order, each in a file of its own. ``space``: of an EXR's values."""

    members: Members
    names: list[str]
    header: Header
    crop: Crop
    space: ColourSpace

    def read(self, first: int, last: int) -> NDArray[np.float32]:
        """Decode photographs first ... last - 1: (image, y, x, 3) float32 linear RGB.

        Raises BadInput for a file that is damaged or has changed since its header was read.
        """
        shape = (last - first, self.crop.height, self.crop.width, 3)
        block = np.empty(shape, dtype=np.float32)
        for light, name in zip(block, self.names[first:last], strict=True):
            file = self.members.path / name
            data = self.members.whole(name)
            light[:], _ = linear_light(file, data, self.header, self.space, self.crop)
            _check_finite(file, light, self.crop)
        return block


class _Colours(NamedTuple):
    """Of EXR files, and what to say."""

    space: ColourSpace
    notes: tuple[str, ...] = ()


def open_photographs(
    path: Path, crop: tuple[int, int, int, int] | None, exr_colours: ExrColours
) -> MeasuredBTF:
    """Open a zip or a folder after reading all names and headers.

    Raises BadInput for names, sizes and formats that do not make a database, and for a first
    photograph that cannot be decoded.
    """
    members: Members = folder_members(path) if path.is_dir() else zip_members(path)

    def are_equal(one: str, other: str) -> bool:
        return members.size(one) == members.size(other) and (
            members.whole(one) == members.whole(other)
        )

    found = ordered_photographs(path, members.names(), are_equal)
    header, header_notes = common_header(members, found.names)
    box = checked_crop(path, crop, header.width, header.height)
    colours = _Colours(LINEAR_SRGB)
    if header.format == "EXR":
        colours = _exr_colours(members, found.names[0], header, exr_colours, found.style == UTIA)
    # Only UTIA's description says that the light gives way where it coincides with the camera.
    coincide = (found.light == found.view).all(axis=1).sum() if found.style == UTIA else 0
    photographs = PhotographFiles(members, found.names, header, box, colours.space)
    pixel_notes = _looked_at(photographs)
    return MeasuredBTF(
        name=path.name,
        layout=_layout(found.style, header.format),
        colour=colour_of(header, colours.space),
        light=found.light,
        view=found.view,
        height=box.height,
        width=box.width,
        views=found.views,
        lights_per_view=found.lights_per_view,
        shifted_lights=int(coincide),
        photographs=photographs,
        notes=(*found.notes, *header_notes, *colours.notes, *pixel_notes),
    )


def _looked_at(photographs: PhotographFiles) -> tuple[str, ...]:
    """What is to be said of the first photograph's pixels, where the header promises something;
    refused at once where they are not what they should be."""
    if not (photographs.header.has_alpha or photographs.header.has_profile):
        return ()
    name = photographs.names[0]
    file = photographs.members.path / name
    data = photographs.members.whole(name)
    return linear_light(file, data, photographs.header, photographs.space, photographs.crop)[1]


def _layout(style: str, image_format: str) -> str:
    if style == UBO2003 and image_format == "HDR":
        return "ATRIUM HDR"
    return f"{style} ({image_format})"


def _exr_colours(
    members: Members, name: str, header: Header, wanted: ExrColours, is_utia: bool
) -> _Colours:
    """What the values of R, G, B are: as asked for, as the chromaticities say, or as it seems."""
    if header.planes[0] in "Xx":
        return _Colours(CIE_XYZ)
    file = members.path / name
    if wanted != "auto":
        return _Colours(CIE_XYZ if wanted == "xyz" else LINEAR_SRGB)
    if header.chromaticities is not None:
        try:
            return _Colours(space_of(header.chromaticities))
        except ValueError:
            text = ", ".join(f"{value:.4g}" for value in header.chromaticities)
            expected = "those of a colour space: set exr_colours to rgb or xyz"
            raise BadInput(file, "chromaticities", text, expected) from None
    if not is_utia:
        return _Colours(LINEAR_SRGB, (_SAID.format("linear sRGB, as OpenEXR has it", "xyz"),))
    values = exr_pixels(file, members.whole(name), header).astype(np.float32)
    outside = CIE_XYZ.converted(values) < -0.01 * np.abs(values).max(initial=0, where=values < 6e4)
    if outside.any(axis=-1).mean() <= _IMPOSSIBLE:
        return _Colours(CIE_XYZ, (_SAID.format("CIE XYZ, as UTIA describes them", "rgb"),))
    reason = "linear sRGB, as no colours in CIE XYZ are like that"
    return _Colours(LINEAR_SRGB, (_SAID.format(reason, "xyz"),))


_SAID = (
    "The files do not say what R, G and B are: they were taken as {}; if colours look wrong, set "
    "exr_colours to {}."
)


def _check_finite(file: Path, colours: NDArray[np.float32], crop: Crop) -> None:
    good = np.isfinite(colours)
    if good.all():
        return
    row, column, channel = np.argwhere(~good)[0]
    raise BadInput(
        file,
        f"pixel value at column {crop.left + column}, row {crop.top + row}",
        f"{colours[row, column, channel]}",
        "a finite value: leave the pixel out by a crop",
    )
