"""STL: triangles, ASCII or binary, as scanners and programs for 3D printing write them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import check_file, number, whole_file
from storage.readers.polygons import PolygonMesh
from storage.readers.usable_polygons import counted

_HEADER = 84  # bytes: 80 of anything, and how many triangles follow
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_TEXT = re.compile(rb"\s*solid\b", re.IGNORECASE)
_CORNER = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def is_stl(file: Path, start: bytes) -> bool:
    """Whether a file that begins with ``start`` is STL: binary ones have no mark but their size,
    and some of them begin as those in text do."""
    return bool(_TEXT.match(start)) or file.suffix.lower() == ".stl" or _is_binary(file, start)


def read_stl(file: Path) -> PolygonMesh:
    """Read an STL file's triangles; equal positions are one. The normals that it gives are not
    used: the order of the corners tells them.

    Raises BadInput for a file that ends early, and for coordinates that are no numbers.
    """
    start = whole_file(file, "an STL mesh")
    text = _TEXT.match(start) and not _is_binary(file, start)
    corners, notes = _text(file, start) if text else _binary(file, start)
    corners = corners + 0.0  # no -0.0
    # Sorted by hand: np.unique along an axis takes ten times as long.
    order = np.lexsort(corners.T)
    ordered = corners[order]
    new = np.ones(len(order), bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    corner = np.empty(len(order), np.int64)
    corner[order] = np.cumsum(new) - 1
    sizes = np.full(len(corners) // 3, 3, np.int64)
    return PolygonMesh(ordered[new], sizes, corner, None, notes=notes)


def _is_binary(file: Path, start: bytes) -> bool:
    if len(start) < _HEADER:
        return False
    count = int.from_bytes(start[80:84], "little")
    return check_file(file, "an STL mesh") == _HEADER + count * _TRIANGLE.itemsize


def _binary(file: Path, data: bytes) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    if len(data) < _HEADER:
        raise BadInput(file, "content", "truncated in its header", "a complete STL file")
    count = int.from_bytes(data[80:84], "little")
    there = (len(data) - _HEADER) // _TRIANGLE.itemsize
    if there < count:
        found = f"truncated: {there} of {count} triangles"
        raise BadInput(file, "content", found, "all triangles: export it again")
    triangles = np.frombuffer(data, _TRIANGLE, count, _HEADER)
    coloured = triangles["attribute"].any() or b"COLOR=" in data[:80]  # by several conventions
    notes = ("Colours of its triangles are not used.",) if coloured else ()
    return triangles["corners"].reshape(-1, 3).astype(np.float64), notes


def _text(file: Path, data: bytes) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    words = (word for match in _CORNER.finditer(data) for word in match.groups())
    try:
        corners = np.fromiter(map(number, words), np.float64).reshape(-1, 3)
    except ValueError:
        raise BadInput(
            file, "a vertex", "no three numbers", "numbers with a point: export it again"
        ) from None
    loops = len(re.findall(rb"\bouter\s+loop\b", data, re.IGNORECASE))
    if len(corners) != 3 * loops or not re.search(rb"\bendsolid\b", data, re.IGNORECASE):
        found = f"truncated or damaged: {counted(len(corners), 'vertex', 'vertices')} of {loops}"
        raise BadInput(file, "content", f"{found} triangles", "complete: export it again")
    return corners, ()
