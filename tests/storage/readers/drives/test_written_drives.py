"""One drive, as seventeen other programs and descriptions write it, comes back the same."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.written_drives import FORMS, comparing
from benchmarks.written_drives.truth import K, true_pictures, true_poses
from storage.readers.drives import read_drive
from storage.readers.drives.formats import FORMATS

TOTALS = {"transforms_blender": 6, "transforms_panorama": 24, "colmap_older_text": 6,
          "kitti_other_program": 6, "kitti_commas": 6}  # fmt: skip
"""Photographs of forms that have not two cameras."""


@pytest.mark.parametrize("form", FORMS)
def test_what_is_written_comes_back(form: str, tmp_path: Path) -> None:
    written = FORMS[form](tmp_path / "drive")
    assert comparing._mismatches(written) == 0
    # And the comparison sees what is a hundredth of a millimetre off, or a code in one pixel.
    moved = written.poses.copy()
    moved[2, 0, 1, 3] += 1e-5
    assert comparing._mismatches(written._replace(poses=moved)) == 1
    if written.codes == 0:
        pictures = [[picture.copy() for picture in row] for row in written.pictures]
        pictures[1][0][3, 4, 1] ^= 1
        assert comparing._mismatches(written._replace(pictures=pictures)) == 1
    shifted = written.intrinsics + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    total = TOTALS.get(form, 12)
    assert comparing._mismatches(written._replace(intrinsics=shifted)) == total
    assert comparing._mismatches(written._replace(notes=("nobody says this",))) == total
    assert comparing._mismatches(written._replace(path=tmp_path)) == total


def test_distortion_that_is_not_undone_is_seen(tmp_path: Path) -> None:
    """The null of the forms that are compared to two codes: the photographs as they are stored."""
    for form in ("transforms_distorted", "transforms_fisheye", "colmap_two_pieces"):
        written = FORMS[form](tmp_path / form)
        drive = read_drive(written.path)
        plain = drive._replace(
            lenses=tuple(
                tuple(lens and lens._replace(model="pinhole", coefficients=()) for lens in row)
                for row in drive.lenses
            )
        )
        assert sum(comparing._off(plain, written, i) for i in range(6)) == 12, form


def test_each_format_is_written_and_named(tmp_path: Path) -> None:
    found = {}
    for form, write in FORMS.items():
        path = write(tmp_path / form).path
        known = [known.name for known in FORMATS if known.find(path)]
        assert len(known) == 1, form
        found[form] = known[0]
    assert set(found.values()) == {known.name for known in FORMATS}
    assert len(FORMS) >= 12
    for known in FORMATS:
        assert known.known_by
        assert known.sentence.endswith(".")


def test_the_most_specific_format_is_read(tmp_path: Path) -> None:
    """transforms.json beside a COLMAP model, as nerfstudio leaves them; and a note of the other."""
    FORMS["colmap_text"](tmp_path / "drive")
    FORMS["transforms_nerfstudio"](tmp_path / "drive")
    drive = read_drive(tmp_path / "drive")
    assert drive.file.name == "transforms.json"
    assert "also in the form of COLMAP" in drive.notes[0]


def test_units_and_up_are_known_where_the_format_says_so(tmp_path: Path) -> None:
    known_of = dict.fromkeys(("transforms_fields", "colmap_text"), False)
    known_of |= dict.fromkeys(("kitti_sequence", "kitti_raw", "nuscenes"), True)
    for form, known in known_of.items():
        drive = read_drive(FORMS[form](tmp_path / form).path)
        assert drive.metric is known, form
        assert drive.up_known is known, form


def change_json(file: Path, change: Callable[[Any], object]) -> None:
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


def test_a_world_that_was_turned_moved_and_scaled_comes_back(tmp_path: Path) -> None:
    written = FORMS["transforms_fields"](tmp_path / "drive")
    turned = np.array([[0, 1.0, 0, 7], [1, 0, 0, -3], [0, 0, -1, 2], [0, 0, 0, 1]])
    turned[:3, :3] *= 0.25  # a scale inside, and one more apart

    def change(top: Any) -> None:
        for frame in top["frames"]:
            matrix = np.array(frame["transform_matrix"])
            matrix[:3, :3] = turned[:3, :3] / 0.25 @ matrix[:3, :3]
            matrix[:3, 3] = 3 * (turned @ np.array(frame["transform_matrix"])[:, 3])[:3]
            frame["transform_matrix"] = matrix.tolist()
        top |= {"applied_transform": turned[:3].tolist(), "applied_scale": 3.0}

    change_json(tmp_path / "drive" / "transforms.json", change)
    assert comparing._mismatches(written) == 0


def test_times_of_one_instant_may_differ_by_a_quarter_of_a_step(tmp_path: Path) -> None:
    written = FORMS["transforms_fields"](tmp_path / "drive")  # a step is 100, 3 apart
    file = tmp_path / "drive" / "transforms.json"
    assert read_drive(written.path).times.tolist() == [1000.0 + 100 * i for i in range(6)]

    def later(by: float) -> Callable[[Any], None]:
        def change(top: Any) -> None:
            for frame in top["frames"]:
                if frame["camera"] == "right":
                    frame["time"] += by

        return change

    change_json(file, later(21))  # 24 apart
    assert read_drive(written.path).present.all()
    change_json(file, later(4))  # 28 apart
    drive = read_drive(written.path)
    assert drive.present.sum(axis=1).tolist() == [1] * 12
    assert "12 instants of 12 without a photograph of each camera" in drive.notes[-1]


def test_kitti_without_poses_has_pictures_and_lenses(tmp_path: Path) -> None:
    written = FORMS["kitti_other_program"](tmp_path / "drive")
    (written.path / "poses.txt").unlink()
    drive = read_drive(written.path)
    assert np.isnan(drive.poses).all()
    np.testing.assert_allclose(drive.intrinsics, K[None])
    assert drive.present.all()
    assert any("poses are to be found" in note for note in drive.notes)


def test_kitti_with_fewer_poses_and_times_than_pictures(tmp_path: Path) -> None:
    written = FORMS["kitti_other_program"](tmp_path / "drive")
    file = written.path / "poses.txt"
    file.write_text("\n".join(file.read_text().splitlines()[:5]))
    (written.path / "times.txt").write_text("\n".join(f"{0.5 * i}" for i in range(4)))
    drive = read_drive(written.path)
    np.testing.assert_allclose(drive.times, [0, 0.5, 1, 1.5])
    said = " ".join(drive.notes)
    assert "1 picture beyond the 5 poses" in said
    assert "2 pictures beyond the 4 times" in said


def test_kitti_sequences_whose_poses_lie_outside_say_so(tmp_path: Path) -> None:
    FORMS["kitti_sequence"](tmp_path / "drive")
    drive = read_drive(tmp_path / "drive" / "sequences" / "07")
    assert np.isnan(drive.poses).all()
    assert any("07.txt lies outside of the folder" in note for note in drive.notes)


def test_kitti_raw_with_its_calibration_in_the_drives_own_folder(tmp_path: Path) -> None:
    written = FORMS["kitti_raw"](tmp_path / "drive")
    own = tmp_path / "drive" / "2011_09_26_drive_0015_sync"
    for file in (tmp_path / "drive").glob("calib_*"):
        file.rename(own / file.name)
    assert comparing._mismatches(written._replace(path=own)) == 0


def test_nuscenes_scene_with_most_pictures_there(tmp_path: Path) -> None:
    """Without pictures of either, the longer one of the tables."""
    written = FORMS["nuscenes"](tmp_path / "drive")
    tables = tmp_path / "drive" / "v1.0-mini"

    def both(rows: Any) -> None:
        rows += [
            row | {"token": f"x{row['token']}", "sample_token": "scene-0061-0"} for row in rows[:6]
        ]

    change_json(tables / "sample_data.json", both)
    drive = read_drive(written.path)
    assert "scene-0103 is read" in drive.notes[0]  # 4 keyframes against 2


def test_the_truth_is_a_drive_of_a_rig() -> None:
    """Else nothing is said by reading it back."""
    poses, pictures = true_poses(), true_pictures()
    turns = poses[..., :3, :3]
    np.testing.assert_allclose(turns @ turns.swapaxes(-1, -2), np.eye(3) + 0 * turns, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1)
    assert (turns[..., 2, 1] < -0.9).all()  # y down
    assert len({picture.tobytes() for row in pictures for picture in row}) == 12
