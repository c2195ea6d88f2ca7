"""Films: the pictures of one camera with the times at which they are shown.

FFmpeg's decoders by PyAV: MP4, MOV, MKV, WebM, AVI, MPEG-TS and others with H.264, H.265, AV1, VP9
and others. Sound, subtitles and further pictures are not looked at.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.opening import first_bytes
from storage.readers.pictures.code_points import CodePoints, light_of_code_points
from storage.readers.pictures.srgb_curve import srgb_of_light

SUFFIXES = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".ts", ".mts", ".m2ts", ".mpg", ".3gp")
"""Of the films that are looked for in folders, lower case; what is in a file decides."""
SHORTEST = 5.0
"""Seconds: a car in a town comes some 60 m."""
SMALLEST_SIDE = 120
LARGEST_SIDE = 8192
MOST_FRAMES = 1_000_000

_FILM = "a film (MP4, MOV, MKV, WebM, AVI, MPEG-TS)"
_HDR = (16, 18)
"""Transfer curves of ITU-T H.273: PQ and HLG."""
_HD = 720
"""Lines from which on colours that say nothing of themselves are those of BT.709."""
_BT709, _NOT_SAID = 1, 2
_UNEVEN = 1.5
"""How much longer than the shortest a frame is shown where the rate is said to vary."""


class Film(NamedTuple):
    """A film of n frames.

    width, height: of its pictures, upright and with square pixels.
    times: (n,) float64, rising: seconds from the first frame at which each is shown.
    ticks: (n,) int64, the same in the file's own unit: what a frame is found again by.
    turned: degrees counterclockwise, 0, 90, 180 or 270, by which stored pictures are turned.
    began: seconds since 1970 in UTC at which it says to have been taken, or None.
    notes: sentences on what is converted, mended or left out.
    """

    file: Path
    width: int
    height: int
    times: NDArray[np.float64]
    ticks: NDArray[np.int64]
    turned: int
    began: float | None
    notes: tuple[str, ...]


def read_film(path: str | PathLike[str]) -> Film:
    """Look at a film: sizes, the time of every frame, what is odd; one picture is decoded.

    Raises BadInput for a file that is missing, no film, a still picture or sound alone; whose index
    is missing (cut before it was finished) or whose pictures cannot be decoded; that is shorter
    than 5 s; and for sides of less than 120 or more than 8192 pixels. Of a film that breaks off
    later, what is there is read, with a note.

    >>> film = read_film("ride.mp4")  # doctest: +SKIP
    >>> film.width, film.height, len(film.times)  # doctest: +SKIP
    (1920, 1080, 1803)
    """
    file = Path(path)
    first_bytes(file, 16, _FILM, None)
    with _opened(file) as container:
        stream = _stream(file, container)
        promised = int(stream.frames)
        first, began = _first_picture(file, container, stream), _began(container, stream)
        aspect = _aspect(stream)
    with _opened(file) as container:
        ticks = _ticks(file, container, _stream(file, container))
        unit = float(container.streams.video[_number(container)].time_base)
    if len(ticks) < 2:
        raise BadInput(file, "film", "a still picture", "a film of a drive")
    times = (ticks - ticks[0]) * unit
    duration = float(times[-1] + np.median(np.diff(times)))
    if duration < SHORTEST:
        expected = f"at least {SHORTEST:g} s: a shorter film shows no street"
        raise BadInput(file, "duration", f"{duration:.1f} s", expected)
    width, height = _upright_size(first, aspect)
    if min(width, height) < SMALLEST_SIDE or max(width, height) > LARGEST_SIDE:
        expected = f"sides of {SMALLEST_SIDE} to {LARGEST_SIDE} pixels"
        raise BadInput(file, "size", f"{width} x {height} pixels", expected)
    notes = (*_notes(first, aspect, times), *_cut(len(ticks), promised))
    return Film(file, width, height, times, ticks, _turned(first), began, notes)


def film_luma(film: Film) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """Every frame in turn, fast: its number and its luma (height, width) uint8, as stored.

    One picture is in memory at a time. A frame that cannot be decoded is left out. Raises BadInput
    where the film cannot be decoded at all.
    """
    for number, frame in _decoded(film, 0):
        yield number, _upright(film, frame.to_ndarray(format="gray"))


def read_film_frame(film: Film, number: int) -> NDArray[np.uint8]:
    """One frame: (height, width, 3) uint8, RGB codes of sRGB; the same as of :func:`film_frames`.

    HDR (PQ, HLG) is converted, diffuse white becomes 255. Raises BadInput for a frame that cannot
    be decoded, IndexError for one that is not there.
    """
    for found, picture in film_frames(film, [number]):
        if found == number:
            return picture
    raise BadInput(film.file, f"frame {number}", "damaged", "a frame that can be decoded")


def film_frames(film: Film, numbers: list[int]) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """Some frames in rising order in one pass, as by :func:`read_film_frame`; damaged ones are
    left out."""
    wanted = sorted(set(numbers))
    if not wanted:
        return
    if wanted[0] < 0 or wanted[-1] >= len(film.ticks):
        raise IndexError(f"{film.file.name}: no frame {wanted[-1]} of {len(film.ticks)}")
    asked = set(wanted)
    for number, frame in _decoded(film, wanted[0]):
        if number in asked:
            yield number, _upright(film, _colours(frame))
        if number >= wanted[-1]:
            return


# ---- opening -----------------------------------------------------------------------------------


def _opened(file: Path) -> Any:
    import av

    try:
        return av.open(str(file), metadata_errors="replace")
    except av.error.FFmpegError as error:
        start = first_bytes(file, 12, _FILM, None)
        if start[4:8] in (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip"):
            found = "cut or damaged: its index is missing"
            expected = "a film that was finished; mend it (untrunc, the camera's own program)"
            raise BadInput(file, "content", found, expected) from error
        raise BadInput(file, "format", "unknown" if start else "empty", _FILM) from error
    except Exception as error:  # what a damaged header makes of PyAV
        raise BadInput(file, "content", "damaged", _FILM) from error


def _number(container: Any) -> int:
    """Which of the video streams is the film: the first that is no cover."""
    import av

    covers = av.stream.Disposition.attached_pic
    for number, stream in enumerate(container.streams.video):
        if not stream.disposition & covers:
            return number
    return -1


def _stream(file: Path, container: Any) -> Any:
    name = str(container.format.name)
    if name.endswith("_pipe") or name == "image2":
        raise BadInput(file, "film", "a still picture", _FILM)
    number = _number(container)
    if number < 0:
        found = "without pictures (sound alone)" if container.streams.audio else "without pictures"
        raise BadInput(file, "film", found, _FILM)
    stream = container.streams.video[number]
    stream.thread_type = "AUTO"
    return stream


def _first_picture(file: Path, container: Any, stream: Any) -> Any:
    import av

    try:
        for frame in container.decode(stream):
            if not frame.is_corrupt:
                return frame
    except av.error.FFmpegError as error:
        codec = shortened(str(stream.codec_context.name), 20)
        raise BadInput(file, "content", f"damaged ({codec})", "a film that plays") from error
    raise BadInput(file, "film", "without frames", "a film of a drive")


def _began(container: Any, stream: Any) -> float | None:
    from datetime import UTC, datetime

    said = stream.metadata.get("creation_time") or container.metadata.get("creation_time")
    try:
        when = datetime.fromisoformat(said)
    except (TypeError, ValueError):
        return None
    seconds = (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
    return seconds if seconds > 0 else None  # clocks that were never set begin in 1904 or 1970


def _ticks(file: Path, container: Any, stream: Any) -> NDArray[np.int64]:
    """When each frame is shown, in the stream's unit, rising."""
    import av

    found: set[int] = set()
    unknown = False
    try:
        for packet in container.demux(stream):
            if packet.size == 0 or packet.is_discard:
                continue
            unknown |= packet.pts is None
            if packet.pts is not None:
                found.add(packet.pts)
            if len(found) > MOST_FRAMES:
                raise BadInput(file, "frames", f"over {MOST_FRAMES}", "a shorter part of the film")
    except av.error.FFmpegError:
        pass  # it breaks off here; `_cut` tells
    if unknown:  # AVI and raw streams: only the decoder knows
        with _opened(file) as again:
            frames = _until_it_breaks(again, _stream(file, again))
            found = {frame.pts for frame in frames if frame.pts is not None}
    return np.array(sorted(found), np.int64)


