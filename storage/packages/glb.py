"""Meshes as binary glTF 2.0."""

from __future__ import annotations

import json
import math
import struct
from typing import TYPE_CHECKING, Any

from storage.packages.schema import Mesh

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FLOAT, _UNSIGNED_INT = 5126, 5125
_VERTEX_DATA, _INDICES = 34962, 34963
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
Z_UP_TO_Y_UP = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""A quarter turn about x, as a quaternion (x, y, z, w)."""


def glb_bytes(mesh: Mesh, material: dict[str, Any] | None = None) -> bytes:
    """A mesh as a .glb: one scene, one node, one primitive.

    The arrays are written as they are, z up, v from the bottom turned to v from the top; the node
    turns them to glTF's y up. ``material`` is glTF's JSON of a material. Raises ValueError for a
    mesh without triangles.
    """
    import numpy as np

    if not len(mesh.triangles):
        raise ValueError("mesh has no triangles; expected one or more.")
    buffers = _Buffers()
    attributes = {"POSITION": buffers.add(mesh.vertices, bounds=True)}
    if mesh.normals is not None:
        attributes["NORMAL"] = buffers.add(mesh.normals)
    if mesh.uvs is not None:
        flipped = np.stack([mesh.uvs[:, 0], 1 - mesh.uvs[:, 1]], axis=1)
        attributes["TEXCOORD_0"] = buffers.add(flipped)
    for name, values in mesh.attributes.items():
        attributes[f"_{name}"] = buffers.add(values)
    primitive: dict[str, Any] = {
        "attributes": attributes,
        "indices": buffers.add(mesh.triangles.reshape(-1), indices=True),
    }
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "Tsuya"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": list(Z_UP_TO_Y_UP)}],
        "meshes": [{"primitives": [primitive]}],
    }
    if material is not None:
        primitive["material"] = 0
        document["materials"] = [material]
    return container(document | buffers.document(), bytes(buffers.content))


def container(document: dict[str, Any], content: bytes) -> bytes:
    """glTF's JSON and its binary chunk as one .glb."""
    text = json.dumps(document, separators=(",", ":"), sort_keys=True).encode()
    text += b" " * (-len(text) % 4)
    content += b"\0" * (-len(content) % 4)
    total = 12 + 8 + len(text) + 8 + len(content)
    return b"".join(
        (
            struct.pack("<4sII", b"glTF", 2, total),
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(content), b"BIN\0"),
            content,
        )
    )


class _Buffers:
    """Arrays one after the other in one buffer."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: NDArray[Any], *, indices: bool = False, bounds: bool = False) -> int:
        """The number of the accessor of an array, which becomes float32, or uint32 if indices."""
        import numpy as np

        stored = np.ascontiguousarray(array, "<u4" if indices else "<f4")
        width = stored.shape[1] if stored.ndim == 2 else 1
        accessor: dict[str, Any] = {
            "bufferView": len(self.views),
            "componentType": _UNSIGNED_INT if indices else _FLOAT,
            "count": len(stored),
            "type": _TYPES[width],
        }
        if bounds:
            accessor |= {"min": stored.min(axis=0).tolist(), "max": stored.max(axis=0).tolist()}
        self.views.append(
            {
                "buffer": 0,
                "byteOffset": len(self.content),
                "byteLength": stored.nbytes,
                "target": _INDICES if indices else _VERTEX_DATA,
            }
        )
        self.content += stored.tobytes()
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def document(self) -> dict[str, Any]:
        """Their part of glTF's JSON."""
        return {
            "buffers": [{"byteLength": len(self.content)}],
            "bufferViews": self.views,
            "accessors": self.accessors,
        }
