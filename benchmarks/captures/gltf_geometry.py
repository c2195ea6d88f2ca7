"""Cases of glTF: accessors and primitives."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import FILES, Case
from benchmarks.captures.gltf_containers import is_the_pyramid
from benchmarks.captures.gltf_writing import (
    PYRAMID,
    SIDES,
    GltfWriter,
    are_triangles,
)
from storage.readers.gltf import read_gltf
from storage.readers.meshes import MeshFile, read_mesh
from storage.readers.polygons import PolygonMesh

UVS = np.array([[0.25, 0], [0.5, 0.25], [0, 1], [0.75, 0.5], [1, 0.125]], np.float32)
"""Of the pyramid's corners, as glTF has them: from the top."""
_COLOURS = np.array(
    [[0, 0, 0, 1], [1, 0, 0, 1], [0, 0.5, 0, 1], [0, 0, 0.25, 1], [0.75, 0.5, 0.25, 0.5]],
    np.float32,
)


def one_node(made: GltfWriter, *primitives: dict[str, Any], **mesh: Any) -> GltfWriter:
    """One node with a mesh of primitives."""
    made.document |= {"scene": 0, "scenes": [{"nodes": [0]}]}
    made.node(mesh=made.mesh(*primitives, **mesh))
    return made


def built(
    file: str,
    kind: str,
    build: Callable[[GltfWriter], object],
    *says: str,
    right: Callable[[Any], bool] | None = is_the_pyramid,
    read: Callable[[Path], Any] = read_mesh,
) -> Case:
    """``build`` adds to an empty document."""

    def write(path: Path) -> None:
        made = GltfWriter()
        build(made)
        made.write(path)

    return Case(file, kind, read, "told" if says else "read", says, right, write)


def built_refused(file: str, kind: str, build: Callable[[GltfWriter], object], *says: str) -> Case:
    """As `built`, for what is refused."""
    case = built(file, kind, build, *says)
    return Case(file, kind, read_mesh, "refused", says, None, case.write)


def _polygons(path: Path) -> PolygonMesh:
    return read_gltf(path).mesh


def has_uvs(expected: NDArray[Any]) -> Callable[[MeshFile], bool]:
    """Whether each corner has the texture coordinates of its place; ``expected`` from the top."""
    corners = np.column_stack([PYRAMID, expected[:, 0], 1 - expected[:, 1]])[SIDES]

    def is_right(found: MeshFile) -> bool:
        if found.uvs is None:
            return False
        rows = np.column_stack([found.vertices, found.uvs])
        return are_triangles(rows[found.triangles], corners.astype(float))

    return is_right


def _has_colours(expected: NDArray[Any]) -> Callable[[PolygonMesh], bool]:
    corners = np.column_stack([PYRAMID, expected])[SIDES].astype(float)

    def is_right(found: PolygonMesh) -> bool:
        if found.corner_colours is None:
            return False
        rows = np.column_stack([found.positions[found.corners], found.corner_colours])
        return are_triangles(rows.reshape(-1, 3, 7), corners)

    return is_right


# --- Accessors ----------------------------------------------------------------------------------


def _with_uvs(values: NDArray[Any], **entry: Any) -> Callable[[GltfWriter], object]:
    def build(made: GltfWriter) -> None:
        one_node(made, made.primitive(TEXCOORD_0=made.accessor(values, **entry)))

    return build


def _with_colours(values: NDArray[Any], **entry: Any) -> Callable[[GltfWriter], object]:
    def build(made: GltfWriter) -> None:
        one_node(made, made.primitive(COLOR_0=made.accessor(values, **entry)))

    return build


def _interleaved(made: GltfWriter) -> None:
    """Positions, a byte of something else, and texture coordinates, a row for each vertex."""
    kinds = [("position", "<f4", 3), ("other", "u1", 4), ("uv", "<u2", 2)]
    rows = np.zeros(5, np.dtype([(name, kind, (width,)) for name, kind, width in kinds]))
    rows["position"], rows["other"], rows["uv"] = PYRAMID, 255, np.round(UVS * 65535)
    view = made.view(rows.tobytes(), byteStride=20, target=34962)
    uv = made.accessor(UVS.astype(np.uint16), bufferView=view, byteOffset=16, normalized=True)
    primitive = made.primitive(TEXCOORD_0=uv)
    primitive["attributes"]["POSITION"] = made.accessor(PYRAMID, bufferView=view)
    one_node(made, primitive)


