"""What a file refers to and cannot do without: an OBJ's material libraries, a glTF's buffers.

References are resolved as the reader of scenes does: from the folder of the file that has them,
else beside it by their last name, as files travel without their folders. One that is absolute, or
leads upwards, is followed where there is such a file.
"""

from __future__ import annotations

import functools
import os
import re
from collections.abc import Iterator
from os import PathLike
from pathlib import Path

from storage.readers.bad_input import BadInput
from storage.readers.films import SUFFIXES as FILM_SUFFIXES
from storage.readers.references import file_beside, spellings

_TEXTURES = re.compile(r"(map_\w+|bump|disp|decal|refl|norm)", re.IGNORECASE)
_GLTF = (".gltf", ".glb")
_ENDINGS = (".obj", ".mtl", ".ply", *_GLTF)
_LONGEST_HEADER = 1 << 20
"""Bytes of a PLY's header, at most."""


def companions(path: str | PathLike[str]) -> list[Path]:
    """The files that a file refers to, and those that these refer to: those that are there.

    OBJ: the files of its ``mtllib`` lines, and the textures (``map_Kd`` …) that these name; PLY:
    what ``comment TextureFile`` names; glTF and GLB: the files of buffers and images; a film: the
    GPX track of its name beside it; of other formats none. Absolute paths, each once, in the order
    of reference. Raises nothing: what is missing or cannot be read is the reader's to judge.

    >>> companions("nobody.obj")
    []
    """
    file = Path(os.path.abspath(path))
    found: dict[Path, None] = {}
    for companion in _referred(file, file.suffix.lower()):
        found |= {companion: None}
        if file.suffix.lower() == ".obj":
            found |= dict.fromkeys(_referred(companion, ".mtl"))
    found.pop(file, None)
    return list(found)


def travel_name(file: Path, companion: Path) -> str:
    """Where a companion is to lie, from the folder of the file, so that a copy finds it.

    One from outside of that folder lies beside the file, where readers look, too.
    """
    folder = os.path.abspath(file.parent)
    relative = os.path.relpath(companion, folder)
    return companion.name if relative.startswith(os.pardir) else Path(relative).as_posix()


def _referred(file: Path, ending: str) -> list[Path]:
    """The files that a file itself names and that are there; of a film its track."""
    if ending in FILM_SUFFIXES:
        track = file.with_suffix(".gpx")
        return [track] if os.path.isfile(track) else []
    if ending not in _ENDINGS or not os.path.isfile(file):  # a pipe would block
        return []
    try:
        status = file.stat()
        lines = _references(file, ending, status.st_size, status.st_mtime_ns)
    except (OSError, BadInput):
        return []
    if ending in _GLTF:
        uris = [map(functools.partial(file_beside, file), spellings(uri)) for (uri,) in lines]
        return [there for places in uris for there in places if there is not None]
    return [found for words in lines for found in _located(file, words, several=ending == ".obj")]


@functools.lru_cache(maxsize=256)
def _references(file: Path, ending: str, size: int, changed: int) -> list[tuple[str, ...]]:
    """The words of each line that refers to files; read once for each state of the file."""
    if ending in _GLTF:
        from storage.readers.gltf.container import referred_uris  # brings numpy

        return [(uri,) for uri in referred_uris(file)]
    if ending == ".ply":
        with file.open("rb") as stream:
            header = stream.read(_LONGEST_HEADER).partition(b"end_header")[0]
        words = [line.split() for line in header.decode("utf-8", errors="replace").splitlines()]
        return [tuple(line[2:]) for line in words if line[:2] == ["comment", "TextureFile"]]
    if ending == ".mtl":
        text = file.read_text(encoding="utf-8-sig", errors="replace")
        words = [line.split() for line in text.splitlines()]
        return [tuple(line[1:]) for line in words if line and _TEXTURES.fullmatch(line[0])]
    words = [line.split() for line in _lines_with(file.read_bytes(), b"mtllib")]
    return [tuple(line[1:]) for line in words if line[:1] == ["mtllib"]]


def _lines_with(data: bytes, word: bytes) -> Iterator[str]:
    """The lines that have a word, continued ones as one: the other millions are not looked at."""
    at = data.find(word)
    while at >= 0:
        end = data.find(b"\n", at)
        while end >= 0 and data[at:end].rstrip(b"\r").endswith(b"\\"):
            end = data.find(b"\n", end + 1)
        end = len(data) if end < 0 else end
        text = data[data.rfind(b"\n", 0, at) + 1 : end].decode("utf-8", errors="replace")
        yield from text.replace("\r\n", "\n").replace("\\\n", " ").splitlines()
        at = data.find(word, end)


def _located(file: Path, words: tuple[str, ...], *, several: bool) -> list[Path]:
    """The files that a line names: one whose name may have spaces; else ``several``, apart by
    spaces, or one behind options (``-s 1 1 1``)."""
    for name in (" ".join(words), " ".join(words).strip("\"'")):  # some write it in quotes
        whole = file_beside(file, name)
        if whole is not None:
            return [whole]
    if several:
        return [there for word in words if (there := file_beside(file, word)) is not None]
    ends = (" ".join(words[start:]).strip("\"'") for start in range(1, len(words)))
    tails = (file_beside(file, name) for name in ends)
    return [there for there in tails if there is not None][:1]
