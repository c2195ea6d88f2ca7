"""Triangle meshes: PLY, OBJ, STL and glTF."""

from __future__ import annotations

import re
from os import PathLike
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.companions import companions
from storage.readers.gltf import read_gltf
from storage.readers.obj_files import read_obj
from storage.readers.opening import first_bytes
from storage.readers.ply_files import read_ply
from storage.readers.polygons import PolygonMesh, triangulate
from storage.readers.stl_files import is_stl, read_stl
from storage.readers.usable_polygons import counted, usable_polygons

FORMATS = "a PLY, OBJ, STL or glTF mesh"

# What other formats of meshes begin with; none of them is read.
_OTHER_FORMATS = (
    (rb"Kaydara FBX Binary|; FBX", "FBX"),
    (rb"BLENDER", "a Blender file"),
    (rb"\x28\xb5\x2f\xfd", "packed by Zstandard (as Blender files are)"),
    (rb"(ST|C|N|4)*OFF\b", "OFF"),
    (rb"MM.{4}(\x02\0|==)", "3DS"),
    (rb"ISO-10303-21", "STEP (surfaces of CAD, without triangles)"),
    (rb"\s*(<\?xml[^>]*>\s*)?(<!--.*?-->\s*)?<COLLADA", "COLLADA"),
    (rb"\s*(<\?xml[^>]*>\s*)?<x3d|#X3D|#VRML", "VRML or X3D"),
    (rb"#usda|PXR-USDC", "USD"),
    (rb"\x1f\x8b", "packed by gzip"),
    (rb"PK\x03\x04", "a ZIP archive (as 3MF and USDZ are, too)"),
)


class MeshFile(NamedTuple):
    """``vertices`` (V, 3) float64; ``triangles`` (F, 3) int64; ``uvs`` (V, 2) float64 with (0, 0)
    at the bottom left of the photograph, (nan, nan) where a corner has none, or None. Every vertex
    belongs to a triangle; vertices are split where one position has several texture coordinates.
    ``notes``: what was mended or left out, and what of the file is not used, a sentence each."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uvs: NDArray[np.float64] | None
    notes: tuple[str, ...] = ()


def read_mesh(path: str | PathLike[str]) -> MeshFile:
    """Read a PLY (ASCII or binary), OBJ, STL or glTF file as one triangle mesh.

    Polygons are cut into triangles, several objects become one, transforms of a glTF's nodes are
    applied, vertices without a face are left out. Axes and units stay those of the file. Faces
    that cannot be used are left out (see `usable_polygons`); those without area are for
    `pipelines.geometry.repair`.

    Raises BadInput for a file that is missing, truncated or of another format, and for meshes
    without faces, with more than ``MOST_CORNERS`` corners in large ones, or with references to
    vertices that do not exist.
    """
    file = Path(path)
    polygons, pictures = _read(file)
    mesh = usable_polygons(file, polygons)
    notes = list(mesh.notes)
    if pictures:
        notes.append(f"{counted(pictures, 'texture')} not used: only the shape is.")
    if mesh.corner_colours is not None:
        notes.append("Colours of its vertices are not used.")
    triangles, _ = triangulate(mesh.positions, mesh.sizes, mesh.corners)
    printable = ("".join(c if c.isprintable() else "?" for c in note) for note in notes)
    return MeshFile(*split_by_uv(mesh, triangles), tuple(printable))


def read_polygons(file: Path) -> PolygonMesh:
    """The polygons of a file, as they are; raises BadInput as `read_mesh`, but for the mesh."""
    return _read(file)[0]


def _read(file: Path) -> tuple[PolygonMesh, int]:
    """The polygons, and how many pictures the file has for its materials."""
    found = mesh_format(file)
    if found == "gltf":
        gltf = read_gltf(file)
        return gltf.mesh, len(gltf.document.get("images") or ())
    if found == "obj":
        obj = read_obj(file)
        beside = companions(file) if obj.libraries else []
        return obj.mesh, sum(path.suffix.lower() != ".mtl" for path in beside)
    return read_ply(file) if found == "ply" else read_stl(file), 0  # PLY says its textures itself


def mesh_format(file: Path) -> Literal["ply", "obj", "stl", "gltf"]:
    """The format of a file, by its first bytes; OBJ and the text form of glTF by its name.

    Raises BadInput for a file that is missing, unreadable, a directory, or of another format.
    """
    start = first_bytes(file, 512, FORMATS)
    if start[:4] == b"glTF" or file.suffix.lower() == ".gltf":
        return "gltf"
    if start[:3] == b"ply" and start[3:4].isspace():
        return "ply"
    for pattern, name in _OTHER_FORMATS:
        if re.match(pattern, start, re.DOTALL):
            raise BadInput(file, "format", name, f"{FORMATS}: export it as one, as Blender does")
    if file.suffix.lower() == ".obj":  # plain text, without a mark of its own
        return "obj"
    if is_stl(file, start):
        return "stl"
    raise BadInput(file, "format", "unknown" if start else "unknown (the file is empty)", FORMATS)


def split_by_uv(
    mesh: PolygonMesh, triangles: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64] | None]:
    """The vertices that polygons have, once for each of their texture coordinates, and triangles
    (F, 3) of them, given as numbers of corners: vertices, triangles and uvs of a `MeshFile`."""
    if mesh.corner_uvs is None:
        used, corners = np.unique(mesh.corners, return_inverse=True)
        return mesh.positions[used], corners.reshape(-1)[triangles], None
    # Sorted by hand: np.unique along an axis takes ten times as long.
    uvs = mesh.corner_uvs + 0.0  # no -0.0
    there = np.nan_to_num(uvs, nan=np.inf)  # which are equal, as no others can be
    keys = (mesh.corners, there[:, 0], there[:, 1])
    order = np.lexsort(keys[::-1])
    new = np.ones(len(order), bool)
    new[1:] = np.logical_or.reduce([key[order[1:]] != key[order[:-1]] for key in keys])
    corners = np.empty(len(order), np.int64)
    corners[order] = np.cumsum(new) - 1
    first = order[new]
    return mesh.positions[mesh.corners[first]], corners[triangles], uvs[first]
