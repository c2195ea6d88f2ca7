"""glTF files written by hand: JSON, bytes and nothing between, for what no exporter would write."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

PYRAMID = np.array([[2, 0, 0], [0, 1, 0], [0, 0, 0], [2, 1, 0], [0.5, 0.25, 3]], np.float32)
"""Corners of a pyramid that is like none of its turned or mirrored copies."""
SIDES = np.array([[2, 3, 0], [2, 1, 3], [2, 0, 4], [0, 3, 4], [3, 1, 4], [1, 2, 4]], np.uint16)
"""Its triangles, counter-clockwise from outside."""

_COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class GltfWriter:
    """A document that grows; each method returns the number of what it added.

    document: the JSON, to be changed at will. binary: of its only buffer, but for the rest.
    """

    def __init__(self, **extra: Any) -> None:
        self.document: dict[str, Any] = {"asset": {"version": "2.0"}} | extra
        self.binary = b""

    def add(self, kind: str, **entry: Any) -> int:
        """An entry of one of the document's lists."""
        entries: list[Any] = self.document.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def view(self, data: bytes, **entry: Any) -> int:
        """A bufferView of bytes, which begin at a multiple of four."""
        self.binary += bytes(-len(self.binary) % 4)
        place = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary += data
        return self.add("bufferViews", **place | entry)

    def accessor(self, values: NDArray[Any], **entry: Any) -> int:
        """An accessor of rows of numbers, close together; ``bufferView=None``: without a view."""
        rows = values.reshape(len(values), -1)
        described = {
            "componentType": _COMPONENTS[rows.dtype.str[1:]],
            "count": len(rows),
            "type": _TYPES[rows.shape[1]],
        }
        if "bufferView" not in entry:
            described["bufferView"] = self.view(rows.tobytes())
        described |= entry
        return self.add("accessors", **{k: v for k, v in described.items() if v is not None})

    def primitive(
        self,
        positions: NDArray[Any] = PYRAMID,
        triangles: NDArray[Any] | None = SIDES,
        **attributes: int,
    ) -> dict[str, Any]:
        """A primitive; ``attributes``: numbers of further accessors, by name."""
        made: dict[str, Any] = {"attributes": {"POSITION": self.accessor(positions)} | attributes}
        if triangles is not None:
            made["indices"] = self.accessor(triangles.reshape(-1))
        return made

    def mesh(self, *primitives: dict[str, Any], **entry: Any) -> int:
        """A mesh; without primitives, of the pyramid."""
        return self.add("meshes", primitives=list(primitives) or [self.primitive()], **entry)

    def node(self, **entry: Any) -> int:
        """A node."""
        return self.add("nodes", **entry)

    def json(self) -> bytes:
        """The JSON, with its buffer's length where it has one."""
        if self.binary and "buffers" not in self.document:
            self.document["buffers"] = [{"byteLength": len(self.binary)}]
        return json.dumps(self.document).encode()

    def glb(self) -> bytes:
        """All as a GLB."""
        return glb(self.json(), self.binary)

    def write(self, path: Path) -> None:
        """As a GLB, or as a .gltf that has its buffer in itself."""
        if path.suffix == ".glb":
            path.write_bytes(self.glb())
            return
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()
        self.document.setdefault("buffers", [{"byteLength": len(self.binary), "uri": uri}])
        path.write_bytes(self.json())


def glb(text: bytes, binary: bytes | None, *others: tuple[bytes, bytes]) -> bytes:
    """A GLB of its JSON, its binary chunk and ``others``: kinds and contents of further chunks."""
    chunks = _chunk(b"JSON", text + b" " * (-len(text) % 4))
    if binary is not None:
        chunks += _chunk(b"BIN\0", binary + bytes(-len(binary) % 4))
    chunks += b"".join(_chunk(kind, data) for kind, data in others)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack("<I4s", len(data), kind) + data


def one_mesh(**node: Any) -> GltfWriter:
    """The pyramid, at a node."""
    made = GltfWriter(scene=0, scenes=[{"nodes": [0]}])
    made.node(mesh=made.mesh(), **node)
    return made


# --- What is right ------------------------------------------------------------------------------


def pyramid_at(*matrices: Any) -> NDArray[np.float64]:
    """(6 n, 3, 3): the triangles of the pyramid, moved by matrices (3, 4) or (4, 4); mirrors turn
    them over."""
    placed = []
    for matrix in np.array(matrices or [np.eye(4)], float):
        corners = PYRAMID.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
        turned = SIDES[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else SIDES
        placed.append(corners[turned])
    return np.concatenate(placed)


def moved(x: float, y: float, z: float) -> NDArray[np.float64]:
    """(4, 4)."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def are_triangles(found: NDArray[np.float64], expected: NDArray[np.float64]) -> bool:
    """Whether triangles (T, 3, n) are the same, by 1e-5 and in any order; which corner is the first
    does not matter, which way they go around does."""
    if found.shape != expected.shape:
        return False
    return np.allclose(_in_order(found), _in_order(expected), atol=1e-5, rtol=1e-5)


def _in_order(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each from its first corner on, and all in order: by numbers that rounding does not change."""
    weights = np.cos(np.arange(triangles.shape[2]) * 1.7 + 0.3)
    keys = np.round(triangles @ weights, 4)
    first = np.argmin(keys, axis=1)[:, None]
    turned = (first + np.arange(3)) % 3
    rows = np.take_along_axis(triangles, turned[:, :, None], axis=1).reshape(len(triangles), -1)
    keys = np.take_along_axis(keys, turned, axis=1)
    ordered: NDArray[np.float64] = rows[np.lexsort(keys.T)]
    return ordered
