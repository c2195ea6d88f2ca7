"""Drives: small folders written by hand, right ones and ones with a planted error."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, PngImagePlugin

from storage.readers import BadInput
from storage.readers.drives import frame_notes, read_drive, read_frame

WIDTH, HEIGHT = 32, 24
LENS = {"fl_x": 30.0, "fl_y": 31.0, "cx": 15.5, "cy": 12.25, "w": WIDTH, "h": HEIGHT}
RIG = {"left": -0.5, "middle": 0.0, "right": 0.5}  # metres to the right of the rig's middle
Json = dict[str, Any]


def opengl_pose(
    heading: float, place: NDArray[np.float64], pitch: float = 0.0
) -> list[list[float]]:
    """A camera that looks along the compass's heading, raised by pitch (degrees); z is up."""
    turn, lift = math.radians(heading), math.radians(pitch)
    ahead = np.array([math.sin(turn), math.cos(turn), 0.0])
    right = np.array([math.cos(turn), -math.sin(turn), 0.0])
    forward = math.cos(lift) * ahead + [0, 0, math.sin(lift)]
    up = np.cross(right, forward)
    rows = np.column_stack([right, up, -forward, place])
    return [*rows.tolist(), [0.0, 0.0, 0.0, 1.0]]


def picture(seed: int, shape: tuple[int, ...] = (HEIGHT, WIDTH, 3)) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)


def write_drive(
    folder: Path,
    *,
    rig: dict[Any, float] | None = None,
    ways: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0),
    heading: float = 120.0,
    lens: Json | None = None,
    change: Callable[[Json], object] | None = None,
    size: tuple[int, int] = (WIDTH, HEIGHT),
) -> Path:
    """A car that goes ``ways`` metres along its heading, one photograph a camera and time.

    ``change`` may plant an error in what becomes `transforms.json`: its frames are numbered by
    time and then in the order of the rig.
    """
    folder.mkdir(exist_ok=True)
    turn = math.radians(heading)
    ahead = np.array([math.sin(turn), math.cos(turn), 0.0])
    right = np.array([math.cos(turn), -math.sin(turn), 0.0])
    frames = []
    for time, way in enumerate(ways):
        for name, across in (RIG if rig is None else rig).items():
            place = np.array([100.0, -50.0, 1.5]) + way * ahead + across * right
            frames.append(
                {
                    "file_path": f"{name}_{time}.png",
                    "transform_matrix": opengl_pose(heading, place, pitch=-5),
                    "camera": name,
                    "time": time,
                }
            )
            pixels = picture(len(frames) - 1, (*size[::-1], 3))
            Image.fromarray(pixels).save(folder / f"{name}_{time}.png")
    transforms = {**(LENS if lens is None else lens), "frames": frames}
    if change:
        change(transforms)
    (folder / "transforms.json").write_text(json.dumps(transforms))
    return folder


def refusal(action: Callable[[], Any], file: str = "transforms.json") -> str:
    with pytest.raises(BadInput) as caught:
        action()
    text = str(caught.value)
    assert re.fullmatch(re.escape(file) + r": .+ is .+; expected .+\.", text), text
    assert ". " not in text
    return text


def set_at(path: tuple[Any, ...], value: Any) -> Callable[[Json], None]:
    def change(transforms: Any) -> None:
        for key in path[:-1]:
            transforms = transforms[key]
        transforms[path[-1]] = value

    return change


def without_focal(transforms: Json) -> None:
    del transforms["fl_x"], transforms["fl_y"]


def without(*path: Any) -> Callable[[Json], None]:
    def change(transforms: Any) -> None:
        for key in path[:-1]:
            transforms = transforms[key]
        del transforms[path[-1]]

    return change


# --- What is read -------------------------------------------------------------------------------


