"""Cases of glTF: how its JSON and its bytes lie in files."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from benchmarks.captures.case import Case
from benchmarks.captures.gltf_writing import (
    PYRAMID,
    GltfWriter,
    are_triangles,
    glb,
    one_mesh,
    pyramid_at,
)
from storage.readers.meshes import MeshFile, read_mesh

_OCTETS = "data:application/octet-stream;base64,"


def is_the_pyramid(found: MeshFile) -> bool:
    """Where it was written, with all its sides the right way round."""
    return are_triangles(found.vertices[found.triangles], pyramid_at())


def _read(
    file: str, kind: str, write: Callable[[Path], object], *says: str, right: Any = is_the_pyramid
) -> Case:
    """A case that is read and gives the pyramid; with ``says``, told."""
    return Case(file, kind, read_mesh, "told" if says else "read", says, right, write)


def _refused(file: str, kind: str, write: Callable[[Path], object], *says: str) -> Case:
    return Case(file, kind, read_mesh, "refused", says, None, write)


def _bytes(data: bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(data)


# --- What is written ----------------------------------------------------------------------------


def _beside(uri: str, name: str) -> Callable[[Path], object]:
    """A .gltf that names its buffer by a URI, and the buffer by its name in the same folder."""

    def write(path: Path) -> None:
        made = one_mesh()
        made.document["buffers"] = [{"byteLength": len(made.binary), "uri": uri}]
        path.write_bytes(made.json())
        if name:
            (path.parent / name).parent.mkdir(exist_ok=True)
            (path.parent / name).write_bytes(made.binary)

    return write


def _with_uri(uri_of: Callable[[bytes], str], change: Callable[[bytes], bytes]) -> Any:
    """A .gltf with a URI of the buffer's bytes in its JSON, which is changed at last."""

    def write(path: Path) -> None:
        made = one_mesh()
        made.document["buffers"] = [{"byteLength": len(made.binary), "uri": uri_of(made.binary)}]
        path.write_bytes(change(made.json()))

    return write


def _same(data: bytes) -> bytes:
    return data


def _for_urls(binary: bytes) -> str:
    return _OCTETS + base64.urlsafe_b64encode(binary).decode().rstrip("=")


def _standard(binary: bytes) -> str:
    return _OCTETS + base64.b64encode(binary).decode()


def _escaped(text: bytes) -> bytes:
    """As writers for the web do."""
    return text.replace(b"/", rb"\/").replace(b"=", rb"\u003d")


def _spoilt(text: bytes) -> bytes:
    return text.replace(b"base64,AAAA", b"base64,A*AA")


def _glb_with(change: Callable[[bytes, bytes], bytes]) -> Callable[[Path], object]:
    """A GLB made of the JSON and of the bytes of the pyramid."""
    made = one_mesh()
    return _bytes(change(made.json(), made.binary))


def _zero_padded(text: bytes, binary: bytes) -> bytes:
    whole = glb(text + b" " * (-len(text) % 4) + b"\n   ", binary)
    return whole.replace(b"\n   ", bytes(4), 1)


def _without_padding(text: bytes, binary: bytes) -> bytes:
    text += b" " * (1 - len(text) % 4)  # no multiple of four
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _changed(change: Callable[[GltfWriter], object], **node: Any) -> Callable[[Path], object]:
    """The document of the pyramid, changed."""

    def write(path: Path) -> None:
        made = one_mesh(**node)
        change(made)
        made.write(path)

    return write


def _asset(**entries: Any) -> Callable[[GltfWriter], object]:
    return lambda made: made.document.update(asset=entries)


def _numbers_as_fractions(made: GltfWriter) -> None:
    for entry in (*made.document["accessors"], *made.document["bufferViews"]):
        entry.update({k: float(v) for k, v in entry.items() if isinstance(v, int)})


def _nulls(made: GltfWriter) -> None:
    made.document["nodes"][0] |= {"skin": None, "matrix": None, "children": None}
    made.document["meshes"][0]["primitives"][0] |= {"material": None, "targets": None}


def _old_document(path: Path) -> None:
    """glTF 1.0: dictionaries where 2.0 has lists."""
    entry = {"primitives": [{"attributes": {"POSITION": "a"}}]}
    path.write_text(json.dumps({"asset": {"version": "1.0"}, "meshes": {"m": entry}}))


def _short_view(made: GltfWriter) -> None:
    made.document["bufferViews"][0]["byteLength"] -= 4


def _buffer_without_end(path: Path) -> None:
    made = one_mesh()
    made.document["buffers"] = [{"byteLength": len(made.binary), "uri": "a.bin"}]
    path.write_bytes(made.json())
    (path.parent / "a.bin").write_bytes(made.binary[:-20])


def _buffer_not_pulled(path: Path) -> None:
    _beside("a.bin", "")(path)
    (path.parent / "a.bin").write_bytes(_POINTER)


