"""The bytes that a glTF's views and images are: of the binary chunk, of files beside, of URIs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput, shortened
from storage.readers.gltf.compression import meshopt_bytes
from storage.readers.gltf.container import Container, data_of
from storage.readers.gltf.document import MESHOPT
from storage.readers.opening import check_file, whole_file
from storage.readers.references import file_beside, spellings

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:")
_LARGEST_IMAGE = 256 << 20
_DATA = "bytes in base64 or with percent signs: export it anew"


class Buffers:
    """The buffers, views and images of a document that was checked."""

    def __init__(self, file: Path, document: dict[str, Any], container: Container) -> None:
        self.file, self.document, self._container = file, document, container
        self._buffers: dict[int, memoryview] = {}
        self._unpacked: dict[int, memoryview] = {}

    def file_bytes(self) -> int:
        """Of the file and of the files beside it that its buffers are in."""
        beside = {self._beside(row) for row in range(len(self.document.get("buffers", ())))}
        sizes = (check_file(there, "a buffer of a glTF") for there in beside if there is not None)
        return self._container.file_bytes + sum(sizes)

    def view(self, number: int) -> memoryview:
        """The bytes of a bufferView, unpacked where meshopt packed them."""
        view = self.document["bufferViews"][number]
        extensions = view.get("extensions", {})
        packed = next((extensions[name] for name in MESHOPT if name in extensions), None)
        if packed is None:
            return self._slice(view, f"bufferViews[{number}]")
        if number not in self._unpacked:
            data = self._slice(packed, f"bufferViews[{number}]")
            self._unpacked[number] = meshopt_bytes(self.file, number, packed, data)
        return self._unpacked[number]

    def image(self, number: int) -> bytes:
        """The encoded picture of an image; raises BadInput where it is missing or damaged."""
        images, field = self.document.get("images"), f"images[{number}]"
        if not isinstance(images, list) or not 0 <= number < len(images):
            raise BadInput(self.file, field, "not in the file", "one of its images")
        image = images[number] if isinstance(images[number], dict) else {}
        uri, view = image.get("uri"), image.get("bufferView")
        if isinstance(uri, str):
            return bytes(self._by_uri(uri, field, _LARGEST_IMAGE))
        if type(view) is int and 0 <= view < len(self.document.get("bufferViews", ())):
            return bytes(self.view(view))
        raise BadInput(self.file, field, "without a picture", "a uri or a bufferView")

    def _slice(self, where: dict[str, Any], field: str) -> memoryview:
        data = self._buffer(where["buffer"])
        first = where.get("byteOffset", 0)
        last = first + where["byteLength"]
        if last > len(data):
            found = f"up to byte {last} of a buffer of {len(data)}"
            raise BadInput(self.file, field, found, "bytes that the buffer has: export it anew")
        return data[first:last]

    def _buffer(self, number: int) -> memoryview:
        if number not in self._buffers:
            uri, field = self.document["buffers"][number].get("uri"), f"buffers[{number}]"
            if uri is not None:
                self._buffers[number] = memoryview(self._by_uri(uri, field))
            elif number == 0 and self._container.binary is not None:
                self._buffers[number] = memoryview(self._container.binary)
            else:
                raise BadInput(self.file, field, "without bytes", "a uri or a GLB's binary chunk")
        return self._buffers[number]

    def _by_uri(self, uri: str, field: str, largest: int = 1 << 30) -> bytes:
        try:
            data = data_of(uri, self._container.embedded)
        except ValueError as error:
            raise BadInput(self.file, field, f"a data URI with {error}", _DATA) from None
        if data is not None:
            return data
        there = _found(self.file, uri)
        if there is None:
            name = shortened(uri)
            if _SCHEME.match(uri) and not re.match(r"[A-Za-z]:[\\/]|file:", uri):
                expected = "a file beside this one: load it down, or export as one .glb"
                raise BadInput(self.file, field, f"on the network ({name})", expected)
            expected = "that file beside this one: copy it along, or export as one .glb"
            raise BadInput(self.file, field, f"'{name}', which is missing", expected)
        return whole_file(there, f"the file of {field}", largest)

    def _beside(self, number: int) -> Path | None:
        uri = self.document["buffers"][number].get("uri")
        return None if uri is None or uri[:5].lower() == "data:" else _found(self.file, uri)


def _found(file: Path, uri: str) -> Path | None:
    """The file that a relative URI names; None where there is none."""
    if _SCHEME.match(uri) and not re.match(r"[A-Za-z]:[\\/]|file:", uri):
        return None
    places = (file_beside(file, name) for name in spellings(uri))
    return next((there for there in places if there is not None), None)
