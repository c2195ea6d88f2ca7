"""UBO2014's ``.btf`` files: the header, and where the factors lie.

A decorrelated full-matrix factorisation, little-endian, laid out as Bonn's own btflib reads and
writes it (github.com/cgbonn/btflib, ``read_ubo_dfmf.m``, ``read_meta_data.m``). The first part
says whether the cosine of the light is already in the values; its mean and matrix of colours
belong to one colour model (3, principal components) and are used for it alone. A file may hold the
transposed matrices: U then belongs to the pixels.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.btf_factors import (
    COLOUR_MODELS,
    ChannelFactors,
    ColourModel,
    FactoredPhotographs,
)
from storage.readers.btf_measured import MeasuredBTF, check_area, checked_crop

SIGNATURES = (b"!DFMF08FCR", b"!DFMF08FC")
_OTHERS = (
    b"!FMF12FCER", b"!FMF06FCR", b"!FMF06FC", b"!PVF06FCR", b"!PVF06FC", b"!BDIF06R2!",
)  # fmt: skip
_MOST_DIRECTIONS = 10_000
_SCALARS = {2: "<f2", 4: "<f4", 8: "<f8"}
_MODEL_NAMES = {
    0: "RGB", 1: "YUV", 2: "LAB", 3: "PCA", 4: "YCoCg", 5: "spectral", 6: "linear spectral",
    9: "log Y, U, V", 10: "log Y, log U, log V", 11: "log Y, U/Y, V/Y", 12: "log RGB",
}  # fmt: skip


class _Directions(NamedTuple):
    """(image, 2) float64 each, radians; phi in [0, 2 pi)."""

    light: NDArray[np.float64]
    view: NDArray[np.float64]
    views: int
    lights_per_view: int


class _File:
    """Reads a file from front to back; no read goes beyond the file's end."""

    def __init__(self, path: Path, stream: BinaryIO) -> None:
        self.path = path
        self.stream = stream
        self.size = path.stat().st_size

    def take(self, count: int) -> bytes:
        self._check_reaches(self.stream.tell() + count)
        return self.stream.read(count)

    def skip(self, count: int) -> int:
        """Where the skipped bytes began."""
        start = self.stream.tell()
        self._check_reaches(start + count)
        self.stream.seek(count, 1)
        return start

    def integer(self) -> int:
        (value,) = struct.unpack("<I", self.take(4))
        return int(value)

    def floats(self, count: int) -> NDArray[np.float64]:
        with np.errstate(invalid="ignore"):  # signalling NaNs, refused where it matters
            return np.frombuffer(self.take(4 * count), "<f4").astype(np.float64)

    def refuse(self, field: str, found: str, expected: str) -> BadInput:
        return BadInput(self.path, field, found, expected)

    def _check_reaches(self, end: int) -> None:
        if end > self.size:
            raise self.refuse("size", f"{self.size} bytes", f"at least {end} bytes by its header")


def open_ubo2014(path: Path, crop: tuple[int, int, int, int] | None) -> MeasuredBTF:
    """Open a ``.btf`` file; its factors stay on the disk.

    Photographs keep the file's order: row = view * lights + light, which for UBO2014 is ring by
    ring. Raises BadInput for other signatures, versions, colour models, directions off the
    hemisphere, views with different numbers of lights, sizes that disagree, and for a file that
    is shorter or longer than its header says.
    """
    with path.open("rb") as stream:
        file = _File(path, stream)
        rotated = _read_signature(file)
        cosine_inside = _read_measurement(file)
        directions = _read_directions(file)
        width, height = file.integer(), file.integer()
        check_area(path, width, height)
        if rotated:
            file.skip(36 * file.integer())
        file.integer()  # the most components of any channel
        model = _read_colour_model(file)
        images = directions.views * directions.lights_per_view
        channels = tuple(_read_channel(file, c, images, width * height) for c in range(3))
        if stream.tell() != file.size:
            raise file.refuse("size", f"{file.size} bytes", f"{stream.tell()} bytes by its header")
    box = checked_crop(path, crop, width, height)
    cosines = np.cos(directions.light[:, 0]).clip(min=0).astype(np.float32)
    cosine = "stored with" if cosine_inside else "multiplied by"
    return MeasuredBTF(
        name=path.name,
        layout="UBO2014",
        colour=f"{_MODEL_NAMES[model.number]} (colour model {model.number}) converted to linear "
        f"RGB; "
        f"values are {cosine} the light's cosine",
        light=directions.light,
        view=directions.view,
        height=box.height,
        width=box.width,
        views=directions.views,
        lights_per_view=directions.lights_per_view,
        shifted_lights=0,
        photographs=FactoredPhotographs(
            path, channels, model, (height, width), box, None if cosine_inside else cosines
        ),
    )


