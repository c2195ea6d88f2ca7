"""COLMAP's sparse models as they lie on disk, binary or text: https://colmap.github.io/format.html

Nothing of an image's keypoints is read; counts are compared with the file's size before anything
is made of them.
"""

from __future__ import annotations

import io
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.drives.recordings import check_count
from storage.readers.drives.text_tables import finite_numbers
from storage.readers.opening import check_file, unreadable

MODELS = {
    "SIMPLE_PINHOLE": (0, 3),
    "PINHOLE": (1, 4),
    "SIMPLE_RADIAL": (2, 4),
    "RADIAL": (3, 5),
    "OPENCV": (4, 8),
    "OPENCV_FISHEYE": (5, 8),
    "FULL_OPENCV": (6, 12),
    "FOV": (7, 5),
    "SIMPLE_RADIAL_FISHEYE": (8, 4),
    "RADIAL_FISHEYE": (9, 5),
    "THIN_PRISM_FISHEYE": (10, 12),
    "RAD_TAN_THIN_PRISM_FISHEYE": (11, 16),
    "SIMPLE_FISHEYE": (14, 3),
    "FISHEYE": (15, 4),
    "EQUIRECTANGULAR": (17, 2),
}
"""Camera models: COLMAP's number and how many parameters."""

LARGEST_MODEL = 64 << 30
"""Bytes of a file; it is read piece by piece."""
MOST_POINTS = 1_000_000
"""More are thinned out evenly."""

_LONGEST_NAME = 4096
_LONGEST_LINE = 1 << 16
_EXPECTED = "a COLMAP model: cameras and images, .bin or .txt"


class ColmapCamera(NamedTuple):
    """``parameters`` in the model's order; pixels count from the first one's outer corner."""

    model: str
    width: int
    height: int
    parameters: NDArray[np.float64]


class ColmapImage(NamedTuple):
    """``quaternion`` (4,) w, x, y, z and ``translation`` (3,): world to camera."""

    number: int
    camera: int
    name: str
    quaternion: NDArray[np.float64]
    translation: NDArray[np.float64]


def read_cameras(file: Path) -> dict[int, ColmapCamera]:
    """Cameras by number; raises BadInput for a file that is broken."""
    with _opened(file) as stream:
        if file.suffix == ".txt":
            return dict(_text_camera(file, *line) for line in _lines(stream))
        source = _Binary(file, stream)
        return dict(_binary_camera(source) for _ in range(source.count("cameras", 24)))


def read_images(file: Path) -> list[ColmapImage]:
    """Images in the file's order; raises BadInput for a file that is broken."""
    with _opened(file) as stream:
        found: list[ColmapImage] = []
        if file.suffix == ".txt":
            lines = _lines(stream)
            for row, line in lines:
                found.append(_text_image(file, row, line))
                check_count(file, len(found))
                next(lines.pairs, None)  # its keypoints; the line may be empty
            return found
        source = _Binary(file, stream)
        count = source.count("images", 73)
        check_count(file, count)
        for _ in range(count):
            number, *pose = source.take("<I7d")
            camera, name = source.take("<I")[0], source.name()
            source.skip(source.count("keypoints", 24), 24)
            _check_finite(file, f"pose of image {number}", pose)
            found.append(ColmapImage(number, camera, name, np.array(pose[:4]), np.array(pose[4:])))
        return found


def read_rig_frames(file: Path) -> dict[int, int]:
    """The number of the frame, what a rig took at once, of each image's number."""
    found: dict[int, int] = {}
    with _opened(file) as stream:
        if file.suffix == ".txt":
            for row, line in _lines(stream):
                words = line.split()
                field = f"line {row + 1}"
                if len(words) < 10 or len(words) != 10 + 3 * _whole(file, field, words[9]):
                    raise BadInput(file, field, f"{len(words)} words", "a frame and its images")
                frame = _whole(file, field, words[0])
                for at in range(10, len(words), 3):
                    if words[at] == "CAMERA":
                        found[_whole(file, field, words[at + 2])] = frame
            return found
        source = _Binary(file, stream)
        for _ in range(source.count("frames", 68)):
            frame = source.take("<II7d")[0]
            for _ in range(source.count("images of a frame", 16, "<I")):
                kind, _, image = source.take("<iIQ")
                if kind == 0:  # a camera, of all sensors
                    found[image] = frame
        return found


