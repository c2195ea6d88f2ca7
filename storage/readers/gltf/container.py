"""The JSON of a glTF file and its binary chunk: a GLB's chunks, or plain text."""

from __future__ import annotations

import base64
import binascii
import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote_to_bytes

from storage.readers.bad_input import BadInput
from storage.readers.opening import parsed_json, whole_file

_EMBEDDED = re.compile(rb'"data:[^",]{0,200};base64,[^"]{200,}"')
_PLACEHOLDER = "data:embedded,"
_WHOLE = "a complete glTF 2.0 file: export it, or load it down, anew"


class Container(NamedTuple):
    """``description``, the file's JSON, not checked; ``binary``, a GLB's second chunk, or None;
    ``embedded``, long data URIs, in whose place the JSON has short ones; ``file_bytes``."""

    description: Any
    binary: bytes | None
    embedded: tuple[bytes, ...]
    file_bytes: int


def opened(file: Path) -> Container:
    """Take a .glb or a .gltf file apart.

    Raises BadInput for a file that is truncated or damaged, and for a GLB of another version.
    """
    data = whole_file(file, "a glTF 2.0 file")
    text, binary = _chunks(file, data) if data[:4] == b"glTF" else (data, None)
    embedded: list[bytes] = []

    def set_aside(match: re.Match[bytes]) -> bytes:
        embedded.append(match[0])
        return f'"{_PLACEHOLDER}{len(embedded) - 1}"'.encode()

    text = _EMBEDDED.sub(set_aside, text)  # whole meshes and pictures, a hundred times the JSON
    text = text.rstrip(b"\0 ")
    try:
        description = _parsed(text)
    except ValueError as error:
        raise BadInput(file, "content", f"damaged JSON ({error})", _WHOLE) from None
    return Container(description, binary, tuple(embedded), len(data))


def _parsed(text: bytes) -> Any:
    try:
        return parsed_json(text)
    except UnicodeDecodeError:  # names in the encoding of a writer's Windows
        return parsed_json(text.decode("cp1252", "replace").encode())


def _chunks(file: Path, data: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a GLB (glTF 2.0, 4.4); other chunks are passed over."""
    try:
        version, length = struct.unpack_from("<4xII", data)
    except struct.error:
        raise BadInput(file, "content", "truncated in its header", _WHOLE) from None
    if version != 2:
        expected = "2 (convert it: gltf-pipeline makes glTF 2.0 of 1.0)"
        raise BadInput(file, "glTF version", f"{version}", expected)
    if length > len(data):
        found = f"truncated: {len(data)} bytes of {length}"
        raise BadInput(file, "content", found, _WHOLE)
    found_chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(data) and len(found_chunks) < 2:
        size, kind = struct.unpack_from("<I4s", data, at)
        if kind in (b"JSON", b"BIN\0"):
            if at + 8 + size > len(data):
                raise BadInput(file, "content", "truncated in a chunk", _WHOLE)
            found_chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if b"JSON" not in found_chunks:
        raise BadInput(file, "content", "without a chunk of JSON", _WHOLE)
    return found_chunks[b"JSON"], found_chunks.get(b"BIN\0")


# --- URIs ---------------------------------------------------------------------------------------


def data_of(uri: str, embedded: tuple[bytes, ...]) -> bytes | None:
    """The bytes of a data URI, base64 (standard or for URLs, padded or not) or percent-encoded;
    None for a URI of another kind. Raises ValueError where it is broken."""
    if uri.startswith(_PLACEHOLDER):
        number = uri.removeprefix(_PLACEHOLDER)
        if not re.fullmatch("[0-9]{1,9}", number) or int(number) >= len(embedded):
            raise ValueError("no data")
        quoted = embedded[int(number)]
        if b"\\" not in quoted:
            return _from_base64(quoted[1:-1].partition(b",")[2])
        uri = json.loads(quoted)  # writers for the web escape the slash and the equals sign
    if uri[:5].lower() != "data:":
        return None
    head, comma, body = uri.partition(",")
    if not comma:
        raise ValueError("no data")
    return _from_base64(body.encode()) if ";base64" in head.lower() else unquote_to_bytes(body)


def _from_base64(text: bytes) -> bytes:
    text = unquote_to_bytes(text) if b"%" in text else text
    plain = text.translate(bytes.maketrans(b"-_", b"+/"), b" \t\r\n=")
    try:
        return base64.b64decode(plain + b"=" * (-len(plain) % 4), validate=True)
    except binascii.Error:
        raise ValueError("no base64") from None


def referred_uris(file: Path) -> list[str]:
    """The URIs of a file's buffers and images that are no data; raises BadInput as `opened`."""
    return list(dict.fromkeys(_uris(opened(file).description)))


def _uris(description: Any) -> Iterator[str]:
    for kind in ("buffers", "images"):
        entries = description.get(kind) if isinstance(description, dict) else None
        for entry in entries if isinstance(entries, list) else ():
            uri = entry.get("uri") if isinstance(entry, dict) else None
            if isinstance(uri, str) and uri[:5].lower() != "data:":
                yield uri
