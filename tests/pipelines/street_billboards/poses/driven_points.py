"""A drive past known points: a bundle and exact sightings, without pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipelines.street_billboards.poses.bundle import Bundle, Sightings, moved_bundle, residuals

FloatArray = NDArray[np.float64]
FOCAL = 400.0


def driven(
    frames: int = 14, points: int = 300, *, cameras: int = 1, bend: float = 0.5, seed: int = 0
) -> tuple[Bundle, Sightings]:
    """A metre a frame along z, turning by ``bend`` radians in all; x right, y down.

    Points stand beside and on the road; each is seen wherever it is in the picture, 640 x 400.
    """
    random = np.random.default_rng(seed)
    heading = bend * np.linspace(0, 1, frames)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    small = random.normal(scale=0.003, size=(frames, 3)) + np.outer(heading, [0, 1, 0])
    poses[:, :3, :3] = Rotation.from_rotvec(small).as_matrix()
    step = np.column_stack([np.sin(heading), np.zeros(frames), np.cos(heading)])
    poses[1:, :3, 3] = np.cumsum(step, axis=0)[:-1]
    rig = np.tile(np.eye(4), (cameras, 1, 1))
    rig[:, 0, 3] = 0.8 * np.arange(cameras)
    lens = np.array([[FOCAL, 0, 319.5], [0, FOCAL, 199.5], [0, 0, 1]])
    near = random.integers(0, frames, points)
    ahead = np.column_stack(
        [
            random.choice([-1, 1], points) * random.uniform(2, 9, points),
            random.uniform(-5, 1.5, points),
            random.uniform(4, 30, points),
        ]
    )
    places = poses[near, :3, 3] + np.einsum("nij,nj->ni", poses[near, :3, :3], ahead)
    bundle = Bundle(poses, rig, np.tile(lens, (cameras, 1, 1)), places)
    every = np.meshgrid(np.arange(frames), np.arange(cameras), np.arange(points), indexing="ij")
    frame, camera, point = (values.ravel() for values in every)
    seen = Sightings(frame, camera, point, np.zeros((len(frame), 2)))
    shown, depth = residuals(bundle, seen)
    inside = (depth > 1) & ((shown > 0) & (shown < [640, 400])).all(axis=1)
    seen = seen._replace(places=shown).some(inside)
    often = np.bincount(seen.point, minlength=points) >= 3
    number = np.cumsum(often) - 1
    seen = seen.some(often[seen.point])
    return bundle._replace(points=places[often]), seen._replace(point=number[seen.point])


def noisy(seen: Sightings, pixels: float, seed: int) -> Sightings:
    noise = np.random.default_rng(seed).normal(scale=pixels, size=seen.places.shape)
    return seen._replace(places=seen.places + noise)


def shaken(bundle: Bundle, place: float, turn: float, seed: int) -> Bundle:
    """With noise on its poses, and on its points three times that of places."""
    random = np.random.default_rng(seed)
    frames = len(bundle.poses)
    step = random.normal(size=(frames, 6)) * np.repeat([turn, place], 3)
    return moved_bundle(
        bundle, step.reshape(-1), random.normal(scale=3 * place, size=bundle.points.shape)
    )
