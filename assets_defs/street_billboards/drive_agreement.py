"""Whether a user's drive shows one world: asked of it before any work."""

from __future__ import annotations

from storage.readers.drives import Drive, read_frame

LEAST_AGREEMENT = 0.3
"""Share of points that neighbouring frames confirm; wrong calibrations leave a tenth."""


def check_agreement(drive: Drive, name: str) -> None:
    """Whether three frames in the middle of a drive show one world. Raises ValueError."""
    import numpy as np

    from pipelines.street_billboards.capture.point_fusion import FrameViews, agreement
    from pipelines.street_billboards.capture.stereo import depth_maps

    middle = min(max(len(drive.times) // 2, 1), len(drive.times) - 2)
    views = []
    for frame in (middle - 1, middle, middle + 1):
        pictures = read_frame(drive, frame)
        maps = depth_maps(pictures, drive.intrinsics, drive.poses[frame])
        views.append(
            FrameViews(maps.depth, maps.deviation, pictures, drive.intrinsics, drive.poses[frame])
        )
    before, _, after = (view._asdict() for view in views)
    beside = FrameViews(**{name: np.concatenate([before[name], after[name]]) for name in before})
    found = agreement(views[1], beside)
    if found < LEAST_AGREEMENT:
        raise ValueError(
            f"{name}: of the points of time {drive.times[middle]:g} the frames beside it confirm "
            f"{found:.0%}; expected {LEAST_AGREEMENT:.0%} at least: intrinsics or poses are wrong."
        )
