"""Frames that are kept to judge by."""

from __future__ import annotations

import numpy as np

from pipelines.street_billboards.capture.held_out import FEWEST_FRAMES, held_out


def test_every_tenth_frame_is_held_out() -> None:
    assert np.flatnonzero(held_out(26)).tolist() == [5, 15, 25]


def test_the_shortest_drive_has_one_with_neighbours() -> None:
    (kept,) = np.flatnonzero(held_out(FEWEST_FRAMES))
    assert 0 < kept < FEWEST_FRAMES - 1
    assert kept == FEWEST_FRAMES - 2
