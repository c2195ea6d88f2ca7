"""Triangle meshes: PLY, OBJ and GLB."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.glb_files import read_glb
from storage.readers.obj_files import read_obj
from storage.readers.opening import first_bytes
from storage.readers.ply_files import read_ply
from storage.readers.polygons import MOST_CORNERS, PolygonMesh, triangulate

FORMATS = "a PLY, OBJ or GLB mesh"

_LARGE_FACE = 500  # corners; what cuts them takes more than in proportion


class MeshFile(NamedTuple):
    """``vertices`` (V, 3) float64; ``triangles`` (F, 3) int64; ``uvs`` (V, 2) float64 with (0, 0)
    at the bottom left of the photograph, or None. Every vertex belongs to a triangle; vertices
    are split where one position has several texture coordinates."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uvs: NDArray[np.float64] | None


def read_mesh(path: str | PathLike[str]) -> MeshFile:
    """Read a PLY (ASCII or binary), OBJ or GLB file as one triangle mesh.

    Polygons are cut into triangles, several objects become one, transforms of a GLB's nodes are
    applied, vertices without a face are left out. Texture coordinates that only some corners
    have count as none. Axes and units stay those of the file.

    Raises BadInput for a file that is missing, truncated or of another format, and for meshes
    without faces, with more than ``MOST_CORNERS`` corners in large ones, with positions or texture
    coordinates that are not finite, with references to vertices that do not exist, or with
    degenerate faces (repeated corners, no area).
    """
    file = Path(path)
    mesh = _read_polygons(file)
    check_polygons(file, mesh)
    triangles, owners = triangulate(mesh.positions, mesh.sizes, mesh.corners)
    _check_areas(file, mesh.positions[mesh.corners[triangles]], owners)
    return split_by_uv(mesh, triangles)


def _read_polygons(file: Path) -> PolygonMesh:
    found = mesh_format(file)
    if found == "glb":
        return read_glb(file).mesh
    return read_ply(file) if found == "ply" else read_obj(file).mesh


def mesh_format(file: Path) -> Literal["ply", "obj", "glb"]:
    """The format of a file, by its first bytes; OBJ by its name.

    Raises BadInput for a file that is missing, unreadable, a directory, or of another format.
    """
    start = first_bytes(file, 4, FORMATS)
    if start == b"glTF":
        return "glb"
    if start[:3] == b"ply" and start[3:].isspace():
        return "ply"
    if file.suffix.lower() == ".obj":  # plain text, without a mark of its own
        return "obj"
    raise BadInput(file, "format", "unknown" if start else "unknown (the file is empty)", FORMATS)


# --- Checks -------------------------------------------------------------------------------------


def check_polygons(file: Path, mesh: PolygonMesh) -> None:
    """Raise BadInput for a mesh without polygons, for polygons of less than three or of too many
    corners, with references to vertices that do not exist, and for positions or texture
    coordinates of their corners that are not finite."""
    if len(mesh.sizes) == 0:
        points = f"{len(mesh.positions)} points without faces"
        raise BadInput(file, "content", points, "at least one face")
    if mesh.sizes.min() < 3:
        face = int(np.argmax(mesh.sizes < 3))
        raise BadInput(
            file, f"face {face}", f"of {mesh.sizes[face]} corners", "at least three corners"
        )
    large = mesh.sizes > _LARGE_FACE
    if mesh.sizes[large].sum() > MOST_CORNERS:
        face = int(mesh.sizes.argmax())
        corners = f"of {mesh.sizes[face]} corners"
        if mesh.sizes[face] <= MOST_CORNERS:
            corners = f"one of {large.sum()} faces of more than {_LARGE_FACE} corners"
        raise BadInput(file, f"face {face}", corners, f"at most {MOST_CORNERS} corners in such")
    count = len(mesh.positions)
    wrong = (mesh.corners < 0) | (mesh.corners >= count)
    if wrong.any():
        corner = int(np.argmax(wrong))
        face = int(np.searchsorted(np.cumsum(mesh.sizes), corner, side="right"))
        found = f"a reference to vertex {mesh.corners[corner]}"
        raise BadInput(file, f"face {face}", found, f"vertices 0 to {count - 1}")
    used = np.zeros(count, bool)
    used[mesh.corners] = True
    _check_finite(file, "vertex", mesh.positions, used)
    if mesh.corner_uvs is not None:
        everywhere = np.ones(len(mesh.corner_uvs), bool)
        _check_finite(file, "texture coordinate of corner", mesh.corner_uvs, everywhere)


def _check_finite(
    file: Path, field: str, values: NDArray[np.float64], used: NDArray[np.bool_]
) -> None:
    wrong = used & ~np.isfinite(values).all(axis=1)
    if wrong.any():
        first = int(np.argmax(wrong))
        found = "(" + ", ".join(f"{value:g}" for value in values[first]) + ")"
        raise BadInput(file, f"{field} {first}", found, "finite numbers")


def _check_areas(file: Path, triangles: NDArray[np.float64], owners: NDArray[np.int64]) -> None:
    """Triangles (F, 3, 3) of the polygons ``owners``. Twice the area is compared with the
    squared longest side: below 1e-12 three corners are on a line as far as doubles can tell."""
    sides = triangles - np.roll(triangles, 1, axis=1)
    longest = (sides**2).sum(axis=2).max(axis=1)
    doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    faces = np.unique(owners[doubled <= 1e-12 * longest])
    if len(faces):
        others = f", and so are {len(faces) - 1} more faces" if len(faces) > 1 else ""
        found = f"degenerate (repeated corners or no area){others}"
        raise BadInput(file, f"face {faces[0]}", found, "three distinct corners not on a line")


def split_by_uv(mesh: PolygonMesh, triangles: NDArray[np.int64]) -> MeshFile:
    """The vertices that polygons have, once for each of their texture coordinates, and triangles
    (F, 3) of them, given as numbers of corners."""
    if mesh.corner_uvs is None:
        used, corners = np.unique(mesh.corners, return_inverse=True)
        return MeshFile(mesh.positions[used], corners.reshape(-1)[triangles], None)
    # Sorted by hand: np.unique along an axis takes ten times as long.
    keys = (mesh.corners, mesh.corner_uvs[:, 0], mesh.corner_uvs[:, 1])
    order = np.lexsort(keys[::-1])
    new = np.ones(len(order), bool)
    new[1:] = np.logical_or.reduce([key[order[1:]] != key[order[:-1]] for key in keys])
    corners = np.empty(len(order), np.int64)
    corners[order] = np.cumsum(new) - 1
    first = order[new]
    return MeshFile(mesh.positions[mesh.corners[first]], corners[triangles], mesh.corner_uvs[first])
