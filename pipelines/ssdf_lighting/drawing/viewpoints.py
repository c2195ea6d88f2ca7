"""Where the camera stands: an open box is looked into, not at its back sides."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipelines.drawing.stage import Camera, fitting_distance, orbit
from pipelines.geometry.rays import build_scene, first_hits
from pipelines.ssdf_lighting.drawing.camera_rays import camera_rays, pixel_centres
from pipelines.ssdf_lighting.scene import Scene

VIEW_ANGLE = 30.0
AZIMUTH, ELEVATION = -62.0, 24.0
"""Degrees, where nothing speaks against them."""

_LOOKED_AT = (48, 36)  # pixels
_FEW = 0.04
_GAP = 0.2
_TURNS = tuple(15.0 * side * step for step in range(13) for side in (1, -1))
_ELEVATIONS = (ELEVATION, 8.0, 55.0)


class Viewpoint(NamedTuple):
    """``azimuth`` and ``elevation``, degrees; ``behind``: the share of what is seen of the scene
    that is seen from behind; ``camera``: that which stands there."""

    azimuth: float
    elevation: float
    behind: float
    camera: Camera


def scene_camera(scene: Scene, azimuth: float, elevation: float, aspect: float) -> Camera:
    """A camera on an orbit, so near that all that stands on the floor just fits in; degrees.

    The floor is taken to be what lies lowest: a twentieth of the scene's height.
    """
    height = np.ptp(scene.vertices[:, 2])
    raised = scene.vertices[scene.vertices[:, 2] > scene.vertices[:, 2].min() + 0.05 * height]
    shown = raised if len(raised) else scene.vertices
    low, high = shown.min(axis=0), shown.max(axis=0)
    bottom = scene.vertices[:, 2].min()
    if low[2] > bottom + _GAP * height:  # long edges: walls have no vertices near the floor
        low[2] = bottom
    x, y, z = (low + high) / 2.0
    target = (float(x), float(y), float(z))
    box = np.stack(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij"), -1).reshape(-1, 3)
    distance = fitting_distance(
        box, target, azimuth, elevation, view_angle=VIEW_ANGLE, aspect=aspect
    )
    return orbit(target, 1.25 * distance, azimuth, elevation, view_angle=VIEW_ANGLE)


def viewpoint(
    scene: Scene, azimuth: float | None, elevation: float | None, aspect: float
) -> Viewpoint:
    """What is given; else, if the usual view shows more than a few back sides, as of a room or a
    box from outside, the nearest view that shows the fewest."""
    traced = build_scene(scene.vertices, scene.triangles)
    corners = scene.vertices[scene.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    def seen(around: float, above: float) -> Viewpoint:
        camera = scene_camera(scene, around, above, aspect)
        origins, ways = camera_rays(camera, _LOOKED_AT, pixel_centres(_LOOKED_AT))
        hits = first_hits(traced, origins, ways)
        hit = hits.triangle >= 0
        behind = np.sum(ways[hit] * facing[hits.triangle[hit]], axis=1) > 0
        return Viewpoint(around, above, float(behind.mean()) if hit.any() else 1.0, camera)

    usual = (AZIMUTH if azimuth is None else azimuth, ELEVATION if elevation is None else elevation)
    found = seen(*usual)
    if found.behind <= _FEW or azimuth is not None or elevation is not None:
        return found
    tried = (seen(AZIMUTH + turn, above) for above in _ELEVATIONS for turn in _TURNS)
    # A little is no reason to go farther.
    return min((found, *tried), key=lambda view: round(view.behind / _FEW))
