"""Cameras and times that only the names of files tell."""

from __future__ import annotations

import pytest

from storage.readers.drives.naming import by_number, cameras_and_times


def told(*names: str) -> list[tuple[str, float]]:
    return cameras_and_times(names)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["1.png", "2.png", "10.png"], [("camera", 1), ("camera", 2), ("camera", 10)]),
        (["frame_00001.jpg", "frame_00002.jpg"], [("frame", 1), ("frame", 2)]),
        (["left/1.png", "right/1.png", "left/2.png"], [("left", 1), ("right", 1), ("left", 2)]),
        (["a_1.png", "b_1.png", "a_2.png", "b_2.png"],
         [("a", 1), ("b", 1), ("a", 2), ("b", 2)]),
        (["1_left.png", "1_right.png", "2_left.png", "2_right.png"],
         [("left", 1), ("right", 1), ("left", 2), ("right", 2)]),
        # Of two numbers the one with most values is the time; the other is the camera's.
        (["cam1_007.png", "cam2_007.png", "cam1_008.png", "cam2_008.png", "cam1_009.png"],
         [("cam1", 7), ("cam2", 7), ("cam1", 8), ("cam2", 8), ("cam1", 9)]),
        (["3_cam1.png", "3_cam2.png", "4_cam1.png", "4_cam2.png", "5_cam1.png"],
         [("cam1", 3), ("cam2", 3), ("cam1", 4), ("cam2", 4), ("cam1", 5)]),
        # Numbers of folders are cameras' ones; where files have none, they are times.
        (["cam9/1.png", "cam10/1.png", "cam9/2.png"],
         [("cam9", 1), ("cam10", 1), ("cam9", 2)]),
        (["0001/left.png", "0001/right.png", "0002/left.png"],
         [("left", 1), ("right", 1), ("left", 2)]),
        # No numbers, and numbers that pair nothing: one camera, as people sort names.
        (["b.png", "a.png", "c.png"], [("camera", 1), ("camera", 0), ("camera", 2)]),
        (["IMG_20240131_235959.jpg", "IMG_20240201_000001.jpg", "IMG_20240201_000004.jpg"],
         [("camera", 0), ("camera", 1), ("camera", 2)]),
        (["x/a2.png", "x/a10.png", "x/b7.png", "x/a2.jpg"],
         [("x", 1), ("x", 2), ("x", 3), ("x", 0)]),
        # Backslashes, points, endings that are none.
        ([".\\images\\a1", "./images/a2.JPG"], [("images/a", 1), ("images/a", 2)]),
        (["shot.0001", "shot.0002"], [("shot", 1), ("shot", 2)]),
        (["1" * 500 + ".png", "2" * 500 + ".png"],
         [("camera", float("1" * 18)), ("camera", float("2" * 18))]),
        ([], []),
    ],
)  # fmt: skip
def test_names(names: list[str], expected: list[tuple[str, float]]) -> None:
    assert told(*names) == expected


def test_many_names_at_once() -> None:
    names = [f"c{camera}/{time}.png" for time in range(10_000) for camera in range(4)]
    assert told(*names)[4 * 77 + 2] == ("c2", 77)


def test_as_people_sort() -> None:
    names = ["b10", "b9", "a", "10", "9", "b9a", ""]
    assert sorted(names, key=by_number) == ["", "9", "10", "a", "b9", "b9a", "b10"]
