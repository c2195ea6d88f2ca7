"""Meshes as PLY files, written byte by byte."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.captures.case import Case, Ending
from benchmarks.captures.mesh_truth import (
    SIDES,
    SOLID,
    UVS,
    has_triangles,
    packed,
    ply_head,
    read_for_fur,
    rows_of,
    text,
)
from storage.readers.meshes import read_mesh

_XYZ = ("float x", "float y", "float z")
_LISTS = ("list uchar int vertex_indices",)
_SOLID = has_triangles(SOLID, SIDES)
_FACES = rows_of(np.full(10, 3), SIDES)
_HEAD = ply_head("ascii", _XYZ, _LISTS, (7, 10))
_BODY = "end_header\n" + rows_of(SOLID) + _FACES


def _case(
    name: str,
    kind: str,
    write: Callable[[Path], object] | None,
    ends: Ending = "read",
    says: Sequence[str] = (),
    is_right: Callable[[Any], bool] | None = _SOLID,
    read: Callable[[Path], Any] = read_mesh,
) -> Case:
    return Case(name, kind, read, ends, says, is_right if ends != "refused" else None, write)


def _binary(order: str, vertex: str, face: str, *columns: Any, head: str = "") -> bytes:
    """Rows packed by ``struct``'s letters, under a header."""
    data = "".join(
        f"{struct.pack(order + vertex, *row).hex()}" for row in np.column_stack(columns).tolist()
    )
    data += "".join(struct.pack(order + face, 3, *row).hex() for row in SIDES.tolist())
    return head.encode() + bytes.fromhex(data)


def _head(kind: str, vertex: Sequence[str] = _XYZ, face: Sequence[str] = _LISTS) -> str:
    return ply_head(kind, vertex, face, (7, 10)) + "end_header\n"


def _strips(rows: Sequence[Sequence[int]]) -> Callable[[Path], object]:
    head = ply_head("ascii", _XYZ, (), (7, 0)) + f"element tristrips {len(rows)}\n"
    head += "property list int int vertex_indices\nend_header\n"
    body = "".join(f"{len(row)} {' '.join(map(str, row))}\n" for row in rows)
    return text(head + rows_of(SOLID) + body)


def _is_the_ellipsoid(found: Any) -> bool:
    """1, 2 and 1 wide; its strips, every second triangle turned, face inwards throughout."""
    a, b, c = np.moveaxis(found.vertices[found.triangles], 1, 0)
    volume = np.einsum("fi,fi->f", np.cross(b - a, c - a), a) / 6
    on_it = np.allclose(np.linalg.norm(found.vertices / [1, 2, 1], axis=1), 1, atol=1e-5)
    whole = -0.99 < volume.sum() / (8 / 3 * np.pi) < -0.95
    return bool(on_it and whole and volume.max() < 1e-12)


