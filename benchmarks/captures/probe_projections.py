"""Light probes in other projections and other formats."""

from __future__ import annotations

import functools
import io
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.probe_files import (
    HEIGHT,
    WIDTH,
    equals,
    exr,
    hdr,
    light,
    probe,
    rgb,
    rgbe,
    saved,
    window,
)

# --- Projections --------------------------------------------------------------------------------


def _cube_light(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smooth radiance by direction: x to the right, y up, z ahead."""
    x, y, z = np.moveaxis(direction, -1, 0)
    return np.stack([1 + 0.6 * x + 0.2 * y, 1 + 0.7 * y, 1 + 0.5 * z - 0.3 * y], axis=-1)


def _face(middle: str, right: str, up: str, size: int = 32) -> NDArray[np.float64]:
    axes = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
    middle_, right_, up_ = (
        np.array(axes[word[1]]) * (1 if word[0] == "+" else -1) for word in (middle, right, up)
    )
    at = (np.arange(size) + 0.5) / size * 2 - 1
    direction = middle_ + at[None, :, None] * right_ - at[:, None, None] * up_
    return _cube_light(direction / np.linalg.norm(direction, axis=2, keepdims=True))


def _cross(lying: bool) -> NDArray[np.float64]:
    size = 32
    picture = np.zeros((3 * size, 4 * size, 3) if lying else (4 * size, 3 * size, 3))
    faces = {
        (0, 1): _face("+y", "+x", "-z"),
        (1, 0): _face("-x", "+z", "+y"),
        (1, 1): _face("+z", "+x", "+y"),
        (1, 2): _face("+x", "-z", "+y"),
        (2, 1): _face("-y", "+x", "+z"),
        (1, 3) if lying else (3, 1): _face("-z", *(("-x", "+y") if lying else ("+x", "-y"))),
    }
    for (row, column), face in faces.items():
        picture[row * size : (row + 1) * size, column * size : (column + 1) * size] = face
    return picture


def _cube_equirectangular() -> NDArray[np.float64]:
    longitude = (np.arange(128) + 0.5) / 128 * 2 * np.pi - np.pi
    latitude = np.pi / 2 - (np.arange(64)[:, None] + 0.5) / 64 * np.pi
    direction = np.stack(
        [
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude) + 0 * longitude,
            np.cos(latitude) * np.cos(longitude),
        ],
        axis=-1,
    )
    return _cube_light(direction)


def _as_hdr(picture: NDArray[np.float64]) -> bytes:
    height, width, _ = picture.shape
    exponent = np.frexp(np.maximum(picture.max(axis=2), 1e-9))[1]
    pixels = np.zeros((height, width, 4), np.uint8)
    pixels[..., :3] = np.minimum(np.round(picture * 2.0 ** (8 - exponent)[..., None]), 255)
    pixels[..., 3] = np.where(picture.max(axis=2) > 0, exponent + 128, 0)
    return hdr(size=f"-Y {height} +X {width}", pixels=pixels.tobytes())


def _cross_as_hdr(lying: bool) -> bytes:
    return _as_hdr(_cross(lying))


def _off_by_one() -> bytes:
    """One column more than twice the height: the picture's, drawn out."""
    return _as_hdr(np.broadcast_to(light(HEIGHT, WIDTH)[:, :1], (HEIGHT, WIDTH + 1, 3)))


def _sized(height: int, width: int) -> bytes:
    return hdr(size=f"-Y {height} +X {width}", pixels=rgbe(height, width).tobytes())


_UNFOLDED = equals(_cube_equirectangular(), 0.03)
_PROJECTIONS = (
    *(
        probe(
            name,
            "a cube's cross",
            saved(functools.partial(_cross_as_hdr, lying)),
            "told",
            ["cross of a cube's faces was unfolded"],
            _UNFOLDED,
        )
        for name, lying in (("lying.hdr", True), ("standing.hdr", False))
    ),
    probe(
        "off_by_one.hdr",
        "a width nearly twice the height",
        saved(_off_by_one),
        "told",
        ["33 x 16 pixels were averaged to 32 x 16"],
        equals(np.broadcast_to(light()[:, :1], (HEIGHT, WIDTH, 3)), 5e-3),
    ),
    probe("photo43.hdr", "not equirectangular", _sized(96, 128), "refused", ["cross", "twice"]),
    probe("photo32.hdr", "not equirectangular", _sized(64, 96), "refused", ["equirectangular"]),
    probe("ball.hdr", "a ball or an angular map", _sized(32, 32), "refused", ["HDR Shop"]),
    probe("row.hdr", "a cube's faces in a row", _sized(16, 96), "refused", ["with cmft"]),
    probe("dome.hdr", "half a sphere", _sized(16, 64), "refused", ["missing above or below"]),
    probe("tiny.hdr", "tiny", _sized(4, 8), "refused", ["at least 16 pixels"]),
)

# --- Other formats ------------------------------------------------------------------------------


def _picture(kind: str) -> Callable[[], bytes]:
    def data() -> bytes:
        from PIL import Image

        stream = io.BytesIO()
        Image.fromarray(rgbe()[..., :3]).save(stream, kind)
        return stream.getvalue()

    return data


_FORMATS = (
    *(
        probe(
            f"{kind}.hdr",
            "8 bits",
            saved(_picture(kind)),
            "refused",
            [kind, "8 bits hold no radiance"],
        )
        for kind in ("PNG", "JPEG", "WebP", "BMP")
    ),
    probe(
        "TIFF.exr", "other formats of radiance", saved(_picture("TIFF")), "refused", ["oiiotool"]
    ),
    probe(
        "PFM.hdr",
        "other formats of radiance",
        b"PF\n32 16\n-1.0\n" + struct.pack("<3f", 1, 1, 1) * 512,
        "refused",
        ["PFM", "oiiotool"],
    ),
    probe(
        "lfs.hdr",
        "a pointer instead of the file",
        b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0" * 64 + b"\nsize 9\n",
        "refused",
        ["pointer of Git LFS", "git lfs pull"],
    ),
    probe("empty.hdr", "no picture", b"", "refused", ["empty", "a Radiance .hdr or an OpenEXR"]),
    probe(
        "black.hdr",
        "all black",
        hdr(pixels=bytes(4 * HEIGHT * WIDTH)),
        "refused",
        ["all black", "light in it"],
    ),
)

# --- Projections that an EXR names ---


def _faces() -> NDArray[np.float64]:
    """One colour a face, from the top: +X, -X, +Y, -Y, +Z, -Z (OpenEXR's ``ImfEnvmap.h``)."""
    colours = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]])
    return np.repeat(np.repeat(colours[:, None, None], 8, 1), 8, 2).reshape(48, 8, 3) + 0.5


