"""Figures of one camera's depth: on the simulated city, where it is known, and on a real drive.

docs/street.md says what each figure means. ``real`` takes a folder in the layout of KITTI's
odometry: `calib.txt`, `poses.txt`, `image_l/`; ``python -m benchmarks.drives_depth FOLDER`` prints
its figures.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from assets_defs.street_billboards.graph import STREET
from assets_defs.workspace import CHECKOUT, Workspace
from benchmarks.drives_ibr import DepthPhotograph, rendered
from benchmarks.street_drive import KEYS, launch
from pipelines.drawing.picture_metrics import image_metrics
from pipelines.street_billboards import figures
from pipelines.street_billboards.capture.drive_depth import DriveDepth, DriveFrames, RigFrame
from pipelines.street_billboards.capture.held_out import held_out

FloatArray = NDArray[np.float64]
Map = NDArray[np.float32]

NEAREST, FARTHEST = 2.0, 40.0
FRAMES, SPACING, WIDTH, HEIGHT = 14, 3.0, 640, 400
TIMED = (1226, 370, 81.9)
"""Pixels and degrees of KITTI's camera."""
_BESIDE_ROAD = 15.0
"""Metres that whatever is no road is away, for a depth that knows nothing."""
_ROAD_HALF = 3.5
_AROUND = 3


class Photographed(NamedTuple):
    """A drive of one camera with the depth of each frame."""

    frames: DriveFrames
    truth: Map
    """(f, h, w), inf in the sky."""


def run() -> dict[str, Any]:
    """All figures of the simulated city."""
    city = simulated(FRAMES, WIDTH, HEIGHT, 75.0)
    return depth_figures(city) | moving_figures(city) | _seconds() | _memory() | _drop()


def simulated(frames: int, width: int, height: int, angle: float) -> Photographed:
    """The simulated city from one camera, every third metre, with what is true in each frame."""
    from pipelines.virtual.city.city import make_city
    from pipelines.virtual.city.drive import expose_photograph, plan_drive
    from pipelines.virtual.city.drive_photographs import EXPOSURE
    from pipelines.virtual.city.photographing import CityStage
    from storage.readers.street_photographs import street_photographs

    drive = plan_drive(frames, SPACING, width, height, view_angle=angle, cameras=1)
    random, shown, truth = np.random.default_rng(0), [], []
    with CityStage(make_city(frames * SPACING, 0), street_photographs(), width, height) as stage:
        for pose, gain in zip(drive.poses[:, 0], drive.gains[:, 0], strict=True):
            shot = stage.shoot(drive.intrinsics[0], pose, labels=True)
            shown.append(expose_photograph(shot.radiance, gain, EXPOSURE, 0.004, random)[None])
            truth.append(shot.depth)

    def load(frame: int) -> RigFrame:
        return RigFrame(shown[frame], drive.intrinsics, drive.poses[frame])

    taken = np.flatnonzero(~held_out(frames))
    return Photographed(DriveFrames(load, drive.poses, taken), np.array(truth, np.float32))


# ---- the simulated city ----------------------------------------------------------------------


def depth_figures(city: Photographed) -> dict[str, float]:
    """How much is known, how much of it is bad, and whether deviations say so; with nulls."""
    found = DriveDepth(city.frames, nearest=NEAREST, farthest=FARTHEST)
    asked = range(1, len(city.truth) - 1)
    maps = [found.maps(frame) for frame in asked]
    depth = np.concatenate([one.depth for one in maps])
    deviation = np.concatenate([one.deviation for one in maps])
    truth = city.truth[1:-1]
    flat = np.stack([road_and_distance(city.frames.load(frame)) for frame in asked])
    known = np.isfinite(depth)
    shuffled = deviation.copy()
    shuffled[known] = np.random.default_rng(0).permutation(deviation[known])
    return {
        "one_camera_known": figures.known_share(depth, truth),
        "one_camera_bad": figures.bad_depth_share(depth, truth),
        "one_camera_bad_null": figures.bad_depth_share(np.where(known, flat, np.nan), truth),
        "deviation_honest": figures.deviation_honest(depth, deviation, truth),
        "deviation_honest_null": figures.deviation_honest(depth, shuffled, truth),
    }


