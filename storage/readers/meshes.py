"""Triangle meshes: PLY, OBJ and GLB."""

from __future__ import annotations

import io
import json
import struct
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.obj_files import read_obj
from storage.readers.ply_files import read_ply
from storage.readers.polygons import MOST_CORNERS, PolygonMesh, triangulate

if TYPE_CHECKING:
    import trimesh

FORMATS = "a PLY, OBJ or GLB mesh"

_LARGE_FACE = 500  # corners; what cuts them takes more than in proportion
_GL_FLOAT = 5126
_PACKED_GEOMETRY = {
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_mesh_quantization",
}


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
    coordinates that are not finite, with references to vertices that do not exist, or with degenerate faces (repeated corners, no area).
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
    if file.is_dir():
        raise BadInput(file, "file", "a directory", FORMATS)
    try:
        with file.open("rb") as stream:
            start = stream.read(4)
    except FileNotFoundError:
        raise BadInput(file, "file", "missing", FORMATS) from None
    except OSError as error:
        raise BadInput(file, "file", f"unreadable ({error.strerror})", FORMATS) from error
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
    corners, with references to vertices that do not exist, and for positions or texture coordinates of their
    corners that are not finite."""
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
    keys = np.column_stack([mesh.corners.astype(np.float64), mesh.corner_uvs])
    unique, corners = np.unique(keys, axis=0, return_inverse=True)
    vertices = mesh.positions[unique[:, 0].astype(np.int64)]
    return MeshFile(vertices, corners.reshape(-1)[triangles], unique[:, 1:].copy())


# --- GLB ----------------------------------------------------------------------------------------


class GlbFile(NamedTuple):
    """``mesh``, all meshes as the scene's nodes place them, its parts rows of ``primitives``;
    ``primitives`` and ``materials``, as in the file's JSON, not checked."""

    mesh: PolygonMesh
    primitives: list[dict[str, Any]]
    materials: Any


def read_glb(file: Path) -> GlbFile:
    """Read a GLB file through trimesh, which turns the texture coordinates' origin from the top
    left (glTF 2.0) to the bottom left.

    Raises BadInput for a file that is truncated, damaged or of another version, and for
    geometry that trimesh would get wrong.
    """
    import trimesh

    description, binary = _chunks(file, file.read_bytes())
    primitives = [dict(primitive) for primitive in _primitives(description)]
    materials = description.get("materials", [])
    data = _geometry_only(description, binary)
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False)
        nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
        placed = [(scene.geometry[name], np.asarray(matrix, float)) for matrix, name in nodes]
    except Exception as error:  # by what is broken: KeyError, ValueError, AssertionError, ...
        raise BadInput(file, "content", "damaged", "a complete GLB file") from error
    positions, corners, uvs, count = [np.zeros((0, 3))], [np.zeros(0, np.int64)], [], 0
    parts = [np.zeros(0, np.int64)]
    for geometry, matrix in placed:
        if not isinstance(geometry, trimesh.Trimesh):
            continue  # points and lines
        triangles = np.asarray(geometry.faces, np.int64)
        if np.linalg.det(matrix[:3, :3]) < 0:  # a mirror turns the triangles inside out
            triangles = triangles[:, ::-1]
        vertices = np.asarray(geometry.vertices, np.float64)
        if triangles.max(initial=-1) >= len(vertices):  # would reach into the next one's vertices
            found = f"a reference to vertex {triangles.max()}"
            raise BadInput(file, "a triangle", found, f"vertices 0 to {len(vertices) - 1}")
        positions.append(vertices @ matrix[:3, :3].T + matrix[:3, 3])
        corners.append(triangles.ravel() + count)
        count += len(vertices)
        uvs.append(_glb_uvs(geometry, triangles))
        looks: Any = geometry.visual
        parts.append(np.full(len(triangles), int(looks.material.name)))
    complete = [uv for uv in uvs if uv is not None]
    joined = np.concatenate(corners)
    mesh = PolygonMesh(
        np.concatenate(positions),
        np.full(len(joined) // 3, 3, np.int64),
        joined,
        np.concatenate(complete) if complete and len(complete) == len(uvs) else None,
        np.concatenate(parts),
    )
    return GlbFile(mesh, primitives, materials)


def _glb_uvs(geometry: trimesh.Trimesh, triangles: NDArray[np.int64]) -> NDArray[np.float64] | None:
    uv = getattr(geometry.visual, "uv", None)
    if uv is None or len(uv) != len(geometry.vertices):
        return None
    return np.asarray(uv, np.float64)[triangles.ravel()]


def _chunks(file: Path, data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON of a GLB (glTF 2.0, 4.4: header, a chunk of JSON, a binary chunk), and what comes
    after it."""
    try:
        version, length, json_length = struct.unpack_from("<4xIII", data)
        if len(data) < length:
            raise ValueError
        description: dict[str, Any] = json.loads(data[20 : 20 + json_length])
        required = set(description.get("extensionsRequired", ()))
        _check_plain(file, version, required, description)
    except BadInput:
        raise
    except (struct.error, ValueError, AttributeError, TypeError, LookupError):
        raise BadInput(file, "content", "truncated or damaged", "a complete GLB file") from None
    return description, data[20 + json_length : length]


def _geometry_only(description: dict[str, Any], binary: bytes) -> bytes:
    """A GLB as trimesh can read it, ``description`` changed to its JSON: every primitive has a
    blank material, named by the primitive's number. Trimesh drops the texture coordinates of a
    primitive without a material, and decodes pictures that are not needed here."""
    primitives = _primitives(description)
    for number, primitive in enumerate(primitives):
        primitive["material"] = number
    description["materials"] = [{"name": f"{number}"} for number in range(len(primitives))]
    for unused in ("images", "textures", "samplers"):
        description.pop(unused, None)
    text = json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _primitives(description: dict[str, Any]) -> list[dict[str, Any]]:
    return [part for mesh in description.get("meshes", ()) for part in mesh["primitives"]]


def _check_plain(file: Path, version: int, required: set[str], description: dict[str, Any]) -> None:
    """Refuse what trimesh passes over in silence."""
    if version != 2:
        raise BadInput(file, "glTF version", str(version), "2")
    if packed := sorted(required & _PACKED_GEOMETRY):
        raise BadInput(file, "geometry", f"packed by {packed[0]}", "plain glTF 2.0 geometry")
    for primitive in _primitives(description):
        if primitive.get("mode", 4) == 6:
            raise BadInput(file, "geometry", "a triangle fan", "triangles or strips")
        attributes = primitive["attributes"]
        for name in ("POSITION", "TEXCOORD_0"):
            if name not in attributes:
                continue
            accessor = description["accessors"][attributes[name]]
            if "sparse" in accessor or accessor["componentType"] != _GL_FLOAT:
                raise BadInput(file, name, "sparse or of integers", "an accessor of floats")
