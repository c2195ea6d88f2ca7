"""Packages read back, by the page alone: no code of the writer's is used.

Everything is checked before it is believed: names, sizes, hashes, types and shapes. What a package
announces is never taken as memory before its file stands for it.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
import zlib
from os import PathLike
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from storage.packages.schema import Mesh
from storage.readers.bad_input import BadInput, shortened

if TYPE_CHECKING:
    from numpy.typing import NDArray

NEWEST_FORMAT = 1
LARGEST_META = 16 << 20
"""Bytes of `meta.json`."""
LARGEST_PART = 1 << 30
"""Bytes of a part, unpacked."""
MOST_UNFOLDED = 1100
"""Times a part may be larger than what is stored of it: deflate cannot do more."""
_GONE = "the whole package: export or download it again"
_ARRAY_TYPES = frozenset(
    ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float16", "float32")
)
_KINDS = frozenset(("array", "picture", "textures", "mesh"))
_FIELDS: tuple[tuple[str, type], ...] = (
    ("system", str),
    ("schema", int),
    ("title", str),
    ("parameters", dict),
    ("parts", dict),
    ("views", list),
    ("figures", list),
    ("lineage", list),
    ("source", list),
)


class Package:
    """An open package: what `meta.json` says, and its parts, each read when it is asked for."""

    def __init__(self, archive: zipfile.ZipFile, name: str, meta: dict[str, Any]) -> None:
        self._archive = archive
        self.name = name
        """Of the file."""
        self.meta = meta
        """`meta.json`."""

    @property
    def system(self) -> str:
        """The system that made it."""
        return str(self.meta["system"])

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of all parts."""
        return tuple(self.meta["parts"])

    def parameter(self, name: str) -> Any:
        """A parameter's value. Raises BadInput where there is none."""
        try:
            return self.meta["parameters"][name]["value"]
        except (KeyError, TypeError):
            raise self._bad(f"parameter {name}", "missing", _GONE) from None

    def whole(self) -> bytes:
        """The bytes of the whole package."""
        stream = self._archive.fp
        assert stream is not None
        stream.seek(0)
        return stream.read()

    def content(self, name: str) -> bytes:
        """The bytes of a part's file. Raises BadInput where they are not what was written."""
        part = self._part(name)
        content = _unpacked(self._archive, str(part["file"]), self.name, LARGEST_PART)
        found = hashlib.sha256(content).hexdigest()
        if found != part.get("sha256"):
            raise self._bad(f"part {name}", "not what its hash says", _GONE)
        return content

    def array(self, name: str) -> NDArray[Any]:
        """An array part. Raises BadInput."""
        import numpy as np

        part = self._part(name, "array")
        dtype, shape = self._type(name, part), self._shape(name, part)
        content = self.content(name)
        if len(content) != dtype.itemsize * math.prod(shape):
            raise self._bad(f"part {name}", f"{len(content)} bytes", f"{dtype} {shape}")
        return np.frombuffer(content, dtype).reshape(shape).astype(dtype.newbyteorder("="))

    def picture(self, name: str) -> NDArray[Any]:
        """A picture part (y, x, channel), uint8 or uint16. Raises BadInput."""
        from storage.packages.reading_binary import png_codes

        part = self._part(name, "picture")
        shape = self._shape(name, part)
        content = self.content(name)
        try:
            codes = png_codes(content, deep=part.get("dtype") == "uint16")
        except ValueError as error:
            raise self._bad(f"part {name}", str(error), _GONE) from None
        return self._as_said(name, part, codes, shape)

    def textures(self, name: str) -> NDArray[Any]:
        """A textures part (layer, y, x, channel). Raises BadInput."""
        from storage.packages.reading_binary import ktx2_layers

        part = self._part(name, "textures")
        shape, content = self._shape(name, part), self.content(name)
        try:
            layers = ktx2_layers(content)
        except ValueError as error:
            raise self._bad(f"part {name}", str(error), _GONE) from None
        return self._as_said(name, part, layers, shape)

    def mesh(self, name: str) -> Mesh:
        """A mesh part, z up. Raises BadInput."""
        from storage.packages.reading_binary import glb_arrays

        self._part(name, "mesh")
        content = self.content(name)
        try:
            arrays = glb_arrays(content)
        except ValueError as error:
            raise self._bad(f"part {name}", str(error), _GONE) from None
        uvs = arrays.pop("TEXCOORD_0", None)
        if uvs is not None:
            uvs = uvs.copy()
            uvs[:, 1] = 1 - uvs[:, 1]
        return Mesh(
            arrays.pop("POSITION"),
            arrays.pop("indices").reshape(-1, 3),
            arrays.pop("NORMAL", None),
            uvs,
            {key.removeprefix("_"): values for key, values in arrays.items()},
        )

    def value(self, name: str) -> Any:
        """A part's array, or its mesh. Raises BadInput."""
        read = {
            "array": self.array,
            "picture": self.picture,
            "textures": self.textures,
            "mesh": self.mesh,
        }
        return read[self._part(name)["kind"]](name)

    def _part(self, name: str, kind: str | None = None) -> dict[str, Any]:
        part: dict[str, Any] | None = self.meta["parts"].get(name)
        if part is None:
            raise self._bad(f"part {name}", "missing", _GONE)
        if kind is not None and part["kind"] != kind:
            raise self._bad(f"part {name}", f"of kind {part['kind']}", kind)
        return part

    def _type(self, name: str, part: dict[str, Any]) -> Any:
        import numpy as np

        if str(part.get("dtype")) not in _ARRAY_TYPES:
            raise self._bad(f"dtype of {name}", str(part.get("dtype")), ", ".join(_ARRAY_TYPES))
        return np.dtype(part["dtype"]).newbyteorder("<")

    def _shape(self, name: str, part: dict[str, Any]) -> tuple[int, ...]:
        shape = part.get("shape")
        is_shape = isinstance(shape, list) and all(
            type(side) is int and 0 <= side < 1 << 31 for side in shape
        )
        if not is_shape:
            raise self._bad(f"shape of {name}", str(shape), "whole numbers")
        assert isinstance(shape, list)
        return tuple(shape)

    def _as_said(
        self, name: str, part: dict[str, Any], found: NDArray[Any], shape: tuple[int, ...]
    ) -> NDArray[Any]:
        if found.shape != shape or str(found.dtype) != part.get("dtype"):
            said = f"{part.get('dtype')} {shape}, as meta.json says"
            raise self._bad(f"part {name}", f"{found.dtype} {found.shape}", said)
        return found

    def _bad(self, field: str, found: str, expected: str) -> BadInput:
        return BadInput(self.name, field, found, expected)