def _two_buffers(path: Path) -> None:
    """A GLB whose corners are in its own chunk, and whose triangles are in a file beside."""
    made = one_mesh()
    first = made.document["bufferViews"][1]
    data = made.binary[first["byteOffset"] :]
    made.document["buffers"] = [
        {"byteLength": len(made.binary)}, {"byteLength": len(data), "uri": "more.bin"}
    ]  # fmt: skip
    first |= {"buffer": 1, "byteOffset": 0}
    (path.parent / "more.bin").write_bytes(data)
    path.write_bytes(glb(made.json(), made.binary[: PYRAMID.nbytes] + bytes(np.uint8(40))))


def _windows_names(text: bytes, binary: bytes) -> bytes:
    named = json.loads(text) | {"materials": [{"name": "Würfel"}]}
    return glb(json.dumps(named, ensure_ascii=False).encode("cp1252"), binary)


def _four_zeros(text: bytes, binary: bytes) -> bytes:
    return glb(text, binary + bytes(3), (b"ACME", b"of our own"))


def _cut(text: bytes, binary: bytes) -> bytes:
    return glb(text, binary)[:-30]


_POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0" * 64 + b"\nsize 9\n"
_PULL = "a pointer of Git LFS", "the file itself: run git lfs pull"

CONTAINERS: tuple[Case, ...] = (
    _read("gltf_plain.glb", "GLB", _glb_with(glb)),
    _read("gltf_own_chunks.glb", "GLB with chunks of its writer's", _glb_with(_four_zeros)),
    _read("gltf_zeros_behind_json.glb", "GLB padded otherwise", _glb_with(_zero_padded)),
    _read("gltf_chunks_not_padded.glb", "GLB padded otherwise", _glb_with(_without_padding)),
    _read("gltf_and_bin.glb", "GLB with a buffer beside", _two_buffers),
    _read("gltf_bin.gltf", "glTF with its buffer beside", _beside("cube.bin", "cube.bin")),
    _read("gltf_space.gltf", "names in URIs", _beside("my%20cube.bin", "my cube.bin")),
    _read("gltf_percent.gltf", "names in URIs", _beside("100%.bin", "100%.bin")),
    _read("gltf_umlaut.gltf", "names in URIs", _beside(quote("Würfel.bin"), "Würfel.bin")),
    _read("gltf_backslash.gltf", "names in URIs", _beside("parts\\a.bin", "parts/a.bin")),
    _read("gltf_other_folder.gltf", "names in URIs", _beside("C:/models/a.bin", "a.bin")),
    _read("gltf_embedded.gltf", "data URIs", _with_uri(_standard, _same)),
    _read("gltf_url_base64.gltf", "data URIs", _with_uri(_for_urls, _same)),
    _read("gltf_escaped.gltf", "data URIs", _with_uri(_standard, _escaped)),
    _read("gltf_percents.gltf", "data URIs", _with_uri(lambda b: "data:," + quote(b), _same)),
    _read("gltf_bom.gltf", "JSON of other writers", _with_uri(_standard, b"\xef\xbb\xbf".__add__)),
    _read("gltf_fractions.gltf", "JSON of other writers", _changed(_numbers_as_fractions)),
    _read("gltf_nulls.gltf", "JSON of other writers", _changed(_nulls)),
    _read("gltf_cp1252.glb", "JSON of other writers", _glb_with(_windows_names)),
    _read("gltf_2_1.glb", "later versions of glTF", _changed(_asset(version="2.1"))),
    _refused(
        "gltf_needs_2_1.glb", "later versions of glTF",
        _changed(_asset(version="2.1", minVersion="2.1")), "minVersion is 2.1", "export it as",
    ),
    _refused("gltf_1.gltf", "glTF 1.0", _old_document, "version is 1.0", "gltf-pipeline makes 2.0"),
    _refused(
        "gltf_1.glb", "glTF 1.0", _bytes(struct.pack("<4sII", b"glTF", 1, 20) + bytes(8)),
        "version is 1", "gltf-pipeline makes",
    ),
    _refused(
        "gltf_bin_missing.gltf", "buffers that are missing", _beside("cube.bin", ""),
        "'cube.bin', which is missing", "copy it along, or export as one .glb",
    ),
    _refused(
        "gltf_on_the_net.gltf", "buffers that are missing", _beside("https://a.b/cube.bin", ""),
        "on the network", "load it down, or export as one .glb",
    ),
    _refused(
        "gltf_bin_cut.gltf", "truncated glTF", _buffer_without_end,
        "of a buffer of", "export it anew",
    ),
    _refused("gltf_cut.glb", "truncated glTF", _glb_with(_cut), "truncated", "load it down"),
    _refused(
        "gltf_short_view.glb", "truncated glTF", _changed(_short_view), "accessors.0.",
        "beyond the 56 bytes", "export it anew",
    ),
    _refused(
        "gltf_broken_base64.gltf", "data URIs", _with_uri(_standard, _spoilt),
        "no base64", "export it anew",
    ),
    _refused("gltf_of_text.gltf", "no glTF", _bytes(b"<html>404 Not Found"), "JSON", "anew"),
    _refused("gltf_lfs.glb", "pointers of Git LFS", _bytes(_POINTER), *_PULL),
    _refused("gltf_lfs_bin.gltf", "pointers of Git LFS", _buffer_not_pulled, *_PULL),
)  # fmt: skip
"""What follows are kinds of numbers and of scenes: `gltf_geometry`, `gltf_scenes`."""
