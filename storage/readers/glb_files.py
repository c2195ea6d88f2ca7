"""GLB (glTF 2.0 in one file): triangles as the scene's nodes place them, with their primitives."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from storage.readers.gltf import read_gltf
from storage.readers.polygons import PolygonMesh


class GlbFile(NamedTuple):
    """``mesh``, all meshes as the scene's nodes place them, its parts rows of ``primitives``;
    ``primitives`` and ``materials``, as in the file's JSON, not checked."""

    mesh: PolygonMesh
    primitives: list[dict[str, Any]]
    materials: Any


def read_glb(file: Path) -> GlbFile:
    """Read a GLB file; raises BadInput as `storage.readers.gltf.read_gltf`."""
    read = read_gltf(file)
    return GlbFile(read.mesh, read.primitives, read.document.get("materials", []))
