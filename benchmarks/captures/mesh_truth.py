"""A small solid that is like none of its turned or mirrored copies, written and compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry.mended_meshes import mend_mesh
from pipelines.geometry.meshes import brought_near
from pipelines.geometry.solids import make_closed_mesh
from storage.readers.bad_input import BadInput
from storage.readers.meshes import read_mesh

SOLID = np.array(
    [
        *([0, 0, 0], [2, 0, 0], [0.5, 0.25, 3], [2, 1, 0]),
        *([0, 1, 0], [1.5, 0.75, 2], [1.75, 2, 1]),
    ]
)
"""Corners: a rectangle, two points above it, and one beside these."""
SIDES = np.array(
    [
        *([0, 3, 1], [0, 4, 3], [0, 1, 2], [1, 5, 2], [1, 3, 5]),
        *([3, 4, 6], [4, 5, 6], [5, 3, 6], [4, 2, 5], [4, 0, 2]),
    ]
)
"""Its triangles, counter-clockwise from outside; the first two are the rectangle."""
UVS = np.array([[0, 0], [1, 0], [0.25, 0.5], [1, 1], [0, 1], [0.75, 0.5], [0.5, 0.75]])


class Furred(NamedTuple):
    """What fur grows on: a mesh, and what was told on the way."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    uvs: NDArray[np.float64]
    normals: NDArray[np.float64]
    notes: tuple[str, ...]


class Blown(NamedTuple):
    """What is made of glass, and what was told on the way."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    notes: tuple[str, ...]


def read_for_fur(path: Path) -> Furred:
    """A mesh as fur has it: read, brought near, repaired, mapped."""
    vertices, triangles, uvs, notes = read_mesh(path)
    vertices, moved = brought_near(vertices)
    mesh, mended = mend_mesh(vertices, triangles, uvs)
    return Furred(mesh.vertices, mesh.triangles, mesh.uvs, mesh.normals, (*notes, *moved, *mended))


def read_for_glass(path: Path) -> Blown:
    """A mesh as glass has it: read, welded, closed. Refusals name the file, as in a run."""
    vertices, triangles, _, notes = read_mesh(path)
    try:
        closed = make_closed_mesh(vertices, triangles)
    except ValueError as error:
        found, _, expected = str(error).partition("; expected ")
        raise BadInput(path, "the mesh", found.removeprefix("the mesh is "), expected) from error
    return Blown(closed.vertices, closed.triangles, (*notes, *closed.notes))


def has_triangles(vertices: ArrayLike, triangles: ArrayLike, atol: float = 1e-6) -> Any:
    """Whether what was read has these triangles and no others, each facing the same way, in any
    order and from whichever corner."""
    expected = _sorted_corners(np.asarray(vertices, np.float64)[np.asarray(triangles)], atol)

    def is_right(found: Any) -> bool:
        corners = _sorted_corners(found.vertices[found.triangles], atol)
        return corners.shape == expected.shape and bool(
            np.allclose(corners, expected, rtol=0, atol=2 * atol)
        )

    return is_right


def _sorted_corners(corners: NDArray[np.float64], atol: float) -> NDArray[np.float64]:
    """Triangles (F, 3, 3) from their lowest corner on, the lowest first."""
    steps = np.rint(corners / atol)
    # By the first number, then the second …: each corner's rank among all.
    _, rank = np.unique(steps.reshape(-1, 3), axis=0, return_inverse=True)
    rank = rank.reshape(-1, 3)
    shift = (np.arange(3) + rank.argmin(axis=1)[:, None]) % 3
    rank = np.take_along_axis(rank, shift, axis=1)
    turned = np.take_along_axis(corners, shift[:, :, None], axis=1)
    return turned[np.lexsort(rank.T[::-1])]


def encloses(volume: float) -> Callable[[Any], bool]:
    """Whether what was read encloses this volume, seen from outside."""

    def is_right(found: Any) -> bool:
        corners = found.vertices[found.triangles]
        six = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        return bool(np.isclose(six / 6, volume, rtol=1e-6))

    return is_right


def text(content: str, encoding: str = "utf-8") -> Callable[[Path], object]:
    """What writes a text file."""
    return lambda path: path.write_bytes(content.encode(encoding))


def packed(content: bytes) -> Callable[[Path], object]:
    """What writes a file of bytes."""
    return lambda path: path.write_bytes(content)


def obj_vertices(vertices: ArrayLike = SOLID, after: Sequence[str] | None = None) -> str:
    """Lines ``v``, with something after each."""
    points = np.asarray(vertices, np.float64)
    ends = after if after is not None else [""] * len(points)
    rows = (" ".join(f"{x!r}" for x in point) for point in points.tolist())
    return "".join(f"v {row} {end}".rstrip() + "\n" for row, end in zip(rows, ends, strict=True))


def obj_uvs(uvs: ArrayLike = UVS) -> str:
    """Lines ``vt``."""
    return "".join(f"vt {u!r} {v!r}\n" for u, v in np.asarray(uvs, np.float64).tolist())


def obj_faces(faces: ArrayLike = SIDES, form: str = "{0}") -> str:
    """Lines ``f``; ``form`` of a corner, whose number is 0 in it."""
    rows = np.asarray(faces).tolist()
    return "".join("f " + " ".join(form.format(n + 1) for n in row) + "\n" for row in rows)


def ply_head(kind: str, vertex: Sequence[str], face: Sequence[str], sizes: tuple[int, int]) -> str:
    """The header of a PLY file, without its last line."""
    vertices = "".join(f"property {one}\n" for one in vertex)
    faces = "".join(f"property {one}\n" for one in face)
    head = f"ply\nformat {kind} 1.0\nelement vertex {sizes[0]}\n{vertices}"
    return head + (f"element face {sizes[1]}\n{faces}" if face else "")


def rows_of(*columns: ArrayLike) -> str:
    """Lines of numbers; a column may be several wide."""
    table = np.column_stack([np.asarray(column) for column in columns]).tolist()
    return "".join(" ".join(f"{value:.9g}" for value in row) + "\n" for row in table)
