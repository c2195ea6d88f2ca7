"""The unit of given poses: by the road below the cameras, else by how a car drives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.road_plane import Road

FloatArray = NDArray[np.float64]

_HEIGHTS = (0.9, 3.2)
"""Metres above the road at which cars carry cameras."""
_UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "feet": 0.3048, "kilometres": 1e3}
_STEPS = (0.1, 50.0)
"""Metres that a car comes from frame to frame."""
_APART = (0.0, 4.0)
"""Metres between neighbouring cameras of one car."""


def in_metres(
    poses: FloatArray, road: Road | None, camera_height: float
) -> tuple[FloatArray, list[str]]:
    """Poses in metres, by how high the cameras are above the road."""
    if road is None:
        return _by_steps(poses)
    low, high = _HEIGHTS
    if low <= road.height <= high:
        return poses, []
    fits = [name for name, unit in _UNITS.items() if low <= road.height * unit <= high]
    if fits:
        factor, said = (
            _UNITS[fits[0]],
            f"The unit is {fits[0]}, by the cameras' height above the road",
        )
    else:
        factor = camera_height / road.height
        said = (
            f"The unit is {factor:.4g} m, if the cameras are {camera_height:g} m above the road "
            "(camera_height)"
        )
    made = poses.copy()
    made[..., :3, 3] *= factor
    return made, [f"{said}: it is scaled."]


def _by_steps(poses: FloatArray) -> tuple[FloatArray, list[str]]:
    """Poses in metres where no road is seen: by what a car drives from frame to frame, and by how
    far apart its cameras are. Raises ValueError where no usual unit fits."""
    step = float(np.median(np.linalg.norm(np.diff(poses[:, 0, :3, 3], axis=0), axis=1)))
    apart = np.linalg.norm(np.diff(poses[0, :, :3, 3], axis=0), axis=1)
    fits = {
        name: unit
        for name, unit in {"metres": 1.0, **_UNITS}.items()
        if _STEPS[0] <= step * unit <= _STEPS[1]
        and all(_APART[0] <= each * unit <= _APART[1] for each in apart)
    }
    if "metres" in fits:
        return poses, ["No road is seen below the cameras: the unit is taken for the metre."]
    if not fits:
        raise ValueError(
            f"The car comes {step:.3g} units from frame to frame, and no road is seen below it "
            "that would tell the unit; expected metres."
        )
    name = next(iter(fits))
    made = poses.copy()
    made[..., :3, 3] *= fits[name]
    return made, [
        f"The unit is {name}, by the car's steps of {step:.3g} from frame to frame: it is scaled."
    ]