_EDGES = "element edge 2\nproperty int vertex1\nproperty int vertex2\n"
_GRID = "element range_grid 2\nproperty list uchar int vertex_indices\n"
_SPLAT = tuple(f"float {name}" for name in ("f_dc_0", "opacity", "scale_0", "rot_0"))
_WEDGES = (*_LISTS, "list uchar float texcoord")
_SOME_WEDGES = "".join(
    f"3 {a} {b} {c} " + ("0\n" if n > 1 else f"6 {' '.join(map(str, UVS[[a, b, c]].ravel()))}\n")
    for n, (a, b, c) in enumerate(SIDES.tolist())
)
_STRIP_TRIANGLES = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4], [1, 5, 0]])
CASES = (
    _case("ply_tristrips.ply", "triangle strips", None, "read", (), _is_the_ellipsoid),
    _case(
        "two_strips.ply",
        "triangle strips",
        _strips([[0, 1, 2, 3], [2, 3, 4], [1, 5, 0]]),
        is_right=has_triangles(SOLID, _STRIP_TRIANGLES),
    ),
    _case(
        "strips_apart_by_minus_one.ply",
        "triangle strips",
        _strips([[0, 1, 2, 3, -1, 2, 3, 4, -1, 1, 5, 0, -1]]),
        is_right=has_triangles(SOLID, _STRIP_TRIANGLES),
    ),
    _case(
        "big_endian.ply",
        "byte orders",
        packed(
            _binary(
                ">",
                "ddd",
                "B3H",
                SOLID,
                head=_head(
                    "binary_big_endian",
                    ("double x", "double y", "double z"),
                    ("list uint8 uint16 vertex_index",),
                ),
            )
        ),
    ),
    _case(
        "crlf_head.ply",
        "line ends",
        packed(
            _binary(
                "<", "fff", "B3i", SOLID, head=_head("binary_little_endian").replace("\n", "\r\n")
            )
        ),
    ),
    _case(
        "int_counts.ply",
        "types of numbers",
        packed(
            _binary(
                "<",
                "fff",
                "i3I",
                SOLID,
                head=_head("binary_little_endian", face=("list int32 uint32 vertex_indices",)),
            )
        ),
    ),
    _case(
        "int64.ply",
        "types of numbers",
        packed(
            _binary(
                "<",
                "fff",
                "B3q",
                SOLID,
                head=_head("binary_little_endian", face=("list uint8 int64 vertex_indices",)),
            )
        ),
    ),
    _case(
        "confidence.ply",
        "properties of scanners",
        packed(
            _binary(
                "<",
                "fffff",
                "B3i",
                SOLID,
                np.full(7, 0.5),
                np.full(7, 9),
                head=_head("binary_little_endian", (*_XYZ, "float confidence", "float intensity")),
            )
        ),
        "told",
        ["Properties of its vertices not used: confidence, intensity"],
    ),
    _case(
        "meshlab_corner_colours.ply",
        "rows longer than their header",
        text(
            ply_head("ascii", _XYZ, (*_LISTS, "uchar red", "uchar green"), (7, 10))
            + "end_header\n"
            + rows_of(SOLID)
            + rows_of(np.full(10, 3), SIDES, np.full(10, 9), np.ones((10, 9)))
        ),
        "told",
        ["Numbers at the ends of its lines left out"],
    ),
    _case(
        "capitals.ply",
        "names of properties",
        text(
            ply_head("ascii", ("FLOAT X", "FLOAT Y", "FLOAT Z"), _LISTS, (7, 10)).replace(
                "vertex_indices", "vertexIndices"
            )
            + _BODY
        ),
    ),
    _case(
        "obj_info.ply",
        "headers",
        text(_HEAD.replace("1.0\n", "1.0\nobj_info num_cols 512\ncomment zipper\n") + _BODY),
    ),
    _case("after_the_end.ply", "what follows the end", text(_HEAD + _BODY + "the end\n7 7 7\n")),
    _case(
        "bytes_after_the_end.ply",
        "what follows the end",
        packed(
            _binary("<", "fff", "B3i", SOLID, head=_head("binary_little_endian")) + b"\0\xff junk"
        ),
    ),
    _case(
        "nan_unused.ply",
        "numbers that are none",
        text(
            ply_head("ascii", _XYZ, _LISTS, (8, 10))
            + "end_header\n"
            + rows_of(SOLID)
            + "-nan(ind) 1.#INF nan\n"
            + _FACES
        ),
    ),
    _case(
        "nan_used.ply",
        "numbers that are none",
        text(
            ply_head("ascii", _XYZ, _LISTS, (8, 11))
            + "end_header\n"
            + rows_of(SOLID)
            + "nan nan nan\n"
            + _FACES
            + "3 0 1 7\n"
        ),
        "told",
        ["1 face left out: positions"],
    ),
    _case(
        "edges.ply",
        "elements that are no faces",
        text(_HEAD + _EDGES + _BODY + "0 1\n1 2\n"),
        "told",
        [r"'edge' \(2 rows\) not read"],
    ),
    _case(
        "texture.ply",
        "textures",
        text(_HEAD.replace("1.0\n", "1.0\ncomment TextureFile skin.png\n") + _BODY),
        "told",
        ["1 texture not used: skin.png"],
    ),
    _case(
        "some_wedges.ply",
        "texture coordinates that are missing",
        text(
            ply_head("ascii", _XYZ, _WEDGES, (7, 10))
            + "end_header\n"
            + rows_of(SOLID)
            + _SOME_WEDGES
        ),
        "told",
        ["unwrapped anew"],
        read=read_for_fur,
    ),
    _case(
        "range_scan.ply",
        "points without faces",
        text(
            ply_head("ascii", _XYZ, (), (7, 0))
            + _GRID
            + "end_header\n"
            + rows_of(SOLID)
            + "1 0\n0\n"
        ),
        "refused",
        ["7 points without faces", "Poisson"],
    ),
    _case(
        "cloud.ply",
        "points without faces",
        text(
            ply_head("ascii", (*_XYZ, "float nx", "float ny", "float nz"), (), (7, 0))
            + "end_header\n"
            + rows_of(SOLID, np.full((7, 3), 9))
        ),
        "refused",
        ["7 points without faces", "Poisson"],
    ),
    _case(
        "splats.ply",
        "Gaussian splats",
        text(
            ply_head("ascii", (*_XYZ, *_SPLAT), (), (7, 0))
            + "end_header\n"
            + rows_of(SOLID, np.ones((7, 4)))
        ),
        "refused",
        ["Gaussian splats", "make a mesh"],
    ),
    _case(
        "cut.ply",
        "missing rows",
        text((_HEAD + _BODY)[:-9]),
        "refused",
        ["truncated", "export it, or load it down, again"],
    ),
)
