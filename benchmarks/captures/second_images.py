"""Photographs and light probes as Pillow, tifffile and OpenEXR see them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

Found = dict[str, str]


def in_picture(path: Path) -> Found:
    """By Pillow: frames, and alpha that is not opaque. What it cannot read it finds nothing in."""
    from PIL import Image, UnidentifiedImageError

    found: Found = {}
    try:
        picture = Image.open(path)
    except UnidentifiedImageError:
        return found
    with picture:
        frames = getattr(picture, "n_frames", 1)
        kinds = [
            entry["Attribute"]["MPType"] for entry in getattr(picture, "mpinfo", {}).get(0xB002, ())
        ]
        frames -= sum(kind.startswith("Large Thumbnail") for kind in kinds)
        if frames > 1:
            found["pages"] = f"{frames} frames"
        if picture.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in picture.info:
            least, most = picture.convert("RGBA").getchannel("A").getextrema()
            # A BMP's fourth byte is often alpha by name alone, 0 everywhere.
            if least != 255 and not (most == 0 and picture.format == "BMP"):
                found["alpha"] = f"down to {least} of 255"
    if path.suffix.lower() in (".jpg", ".jpeg") and b"ftypmp4" in path.read_bytes():
        found["film"] = "an MP4 behind the picture"
    return found


def in_tiff(path: Path) -> Found:
    """By tifffile: pages, pages below pages, channels beyond the colours."""
    import tifffile

    found: Found = {}
    with tifffile.TiffFile(path) as file:
        # A page of reduced size is the same picture once more.
        pages = [
            page
            for page in file.pages
            if isinstance(page, tifffile.TiffPage) and not page.is_reduced
        ]
        first = file.pages.first
        if len(pages) > 1:
            found["pages"] = f"{len(pages)} pages"
        elif first.subifds:
            found["pages"] = f"{len(first.subifds)} pages below the first"
        colours = {2: 3, 6: 3, 8: 3, 9: 3, 10: 3, 5: 4}.get(int(first.photometric), 1)
        if first.samplesperpixel > colours:
            kinds = [int(kind) for kind in first.extrasamples]
            picture = first.asarray()
            if picture.ndim > 2:
                axis = -1 if picture.shape[-1] == first.samplesperpixel else 0
                extra = np.moveaxis(picture, axis, -1)[..., colours:]
                opaque = np.iinfo(extra.dtype).max if extra.dtype.kind in "ui" else 1.0
                if not (extra == opaque).all():
                    name = "alpha" if set(kinds) & {1, 2} else "channels"
                    found[name] = f"{len(kinds)} beyond the colours, of kinds {kinds}"
    return found


def in_exr(path: Path) -> Found:
    """By OpenEXR: parts, channels that are no colours, alpha that is not opaque, windows."""
    import OpenEXR

    found: Found = {}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        if len(file.parts) > 1:
            found["parts"] = f"{len(file.parts)} parts"
        names = [name for part in file.parts for name in part.channels]
        colours = {"r", "g", "b", "a", "y", "ry", "by", "x", "z", "red", "green", "blue", "alpha"}
        has_xyz = {"X", "Y", "Z"} <= {name.rpartition(".")[2] for name in names}
        others = [
            name
            for name in names
            if (last := re.split("[._]", name)[-1].lower()) not in colours
            or (last in ("x", "z") and not has_xyz)
        ]
        layers = {name.rpartition(".")[0] for name in names}
        if others or len(layers) > 1:
            found["channels"] = ", ".join(others or sorted(layers))
        for part in file.parts:
            for name, channel in part.channels.items():
                alpha = np.asarray(channel.pixels)
                if name.rpartition(".")[2].lower() in ("a", "alpha") and (alpha != 1).any():
                    found["alpha"] = f"{name}, down to {alpha.min():g}"
        header = file.parts[0].header
        if any(
            (np.asarray(a) != np.asarray(b)).any()
            for a, b in zip(header["dataWindow"], header["displayWindow"], strict=True)
        ):
            found["window"] = "the data's is not the display's"
    return found
