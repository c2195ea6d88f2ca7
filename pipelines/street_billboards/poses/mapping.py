"""Features of a film's frames to poses and points: COLMAP's incremental mapping, set for driving.

Schönberger and Frahm, "Structure-from-motion revisited" (2016), by pycolmap. As it comes it finds
no pose of a camera that drives forward: its first pair must not move towards what it sees, and its
points must be seen under angles that a road does not give. Both are allowed here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.bundle import Bundle, Sightings, residuals
from pipelines.street_billboards.poses.features import Features, match_features

FloatArray = NDArray[np.float64]

NEIGHBOURS = 8
"""Frames ahead that each is matched with."""
FEWEST_MATCHES = 15
_LEAST_ANGLE = 0.7
"""Degrees under which a point is seen at least."""
_ATTEMPTS = ((4.0, 1.0), (8.0, 0.8), (2.0, 1.25), (12.0, 1.0), (1.0, 0.9))
"""Degrees under which the first pair's points are seen at least, and a factor of the guessed focal
length."""
_AGREE = 0.03
"""By how much sightings that fit, and frames with a pose, may differ where two attempts agree."""


class Pinhole(NamedTuple):
    """One camera of pictures of one size; the middle of the first pixel is at (0, 0)."""

    width: int
    height: int
    focal: float
    """Pixels, across and down."""
    middle: tuple[float, float]
    """The principal point, pixels."""
    is_known: bool
    """Else the focal length is a guess, to be improved."""


class Mapped(NamedTuple):
    """What was found: the frames that have a pose, in their order."""

    frames: NDArray[np.int64]
    """Their numbers."""
    bundle: Bundle
    """Poses of these frames, one camera, points."""
    seen: Sightings
    """Where points were found; ``frame`` counts ``frames``."""
    feature: NDArray[np.int64]
    """(m,), which feature of its frame each sighting is."""


def write_matches(file: Path, camera: Pinhole, frames: Iterable[Features]) -> None:
    """A database of features and of their matches in the eight frames before, verified.

    Frames are taken one by one; nine of them are in memory. Matches that no motion of a camera
    explains are dropped (the essential or fundamental matrix, by RANSAC).
    """
    import pycolmap

    before: deque[tuple[int, Features]] = deque(maxlen=NEIGHBOURS)
    with _quiet(), pycolmap.Database.open(file) as database:
        lens = _camera(camera)
        database.write_camera(lens, use_camera_id=True)
        rig = pycolmap.Rig(rig_id=1)
        rig.add_ref_sensor(lens.sensor_id)
        database.write_rig(rig, use_rig_id=True)
        for number, features in enumerate(frames, start=1):
            _write_frame(database, number, features)
            for other, earlier in before:
                matches = match_features(earlier, features)
                if len(matches) >= FEWEST_MATCHES:
                    database.write_matches(other, number, matches)
            before.append((number, features))
    with _quiet():
        verifying = pycolmap.TwoViewGeometryOptions()
        verifying.ransac.random_seed = 0
        pycolmap.geometric_verification(file, two_view_geometry_options=verifying)


def map_frames(file: Path, count: int, camera: Pinhole) -> Mapped | None:
    """Poses and points from a database of ``count`` frames; None where no pair starts it.

    A first pair may be understood wrongly (a street's walls are planes, and its motion is forward),
    and all that follows stands on it. So it is tried from other pairs and focal lengths until two
    attempts agree; the one with most sightings within a pixel is taken.
    """
    import pycolmap

    best: Mapped | None = None
    most = 0
    for angle, factor in _ATTEMPTS:
        if not camera.is_known:
            _guess(file, factor * camera.focal)
        with _quiet():
            options = _options(angle, fixed_focal=camera.is_known)
            models = pycolmap.incremental_mapping(file, file.parent, file.parent, options)
        for model in models.values():
            found = _mapped(model)
            good = int((np.linalg.norm(residuals(found.bundle, found.seen)[0], axis=1) < 1).sum())
            before = 0 if best is None else len(best.frames)
            agree = abs(good - most) < _AGREE * most
            agree &= abs(len(found.frames) - before) <= _AGREE * count
            if good > most:
                best, most = found, good
            if agree:
                return best
    return best


def _guess(file: Path, focal: float) -> None:
    import pycolmap

    with pycolmap.Database.open(file) as database:
        (lens,) = database.read_all_cameras()
        lens.params = [focal, *lens.params[1:]]
        database.update_camera(lens)


def _options(first_angle: float, *, fixed_focal: bool) -> Any:
    import pycolmap

    options = pycolmap.IncrementalPipelineOptions()
    options.extract_colors = False
    options.multiple_models = False
    options.random_seed = 0
    options.min_num_matches = FEWEST_MATCHES
    options.ba_refine_focal_length = not fixed_focal
    options.ba_refine_extra_params = False
    options.mapper.abs_pose_refine_focal_length = not fixed_focal
    options.mapper.abs_pose_refine_extra_params = False
    options.mapper.init_max_forward_motion = 1.0
    options.mapper.init_min_tri_angle = first_angle
    options.mapper.filter_min_tri_angle = _LEAST_ANGLE
    options.triangulation.min_angle = _LEAST_ANGLE
    return options


def _camera(camera: Pinhole) -> Any:
    import pycolmap

    # COLMAP counts from the first pixel's outer corner.
    middle = camera.middle[0] + 0.5, camera.middle[1] + 0.5
    made = pycolmap.Camera(
        camera_id=1,
        model="SIMPLE_PINHOLE",
        width=camera.width,
        height=camera.height,
        params=[camera.focal, *middle],
    )
    # Also a guess: matches are then verified both with it and without.
    made.has_prior_focal_length = True
    return made


def _write_frame(database: Any, number: int, features: Features) -> None:
    import pycolmap

    image = pycolmap.Image(name=f"{number:08d}", camera_id=1, image_id=number)
    database.write_image(image, use_image_id=True)
    frame = pycolmap.Frame(frame_id=number, rig_id=1)
    frame.add_data_id(image.data_id)
    database.write_frame(frame, use_frame_id=True)
    rows = np.zeros((len(features.places), 4), np.float32)
    rows[:, :2], rows[:, 2] = features.places + 0.5, 1.0
    database.write_keypoints(number, rows)


def _mapped(model: Any) -> Mapped:
    """COLMAP's objects as arrays."""
    images = sorted(model.reg_image_ids())
    poses = np.tile(np.eye(4), (len(images), 1, 1))
    for row, number in enumerate(images):
        poses[row, :3] = model.image(number).cam_from_world().inverse().matrix()
    focal, *middle = model.camera(1).params
    lens = [[focal, 0, middle[0] - 0.5], [0, focal, middle[1] - 0.5], [0, 0, 1]]
    row_of = {number: row for row, number in enumerate(images)}
    frame: list[int] = []
    point: list[int] = []
    feature: list[int] = []
    points: list[FloatArray] = []
    places: list[FloatArray] = []
    pictures = {number: model.image(number).points2D for number in images}
    for known in model.points3D.values():
        for element in known.track.elements:
            frame.append(row_of[element.image_id])
            point.append(len(points))
            feature.append(element.point2D_idx)
            places.append(pictures[element.image_id][element.point2D_idx].xy)
        points.append(known.xyz)
    seen = Sightings(
        np.array(frame, np.int64),
        np.zeros(len(frame), np.int64),
        np.array(point, np.int64),
        np.array(places, np.float64).reshape(-1, 2) - 0.5,
    )
    one_camera = np.eye(4)[None]
    bundle = Bundle(poses, one_camera, np.array([lens]), np.array(points).reshape(-1, 3))
    return Mapped(np.array(images, np.int64) - 1, bundle, seen, np.array(feature, np.int64))


@contextmanager
def _quiet() -> Iterator[None]:
    """COLMAP says only what is fatal."""
    import pycolmap

    before = pycolmap.logging.minloglevel
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    try:
        yield
    finally:
        pycolmap.logging.minloglevel = before
