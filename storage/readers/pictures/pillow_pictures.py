"""Pictures that Pillow decodes, 8 bits a channel: colours and alpha as stored, orientation, notes.

Each format is opened through its own class: ``Image.open`` would apply a limit of its own, which
can only be changed for the whole process.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from storage.readers.pictures.decoded_image import Space, StoredPicture
from storage.readers.pictures.picture_sizes import check_area

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
    image = opened(plugin, stream)
    check_area(file, *image.size, pixel_bytes)
    image.load()
    return image


def opened(plugin: type[ImageFile.ImageFile], stream: Any) -> ImageFile.ImageFile:
    """A picture of which the header was read; Pillow warns of tags that nothing needs."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return plugin(stream)


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
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            orientation = image.getexif().get(_ORIENTATION)
    except Exception:  # SyntaxError, struct.error and others by what is broken
        return 1, (_EXIF_DAMAGED,)
    if orientation is None and not _is_whole(image.info.get("exif", b"")):
        return 1, (_EXIF_DAMAGED,)
    return orientation, ()


def _is_whole(block: bytes) -> bool:
    """Whether the tags of the picture itself lie inside the block; Pillow only warns."""
    tags = block.removeprefix(b"Exif\0\0")
    order: Literal["little", "big"] = "little" if tags[:2] == b"II" else "big"
    at = int.from_bytes(tags[4:8], order)
    count = int.from_bytes(tags[at : at + 2], order)
    return not tags or at + 2 + 12 * count <= len(tags)


def animation_notes(image: Image.Image) -> tuple[str, ...]:
    """What is to be said of a picture with more frames than the first."""
    return (ANIMATION,) if getattr(image, "is_animated", False) else ()
