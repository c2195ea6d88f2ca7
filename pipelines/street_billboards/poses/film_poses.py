"""From one camera's pictures to poses in metres: frames chosen, poses found, scale and north.

What comes before the street where nobody knows where the camera was: `frame_choice`, `still_parts`,
`found_poses` and `scale`, one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.found_poses import FoundPoses, find_poses
from pipelines.street_billboards.poses.frame_choice import FrameChoice, choose_frames
from pipelines.street_billboards.poses.joined_pieces import Similarity
from pipelines.street_billboards.poses.mapping import Pinhole
from pipelines.street_billboards.poses.scale import (
    by_road,
    by_track,
    east_north_up,
    road_below,
)
from pipelines.street_billboards.poses.still_parts import FEWEST, still_parts

FloatArray = NDArray[np.float64]
Picture = NDArray[np.uint8]


class Pictures(NamedTuple):
    """A film or photographs, read when they are asked for."""

    greys: Callable[[], Iterable[tuple[int, Picture]]]
    """Numbers, rising, and grey pictures (h, w) of all frames."""
    colours: Callable[[Sequence[int]], Iterable[Picture]]
    """Pictures (h, w, 3), sRGB, of some frames, by rising numbers."""


class PosedFilm(NamedTuple):
    """k frames of one camera, n points; metres, z up."""

    frames: NDArray[np.int64]
    """(k,), numbers of the frames that have a pose."""
    poses: FloatArray
    """(k, 4, 4), from the camera's axes to the world's."""
    intrinsics: FloatArray
    """K (3, 3), pixels."""
    focal_deviation: float
    """Pixels; 0 where the focal length was given."""
    points: FloatArray
    """(n, 3)."""
    colours: Picture
    """(n, 3), sRGB."""
    used: NDArray[np.bool_]
    """(h, w), False where something stands still in the picture."""
    notes: tuple[str, ...]


def pose_film(
    pictures: Pictures,
    camera: Pinhole,
    *,
    camera_height: float,
    places: FloatArray | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> PosedFilm:
    """Find where one camera was when it took its pictures.

    camera: what is known of it (``found_poses.guessed_pinhole`` if nothing); camera_height: metres
    above the road, by which the unit is told where there are no ``places``: (frames, 3), degrees
    north, degrees east and metres above the sea of all frames, NaN where not known; progress is
    told the fraction done. Raises ValueError for pictures without parallax, of which fewer than
    eight get a pose, or below which no road is found.
    """
    choice = choose_frames(pictures.greys())
    progress(0.2)
    chosen = choice.frames.tolist()
    still = _still(pictures, chosen)
    progress(0.25)
    found = find_poses(
        pictures.colours(chosen),
        camera,
        ~still,
        progress=lambda done: progress(0.25 + 0.7 * done / len(chosen)),
    )
    world, said = _world(found, choice, camera_height, places)
    kept = found.registered
    notes = (*choice.notes, *found.notes, *said)
    if still.any():
        notes += (
            f"{still.mean():.0%} of the picture stand still (the bonnet, a stamp): not used.",
        )
    return PosedFilm(
        choice.frames[kept],
        world.poses(found.poses[kept]),
        found.intrinsics,
        found.focal_deviation,
        world.points(found.points),
        found.colours,
        ~still,
        notes,
    )


def _still(pictures: Pictures, chosen: Sequence[int]) -> NDArray[np.bool_]:
    greys = (picture.mean(axis=2).astype(np.uint8) for picture in pictures.colours(chosen))
    if len(chosen) < FEWEST:
        first = next(iter(greys))
        return np.zeros(first.shape, np.bool_)
    return still_parts(greys)


def _world(
    found: FoundPoses,
    choice: FrameChoice,
    camera_height: float,
    places: FloatArray | None,
) -> tuple[Similarity, tuple[str, ...]]:
    """Into metres and z up, and how that was told."""
    road = road_below(found.poses, found.points, found.nearest)
    known = None if places is None else places[choice.frames]
    if known is not None and np.isfinite(known[:, :2]).all(axis=1).sum() >= 3:
        up = np.nanmean(np.einsum("fij,j->fi", found.poses[:, :3, :3], road.normal), axis=0)
        try:
            world, off = by_track(found.poses, up, east_north_up(known))
        except ValueError as error:
            note = f"Its places by satellite are not used: {error}"
            return by_road(found.poses, road, camera_height), (note,)
        return world, (f"Scale and north are those of its places by satellite, {off:.1f} m off.",)
    return by_road(found.poses, road, camera_height), (
        f"The unit follows from camera_height: the camera is taken to be {camera_height:g} m above "
        "the road.",
    )