def read_points(file: Path) -> NDArray[np.float64]:
    """Places (n, 3) float64 of the points, in the file's order; raises BadInput for a broken file.

    Of more than a million every second one, third one and so on.
    """
    with _opened(file) as stream:
        if file.suffix == ".txt":
            return _text_points(file, stream)
        source = _Binary(file, stream)
        count = source.count("points", 51)
        every = 1 + count // MOST_POINTS
        places = np.empty((-(-count // every), 3))
        for row in range(count):
            _, *values = source.take("<Q3d3Bd")
            if row % every == 0:
                places[row // every] = values[:3]
            source.skip(source.count("images of a point", 8), 8)
        if not np.isfinite(places).all():
            raise BadInput(file, "points", "not finite", "places in finite numbers")
        return places


def count_images(file: Path) -> int:
    """How many images a file says that it has; raises BadInput where it cannot be opened."""
    with _opened(file) as stream:
        if file.suffix == ".txt":
            lines = _lines(stream)
            return sum(next(lines.pairs, b"") is not None for _ in lines)
        return int.from_bytes(stream.read(8), "little")


@contextmanager
def _opened(file: Path) -> Iterator[BinaryIO]:
    check_file(file, _EXPECTED, LARGEST_MODEL)
    try:
        with file.open("rb") as stream:
            yield stream
    except OSError as error:
        raise unreadable(file, error, _EXPECTED) from error


class _Binary:
    """Little-endian values, one after the other."""

    def __init__(self, file: Path, stream: BinaryIO) -> None:
        self.file, self._stream = file, stream
        self._left = os.fstat(stream.fileno()).st_size

    def take(self, layout: str) -> tuple[Any, ...]:
        size = struct.calcsize(layout)
        data = self._stream.read(size)
        if len(data) < size:
            raise BadInput(self.file, "content", "truncated", "a complete file")
        self._left -= size
        return struct.unpack(layout, data)

    def count(self, what: str, least: int, layout: str = "<Q") -> int:
        """A count of things that take ``least`` bytes each."""
        (count,) = self.take(layout)
        if count * least > self._left:
            expected = f"at most {self._left // least}, which the file has bytes for"
            raise BadInput(self.file, f"number of {what}", f"{count}", expected)
        return int(count)

    def skip(self, count: int, size: int) -> None:
        self._stream.seek(count * size, io.SEEK_CUR)
        self._left -= count * size

    def name(self) -> str:
        """Bytes up to a zero."""
        data = bytearray()
        while (byte := self._stream.read(1)) not in (b"", b"\0"):
            data += byte
            if len(data) > _LONGEST_NAME:
                expected = f"at most {_LONGEST_NAME} bytes"
                raise BadInput(self.file, "an image's name", "without an end", expected)
        self._left -= len(data) + 1
        if byte == b"":
            raise BadInput(self.file, "content", "truncated", "a complete file")
        return data.decode("utf-8", errors="replace")


class _lines:  # noqa: N801 - an iterator that is used like a generator
    """Lines with words in them, but for comments, each with its row; long ones are cut.

    ``pairs``: the lines as they stand, for what belongs to the line before.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._row = -1
        self.pairs = self._all(stream)

    def __iter__(self) -> _lines:
        return self

    def __next__(self) -> tuple[int, str]:
        while True:
            line = next(self.pairs).strip()
            if line and not line.startswith(b"#"):
                return self._row, line.decode("utf-8-sig", errors="replace")

    def _all(self, stream: BinaryIO) -> Iterator[bytes]:
        while line := stream.readline(_LONGEST_LINE):
            self._row += 1
            rest = line
            while rest and not rest.endswith(b"\n"):
                rest = stream.readline(_LONGEST_LINE)
            yield line


def _text_camera(file: Path, row: int, line: str) -> tuple[int, ColmapCamera]:
    words, field = line.split(), f"line {row + 1}"
    if len(words) < 4:
        raise BadInput(file, field, f"{len(words)} words", "CAMERA_ID MODEL WIDTH HEIGHT PARAMS")
    number, width, height = (_whole(file, field, words[at]) for at in (0, 2, 3))
    parameters = finite_numbers(file, field, words[4:])
    return number, _camera(file, words[1], width, height, parameters)


def _binary_camera(source: _Binary) -> tuple[int, ColmapCamera]:
    number, model, width, height = source.take("<IiQQ")
    named = {code: (name, count) for name, (code, count) in MODELS.items()}
    if model not in named:
        expected = "one of " + ", ".join(MODELS)
        raise BadInput(source.file, f"model of camera {number}", f"{model}", expected)
    name, count = named[model]
    parameters = source.take(f"<{count}d")
    _check_finite(source.file, f"parameters of camera {number}", parameters)
    return number, _camera(source.file, name, width, height, np.array(parameters))


def _camera(
    file: Path, model: str, width: int, height: int, parameters: NDArray[np.float64]
) -> ColmapCamera:
    if model not in MODELS:
        raise BadInput(file, "camera model", model, "one of " + ", ".join(MODELS))
    count = MODELS[model][1]
    if len(parameters) != count:
        found = f"{len(parameters)} parameters of a camera {model}"
        raise BadInput(file, "camera", found, f"{count} parameters")
    return ColmapCamera(model, width, height, parameters)


def _text_image(file: Path, row: int, line: str) -> ColmapImage:
    words, field = line.split(maxsplit=9), f"line {row + 1}"
    if len(words) < 10:
        found = f"{len(words)} words"
        raise BadInput(file, field, found, "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME")
    pose = finite_numbers(file, field, words[1:8])
    number, camera = (_whole(file, field, words[at]) for at in (0, 8))
    return ColmapImage(number, camera, words[9], pose[:4], pose[4:])


def _text_points(file: Path, stream: BinaryIO) -> NDArray[np.float64]:
    kept: list[NDArray[np.float64]] = []
    every = 1
    for count, (row, line) in enumerate(_lines(stream)):
        words = line.split(maxsplit=4)[1:4]
        if len(words) != 3:
            raise BadInput(file, f"line {row + 1}", f"{len(words)} numbers", "POINT3D_ID X Y Z …")
        if count % every == 0:
            kept.append(finite_numbers(file, f"line {row + 1}", words))
        if len(kept) > MOST_POINTS:
            kept, every = kept[::2], 2 * every
    return np.array(kept).reshape(-1, 3)


def _whole(file: Path, field: str, word: str) -> int:
    if not word.isdecimal() or len(word) > 20:
        raise BadInput(file, field, f'"{word}" among its numbers', "a whole number")
    return int(word)


def _check_finite(file: Path, field: str, values: Any) -> None:
    if not np.isfinite(values).all():
        raise BadInput(file, field, "not finite", "finite numbers")
