"""Polygons as files hold them, made fit to be cut into triangles: mended, left out or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.polygons import MOST_CORNERS, PolygonMesh

_LARGEST = 1e100  # coordinates above it are noise, and their squares are no numbers
_LARGE_FACE = 500  # corners; what cuts them takes more than in proportion


def usable_polygons(file: Path, mesh: PolygonMesh) -> PolygonMesh:
    """Those polygons of a mesh that have three corners or more, at positions that are finite.

    Corners equal to the one before them are left out (a quad of which two corners are one is a
    triangle), polygons that go around several times go around once, and polygons of less than
    three corners and at positions that are no finite numbers are left out. Texture coordinates
    that are no finite numbers become (nan, nan), as corners have that lack them; None, if all
    lack them. What was done is added to the notes.

    Raises BadInput for a mesh of which nothing is left, for references to vertices that do not
    exist, and for more than ``MOST_CORNERS`` corners in large polygons.
    """
    notes = list(mesh.notes)
    if len(mesh.sizes) == 0:
        raise _without_faces(file, mesh)
    _check_references(file, mesh)
    mesh = _with_distinct_corners(mesh, notes)
    mesh = _of_three_corners(file, mesh, notes)
    mesh = _finite(file, mesh, notes)
    large = mesh.sizes > _LARGE_FACE
    if mesh.sizes[large].sum() > MOST_CORNERS:
        face = int(mesh.sizes.argmax())
        corners = f"of {mesh.sizes[face]} corners"
        if mesh.sizes[face] <= MOST_CORNERS:
            corners = f"one of {large.sum()} faces of more than {_LARGE_FACE} corners"
        expected = f"at most {MOST_CORNERS} corners in such: triangulate them where it was made"
        raise BadInput(file, f"face {face}", corners, expected)
    return mesh._replace(notes=tuple(notes))


def counted(number: int, one: str, more: str | None = None) -> str:
    """A number and its noun: "1 face", "2 faces"."""
    return f"{number} {one if number == 1 else more or one + 's'}"


def _without_faces(file: Path, mesh: PolygonMesh) -> BadInput:
    points = f"{len(mesh.positions)} points without faces"
    if not len(mesh.positions):
        return BadInput(file, "content", points, "at least one face: export it again")
    expected = (
        "at least one face; make a mesh of a point cloud first, as by screened Poisson "
        "reconstruction in MeshLab"
    )
    return BadInput(file, "content", points, expected)


def _check_references(file: Path, mesh: PolygonMesh) -> None:
    count = len(mesh.positions)
    wrong = (mesh.corners < 0) | (mesh.corners >= count)
    if wrong.any():
        corner = int(np.argmax(wrong))
        face = int(np.searchsorted(np.cumsum(mesh.sizes), corner, side="right"))
        found = f"a reference to vertex {mesh.corners[corner]}"
        expected = f"vertices 0 to {count - 1}: part of the file is missing, export it again"
        raise BadInput(file, f"face {face}", found, expected)


def _owners(mesh: PolygonMesh) -> NDArray[np.int64]:
    """The polygon of each corner."""
    return np.repeat(np.arange(len(mesh.sizes)), mesh.sizes)


def _with_corners(mesh: PolygonMesh, kept: NDArray[np.bool_]) -> PolygonMesh:
    """The polygons with some of their corners only."""
    return mesh._replace(
        sizes=np.bincount(_owners(mesh)[kept], minlength=len(mesh.sizes)).astype(np.int64),
        corners=mesh.corners[kept],
        corner_uvs=None if mesh.corner_uvs is None else mesh.corner_uvs[kept],
        corner_colours=None if mesh.corner_colours is None else mesh.corner_colours[kept],
    )


def _with_polygons(mesh: PolygonMesh, kept: NDArray[np.bool_]) -> PolygonMesh:
    """Some of the polygons."""
    left = _with_corners(mesh, kept[_owners(mesh)])
    return left._replace(
        sizes=left.sizes[kept], parts=None if mesh.parts is None else mesh.parts[kept]
    )


def _with_distinct_corners(mesh: PolygonMesh, notes: list[str]) -> PolygonMesh:
    """No corner twice in a row, and no polygon around more than once."""
    firsts = np.cumsum(mesh.sizes) - mesh.sizes
    before = np.arange(len(mesh.corners)) - 1
    begins = mesh.sizes > 0
    before[firsts[begins]] = (firsts + mesh.sizes - 1)[begins]
    kept = mesh.corners != mesh.corners[before]
    owners = _owners(mesh)
    # A polygon that comes back to its first corner is looked at on its own.
    at_first = (mesh.corners == mesh.corners[firsts[owners]]) & kept
    for face in np.flatnonzero(np.bincount(owners[at_first], minlength=len(mesh.sizes)) > 1):
        its = slice(firsts[face], firsts[face] + mesh.sizes[face])
        outline = mesh.corners[its]
        for again in np.flatnonzero(outline[1:] == outline[0]) + 1:
            if len(outline) % again == 0 and (outline[again:] == outline[:-again]).all():
                kept[its][again:] = False
                break
    if kept.all():
        return mesh
    mended = _with_corners(mesh, kept)
    left_out = (mesh.sizes - mended.sizes)[mended.sizes >= 3].sum()
    if left_out:
        notes.append(f"{counted(int(left_out), 'repeated corner')} of faces left out.")
    return mended


def _of_three_corners(file: Path, mesh: PolygonMesh, notes: list[str]) -> PolygonMesh:
    small = np.less(mesh.sizes, 3)
    if not small.any():
        return mesh
    if small.all():
        raise BadInput(
            file, "face 0", f"of {counted(int(mesh.sizes[0]), 'corner')}", "at least three corners"
        )
    faces = counted(int(small.sum()), "face")
    notes.append(f"{faces} of less than three corners left out.")
    return _with_polygons(mesh, ~small)


def _finite(file: Path, mesh: PolygonMesh, notes: list[str]) -> PolygonMesh:
    wrong = ~np.asarray((np.abs(mesh.positions) < _LARGEST).all(axis=1))[mesh.corners]
    if wrong.any():
        bad = np.zeros(len(mesh.sizes), bool)
        bad[_owners(mesh)[wrong]] = True
        if bad.all():
            vertex = int(mesh.corners[np.argmax(wrong)])
            found = "(" + ", ".join(f"{value:g}" for value in mesh.positions[vertex]) + ")"
            raise BadInput(file, f"vertex {vertex}", found, "finite numbers: export it again")
        faces = counted(int(bad.sum()), "face")
        notes.append(f"{faces} left out: positions that are no finite numbers.")
        mesh = _with_polygons(mesh, ~bad)
    if mesh.corner_uvs is not None:
        missing = np.isnan(mesh.corner_uvs).all(axis=1)
        wrong = ~np.asarray((np.abs(mesh.corner_uvs) < _LARGEST).all(axis=1))
        if unusable := int((wrong & ~missing).sum()):
            corners = counted(unusable, "corner")
            notes.append(f"Texture coordinates of {corners} left out: no finite numbers.")
        uvs = np.where(wrong[:, None], np.nan, mesh.corner_uvs)
        mesh = mesh._replace(corner_uvs=None if wrong.all() else uvs)
    return mesh
