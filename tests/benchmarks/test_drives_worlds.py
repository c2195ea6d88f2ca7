"""How worlds are judged: the truth is right, and what is given wrongly is not."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.drives_worlds import (
    FRAMES,
    Case,
    Drive,
    alone_cases,
    as_given,
    fits,
    mirrored,
    noisy,
    rig_cases,
    scaled,
)
from pipelines.virtual.city.drive import plan_drive


@pytest.fixture(scope="module")
def rig() -> Drive:
    plan = plan_drive(FRAMES, 3.0, 64, 40, camera_height=1.9)
    return Drive(np.zeros((FRAMES, 3, 4, 6, 3), np.uint8), plan.poses, plan.intrinsics)


def test_there_are_enough_of_them_and_if_nothing_is_done_few_are_right(rig: Drive) -> None:
    cases = rig_cases(rig)
    assert len(cases) + len(alone_cases(Drive(*(rig[0][:, :1], rig[1][:, :1], rig[2][:1])))) >= 40
    assert len({case.name for case in cases}) == len(cases)
    right = {
        case.name for case in cases if case.refused is None and fits(as_given(case), case, rig)
    }
    assert right == {"as it is", "places off by centimetres", "in any order", "the other way"}


def test_a_world_is_right_wherever_its_zero_is_and_x_points(rig: Drive) -> None:
    c, s = np.cos(1.1), np.sin(1.1)
    turn = np.array([[c, -s, 0, 70.0], [s, c, 0, -9], [0, 0, 1, 4], [0, 0, 0, 1]])
    for poses, right in (
        (turn @ rig.poses, True),
        (scaled(rig.poses, 1.1), False),
        (mirrored(rig.poses, 0), False),
        (noisy(rig.poses, 0.5, 2.0), False),
        (np.diag([1.0, -1, -1, 1]) @ rig.poses, False),
    ):
        case = Case("one", rig._replace(poses=poses))
        assert fits(as_given(case), case, rig) == right
