"""Binary glTF 2.0: a file of several arrays and pictures, and a mesh as a package has it."""

from __future__ import annotations

import json
import math
import struct
from typing import TYPE_CHECKING, Any

from storage.packages.schema import Mesh

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_FLOAT, _UNSIGNED_INT = 5126, 5125
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
Z_UP_TO_Y_UP = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""A quarter turn about x, as a quaternion (x, y, z, w)."""


class GlbFile:
    """The buffer of a .glb, its views and accessors."""

    def __init__(self) -> None:
        self._content = bytearray()
        self._views: list[dict[str, int]] = []
        self._accessors: list[dict[str, Any]] = []

    def values(self, array: NDArray[Any]) -> int:
        """The number of an accessor of floats (N,) or (N, k), with their bounds."""
        import numpy as np

        stored = np.ascontiguousarray(array, "<f4")
        rows = stored.reshape(len(stored), -1)
        return self._accessor(
            {
                "bufferView": self._view(stored.tobytes()),
                "componentType": _FLOAT,
                "count": len(rows),
                "type": _TYPES[rows.shape[1]],
                "min": rows.min(axis=0).tolist(),
                "max": rows.max(axis=0).tolist(),
            }
        )

    def indices(self, corners: NDArray[np.integer]) -> int:
        """The number of an accessor of vertex numbers."""
        stored = corners.reshape(-1).astype("<u4")
        made = {"bufferView": self._view(stored.tobytes()), "componentType": _UNSIGNED_INT}
        return self._accessor(made | {"count": len(stored), "type": "SCALAR"})

    def picture(self, codes: NDArray[np.uint8]) -> int:
        """The number of a view that holds a picture as PNG."""
        import imagecodecs

        return self._view(bytes(imagecodecs.png_encode(codes)))

    def whole(self, document: dict[str, Any]) -> bytes:
        """The file: glTF's JSON, without what is of the buffer, and the buffer."""
        parts: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "Tsuya"},
            "buffers": [{"byteLength": len(self._content)}],
            "bufferViews": self._views,
            "accessors": self._accessors,
        }
        text = json.dumps(parts | document, separators=(",", ":"), sort_keys=True).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self._content)
        return b"".join(
            (
                struct.pack("<4sII", b"glTF", 2, total),
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(self._content), b"BIN\0"),
                self._content,
            )
        )

    def _view(self, content: bytes) -> int:
        self._views.append(
            {"buffer": 0, "byteOffset": len(self._content), "byteLength": len(content)}
        )
        self._content += content + b"\0" * (-len(content) % 4)
        return len(self._views) - 1

    def _accessor(self, made: dict[str, Any]) -> int:
        self._accessors.append(made)
        return len(self._accessors) - 1


def glb_bytes(mesh: Mesh) -> bytes:
    """A mesh as a .glb: one scene, one node, one primitive.

    The arrays are written as they are, z up, v from the bottom turned to v from the top; the node
    turns them to glTF's y up. Raises ValueError for a mesh without triangles.
    """
    import numpy as np

    if not len(mesh.triangles):
        raise ValueError("mesh has no triangles; expected one or more.")
    file = GlbFile()
    attributes = {"POSITION": file.values(mesh.vertices)}
    if mesh.normals is not None:
        attributes["NORMAL"] = file.values(mesh.normals)
    if mesh.uvs is not None:
        flipped = np.stack([mesh.uvs[:, 0], 1 - mesh.uvs[:, 1]], axis=1)
        attributes["TEXCOORD_0"] = file.values(flipped)
    for name, values in mesh.attributes.items():
        attributes[f"_{name}"] = file.values(values)
    primitive = {"attributes": attributes, "indices": file.indices(mesh.triangles)}
    return file.whole(
        {
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "rotation": list(Z_UP_TO_Y_UP)}],
            "meshes": [{"primitives": [primitive]}],
        }
    )
