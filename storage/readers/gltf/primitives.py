"""The geometry of one primitive: triangles with what their vertices have (glTF 2.0, 3.7.2)."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.gltf.accessors import Accessors
from storage.readers.gltf.compression import DracoMesh, draco_mesh
from storage.readers.gltf.document import DRACO

TRIANGLES, STRIP, FAN = 4, 5, 6

_ROUNDING = 1e-3
_UV = re.compile(r"TEXCOORD_([0-9]{1,3})")
_JOINTS = re.compile(r"JOINTS_([0-9]{1,3})")


class Geometry(NamedTuple):
    """``positions`` (V, 3) float64; ``triangles`` (T, 3) int64; ``uvs``, by the number of their
    set, (V, 2) float64, v from the bottom; ``colours`` (V, 4) float64 in [0, 1], or None;
    ``joints`` (V, J) int64 and ``weights`` (V, J) float64, of a skin, or None; ``leftover``,
    vertices at the end that make no whole triangle; ``clamped``, vertices whose colours were not in
    [0, 1]."""

    positions: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uvs: dict[int, NDArray[np.float64]]
    colours: NDArray[np.float64] | None
    joints: NDArray[np.int64] | None
    weights: NDArray[np.float64] | None
    leftover: int
    clamped: int


def is_surface(primitive: dict[str, Any]) -> bool:
    """Whether a primitive has triangles with positions: not points, not lines, not nothing."""
    return primitive.get("mode", TRIANGLES) >= TRIANGLES and "POSITION" in primitive["attributes"]


def uv_sets(primitive: dict[str, Any]) -> list[int]:
    """The numbers of a primitive's sets of texture coordinates."""
    matches = map(_UV.fullmatch, primitive["attributes"])
    return sorted({int(match[1]) for match in matches if match})


def joint_sets(primitive: dict[str, Any]) -> list[int]:
    """The numbers of a primitive's sets of joints that have weights."""
    attributes = primitive["attributes"]
    matches = map(_JOINTS.fullmatch, attributes)
    numbers = sorted({int(match[1]) for match in matches if match})
    return [number for number in numbers if f"WEIGHTS_{number}" in attributes]


