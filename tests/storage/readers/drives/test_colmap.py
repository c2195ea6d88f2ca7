"""COLMAP's files as pycolmap writes them: our reader against pycolmap's own."""

from __future__ import annotations

import shutil
import struct
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest

from benchmarks.written_drives import FORMS
from storage.readers import BadInput
from storage.readers.drives import read_drive
from storage.readers.drives.colmap import _lens
from storage.readers.drives.colmap_models import (
    MODELS,
    ColmapCamera,
    count_images,
    read_cameras,
    read_images,
    read_points,
    read_rig_frames,
)


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, pycolmap.Reconstruction]:
    """Two rigs of two cameras, seven frames, forty points with tracks: binary and text."""
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig = 2, 2
    options.num_frames_per_rig, options.num_points3D = 7, 40
    model = pycolmap.synthesize_dataset(options)
    folder = tmp_path_factory.mktemp("models")
    for name in ("binary", "text"):
        (folder / name).mkdir()
    model.write_binary(str(folder / "binary"))
    model.write_text(str(folder / "text"))
    return folder, model


@pytest.mark.parametrize("form", ["binary", "text"])
def test_models_are_as_pycolmap_has_them(
    models: tuple[Path, pycolmap.Reconstruction], form: str
) -> None:
    folder, model = models
    ending = "bin" if form == "binary" else "txt"
    cameras = read_cameras(folder / form / f"cameras.{ending}")
    assert cameras.keys() == set(model.cameras)
    for number, camera in cameras.items():
        other = model.cameras[number]
        assert (camera.model, camera.width, camera.height) == (
            other.model_name, other.width, other.height,
        )  # fmt: skip
        np.testing.assert_allclose(camera.parameters, other.params, rtol=1e-15)
    images = read_images(folder / form / f"images.{ending}")
    assert len(images) == len(model.images) == 28
    assert count_images(folder / form / f"images.{ending}") == 28
    for image in images:
        other = model.images[image.number]
        assert (image.camera, image.name) == (other.camera_id, other.name)
        x, y, z, w = other.cam_from_world().rotation.quat
        sign = np.sign(w * image.quaternion[0])
        np.testing.assert_allclose(sign * image.quaternion, [w, x, y, z], atol=1e-12)
        np.testing.assert_allclose(image.translation, other.cam_from_world().translation)
    frames = read_rig_frames(folder / form / f"frames.{ending}")
    assert frames == {number: image.frame_id for number, image in model.images.items()}
    points = read_points(folder / form / f"points3D.{ending}")
    expected = np.array([point.xyz for point in model.points3D.values()])
    np.testing.assert_allclose(sorted(points.tolist()), sorted(expected.tolist()), atol=1e-12)


PARAMETERS = {
    "SIMPLE_PINHOLE": [500, 320.5, 239],
    "PINHOLE": [500, 510, 320.5, 239],
    "SIMPLE_RADIAL": [500, 320.5, 239, -0.1],
    "RADIAL": [500, 320.5, 239, -0.1, 0.03],
    "OPENCV": [500, 510, 320.5, 239, -0.1, 0.03, 0.002, -0.003],
    "OPENCV_FISHEYE": [500, 510, 320.5, 239, 0.05, -0.02, 0.01, -0.003],
    "FULL_OPENCV": [500, 510, 320.5, 239, -0.1, 0.03, 0.002, -0.003, 0.02, 0, 0, 0],
    "SIMPLE_RADIAL_FISHEYE": [500, 320.5, 239, 0.05],
    "RADIAL_FISHEYE": [500, 320.5, 239, 0.05, -0.02],
    "SIMPLE_FISHEYE": [500, 320.5, 239],
    "FISHEYE": [500, 510, 320.5, 239],
}


@pytest.mark.parametrize("model", PARAMETERS)
def test_lenses_show_points_where_pycolmap_has_them(model: str) -> None:
    """OpenCV's projection through our lens against pycolmap's, half a pixel between their zeros."""
    numbers = [float(number) for number in PARAMETERS[model]]
    camera = pycolmap.Camera(camera_id=1, model=model, width=640, height=480, params=numbers)
    points = np.random.default_rng(3).uniform([-0.9, -0.7, 1], [0.9, 0.7, 1.6], (200, 3))
    expected = camera.img_from_cam(points)
    lens = _lens(Path("cameras.bin"), 1, ColmapCamera(model, 640, 480, np.array(numbers)))
    k = np.array([[lens.fl_x, 0, lens.cx], [0, lens.fl_y, lens.cy], [0, 0, 1]])
    project = cv2.fisheye.projectPoints if lens.model == "fisheye" else cv2.projectPoints
    still = np.zeros((3, 1))
    coefficients = np.array(lens.coefficients)
    if lens.model == "fisheye":
        found, _ = project(points.reshape(-1, 1, 3), still, still, k, coefficients)
    else:
        found, _ = project(points, still, still, k, coefficients)
    np.testing.assert_allclose(found.reshape(-1, 2) + 0.5, expected, atol=1e-9)


