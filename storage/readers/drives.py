"""Drives: what several cameras on one car photographed, instant by instant.

A drive is a folder in the layout of nerfstudio and instant-ngp, `transforms.json` and the
photographs that it lists, with two fields more in each of its `frames`: `camera`, a name or a
number, and `time`, a number; photographs of one time were taken together. The world's z points up
and its unit is the metre: neither can be seen in the file, so both are the user's promise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.drive_transforms import Frame, Lens, read_transforms, shown_number
from storage.readers.opening import check_file, check_memory, first_bytes
from storage.readers.pictures.image_decoding import decode_image
from storage.readers.pictures.picture_sizes import LARGEST_PICTURE, MEMORY_PER_BYTE
from storage.readers.pictures.pillow_pictures import opened
from storage.readers.pictures.srgb_curve import srgb_of_light

FEWEST_CAMERAS = 2
MOST_CAMERAS = 500
"""Each is compared with each."""
FEWEST_INSTANTS = 3
LEAST_BASELINE = 1e-3
"""Metres between two cameras of one instant."""
LEAST_WAY = 0.1
"""Metres, as far as the car has to come at least; or a baseline, if that is longer."""
BASELINE_CHANGE = 0.05
"""How much longer than its shortest the distance of two cameras may become."""
LARGEST_GAP = 20
"""The longest step from an instant to the next, in medians of all steps."""

_STANDING = 0.01  # metres a step: a car that waits has no say in the median
_PHOTOGRAPH = "a PNG, JPEG, WebP, AVIF or BMP photograph"


class Drive(NamedTuple):
    """c cameras on one car, f instants.

    file: the drive's `transforms.json`.
    cameras: names, from left to right along the rig's own x axis at the first instant.
    width, height: of every photograph, pixels.
    intrinsics: (c, 3, 3) float64, K in pixels, the middle of the first pixel at (0, 0).
    poses: (f, c, 4, 4) float64, camera to world in metres, z up; the camera's axes are OpenCV's:
        x right, y down, z forward.
    times: (f,) float64, rising; in the file's unit.
    files: f tuples of c photographs.
    distortion: (c, 5) float64, OpenCV's k1, k2, p1, p2, k3.
    """

    file: Path
    cameras: tuple[str, ...]
    width: int
    height: int
    intrinsics: NDArray[np.float64]
    poses: NDArray[np.float64]
    times: NDArray[np.float64]
    files: tuple[tuple[Path, ...], ...]
    distortion: NDArray[np.float64]


def read_drive(path: str | PathLike[str]) -> Drive:
    """Read and check a drive; of the photographs only the headers are read.

    Parameters: ``path``, a folder with `transforms.json`.

    Raises BadInput as :func:`read_transforms` does; for fewer than 2 cameras or 3 instants; for two
    photographs of one camera and time, and a time that lacks a camera; for a camera whose lens
    changes, and cameras whose pictures differ in size; for cameras less than 1 mm apart, or whose
    distance changes by more than 5 %; for a car that stays within 0.1 m or a baseline of its first
    place; for a step of more than 20 times the median of the steps (those without motion left
    out); and for a photograph that is missing, of another format, to be turned, or of another size
    than `w` and `h` say.
    """
    file, frames = read_transforms(path)
    instants = _instants(file, frames)
    names = sorted({frame.camera for frame in frames})
    lenses = {name: _lens(file, name, instants) for name in names}
    _check_sizes(file, names, lenses)
    names = _left_to_right(names, instants[0])
    ordered = [[instant[name] for name in names] for instant in instants]
    poses = np.stack([[frame.pose for frame in row] for row in ordered])
    times = np.array([row[0].time for row in ordered])
    _check_rig(file, names, times, poses[..., :3, 3])
    _check_way(file, times, poses[..., :3, 3])
    width, height = lenses[names[0]].w, lenses[names[0]].h
    for row in ordered:
        for frame in row:
            _check_header(frame.photograph, width, height)
    return Drive(
        file=file,
        cameras=tuple(names),
        width=width,
        height=height,
        intrinsics=np.stack([_intrinsics(lenses[name]) for name in names]),
        poses=poses,
        times=times,
        files=tuple(tuple(frame.photograph for frame in row) for row in ordered),
        distortion=np.array([lenses[name][6:] for name in names], np.float64),
    )


def read_frame(drive: Drive, frame: int) -> NDArray[np.uint8]:
    """Decode the photographs of one instant: (c, height, width, 3) uint8, RGB codes of sRGB.

    Distorted photographs are undistorted to the same K; what then lies outside of what was
    photographed is black. Grey ones get three equal channels, 16 bit codes are rounded to 8 bit.

    Raises BadInput as :func:`decode_image` does, for transparent pixels, and for a photograph that
    has another size than when the drive was read or is missing; for more photographs than their
    files' sizes stand for; IndexError for an instant that is not there.
    """
    shape = (len(drive.cameras), drive.height, drive.width, 3)
    stored = sum(check_file(file, _PHOTOGRAPH, LARGEST_PICTURE) for file in drive.files[frame])
    found = f"{shape[0]} photographs of {drive.width} x {drive.height} pixels"
    check_memory(drive.file, "instant", found, 2 * math.prod(shape), stored, MEMORY_PER_BYTE)
    pictures = np.empty(shape, np.uint8)
    lenses = zip(drive.intrinsics, drive.distortion, strict=True)
    for picture, file, lens in zip(pictures, drive.files[frame], lenses, strict=True):
        picture[:] = _picture(file, drive.width, drive.height, *lens)
    return pictures


def frame_notes(drive: Drive, frame: int) -> tuple[str, ...]:
    """What is to be said of how the photographs of one instant were read, each sentence once.

    Raises BadInput as :func:`decode_image` does; IndexError for an instant that is not there.
    """
    said = (note for file in drive.files[frame] for note in decode_image(file).notes)
    return tuple(dict.fromkeys(said))


def _instants(file: Path, frames: Sequence[Frame]) -> list[dict[str, Frame]]:
    """The frames of each time by camera, times rising; every camera is in each."""
    by_time: dict[float, dict[str, Frame]] = {}
    for row, frame in enumerate(frames):
        instant = by_time.setdefault(frame.time, {})
        if frame.camera in instant:
            raise BadInput(
                file,
                f"frames[{row}]",
                f"a second photograph of camera {frame.camera} at time {shown_number(frame.time)}",
                "one photograph of a camera at a time",
            )
        instant[frame.camera] = frame
    names = {frame.camera for frame in frames}
    for what, number, fewest in (
        ("cameras", len(names), FEWEST_CAMERAS),
        ("instants", len(by_time), FEWEST_INSTANTS),
    ):
        if number < fewest:
            raise BadInput(file, f"number of {what}", f"{number}", f"at least {fewest}")
    if len(names) > MOST_CAMERAS:
        raise BadInput(file, "number of cameras", f"{len(names)}", f"at most {MOST_CAMERAS}")
    for time, instant in sorted(by_time.items()):
        if instant.keys() != names:
            field = f"set of cameras at time {shown_number(time)}"
            raise BadInput(file, field, _listed(instant), _listed(names))
    return [instant for _, instant in sorted(by_time.items())]


def _listed(names: set[str] | dict[str, Frame]) -> str:
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return shortened(", ".join(sorted(names)[:8])) + more


def _lens(file: Path, name: str, instants: Sequence[dict[str, Frame]]) -> Lens:
    first = instants[0][name]
    for instant in instants:
        frame = instant[name]
        for field, value, before in zip(Lens._fields, frame.lens, first.lens, strict=True):
            if value != before:
                raise BadInput(
                    file,
                    f"{field} of camera {name}",
                    f"{shown_number(value)} at time {shown_number(frame.time)}",
                    f"{shown_number(before)} as at time {shown_number(first.time)}",
                )
    return first.lens


def _check_sizes(file: Path, names: Sequence[str], lenses: dict[str, Lens]) -> None:
    first = lenses[names[0]]
    for name in names:
        lens = lenses[name]
        if (lens.w, lens.h) != (first.w, first.h):
            raise BadInput(
                file,
                f"picture size of camera {name}",
                f"{lens.w} x {lens.h} pixels",
                f"{first.w} x {first.h} pixels as of camera {shortened(names[0], 40)}",
            )


def _left_to_right(names: Sequence[str], instant: dict[str, Frame]) -> list[str]:
    """Names by the cameras' places along the mean of their x axes; of equal ones by name."""
    poses = np.stack([instant[name].pose for name in names])
    along = poses[:, :3, 3] @ poses[:, :3, 0].mean(axis=0)
    return [names[row] for row in np.argsort(along, kind="stable")]