def _faces_are_right(found: Any) -> bool:
    """In the middle +Z, a quarter to the left +X, to the right -X, above +Y, below -Y."""
    picture = found.radiance
    expected = {
        (8, 16): (0, 1, 1),
        (8, 8): (1, 0, 0),
        (8, 24): (0, 1, 0),
        (8, 0): (1, 0, 1),
        (0, 3): (0, 0, 1),
        (15, 3): (1, 1, 0),
    }
    return picture.shape == (16, 32, 3) and all(
        np.allclose(picture[at], np.array(colour) + 0.5) for at, colour in expected.items()
    )


_CUBE_WINDOW = window(0, 0, 8, 48)
_MARKED = (
    probe("latlong.exr", "an environment that says so", exr(envmap="ENVMAP_LATLONG")),
    probe(
        "cube.exr",
        "a cube that says so",
        exr(rgb(values=_faces()), envmap="ENVMAP_CUBE"),
        "told",
        ["six faces of a cube were unfolded"],
        _faces_are_right,
    ),
    probe(
        "column.exr",
        "a cube's faces in a row",
        exr(rgb(values=_faces())),
        "refused",
        ["8 x 48 pixels", "with cmft"],
    ),
)

CASES: tuple[Case, ...] = (*_PROJECTIONS, *_MARKED, *_FORMATS)
