"""What stands still in a film: a planted bonnet, a planted date stamp; and nothing."""

from __future__ import annotations

import functools

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.street_billboards.poses.still_parts import still_parts
from tests.pipelines.street_billboards.poses.corridor import (
    HEIGHT,
    WIDTH,
    lens,
    photograph,
    swerving,
)

FRAMES = 14


@functools.cache
def _film() -> tuple[NDArray[np.uint8], ...]:
    return tuple(photograph(pose, lens()) for pose in swerving(FRAMES, 0.7))


def _bonnet() -> NDArray[np.bool_]:
    row, column = np.mgrid[:HEIGHT, :WIDTH]
    return row > HEIGHT - 34 + ((column - WIDTH / 2) / 55.0) ** 2 * 2


def _with_bonnet(number: int, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Dark paint with a rim that shines and reflections that pass over it, and noise."""
    random = np.random.default_rng(number)
    row, column = np.mgrid[:HEIGHT, :WIDTH]
    paint = 60 + 25 * np.sin(column / 60 + number) + 0.2 * (HEIGHT - row)
    where = _bonnet()
    rim = where & ~cv2.erode(where.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    paint[rim] = 150
    shown = np.where(where, paint + random.normal(scale=1.0, size=paint.shape), picture)
    return np.clip(np.rint(shown), 0, 255).astype(np.uint8)


def _with_stamp(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    shown = picture.copy()
    cv2.putText(shown, "2024-05-01", (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.5, 255, 2)
    return shown


def test_the_bonnet_is_found() -> None:
    found = still_parts(_with_bonnet(*row) for row in enumerate(_film()))
    bonnet = _bonnet()
    assert found[bonnet].mean() > 0.9
    assert found[~bonnet].mean() < 0.04


def test_a_date_stamp_is_found() -> None:
    stamp = np.zeros((HEIGHT, WIDTH), np.uint8)
    written = _with_stamp(stamp) > 0
    found = still_parts(_with_stamp(picture) for picture in _film())
    assert found[written].mean() > 0.9
    around = cv2.dilate(written.astype(np.uint8), np.ones((21, 21), np.uint8)) > 0
    assert found[~around].mean() < 0.02


def test_a_film_without_still_parts_has_none() -> None:
    """The sky above is as smooth as a bonnet, and stays."""
    assert still_parts(_film()).mean() < 0.01


def test_too_few_frames_tell_nothing() -> None:
    with pytest.raises(ValueError, match="found 5 frames; expected at least 12"):
        still_parts(_film()[:5])