def _read_signature(file: _File) -> bool:
    """Whether rotations follow the sizes."""
    start = file.stream.read(max(map(len, SIGNATURES)))
    for signature in SIGNATURES:
        if start.startswith(signature):
            file.stream.seek(len(signature))
            return signature.endswith(b"R")
    other = next((name for name in _OTHERS if start.startswith(name)), None)
    found = other.decode() if other else "unknown"
    raise file.refuse(
        "signature",
        f"{found}, another of Bonn's formats" if other else found,
        "!DFMF08FCR, the decorrelated full-matrix factorisation of UBO2014: btflib can write it",
    )


def _read_measurement(file: _File) -> bool:
    """Whether the cosine of the light is in the values. Setup, sensor, lamp, scale and the
    measurement's XML are passed over."""
    begin = file.stream.tell()
    size, version = file.integer(), file.integer()
    if not 1 <= version <= 4:
        raise file.refuse("header version", str(version), "1 to 4")
    file.skip(3 * 80 + 4 + 3 * 4)
    cosine_inside = bool(file.integer()) if version > 1 else False
    if version > 2:
        file.skip(file.integer())
    if version > 3:
        channels = file.integer()
        if channels != 3:
            expected = "3 (RGB): write spectra as RGB"
            raise file.refuse("number of channels", str(channels), expected)
        for _ in range(channels):
            file.skip(file.integer())
    read = file.stream.tell() - begin
    if read != size:
        raise file.refuse("header size", f"{size} bytes", f"{read} bytes by its content")
    return cosine_inside


def _read_directions(file: _File) -> _Directions:
    views = _read_count(file, "number of views")
    view: list[NDArray[np.float64]] = []
    light: list[NDArray[np.float64]] = []
    for index in range(views):
        view.append(file.floats(2))
        lights = _read_count(file, f"number of lights of view {index}")
        if light and lights != len(light[0]):
            raise file.refuse(
                f"number of lights of view {index}",
                str(lights),
                f"{len(light[0])} as before: the same lights for every view",
            )
        light.append(file.floats(2 * lights).reshape(lights, 2))
    lights = len(light[0])
    return _Directions(
        light=_on_the_hemisphere(file, "light", np.concatenate(light)),
        view=_on_the_hemisphere(file, "view", np.repeat(np.stack(view), lights, axis=0)),
        views=views,
        lights_per_view=lights,
    )


def _read_count(file: _File, field: str) -> int:
    count = file.integer()
    if not 1 <= count <= _MOST_DIRECTIONS:
        raise file.refuse(field, str(count), f"1 to {_MOST_DIRECTIONS}")
    return count


def _on_the_hemisphere(
    file: _File, kind: str, directions: NDArray[np.float64]
) -> NDArray[np.float64]:
    theta, phi = directions.T
    good = np.isfinite(phi) & (theta >= 0) & (theta <= np.pi / 2 + 1e-6)  # rounded to single
    if not good.all():
        index = int(np.argmin(good))
        raise file.refuse(
            f"{kind} of photograph {index}",
            f"theta {theta[index]:.4g}, phi {phi[index]:.4g}",
            "theta of 0 to pi / 2 and a finite phi, in radians",
        )
    return np.stack([theta, np.mod(phi, 2 * np.pi)], axis=-1)


def _read_colour_model(file: _File) -> ColourModel:
    (number,) = struct.unpack("<i", file.take(4))
    mean, matrix = file.floats(3), file.floats(9).reshape(3, 3)
    if number not in COLOUR_MODELS:
        name = _MODEL_NAMES.get(number, "unknown")
        known = ", ".join(f"{key} ({_MODEL_NAMES[key]})" for key in COLOUR_MODELS)
        expected = f"one of {known}: write it with one of them, btflib can"
        raise file.refuse("colour model", f"{number} ({name})", expected)
    return ColourModel(int(number), mean.astype(np.float32), matrix.astype(np.float32))


def _read_channel(file: _File, channel: int, images: int, pixels: int) -> ChannelFactors:
    (scalar_size,) = file.take(1)
    if scalar_size not in _SCALARS:
        raise file.refuse(f"scalar size of channel {channel}", f"{scalar_size} bytes", "2, 4 or 8")
    components, rows, columns = file.integer(), file.integer(), file.integer()
    transposed = (rows, columns) == (pixels, images)
    for field, found, expected in (("rows", rows, images), ("columns", columns, pixels)):
        if found != expected and not transposed:
            raise file.refuse(f"number of {field} of channel {channel}", str(found), str(expected))
    if not components:
        raise file.refuse(f"number of components of channel {channel}", "0", "1 or more")
    scalar = np.dtype(_SCALARS[scalar_size])
    singular_values = np.frombuffer(file.take(scalar_size * components), scalar)
    if not np.isfinite(singular_values).all():
        raise file.refuse(f"singular values of channel {channel}", "not finite", "finite values")
    u_at = file.skip(scalar_size * components * rows)
    sxv_at = file.skip(scalar_size * components * columns)
    if transposed and images != pixels:
        u_at, sxv_at = sxv_at, u_at
    return ChannelFactors(scalar.str, components, u_at, sxv_at)
