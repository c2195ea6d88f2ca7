"""All steps at once on a street of exact depth: what is drawn is what the cameras saw."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.drawing.picture_metrics import psnr
from pipelines.street_billboards.capture.drive_depth import RigFrame
from pipelines.street_billboards.figures import match_exposure
from pipelines.street_billboards.frames import draw_view
from pipelines.street_billboards.whole_street import street_of_frames
from tests.pipelines.street_billboards.stereo_street import frame_at

SIZE = (320, 200)


def _rig(place: float) -> RigFrame:
    frame = frame_at(place)
    return RigFrame(frame.photographs, frame.intrinsics, frame.poses)


@pytest.mark.parametrize("places", [(0.0,), (0.0, 3.0)], ids=["one frame", "two frames"])
def test_a_street_of_frames_looks_as_it_was_photographed(places: tuple[float, ...]) -> None:
    street = street_of_frames([_rig(place) for place in places], voxel=0.8)
    assert 0.02 < street.billboards.turns.mean() < 0.9
    seen = _rig(0.0)
    shown = draw_view(street, seen.intrinsics[1], seen.poses[1], SIZE)
    truth = seen.photographs[1]
    near = frame_at(0.0).depth[1] < 15.0
    assert psnr(match_exposure(shown, truth, near), truth, near) > 20.0
    # The sky is the sky's mean above the houses.
    sky = np.isnan(frame_at(0.0).depth[1])
    assert np.abs(shown[sky].astype(int) - truth[sky]).mean() < 25


def test_frames_without_depth_are_refused() -> None:
    blank = _rig(0.0)
    blank = blank._replace(photographs=np.full_like(blank.photographs, 128))
    with pytest.raises(ValueError, match="expected"):
        street_of_frames([blank])
