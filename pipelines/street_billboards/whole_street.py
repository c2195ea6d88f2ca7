"""All steps to a street, from a few frames that fit into memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.cameras import Cameras, unproject_depth
from pipelines.street_billboards.billboards import fit_billboards
from pipelines.street_billboards.capture.drive_depth import (
    DriveDepth,
    DriveFrames,
    RigFrame,
    open_to_sky,
    sky_views,
)
from pipelines.street_billboards.capture.drive_points import (
    Fusion,
    LoadedByFrame,
    company_of,
    drive_gains,
    drive_points,
)
from pipelines.street_billboards.capture.exposure import exposure_lut
from pipelines.street_billboards.capture.point_fusion import RgbdViews
from pipelines.street_billboards.capture.sky import SkyView, sky_map
from pipelines.street_billboards.capture.surface_depth import fill_unknown_depth
from pipelines.street_billboards.octree import octree_leaves
from pipelines.street_billboards.street_model import StreetModel
from pipelines.street_billboards.textures.atlases import pack_pages
from pipelines.street_billboards.textures.eigen_textures import compress_views
from pipelines.street_billboards.textures.photographs import Photographs
from pipelines.street_billboards.textures.view_textures import view_textures

FloatArray = NDArray[np.float64]


def street_of_frames(
    frames: Sequence[RigFrame],
    *,
    voxel: float = 0.8,
    least_points: int = 10,
    nearest: float = 2.0,
    farthest: float = 40.0,
    error: float = 4.4,
) -> StreetModel:
    """All steps on frames of one rig or camera: depth, points, billboards, textures, pages.

    voxel: metres, side of an octree's leaf, which holds ``least_points`` at least; nearest,
    farthest: metres, between which depth is looked for; error: of the textures, in codes. Of a
    single frame every pixel of known depth becomes a point; of several those that they confirm.
    Raises ValueError where there are none, and for a single frame of one camera.
    """
    views, sky = _with_depth(frames, nearest, farthest)
    _, height, width = views.depth.shape
    cameras = len(frames[0].poses)
    drive = LoadedByFrame(len(frames), lambda taken: _some(views, taken, cameras))
    alone = len(frames) == 1
    fusion = Fusion(company=company_of(cameras))
    positions = _every_point(views) if alone else drive_points(drive, fusion).points.positions
    leaves = octree_leaves(positions, voxel, least_points)
    billboards = fit_billboards(
        leaves, positions, Cameras(views.intrinsics, views.poses, width, height)
    )
    gains = drive_gains(positions, drive, cameras, farthest=farthest)
    fill_unknown_depth(views, positions, farthest=farthest)
    photographs = Photographs(
        views.photographs,
        views.depth,
        views.deviation,
        views.intrinsics,
        views.poses,
        exposure_lut(gains.reshape(-1, 3)),
    )
    sampled = view_textures(billboards, leaves.side, photographs, farthest=farthest)
    textures = compress_views(sampled, billboards.turns, error=error)
    return StreetModel(billboards, pack_pages(textures), textures, sky)


def _with_depth(
    frames: Sequence[RigFrame], nearest: float, farthest: float
) -> tuple[RgbdViews, NDArray[np.float32]]:
    """All photographs with their depths, frame by frame, and the sky behind them."""
    poses = np.stack([frame.poses for frame in frames])
    drive = DriveFrames(frames.__getitem__, poses, np.arange(len(frames)))
    found = DriveDepth(drive, nearest=nearest, farthest=farthest)
    views, skies = [], list[SkyView]()
    for number, frame in enumerate(frames):
        maps = found.maps(number)
        skies += sky_views(frame, maps)
        views.append(RgbdViews(maps.depth, maps.deviation, *frame))
    joined = RgbdViews._make(
        np.concatenate([getattr(view, name) for view in views]) for name in RgbdViews._fields
    )
    return joined._replace(depth=open_to_sky(skies)), sky_map(skies)


def _some(views: RgbdViews, taken: slice, cameras: int) -> RgbdViews:
    """The photographs of some frames with so many cameras each."""
    rows = slice(taken.start * cameras, taken.stop * cameras)
    return RgbdViews._make(values[rows] for values in views)


def _every_point(views: RgbdViews) -> FloatArray:
    """World positions (n, 3) of all pixels whose depth is known."""
    places = []
    for lens, pose, depth in zip(views.intrinsics, views.poses, views.depth, strict=True):
        known = np.isfinite(depth)
        places.append(unproject_depth(lens, pose, np.where(known, depth, 1.0))[known])
    return np.concatenate(places)
