"""The rows of Stanford PLY files, ASCII or binary, as their header describes them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import LONGEST_NUMBER, number, whole_file

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
    **{"int64": "i8", "uint64": "u8"},
}
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_PIECE = 1 << 20  # bytes


class Property(NamedTuple):
    """A property: its name, its type, and of a list that of its length."""

    name: str
    type: np.dtype[Any]
    count_type: np.dtype[Any] | None


class Element(NamedTuple):
    """An element: its name, how many rows it has, and of what."""

    name: str
    rows: int
    properties: list[Property]


class Lists(NamedTuple):
    """A list property: the lengths of its lists, and their values one after the other."""

    lengths: NDArray[np.int64]
    values: NDArray[np.float64]


class _EndOfFileError(Exception):
    """The file ends before its header says so."""


class PlyRows(NamedTuple):
    """``elements``, as the header has them; ``columns``, by the names of the elements and of their
    properties, numbers (rows,) or lists; ``comments`` of the header, without that word;
    ``notes``, what was left out, a sentence each."""

    elements: list[Element]
    columns: dict[str, dict[str, NDArray[np.float64] | Lists]]
    comments: list[str]
    notes: tuple[str, ...]


def read_rows(file: Path) -> PlyRows:
    """Read all rows of a PLY file; what follows them is passed over.

    Raises BadInput for a header that cannot be understood, and for a file that ends early.
    """
    data = whole_file(file, "a PLY mesh")
    lines, start = _header_lines(file, data)
    header, order = _header(file, lines)
    comments = [line.split(None, 1)[1] for line in lines if re.match(r"comment\s+\S", line)]
    body = _AsciiBody(_numbers(data, start)) if not order else _BinaryBody(data, start)
    columns = _read_elements(body, header)
    notes: tuple[str, ...] = ()
    if isinstance(body, _AsciiBody) and (columns is None or not body.is_at_end()):
        lined = _AsciiBody(_numbers_of_lines(data, start, header))
        by_lines = _read_elements(lined, header)
        if by_lines is not None and not lined.is_start_of(body):
            columns = by_lines
            notes = ("Numbers at the ends of its lines left out: its header has no such.",)
    if columns is None:
        expected = "all the rows that the header announces: export it, or load it down, again"
        raise BadInput(file, "content", "truncated or damaged", expected)
    return PlyRows(header, columns, comments, notes)


def _read_elements(
    body: _AsciiBody | _BinaryBody, header: list[Element]
) -> dict[str, dict[str, NDArray[np.float64] | Lists]] | None:
    """None where there are not as many rows, or not such, as the header says."""
    try:
        return {element.name: _read_element(body, element) for element in header}
    except (_EndOfFileError, ValueError):
        return None


def _header_lines(file: Path, data: bytes) -> tuple[list[str], int]:
    """The header's lines but for the first and the last one, and where the rows start."""
    end = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", data, re.MULTILINE)
    if end is None:
        raise BadInput(file, "header", "truncated or damaged", "a line 'end_header'")
    return data[: end.start()].decode("utf-8", errors="replace").splitlines()[1:], end.end()


def _header(file: Path, lines: list[str]) -> tuple[list[Element], str]:
    """The elements, and the byte order ('' for ASCII)."""
    order: str | None = None
    elements: list[Element] = []
    for line in lines:
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _BYTE_ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(Element(words[1].lower(), int(words[2]), []))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(_property(words[1:], order or ""))
        except (KeyError, IndexError, ValueError):
            raise BadInput(file, "header", f"'{line[:60]}'", "a line of PLY 1.0") from None
    if order is None:
        raise BadInput(file, "header", "without a format", "a line 'format'")
    return elements, order


def _property(words: list[str], order: str) -> Property:
    def type_of(word: str) -> np.dtype[Any]:
        return np.dtype(order + _TYPES[word.lower()])

    if words[0] == "list":
        return Property(words[3].lower(), type_of(words[2]), type_of(words[1]))
    return Property(words[1].lower(), type_of(words[0]), None)


class _AsciiBody:
    """Rows of numbers in text, up to the first word that is none; line ends do not matter."""

    def __init__(self, numbers: Iterator[float]) -> None:
        self._numbers = np.fromiter(numbers, np.float64)
        self.at = 0

    def is_at_end(self) -> bool:
        return self.at == len(self._numbers)

    def is_start_of(self, other: _AsciiBody) -> bool:
        return np.array_equal(self._numbers, other._numbers[: len(self._numbers)], equal_nan=True)

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


def _numbers(data: bytes, start: int) -> Iterator[float]:
    """Up to the first word that is none."""
    try:
        for word in _words(data, start):
            yield number(word)
    except ValueError:
        return


def _numbers_of_lines(data: bytes, start: int, header: list[Element]) -> Iterator[float]:
    """As `_numbers`, but of each row's line only as many as the header says: MeshLab's colours of
    corners stand there under a header that promises others. Ends at a line with less."""
    lines = filter(None, map(bytes.split, data[start:].splitlines()))
    for element in header:
        for _, words in zip(range(element.rows), lines, strict=False):
            at = 0
            for item in element.properties:
                if item.count_type is not None:
                    length = words[at : at + 1]
                    if not length or not length[0].isdigit() or len(length[0]) > 9:
                        return
                    at += int(length[0])
                at += 1
            if at > len(words):
                return
            try:
                yield from [number(word) for word in words[:at]]
            except ValueError:
                return


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
    body: _AsciiBody | _BinaryBody, element: Element
) -> dict[str, NDArray[np.float64] | Lists]:
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
    body: _AsciiBody | _BinaryBody, element: Element
) -> dict[str, NDArray[np.float64] | Lists]:
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
    result: dict[str, NDArray[np.float64] | Lists] = {}
    for item in element.properties:
        if item.count_type is None:
            result[item.name] = next(columns)[:, 0].astype(np.float64)
            continue
        counts = next(columns)[:, 0]
        if (counts != lengths[item.name]).any():
            raise _EndOfFileError
        result[item.name] = Lists(counts.astype(np.int64), next(columns).astype(np.float64).ravel())
    return result


def _ragged_rows(
    body: _AsciiBody | _BinaryBody, element: Element
) -> dict[str, NDArray[np.float64] | Lists]:
    """Rows one by one."""
    taken: list[list[NDArray[np.float64]]] = [[] for _ in element.properties]
    for _ in range(element.rows):
        for item, values in zip(element.properties, taken, strict=True):
            count = 1 if item.count_type is None else _length(body, item.count_type)
            values.append(body.take(item.type, count))
    result: dict[str, NDArray[np.float64] | Lists] = {}
    for item, values in zip(element.properties, taken, strict=True):
        flat = np.concatenate(values).astype(np.float64)
        lengths = np.array([len(v) for v in values], np.int64)
        result[item.name] = flat if item.count_type is None else Lists(lengths, flat)
    return result
