"""The photographs of one instant, decoded."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.drives.driven import Drive
from storage.readers.drives.headers import PHOTOGRAPH, check_size
from storage.readers.drives.lenses import as_pinhole
from storage.readers.drives.recordings import Lens
from storage.readers.films import read_film_frame
from storage.readers.opening import check_file, check_memory
from storage.readers.pictures.image_decoding import decode_image
from storage.readers.pictures.picture_sizes import LARGEST_PICTURE, MEMORY_PER_BYTE
from storage.readers.pictures.srgb_curve import srgb_of_light


def read_frame(drive: Drive, frame: int) -> NDArray[np.uint8]:
    """Decode the photographs of one instant: (c, height, width, 3) uint8, RGB codes of sRGB.

    They come as pinholes of the drive's K take them: what is distorted, a fisheye's or a panorama
    is looked up anew; what then lies outside of what was photographed is black, and so are smaller
    photographs' right and lower rims and those of absent cameras. Grey ones get three equal
    channels, 16 bit codes are rounded to 8 bit.

    Raises BadInput as :func:`decode_image` does, for transparent pixels, and for a photograph that
    has another size than when the drive was read or is missing; for more photographs than their
    files' sizes stand for; IndexError for an instant that is not there.
    """
    if drive.film is not None:
        return read_film_frame(drive.film, frame)[None]
    shape = (len(drive.cameras), drive.height, drive.width, 3)
    there = {file for file in drive.files[frame] if file is not None}
    stored = sum(check_file(file, PHOTOGRAPH, LARGEST_PICTURE) for file in there)
    found = f"{shape[0]} photographs of {drive.width} x {drive.height} pixels"
    check_memory(drive.file, "instant", found, 2 * math.prod(shape), stored, MEMORY_PER_BYTE)
    pictures = np.zeros(shape, np.uint8)
    decoded: tuple[Path, NDArray[Any]] | None = None
    for camera, (file, lens) in enumerate(
        zip(drive.files[frame], drive.lenses[frame], strict=True)
    ):
        if file is None or lens is None:
            continue
        if decoded is None or decoded[0] != file:  # a panorama's views follow each other
            decoded = file, _codes(file, lens)
        width, height = drive.sizes[camera]
        flat = as_pinhole(decoded[1], lens, drive.intrinsics[camera], width, height)
        if flat.dtype == np.uint16:
            # 65535 / 255 = 257, to the nearest.
            flat = ((flat.astype(np.uint32) + 128) // 257).astype(np.uint8)
        pictures[camera, :height, :width] = flat
    return pictures


def read_masks(drive: Drive, frame: int) -> NDArray[np.bool_] | None:
    """Where the photographs of one instant are to be used: (c, height, width) bool, for the pixels
    of :func:`read_frame`; all of a photograph without a mask. None where no photograph of the drive
    has one.

    A pixel counts unless its mask is black there. Raises BadInput as :func:`decode_image` does and
    for a mask of another size than its photograph; IndexError for an instant that is not there.
    """
    if not any(mask for row in drive.masks for mask in row):
        return None
    used = np.ones((len(drive.cameras), drive.height, drive.width), bool)
    for camera, (mask, lens) in enumerate(
        zip(drive.masks[frame], drive.lenses[frame], strict=True)
    ):
        if mask is None or lens is None:
            continue
        codes = decode_image(mask).colours
        check_size(mask, (codes.shape[1], codes.shape[0]), (lens.w, lens.h))
        white = np.where((codes > 0).any(axis=2, keepdims=True), np.uint8(255), np.uint8(0))
        width, height = drive.sizes[camera]
        flat = as_pinhole(white, lens, drive.intrinsics[camera], width, height, nearest=True)
        used[camera, :height, :width] = flat[..., 0] > 0
    return used


def frame_notes(drive: Drive, frame: int) -> tuple[str, ...]:
    """What is to be said of how the photographs of one instant were decoded, each sentence once.

    Raises BadInput as :func:`decode_image` does; IndexError for an instant that is not there.
    """
    if drive.film is not None:
        return ()
    files = dict.fromkeys(file for file in drive.files[frame] if file is not None)
    said = (note for file in files for note in decode_image(file).notes)
    return tuple(dict.fromkeys(said))


def _codes(file: Path, lens: Lens) -> NDArray[Any]:
    """(h, w, 1 or 3), as they are stored but for their profile."""
    image = decode_image(file)
    codes = image.colours
    check_size(file, (codes.shape[1], codes.shape[0]), (lens.w, lens.h))
    if image.opaque is not None and not image.opaque.all():
        holes = image.opaque.size - np.count_nonzero(image.opaque)
        found = f"less than opaque in {holes} pixel(s)"
        raise BadInput(file, "alpha", found, "an opaque picture; save it without its alpha channel")
    if codes.dtype.kind == "f":  # colours with a profile other than sRGB's
        codes = np.rint(65535 * srgb_of_light(codes)).astype(np.uint16)
    return codes
