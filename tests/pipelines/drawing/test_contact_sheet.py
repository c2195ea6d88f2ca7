"""Sheets: every picture found again in its place."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.drawing.contact_sheet import contact_sheet


@pytest.mark.parametrize(
    ("count", "layout"),
    [
        (1, [[0]]),
        (2, [[0, 1]]),
        (3, [[0, 1], [2, None]]),
        (4, [[0, 1], [2, 3]]),
        (5, [[0, 1, 2], [3, 4, None]]),
        (8, [[0, 1, 2, 3], [4, 5, 6, 7]]),
    ],
)
def test_a_contact_sheet_lies_in_at_most_two_rows(
    count: int, layout: list[list[int | None]]
) -> None:
    pictures = np.random.default_rng(1).integers(1, 256, (count, 5, 7, 3), dtype=np.uint8)
    sheet = contact_sheet(pictures)
    assert sheet.dtype == np.uint8
    assert sheet.shape == (5 * len(layout), 7 * len(layout[0]), 3)
    for row, line in enumerate(layout):
        for column, number in enumerate(line):
            part = sheet[5 * row : 5 * row + 5, 7 * column : 7 * column + 7]
            np.testing.assert_array_equal(part, 0 if number is None else pictures[number])
