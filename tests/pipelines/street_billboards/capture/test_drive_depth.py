"""Depth of a drive's frames before the sky, on a street of exact depth."""

from __future__ import annotations

import numpy as np

from pipelines.street_billboards.capture.drive_depth import RigFrame, depth_before_sky, drive_sky
from pipelines.street_billboards.capture.sky import SkyView, sky_map
from pipelines.street_billboards.capture.stereo import depth_maps
from tests.pipelines.street_billboards.stereo_street import frame_at

REACH = {"nearest": 2.0, "farthest": 40.0}


def _frame(place: float = 0.0) -> RigFrame:
    frame = frame_at(place)
    return RigFrame(frame.photographs, frame.intrinsics, frame.poses)


def test_the_sky_is_infinitely_far_and_the_rest_as_stereo_has_it() -> None:
    frame, truth = _frame(), frame_at(0.0).depth
    stereo = depth_maps(*frame, **REACH)
    found = depth_before_sky(frame, **REACH)
    sky = np.isinf(found.depth)
    assert sky[np.isnan(truth)].mean() > 0.5
    assert sky[np.isfinite(truth)].mean() < 0.02
    np.testing.assert_array_equal(found.depth[~sky], stereo.depth[~sky])
    np.testing.assert_array_equal(found.deviation, stereo.deviation)
    assert found.depth.dtype == np.float32


def test_the_drives_sky_is_of_half_a_dozen_frames() -> None:
    loaded: list[int] = []

    def load(frame: int) -> RigFrame:
        loaded.append(frame)
        return _frame()._replace(photographs=np.full((3, 200, 320, 3), frame, np.uint8))

    drive_sky(load, np.arange(100, 130), **REACH)
    assert loaded == [100, 105, 110, 115, 120, 125]
    loaded.clear()
    drive_sky(load, [4, 7], **REACH)
    assert loaded == [4, 7]


def test_the_drives_sky_is_the_map_of_these_frames() -> None:
    views = []
    for place in (0.0, 3.0):
        frame = _frame(place)
        maps = depth_maps(*frame, **REACH)
        columns = (frame.photographs, maps.depth, frame.intrinsics, frame.poses)
        views += [SkyView(*one) for one in zip(*columns, strict=True)]
    found = drive_sky(_frame, [0.0, 3.0], **REACH)  # type: ignore[list-item]
    np.testing.assert_array_equal(found, sky_map(views))
    assert found[20].max() > 0.3
