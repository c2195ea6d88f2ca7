"""BTF databases that are one file a photograph: UBO2003, ATRIUM and UTIA, zipped or in a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.btf_archives import FolderMembers, Members, zip_members
from storage.readers.btf_headers import Header, common_header
from storage.readers.btf_measured import Crop, MeasuredBTF, checked_crop
from storage.readers.btf_names import BLANKS, ordered_photographs
from storage.readers.btf_pixels import colour_of, linear_light_into


@dataclass(frozen=True)
class PhotographFiles:
    """Photographs in order, each in a file of its own."""

    members: Members
    names: list[str]
    header: Header
    crop: Crop

    def read(self, first: int, last: int) -> NDArray[np.float32]:
        """Decode photographs first ... last - 1: (image, y, x, 3) float32 linear RGB.

        Raises BadInput for a file that is damaged or has changed since its header was read.
        """
        shape = (last - first, self.crop.height, self.crop.width, 3)
        block = np.empty(shape, dtype=np.float32)
        for light, name in zip(block, self.names[first:last], strict=True):
            file = self.members.path / name
            linear_light_into(light, file, self.members.whole(name), self.header, self.crop)
        return block


def open_photographs(path: Path, crop: tuple[int, int, int, int] | None) -> MeasuredBTF:
    """Open a zip or a folder after reading all names and headers.

    Raises BadInput for names, sizes and formats that do not make a database.
    """
    members: Members = FolderMembers(path) if path.is_dir() else zip_members(path)
    found = ordered_photographs(path, members.names())
    header = common_header(members, found.names)
    box = checked_crop(path, crop, header.width, header.height)
    # Only UTIA's description says that the light gives way where it coincides with the camera.
    coincide = (found.light == found.view).all(axis=1).sum() if found.separator != BLANKS else 0
    return MeasuredBTF(
        name=path.name,
        layout=_layout(found.separator, header.format),
        colour=colour_of(header),
        light=found.light,
        view=found.view,
        height=box.height,
        width=box.width,
        views=found.views,
        lights_per_view=found.lights_per_view,
        shifted_lights=int(coincide),
        photographs=PhotographFiles(members, found.names, header, box),
    )


def _layout(separator: str, image_format: str) -> str:
    if separator != BLANKS:
        return f"UTIA ({image_format})"
    return "ATRIUM HDR" if image_format == "HDR" else f"UBO2003 / ATRIUM ({image_format})"
