"""Wavefront OBJ: positions, texture coordinates, polygons and what they belong to.

Read here and not by trimesh: it takes indices counted from the end of the list so far as
counted from the end of the file, and cuts every vertex short where one line is (both seen).
"""

from __future__ import annotations

import codecs
import io
import re
from array import array
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.opening import number, whole_file
from storage.readers.polygons import PolygonMesh
from storage.readers.usable_polygons import counted
from storage.readers.vertex_colours import linear_colours

_LONGEST_LINE = 1_000_000
_COMMENT = re.compile(r"(?:^|\s)#.*")
_JOINED = re.compile(r"\\[ \t]*\n")
# What is no polygon, by its keyword.
_OTHER_ELEMENTS = {
    **{"p": "point", "l": "line", "curv": "curve", "curv2": "curve", "surf": "free-form surface"},
    **{"bzp": "patch", "bsp": "patch", "cdc": "curve", "cdp": "patch", "res": "patch"},
    **{"call": "call of another file", "csh": "command"},
}
_PAINT = "#MRGB "  # ZBrush's comments, up to 64 vertices' mask, red, green and blue in each


class ObjPart(NamedTuple):
    """What polygons have in common: the names that ``o``, ``g`` and ``usemtl`` gave last before
    them, '' for none. A name is all of the line, spaces and number signs included."""

    object: str = ""
    group: str = ""
    material: str = ""


class ObjFile(NamedTuple):
    """``mesh``, whose parts are rows of ``parts``, in the order in which they have their first
    polygons; ``libraries``, what each ``mtllib`` line names: one or more files."""

    mesh: PolygonMesh
    parts: tuple[ObjPart, ...]
    libraries: tuple[str, ...]


def read_obj(file: Path) -> ObjFile:
    """Read ``v``, ``vt``, ``f`` and the names of parts of an OBJ file; all go into one mesh.

    Text is UTF-8 or UTF-16; references may lead forward. Texture coordinates count from the
    bottom left; corners without one have (nan, nan), and without any they are None. Colours of
    vertices are three or four numbers after the position, or ZBrush's comments; their range is
    1 or 255. Material libraries are not opened; normals are not used: the product computes its
    own. Notes say which elements that are no polygons the file has.

    Raises BadInput, naming the line, for numbers that are missing or no numbers, and for
    references to vertices that do not exist.
    """
    content = _Content()
    libraries: list[str] = []
    part, rows, parts = ObjPart(), dict[ObjPart, int](), array("q")
    for row, line in enumerate(_lines(file), start=1):
        if "#" in line:
            content.painted(line)
        keyword, *words = (_COMMENT.sub("", line) if "#" in line else line).split() or [""]
        try:
            if keyword == "v":
                content.vertex(words)
            elif keyword == "vt":
                content.uvs.extend(content.numbers([*words, "0"][: max(len(words), 2)], 2))
            elif keyword in ("f", "fo"):
                content.face(words, row)
                parts.append(rows.setdefault(part, len(rows)))
            elif keyword == "o":
                part = ObjPart(_name(line), "", part.material)
            elif keyword == "g":
                part = part._replace(group=_name(line))
            elif keyword == "usemtl":
                part = part._replace(material=_name(line))
            elif keyword == "mtllib":
                libraries.append(_name(line))
            elif keyword in _OTHER_ELEMENTS:
                content.others[_OTHER_ELEMENTS[keyword]] += 1
        except ValueError as error:
            shown = line.strip()[:60]
            raise BadInput(file, f"line {row}", f"'{shown}'", str(error)) from None
    return ObjFile(content.mesh(file, np.array(parts, np.int64)), tuple(rows), tuple(libraries))


