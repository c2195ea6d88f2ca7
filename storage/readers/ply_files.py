"""Stanford PLY: positions, texture coordinates and polygons, ASCII or binary.

Read here and not by trimesh: it refuses binary files with polygons of different sizes, which
Blender writes, and accepts ASCII files that end early (both seen).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import LONGEST_NUMBER, number, whole_file
from storage.readers.polygons import PolygonMesh

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_PIECE = 1 << 20  # bytes
_UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))  # no standard, three habits


class _Property(NamedTuple):
    name: str
    type: np.dtype[Any]
    count_type: np.dtype[Any] | None  # of a list


class _Element(NamedTuple):
    name: str
    rows: int
    properties: list[_Property]


class _Lists(NamedTuple):
    """A list property: the lengths of its lists, and their values one after the other."""

    lengths: NDArray[np.int64]
    values: NDArray[np.float64]


class _EndOfFileError(Exception):
    """The file ends before its header says so."""


def read_ply(file: Path) -> PolygonMesh:
    """Read the elements ``vertex`` and ``face`` of a PLY file, ASCII or binary.

    Texture coordinates are those of the vertices (s, t; u, v; or texture_u, texture_v) or else
    of the faces' corners (a list ``texcoord``, as MeshLab writes); from the bottom left.

    Raises BadInput for a header that cannot be understood, and for a file that ends early.
    """
    data = whole_file(file, "a PLY mesh")
    header, order, start = _header(file, data)
    try:
        body = _AsciiBody(data, start) if not order else _BinaryBody(data, start)
        columns = {element.name: _read_element(body, element) for element in header}
    except (_EndOfFileError, ValueError):
        raise BadInput(
            file, "content", "truncated or damaged", "all the rows that the header announces"
        ) from None
    return _polygon_mesh(file, columns)


def _polygon_mesh(
    file: Path, columns: Mapping[str, Mapping[str, NDArray[np.float64] | _Lists]]
) -> PolygonMesh:
    face = columns.get("face", {})
    vertex = {
        name: values
        for name, values in columns.get("vertex", {}).items()
        if not isinstance(values, _Lists)
    }
    if not {"x", "y", "z"} <= vertex.keys():
        found = ", ".join(vertex) or "none"
        raise BadInput(file, "vertex properties", found, "x, y and z")
    polygons = face.get("vertex_indices", face.get("vertex_index"))
    if not isinstance(polygons, _Lists):
        polygons = _Lists(np.zeros(0, np.int64), np.zeros(0))
    if (wrong := ~(np.abs(polygons.values) < 2**53) | (polygons.values % 1 != 0)).any():
        corner = int(np.argmax(wrong))
        polygon = int(np.searchsorted(np.cumsum(polygons.lengths), corner, side="right"))
        found = f"a reference to vertex {polygons.values[corner]:g}"
        raise BadInput(file, f"face {polygon}", found, "whole numbers")
    corners = polygons.values.astype(np.int64)
    uvs = None
    wedges = face.get("texcoord")
    names = next((pair for pair in _UV_NAMES if set(pair) <= vertex.keys()), None)
    if names is not None:
        vertex_uvs = np.stack([vertex[name] for name in names], axis=1)
        if corners.size and corners.min() >= 0 and corners.max() < len(vertex_uvs):
            uvs = vertex_uvs[corners]
    elif isinstance(wedges, _Lists) and np.array_equal(wedges.lengths, 2 * polygons.lengths):
        uvs = wedges.values.reshape(-1, 2)
    positions = np.stack([vertex[axis] for axis in "xyz"], axis=1)
    return PolygonMesh(positions, polygons.lengths, corners, uvs)


def _header(file: Path, data: bytes) -> tuple[list[_Element], str, int]:
    """The elements, the byte order ('' for ASCII) and where the rows start."""
    end = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", data, re.MULTILINE)
    if end is None:
        raise BadInput(file, "header", "truncated or damaged", "a line 'end_header'")
    order: str | None = None
    elements: list[_Element] = []
    for line in data[: end.start()].decode("ascii", errors="replace").splitlines()[1:]:
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _BYTE_ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(_property(words[1:], order or ""))
        except (KeyError, IndexError, ValueError):
            raise BadInput(file, "header", f"'{line[:60]}'", "a line of PLY 1.0") from None
    if order is None:
        raise BadInput(file, "header", "without a format", "a line 'format'")
    return elements, order, end.end()


def _property(words: list[str], order: str) -> _Property:
    def type_of(word: str) -> np.dtype[Any]:
        return np.dtype(order + _TYPES[word])

    if words[0] == "list":
        return _Property(words[3], type_of(words[2]), type_of(words[1]))
    return _Property(words[1], type_of(words[0]), None)


class _AsciiBody:
    """Rows of numbers in text; line ends do not matter."""

    def __init__(self, data: bytes, start: int) -> None:
        self._numbers = np.fromiter(map(number, _words(data, start)), np.float64)
        self.at = 0

    def take(self, type_: np.dtype[Any], count: int) -> NDArray[np.float64]:
        if count < 0 or self.at + count > len(self._numbers):
            raise _EndOfFileError
        taken = self._numbers[self.at : self.at + count]
        self.at += count
        return taken

    def table(self, rows: int, fields: list[tuple[np.dtype[Any], int]]) -> list[NDArray[Any]]:
        """Columns (rows, width) of rows that are all alike; fields are types and widths."""
        widths = [width for _, width in fields]
        numbers = self.take(np.dtype(np.float64), rows * sum(widths)).reshape(rows, sum(widths))
        return np.split(numbers, np.cumsum(widths)[:-1], axis=1)


def _words(data: bytes, start: int) -> Iterator[bytes]:
    """Words apart by blanks and line ends, split a piece at a time: all together would take thirty
    times the file. Raises ValueError for a word of a thousand characters."""
    rest = b""
    for at in range(start, len(data), _PIECE):
        piece = rest + data[at : at + _PIECE]
        words = piece.split()
        rest = words.pop() if words and not piece[-1:].isspace() else b""
        if len(rest) > LONGEST_NUMBER:
            raise ValueError("a word that is no number")
        yield from words
    if rest:
        yield rest


class _BinaryBody:
    """Rows of numbers as they lie in memory."""

    def __init__(self, data: bytes, start: int) -> None:
        self._data = data
        self.at = start

    def take(self, type_: np.dtype[Any], count: int) -> NDArray[Any]:
        if count < 0 or self.at + count * type_.itemsize > len(self._data):
            raise _EndOfFileError
        taken = np.frombuffer(self._data, type_, count, self.at)
        self.at += taken.nbytes
        return taken

    def table(self, rows: int, fields: list[tuple[np.dtype[Any], int]]) -> list[NDArray[Any]]:
        """Columns (rows, width) of rows that are all alike; fields are types and widths."""
        row = np.dtype([(f"{i}", type_, (width,)) for i, (type_, width) in enumerate(fields)])
        taken = self.take(row, rows)
        return [taken[name] for name in row.names or ()]


def _read_element(
    body: _AsciiBody | _BinaryBody, element: _Element
) -> dict[str, NDArray[np.float64] | _Lists]:
    if element.rows == 0 or not element.properties:
        return {}
    start = body.at
    try:
        return _alike_rows(body, element)
    except _EndOfFileError:
        body.at = start
        return _ragged_rows(body, element)


def _length(body: _AsciiBody | _BinaryBody, type_: np.dtype[Any]) -> int:
    """Of a list; raises ValueError where it is no whole number."""
    length = float(body.take(type_, 1)[0])
    if not length.is_integer():  # nor infinite, nor no number
        raise ValueError("a length that is no whole number")
    return int(length)


def _alike_rows(
    body: _AsciiBody | _BinaryBody, element: _Element
) -> dict[str, NDArray[np.float64] | _Lists]:
    """Rows whose lists all have the lengths of those in the first row: one block.

    Raises _EndOfFileError where they have not, as for a file that is too short.
    """
    start = body.at
    lengths = {}
    for item in element.properties:
        if item.count_type is not None:
            lengths[item.name] = _length(body, item.count_type)
        body.take(item.type, lengths.get(item.name, 1))
    body.at = start
    fields = []
    for item in element.properties:
        if item.count_type is not None:
            fields.append((item.count_type, 1))
        fields.append((item.type, lengths.get(item.name, 1)))
    columns = iter(body.table(element.rows, fields))
    result: dict[str, NDArray[np.float64] | _Lists] = {}
    for item in element.properties:
        if item.count_type is None:
            result[item.name] = next(columns)[:, 0].astype(np.float64)
            continue
        counts = next(columns)[:, 0]
        if (counts != lengths[item.name]).any():
            raise _EndOfFileError
        result[item.name] = _Lists(
            counts.astype(np.int64), next(columns).astype(np.float64).ravel()
        )
    return result


def _ragged_rows(
    body: _AsciiBody | _BinaryBody, element: _Element
) -> dict[str, NDArray[np.float64] | _Lists]:
    """Rows one by one."""
    taken: list[list[NDArray[np.float64]]] = [[] for _ in element.properties]
    for _ in range(element.rows):
        for item, values in zip(element.properties, taken, strict=True):
            count = 1 if item.count_type is None else _length(body, item.count_type)
            values.append(body.take(item.type, count))
    result: dict[str, NDArray[np.float64] | _Lists] = {}
    for item, values in zip(element.properties, taken, strict=True):
        flat = np.concatenate(values).astype(np.float64)
        lengths = np.array([len(v) for v in values], np.int64)
        result[item.name] = flat if item.count_type is None else _Lists(lengths, flat)
    return result
