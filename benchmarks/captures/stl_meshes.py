"""Meshes as STL files and of formats that are not read, written byte by byte."""

from __future__ import annotations

import gzip
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from benchmarks.captures.case import Case, Ending
from benchmarks.captures.mesh_truth import (
    SIDES,
    SOLID,
    has_triangles,
    packed,
    read_for_glass,
    text,
)
from storage.readers.meshes import read_mesh

_SOLID = has_triangles(SOLID, SIDES)


def _case(
    name: str,
    kind: str,
    write: Callable[[Path], object],
    ends: Ending = "read",
    says: Sequence[str] = (),
    read: Callable[[Path], Any] = read_mesh,
) -> Case:
    return Case(name, kind, read, ends, says, _SOLID if ends != "refused" else None, write)


_TRIANGLES = SOLID[SIDES].astype("<f4")
_STL = "solid a body\n" + "".join(
    "facet normal 0 0 0\n outer loop\n"
    + "".join(f"  vertex {x:e} {y:e} {z:e}\n" for x, y, z in corners)
    + " endloop\nendfacet\n"
    for corners in _TRIANGLES.tolist()
)


def _binary_stl(start: bytes = b"", attribute: int = 0) -> bytes:
    rows = (bytes(12) + one.tobytes() + struct.pack("<H", attribute) for one in _TRIANGLES)
    return start.ljust(80, b"\0") + struct.pack("<I", 10) + b"".join(rows)


STL_CASES = (
    _case("text.stl", "STL", text(_STL + "endsolid a body\n"), read=read_for_glass),
    _case("binary.stl", "STL", packed(_binary_stl()), read=read_for_glass),
    _case(
        "solid_but_binary.stl",
        "STL",
        packed(_binary_stl(b"solid by a program")),
        read=read_for_glass,
    ),
    _case(
        "two_solids.stl",
        "STL",
        text((_STL + "endsolid\n").replace("endfacet\n", "endfacet\nendsolid\nsolid b\n", 1)),
    ),
    _case(
        "coloured.stl",
        "STL",
        packed(_binary_stl(b"COLOR=\xff\0\0\xff", 0xFC00)),
        "told",
        ["Colours of its triangles are not used"],
    ),
    _case(
        "cut.stl",
        "missing rows",
        packed(_binary_stl()[:-20]),
        "refused",
        ["9 of 10 triangles", "export it again"],
    ),
)

OTHER_CASES = tuple(
    _case(name, "other formats", packed(start), "refused", [said, "export it as one"])
    for name, start, said in (
        ("fox.fbx", b"Kaydara FBX Binary  \0\x1a\0" + bytes(40), "FBX"),
        ("bunny.off", b"OFF\n6 8 0\n", "OFF"),
        ("part.step", b"ISO-10303-21;\nHEADER;\n", "STEP"),
        ("print.3mf", b"PK\3\4" + bytes(30), "ZIP"),
        ("bunny.ply.gz", gzip.compress(b"ply\n", mtime=0), "gzip"),
        ("scene.dae", b'<?xml version="1.0"?>\n<COLLADA xmlns="http://www">', "COLLADA"),
        ("room.blend", b"BLENDER-v402", "Blender"),
    )
)
