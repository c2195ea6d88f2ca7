"""Drives that lack something, or whose photographs are not all alike."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from benchmarks.written_drives import FORMS
from benchmarks.written_drives.truth import HEIGHT, WIDTH, K, rigid, save, true_pictures, true_poses
from storage.readers import BadInput
from storage.readers.drives import Drive, read_drive, read_frame, read_masks
from storage.readers.drives.drive import drive_of
from storage.readers.drives.recordings import Frame, Lens, Recording, pinhole_lens


def written(folder: Path, change: Callable[[Any], object] = lambda top: None) -> Path:
    """The drive with cameras and times in fields; frames are numbered by time, then left, right."""
    path = FORMS["transforms_fields"](folder).path
    file = path / "transforms.json"
    top = json.loads(file.read_text())
    change(top)
    file.write_text(json.dumps(top))
    return path


def said(drive: Drive) -> str:
    return " ".join(drive.notes)


# --- Photographs that are not there ---------------------------------------------------------------


@pytest.mark.parametrize("lost", ["file", "frame"])
def test_an_instant_that_lacks_a_camera_serves_the_other(tmp_path: Path, lost: str) -> None:
    def change(top: Any) -> None:
        if lost == "frame":
            del top["frames"][5]

    path = written(tmp_path / "drive", change)
    if lost == "file":
        (path / "right_2.png").unlink()
    drive = read_drive(path)
    assert drive.cameras == ("left", "right")
    expected = np.ones((6, 2), bool)
    expected[2, 1] = False
    np.testing.assert_array_equal(drive.present, expected)
    assert drive.files[2][1] is None
    # The rig is rigid: it is known where the camera was.
    np.testing.assert_allclose(drive.poses, true_poses(), atol=1e-9)
    pictures = read_frame(drive, 2)
    np.testing.assert_array_equal(pictures[0], true_pictures()[2][0])
    assert not pictures[1].any()
    assert "1 instant of 6 without a photograph of each camera: it is black there" in said(drive)
    assert ("1 of 12 photographs is not there and left out (the first is right_2.png)"
            in said(drive)) == (lost == "file")  # fmt: skip


def test_a_camera_that_never_goes_with_the_other_has_the_others_places(tmp_path: Path) -> None:
    def change(top: Any) -> None:
        top["frames"] = [f for i, f in enumerate(top["frames"]) if i // 2 % 2 == i % 2]

    drive = read_drive(written(tmp_path / "drive", change))
    np.testing.assert_array_equal(drive.present.sum(axis=1), 1)
    for instant, row in enumerate(drive.present):
        own = int(row.argmax())
        np.testing.assert_allclose(drive.poses[instant, 0], drive.poses[instant, 1])
        np.testing.assert_allclose(drive.poses[instant, own], true_poses()[instant, own])


def test_photographs_that_are_nowhere_are_missing(tmp_path: Path) -> None:
    path = written(tmp_path / "drive")
    for file in path.glob("*_[1-4].png"):
        file.unlink()
    with pytest.raises(BadInput, match=r"left_1.png: photograph is missing"):
        read_drive(path)


def test_a_hole_in_the_drive_is_a_gap(tmp_path: Path) -> None:
    def change(top: Any) -> None:
        for frame in top["frames"][8:]:
            for axis in range(2):
                frame["transform_matrix"][axis][3] += 40

    with pytest.raises(BadInput, match="expected no gap"):
        read_drive(written(tmp_path / "drive", change))


def test_one_camera_is_a_drive(tmp_path: Path) -> None:
    def change(top: Any) -> None:
        top["frames"] = top["frames"][::2]

    drive = read_drive(written(tmp_path / "drive", change))
    assert drive.cameras == ("left",)
    np.testing.assert_allclose(drive.poses, true_poses()[:, :1])
    assert drive.notes == ()


# --- Units ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", [1e-4, 1e-3, 1.0, 1e3])
def test_any_unit_is_read_as_it_is(tmp_path: Path, unit: float) -> None:
    """What the unit is, is for others to find out: a drive in kilometres is no parked car."""

    def change(top: Any) -> None:
        for frame in top["frames"]:
            for axis in range(3):
                frame["transform_matrix"][axis][3] *= unit

    drive = read_drive(written(tmp_path / "drive", change))
    np.testing.assert_allclose(drive.poses[..., :3, 3], unit * true_poses()[..., :3, 3], rtol=1e-12)
    assert not drive.metric


def test_a_parked_car_is_one_where_the_unit_is_known(tmp_path: Path) -> None:
    path = FORMS["kitti_other_program"](tmp_path / "drive").path
    lines = (path / "poses.txt").read_text().splitlines()
    still = [line.split() for line in lines]
    for row, words in enumerate(still):
        for column in (3, 7, 11):
            words[column] = str(0.01 * row)
    (path / "poses.txt").write_text("\n".join(" ".join(words) for words in still))
    with pytest.raises(BadInput, match=r"way of the car is 0\.0866; expected at least 0\.1"):
        read_drive(path)


# --- Photographs that are not alike ---------------------------------------------------------------


def test_cameras_of_different_sizes_are_padded_with_black(tmp_path: Path) -> None:
    small = np.random.default_rng(4).integers(1, 256, (6, 20, 30, 3)).astype(np.uint8)

    def change(top: Any) -> None:
        for frame in top["frames"][1::2]:
            frame |= {"w": 30, "h": 20, "cx": 14.0, "cy": 9.0}

    path = written(tmp_path / "drive", change)
    for instant in range(6):
        save(path / f"right_{instant}.png", small[instant])
    drive = read_drive(path)
    assert (drive.width, drive.height) == (WIDTH, HEIGHT)
    np.testing.assert_array_equal(drive.sizes, [[WIDTH, HEIGHT], [30, 20]])
    np.testing.assert_allclose(drive.intrinsics[1, :2, 2], [13.5, 8.5])
    pictures = read_frame(drive, 3)
    np.testing.assert_array_equal(pictures[0], true_pictures()[3][0])
    np.testing.assert_array_equal(pictures[1, :20, :30], small[3])
    assert not pictures[1, 20:].any()
    assert not pictures[1, :, 30:].any()
    assert "differ in the size" in said(drive)


def test_a_lens_that_changes_is_evened_out(tmp_path: Path) -> None:
    """A camera twice as long and twice as large at one instant: its pixels are every second one's
    of a picture that has each twice."""

    def change(top: Any) -> None:
        top["frames"][7] |= {
            "w": 2 * WIDTH, "h": 2 * HEIGHT, "fl_x": 2 * K[0, 0], "fl_y": 2 * K[1, 1],
            "cx": 2 * (K[0, 2] + 0.5), "cy": 2 * (K[1, 2] + 0.5),
        }  # fmt: skip

    path = written(tmp_path / "drive", change)
    picture = true_pictures()[3][1]
    save(path / "right_3.png", picture.repeat(2, axis=0).repeat(2, axis=1))
    drive = read_drive(path)
    np.testing.assert_array_equal(read_frame(drive, 3)[1], picture)
    np.testing.assert_allclose(drive.intrinsics[1], K)
    assert "The lens of right changes" in said(drive)


def test_photographs_that_somebody_shrank_have_their_lens_shrunk(tmp_path: Path) -> None:
    path = written(tmp_path / "drive")
    half = [row[1].reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean(axis=(1, 3)).astype(np.uint8)
            for row in true_pictures()]  # fmt: skip
    for instant, picture in enumerate(half):
        save(path / f"right_{instant}.png", picture)
    drive = read_drive(path)
    np.testing.assert_array_equal(drive.sizes, [[WIDTH, HEIGHT], [WIDTH // 2, HEIGHT // 2]])
    np.testing.assert_array_equal(read_frame(drive, 4)[1, : HEIGHT // 2, : WIDTH // 2], half[4])
    # A ray through the corner where four pixels meet goes through the middle of the small one.
    for k, pixel in ((K, [10.5, 20.5, 1]), (drive.intrinsics[1], [5, 10, 1])):
        np.testing.assert_allclose(np.linalg.inv(k) @ pixel, np.linalg.inv(K) @ [10.5, 20.5, 1])
    assert "photographs of camera right have 24 x 16 pixels" in said(drive)
    # But one alone is an error, and so is another shape.
    save(path / "right_3.png", true_pictures()[3][1])
    with pytest.raises(BadInput, match=r"right_\d.png: size is 24 x 16 pixels; expected 48 x 32"):
        read_drive(path)
    for instant in range(6):
        save(path / f"right_{instant}.png", true_pictures()[instant][1][:-1])
    with pytest.raises(BadInput, match="size is 48 x 31 pixels; expected 48 x 32"):
        read_drive(path)
    for instant in range(6):
        save(path / f"right_{instant}.png", half[instant][:-2])
    with pytest.raises(BadInput, match="size is 24 x 14 pixels; expected 48 x 32"):
        read_drive(path)


def test_masks(tmp_path: Path) -> None:
    def change(top: Any) -> None:
        top["frames"][4]["mask_path"] = "masks\\left_2"
        top["frames"][7] |= {"mask_path": "./masks/right_3.png", "cx": K[0, 2] + 3.5}
        top["frames"][8]["mask_path"] = None

    path = written(tmp_path / "drive", change)
    marked = np.full((HEIGHT, WIDTH), 255, np.uint8)
    marked[5:12, 20:30] = 0
    for name in ("left_2", "right_3"):
        save(path / f"masks/{name}.png", marked)
    drive = read_drive(path)
    masks = read_masks(drive, 2)
    assert masks is not None
    assert masks.dtype == bool
    np.testing.assert_array_equal(masks, [marked > 0, np.ones((HEIGHT, WIDTH), bool)])
    # With another principal point, the mask moves as its photograph does: three pixels.
    moved = read_masks(drive, 3)
    assert moved is not None
    assert moved[0].all()
    np.testing.assert_array_equal(moved[1, :, :-3], marked[:, 3:] > 0)
    plain = read_masks(drive, 0)
    assert plain is not None
    assert plain.all()
    Image.fromarray(marked[:-1]).save(path / "masks/left_2.png")
    with pytest.raises(BadInput, match=r"left_2.png: size is 48 x 31 pixels; expected 48 x 32"):
        read_masks(drive, 2)
    assert read_masks(read_drive(written(tmp_path / "other")), 0) is None


# --- Rigs that are none ---------------------------------------------------------------------------


def test_folders_that_are_no_rig_are_one_camera(tmp_path: Path) -> None:
    """Names pair photographs of two walks, whose poses say that nobody took them together."""
    path = FORMS["transforms_nerfstudio"](tmp_path / "drive").path
    file = path / "transforms.json"
    top = json.loads(file.read_text())
    for number, frame in enumerate(top["frames"]):
        instant, side = number // 2, number % 2
        frame["transform_matrix"][0][3] = 0.4 * (instant + 6 * side)
        frame["transform_matrix"][1][3] = 0.3 * side * instant
    file.write_text(json.dumps(top))
    drive = read_drive(path)
    assert drive.cameras == ("camera",)
    assert [row[0].parent.name for row in drive.files if row[0]] == ["left"] * 6 + ["right"] * 6
    assert "no rig: they are read as one camera" in said(drive)


def test_a_rig_whose_cameras_are_released_one_after_the_other(tmp_path: Path) -> None:
    """At 13 m/s and 24 ms they are 0.3 m further: no reason to call the rig loose. But 2 m are."""
    path = FORMS["nuscenes"](tmp_path / "drive").path
    file = path / "v1.0-mini" / "ego_pose.json"
    good = json.loads(file.read_text())

    def moved(metres: float) -> None:
        rows = json.loads(json.dumps(good))
        for row in rows:
            if row["token"] == "e3right":
                row["translation"][0] += metres
        file.write_text(json.dumps(rows))

    moved(0.3)
    assert read_drive(path).present.all()
    moved(2)
    with pytest.raises(BadInput, match="expected a rigid rig"):
        read_drive(path)


def test_cameras_that_look_all_around(tmp_path: Path) -> None:
    """Six in a ring: by their places along what is right for most of them, else by name."""
    for evenly in (True, False):
        shots = []
        for instant in range(3):
            for number in range(6):
                heading = np.radians(60 * number if evenly else 30 * (number - 2))
                ahead = np.array([np.sin(heading), np.cos(heading), 0])
                right = np.array([np.cos(heading), -np.sin(heading), 0])
                place = 0.8 * ahead + [5, 70 + 2 * instant, 1.5]
                turn = np.column_stack([right, [0, 0, -1], ahead])
                file = tmp_path / f"{instant}{number}.png"
                save(file, true_pictures()[instant][0])
                lens = pinhole_lens(K, WIDTH, HEIGHT)
                shots.append(Frame(f"{5 - number}", instant, file, rigid(turn, place), lens))
        drive = drive_of(Recording(tmp_path, shots))
        assert drive.cameras == tuple("012345" if evenly else "543210")
        np.testing.assert_allclose(drive.poses[1, :, 1, 3], drive.poses[0, :, 1, 3] + 2)


# --- Recordings without poses or lenses -----------------------------------------------------------


def frames(folder: Path, pose: NDArray[np.float64] | None, lens: Lens | None) -> list[Frame]:
    for instant in range(3):
        save(folder / f"{instant}.png", true_pictures()[instant][0])
    return [Frame("a", float(i), folder / f"{i}.png", pose, lens) for i in range(3)]


def test_nothing_is_known_but_the_photographs(tmp_path: Path) -> None:
    drive = drive_of(Recording(tmp_path, frames(tmp_path, None, None)))
    assert np.isnan(drive.poses).all()
    assert np.isnan(drive.intrinsics[0, :2]).any()
    assert (drive.width, drive.height) == (WIDTH, HEIGHT)
    np.testing.assert_array_equal(read_frame(drive, 1)[0], true_pictures()[1][0])


def test_some_poses_are_no_poses(tmp_path: Path) -> None:
    some = frames(tmp_path, None, None)
    some[1] = some[1]._replace(pose=np.eye(4))
    with pytest.raises(BadInput, match="number of poses is 1 for 3 photographs"):
        drive_of(Recording(tmp_path, some))
