"""One mesh of all that a scene places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.gltf.accessors import Accessors
from storage.readers.gltf.primitives import Geometry, Primitive, is_surface
from storage.readers.gltf.quantised_uvs import unquantised
from storage.readers.gltf.scene_tree import Group, placements
from storage.readers.gltf.skins import joint_matrices, posed
from storage.readers.polygons import PolygonMesh


class _Placed(NamedTuple):
    """``positions`` (I, V, 3); ``triangles`` (I, T, 3), of the geometry's own vertices."""

    geometry: Geometry
    positions: NDArray[np.float64]
    triangles: NDArray[np.int64]
    row: int


class Assembly:
    """Grows by one group of nodes after the other.

    primitives: the JSON of each primitive of the file.
    flat: how many nodes or instances are scaled to nothing, which hides them.
    leftover: corners that made no whole triangle.
    clamped: vertices whose colours were not in [0, 1].
    """

    def __init__(self, accessors: Accessors, world: NDArray[np.float64]) -> None:
        self._accessors, self._world = accessors, world
        self._document = accessors.buffers.document
        meshes = self._document.get("meshes", [])
        self.primitives = [part for mesh in meshes for part in mesh["primitives"]]
        self._first_rows = np.cumsum([0, *(len(mesh["primitives"]) for mesh in meshes)])
        self._joints: dict[int, NDArray[np.float64]] = {}
        self._placed: list[_Placed] = []
        self.flat = self.leftover = self.clamped = 0

    def place(self, group: Group) -> None:
        """Add a mesh wherever the nodes of a group put it."""
        matrices = np.zeros((0, 4, 4))
        if group.skin is None:
            each = [
                placements(self._document, self._accessors, self._world, node)
                for node in group.nodes
            ]
            matrices = np.concatenate(each)
            drawn = matrices[:, :3, :3].any(axis=(1, 2))
            self.flat += int((~drawn).sum())
            matrices = matrices[drawn]
        first = int(self._first_rows[group.mesh])
        for row, entry in enumerate(self._document["meshes"][group.mesh]["primitives"], first):
            if not is_surface(entry):
                continue
            geometry = Primitive(self._accessors, entry, row).geometry(
                group.weights, skinned=group.skin is not None
            )
            self.leftover += geometry.leftover
            self.clamped += geometry.clamped
            if group.skin is None or geometry.joints is None or geometry.weights is None:
                places = self._world[group.nodes] if group.skin is not None else matrices
                self._placed.append(_by_matrices(geometry, places, row))
            else:
                self._placed.append(self._by_joints(geometry, group.skin, row))

    def _by_joints(self, geometry: Geometry, skin: int, row: int) -> _Placed:
        if skin not in self._joints:
            self._joints[skin] = joint_matrices(self._document, self._accessors, self._world, skin)
        file, matrices = self._accessors.buffers.file, self._joints[skin]
        assert geometry.joints is not None
        assert geometry.weights is not None
        positions, mirrored = posed(
            file, geometry.positions, geometry.joints, geometry.weights, matrices
        )
        triangles = geometry.triangles.copy()
        turned = mirrored[triangles].sum(axis=1) >= 2
        triangles[turned] = triangles[turned][:, ::-1]
        return _Placed(geometry, positions[None], triangles[None], row)

    def joined(self, notes: tuple[str, ...]) -> tuple[PolygonMesh, dict[int, NDArray[np.float64]]]:
        """The mesh, and each set of texture coordinates of its corners."""
        placed = self._placed
        positions, corners, parts = [np.zeros((0, 3))], [np.zeros(0, np.int64)], []
        vertices = 0
        for part in placed:
            instances, count = part.positions.shape[:2]
            offsets = vertices + count * np.arange(instances)
            corners.append((part.triangles + offsets[:, None, None]).ravel())
            positions.append(part.positions.reshape(-1, 3))
            parts.append(np.full(len(corners[-1]) // 3, part.row, np.int64))
            vertices += instances * count
        all_corners = np.concatenate(corners)
        sets = sorted({number for part in placed for number in part.geometry.uvs})
        uvs = {number: self._uvs(number) for number in sets}
        mesh = PolygonMesh(
            np.concatenate(positions),
            np.full(len(all_corners) // 3, 3, np.int64),
            all_corners,
            self._first_uvs() if 0 in sets else None,
            np.concatenate(parts) if parts else np.zeros(0, np.int64),
            self._colours(),
            notes,
        )
        return mesh, uvs

    def _uvs(self, number: int) -> NDArray[np.float64]:
        pieces = [
            part.geometry.uvs[number][part.triangles.ravel()]
            if number in part.geometry.uvs
            else np.zeros((part.triangles.size, 2))
            for part in self._placed
        ]
        return np.concatenate(pieces)

    def _first_uvs(self) -> NDArray[np.float64]:
        """Of a mesh without its materials."""
        pieces = []
        for part in self._placed:
            piece = np.full((part.triangles.size, 2), np.nan)
            if 0 in part.geometry.uvs:
                entry, stored = self.primitives[part.row], part.geometry.uvs[0]
                piece = unquantised(self._document, entry, stored)[part.triangles.ravel()]
            pieces.append(piece)
        return np.concatenate(pieces)

    def _colours(self) -> NDArray[np.float64] | None:
        if all(part.geometry.colours is None for part in self._placed):
            return None
        pieces = [
            np.ones((part.triangles.size, 4))
            if part.geometry.colours is None
            else part.geometry.colours[part.triangles.ravel()]
            for part in self._placed
        ]
        return np.concatenate(pieces)


def _by_matrices(geometry: Geometry, matrices: NDArray[np.float64], row: int) -> _Placed:
    """Geometry once for each matrix (I, 4, 4); mirrors turn the triangles over."""
    turned = geometry.positions @ matrices[:, :3, :3].transpose(0, 2, 1)
    positions = turned + matrices[:, None, :3, 3]
    triangles = np.repeat(geometry.triangles[None], len(matrices), axis=0)
    mirrored = np.linalg.det(matrices[:, :3, :3]) < 0
    triangles[mirrored] = triangles[mirrored][:, :, ::-1]
    return _Placed(geometry, positions, triangles, row)
