"""The paper's sizes: 15 layers, some 34 800 vertices, a 512 x 512 photograph."""

from __future__ import annotations

from typing import Any

import pytest

from assets_defs.launcher import Request
from assets_defs.photo_fur.graph import FUR


@pytest.mark.slow
def test_the_paper_preset_runs_and_passes_its_checks(house: Any) -> None:
    keys = [{"photo": "pelt", "mesh": mesh} for mesh in ("square", "teapot-large")]
    house.launcher.launch(Request(FUR, keys, preset="paper"))
    store = house.workspace.store
    shells = store.open(FUR.slot("shell_mesh", {"mesh": "teapot-large"}))
    assert shells.sizes["shell"] == 15
    assert abs(shells.sizes["vertex"] / 34_832 - 1) < 0.03
    frames = store.open(FUR.slot("fur_frames", keys[1]))
    assert dict(frames.sizes) == {"view": 4, "y": 960, "x": 1280, "channel": 3}
    photo = store.open(FUR.slot("fur_photo", {"photo": "pelt"}))
    assert photo.sizes["x"] == photo.sizes["y"] == 512
