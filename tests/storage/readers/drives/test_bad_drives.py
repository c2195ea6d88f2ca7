"""Files of drives that cannot be used: the sentence, for each kind of fault of each format."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.written_drives import FORMS
from storage.readers import BadInput
from storage.readers.drives import colmap_models, json_rows, read_drive
from storage.readers.drives.motions import quaternion_rotation, rotation
from storage.readers.drives.text_tables import Table


def refusal(path: Path) -> str:
    with pytest.raises(BadInput) as caught:
        read_drive(path)
    text = str(caught.value)
    assert re.fullmatch(r"[^:]+: .+ is .+; expected .+\.", text), text
    return text


def replaced(old: str, new: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new, 1)

    return change


def first_line(new: str) -> Callable[[str], str]:
    return lambda text: "\n".join([new, *text.splitlines()[1:]])


TWELVE = "1 0 0 0 0 1 0 0 0 0 1 0"


@pytest.mark.parametrize(
    ("form", "file", "change", "part"),
    [
        ("kitti_other_program", "poses.txt", first_line(TWELVE[2:]),
         "poses.txt: line 1 is 11 numbers; expected 12 numbers"),
        ("kitti_other_program", "poses.txt", first_line(TWELVE[:-1] + "x"),
         'line 1 is "x" among its numbers; expected numbers'),
        ("kitti_other_program", "poses.txt", first_line(TWELVE[:-1] + "nan"), "line 1 is not fin"),
        ("kitti_other_program", "poses.txt", first_line("-" + TWELVE),
         "line 1 is no rotation (mirrored)"),
        ("kitti_other_program", "poses.txt", first_line("2 0 0 0 0 2 0 0 0 0 2 0"),
         "line 1 is scaled by 2; expected a rotation and a place"),
        ("kitti_other_program", "poses.txt", first_line(TWELVE[:-1] + "1e200"), "1e+200 m away"),
        ("kitti_other_program", "calib.txt", first_line(TWELVE[:-1] + "x"), "calib.txt: line 1"),
        ("kitti_other_program", "calib.txt", first_line("1 1 0 0 0 1 0 0 0 0 1 0"),
         "P0 is of another form; expected the projection"),
        ("kitti_other_program", "calib.txt", first_line("9 0 900 0 0 9 8 0 0 0 1 0"),
         "cx of P0 is 900; expected a place inside the picture"),
        ("kitti_other_program", "calib.txt", lambda text: "", "P0 of image_l is missing"),
        ("kitti_sequence", "sequences/07/calib.txt", replaced("P3", "Q3"),
         "P3 of image_3 is missing; expected P0: and 12 numbers"),
        ("kitti_sequence", "sequences/07/times.txt", first_line("noon"), 'line 1 is "noon"'),
        ("kitti_raw", "calib_cam_to_cam.txt", replaced("R_rect_00", "R_rect"),
         "calib_cam_to_cam.txt: R_rect_00 is missing"),
        ("kitti_raw", "calib_velo_to_cam.txt", replaced("T:", "T: 1"), "4 numbers; expected 3 num"),
        ("kitti_raw", "calib_imu_to_velo.txt", replaced("R: ", "R: -"), "R is no rotation (shear"),
        ("kitti_raw", "2011_09_26_drive_0015_sync/oxts/data/0000000002.txt", lambda text: "1 2",
         "0000000002.txt: line 1 is 2 numbers; expected 30 numbers"),
        ("kitti_raw", "2011_09_26_drive_0015_sync/oxts/data/0000000002.txt",
         lambda text: "90 " + text.split(" ", 1)[1], "latitude is 90; expected from -89 to 89"),
        ("kitti_raw", "2011_09_26_drive_0015_sync/image_00/timestamps.txt",
         replaced("2011-09-26 13:02:25.2", "2011-19-26 13:02:25.2"), "line 3 is \"2011-19-26 13:"),
        ("nuscenes", "v1.0-mini/scene.json", lambda text: "[]", "number of scenes is 0"),
        ("nuscenes", "v1.0-mini/scene.json", lambda text: text[:40], "JSON is broken after 0 rows"),
        ("nuscenes", "v1.0-mini/sensor.json", lambda text: "[3]", "row 0 is no object"),
        ("nuscenes", "v1.0-mini/sensor.json", lambda text: text.replace('"camera"', '"x"'),
         "number of cameras is 0; expected calibrations of cameras"),
        ("nuscenes", "v1.0-mini/ego_pose.json", replaced("e2left", "elsewhere"),
         "expected a row of ego_pose.json with the token e2left"),
        ("nuscenes", "v1.0-mini/sample_data.json", replaced("samples/", "../samples/"),
         "sample_data.json: filename is \"../samples/CAM_FRONT_LEFT"),
        ("nuscenes", "v1.0-mini/sample_data.json", replaced('"width": 48', '"width": 47'),
         "size is 48 x 32 pixels; expected 47 x 32"),
        ("nuscenes", "v1.0-mini/sample_data.json", replaced('"timestamp": ', '"timestamp": 1e999'),
         "timestamp is inf; expected a finite number"),
        ("nuscenes", "v1.0-mini/calibrated_sensor.json", replaced("41.0", '"41"'),
         'camera_intrinsic[0][0] is "41"; expected a number'),
        ("nuscenes", "v1.0-mini/calibrated_sensor.json", replaced("1.7,", "1.7, 0,"),
         "expected a list of 3 numbers"),
        ("transforms_instant_ngp", "transforms.json", replaced("camera_angle_x", "camera_angle"),
         "fl_x is missing for camera images/left; expected a number in the frame"),
        ("transforms_instant_ngp", "transforms.json", replaced('"camera_angle_x": ',
         '"camera_angle_x": 3'), "expected an angle between 0 and 3.142"),
        ("transforms_fisheye", "transforms.json", replaced("k4", "k5"), "k5 is -0.001; expected a"),
        ("transforms_panorama", "transforms.json", replaced("EQUIRECTANGULAR", "CYLINDER"),
         'camera_model is "CYLINDER"; expected a pinhole'),
        ("transforms_blender", "transforms_train.json", replaced('"./train/r_0"', '"./../r_0"'),
         "transforms_train.json: frames[0].file_path is"),
    ],
)  # fmt: skip
def test_planted_faults(
    tmp_path: Path, form: str, file: str, change: Callable[[str], str], part: str
) -> None:
    path = FORMS[form](tmp_path / "drive").path
    (path / file).write_text(change((path / file).read_text()))
    text = refusal(path)
    assert part in text, text


def test_sequences_without_what_they_need(tmp_path: Path) -> None:
    path = FORMS["kitti_raw"](tmp_path / "raw").path
    drive = path / "2011_09_26_drive_0015_sync"
    assert "calib_cam_to_cam.txt: file is missing; expected a day of KITTI" in refusal(drive)
    (path / "calib_imu_to_velo.txt").unlink()
    assert "calib_imu_to_velo.txt: file is missing" in refusal(path)
    path = FORMS["kitti_other_program"](tmp_path / "kitti").path
    for file in (path / "image_l").iterdir():
        file.unlink()
    assert "number of pictures is 0; expected a KITTI sequence" in refusal(path)


def test_commas_apart_and_inside(tmp_path: Path) -> None:
    file = tmp_path / "poses.txt"
    file.write_text("1,5 2,25 -3,0e1\n1.5, 2.25, -30\n1,2,3\n1;2;3\n")
    table = Table(file, "numbers")
    for row, expected in ((0, [1.5, 2.25, -30]), (1, [1.5, 2.25, -30]), (2, [1, 2, 3])):
        np.testing.assert_array_equal(table.numbers(row, table.lines[row], 3), expected)
    assert table.notes == [
        "poses.txt: commas were read as decimal points.",
        "poses.txt: commas were read as spaces.",
    ]
    with pytest.raises(BadInput, match="line 4 is 1 numbers; expected 3 numbers"):
        table.numbers(3, table.lines[3], 3)


@pytest.mark.parametrize("piece", [1, 7, 64])
def test_rows_of_json_come_back_however_the_file_is_cut(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, piece: int
) -> None:
    """Python's own parser of the whole is the judge."""
    rows: list[Any] = [{"token": f"t{i}", "a": [i, {"b": "]},{["}], "c": None} for i in range(60)]
    file = tmp_path / "rows.json"
    monkeypatch.setattr(json_rows, "_PIECE", piece)
    monkeypatch.setattr(json_rows, "LONGEST_ROW", 300)
    for indent in (None, 0, 3):
        for content in (rows, rows[:1], []):
            file.write_text(json.dumps(content, indent=indent) + "\n ")
            assert list(json_rows.json_rows(file)) == content
    for broken in (
        "",
        " ",
        "{}",
        "[",
        "[,]",
        "[{}",
        "[{},",
        "[{},]",
        "[{} {}]",
        '[{"a": 1]',
        "nul",
    ):
        file.write_text(broken)
        with pytest.raises(BadInput):
            list(json_rows.json_rows(file))
    file.write_text('[{"a": "' + "x" * 5000 + '"}]')  # longer than a row may be
    with pytest.raises(BadInput, match="broken after 0 rows"):
        list(json_rows.json_rows(file))


