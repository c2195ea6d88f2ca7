"""What a light probe's values may be, and what becomes of those that are no radiance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.pictures.exr_files import LARGEST_HALF

_MOST_MISSING = 0.01  # of the texels
_MOST_NEGATIVE = 0.5


def mended(file: Path, light: NDArray[Any]) -> tuple[NDArray[np.float32], tuple[str, ...]]:
    """Radiance of what a file holds, and a sentence on each kind of value that was mended.

    ``light`` is (height, width, channels), equirectangular. Values that are no number become the
    mean of those around (the left edge being beside the right one), infinite ones the half's
    largest, negative ones 0; in place, where the array is of float32.

    Raises BadInput where more than a hundredth of the texels are no number, or more than half
    negative, and for a picture that is all black.
    """
    notes = []
    with np.errstate(over="ignore"):  # a double beyond float32 becomes infinite
        light = light.astype(np.float32, copy=False)
    missing = ~(light > -np.inf)
    if missing.any():
        count = _texels(missing)
        _check_share(file, "no number", count, missing, _MOST_MISSING)
        _fill(light, missing)
        notes.append(f"{_were(count)} no number and filled from the texels around.")
    infinite = np.isinf(light)
    if infinite.any():
        light[infinite] = LARGEST_HALF
        notes.append(f"{_were(_texels(infinite))} infinite and became {LARGEST_HALF:g}.")
    negative = light < 0
    if negative.any():
        count = _texels(negative)
        _check_share(file, "negative", count, negative, _MOST_NEGATIVE)
        notes.append(f"{_were(count)} negative (the least {light.min():.3g}) and became 0.")
        light[negative] = 0
    if light.max() == 0:
        raise BadInput(file, "picture", "all black", "an environment with light in it")
    return light, tuple(notes)


def _texels(bad: NDArray[np.bool_]) -> int:
    return int(np.count_nonzero(bad.any(axis=2)))


def _were(count: int) -> str:
    return "1 texel was" if count == 1 else f"{count} texels were"


def _check_share(file: Path, what: str, count: int, bad: NDArray[np.bool_], most: float) -> None:
    texels = bad.shape[0] * bad.shape[1]
    if count > most * texels:
        raise BadInput(
            file,
            "picture",
            f"{what} in {count} of {texels} texels",
            f"radiance: at most {most:.0%} of them are mended, so render or save it again",
        )


def _fill(light: NDArray[np.float32], missing: NDArray[np.bool_]) -> None:
    """In place, from the edges of holes inwards."""
    height, width, _ = light.shape
    light[missing] = np.nan
    rows, columns, channels = np.nonzero(missing)
    while len(rows):
        total = np.zeros(len(rows))
        count = np.zeros(len(rows))
        for down in (-1, 0, 1):
            for across in (-1, 0, 1):
                beside = light[
                    (rows + down).clip(0, height - 1), (columns + across) % width, channels
                ]
                known = np.isfinite(beside)
                total += np.where(known, beside, 0)
                count += known
        found = count > 0
        if not found.any():  # all that is known is infinite
            light[rows, columns, channels] = 0
            return
        light[rows[found], columns[found], channels[found]] = total[found] / count[found]
        rows, columns, channels = rows[~found], columns[~found], channels[~found]
