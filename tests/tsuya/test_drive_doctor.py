"""``tsuya doctor --drive``: what a drive is good for, in a line each."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from storage.readers.bad_input import BadInput
from tests.assets_defs.test_street_unposed import write_rig
from tsuya.drive_doctor import examine_drive


def test_a_drive_with_poses_is_told_to_fit_or_not(tmp_path: Path) -> None:
    rig = tmp_path / "rig"
    write_rig(rig)
    found = {one.requirement: one for one in examine_drive(rig)}
    assert found["drive"].found == "8 frames of 3 camera(s), 256 x 160 pixels, with poses"
    assert found["poses"].met
    assert "21 m of road" in found["poses"].found
    assert found["neighbouring frames"].met
    listed = json.loads((rig / "transforms.json").read_text())
    random = np.random.default_rng(0)
    for row in listed["frames"]:
        row["transform_matrix"][1][3] += 6.0 * row["time"] * random.uniform(0.9, 1.1)
    (rig / "transforms.json").write_text(json.dumps(listed))
    with pytest.raises(BadInput, match="cameras"):  # no rig any more
        examine_drive(rig)


def test_what_is_no_drive_is_refused(tmp_path: Path) -> None:
    (tmp_path / "film.mp4").write_bytes(b"no film at all, whatever its name says")
    with pytest.raises(BadInput, match=r"film\.mp4"):
        examine_drive(tmp_path / "film.mp4")


def test_several_cameras_without_poses_are_refused(tmp_path: Path) -> None:
    for camera in ("image_0", "image_1"):
        (tmp_path / "drive" / camera).mkdir(parents=True)
        for number in range(4):
            picture = np.full((40, 60), 30 * number, np.uint8)
            assert cv2.imwrite(str(tmp_path / "drive" / camera / f"{number:06d}.png"), picture)
    rows = [f"P{number}: 50 0 30 {-20 * number} 0 50 20 0 0 0 1 0" for number in range(2)]
    (tmp_path / "drive" / "calib.txt").write_text("\n".join(rows))
    found = examine_drive(tmp_path / "drive")[-1]
    assert not found.met
    assert "has 2 cameras and no poses; expected poses, or one camera" in found.found