def _until_it_breaks(container: Any, stream: Any) -> Iterator[Any]:
    """Decoded frames; damaged packets are passed over."""
    import av

    try:
        for packet in container.demux(stream):
            try:
                yield from packet.decode()
            except av.error.InvalidDataError:
                continue
    except av.error.FFmpegError:
        return


def _decoded(film: Film, first: int) -> Iterator[tuple[int, Any]]:
    """Frames from ``first`` on with their numbers."""
    with _opened(film.file) as container:
        stream = _stream(film.file, container)
        if first:
            container.seek(int(film.ticks[first]), stream=stream, backward=True)
        started = False
        for frame in _until_it_breaks(container, stream):
            if frame.pts is None or frame.is_corrupt:
                continue
            number = int(np.searchsorted(film.ticks, frame.pts))
            if number == len(film.ticks) or film.ticks[number] != frame.pts:
                continue
            if not started and number > first > 0:  # an index that leads too far
                break
            started = True
            if number >= first:
                yield number, frame
        else:
            return
    yield from ((number, frame) for number, frame in _decoded(film, 0) if number >= first)


# ---- pictures ----------------------------------------------------------------------------------


def _turned(frame: Any) -> int:
    return round(frame.rotation / 90) % 4 * 90


def _aspect(stream: Any) -> float:
    """Width of a pixel over its height."""
    ratio = stream.sample_aspect_ratio
    return float(ratio) if ratio and 0.2 < float(ratio) < 5 else 1.0