def _intrinsics(lens: Lens) -> NDArray[np.float64]:
    # The file counts from the first pixel's outer corner, K from its middle.
    return np.array([[lens.fl_x, 0, lens.cx - 0.5], [0, lens.fl_y, lens.cy - 0.5], [0, 0, 1]])


def _check_rig(
    file: Path, names: Sequence[str], times: NDArray[np.float64], places: NDArray[np.float64]
) -> None:
    """``places`` (f, c, 3), metres."""
    for first, second in combinations(range(len(names)), 2):
        apart = np.linalg.norm(places[:, first] - places[:, second], axis=1)
        near, far = int(apart.argmin()), int(apart.argmax())
        field = f"distance of cameras {names[first]} and {names[second]}"
        at_near = f"{apart[near]:.4f} m at time {shown_number(times[near])}"
        if apart[near] < LEAST_BASELINE:
            raise BadInput(file, field, at_near, f"at least {LEAST_BASELINE} m")
        if apart[far] > (1 + BASELINE_CHANGE) * apart[near]:
            found = f"{at_near} and {apart[far]:.4f} m at time {shown_number(times[far])}"
            expected = f"a rigid rig (a change of at most {BASELINE_CHANGE:.0%})"
            raise BadInput(file, field, found, expected)


def _check_way(file: Path, times: NDArray[np.float64], places: NDArray[np.float64]) -> None:
    """``places`` (f, c, 3), metres, cameras from left to right."""
    middle = places.mean(axis=1)
    baseline = np.linalg.norm(np.diff(places[0], axis=0), axis=1).mean()
    least = max(LEAST_WAY, baseline)
    # Not the length of the path: that of a parked car grows with the noise of its places.
    moved = np.linalg.norm(middle - middle[0], axis=1).max()
    if moved < least:
        raise BadInput(file, "way of the car", f"{moved:.2f} m", f"at least {least:.2f} m")
    steps = np.linalg.norm(np.diff(middle, axis=0), axis=1)
    moving = steps[steps > _STANDING]
    usual = np.median(moving) if moving.size else _STANDING
    longest = int(steps.argmax())
    if steps[longest] > LARGEST_GAP * usual:
        before, after = (shown_number(time) for time in times[longest : longest + 2])
        field = f"way of the car between time {before} and {after}"
        found = f"{steps[longest]:.1f} m, {steps[longest] / usual:.0f} times the median"
        raise BadInput(file, field, found, f"no gap (at most {LARGEST_GAP} times)")


