"""Stanford PLY: positions, texture coordinates, colours and polygons, ASCII or binary.

Read here and not by trimesh: it refuses binary files with polygons of different sizes, which
Blender writes, and accepts ASCII files that end early (both seen).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.ply_rows import Element, Lists, PlyRows, read_rows
from storage.readers.polygons import PolygonMesh
from storage.readers.usable_polygons import counted
from storage.readers.vertex_colours import linear_colours

_Columns = Mapping[str, NDArray[np.float64] | Lists]

# No standard says these names: they are the habits of programs.
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_COLOURS = (
    ("red", "green", "blue", "alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"),
)
_NORMALS = {"nx", "ny", "nz"}  # which the product computes
_SPLATS = ({"f_dc_0", "opacity", "scale_0", "rot_0"}, {"packed_position", "packed_scale"})
_FULL = {"u1": 255.0, "u2": 65535.0}


def read_ply(file: Path) -> PolygonMesh:
    """Read the elements ``vertex``, ``face`` and ``tristrips`` of a PLY file.

    Texture coordinates are those of the vertices (s, t; u, v; or texture_u, texture_v) or else
    of the faces' corners (a list ``texcoord``, as MeshLab writes; (nan, nan) where it is empty);
    from the bottom left. Colours are those of the vertices, or else of the faces. Notes say what
    other elements the file has.

    Raises BadInput for a header that cannot be understood, for a file that ends early, and for
    3D Gaussian splats.
    """
    rows = read_rows(file)
    vertex = {
        name: values
        for name, values in rows.columns.get("vertex", {}).items()
        if not isinstance(values, Lists)
    }
    if any(names <= vertex.keys() for names in _SPLATS):
        raise BadInput(
            file, "content", "3D Gaussian splats", "faces: make a mesh of the photographs instead"
        )
    if not {"x", "y", "z"} <= vertex.keys():
        found = ", ".join(vertex) or "none"
        raise BadInput(file, "vertex properties", found, "x, y and z")
    face, strips = rows.columns.get("face", {}), rows.columns.get("tristrips", {})
    polygons, cut = _corners(file, face, "face"), _corners(file, strips, "strip")
    of_strips = _triangles_of_strips(cut)
    corners = np.concatenate([polygons.values, of_strips.ravel()]).astype(np.int64)
    sizes = np.concatenate([polygons.lengths, np.full(len(of_strips), 3)])
    notes = _notes(rows)
    vertex_colours = _colours(vertex, rows.elements, "vertex", notes)
    colours = None if vertex_colours is None else _of_corners(vertex_colours, corners)
    face_colours = _colours(face, rows.elements, "face", notes)
    if face_colours is not None and colours is None and len(face_colours) == len(sizes):
        colours = np.repeat(face_colours, sizes, axis=0)
    elif face_colours is not None:
        notes.append("Colours of its faces are not used: its vertices have colours.")
    return PolygonMesh(
        np.stack([vertex[axis] for axis in "xyz"], axis=1),
        sizes,
        corners,
        _uvs(vertex, face, polygons, corners),
        None,
        colours,
        tuple(notes),
    )


def _corners(file: Path, columns: _Columns, one: str) -> Lists:
    """The lists of vertices of polygons or strips, all whole numbers; none where there are none."""
    # vertex_indices, vertex_index, vertexIndices …
    lists = next((values for name, values in columns.items() if name.startswith("vert")), None)
    if not isinstance(lists, Lists):
        return Lists(np.zeros(0, np.int64), np.zeros(0))
    known = np.where(np.abs(lists.values) < 2**53, lists.values, 0.5)
    if (wrong := known % 1 != 0).any():
        corner = int(np.argmax(wrong))
        row = int(np.searchsorted(np.cumsum(lists.lengths), corner, side="right"))
        found = f"a reference to vertex {lists.values[corner]:g}"
        raise BadInput(file, f"{one} {row}", found, "whole numbers: export it again")
    return lists


def _triangles_of_strips(strips: Lists) -> NDArray[np.float64]:
    """(T, 3) vertices: three in a row each, every second one the other way round, for each strip;
    strips end with their list, or at -1 or another negative number in it."""
    values, at = strips.values, np.arange(len(strips.values))
    begins = np.zeros(len(values), bool)
    firsts = np.cumsum(strips.lengths) - strips.lengths
    begins[firsts[strips.lengths > 0]] = True
    ends = np.flatnonzero(values < 0) + 1
    begins[ends[ends < len(values)]] = True
    begin = np.maximum.accumulate(np.where(begins, at, 0))
    third = np.flatnonzero((at - begin >= 2) & (values >= 0))
    odd = ((third - begin[third]) % 2 == 1)[:, None]
    rows = np.where(odd, third[:, None] + [-1, -2, 0], third[:, None] + [-2, -1, 0])
    return values[rows].reshape(-1, 3)


def _of_corners(
    values: NDArray[np.float64], corners: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """Values of vertices, one for each corner; None where a corner refers to none."""
    if not corners.size or corners.min() < 0 or corners.max() >= len(values):
        return None
    return values[corners]


def _uvs(
    vertex: Mapping[str, NDArray[np.float64]],
    face: _Columns,
    polygons: Lists,
    corners: NDArray[np.int64],
) -> NDArray[np.float64] | None:
    names = next((pair for pair in _UV_NAMES if set(pair) <= vertex.keys()), None)
    if names is not None:
        return _of_corners(np.stack([vertex[name] for name in names], axis=1), corners)
    wedges = face.get("texcoord")
    whole = len(polygons.values) == len(corners)  # no strips
    if not isinstance(wedges, Lists) or len(wedges.lengths) != len(polygons.lengths) or not whole:
        return None
    mapped = wedges.lengths == 2 * polygons.lengths
    if not mapped.any() or not (mapped | (wedges.lengths == 0)).all():
        return None
    uvs = np.full((len(corners), 2), np.nan)
    uvs[np.repeat(mapped, polygons.lengths)] = wedges.values.reshape(-1, 2)
    return uvs


def _colours(
    columns: _Columns, elements: list[Element], element: str, notes: list[str]
) -> NDArray[np.float64] | None:
    """Of an element's rows, (rows, 4) linear; None where it has none."""
    names = next((names for names in _COLOURS if set(names[:3]) <= columns.keys()), None)
    if names is None:
        return None
    values = [columns[name] for name in names if name in columns]
    properties = next(one.properties for one in elements if one.name == element)
    types = {one.name: one.type for one in properties}
    coded = np.column_stack([one for one in values if not isinstance(one, Lists)])
    full = _FULL.get(types[names[0]].str[1:], 255.0 if coded.max(initial=0) > 1 else 1.0)
    colours = linear_colours(coded, full) if coded.shape[1] == len(values) else None
    if colours is None:
        notes.append(f"'{names[0]}' and the like of each {element} left out: they are no colours.")
    return colours


def _notes(rows: PlyRows) -> list[str]:
    """What else the file has."""
    others = [
        f"'{element.name}' ({counted(element.rows, 'row')})"
        for element in rows.elements
        if element.name not in ("vertex", "face", "tristrips") and element.rows
    ]
    notes = [f"Its {', '.join(others)} not read: only vertices and faces are."] if others else []
    known = {"x", "y", "z"}.union(_NORMALS, *_UV_NAMES, *_COLOURS)
    own = [
        item.name[:60]
        for element in rows.elements
        if element.name == "vertex"
        for item in element.properties
        if item.name not in known
    ]
    if own:
        more = f" and {len(own) - 6} more" if len(own) > 6 else ""
        notes.append(f"Properties of its vertices not used: {', '.join(own[:6])}{more}.")
    words = [comment.split(None, 1) for comment in rows.comments]
    textures = [word[1] for word in words if word[0].lower() == "texturefile" and len(word) > 1]
    if textures:
        shown = ", ".join(name.strip()[:60] for name in textures[:3])
        notes.append(f"{counted(len(textures), 'texture')} not used: {shown}.")
    return [*rows.notes, *notes]