def test_a_drive(tmp_path: Path) -> None:
    folder = write_drive(tmp_path / "street")
    drive = read_drive(str(folder))
    assert drive.file == folder / "transforms.json"
    assert drive.cameras == ("left", "middle", "right")
    assert (drive.width, drive.height) == (WIDTH, HEIGHT)
    assert drive.files[3] == tuple(folder / f"{name}_3.png" for name in RIG)
    np.testing.assert_array_equal(drive.times, [0, 1, 2, 3])
    # The middle of the first pixel is (0.5, 0.5) in the file and (0, 0) in K.
    k = [[30, 0, 15], [0, 31, 11.75], [0, 0, 1]]
    np.testing.assert_array_equal(drive.intrinsics, [k, k, k])
    np.testing.assert_array_equal(drive.distortion, np.zeros((3, 5)))
    assert drive.poses.shape == (4, 3, 4, 4)
    for array in (drive.intrinsics, drive.poses, drive.times, drive.distortion):
        assert array.dtype == np.float64
    for instant in range(4):
        pictures = read_frame(drive, instant)
        assert pictures.dtype == np.uint8
        expected = [picture(3 * instant + camera) for camera in range(3)]
        np.testing.assert_array_equal(pictures, expected)
    with pytest.raises(IndexError):
        read_frame(drive, 4)


