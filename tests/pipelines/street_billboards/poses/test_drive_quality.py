"""What is said of a drive before a long run: good ones, and ones that lack something."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.street_billboards.poses.drive_quality import ENOUGH_FRAMES, drive_quality
from pipelines.street_billboards.poses.found_poses import guessed_pinhole
from pipelines.street_billboards.poses.mapping import Pinhole
from tests.pipelines.street_billboards.poses.corridor import (
    HEIGHT,
    WIDTH,
    lens,
    path,
    photograph,
    swerving,
)

FRAMES = 9


def _pinhole() -> Pinhole:
    k = lens()
    return Pinhole(WIDTH, HEIGHT, float(k[0, 0]), (float(k[0, 2]), float(k[1, 2])), is_known=True)


def test_a_good_drive_lacks_nothing() -> None:
    film = [photograph(pose, lens()) for pose in swerving(FRAMES, 0.6)]
    quality = drive_quality(film, _pinhole(), frames=200)
    assert quality.is_good
    assert (quality.asked, quality.registered) == (FRAMES, FRAMES)
    assert quality.focal == pytest.approx(lens()[0, 0])
    assert quality.focal_deviation == 0.0
    assert quality.points > 60
    assert quality.residual < 0.5
    assert 0.01 < quality.parallax < 0.3
    short = drive_quality(film, _pinhole(), frames=ENOUGH_FRAMES - 1)
    assert len(short.lacking) == 1
    assert "Only 19 frames" in short.lacking[0]


def test_a_straight_drive_lacks_a_focal_length() -> None:
    along = np.column_stack([np.zeros(FRAMES), np.zeros(FRAMES), 0.6 * np.arange(FRAMES)])
    film = [photograph(pose, lens()) for pose in path(along, np.zeros(FRAMES))]
    quality = drive_quality(film, guessed_pinhole(WIDTH, HEIGHT), frames=200)
    assert not quality.is_good
    assert any("hardly tells its focal length" in sentence for sentence in quality.lacking)
    off = abs(quality.focal - lens()[0, 0])
    assert off < 3 * quality.focal_deviation


def test_a_car_that_stands_has_neither_parallax_nor_poses() -> None:
    film = [photograph(np.eye(4), lens())] * FRAMES
    quality = drive_quality(film, _pinhole(), frames=200)
    assert quality.registered == 0
    assert quality.parallax < 0.001
    assert any("farther apart" in sentence for sentence in quality.lacking)
    assert any("found poses of 0" in sentence for sentence in quality.lacking)
    with pytest.raises(ValueError, match="at least two"):
        drive_quality(film[:1], _pinhole(), frames=200)