def _sparse(base: NDArray[Any] | None) -> Callable[[GltfWriter], object]:
    """The apex and one corner are told apart."""

    def build(made: GltfWriter) -> None:
        rows = np.array([1, 4], np.uint8)
        sparse = {
            "count": 2,
            "indices": {"bufferView": made.view(rows.tobytes()), "componentType": 5121},
            "values": {"bufferView": made.view(PYRAMID[rows].tobytes())},
        }
        primitive = made.primitive()
        view = {} if base is not None else {"bufferView": None}
        held = PYRAMID if base is None else base
        primitive["attributes"]["POSITION"] = made.accessor(held, sparse=sparse, **view)
        one_node(made, primitive)

    return build


def _changed_base() -> NDArray[np.float32]:
    base = PYRAMID.copy()
    base[[1, 4]] = 9
    return base


def _sparse_pyramid_of_zeros() -> NDArray[np.float64]:
    corners = np.zeros((5, 3))
    corners[[1, 4]] = PYRAMID[[1, 4]]
    return corners


def _two_of_zero_area(found: PolygonMesh) -> bool:
    """Only two corners are not at the origin."""
    corners = found.positions[found.corners].reshape(-1, 3, 3)
    return are_triangles(corners, _sparse_pyramid_of_zeros()[SIDES])


# --- Primitives ---------------------------------------------------------------------------------


def _with_mode(mode: int, corners: NDArray[Any] | None) -> Callable[[GltfWriter], object]:
    def build(made: GltfWriter) -> None:
        primitive = made.primitive(triangles=corners) | {"mode": mode}
        one_node(made, primitive)

    return build


def _without_indices(made: GltfWriter) -> None:
    one_node(made, made.primitive(PYRAMID[SIDES.ravel()], None))


def _fans(made: GltfWriter) -> None:
    """One around the apex, and the base as another."""
    around = made.primitive(triangles=np.array([4, 2, 0, 3, 1, 2], np.uint16)) | {"mode": 6}
    base = made.primitive(triangles=np.array([2, 1, 3, 0], np.uint16)) | {"mode": 6}
    one_node(made, around, base)


def _strips(made: GltfWriter) -> None:
    """One strip, whose two pieces triangles without area join."""
    corners = np.array([2, 0, 4, 3, 1, 2, 4, 4, 2, 2, 2, 3, 0], np.uint8)
    one_node(made, made.primitive(triangles=corners) | {"mode": 5})


def _with_lines(made: GltfWriter) -> None:
    edges = made.primitive(triangles=np.array([0, 1], np.uint16)) | {"mode": 1}
    points = made.primitive(triangles=None) | {"mode": 0}
    one_node(made, edges, made.primitive(), points)


def _one_corner_more(made: GltfWriter) -> None:
    one_node(made, made.primitive(triangles=np.append(SIDES.ravel(), 0).astype(np.uint16)))


def _some_with_colours(made: GltfWriter) -> None:
    """Two primitives: that without colours is white."""
    colours = made.accessor(np.full((5, 3), 0.5, np.float32))
    first = made.primitive(triangles=SIDES[:2], COLOR_0=colours)
    one_node(made, first, made.primitive(triangles=SIDES[2:]))


def _half_is_white(found: PolygonMesh) -> bool:
    expected = np.repeat([[0.5, 0.5, 0.5, 1.0], [1.0] * 4], [6, 12], axis=0)
    return found.corner_colours is not None and np.allclose(found.corner_colours, expected)


def _measured(made: GltfWriter) -> None:
    one_node(made, made.primitive(_TEMPERATURE=made.accessor(np.arange(5, dtype=np.float32))))


def _bad_index(made: GltfWriter) -> None:
    one_node(made, made.primitive(triangles=np.append(SIDES.ravel()[:-1], 5).astype(np.uint16)))


# --- Cases --------------------------------------------------------------------------------------


def _stored(file: str, kind: str, vertices: int, width: int) -> NDArray[np.float64]:
    """(T, 3, width): triangles of a shared file's first numbers; indices of 32 bits follow them."""
    data = (FILES / file).read_bytes()
    binary = data[data.index(b"BIN\0") + 4 :]
    values = np.frombuffer(binary, kind, vertices * width).reshape(-1, width)
    indices = np.frombuffer(binary, "<u4", 2880, values.nbytes).reshape(-1, 3)
    return values.astype(np.float64)[indices]


