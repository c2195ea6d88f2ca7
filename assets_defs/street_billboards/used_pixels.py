"""Where users' photographs show the world: not the bonnet, not what a mask has black."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from storage.readers.drives import Drive, read_masks

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray


def used_pixels(drive: Drive, poses: xr.Dataset) -> Callable[[int], NDArray[np.bool_]] | None:
    """A function of an instant's number that gives (c, y, x), True where a pixel is used; None
    where all are.

    By the files' masks, by what `drive_poses` found to stand still, and without absent photographs.
    """
    masked = any(mask is not None for row in drive.masks for mask in row)
    if not masked and "used" not in poses and drive.present.all():
        return None
    shape = (len(drive.cameras), drive.height, drive.width)
    always = poses["used"].values if "used" in poses else np.ones(shape, np.bool_)
    lenses = poses["intrinsics"].values

    def used(instant: int) -> NDArray[np.bool_]:
        from pipelines.street_billboards.capture.centred_photographs import centre_photographs

        own = read_masks(drive, instant) if masked else None
        whole = always if own is None else always & own
        whole = whole & drive.present[instant][:, None, None]
        codes = np.repeat(whole[..., None].astype(np.uint8) * 255, 3, axis=3)
        return centre_photographs(codes, lenses)[..., 0] > 127

    return used
