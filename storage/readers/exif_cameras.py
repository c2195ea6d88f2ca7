"""What EXIF says of the camera of a photograph: its focal length in pixels, when and where it was.

EXIF 2.32 (CIPA DC-008): FocalLength with FocalPlaneXResolution, FocalLengthIn35mmFilm, dates, GPS.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from storage.readers.bad_input import BadInput
from storage.readers.pictures.decoded_image import damaged
from storage.readers.pictures.image_decoding import FORMATS

_DIAGONAL_35 = math.hypot(36.0, 24.0)
_UNITS = {2: 25.4, 3: 10.0, 4: 1.0}
"""Millimetres of FocalPlaneResolutionUnit: inch, centimetre, millimetre."""
_BY_SENSOR, _BY_FILM = 0.01, 0.03
"""Relative deviation of a focal length: of the lens as built; of whole millimetres, too."""
_RANGE = 0.2, 10.0
"""Of a focal length, in widths of the picture."""


class ExifCamera(NamedTuple):
    """What a photograph says; nan or None: nothing.

    width, height: pixels, upright.
    focal, focal_deviation: pixels.
    time: seconds since 1970; without a time zone as if of UTC.
    place: degrees north, degrees east, metres above the sea.
    """

    width: int
    height: int
    focal: float
    focal_deviation: float
    time: float | None
    place: tuple[float, float, float] | None


def read_exif_camera(file: Path) -> ExifCamera:
    """What the head of a photograph says of its camera; no pixel is decoded.

    Raises BadInput for a file that is missing, unreadable or no picture.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(file) as image:
            size = image.size
            tags = image.getexif()
            exif, gps = dict(tags.get_ifd(0x8769)), dict(tags.get_ifd(0x8825))
            orientation = tags.get(0x0112, 1)
            when = tags.get(0x0132)
    except FileNotFoundError:
        raise BadInput(file, "file", "missing", FORMATS) from None
    except UnidentifiedImageError:
        raise BadInput(file, "format", "unknown", FORMATS) from None
    except Exception as error:  # what damaged headers make of Pillow
        raise damaged(file, "picture") from error
    focal, deviation = _focal(exif, size)
    width, height = size[::-1] if orientation in (5, 6, 7, 8) else size
    return ExifCamera(width, height, focal, deviation, _time(exif, when), _place(gps))


def _focal(exif: Mapping[int, Any], size: tuple[int, int]) -> tuple[float, float]:
    """Pixels of a picture (width, height) as stored, and the deviation."""
    longest = max(size)
    length, resolution = _number(exif.get(0x920A)), _number(exif.get(0xA20E))
    full = max(_number(exif.get(0xA002)), _number(exif.get(0xA003)))
    unit = _UNITS.get(exif.get(0xA210, 2), math.nan)
    # Of a picture that was made smaller, the resolution is still that of the sensor.
    shrunk = longest / full if full >= longest else 1.0
    by_sensor = length * resolution / unit * shrunk
    by_film = _number(exif.get(0xA405)) / _DIAGONAL_35 * math.hypot(*size)
    for focal, deviation in ((by_sensor, _BY_SENSOR), (by_film, _BY_FILM)):
        if _RANGE[0] * longest <= focal <= _RANGE[1] * longest:
            return focal, deviation * focal
    return math.nan, math.nan


def _number(value: Any) -> float:
    try:
        found = float(value)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return math.nan
    return found if math.isfinite(found) and found > 0 else math.nan


def _time(exif: Mapping[int, Any], changed: Any) -> float | None:
    for tag, part, zone in ((0x9003, 0x9291, 0x9011), (0x9004, 0x9292, 0x9012)):
        found = _seconds(exif.get(tag), exif.get(part), exif.get(zone))
        if found is not None:
            return found
    return _seconds(changed, None, exif.get(0x9010))


def _seconds(text: Any, part: Any, zone: Any) -> float | None:
    try:
        when = datetime.strptime(str(text).strip("\0 "), "%Y:%m:%d %H:%M:%S").replace(tzinfo=UTC)
        digits = str(part).strip("\0 ") if part is not None else ""
        seconds = when.timestamp() + (float(f"0.{digits}") if digits.isdigit() else 0.0)
    except (ValueError, OverflowError):
        return None
    sign, hours, minutes = str(zone)[:1], str(zone)[1:3], str(zone)[4:6]
    if sign in "+-" and hours.isdigit() and minutes.isdigit():
        ahead = timedelta(hours=int(hours), minutes=int(minutes)).total_seconds()
        seconds -= ahead if sign == "+" else -ahead
    return seconds


def _place(gps: Mapping[int, Any]) -> tuple[float, float, float] | None:
    degrees = []
    for tag, reference, negative, largest in ((2, 1, "S", 90.0), (4, 3, "W", 180.0)):
        try:
            whole, minutes, seconds = (float(value) for value in gps[tag])
        except (KeyError, TypeError, ValueError, ZeroDivisionError):
            return None
        value = whole + minutes / 60 + seconds / 3600
        if not value <= largest:
            return None
        degrees.append(-value if str(gps.get(reference, "")).startswith(negative) else value)
    if degrees == [0.0, 0.0]:  # what receivers write that know nothing yet
        return None
    try:
        height = float(gps[6]) * (-1 if gps.get(5) in (1, b"\x01") else 1)
    except (KeyError, TypeError, ValueError, ZeroDivisionError):
        height = math.nan
    return degrees[0], degrees[1], height