def test_points_fall_on_the_pixels_of_the_files_own_convention(tmp_path: Path) -> None:
    folder = write_drive(tmp_path / "street", heading=35)
    drive = read_drive(folder)
    listed = json.loads((folder / "transforms.json").read_text())["frames"]
    random = np.random.default_rng(2)
    for row, frame in enumerate(listed):
        to_world = np.array(frame["transform_matrix"])
        seen = random.uniform([-3, -2, -30], [3, 2, -2], (20, 3))  # OpenGL: ahead is -z
        points = seen @ to_world[:3, :3].T + to_world[:3, 3]
        across = LENS["cx"] + LENS["fl_x"] * seen[:, 0] / -seen[:, 2]
        down = LENS["cy"] - LENS["fl_y"] * seen[:, 1] / -seen[:, 2]

        homogeneous = np.column_stack([points, np.ones(len(points))])
        pose = drive.poses[row // 3, row % 3]
        image = drive.intrinsics[row % 3] @ (np.linalg.inv(pose) @ homogeneous.T)[:3]
        assert (image[2] > 0).all()
        pixels = image[:2] / image[2]
        np.testing.assert_allclose(pixels, [across - 0.5, down - 0.5], atol=1e-9)


def test_a_point_ahead_right_and_above_is_right_and_above_in_the_picture(tmp_path: Path) -> None:
    drive = read_drive(write_drive(tmp_path / "street", heading=0))  # north: right is east
    pose = drive.poses[0, 1]
    seen = pose[:3, :3].T @ (np.array([102.0, -40.0, 5.0]) - pose[:3, 3])
    assert seen[2] > 9
    assert seen[0] == pytest.approx(2)
    assert seen[1] < -3  # y is down


@pytest.mark.parametrize("heading", [0, 90, 135, 200, 300])
@pytest.mark.parametrize("names", [("a", "b", "c"), ("c", "b", "a"), ("b", "c", "a"), (10, 9, 1)])
def test_cameras_are_ordered_by_place_and_instants_by_time(
    tmp_path: Path, heading: float, names: tuple[Any, ...]
) -> None:
    folder = tmp_path / "street"
    rig = dict(zip(names, RIG.values(), strict=True))

    def shuffle(transforms: Json) -> None:
        np.random.default_rng(int(heading)).shuffle(transforms["frames"])

    drive = read_drive(write_drive(folder, rig=rig, heading=heading, change=shuffle))
    assert drive.cameras == tuple(str(name) for name in names)
    np.testing.assert_array_equal(drive.times, [0, 1, 2, 3])
    assert drive.files == tuple(
        tuple(folder / f"{name}_{time}.png" for name in names) for time in range(4)
    )
    to_the_right = drive.poses[:, 1:, :3, 3] - drive.poses[:, :-1, :3, 3]
    np.testing.assert_allclose(np.linalg.norm(to_the_right, axis=-1), 0.5)
    np.testing.assert_allclose(
        np.einsum("fci,fci->fc", to_the_right, drive.poses[:, 1:, :3, 0]), 0.5
    )


def test_lenses_may_stand_with_the_frame_the_camera_or_at_the_top(tmp_path: Path) -> None:
    def change(transforms: Json) -> None:
        transforms["camera_model"] = "OPENCV"
        transforms["cameras"] = {
            "1": {"fl_x": 40, "camera_model": "PINHOLE", "k1": 0},
            "2": {"cx": 10, "fl_x": 50, "k3": 0.25},
        }
        for frame in transforms["frames"]:
            if frame["camera"] == 2:
                frame |= {"fl_x": 60, "p1": 0.125}

    rig = {1: 0.0, 2: 0.4, 3: 0.8}
    lens = LENS | {"w": 32.0, "k1": 0.5, "k2": -0.5}
    drive = read_drive(write_drive(tmp_path / "street", rig=rig, lens=lens, change=change))
    assert drive.cameras == ("1", "2", "3")
    np.testing.assert_array_equal(drive.intrinsics[:, 0, 0], [40, 60, 30])
    np.testing.assert_array_equal(drive.intrinsics[:, 0, 2], [15, 9.5, 15])
    expected = [[0, -0.5, 0, 0, 0], [0.5, -0.5, 0.125, 0, 0.25], [0.5, -0.5, 0, 0, 0]]
    np.testing.assert_array_equal(drive.distortion, expected)


def test_times_may_be_any_numbers_and_steps_uneven_or_none(tmp_path: Path) -> None:
    def change(transforms: Json) -> None:
        for frame in transforms["frames"]:
            frame["time"] = 0.1 - frame["time"] ** 2 * 1e3

    ways = (0.0, 0.3, 4.0, 4.0, 4.0, 4.0, 4.001, 4.0, 4.0, 9.0)  # most of the time at lights
    drive = read_drive(write_drive(tmp_path / "street", ways=ways, change=change))
    np.testing.assert_allclose(drive.times, 0.1 - np.arange(9, -1, -1.0) ** 2 * 1e3)


def test_matrices_of_few_decimals_become_rotations(tmp_path: Path) -> None:
    def change(transforms: Json) -> None:
        for frame in transforms["frames"]:
            frame["transform_matrix"] = np.round(frame["transform_matrix"], 4).tolist()

    drive = read_drive(write_drive(tmp_path / "street", change=change))
    turns = drive.poses[..., :3, :3]
    identity = np.broadcast_to(np.eye(3), turns.shape)
    np.testing.assert_allclose(turns.swapaxes(-1, -2) @ turns, identity, atol=1e-14)
    exact = read_drive(write_drive(tmp_path / "exact"))
    np.testing.assert_allclose(drive.poses, exact.poses, atol=1e-4)


def test_kinds_of_photographs(tmp_path: Path) -> None:
    folder = write_drive(tmp_path / "street")
    deep = np.random.default_rng(1).integers(0, 65536, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    cv2.imwrite(str(folder / "left_0.png"), deep[..., ::-1])
    grey = picture(50, (HEIGHT, WIDTH))
    Image.fromarray(grey).save(folder / "middle_0.png")
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    smooth = np.stack([4 * x + 50, 6 * y + 60, 200 - 3 * x], axis=-1).astype(np.uint8)
    Image.fromarray(smooth).save(folder / "right_0.png", format="JPEG", quality=98, subsampling=0)
    drive = read_drive(folder)
    pictures = read_frame(drive, 0)
    np.testing.assert_array_equal(pictures[0], np.round(deep / 65535 * 255))
    np.testing.assert_array_equal(pictures[1], np.repeat(grey[..., None], 3, axis=2))
    assert np.abs(pictures[2].astype(int) - smooth).max() < 6
    assert frame_notes(drive, 0) == ()


def test_other_formats_and_colours_of_photographs(tmp_path: Path) -> None:
    """WebP and BMP keep the codes; a gamma of 1 is turned into sRGB's curve, and said."""
    folder = write_drive(tmp_path / "street")
    plain = picture(51)
    Image.fromarray(plain).save(folder / "left_0.png", format="WEBP", lossless=True)
    Image.fromarray(plain).save(folder / "middle_0.png", format="BMP")
    linear = PngImagePlugin.PngInfo()
    linear.add(b"gAMA", (100_000).to_bytes(4, "big"))
    Image.fromarray(plain).save(folder / "right_0.png", pnginfo=linear)
    drive = read_drive(folder)
    pictures = read_frame(drive, 0)
    np.testing.assert_array_equal(pictures[0], plain)
    np.testing.assert_array_equal(pictures[1], plain)
    light = plain / 255
    curved = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(pictures[2] - 255 * curved).max() <= 0.51
    assert frame_notes(drive, 0) == ("The colours were converted to sRGB from the gamma 1.",)


@pytest.mark.parametrize("mode", ["8 bit", "16 bit", "grey"])
def test_a_bent_line_is_straight_again(tmp_path: Path, mode: str) -> None:
    width, height = 128, 96
    lens = {"fl_x": 90.0, "fl_y": 85.0, "cx": 60.5, "cy": 50.5, "w": width, "h": height}
    coefficients = {"k1": -0.3, "k2": 0.12, "k3": -0.02, "p1": 0.01, "p2": -0.008}
    folder = write_drive(tmp_path / "street", lens=lens | coefficients, size=(width, height))
    drive = read_drive(folder)

    # A line in the camera's space, y = 0.4 x - 0.35 at z = 1, along which a bright band is drawn.
    x = np.linspace(-2, 2, 4000)
    line = np.column_stack([x, 0.4 * x - 0.35, np.ones_like(x)])
    k = np.array([[90.0, 0, 60.0], [0, 85.0, 50.0], [0, 0, 1]])
    order = ("k1", "k2", "p1", "p2", "k3")
    bent, _ = cv2.projectPoints(
        line, np.zeros(3), np.zeros(3), k, np.array([coefficients[key] for key in order])
    )
    bent = bent[np.abs(x) < 0.9, 0]
    columns = np.arange(width)
    curve = np.interp(columns, *bent.T)
    rows = np.arange(height)[:, None]
    band = np.exp(-(((rows - curve) / 1.5) ** 2) / 2)[..., None].repeat(3, axis=2)
    pixels = np.round(band * (65535 if mode == "16 bit" else 255))
    pixels = pixels.astype(np.uint16 if mode == "16 bit" else np.uint8)
    cv2.imwrite(str(folder / "middle_0.png"), pixels[..., 0] if mode == "grey" else pixels)

    straight = 50.0 + 85.0 * (0.4 * (columns - 60.0) / 90.0 - 0.35)
    seen = read_frame(drive, 0)[1].astype(float)
    inner = slice(20, 115)  # where the whole band is in the picture

    def centre(of: NDArray[Any]) -> NDArray[np.float64]:
        return np.asarray((of[..., 1] * rows).sum(axis=0) / of[..., 1].sum(axis=0))[inner]

    assert np.abs(centre(band) - straight[inner]).max() > 1.5
    assert np.abs(centre(seen) - straight[inner]).max() < 0.1


def test_photographs_may_lie_in_folders_and_behind_links(tmp_path: Path) -> None:
    def change(transforms: Json) -> None:
        for frame in transforms["frames"]:
            frame["file_path"] = "./images/../images/" + frame["file_path"]

    folder = write_drive(tmp_path / "street", change=change)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for file in folder.glob("*.png"):
        file.rename(elsewhere / file.name)
    (folder / "images").symlink_to(elsewhere)
    drive = read_drive(folder)
    assert drive.files[0][0] == folder / "images" / "left_0.png"
    np.testing.assert_array_equal(read_frame(drive, 0)[0], picture(0))


# --- What is refused ----------------------------------------------------------------------------


def test_no_drive(tmp_path: Path) -> None:
    text = refusal(lambda: read_drive(tmp_path / "none"), "none")
    assert "drive is missing" in text
    folder = write_drive(tmp_path / "street")
    photograph = folder / "left_0.png"
    assert "a file" in refusal(lambda: read_drive(photograph), "left_0.png")
    for file in folder.iterdir():
        file.unlink()
    text = refusal(lambda: read_drive(folder), "street")
    assert "a folder without any of these; expected one of transforms.json or" in text
    (folder / "transforms.json").mkdir()
    assert "file is a directory" in refusal(lambda: read_drive(folder))


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (b"", "JSON is broken in line 1"),
        (b'{"w": 3,\n "h"', "JSON is broken in line 2, column 5"),
        (b'{"w": "\xff\xfe"}', "JSON is broken"),
        (b"[" * 100_000, "JSON is broken"),
        (b'{"w": ' + b"9" * 5000 + b"}", "JSON is broken"),
        (b"[1, 2]", "content is [1, 2]; expected a JSON object"),
        (b"{}", "frames is missing"),
        (b'{"frames": {}}', "frames is {}; expected a list"),
        (b'{"frames": []}', "number of cameras is 0; expected at least 1"),
        (b'{"frames": [3]}', "frames[0] is 3; expected a JSON object"),
        (b'{"frames": [], "cameras": []}', "cameras is []; expected a JSON object"),
    ],
)
def test_broken_json(tmp_path: Path, content: bytes, part: str) -> None:
    (tmp_path / "transforms.json").write_bytes(content)
    assert part in refusal(lambda: read_drive(tmp_path))


