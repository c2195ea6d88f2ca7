"""Wavefront OBJ: positions, texture coordinates, polygons and what they belong to.

Read here and not by trimesh: it takes indices counted from the end of the list so far as
counted from the end of the file, and cuts every vertex short where one line is (both seen).
"""

from __future__ import annotations

import io
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from storage.readers.bad_input import BadInput
from storage.readers.opening import number, whole_file
from storage.readers.polygons import PolygonMesh

_LONGEST_LINE = 1_000_000


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

    Texture coordinates count from the bottom left; they are None unless every corner has one.
    Material libraries are not opened.

    Raises BadInput, naming the line, for numbers that are missing or no numbers, and for
    references to vertices that do not exist.
    """
    # Arrays, not lists: of a line of ten bytes these would keep two hundred.
    positions, uvs = array("d"), array("d")
    sizes, corners, corner_uvs = array("q"), array("q"), array("q")
    libraries: list[str] = []
    part, rows, parts = ObjPart(), dict[ObjPart, int](), array("q")
    for row, line in enumerate(_lines(file), start=1):
        keyword, *words = line.split("#", 1)[0].split() or [""]
        try:
            if keyword == "v":
                positions.extend(_numbers(words, 3))
            elif keyword == "vt":
                uvs.extend(_numbers([*words, "0"][: max(len(words), 2)], 2))
            elif keyword == "f":
                if len(words) < 3:
                    raise ValueError("at least three corners")
                sizes.append(len(words))
                parts.append(rows.setdefault(part, len(rows)))
                for word in words:
                    corner, uv = _corner(word, len(positions) // 3, len(uvs) // 2)
                    corners.append(corner)
                    corner_uvs.append(uv)
            elif keyword == "o":
                part = ObjPart(_name(line), "", part.material)
            elif keyword == "g":
                part = part._replace(group=_name(line))
            elif keyword == "usemtl":
                part = part._replace(material=_name(line))
            elif keyword == "mtllib":
                libraries.append(_name(line))
        except ValueError as error:
            shown = line.strip()[:60]
            raise BadInput(file, f"line {row}", f"'{shown}'", str(error)) from None
    mapped = np.array(corner_uvs, np.int64)
    complete = mapped.min(initial=0 if len(corners) else -1) >= 0
    mesh = PolygonMesh(
        np.array(positions, np.float64).reshape(-1, 3),
        np.array(sizes, np.int64),
        np.array(corners, np.int64),
        np.array(uvs, np.float64).reshape(-1, 2)[mapped] if complete else None,
        np.array(parts, np.int64),
    )
    return ObjFile(mesh, tuple(rows), tuple(libraries))


def _lines(file: Path) -> Iterator[str]:
    """Lines as :meth:`str.splitlines` has them, but one by one; those that end in a backslash
    joined to the next."""
    text = whole_file(file, "an OBJ mesh").decode("utf-8", errors="replace")
    text = text.replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", " ")
    for row, line in enumerate(io.StringIO(text), start=1):
        if len(line) > _LONGEST_LINE:
            found = f"{len(line)} characters long"
            raise BadInput(file, f"line {row}", found, f"at most {_LONGEST_LINE} characters")
        yield from line.splitlines()


def _name(line: str) -> str:
    """Not cut at a number sign: 3ds Max calls its materials "Material #25"."""
    return " ".join(line.split()[1:])


def _numbers(words: list[str], count: int) -> list[float]:
    """The first numbers of a line: weights and vertex colours may follow."""
    try:
        numbers = [number(word) for word in words[:count]]
    except ValueError:
        numbers = []
    if len(numbers) < count:
        raise ValueError(f"{count} numbers")
    return numbers


def _corner(word: str, positions: int, uvs: int) -> tuple[int, int]:
    """``position``, ``position/uv``, ``position//normal`` or ``position/uv/normal``; -1 for no
    texture coordinate."""
    position, *others = word.split("/")
    uv = others[0] if others else ""
    return _index(position, positions, "vertices"), (
        _index(uv, uvs, "texture coordinates") if uv else -1
    )


def _index(word: str, count: int, things: str) -> int:
    """From 1 for the first, or from -1 for the last one so far; as an index from 0."""
    try:
        index = int(word[:20])
    except ValueError:
        index = 0
    if index == 0 or len(word) > 20 or not -count <= index <= count:
        raise ValueError(f"references from 1 to the {count} {things} before this line")
    return index - 1 if index > 0 else count + index
