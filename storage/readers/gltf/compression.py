"""Packed geometry, unpacked by its formats' own decoders: meshoptimizer's and Draco's."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput

_UNPACKED = "what its decoder can read: export it without compression, or anew"


def meshopt_bytes(file: Path, number: int, packed: dict[str, Any], data: memoryview) -> memoryview:
    """The bytes of a bufferView that meshopt packed: ``count`` elements of ``byteStride``.

    Raises BadInput for data that are damaged, and for modes and filters that the extension has not.
    """
    import meshopt

    mode, filter_ = packed.get("mode", "none"), packed.get("filter", "NONE")
    field = f"bufferViews[{number}]"
    if packed["count"] == 0:
        return memoryview(b"")
    try:
        unpacked = meshopt.decode_gltf_buffer(
            bytes(data), packed["count"], packed["byteStride"], mode, filter_
        )
    except (ValueError, RuntimeError, TypeError, OverflowError) as error:
        found = f"packed by meshopt and damaged ({error})"
        raise BadInput(file, field, found, _UNPACKED) from None
    return memoryview(unpacked.tobytes())


class DracoMesh(NamedTuple):
    """``triangles`` (T, 3) int64; ``attributes``, by their names in the glTF, (V, n) arrays of the
    types that Draco has them in."""

    triangles: NDArray[np.int64]
    attributes: dict[str, NDArray[Any]]


def draco_mesh(
    file: Path, data: memoryview, names: dict[str, int], most_triangles: int
) -> DracoMesh:
    """What Draco packed of a primitive; ``names``: the number in Draco of each attribute.

    Raises BadInput for data that are damaged, and for more triangles than ``most_triangles``.
    """
    import DracoPy

    field = "geometry packed by Draco"
    packed = bytes(data)
    try:
        announced = _announced_triangles(packed)
        if announced > most_triangles:
            expected = f"at most {most_triangles}, as its accessor says: export it anew"
            raise BadInput(file, field, f"of {announced} triangles", expected)
        mesh = DracoPy.decode(packed)
        triangles = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
        by_number = {entry["unique_id"]: np.asarray(entry["data"]) for entry in mesh.attributes}
    except BadInput:
        raise
    except Exception as error:  # DracoPy's own have no common base
        raise BadInput(file, field, f"damaged ({error})", _UNPACKED) from None
    missing = [name for name, row in names.items() if row not in by_number]
    if missing:
        raise BadInput(file, field, f"without {missing[0]}", "all attributes that it names")
    attributes = {name: by_number[row] for name, row in names.items()}
    return DracoMesh(triangles, {n: a.reshape(len(a), -1) for n, a in attributes.items()})


def _announced_triangles(packed: bytes) -> int:
    """How many triangles the head of Draco's data announces (its bitstream, 2.2), which is what
    the decoder takes memory for; raises ValueError and IndexError where it is broken."""
    at = 11

    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            byte = packed[at]
            at += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128 or shift > 63:
                return value

    def pass_metadata(depth: int = 0) -> None:
        nonlocal at
        if depth > 16:
            raise ValueError("metadata nested too deep")
        for _ in range(varint()):
            at += 1 + packed[at]  # a name
            at += varint()  # and its value
        for _ in range(varint()):
            at += 1 + packed[at]
            pass_metadata(depth + 1)

    if packed[:5] != b"DRACO" or packed[7] != 1:
        raise ValueError("no mesh of Draco's")
    if packed[10] & 128:
        for _ in range(varint()):
            varint()  # of which attribute
            pass_metadata()
        pass_metadata()
    if packed[8] == 1:  # edgebreaker: a byte of the way it goes, vertices, faces
        at += 1
        varint()
    return varint()
