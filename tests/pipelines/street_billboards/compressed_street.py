"""Random compressed textures and billboards to pack and draw."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.textures.texture_tables import SIDE, CompressedTextures
from pipelines.street_billboards.textures.view_directions import CIRCLE


def random_textures(
    turns: NDArray[np.bool_],
    *,
    seed: int = 0,
    colour: str = "ycocg",
    tint_side: int = 16,
    ranks: ArrayLike | None = None,
    most_views: int = 8,
    contrast: float = 40.0,
    opaque: bool = False,
) -> CompressedTextures:
    """Textures of billboards that turn (a mask a view) or not (b,), 1 to ``most_views`` views each.

    ranks: (b, 3) or what broadcasts; else 0 to 6 and 0 to 2 and 0 to 3. contrast: in codes.
    """
    rng = np.random.default_rng(seed)
    count = len(turns)
    if ranks is None:
        ranks = rng.integers(0, [7, 3, 4], (count, 3))
    of_channel = np.broadcast_to(np.asarray(ranks), (count, 3)).astype(np.int64)
    views = rng.integers(1, most_views + 1, count)
    directions = [np.sort(rng.permutation(SIDE)[:number]) for number in views]
    means = rng.integers(90, 166, (views.sum(), 3))
    if colour == "ycocg":
        means[:, 1:] = rng.integers(108, 148, (len(means), 2))
    sides = (SIDE, tint_side, tint_side)
    sums = of_channel.sum(axis=0)
    # What single planes may add to each other stays about as large as one of them.
    share = contrast / np.sqrt(np.maximum(of_channel, 1))
    masks = np.where(turns, views, 1)
    y, x = np.mgrid[:SIDE, :SIDE] - (SIDE - 1) / 2
    radius = rng.uniform(10, 20, masks.sum())[:, None, None]
    alpha = np.full((masks.sum(), SIDE, SIDE), True) if opaque else x**2 + y**2 < radius**2
    planes = [_smooth(rng, int(sums[c]), sides[c]) for c in range(3)]
    scales = [
        np.repeat(share[:, c] * (1.0 if c == 0 else 0.3), of_channel[:, c]).astype(np.float32)
        for c in range(3)
    ]
    weights = [
        rng.integers(0, 256, int((of_channel[:, c] * views).sum()), dtype=np.uint8)
        for c in range(3)
    ]
    return CompressedTextures(
        colour=colour,
        first=np.append(0, np.cumsum(views)),
        direction=np.concatenate([np.empty(0), *directions]).astype(np.uint8),
        means=means.astype(np.uint8),
        ranks=of_channel.astype(np.uint8),
        planes=(planes[0], planes[1], planes[2]),
        scales=(scales[0], scales[1], scales[2]),
        weights=(weights[0], weights[1], weights[2]),
        first_mask=np.append(0, np.cumsum(masks)),
        masks=np.packbits(alpha, axis=-1),
    )


def _smooth(rng: np.random.Generator, count: int, side: int) -> NDArray[np.uint8]:
    noise = rng.random((count, side, side))
    for axis in (1, 2):
        noise = (np.roll(noise, 1, axis) + noise + np.roll(noise, -1, axis)) / 3
    return np.rint(np.clip(4 * noise - 1.5, 0, 1) * 255).astype(np.uint8)


def scattered(
    count: int, *, seed: int = 0, reach: float = 12.0, all_turn: bool | None = None
) -> Billboards:
    """Billboards of 0.3 to 1.2 m around the origin, some still in any plane, some that turn."""
    rng = np.random.default_rng(seed + 1000)
    turns = rng.random(count) < 0.5 if all_turn is None else np.full(count, all_turn)
    half = rng.uniform(0.15, 0.6, (count, 2))
    axes = np.linalg.qr(rng.standard_normal((count, 3, 3)))[0]
    half_s, half_t = axes[:, 0] * half[:, :1], axes[:, 1] * half[:, 1:]
    half_s[turns] = half[turns, :1] * [1.0, 0.0, 0.0]
    half_t[turns] = half[turns, :1] * [0.0, 0.0, 1.0]
    centre = rng.uniform(-reach, reach, (count, 3))
    return Billboards(
        centre=centre,
        voxel=centre,
        turns=turns,
        half_s=half_s.astype(np.float32),
        half_t=half_t.astype(np.float32),
        fan=rng.integers(0, CIRCLE, count).astype(np.int32),
    )


def facing(azimuth: float, fan: int, *, half: float = 1.0, turns: bool = False) -> Billboards:
    """One square in the origin that faces a viewer at this azimuth, in degrees."""
    angle = np.radians(azimuth)
    row = [1.0, 0.0, 0.0] if turns else [-np.sin(angle), np.cos(angle), 0.0]
    return Billboards(
        centre=np.zeros((1, 3)),
        voxel=np.zeros((1, 3)),
        turns=np.array([turns]),
        half_s=np.array([row], np.float32) * np.float32(half),
        half_t=np.array([[0.0, 0.0, half]], np.float32),
        fan=np.array([fan], np.int32),
    )


def placed_camera(
    place: ArrayLike, target: ArrayLike, size: tuple[int, int], focal: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """K (3, 3) and the pose (4, 4) of an upright camera; size is width, height."""
    width, height = size
    intrinsics = np.array(
        [[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]]
    )
    pose = np.eye(4)
    forward = np.asarray(target, np.float64) - np.asarray(place, np.float64)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose[:3] = np.column_stack([right, np.cross(forward, right), forward, np.asarray(place)])
    return intrinsics, pose
