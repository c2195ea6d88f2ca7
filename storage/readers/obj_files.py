"""Wavefront OBJ: positions, texture coordinates and polygons.

Read here and not by trimesh: it takes indices counted from the end of the list so far as
counted from the end of the file, and cuts every vertex short where one line is (both seen).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from storage.readers.bad_input import BadInput
from storage.readers.polygons import PolygonMesh


def read_obj(file: Path) -> PolygonMesh:
    """Read ``v``, ``vt`` and ``f`` of an OBJ file; all objects and groups go into one mesh.

    Texture coordinates count from the bottom left; they are None unless every corner has one.
    Raises BadInput, naming the line, for numbers that are missing or no numbers, and for
    references to vertices that do not exist.
    """
    positions: list[Sequence[float]] = []
    uvs: list[Sequence[float]] = []
    sizes: list[int] = []
    corners: list[int] = []
    corner_uvs: list[int | None] = []
    text = file.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        keyword, *words = line.split("#", 1)[0].split() or [""]
        try:
            if keyword == "v":
                positions.append(_numbers(words, 3))
            elif keyword == "vt":
                uvs.append(_numbers([*words, "0"][: max(len(words), 2)], 2))
            elif keyword == "f":
                if len(words) < 3:
                    raise ValueError("at least three corners")
                sizes.append(len(words))
                for word in words:
                    corner, uv = _corner(word, len(positions), len(uvs))
                    corners.append(corner)
                    corner_uvs.append(uv)
        except ValueError as error:
            shown = line.strip()[:60]
            raise BadInput(file, f"line {number}", f"'{shown}'", str(error)) from None
    mapped = [uv for uv in corner_uvs if uv is not None]
    complete = len(mapped) == len(corners) > 0
    return PolygonMesh(
        np.array(positions, np.float64).reshape(-1, 3),
        np.array(sizes, np.int64),
        np.array(corners, np.int64),
        np.array(uvs, np.float64)[mapped] if complete else None,
    )


def _numbers(words: list[str], count: int) -> list[float]:
    """The first numbers of a line: weights and vertex colours may follow."""
    try:
        numbers = [float(word) for word in words[:count]]
    except ValueError:
        numbers = []
    if len(numbers) < count:
        raise ValueError(f"{count} numbers")
    return numbers


def _corner(word: str, positions: int, uvs: int) -> tuple[int, int | None]:
    """``position``, ``position/uv``, ``position//normal`` or ``position/uv/normal``."""
    position, *others = word.split("/")
    uv = others[0] if others else ""
    return _index(position, positions, "vertices"), (
        _index(uv, uvs, "texture coordinates") if uv else None
    )


def _index(word: str, count: int, things: str) -> int:
    """From 1 for the first, or from -1 for the last one so far; as an index from 0."""
    try:
        number = int(word)
    except ValueError:
        number = 0
    if number == 0 or not -count <= number <= count:
        raise ValueError(f"references from 1 to the {count} {things} before this line")
    return number - 1 if number > 0 else count + number