def test_panoramas_show_points_where_pycolmap_has_them() -> None:
    from storage.readers.drives.lenses import AZIMUTHS, _places, _to_the_right, pinhole_of

    camera = pycolmap.Camera(
        camera_id=1, model="EQUIRECTANGULAR", width=640, height=320, params=[640.0, 320.0]
    )
    known = ColmapCamera("EQUIRECTANGULAR", 640, 320, np.array([640.0, 320.0]))
    lens = _lens(Path("cameras.bin"), 1, known)
    k, width, height = pinhole_of(lens)
    rows, columns = np.mgrid[:height, :width]
    pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1).reshape(-1, 3)
    for azimuth in AZIMUTHS:
        view = lens._replace(azimuth=float(azimuth))
        across, down = _places(view, k, width, height)
        rays = pixels @ np.linalg.inv(k).T @ _to_the_right(azimuth).T
        expected = camera.img_from_cam(rays) - 0.5
        apart = across.ravel() - expected[:, 0]
        np.testing.assert_allclose((apart + 320) % 640 - 320, 0, atol=1e-3)
        np.testing.assert_allclose(down.ravel(), expected[:, 1], atol=1e-3)


def test_models_of_cameras_are_numbered_as_pycolmap_numbers_them() -> None:
    for name, (number, parameters) in MODELS.items():
        model = pycolmap.CameraModelId(number)
        assert model.name == name
        camera = pycolmap.Camera.create_from_model_name(1, name, 100.0, 64, 48)
        assert len(camera.params) == parameters


@pytest.mark.parametrize(
    ("model", "found"),
    [
        ("FOV 32 24 30 30 16 12 0.9", "FOV"),
        ("FULL_OPENCV 32 24 30 30 16 12 0 0 0 0 0 0.1 0 0", "FULL_OPENCV with terms beyond k3"),
        ("THIN_PRISM_FISHEYE 32 24 30 30 16 12 0 0 0 0 0 0 0 0", "THIN_PRISM_FISHEYE"),
        ("MAGIC 32 24 30", "MAGIC"),
        ("PINHOLE 32 24 30 30 16", "3 parameters of a camera PINHOLE"),
        ("PINHOLE 32 24 30 30 16 nan", "not finite"),
        ("PINHOLE 32 24 -30 30 16 12", "-30"),
        ("PINHOLE 32 24 30 30 160 12", "160"),
        ("PINHOLE 32 1e9 30 30 16 12", '"1e9" among its numbers'),
        ("PINHOLE 99999999 24 30 30 16 12", "99999999"),
        ("PINHOLE", "2 words"),
    ],
)
def test_cameras_that_cannot_be_used(tmp_path: Path, model: str, found: str) -> None:
    written = FORMS["colmap_older_text"](tmp_path / "drive")
    (written.path / "colmap/sparse/0/cameras.txt").write_text(f"4 {model}\n")
    with pytest.raises(BadInput) as caught:
        read_drive(written.path)
    assert caught.value.found.startswith(found), caught.value


def test_what_lacks(tmp_path: Path) -> None:
    written = FORMS["colmap_older_text"](tmp_path / "drive")
    model = written.path / "colmap/sparse/0"
    good = (model / "images.txt").read_text()
    for picture in (written.path / "images").iterdir():  # outside of the pictures' folder
        shutil.copy(picture, written.path / f"secret {picture.name}")
    for content, part in (
        ("# none\n", "number of images is 0"),
        (good.replace(" 4 IMG", " 5 IMG"), "camera 5 is missing"),
        (good.replace("IMG ", "../secret IMG "), "expected a path inside the folder"),
        (good.replace("IMG ", "IMAGE "), "folder of its photographs is nowhere"),
        ("7 1 0 0 0 0 0 4 a.png\n\n", "9 words"),
        ("7 1 0 0 0 0 0 inf 4 a.png\n\n", "line 1 is not finite"),
        ("7 1 0 0 0 0 0 x 4 a.png\n\n", 'line 1 is "x" among its numbers'),
        (good.replace("\n8 ", "\n8 0 0 0 0 0 0 0 4 IMG 99.png\n\n9 "), "quaternion of length 0"),
    ):
        (model / "images.txt").write_text(content)
        with pytest.raises(BadInput, match="expected") as caught:
            read_drive(written.path)
        assert part in str(caught.value), caught.value


def test_binary_files_that_lie(
    models: tuple[Path, pycolmap.Reconstruction], tmp_path: Path
) -> None:
    """Counts of 2^60, files cut anywhere, names without an end: a sentence, at once."""
    readers = {
        "cameras.bin": read_cameras, "images.bin": read_images,
        "frames.bin": read_rig_frames, "points3D.bin": read_points,
    }  # fmt: skip
    for name, read in readers.items():
        good = (models[0] / "binary" / name).read_bytes()
        file = tmp_path / name
        for cut in [0, 4, 8, 9, len(good) // 2, len(good) - 1]:
            file.write_bytes(good[:cut])
            with pytest.raises(BadInput):
                read(file)
        file.write_bytes(struct.pack("<Q", 1 << 60) + good[8:])
        with pytest.raises(BadInput, match="expected at most"):
            read(file)
    file = tmp_path / "images.bin"
    file.write_bytes(struct.pack("<QI7dI", 1, 1, 1, 0, 0, 0, 0, 0, 0, 1) + b"a" * 100_000)
    with pytest.raises(BadInput, match="without an end"):
        read_images(file)
    head = struct.pack("<QI7dI", 1, 1, 1, 0, 0, 0, 0, 0, 0, 1) + b"a.png\0"
    file.write_bytes(head + struct.pack("<Q", 1 << 60))
    with pytest.raises(BadInput, match="number of keypoints"):
        read_images(file)