def is_stored(
    file: str, kind: str, vertices: int, width: int, scale: float = 1
) -> Callable[[MeshFile], bool]:
    """Whether the triangles are those that lie in a shared file, which are on an ellipsoid."""
    expected = _stored(file, kind, vertices, width)[:, :, :3] * scale
    lengths = np.linalg.norm(expected / np.abs(expected).max(axis=(0, 1)), axis=2)
    assert np.allclose(lengths, 1, atol=1e-3)
    return lambda found: np.allclose(found.vertices[found.triangles], expected, atol=1e-6)


def _has_stored_uvs(found: MeshFile) -> bool:
    """Whether the corners have the numbers that the shared file stores last, 16 bits each."""
    data = (FILES / "glb_uv_ushort_core.glb").read_bytes()
    uvs = np.frombuffer(data[-2176:], "<u2").reshape(-1, 2) / 65535
    indices = np.frombuffer(data[-2176 - 11520 : -2176], "<u4").reshape(-1, 3)
    expected = np.column_stack([uvs[:, 0], 1 - uvs[:, 1]])[indices]
    return found.uvs is not None and np.allclose(found.uvs[found.triangles], expected, atol=1e-6)


_BYTE_UVS = np.round(UVS * 255).astype(np.uint8)
_BYTES = np.round(_COLOURS * 255).astype(np.uint8)
_UP_TO_ONE = {"normalized": True}

GEOMETRY: tuple[Case, ...] = (
    Case(
        "glb_threejs_sphere_closed.glb", "vertices apart by rounding", read_mesh, "read", (),
        is_stored("glb_threejs_sphere_closed.glb", "<f4", 561, 3),
    ),
    Case("glb_uv_ushort_core.glb", "texture coordinates in integers", read_mesh, "read", (),
         _has_stored_uvs),
    built("gltf_uv.glb", "texture coordinates", _with_uvs(UVS), right=has_uvs(UVS)),
    built(
        "gltf_uv_bytes.glb", "texture coordinates in integers",
        _with_uvs(_BYTE_UVS, **_UP_TO_ONE), right=has_uvs(_BYTE_UVS / 255),
    ),
    built(
        "gltf_uv_without_view.glb", "accessors without a view", _with_uvs(UVS, bufferView=None),
        right=has_uvs(UVS * 0),
    ),
    built("gltf_interleaved.glb", "interleaved attributes", _interleaved, right=has_uvs(UVS)),
    built("gltf_sparse.glb", "sparse accessors", _sparse(_changed_base())),
    built(
        "gltf_sparse_zeros.glb", "sparse accessors", _sparse(None),
        right=_two_of_zero_area, read=_polygons,
    ),
    built(
        "gltf_colours.glb", "colours of vertices", _with_colours(_COLOURS),
        right=_has_colours(_COLOURS), read=_polygons,
    ),
    built(
        "gltf_colours_bytes.glb", "colours of vertices", _with_colours(_BYTES, **_UP_TO_ONE),
        right=_has_colours(_BYTES / 255), read=_polygons,
    ),
    built(
        "gltf_colours_not_said_normalised.glb", "colours of vertices", _with_colours(_BYTES),
        right=_has_colours(_BYTES / 255), read=_polygons,
    ),
    built(
        "gltf_colours_of_some.glb", "colours of vertices", _some_with_colours,
        right=_half_is_white, read=_polygons,
    ),
    built("gltf_index_bytes.glb", "types of indices", _with_mode(4, SIDES.astype(np.uint8))),
    built("gltf_index_32.glb", "types of indices", _with_mode(4, SIDES.astype(np.uint32))),
    built("gltf_no_indices.glb", "types of indices", _without_indices),
    built("gltf_strips.glb", "strips and fans", _strips),
    built("gltf_fans.glb", "strips and fans", _fans),
    built(
        "gltf_lines_too.glb", "points and lines in glTF", _with_lines,
        "2 primitives are of points or lines and left out",
    ),
    built_refused(
        "gltf_points.glb", "points and lines in glTF", _with_mode(0, None),
        "1 primitive is of points or lines", "of points, make a mesh before",
    ),
    built(
        "gltf_half_a_triangle.glb", "corners without a triangle", _one_corner_more,
        "1 last corner made no whole triangle",
    ),
    built(
        "gltf_temperature.glb", "attributes of writers' own", _measured,
        "Attributes of vertices that are not read: _TEMPERATURE",
    ),
    built_refused(
        "gltf_index_too_large.glb", "references to no vertex", _bad_index,
        "an index of primitive 0 is 5", "one of vertices 0 to 4",
    ),
)  # fmt: skip
