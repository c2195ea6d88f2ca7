"""Accessors as arrays: numbers of all types, strided, normalised, sparse (glTF 2.0, 3.6)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.gltf.buffers import Buffers
from storage.readers.gltf.document import COMPONENT_TYPES, COMPONENTS

_MATRIX_ROWS = {"MAT2": 2, "MAT3": 3, "MAT4": 4}


class Accessors:
    """The arrays of a document that was checked."""

    def __init__(self, buffers: Buffers) -> None:
        self.buffers = buffers
        self._entries = buffers.document.get("accessors", [])

    def count(self, number: int) -> int:
        """How many elements an accessor has."""
        count: int = self._entries[number]["count"]
        return count

    def largest(self, number: int) -> float:
        """What stands for 1 in integers of an accessor; 1 where they are normalised, or floats."""
        entry = self._entries[number]
        kind = np.dtype(COMPONENT_TYPES[entry["componentType"]])
        if kind.kind == "f" or entry.get("normalized", False):
            return 1.0
        return float(np.iinfo(kind).max)

    def floats(self, number: int, widths: tuple[int, ...], what: str) -> NDArray[np.float64]:
        """(count, n), normalised where the accessor says so; matrices one column after the other.

        Raises BadInput where ``n``, what an element has, is none of ``widths``, naming ``what``.
        """
        values = self._array(number, widths, what)
        return as_floats(values, bool(self._entries[number].get("normalized", False)))

    def wholes(self, number: int, widths: tuple[int, ...], what: str) -> NDArray[np.int64]:
        """(count, n) of integers, as they are; raises BadInput for floats, too."""
        if self._entries[number]["componentType"] == 5126:
            raise self._wrong(number, f"of floats for {what}", "integers")
        return self._array(number, widths, what).astype(np.int64)

    def converted(self, number: int, values: NDArray[Any]) -> NDArray[np.float64]:
        """Values that were packed apart, as floats by what the accessor says of them."""
        return as_floats(values, bool(self._entries[number].get("normalized", False)))

    def _array(self, number: int, widths: tuple[int, ...], what: str) -> NDArray[Any]:
        entry = self._entries[number]
        if COMPONENTS[entry["type"]] not in widths:
            expected = " or ".join(f"{width}" for width in widths) + f" numbers for {what}"
            raise self._wrong(number, f"of type {entry['type']}", expected)
        if "bufferView" in entry:
            values = self._stored(number, entry, entry["type"], entry["count"])
        else:
            kind = COMPONENT_TYPES[entry["componentType"]]
            values = np.zeros((entry["count"], COMPONENTS[entry["type"]]), f"<{kind}")
        return self._with_sparse(number, entry, values) if "sparse" in entry else values

    def _with_sparse(
        self, number: int, entry: dict[str, Any], values: NDArray[Any]
    ) -> NDArray[Any]:
        sparse = entry["sparse"]
        rows = self._stored(number, sparse["indices"], "SCALAR", sparse["count"])[:, 0]
        where = sparse["values"] | {"componentType": entry["componentType"]}
        changed = self._stored(number, where, entry["type"], sparse["count"])
        if rows.max(initial=0) >= max(len(values), 1):
            found = f"sparse with a value for element {rows.max()}"
            raise self._wrong(number, found, f"elements 0 to {len(values) - 1}")
        values = values.copy()
        values[rows.astype(np.int64)] = changed
        return values

    def _stored(self, number: int, where: dict[str, Any], kind: str, count: int) -> NDArray[Any]:
        """(count, n): a window on the bytes of a bufferView."""
        view = self.buffers.view(where["bufferView"])
        dtype = np.dtype("<" + COMPONENT_TYPES[where["componentType"]])
        rows = _MATRIX_ROWS.get(kind, COMPONENTS[kind])
        columns = COMPONENTS[kind] // rows
        column = rows * dtype.itemsize
        if columns > 1:  # each column of a matrix begins at a multiple of four bytes
            column += -column % 4
        element = column * (columns - 1) + rows * dtype.itemsize
        described = self.buffers.document["bufferViews"][where["bufferView"]]
        stride = described.get("byteStride") or column * columns
        first = where.get("byteOffset", 0)
        if count and first + stride * (count - 1) + element > len(view):
            found = f"of {count} elements, beyond the {len(view)} bytes of its bufferView"
            raise self._wrong(number, found, "a bufferView that holds them: export it anew")
        if count == 0:
            return np.zeros((0, COMPONENTS[kind]), dtype)
        strides = (stride, column, dtype.itemsize)
        window = np.ndarray((count, columns, rows), dtype, view, first, strides)
        return window.reshape(count, -1)

    def _wrong(self, number: int, found: str, expected: str) -> BadInput:
        return BadInput(self.buffers.file, f"accessors[{number}]", found, expected)


def as_floats(values: NDArray[Any], normalised: bool) -> NDArray[np.float64]:
    """Numbers as float64; normalised integers from -1 or 0 to 1 (glTF 2.0, 3.11)."""
    floats = values.astype(np.float64)
    if not normalised or values.dtype.kind == "f":
        return floats
    floats /= np.iinfo(values.dtype).max
    return np.maximum(floats, -1.0, out=floats)