class Primitive:
    """Reads a primitive's attributes, from its accessors or from what Draco packed."""

    def __init__(self, accessors: Accessors, entry: dict[str, Any], number: int) -> None:
        self._accessors, self._entry, self._field = accessors, entry, f"primitive {number}"
        self._draco = self._unpacked()
        self._count: int | None = None

    def geometry(self, weights: tuple[float, ...], skinned: bool) -> Geometry:
        """The triangles, with morph targets in these proportions.

        Raises BadInput for references to vertices that do not exist, and where attributes are of
        types that they cannot have.
        """
        active = [
            (target, weight)
            for target, weight in zip(self._entry.get("targets", ()), weights, strict=False)
            if weight
        ]
        positions = self._morphed("POSITION", (3,), active)
        uvs = {}
        for row in uv_sets(self._entry):
            uv = self._morphed(f"TEXCOORD_{row}", (2,), active)
            uvs[row] = np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])
        triangles, leftover = self._triangles(len(positions))
        joints, proportions = self._skinning() if skinned else (None, None)
        colours, clamped = self._colours(active)
        return Geometry(positions, triangles, uvs, colours, joints, proportions, leftover, clamped)

    def _unpacked(self) -> DracoMesh | None:
        packed = self._entry.get("extensions", {}).get(DRACO)
        if packed is None:
            return None
        accessors, buffers = self._accessors, self._accessors.buffers
        indices = self._entry.get("indices", self._entry["attributes"]["POSITION"])
        most = accessors.count(indices) // (1 if self._entry.get("mode") == STRIP else 3)
        names = {
            name: row
            for name, row in packed["attributes"].items()
            if name in self._entry["attributes"]
        }
        return draco_mesh(buffers.file, buffers.view(packed["bufferView"]), names, most)

    def _values(self, name: str, widths: tuple[int, ...]) -> NDArray[np.float64]:
        accessor = self._entry["attributes"][name]
        if self._draco is None or name not in self._draco.attributes:
            values = self._accessors.floats(accessor, widths, name)
        else:
            values = self._accessors.converted(accessor, self._draco.attributes[name])
            if values.shape[1] not in widths:
                raise self._wrong(f"{name} of {values.shape[1]} numbers", f"{widths[0]} numbers")
        return self._of_each_vertex(name, values)

    def _of_each_vertex(self, name: str, values: NDArray[Any]) -> NDArray[Any]:
        if self._count is None:
            self._count = len(values)
        if len(values) != self._count:
            found = f"with {len(values)} values of {name} for {self._count} vertices"
            raise self._wrong(found, "one for each vertex")
        return values

    def _morphed(
        self, name: str, widths: tuple[int, ...], active: list[tuple[dict[str, int], float]]
    ) -> NDArray[np.float64]:
        values = self._values(name, widths)
        for target, weight in active:
            if name in target:
                moved = self._accessors.floats(target[name], widths, f"{name} of a morph target")
                moved = self._of_each_vertex(f"{name} of a morph target", moved)
                width = min(values.shape[1], moved.shape[1])
                values[:, :width] += weight * moved[:, :width]
        return values

    def _colours(
        self, active: list[tuple[dict[str, int], float]]
    ) -> tuple[NDArray[np.float64] | None, int]:
        accessor = self._entry["attributes"].get("COLOR_0")
        if accessor is None:
            return None, 0
        values = self._morphed("COLOR_0", (3, 4), active)
        values /= self._accessors.largest(accessor)  # integers are normalised, said or not
        colours = np.ones((len(values), 4))
        colours[:, : values.shape[1]] = np.clip(np.nan_to_num(values, nan=1.0), 0.0, 1.0)
        within = (values > -_ROUNDING) & (values < 1 + _ROUNDING)
        return colours, int((~within.all(axis=1)).sum())

    def _skinning(self) -> tuple[NDArray[np.int64], NDArray[np.float64]] | tuple[None, None]:
        joints, weights = [], []
        for row in joint_sets(self._entry):
            if self._draco is None or f"JOINTS_{row}" not in self._draco.attributes:
                accessor = self._entry["attributes"][f"JOINTS_{row}"]
                held = self._accessors.wholes(accessor, (4,), f"JOINTS_{row}")
                joints.append(self._of_each_vertex(f"JOINTS_{row}", held))
            else:
                joints.append(self._values(f"JOINTS_{row}", (4,)).astype(np.int64))
            weights.append(self._values(f"WEIGHTS_{row}", (4,)))
        if not joints:
            return None, None
        return np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)

    def _triangles(self, vertices: int) -> tuple[NDArray[np.int64], int]:
        if self._draco is not None:
            triangles, leftover = self._draco.triangles, 0
        else:
            corners = np.arange(vertices)
            if "indices" in self._entry:
                corners = self._accessors.wholes(self._entry["indices"], (1,), "indices")[:, 0]
            triangles, leftover = cut(corners, self._entry.get("mode", TRIANGLES))
        wrong = triangles[(triangles < 0) | (triangles >= vertices)]
        if wrong.size:
            file, index = self._accessors.buffers.file, f"an index of {self._field}"
            raise BadInput(file, index, f"{wrong[0]}", f"one of vertices 0 to {vertices - 1}")
        return triangles, leftover

    def _wrong(self, found: str, expected: str) -> BadInput:
        return BadInput(self._accessors.buffers.file, self._field, found, expected)


def cut(corners: NDArray[np.int64], mode: int) -> tuple[NDArray[np.int64], int]:
    """Corners of triangles, of a strip or of a fan to triangles (T, 3), and how many are left over.

    Every second triangle of a strip is turned (glTF 2.0, 3.7.2.1); those with a repeated corner,
    which join the pieces of a strip, are left out.
    """
    if mode == TRIANGLES:
        whole = len(corners) - len(corners) % 3
        return corners[:whole].reshape(-1, 3), len(corners) - whole
    if len(corners) < 3:
        return np.zeros((0, 3), np.int64), len(corners)
    if mode == FAN:
        first = np.full(len(corners) - 2, corners[0])
        triangles = np.column_stack([corners[1:-1], corners[2:], first])
    else:
        triangles = np.column_stack([corners[:-2], corners[1:-1], corners[2:]])
        triangles[1::2] = triangles[1::2][:, [0, 2, 1]]
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (c != a)], 0
