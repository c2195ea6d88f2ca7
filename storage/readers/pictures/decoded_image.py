"""A picture as its file stores it, and as it is meant: upright, alpha apart, without a profile."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.pictures.code_points import CodePoints, light_of_code_points
from storage.readers.pictures.colour_profiles import without_profile

Space = Literal["grey", "RGB", "CMYK"]

_UPRIGHT: dict[object, Callable[[NDArray[Any]], NDArray[Any]]] = {
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: a.swapaxes(0, 1)[:, ::-1],
    7: lambda a: a.swapaxes(0, 1)[::-1, ::-1],
    8: lambda a: a.swapaxes(0, 1)[::-1],
}  # EXIF 2.32, tag 0x0112: what a stored array needs to stand upright


class DecodedImage(NamedTuple):
    """What a picture file holds, upright, the top row first.

    ``colours``: (height, width, 1 or 3), grey or RGB with the primaries of sRGB; unsigned
    integers are codes of the sRGB curve, floats are linear. ``alpha``: (height, width) float32
    in [0, 1], with which the colours are not multiplied, or None where the file has none.
    ``notes``: sentences on what was converted, mended or left out.
    """

    colours: NDArray[Any]
    alpha: NDArray[np.float32] | None
    notes: tuple[str, ...] = ()

    @property
    def opaque(self) -> NDArray[np.bool_] | None:
        """Where nothing shines through."""
        return None if self.alpha is None else self.alpha >= 1


class StoredPicture(NamedTuple):
    """What a decoder finds.

    ``values``: (height, width, channels of the space), unsigned integers that use their type's
    whole range, or floats; ``alpha``: as of ``DecodedImage``; ``profile``: an ICC profile;
    ``orientation``: as EXIF has it, 1 to 8, anything else is upright.
    """

    values: NDArray[Any]
    space: Space
    alpha: NDArray[np.float32] | None = None
    profile: bytes | None = None
    orientation: object = 1
    notes: tuple[str, ...] = ()


def decoded(stored: StoredPicture) -> DecodedImage:
    """Colours converted to sRGB, and all turned upright."""
    colours, notes = without_profile(stored.values, stored.profile)
    if stored.space == "CMYK" and colours.shape[2] == 4:
        colours = rgb_of_inks(colours)
        notes = (*notes, "The inks (CMYK) have no profile: a plain formula made them colours.")
    turn = _UPRIGHT.get(stored.orientation, lambda a: a)
    alpha = None if stored.alpha is None else turn(stored.alpha)
    return DecodedImage(turn(colours), alpha, (*stored.notes, *notes))


def by_code_points(
    file: Path, stored: StoredPicture, points: CodePoints, *, is_full_range: bool = True
) -> StoredPicture:
    """Colours that code points describe, as linear light unless they are sRGB's already.

    A limited range (16 to 235 of 8 bits) is widened. Raises BadInput for curves and primaries that
    are not known.
    """
    if not points.are_known:
        raise BadInput(
            file,
            "colour code points",
            f"primaries {points.primaries}, transfer {points.transfer}",
            "those of sRGB, Display P3, BT.2020, PQ or HLG; export it as sRGB",
        )
    values = stored.values
    if not is_full_range:
        step = 1 << (8 * values.dtype.itemsize - 8)
        full = np.iinfo(values.dtype).max
        widened = (values.astype(np.float32) - 16 * step) / (219 * step)
        values = np.rint(np.clip(widened, 0, 1) * full).astype(values.dtype)
    if points.are_srgb:
        return stored._replace(values=values, profile=None)
    light = light_of_code_points(values, points)
    note = f"The colours were converted to sRGB from {points.name}."
    return stored._replace(values=light, profile=None, notes=(*stored.notes, note))


def rgb_of_inks(inks: NDArray[Any]) -> NDArray[Any]:
    """Codes of sRGB of inks (..., 4), C, M, Y and K with 0 for none, without a profile: each ink
    takes its part of the light, as most programs have it."""
    full = np.iinfo(inks.dtype).max
    light = full - inks.astype(np.uint64)
    return ((light[..., :3] * light[..., 3:] + full // 2) // full).astype(inks.dtype)


def straight(values: NDArray[Any], alpha: NDArray[np.float32]) -> NDArray[Any]:
    """Colours that a file has multiplied with alpha, without it; black where alpha is 0."""
    scale = np.divide(1, alpha, out=np.zeros_like(alpha), where=alpha > 0)
    if values.dtype.kind == "f":
        return values * scale[..., None]
    full = np.iinfo(values.dtype).max
    return np.minimum(np.rint(values * scale[..., None]), full).astype(values.dtype)


def damaged(file: Path, kind: str) -> BadInput:
    """What to raise where a decoder gives up."""
    return BadInput(
        file, "content", "truncated or damaged", f"a complete {kind} file; copy or save it again"
    )
