"""Pictures that Pillow decodes, 8 bits a channel: colours and alpha as stored, orientation, notes.

Each format is opened through its own class: ``Image.open`` would apply a limit of its own, which
can only be changed for the whole process.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.decoded_image import Space, StoredPicture
from storage.readers.picture_sizes import check_area

if TYPE_CHECKING:
    from PIL import Image, ImageFile

ANIMATION = "The file is an animation: its first picture was read, the others were left out."
_EXIF_DAMAGED = "The EXIF block is damaged: the picture was taken as upright."
_ORIENTATION = 0x0112


def load(
    file: Path, plugin: type[ImageFile.ImageFile], stream: Any, pixel_bytes: int = 4
) -> ImageFile.ImageFile:
    """Open and decode; ``pixel_bytes``: of a pixel with all its channels. Raises BadInput for what
    is too large, and nearly anything for what is damaged."""
    image = plugin(stream)
    check_area(file, *image.size, pixel_bytes)
    image.load()
    return image


def stored_picture(image: Image.Image, *, notes: tuple[str, ...] = ()) -> StoredPicture:
    """What a decoded picture holds, whatever its mode."""
    profile = image.info.get("icc_profile")
    orientation, said = orientation_of(image)
    if image.mode == "CMYK":
        return StoredPicture(np.asarray(image), "CMYK", None, profile, orientation, (*notes, *said))
    alpha = None
    if image.has_transparency_data:
        alpha = as_alpha(np.asarray(image.convert("RGBA").getchannel("A")))
    is_grey = image.mode in ("1", "L", "LA", "La")
    if image.mode in ("RGBa", "La"):  # multiplied with alpha; converted by way of the straight one
        image = image.convert("RGBA" if image.mode == "RGBa" else "LA")
    codes = np.asarray(image.convert("L" if is_grey else "RGB"))
    space: Space = "grey" if is_grey else "RGB"
    colours = codes.reshape(*codes.shape[:2], -1)
    return StoredPicture(colours, space, alpha, profile, orientation, (*notes, *said))


def as_alpha(codes: NDArray[Any]) -> NDArray[np.float32]:
    """Alpha in [0, 1] of unsigned integers."""
    return codes.astype(np.float32) / np.float32(np.iinfo(codes.dtype).max)


def orientation_of(image: Image.Image) -> tuple[object, tuple[str, ...]]:
    """EXIF's orientation, and what is to be said where the block cannot be read."""
    try:
        return image.getexif().get(_ORIENTATION, 1), ()
    except Exception:  # SyntaxError, struct.error and others by what is broken
        return 1, (_EXIF_DAMAGED,)


def animation_notes(image: Image.Image) -> tuple[str, ...]:
    """What is to be said of a picture with more frames than the first."""
    return (ANIMATION,) if getattr(image, "is_animated", False) else ()