def read_package(source: bytes | str | PathLike[str], name: str = "package") -> Package:
    """Open a package: a path, or its bytes, which ``name`` names in errors.

    Raises BadInput for a file that is no package, is cut or altered, is of a newer format, or
    announces names or sizes that no package has. Parts are checked when they are read.
    """
    if not isinstance(source, bytes):
        from storage.readers.opening import check_file

        name = str(source)
        check_file(source, "a .tsuya package", largest=None)
    try:
        archive = zipfile.ZipFile(io.BytesIO(source) if isinstance(source, bytes) else source)
    except (zipfile.BadZipFile, ValueError, RuntimeError, OSError):
        raise BadInput(name, "file", "no whole zip", "a .tsuya package, complete") from None
    meta = _meta(archive, name)
    _check_files(archive, meta, name)
    return Package(archive, name, meta)


def _meta(archive: zipfile.ZipFile, name: str) -> dict[str, Any]:
    content = _unpacked(archive, "meta.json", name, LARGEST_META)
    try:
        meta = json.loads(content)
    except (ValueError, RecursionError):
        raise BadInput(name, "meta.json", "no JSON", _GONE) from None
    if not isinstance(meta, dict) or type(meta.get("format")) is not int:
        raise BadInput(name, "meta.json", "without a format", _GONE)
    if meta["format"] > NEWEST_FORMAT:
        expected = f"at most {NEWEST_FORMAT}: update Tsuya, or export the package again"
        raise BadInput(name, "format", str(meta["format"]), expected)
    for field, kind in _FIELDS:
        if type(meta.get(field)) is not kind:
            raise BadInput(name, field, shortened(str(meta.get(field))), f"a {kind.__name__}")
    return meta


def _check_files(archive: zipfile.ZipFile, meta: dict[str, Any], name: str) -> None:
    stored = {entry.filename: entry for entry in archive.infolist()}
    for part_name, part in meta["parts"].items():
        field = f"part {part_name}"
        if not isinstance(part, dict) or str(part.get("kind")) not in _KINDS:
            raise BadInput(name, field, "of no known kind", ", ".join(sorted(_KINDS)))
        file = part.get("file")
        if not isinstance(file, str) or not _is_plain(file):
            raise BadInput(name, field, f"in {file!r}", "a path inside the package")
        if file not in stored:
            raise BadInput(name, field, "missing", _GONE)
        if stored[file].file_size != part.get("bytes"):
            found = f"{stored[file].file_size} bytes"
            raise BadInput(name, field, found, f"{part.get('bytes')}, as meta.json says")


def _is_plain(file: str) -> bool:
    path = PurePosixPath(file)
    return bool(file) and not (
        path.is_absolute() or ".." in path.parts or "\\" in file or ":" in file or "\0" in file
    )


def _unpacked(archive: zipfile.ZipFile, file: str, name: str, largest: int) -> bytes:
    """An entry's bytes. Raises BadInput."""
    try:
        entry = archive.getinfo(file)
    except KeyError:
        raise BadInput(name, file, "missing", "a .tsuya package") from None
    allowed = min(largest, MOST_UNFOLDED * max(entry.compress_size, 1))
    if entry.file_size > allowed:
        raise BadInput(name, file, f"{entry.file_size} bytes", f"at most {allowed} bytes")
    try:
        with archive.open(entry) as stream:
            content = stream.read(entry.file_size + 1)
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, ValueError):
        # RuntimeError: a password is wanted, a method is not known; ValueError: a name is no text
        raise BadInput(name, file, "damaged", _GONE) from None
    if len(content) != entry.file_size:
        raise BadInput(name, file, "longer than announced", _GONE)
    return content