class _Content:
    """What a file's lines say, one after the other."""

    def __init__(self) -> None:
        # Arrays, not lists: of a line of ten bytes these would keep two hundred.
        self.positions, self.uvs, self.colours = array("d"), array("d"), array("d")
        self.coloured = array("q")  # the vertex of each colour
        self.paint = array("B")
        self.sizes, self.rows = array("q"), array("q")
        self.corners, self.corner_uvs = array("q"), array("q")
        self.others = Counter[str]()
        self.commas = 0

    def vertex(self, words: list[str]) -> None:
        """``x y z``, with a weight, which polygons have no use for, or a colour after it."""
        self.positions.extend(self.numbers(words, 3))
        if len(words) >= 6:
            self.coloured.append(len(self.positions) // 3 - 1)
            self.colours.extend(self.numbers([*words, "-1"][3:7], 4))  # -1: no opacity

    def face(self, words: list[str], row: int) -> None:
        positions, uvs = len(self.positions) // 3, len(self.uvs) // 2
        for word in words:
            position, *others = word.split("/")
            uv = others[0] if others else ""
            self.corners.append(_index(position, positions, "vertices"))
            self.corner_uvs.append(_index(uv, uvs, "texture coordinates") if uv else -1)
        self.sizes.append(len(words))
        self.rows.append(row)

    def painted(self, line: str) -> None:
        if line.startswith(_PAINT):
            digits = line[len(_PAINT) :].strip()
            try:
                self.paint.frombytes(bytes.fromhex(digits[: len(digits) // 8 * 8]))
            except ValueError:
                return

    def numbers(self, words: list[str], count: int) -> list[float]:
        """The first numbers of a line; of a line with decimal commas, too."""
        try:
            numbers = [number(word) for word in words[:count]]
        except ValueError:
            try:
                numbers = [number(word.replace(",", ".")) for word in words[:count]]
                self.commas += 1
            except ValueError:
                numbers = []
        if len(numbers) < count:
            raise ValueError(f"{count} numbers, such as 1.5 or 2e-3")
        return numbers

    def mesh(self, file: Path, parts: NDArray[np.int64]) -> PolygonMesh:
        """All of it; raises BadInput for references to vertices that do not exist."""
        notes = []
        if self.others:
            things = " and ".join(counted(n, thing) for thing, n in self.others.items())
            if not self.sizes and set(self.others) != {"point"}:
                expected = "faces: convert curves and surfaces to polygons where they were made"
                raise BadInput(file, "content", f"{things} without faces", expected)
            notes.append(f"{things} not read: only polygons are.")
        if self.commas:
            notes.append(f"Decimal commas of {counted(self.commas, 'line')} read as points.")
        positions = np.array(self.positions, np.float64).reshape(-1, 3)
        sizes, corners = np.array(self.sizes, np.int64), np.array(self.corners, np.int64)
        wrong = corners >= len(positions)
        if wrong.any():
            corner = int(np.argmax(wrong))
            face = int(np.searchsorted(np.cumsum(sizes), corner, side="right"))
            found = f"a reference to vertex {corners[corner] + 1}"
            expected = f"1 to {len(positions)}: part of the file is missing, export it again"
            raise BadInput(file, f"line {self.rows[face]}", found, expected)
        colours = self._vertex_colours(len(positions), notes)
        return PolygonMesh(
            positions,
            sizes,
            corners,
            self._corner_uvs(notes),
            parts,
            None if colours is None else colours[corners],
            tuple(notes),
        )

    def _corner_uvs(self, notes: list[str]) -> NDArray[np.float64] | None:
        rows = np.array(self.corner_uvs, np.int64)
        uvs = np.array(self.uvs, np.float64).reshape(-1, 2)
        if missing := int((rows >= len(uvs)).sum()):
            notes.append(
                f"Texture coordinates of {counted(missing, 'corner')} left out: the file "
                f"has {len(uvs)}, they refer to others."
            )
        rows[rows >= len(uvs)] = -1
        if rows.max(initial=-1) < 0:
            return None
        return np.concatenate([uvs, [[np.nan, np.nan]]])[rows]  # -1 is the last one

    def _vertex_colours(self, count: int, notes: list[str]) -> NDArray[np.float64] | None:
        """(count, 4), or None. White, where only some vertices have a colour."""
        if len(self.paint) == 4 * count > 0 and not self.coloured:
            painted = np.frombuffer(self.paint, np.uint8).reshape(-1, 4).astype(np.float64)
            return linear_colours(painted[:, 1:], 255.0)
        if not self.coloured:
            return None
        coded = np.array(self.colours, np.float64).reshape(-1, 4)
        full = 255.0 if coded.max() > 1.0 else 1.0
        coded[:, 3] = np.where(coded[:, 3] < 0, full, coded[:, 3])
        colours = linear_colours(coded, full)
        if colours is None:
            notes.append("Numbers after its positions left out: they are no colours.")
            return None
        result = np.ones((count, 4))
        result[np.array(self.coloured, np.int64)] = colours
        if len(self.coloured) < count:
            notes.append(f"{count - len(self.coloured)} of {count} vertices have no colour: white.")
        return result


def _lines(file: Path) -> Iterator[str]:
    """Lines as :meth:`str.splitlines` has them, but one by one; those that end in a backslash
    joined to the next."""
    data = whole_file(file, "an OBJ mesh")
    text = data.decode(_encoding(data), errors="replace")
    text = _JOINED.sub(" ", text.replace("\r\n", "\n").replace("\r", "\n"))
    for row, line in enumerate(io.StringIO(text), start=1):
        if len(line) > _LONGEST_LINE:
            found = f"{len(line)} characters long"
            raise BadInput(file, f"line {row}", found, f"at most {_LONGEST_LINE} characters")
        yield from line.splitlines()


def _encoding(data: bytes) -> str:
    """UTF-16 by its mark or, without one, by the zeros of its first letters; else UTF-8."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if data[1:4:2] == b"\0\0" and data[:1] != b"\0":
        return "utf-16-le"
    return "utf-16-be" if data[0:3:2] == b"\0\0" and data[1:2] != b"\0" else "utf-8-sig"


def _name(line: str) -> str:
    """Not cut at a number sign: 3ds Max calls its materials "Material #25"."""
    return " ".join(line.split()[1:])


def _index(word: str, count: int, things: str) -> int:
    """From 1 for the first, or from -1 for the last one so far; as an index from 0."""
    try:
        index = int(word) if len(word) <= 18 else 0
    except ValueError:
        index = 0
    if index == 0 or index < -count:
        raise ValueError(f"references from 1 on, or from -1 back to the {count} {things} so far")
    return index - 1 if index > 0 else count + index
