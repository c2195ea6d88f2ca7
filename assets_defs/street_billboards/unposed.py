"""Users' films and photographs without poses, as what poses are found from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from storage.readers.drives import Drive, read_frame
from storage.readers.films import film_frames, film_luma

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipelines.street_billboards.poses.film_poses import Pictures
    from pipelines.street_billboards.poses.mapping import Pinhole


def check_one_camera(drive: Drive, name: str) -> None:
    """Raise ValueError for a drive of several cameras without poses: those of one are found."""
    if len(drive.cameras) > 1:
        raise ValueError(
            f"{name}: has {len(drive.cameras)} cameras and no poses; expected poses, or one "
            "camera: give the folder of one camera's photographs."
        )


def camera_of(drive: Drive, focal: float | None) -> Pinhole:
    """What is known of a drive's one camera: the focal length asked for, or the files'."""
    from pipelines.street_billboards.poses.found_poses import guessed_pinhole

    guessed = guessed_pinhole(drive.width, drive.height)
    known = float(drive.intrinsics[0, 0, 0]) if focal is None else focal
    return guessed if np.isnan(known) else guessed._replace(focal=known, is_known=True)


def pictures_of(drive: Drive, frames: NDArray[np.integer]) -> Pictures:
    """The pictures of a drive's one camera, of these consecutive frames."""
    from pipelines.street_billboards.poses.film_poses import Pictures

    first, last = int(frames[0]), int(frames[-1])

    def greys() -> Iterator[tuple[int, NDArray[np.uint8]]]:
        if drive.film is not None:
            luma = film_luma(drive.film)
            yield from ((n, picture) for n, picture in luma if first <= n <= last)
            return
        for number in frames.tolist():
            yield number, read_frame(drive, number)[0].mean(axis=2).astype(np.uint8)

    def colours(numbers: Sequence[int]) -> Iterator[NDArray[np.uint8]]:
        if drive.film is not None:
            yield from (picture for _, picture in film_frames(drive.film, list(numbers)))
            return
        yield from (read_frame(drive, number)[0] for number in numbers)

    return Pictures(greys, colours)