def test_points_beyond_the_most_are_thinned_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import struct

    places = np.arange(30.0).reshape(10, 3)
    text, binary = tmp_path / "points3D.txt", tmp_path / "points3D.bin"
    text.write_text("".join(f"{i} {x} {y} {z} 0 0 0 1\n" for i, (x, y, z) in enumerate(places)))
    rows = (struct.pack("<Q3d3BdQ", i, *place, 0, 0, 0, 1, 0) for i, place in enumerate(places))
    binary.write_bytes(struct.pack("<Q", 10) + b"".join(rows))
    for file in (text, binary):
        np.testing.assert_array_equal(colmap_models.read_points(file), places)
    monkeypatch.setattr(colmap_models, "MOST_POINTS", 4)
    for file in (text, binary):
        found = colmap_models.read_points(file)
        assert len(found) <= 4
        assert {tuple(place) for place in found} <= {tuple(place) for place in places}


def test_matrices() -> None:
    """Noise of decimals and a scale are told from mirrors and shears."""
    file, chance = Path("a.json"), np.random.default_rng(5)
    for _ in range(50):
        true = quaternion_rotation(file, "q", np.array([1.2, 0, 0, 0]) * 0.5 + 0.3)
        turn, _ = np.linalg.qr(chance.normal(size=(3, 3)))
        turn = turn * np.sign(np.linalg.det(turn))
        scale = np.exp(chance.uniform(-20, 20))
        found, told = rotation(file, "m", scale * np.round(turn, 3))
        assert np.abs(found - turn).max() < 2e-3
        assert told == pytest.approx(scale, rel=3e-3)
        np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(true) == pytest.approx(1)
        for broken in (
            -turn,
            turn * [1, 1, -1],
            turn * [1, 1, 1.02],
            turn + 0.02 * turn[:, :1],
            turn[:, [0, 1, 1]],
            np.full((3, 3), np.nan),
            np.full((3, 3), 1e300),
        ):
            with pytest.raises(BadInput, match="no rotation"):
                rotation(file, "m", broken)