@pytest.mark.parametrize("bom", ["utf-8-sig", "utf-16"])
def test_json_of_other_editors(tmp_path: Path, bom: str) -> None:
    file = write_drive(tmp_path / "street") / "transforms.json"
    file.write_bytes(file.read_text().encode(bom))
    assert read_drive(file.parent).cameras == ("left", "middle", "right")


MATRIX = ("frames", 4, "transform_matrix")


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (without_focal, "fl_x is missing for camera left; expected a number in the fra"),
        (without("frames", 4, "file_path"), "frames[4].file_path is missing"),
        (without("frames", 4, "transform_matrix"), "frames[4].transform_matrix is missing"),
        (set_at(("fl_x",), "30"), 'fl_x is "30"; expected a number'),
        (set_at(("fl_x",), math.nan), "fl_x is nan; expected a finite number"),
        (set_at(("fl_y",), 0), "fl_y is 0; expected more than 0 pixels"),
        (set_at(("fl_y",), -31.5), "fl_y is -31.5; expected more"),
        (set_at(("cx",), 32), "cx is 32; expected a place inside the picture, between 0 and 32"),
        (set_at(("cy",), -1), "cy is -1; expected a place inside the picture, between 0 and 24"),
        (set_at(("w",), 32.5), "w is 32.5; expected a whole number of pixels"),
        (set_at(("h",), 0), "h is 0; expected a whole number of pixels"),
        (set_at(("h",), True), "h is true; expected a number"),
        (set_at(("w",), 10**400), "w is inf; expected a finite number"),
        (set_at(("k1",), -math.inf), "k1 is -inf; expected a finite number"),
        (set_at(("k2",), None), "k2 is null; expected a number"),
        (set_at(("cameras",), {"left": 3}), "cameras.left is 3; expected a JSON object"),
        (set_at(("cameras",), {"right": {"p2": "x"}}), 'cameras.right.p2 is "x"; expected a num'),
        (set_at(("camera_model",), "FISHEYE624"), 'camera_model is "FISHEYE624"; expected a pin'),
        (set_at(("ftheta_p0",), 0.1), "ftheta_p0 is 0.1; expected a pinhole"),
        (set_at(("cameras",), {"left": {"k4": 0.1}}), "cameras.left.k4 is 0.1; expected a pinhole"),
        (set_at(("frames", 4, "camera"), None), "frames[4].camera is null; expected a name"),
        (set_at(("frames", 4, "camera"), " "), 'frames[4].camera is " "; expected a name'),
        (set_at(("frames", 4, "camera"), False), "frames[4].camera is false"),
        (set_at(("frames", 4, "camera"), math.nan), "frames[4].camera is NaN"),
        (set_at(("frames", 4, "time"), "noon"), 'frames[4].time is "noon"; expected a number'),
        (set_at(("frames", 4, "time"), math.nan), "frames[4].time is nan; expected a finite"),
        (set_at(("frames", 4, "file_path"), 7), "frames[4].file_path is 7"),
        (set_at(("frames", 4, "file_path"), ""), 'frames[4].file_path is ""'),
        (set_at(("frames", 4, "file_path"), "a\0.png"), "frames[4].file_path is"),
        (set_at(("frames", 4, "file_path"), "."), "expected a path inside the folder"),
        (set_at(("frames", 4, "file_path"), "../left_0.png"), "expected a path inside the folder"),
        (set_at(("frames", 4, "file_path"), "a/../../x.png"), "expected a path inside the folder"),
        (set_at(("frames", 4, "file_path"), "/etc/x.png"), "expected a path inside the folder"),
        (set_at(MATRIX, 3), "frames[4].transform_matrix is not 4 x 4"),
        (set_at(MATRIX, np.eye(3).tolist()), "frames[4].transform_matrix is not 4 x 4"),
        (set_at((*MATRIX, 2), [0, 1, 0]), "frames[4].transform_matrix is not 4 x 4"),
        (set_at((*MATRIX, 2, 3), math.nan), "transform_matrix[2][3] is nan; expected a finite"),
        (set_at((*MATRIX, 0, 0), math.inf), "transform_matrix[0][0] is inf; expected a finite"),
        (set_at((*MATRIX, 0, 0), "a"), 'transform_matrix[0][0] is "a"; expected a number'),
        (set_at((*MATRIX, 0, 0), 1e200), "frames[4].transform_matrix is no rotation"),
        (set_at((*MATRIX, 0, 3), 1e200), "frames[4].transform_matrix is a place 1e+200 m away"),
        (set_at(MATRIX, (np.eye(4) * 1.001).tolist()), "frames[4].transform_matrix[3] is [0.0, 0."),
        (set_at(MATRIX, np.diag([1, 1, -1, 1]).tolist()), "matrix is no rotation (mirrored); ex"),
        (set_at(MATRIX, np.diag([1, 1, 1.02, 1]).tolist()), "matrix is no rotation (sheared, or"),
        (set_at((*MATRIX, 0), [1, 0.02, 0, 0]), "frames[4].transform_matrix is no rotation"),
        (set_at(MATRIX, np.zeros((4, 4)).tolist()), "is no rotation (its axes lie in a plane)"),
        (set_at((*MATRIX, 3), [1, 2, 3, 1]), "transform_matrix[3] is [1, 2, 3, 1]; expected [0"),
        (
            set_at(("frames", 4, "time"), 0),
            "picture middle_1.png is a second photograph of camera middle at time 0",
        ),
        (set_at(("applied_transform",), np.diag([1, -1, 1]).tolist()), "applied_transform is not"),
        (set_at(("applied_transform",), np.diag([1, -1, 1, 1]).tolist()), "no rotation (mirrored"),
        (set_at(("applied_scale",), 0), "applied_scale is 0; expected a scale above 0"),
        (set_at(("frames", 4, "mask_path"), "../mask.png"), "mask_path is"),
    ],
)
def test_planted_errors(tmp_path: Path, change: Callable[[Json], None], part: str) -> None:
    folder = write_drive(tmp_path / "street", change=change)
    for photograph in folder.glob("*.png"):  # all this is seen before any photograph
        photograph.unlink()
    text = refusal(lambda: read_drive(folder))
    assert part in text, text