def road_and_distance(frame: RigFrame) -> Map:
    """Depth (h, w) of the plane z = 0 as far as a road goes to either side, and of one distance."""
    from pipelines.geometry.cameras import unproject_depth

    pose, lens = frame.poses[0], frame.intrinsics[0]
    shape = frame.photographs.shape[1:3]
    rays = unproject_depth(lens, pose, np.ones(shape)) - pose[:3, 3]
    with np.errstate(divide="ignore"):
        depth = np.where(rays[..., 2] < 0, -pose[2, 3] / rays[..., 2], np.inf)
    aside = np.abs(rays @ pose[:3, 0]) * np.minimum(depth, 1e6)
    return np.where(aside < _ROAD_HALF, depth, _BESIDE_ROAD).astype(np.float32)


def moving_figures(city: Photographed) -> dict[str, float]:
    """Share of what overtakes that has a depth; and of what is there without it."""
    boxes: dict[int, tuple[slice, slice]] = {}
    picture = np.random.default_rng(5).integers(0, 255, (40, 60, 3), np.uint8)
    picture = np.repeat(np.repeat(picture, 6, axis=0), 6, axis=1)

    def load(frame: int) -> RigFrame:
        """With a painted box on the road, 1.8 m wide, 4 m faster from frame to frame."""
        import cv2

        shown = city.frames.load(frame)
        lens, away = shown.intrinsics[0], 9.0 + 1.0 * frame
        scale = lens[0, 0] / away
        left, top = (lens[:2, 2] + np.array([0.9, 0.5]) * scale).astype(int)
        size = int(1.8 * scale), int(1.4 * scale)
        boxes[frame] = np.s_[top : top + size[1], left : left + size[0]]
        pixels = shown.photographs.copy()
        pixels[0][boxes[frame]] = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        return shown._replace(photographs=pixels)

    moving = DriveDepth(city.frames._replace(load=load), nearest=NEAREST, farthest=FARTHEST)
    still = DriveDepth(city.frames, nearest=NEAREST, farthest=FARTHEST)
    shares = []
    for frame in (4, 7):
        pair = [one.maps(frame).depth[0][boxes[frame]] for one in (moving, still)]
        shares.append([np.isfinite(one).mean() for one in pair])
    with_car, without = np.mean(shares, axis=0)
    return {"moving_known": float(with_car), "moving_known_null": float(without)}


def _seconds() -> dict[str, float]:
    """CPU seconds a frame at the size of KITTI's photographs, compiled before."""
    city = simulated(10, *TIMED)
    found = DriveDepth(city.frames, nearest=NEAREST, farthest=FARTHEST)
    found.maps(0)
    again = DriveDepth(city.frames, nearest=NEAREST, farthest=FARTHEST)
    start = time.process_time()
    for frame in map(int, city.frames.taken):
        again.before_sky(frame)
    return {"depth_s_per_frame": (time.process_time() - start) / len(city.frames.taken)}


def _memory() -> dict[str, float]:
    """Peak of depth alone, of 60 frames over 30: what was kept of each would be 1.2."""
    peaks = []
    for frames in (60, 30):
        command = [sys.executable, "-m", "benchmarks.drives_memory", str(frames)]
        done = subprocess.run(command, cwd=CHECKOUT, check=True, stdout=subprocess.PIPE, text=True)
        peaks.append(float(done.stdout))
    return {"memory_60_over_30": peaks[0] / peaks[1]}


def _drop() -> dict[str, float]:
    """Whole frames held out: the three cameras' street against the middle camera's alone."""
    whole = {cameras: _street_psnr(cameras) for cameras in (3, 1)}
    return {
        "three_cameras_whole_psnr_db": whole[3],
        "one_camera_whole_psnr_db": whole[1],
        "one_camera_drop_db": whole[3] - whole[1],
    }


def _street_psnr(cameras: int) -> float:
    with tempfile.TemporaryDirectory() as folder:
        launch(Path(folder), {"cameras": cameras, "flight_frames": 2}, None)
        store = Workspace(Path(folder)).store
        shown = store.open(STREET.slot("street_frames", KEYS))
        pictures, truth = shown["rendered"].values, shown["truth"].values
    return figures.mean_psnr(pictures, truth, np.ones(truth.shape[:3], bool))


# ---- a real drive ----------------------------------------------------------------------------