def _upright_size(frame: Any, aspect: float) -> tuple[int, int]:
    width, height = round(frame.width * aspect), frame.height
    return (height, width) if _turned(frame) in (90, 270) else (width, height)


def _colours(frame: Any) -> NDArray[np.uint8]:
    """(stored height, stored width, 3), codes of sRGB."""
    given: dict[str, Any] = {}
    if int(frame.colorspace) == _NOT_SAID and frame.height >= _HD:
        given["src_colorspace"] = _BT709
    if int(frame.color_trc) not in _HDR:
        return np.asarray(frame.to_ndarray(format="rgb24", **given))
    codes = frame.to_ndarray(format="rgb48le", **given)
    points = CodePoints(int(frame.color_primaries), int(frame.color_trc))
    if not points.are_known:
        points = CodePoints(9, int(frame.color_trc))
    light = light_of_code_points(codes, points)
    return np.rint(255 * srgb_of_light(np.minimum(light, 1))).astype(np.uint8)


def _upright(film: Film, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    turned = np.ascontiguousarray(np.rot90(picture, film.turned // 90))
    if turned.shape[:2] != (film.height, film.width):
        import cv2

        size = film.width, film.height
        turned = np.asarray(cv2.resize(turned, size, interpolation=cv2.INTER_AREA), np.uint8)
    return turned


def _notes(frame: Any, aspect: float, times: NDArray[np.float64]) -> list[str]:
    notes = []
    steps = np.diff(times)
    if _turned(frame):
        notes.append(f"Its pictures are turned by {_turned(frame)} degrees, as it says itself.")
    if not math.isclose(aspect, 1, abs_tol=1e-3):
        notes.append(f"Its pixels are {aspect:.3f} times as wide as high: made square.")
    if int(frame.color_trc) in _HDR:
        notes.append("It is HDR (PQ or HLG): converted to sRGB, what is brighter than white cut.")
    if frame.interlaced_frame:
        notes.append("It is interlaced: what moves fast is combed.")
    if steps.max() > _UNEVEN * max(steps.min(), 1e-9):
        notes.append(
            f"Its frames are shown for {1000 * steps.min():.0f} to {1000 * steps.max():.0f} ms: "
            "the times at which they are shown are used."
        )
    return notes


def _cut(found: int, promised: int) -> list[str]:
    if promised <= found:
        return []
    return [f"It breaks off: {found} of {promised} frames are there."]
