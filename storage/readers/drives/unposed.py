"""Films and folders of photographs that know nothing of where they were taken: one camera each."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from storage.readers.drives.recordings import PINHOLE, Frame, Lens, Recording
from storage.readers.films import SUFFIXES as FILM_SUFFIXES
from storage.readers.films import Film, read_film
from storage.readers.gpx_files import places_at, read_gpx
from storage.readers.photograph_folders import FEWEST, read_photograph_folder
from storage.readers.photographs import SUFFIXES as PHOTOGRAPH_SUFFIXES

FILM, CAMERA = "film", "camera"
"""Names of the one camera."""


def find_film(path: Path) -> Path | None:
    """A film's file, or the one film that lies in a folder."""
    if path.is_dir():
        films = sorted(file for file in path.iterdir() if file.suffix.lower() in FILM_SUFFIXES)
        return films[0] if len(films) == 1 else None
    return path if path.suffix.lower() in FILM_SUFFIXES and path.exists() else None


def read_film_recording(file: Path, given: Path) -> Recording:
    """All frames of a film; places of a GPX file of its name beside it, by the film's clock.

    Raises BadInput as :func:`read_film` and :func:`read_gpx`.
    """
    film = read_film(file)
    lens = Lens(PINHOLE, film.width, film.height, *(np.nan,) * 4)
    frames = [Frame(FILM, float(time), file, None, lens) for time in film.times]
    places, notes = _track(film)
    return Recording(
        file, frames, notes=(*film.notes, *notes), checked=True, film=film, places=places
    )


def _track(film: Film) -> tuple[np.ndarray, tuple[str, ...]]:
    track = film.file.with_suffix(".gpx")
    if not track.exists():
        return np.full((len(film.times), 3), np.nan), ()
    if film.began is None:
        note = f"{track.name} is not used: the film does not say when it was taken."
        return np.full((len(film.times), 3), np.nan), (note,)
    return places_at(read_gpx(track), film.began + film.times), ()


def find_photographs(path: Path) -> Path | None:
    """A folder in which photographs lie, not in folders of their own."""
    if not path.is_dir():
        return None
    some = (file for file in path.iterdir() if file.suffix.lower() in PHOTOGRAPH_SUFFIXES)
    return path if sum(1 for _, _ in zip(some, range(FEWEST), strict=False)) == FEWEST else None


def read_photographs_recording(folder: Path, given: Path) -> Recording:
    """Photographs in the order of their names; focal length and places as EXIF has them.

    A focal length that EXIF does not tell well enough to be used is left to be found. Raises
    BadInput as :func:`read_photograph_folder`.
    """
    found = read_photograph_folder(folder)
    middle = (found.width - 1) / 2, (found.height - 1) / 2
    lens = Lens(PINHOLE, found.width, found.height, found.focal, found.focal, *middle)
    frames = [
        Frame(CAMERA, float(number), file, None, lens) for number, file in enumerate(found.files)
    ]
    return Recording(folder, frames, notes=found.notes, checked=True, places=found.places)
