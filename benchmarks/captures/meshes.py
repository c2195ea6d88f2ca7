"""Meshes: OBJ, PLY, STL, and those of glTF that only glass shows."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.captures import mesh_colours, obj_meshes, ply_meshes, stl_meshes
from benchmarks.captures.case import FILES, Case
from benchmarks.captures.mesh_truth import packed, read_for_glass


def _is_a_ball_of_glass(found: Any) -> bool:
    """Of radius 1."""
    a, b, c = np.moveaxis(found.vertices[found.triangles], 1, 0)
    volume = np.einsum("fi,fi->", a, np.cross(b, c)) / 6
    on_it = np.allclose(np.linalg.norm(found.vertices, axis=1), 1, atol=1e-6)
    return bool(on_it and 0.95 < volume / (4 / 3 * np.pi) < 1)


CASES: tuple[Case, ...] = (
    *obj_meshes.CASES,
    *ply_meshes.CASES,
    *mesh_colours.CASES,
    *stl_meshes.STL_CASES,
    *stl_meshes.OTHER_CASES,
    Case(
        "glb_sphere_of_glass.glb",
        "gaps between corners",
        read_for_glass,
        "told",
        ["vertices merged with others within 1e-07"],
        _is_a_ball_of_glass,
        packed((FILES / "glb_threejs_sphere_closed.glb").read_bytes()),
    ),
)
