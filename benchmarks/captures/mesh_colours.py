"""Colours of vertices and faces, as OBJ and PLY files have them; the truth by sRGB's formula."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case, Ending
from benchmarks.captures.mesh_truth import (
    SIDES,
    SOLID,
    obj_faces,
    obj_vertices,
    ply_head,
    rows_of,
    text,
)
from storage.readers.meshes import read_mesh, read_polygons

_XYZ = ("float x", "float y", "float z")
_RGB = ("uchar red", "uchar green", "uchar blue")
_LISTS = ("list uchar int vertex_indices",)
_CODES = np.array(
    [
        [200, 10, 0],
        [0, 255, 30],
        [7, 0, 128],
        [255, 255, 255],
        [90, 60, 0],
        [1, 2, 3],
        [50, 50, 200],
    ]
)
_FACES = rows_of(np.full(10, 3), SIDES)


class _Polygons:
    """A mesh before it is cut: its corners' colours are not lost yet."""

    def __init__(self, path: Path) -> None:
        self.mesh = read_polygons(path)
        self.notes = self.mesh.notes


def _case(
    name: str,
    kind: str,
    write: Callable[[Path], object],
    ends: Ending = "read",
    says: Sequence[str] = (),
    is_right: Callable[[Any], bool] | None = None,
    read: Callable[[Path], Any] = _Polygons,
) -> Case:
    return Case(name, kind, read, ends, says, is_right, write)


def _linear(codes: NDArray[np.floating]) -> NDArray[np.float64]:
    """sRGB's curve (IEC 61966-2-1) for shares in [0, 1]."""
    return np.array(
        [
            [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in row]
            for row in codes
        ]
    )


def _colours_are(
    rows: NDArray[np.float64], opacity: float = 1.0, of_faces: bool = False
) -> Callable[[Any], bool]:
    """Whether corners have these linear colours of their vertices, or of their triangles."""

    def is_right(found: Any) -> bool:
        mesh = found.mesh
        index = np.repeat(np.arange(10), 3) if of_faces else SIDES.ravel()
        positions = np.allclose(mesh.positions[mesh.corners], SOLID[SIDES.ravel()])
        wanted = np.column_stack([rows[index], np.full(30, opacity)])
        return bool(positions and np.allclose(mesh.corner_colours, wanted, atol=1e-6))

    return is_right


def _coloured(names: Sequence[str], values: Any) -> Callable[[Path], object]:
    head = ply_head("ascii", (*_XYZ, *names), _LISTS, (7, 10)) + "end_header\n"
    return text(head + rows_of(SOLID, values) + _FACES)


def _obj(colours: Sequence[str], more: str = "") -> Callable[[Path], object]:
    return text(obj_vertices(after=colours) + more + obj_faces())


def _words(rows: NDArray[np.floating], form: str) -> list[str]:
    return [" ".join(format(value, form) for value in row) for row in rows.tolist()]


_LINEAR = _linear(_CODES / 255)
_SOME = np.where(np.arange(7)[:, None] < 3, _LINEAR, 1.0)
_PAINT = (
    "#MRGB " + "".join(f"ff{red:02x}{green:02x}{blue:02x}" for red, green, blue in _CODES) + "\n"
)

CASES = (
    _case(
        "colours_byte.ply",
        "colours of vertices",
        _coloured(_RGB, _CODES),
        is_right=_colours_are(_linear(_CODES / 255)),
    ),
    _case(
        "colours_short.ply",
        "colours of vertices",
        _coloured(("ushort red", "ushort green", "ushort blue"), _CODES * 257),
        is_right=_colours_are(_linear(_CODES / 255)),
    ),
    _case(
        "colours_float.ply",
        "colours of vertices",
        _coloured(("float red", "float green", "float blue"), _CODES / 255),
        is_right=_colours_are(_linear(_CODES / 255)),
    ),
    _case(
        "colours_diffuse_alpha.ply",
        "colours of vertices",
        _coloured(
            [f"uchar diffuse_{name}" for name in ("red", "green", "blue", "alpha")],
            np.column_stack([_CODES, np.full(7, 51)]),
        ),
        is_right=_colours_are(_linear(_CODES / 255), 0.2),
    ),
    _case(
        "colours_of_faces.ply",
        "colours of faces",
        text(
            ply_head("ascii", _XYZ, (*_LISTS, *_RGB), (7, 10))
            + "end_header\n"
            + rows_of(SOLID)
            + rows_of(np.full(10, 3), SIDES, _CODES[[0, 1, 2, 3, 4, 5, 6, 0, 1, 2]])
        ),
        is_right=_colours_are(_linear(_CODES[[0, 1, 2, 3, 4, 5, 6, 0, 1, 2]] / 255), of_faces=True),
    ),
    _case(
        "colours_for_fur.ply",
        "colours of vertices",
        _coloured(_RGB, _CODES),
        "told",
        ["Colours of its vertices are not used"],
        read=read_mesh,
    ),
    _case(
        "colours_unit.obj",
        "colours of vertices",
        _obj(_words(_CODES / 255, ".9f")),
        is_right=_colours_are(_LINEAR),
    ),
    _case(
        "colours_255.obj",
        "colours of vertices",
        _obj(_words(_CODES, "d")),
        is_right=_colours_are(_LINEAR),
    ),
    _case(
        "colours_alpha.obj",
        "colours of vertices",
        _obj(_words(np.column_stack([_CODES / 255, np.full(7, 0.2)]), ".9f")),
        is_right=_colours_are(_LINEAR, 0.2),
    ),
    _case(
        "colours_of_some.obj",
        "colours of some vertices",
        _obj([*_words(_CODES[:3] / 255, ".9f"), *[""] * 4]),
        "told",
        ["4 of 7 vertices have no colour: white"],
        _colours_are(_SOME),
    ),
    _case(
        "colours_zbrush.obj",
        "colours in comments",
        _obj([""] * 7, _PAINT),
        is_right=_colours_are(_LINEAR),
    ),
    _case(
        "colours_nan.obj",
        "numbers that are none",
        _obj(["nan 0 0"] * 7),
        "told",
        ["they are no colours"],
        lambda found: (
            found.mesh.corner_colours is None and bool(np.allclose(found.mesh.positions, SOLID))
        ),
    ),
)