def kitti_frames(folder: Path) -> DriveFrames:
    """A drive in the layout of KITTI's odometry, its world turned to z up."""
    import cv2

    lens = np.atleast_2d(np.loadtxt(folder / "calib.txt"))[0].reshape(3, 4)[:, :3]
    # Of the first camera: x right, y down, z forward; the world's are x forward, y left, z up.
    upright = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    rows = np.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)
    poses = upright @ np.concatenate([rows, np.tile([[[0.0, 0, 0, 1]]], (len(rows), 1, 1))], axis=1)
    files = sorted((folder / "image_l").iterdir())

    def load(frame: int) -> RigFrame:
        from pipelines.street_billboards.capture.centred_photographs import (
            centre_photographs,
            centred_intrinsics,
        )

        grey = cv2.imread(str(files[frame]), cv2.IMREAD_GRAYSCALE)
        if grey is None:
            raise ValueError(f"{files[frame]}: no picture; expected a photograph of the drive.")
        pixels = np.repeat(np.asarray(grey, np.uint8)[None, ..., None], 3, axis=-1)
        height, width = pixels.shape[1:3]
        own = centred_intrinsics(lens, width, height)
        return RigFrame(centre_photographs(pixels, lens[None]), own[None], poses[frame, None])

    return DriveFrames(load, poses[:, None], np.flatnonzero(~held_out(len(poses))))


def real(folder: Path) -> dict[str, float]:
    """Every tenth frame: the street, pictures from depth alone, the nearest photograph."""
    drive = kitti_frames(folder)
    held = np.setdiff1d(np.arange(len(drive.poses)), drive.taken)
    found = DriveDepth(drive, nearest=NEAREST, farthest=FARTHEST)
    known, start = [], time.process_time()
    maps = {}
    for frame in map(int, drive.taken):
        maps[frame] = found.before_sky(frame)
        known.append(float(np.isfinite(maps[frame].depth).mean()))
    answer = {
        "real_known": float(np.mean(known)),
        "real_depth_s_per_frame": (time.process_time() - start) / len(drive.taken),
    }
    truths = [drive.load(int(frame)).photographs[0] for frame in held]
    nearest, views = [], []
    for frame in held:
        ways = drive.poses[drive.taken, 0, :3, 3] - drive.poses[frame, 0, :3, 3]
        away = np.linalg.norm(ways, axis=1)
        around = [int(one) for one in drive.taken[np.argsort(away)[: _AROUND * 2]]]
        shown = [drive.load(one) for one in around]
        nearest.append(shown[0].photographs[0])
        views.append(
            rendered(
                [
                    DepthPhotograph(s.photographs[0], maps[n].depth[0], s.intrinsics[0], s.poses[0])
                    for n, s in zip(around, shown, strict=True)
                ],
                shown[0].intrinsics[0],
                drive.poses[frame, 0],
            )
        )
    whole = np.ones(truths[0].shape[:2], bool)
    for name, pictures in (("nearest", nearest), ("ibr", views)):
        judged = [image_metrics(*one, whole) for one in zip(pictures, truths, strict=True)]
        answer |= _named(f"real_{name}", judged)
    return answer | _real_street(drive, held, truths)


def _named(name: str, judged: list[Any]) -> dict[str, float]:
    return {
        f"{name}_{figure}": float(np.mean([getattr(one, figure) for one in judged]))
        for figure in ("psnr", "ssim", "flip")
    }


def _real_street(
    drive: DriveFrames, held: NDArray[np.integer], truths: list[NDArray[np.uint8]]
) -> dict[str, float]:
    from pipelines.drawing.colour import to_8bit
    from pipelines.street_billboards.drawing.street_stage import StreetStage
    from pipelines.street_billboards.textures.eigen_textures import byte_counts
    from pipelines.street_billboards.whole_street import street_of_frames

    frames = [drive.load(int(frame)) for frame in drive.taken]
    street = street_of_frames(frames)
    whole = np.ones(truths[0].shape[:2], bool)
    size = (truths[0].shape[1], truths[0].shape[0])
    everywhere, where_covered, covered = [], [], []
    with StreetStage(street.billboards, street.pages, street.sky, size) as stage:
        for frame, truth in zip(held, truths, strict=True):
            view = stage.view(frames[0].intrinsics[0], drive.poses[frame, 0])
            inside = view.covered > 0.5
            shown = figures.match_exposure(to_8bit(view.with_sky), truth, inside)
            everywhere.append(image_metrics(shown, truth, whole))
            where_covered.append(image_metrics(shown, truth, inside))
            covered.append(float(inside.mean()))
    metres = figures.path_length(drive.poses[:, 0, :3, 3])
    return {
        **_named("real_whole", everywhere),
        **_named("real_covered", where_covered),
        "real_coverage": float(np.mean(covered)),
        "real_bytes_per_metre": byte_counts(street.textures)["total"] / metres,
    }


if __name__ == "__main__":
    print(json.dumps(real(Path(sys.argv[1])) if len(sys.argv) > 1 else run()))
