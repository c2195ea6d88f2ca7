"""Pictures and moving ones as files: PNG, EXR in linear light, WebP, MP4."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FRAMES_A_SECOND = 4
"""Pace of moving pictures: the assets' frames are far apart."""


def write_picture(picture: NDArray[Any], stem: Path, ending: str) -> list[Path]:
    """Write a picture (y, x, 3), or a moving one (frame, y, x, 3); returns what was written.

    ``picture`` is of 8 bits, sRGB, or of floats, linear. ``ending`` is ``png``, ``exr`` (linear,
    half floats), ``webp`` or ``mp4``; ``stem`` the path without it. A moving picture becomes one
    file as WebP or MP4, numbered ones as PNG or EXR. Raises ValueError where a still picture is to
    become a film.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    moving = picture.ndim == 4
    film = _FILMS.get(ending)
    if film is not None:
        if not moving:
            raise ValueError(f"{stem.name} is a still picture; expected --as png or --as exr.")
        path = stem.parent / f"{stem.name}.{ending}"
        film(_codes(picture), path)
        return [path]
    written = []
    for number, still in enumerate(picture if moving else picture[None]):
        count = f"-{number + 1:04d}" if moving else ""
        path = stem.parent / f"{stem.name}{count}.{ending}"
        _STILLS[ending](still, path)
        written.append(path)
    return written


def _codes(picture: NDArray[Any]) -> NDArray[np.uint8]:
    """8-bit sRGB of either."""
    from pipelines.drawing.colour import to_8bit

    return picture if picture.dtype.kind == "u" else to_8bit(picture)


def _write_png(picture: NDArray[Any], path: Path) -> None:
    from PIL import Image

    Image.fromarray(_codes(picture)).save(path)


def _write_exr(picture: NDArray[Any], path: Path) -> None:
    import numpy as np
    import OpenEXR

    from pipelines.drawing.colour import decode_srgb

    linear = decode_srgb(picture / 255.0) if picture.dtype.kind == "u" else picture
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    largest = np.finfo(np.float16).max
    half = np.ascontiguousarray(np.clip(linear, -largest, largest), np.float16)
    with OpenEXR.File(header, {"RGB": half}) as file:
        file.write(str(path))


def _write_webp(frames: NDArray[np.uint8], path: Path) -> None:
    from PIL import Image

    first, *others = (Image.fromarray(frame) for frame in frames)
    pace = 1000 // FRAMES_A_SECOND
    first.save(path, save_all=True, append_images=others, duration=pace, loop=0, quality=80)


def _write_mp4(frames: NDArray[np.uint8], path: Path) -> None:
    """H.264 that every browser plays: 4:2:0, so sides are made even."""
    import av

    height, width = (side // 2 * 2 for side in frames.shape[1:3])
    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(FRAMES_A_SECOND))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": "18"}
        for frame in frames:
            picture = av.VideoFrame.from_ndarray(frame[:height, :width].copy(), format="rgb24")
            container.mux(stream.encode(picture))
        container.mux(stream.encode())


_STILLS: dict[str, Callable[[NDArray[Any], Path], None]] = {"png": _write_png, "exr": _write_exr}
_FILMS: dict[str, Callable[[NDArray[np.uint8], Path], None]] = {
    "webp": _write_webp,
    "mp4": _write_mp4,
}
ENDINGS = (*_STILLS, *_FILMS)
