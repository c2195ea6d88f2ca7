"""GLB (glTF 2.0 in one file): triangles as the scene's nodes place them, with their primitives."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.glb_sizes import check_sizes
from storage.readers.opening import parsed_json, whole_file
from storage.readers.polygons import PolygonMesh

if TYPE_CHECKING:
    import trimesh

_GL_FLOAT = 5126
_PACKED_GEOMETRY = {
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_mesh_quantization",
}
_USED = ("POSITION", "TEXCOORD_0")


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

    description, binary = _chunks(file, whole_file(file, "a GLB mesh"))
    primitives = [dict(primitive) for primitive in _primitives(description)]
    materials = description.get("materials", [])
    data = _geometry_only(description, binary)
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False)
        nodes = [scene.graph[node] for node in scene.graph.nodes_geometry]
        placed = [(scene.geometry[name], np.asarray(matrix, float)) for matrix, name in nodes]
        mesh = _joined(file, placed)
    except BadInput:
        raise
    except Exception as error:  # by what is broken: KeyError, ValueError, AssertionError, ...
        raise BadInput(file, "content", "damaged", "a complete GLB file") from error
    return GlbFile(mesh, primitives, materials)


def _joined(file: Path, placed: list[tuple[Any, NDArray[np.float64]]]) -> PolygonMesh:
    """Trimesh's geometries with their matrices (4, 4) as one mesh."""
    import trimesh

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
    return PolygonMesh(
        np.concatenate(positions),
        np.full(len(joined) // 3, 3, np.int64),
        joined,
        np.concatenate(complete) if complete and len(complete) == len(uvs) else None,
        np.concatenate(parts),
    )


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
        description: dict[str, Any] = parsed_json(data[20 : 20 + json_length])
        required = set(description.get("extensionsRequired", ()))
        _check_plain(file, version, required, description)
        check_sizes(file, len(data), description)
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
        attributes = primitive["attributes"]
        primitive["attributes"] = {name: attributes[name] for name in _USED if name in attributes}
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
        raise BadInput(
            file, "geometry", f"packed by {shortened(packed[0])}", "plain glTF 2.0 geometry"
        )
    for primitive in _primitives(description):
        if primitive.get("mode", 4) == 6:
            raise BadInput(file, "geometry", "a triangle fan", "triangles or strips")
        attributes = primitive["attributes"]
        for name in _USED:
            if name not in attributes:
                continue
            accessor = description["accessors"][attributes[name]]
            if "sparse" in accessor or accessor["componentType"] != _GL_FLOAT:
                raise BadInput(file, name, "sparse or of integers", "an accessor of floats")
