"""UBO2014's ``.btf``: matrices of every colour model, either way round."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case
from benchmarks.captures.database_files import (
    HEIGHT,
    LIGHTS,
    PAIRS,
    VIEWS,
    WIDTH,
    Right,
    Writer,
    case,
    is_light,
    radiance,
)

_MEAN = np.array([0.3, 0.2, 0.1])
_AXES = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
"""Principal components, one a row."""
_EPSILON = 1e-5


def _yuv(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """BT.601; U and V scaled to 0.436 and 0.615."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    y = 0.299 * red + 0.587 * green + 0.114 * blue
    return np.stack([y, 0.436 * (blue - y) / (1 - 0.114), 0.615 * (red - y) / (1 - 0.299)], -1)


def _stored(model: int, rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """RGB (…, 3) in a colour model, by the models' definitions."""
    yuv = _yuv(rgb)
    luminance = yuv[..., :1] + _EPSILON
    if model == 1:
        return yuv
    if model == 3:
        return np.asarray((rgb - _MEAN) @ _AXES.T)  # the axes are orthonormal
    if model == 4:  # Malvar, Sullivan
        red, green, blue = np.moveaxis(rgb, -1, 0)
        outer = red / 4 + blue / 4
        return np.stack([outer + green / 2, (red - blue) / 2, green / 2 - outer], -1)
    if model == 9:
        return np.concatenate([np.log(luminance), yuv[..., 1:]], -1)
    if model == 10:
        chroma = yuv[..., 1:]
        return np.concatenate(
            [np.log(luminance), np.sign(chroma) * np.log(np.abs(chroma) / _EPSILON)], -1
        )
    if model == 11:
        return np.concatenate([np.log(luminance), yuv[..., 1:] / luminance], -1)
    if model == 12:
        return np.log(rgb + _EPSILON)
    return rgb


def _btf(
    model: int = 11,
    transposed: bool = False,
    cosine: int = 1,
    signature: bytes = b"!DFMF08FCR",
    lights: Sequence[int] = (3, 3),
    channels: Sequence[bytes] = (b"R", b"G", b"B"),
) -> Writer:
    """A file of version 4 by the published layout; factors by an SVD of full rank."""

    def write(path: Path) -> None:
        measured = b"".join(text.ljust(80, b"\0") for text in (b"dome", b"camera", b"flash"))
        measured += struct.pack("<f3f", 12.5, 1, 1, 1) + struct.pack("<II", cosine, 4) + b"<a/>"
        measured += struct.pack("<I", len(channels))
        measured += b"".join(struct.pack("<I", len(name)) + name for name in channels)
        out = signature + struct.pack("<II", 8 + len(measured), 4) + measured
        out += struct.pack("<I", len(VIEWS))
        for view, count in zip(np.radians(VIEWS), lights, strict=True):
            out += struct.pack("<2fI", *view, count)
            out += np.radians(LIGHTS[:count]).astype("<f4").tobytes()
        out += struct.pack("<II", WIDTH, HEIGHT) + struct.pack("<I", 0)
        out += struct.pack("<Ii", 6, model)
        out += _MEAN.astype("<f4").tobytes() + _AXES.astype("<f4").tobytes()
        values = _stored(model, radiance()).reshape(len(PAIRS), -1, 3)
        for channel in range(3):
            matrix: NDArray[Any] = values[..., channel]
            u, s, vt = np.linalg.svd(matrix.T if transposed else matrix, full_matrices=False)
            out += struct.pack("<BIII", 4, len(s), len(u), vt.shape[1])
            for part in (s, u, vt.T * s):
                out += part.astype("<f4").tobytes()
        path.write_bytes(out)

    return write


def _right(cosine: int = 1) -> Right:
    dimmed = np.cos(np.radians([light[0] for light, _ in PAIRS])) if not cosine else np.ones(6)
    return is_light(radiance() * dimmed[:, None, None, None], 2e-3)


def _folder(path: Path) -> None:
    path.mkdir()
    _btf()(path / "carpet.btf")
    (path / "carpet.png").write_bytes(b"a preview")


_MODELS = {0: "RGB", 1: "YUV", 3: "principal components", 4: "YCoCg", 9: "log Y", 10: "logs of YUV",
           11: "log Y and ratios", 12: "log RGB"}  # fmt: skip

CASES: tuple[Case, ...] = (
    *(
        case(f"model_{model}.btf", f".btf in {name}", _btf(model), _right())
        for model, name in _MODELS.items()
    ),
    case("transposed.btf", ".btf transposed", _btf(transposed=True), _right()),
    case("transposed_log_rgb.btf", ".btf transposed", _btf(12, transposed=True), _right()),
    case("no_cosine.btf", ".btf without the cosine", _btf(cosine=0), _right(0)),
    case("folder_of_a_btf", ".btf in a folder", _folder, _right()),
    case(
        "model_lab.btf",
        ".btf in other models",
        _btf(2),
        says=[r"colour model is 2 \(LAB\)", r"11 \(log Y, U/Y, V/Y\)"],
    ),
    case(
        "full_matrix.btf",
        ".btf of other factorisations",
        _btf(signature=b"!FMF06FCR"),
        says=[r"signature is !FMF06FCR, another of Bonn's", r"!DFMF08FCR.*btflib can write it"],
    ),
    case(
        "lights_differ.btf",
        ".btf whose lights differ",
        _btf(lights=(3, 2)),
        says=[r"number of lights of view 1 is 2", r"3 as before: the same lights for every view"],
    ),
    case(
        "spectral.btf",
        ".btf of spectra",
        _btf(channels=(b"400", b"500", b"600", b"700")),
        says=[r"number of channels is 4", r"3 \(RGB\)"],
    ),
)