def test_an_absolute_path_inside_the_folder_is_one_inside(tmp_path: Path) -> None:
    folder = tmp_path / "street"
    change = set_at(("frames", 0, "file_path"), str(folder / "left_0.png"))
    assert read_drive(write_drive(folder, change=change)).files[0][0] == folder / "left_0.png"


def moved(transforms: Json, metres: Callable[[str, int], float]) -> None:
    """Move cameras to the east by what their name and time say."""
    for frame in transforms["frames"]:
        frame["transform_matrix"][0][3] += metres(frame["camera"], frame["time"])


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"ways": (0.0, 1.0)}, "number of instants is 2; expected at least 3"),
        (
            {"rig": {"left": 0.0, "right": 0.0009}},
            "distance of cameras left and right is 0.0009 at time",
        ),
        ({"ways": (0.0, 0.0, 0.0)}, "way of the car is 0; expected at least 0.5"),
        ({"ways": (0.0, 0.2, 0.49)}, "way of the car is 0.49; expected at least 0.5"),
        # A parked car, whose path grows with the noise of its places.
        ({"ways": (0.0, 0.2) * 20}, "way of the car is 0.2; expected at least 0.5"),
        ({"rig": {"only": 0.0}, "ways": (2.0, 2.0, 2.0)}, "way of the car is 0; expected at leas"),
        (
            {"ways": (0.0, 1.0, 2.0, 3.0, 63.0, 64.0)},
            "way of the car between time 3 and 4 is 60.0, 60 times the median; expected no gap",
        ),
        (
            {"change": lambda t: moved(t, lambda name, time: 0.1 * time * (name == "right"))},
            "expected a rigid rig (a change of at most 5%)",
        ),
        (
            {"change": lambda t: moved(t, lambda name, time: 0.06 * (time == 2 and name == "left")),
             "heading": 0},
            "distance of cameras left and middle is 0.4400 at time 2 and 0.5000 at time",
        ),
    ],
)  # fmt: skip
def test_no_rig_and_no_way(tmp_path: Path, options: Json, part: str) -> None:
    folder = write_drive(tmp_path / "street", **options)
    text = refusal(lambda: read_drive(folder))
    assert part in text, text


