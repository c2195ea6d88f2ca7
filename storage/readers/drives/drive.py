"""A drive: found, read by its format's module, checked."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.drives.driven import Drive
from storage.readers.drives.formats import read_recording
from storage.readers.drives.headers import check_size, photograph_size
from storage.readers.drives.instants import Instant, instants, with_absent
from storage.readers.drives.lenses import fitted_lens, panorama_views, pinhole_of
from storage.readers.drives.naming import by_number
from storage.readers.drives.recordings import (
    PANORAMA,
    PINHOLE,
    Frame,
    Lens,
    Recording,
    counted,
    listed,
    shown_number,
)
from storage.readers.drives.rigs import LooseRig, check_rig, check_way

FEWEST_CAMERAS = 1
MOST_CAMERAS = 500
"""Each is compared with each."""
FEWEST_INSTANTS = 3


def read_drive(path: str | PathLike[str]) -> Drive:
    """Read and check a drive of any format of :data:`FORMATS`; of the photographs only the headers
    are read.

    Photographs that are listed and not there are left out, and instants that lack a camera serve
    the others; both are said in the notes. Where a camera's lens changes, all its photographs are
    those of the first one.

    Parameters: ``path``, a folder.

    Raises BadInput as the format's reader does and where there is none; for no camera or fewer than
    3 instants; for two photographs of one camera and time; as :func:`check_way` and
    :func:`check_rig` do; for a photograph of another format, to be turned, or of another size than
    its camera; and where none is there.

    >>> read_drive("kitti/sequences/07").cameras  # doctest: +SKIP
    ('image_2', 'image_0', 'image_3', 'image_1')
    """
    return drive_of(read_recording(Path(path)))


def drive_of(recording: Recording) -> Drive:
    """The drive of a recording; raises BadInput as :func:`read_drive`.

    Cameras that were guessed from names and are no rig are one camera, its photographs in the order
    of their names.
    """
    try:
        return _drive(recording)
    except LooseRig:
        if not recording.guessed:
            raise
    frames = sorted(recording.frames, key=lambda frame: by_number(str(frame.photograph)))
    one = [frame._replace(camera="camera", time=float(row)) for row, frame in enumerate(frames)]
    note = "By their poses the cameras of the files' names are no rig: they are read as one camera."
    return _drive(recording._replace(frames=one, notes=(*recording.notes, note)))


def _drive(recording: Recording) -> Drive:
    file = recording.file
    frames = [view for frame in recording.frames for view in panorama_views(frame)]
    moments = instants(file, frames, recording.spread)
    _check_numbers(file, frames, moments)
    listed_files = dict.fromkeys(frame.photograph for frame in frames)
    frames = [frame for frame in frames if os.path.exists(frame.photograph)]
    moments = instants(file, frames, recording.spread)
    missing = _missing(listed_files, frames, moments)
    names = sorted({frame.camera for frame in frames})
    poses = _poses(moments, names)
    if not np.isnan(poses).any():
        names = _left_to_right(names, poses[0])
        poses = _checked(recording, moments, names)
    photographs = [[moment.get(name) for name in names] for moment in moments]
    lenses = _checked_lenses(photographs, are_known=recording.checked)
    firsts = [next(lens for lens in column if lens) for column in zip(*lenses, strict=True)]
    pinholes = [pinhole_of(lens) for lens in firsts]
    sizes = np.array([(width, height) for _, width, height in pinholes])
    present = np.array([[frame is not None for frame in row] for row in photographs])
    told = _notes(names, frames, moments, lenses, sizes) + _shrunk(names, photographs, lenses)
    return Drive(
        file=file,
        cameras=tuple(names),
        width=int(sizes[:, 0].max()),
        height=int(sizes[:, 1].max()),
        intrinsics=np.stack([k for k, _, _ in pinholes]),
        poses=poses,
        times=np.array([min(frame.time for frame in moment.values()) for moment in moments]),
        files=tuple(tuple(frame and frame.photograph for frame in row) for row in photographs),
        present=present,
        sizes=sizes,
        lenses=lenses,
        masks=tuple(tuple(frame and frame.mask for frame in row) for row in photographs),
        points=recording.points,
        film=recording.film,
        places=_places(recording, len(moments)),
        metric=recording.metric,
        up_known=recording.up_known,
        notes=(*recording.notes, *missing, *told),
    )


def _check_numbers(file: Path, frames: Sequence[Frame], moments: Sequence[Instant]) -> None:
    cameras = len({frame.camera for frame in frames})
    for what, number, fewest in (
        ("cameras", cameras, FEWEST_CAMERAS),
        ("instants", len(moments), FEWEST_INSTANTS),
    ):
        if number < fewest:
            raise BadInput(file, f"number of {what}", f"{number}", f"at least {fewest}")
    if cameras > MOST_CAMERAS:
        raise BadInput(file, "number of cameras", f"{cameras}", f"at most {MOST_CAMERAS}")
    posed = sum(frame.pose is not None for frame in frames)
    if 0 < posed < len(frames):
        found = f"{posed} for {len(frames)} photographs"
        raise BadInput(file, "number of poses", found, "a pose of each photograph, or of none")


def _missing(
    files: Collection[Path], there: Sequence[Frame], moments: Sequence[Instant]
) -> list[str]:
    """What is to be said of photographs that are listed and not there."""
    lost = set(files) - {frame.photograph for frame in there}
    if not lost:
        return []
    first = min(lost)
    if len(moments) < FEWEST_INSTANTS:
        photograph_size(first)  # says that it is missing
    are = "is" if len(lost) == 1 else "are"
    return [
        f"{len(lost)} of {len(files)} photographs {are} not there and left out (the first is "
        f"{shortened(first.name, 40)})."
    ]


def _poses(moments: Sequence[Instant], names: Sequence[str]) -> NDArray[np.float64]:
    """(f, c, 4, 4), of absent cameras by the rig; all NaN where there are none."""
    poses = np.full((len(moments), len(names), 4, 4), np.nan)
    present = np.zeros(poses.shape[:2], bool)
    for row, moment in enumerate(moments):
        for column, name in enumerate(names):
            frame = moment.get(name)
            if frame is not None and frame.pose is not None:
                poses[row, column], present[row, column] = frame.pose, True
    return with_absent(poses, present) if present.any() else poses


def _left_to_right(names: Sequence[str], poses: NDArray[np.float64]) -> list[str]:
    """Names by the cameras' places along the mean of their x axes; of equal ones by name.

    ``poses`` (c, 4, 4).
    """
    apart = poses[:, :3, 3] - poses[0, :3, 3]
    along = apart @ poses[:, :3, 0].mean(axis=0)
    reach = np.abs(apart).max() or 1.0
    return [names[row] for row in np.argsort(np.round(along / reach, 6), kind="stable")]


def _checked(
    recording: Recording, moments: Sequence[Instant], names: Sequence[str]
) -> NDArray[np.float64]:
    """Poses (f, c, 4, 4) that are those of a rig that drives."""
    poses = _poses(moments, names)
    places = poses[..., :3, 3].copy()
    times = np.array(
        [[moment[name].time if name in moment else np.nan for name in names] for moment in moments]
    )
    step = check_way(recording.file, np.nanmin(times, axis=1), places, recording.metric)
    places[np.isnan(times)] = np.nan
    check_rig(recording.file, names, times, places, step)
    return poses


def _places(recording: Recording, count: int) -> NDArray[np.float64]:
    if recording.places is None or len(recording.places) != count:
        return np.full((count, 3), np.nan)
    return recording.places


def _checked_lenses(
    photographs: Sequence[Sequence[Frame | None]], *, are_known: bool
) -> tuple[tuple[Lens | None, ...], ...]:
    """Each photograph's lens, its size compared with the header's unless they are known; of an
    unknown one the size."""
    rows = []
    for row in photographs:
        lenses: list[Lens | None] = []
        for frame in row:
            if frame is None:
                lenses.append(None)
                continue
            if are_known:
                lenses.append(frame.lens)
                continue
            size = photograph_size(frame.photograph)
            nothing = (np.nan,) * 4
            lens = frame.lens or Lens(PINHOLE, *size, *nothing)
            lenses.append(fitted_lens(frame.photograph, lens, size))
        rows.append(tuple(lenses))
    return tuple(rows)


def _shrunk(
    names: Sequence[str],
    photographs: Sequence[Sequence[Frame | None]],
    lenses: Sequence[Sequence[Lens | None]],
) -> list[str]:
    """What is to be said of cameras whose lenses were scaled; that is all photographs or none."""
    notes = []
    columns = zip(names, zip(*photographs, strict=True), zip(*lenses, strict=True), strict=True)
    for name, frames, own in columns:
        pairs = [(frame, lens) for frame, lens in zip(frames, own, strict=True) if frame and lens]
        other = [(frame, lens) for frame, lens in pairs if frame.lens and frame.lens.w != lens.w]
        if not other:
            continue
        frame, lens = other[0]
        if len(other) < len(pairs) or len({(own.w, own.h) for _, own in pairs}) > 1:
            said = frame.lens or lens
            check_size(frame.photograph, (lens.w, lens.h), (said.w, said.h))
        notes.append(
            f"The photographs of camera {shortened(name, 40)} have {lens.w} x {lens.h} pixels, "
            "not those of its lens: that is scaled."
        )
    return notes


def _notes(
    names: Sequence[str],
    frames: Sequence[Frame],
    moments: Sequence[Instant],
    lenses: Sequence[Sequence[Lens | None]],
    sizes: NDArray[np.int64],
) -> list[str]:
    notes = []
    lacking = [moment for moment in moments if len(moment) < len(names)]
    if lacking:
        at = shown_number(min(frame.time for frame in lacking[0].values()))
        notes.append(
            f"{counted(len(lacking), 'instant')} of {len(moments)} without a photograph of each "
            f"camera: it is black there (the first at time {at})."
        )
    changed = [
        name
        for name, own in zip(names, zip(*lenses, strict=True), strict=True)
        if len({lens for lens in own if lens}) > 1
    ]
    if changed:
        notes.append(
            f"The lens of {listed(changed)} changes: all photographs are taken anew with the first."
        )
    if len(np.unique(sizes, axis=0)) > 1:
        notes.append(
            "Cameras differ in the size of their pictures: smaller ones have black to their right "
            "and below."
        )
    if any(frame.lens and frame.lens.model == PANORAMA for frame in frames):
        notes.append(
            "Pictures of everything around (equirectangular) are cut into four views, 90 degrees "
            "wide: ahead, to the right, back, to the left."
        )
    return notes