def _check_header(file: Path, width: int, height: int) -> None:
    # Imported when needed, as in the modules that decode.
    from PIL import (
        AvifImagePlugin,
        BmpImagePlugin,
        JpegImagePlugin,
        PngImagePlugin,
        WebPImagePlugin,
    )

    plugins: tuple[tuple[int, bytes, Any], ...] = (
        (0, b"\x89PNG\r\n\x1a\n", PngImagePlugin.PngImageFile),
        (0, b"\xff\xd8\xff", JpegImagePlugin.JpegImageFile),
        (8, b"WEBP", WebPImagePlugin.WebPImageFile),
        (4, b"ftypavi", AvifImagePlugin.AvifImageFile),
        (0, b"BM", BmpImagePlugin.BmpImageFile),
    )
    try:
        start = first_bytes(file, 16, _PHOTOGRAPH, LARGEST_PICTURE, field="photograph")
        found = [plugin for at, begins, plugin in plugins if start.startswith(begins, at)]
        if not found:
            raise BadInput(file, "format", "unknown" if start else "empty", _PHOTOGRAPH)
        with file.open("rb") as stream:
            image = opened(found[0], stream)
            # Asked of a PNG without EXIF before its pixels, Pillow would decode it.
            tags = image.getexif() if image.format != "PNG" or "exif" in image.info else {}
            orientation = tags.get(0x0112, 1)
    except BadInput:
        raise
    except Exception as error:  # decoders of damaged data raise nearly anything
        if isinstance(error, OSError) and error.strerror:  # the system's, not Pillow's
            raise BadInput(file, "file", f"unreadable ({error.strerror})", _PHOTOGRAPH) from error
        raise BadInput(file, "content", "truncated or damaged", _PHOTOGRAPH) from error
    if orientation in range(2, 9):
        # Tools differ in whether their poses are those of the picture before or after turning.
        raise BadInput(file, "orientation", f"tag {orientation}", "a photograph stored upright")
    _check_size(file, *image.size, width, height)


def _check_size(file: Path, found_width: int, found_height: int, width: int, height: int) -> None:
    if (found_width, found_height) != (width, height):
        raise BadInput(
            file,
            "size",
            f"{found_width} x {found_height} pixels",
            f"{width} x {height} pixels as its camera's w and h",
        )


def _picture(
    file: Path,
    width: int,
    height: int,
    intrinsics: NDArray[np.float64],
    distortion: NDArray[np.float64],
) -> NDArray[np.uint8]:
    """(height, width, 1 or 3) uint8, undistorted."""
    image = decode_image(file)
    codes = image.colours
    _check_size(file, codes.shape[1], codes.shape[0], width, height)
    if image.opaque is not None and not image.opaque.all():
        holes = image.opaque.size - np.count_nonzero(image.opaque)
        found = f"less than opaque in {holes} pixel(s)"
        raise BadInput(file, "alpha", found, "an opaque picture; save it without its alpha channel")
    if codes.dtype.kind == "f":  # colours with a profile other than sRGB's
        codes = np.rint(65535 * srgb_of_light(codes)).astype(np.uint16)
    if distortion.any():
        import cv2

        # OpenCV leaves out the last axis of a grey picture.
        flat = cv2.undistort(np.ascontiguousarray(codes), intrinsics, distortion)
        codes = flat.reshape(codes.shape)
    if codes.dtype == np.uint16:
        codes = (codes.astype(np.uint32) + 128) // 257  # 65535 / 255 = 257, to the nearest
    return codes.astype(np.uint8)