def test_a_rig_may_breathe_and_steps_may_grow_twentyfold(tmp_path: Path) -> None:
    def change(transforms: Json) -> None:
        moved(transforms, lambda name, time: 0.02 * (time % 2) * (name == "right"))

    read_drive(write_drive(tmp_path / "street", heading=0, change=change))
    read_drive(write_drive(tmp_path / "other", ways=(0.0, 1.0, 2.0, 3.0, 22.9)))


def test_missing_and_wrong_photographs(tmp_path: Path) -> None:
    folder = write_drive(tmp_path / "street")
    file = folder / "middle_2.png"
    good = file.read_bytes()

    def read() -> object:
        return read_drive(folder)

    file.unlink()
    file.mkdir()
    assert "photograph is a directory" in refusal(read, file.name)
    file.rmdir()
    for content, part in (
        (b"", "format is empty"),
        (b"GIF89a", "format is unknown"),
        (
            b"II*\0" + bytes(200),
            "format is unknown; expected a PNG, JPEG, WebP, AVIF or BMP photograph",
        ),
        (good[:20], "content is truncated or damaged"),
        (b"\xff\xd8\xff\xe0", "content is truncated or damaged"),
    ):
        file.write_bytes(content)
        assert part in refusal(read, file.name)
    Image.fromarray(picture(1, (30, 40, 3))).save(file)
    assert "size is 40 x 30 pixels; expected 32 x 24 pixels" in refusal(read, file.name)
    for kind in ("JPEG", "PNG"):
        exif = Image.Exif()
        exif[0x0112] = 3
        Image.fromarray(picture(1)).save(file, format=kind, exif=exif)
        assert "orientation is tag 3; expected a photograph stored upright" in refusal(
            read, file.name
        )
        exif[0x0112] = 1
        Image.fromarray(picture(1)).save(file, format=kind, exif=exif)
        read()


def test_pixels_that_cannot_be_used(tmp_path: Path) -> None:
    folder = write_drive(tmp_path / "street")
    file = folder / "middle_2.png"
    good = file.read_bytes()
    file.write_bytes(good[: len(good) // 2])
    drive = read_drive(folder)  # only the headers are read
    read_frame(drive, 1)
    assert "truncated or damaged" in refusal(lambda: read_frame(drive, 2), file.name)
    holes = np.dstack([picture(1), np.full((HEIGHT, WIDTH), 255, np.uint8)])
    holes[3, 4:7, 3] = 100
    Image.fromarray(holes).save(file)
    assert "alpha is less than opaque in 3 pixel(s)" in refusal(
        lambda: read_frame(drive, 2), file.name
    )
    holes[..., 3] = 255
    Image.fromarray(holes).save(file)
    np.testing.assert_array_equal(read_frame(drive, 2)[1], picture(1))
    Image.fromarray(picture(1, (HEIGHT, WIDTH + 1, 3))).save(file)
    assert "size is 33 x 24 pixels" in refusal(lambda: read_frame(drive, 2), file.name)
    os.unlink(file)
    assert "missing" in refusal(lambda: read_frame(drive, 2), file.name)
