"""The arrays in a package's .glb, .ktx2 and .png files, by the specifications of these."""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_COMPONENTS = {5126: "<f4", 5125: "<u4"}
_PNG = b"\x89PNG\r\n\x1a\n"
_KTX2 = bytes((0xAB, 0x4B, 0x54, 0x58, 0x20, 0x32, 0x30, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A))
_VULKAN = {
    first + 7 * channels: (dtype, channels + 1)
    for first, dtype in ((9, "u1"), (70, "<u2"), (76, "<f2"))
    for channels in range(3)
}
_VULKAN |= {37: ("u1", 4), 91: ("<u2", 4), 97: ("<f2", 4)}
_VULKAN |= {100 + 3 * channels: ("<f4", channels + 1) for channels in range(4)}


def png_codes(content: bytes, *, deep: bool) -> NDArray[Any]:
    """The codes (y, x, channel) of a PNG: uint8, or uint16 if ``deep``.

    Raises ValueError, a few words, for what is no PNG of that depth.
    """
    import io

    import cv2
    import numpy as np
    from PIL import Image

    if content[:8] != _PNG:
        raise ValueError("no PNG")
    if deep:
        # Pillow reads 16 bits of one channel alone.
        found: Any = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        if found is None:
            raise ValueError("no whole PNG")
        codes = found if found.ndim == 3 else found[..., None]
        return np.ascontiguousarray(
            codes[..., {1: [0], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[codes.shape[2]]]
        )
    try:
        with Image.open(io.BytesIO(content), formats=["PNG"]) as picture:
            picture.load()
            codes = np.asarray(picture)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        raise ValueError("no whole PNG") from None
    return codes if codes.ndim == 3 else codes[..., None]


def glb_arrays(content: bytes) -> dict[str, NDArray[Any]]:
    """Vertex attributes by name, and `indices`, of a .glb with one primitive.

    Raises ValueError, a few words, for anything else.
    """
    document, binary = _chunks(content)
    try:
        (mesh,) = document["meshes"]
        (primitive,) = mesh["primitives"]
        named = {**primitive["attributes"], "indices": primitive["indices"]}
        arrays = {str(name): _accessor(document, binary, number) for name, number in named.items()}
        vertices = len(arrays["POSITION"])
        lengths = {len(values) for name, values in arrays.items() if name != "indices"}
        if lengths != {vertices} or arrays["POSITION"].shape != (vertices, 3):
            raise ValueError("attributes of several lengths")
        if len(arrays["indices"]) % 3 or (
            len(arrays["indices"]) and int(arrays["indices"].max()) >= vertices
        ):
            raise ValueError("triangles of vertices that are not there")
    except (KeyError, TypeError, IndexError, AttributeError):
        raise ValueError("no mesh of one primitive") from None
    return arrays


def _chunks(content: bytes) -> tuple[dict[str, Any], bytes]:
    if len(content) < 20 or content[:4] != b"glTF":
        raise ValueError("no .glb")
    version, total, text_bytes = struct.unpack_from("<3I", content, 4)
    if version != 2 or total != len(content) or content[16:20] != b"JSON":
        raise ValueError("no .glb of version 2")
    binary_at = 20 + text_bytes + 8
    if binary_at > total:
        raise ValueError("a .glb without its binary chunk")
    try:
        document = json.loads(content[20 : 20 + text_bytes])
    except (ValueError, RecursionError):
        raise ValueError("a .glb whose JSON is damaged") from None
    if not isinstance(document, dict):
        raise ValueError("a .glb whose JSON is no object")
    return document, content[binary_at:]


def _accessor(document: dict[str, Any], binary: bytes, number: int) -> NDArray[Any]:
    import numpy as np

    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    dtype = _COMPONENTS.get(accessor["componentType"])
    width, count = _WIDTHS[accessor["type"]], int(accessor["count"])
    if dtype is None or count < 0:
        raise ValueError("an accessor of another type than float or unsigned int")
    start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    if start < 0 or start + count * width * 4 > len(binary):
        raise ValueError("an accessor beyond its buffer")
    values = np.frombuffer(binary, dtype, count * width, start)
    shaped = values.reshape(count, width) if width > 1 else values
    return shaped.astype(np.dtype(dtype).newbyteorder("="))


def ktx2_layers(content: bytes) -> NDArray[Any]:
    """The layers (layer, y, x, channel) of a .ktx2 of one level that is not compressed.

    Raises ValueError, a few words, for anything else.
    """
    import numpy as np

    if len(content) < 104 or content[:12] != _KTX2:
        raise ValueError("no KTX 2")
    number, _, width, height, depth, layers, faces, levels, scheme = struct.unpack_from(
        "<9I", content, 12
    )
    if number not in _VULKAN or depth or faces != 1 or levels != 1 or scheme:
        raise ValueError("a KTX 2 of a kind that packages do not hold")
    start, length, _ = struct.unpack_from("<3Q", content, 80)
    dtype, channels = _VULKAN[number]
    shape = (max(layers, 1), height, width, channels)
    needed = shape[0] * height * width * channels * np.dtype(dtype).itemsize
    if length != needed or start + length > len(content):
        raise ValueError("a KTX 2 whose texels are not all there")
    values = np.frombuffer(content, dtype, needed // np.dtype(dtype).itemsize, start)
    return values.reshape(shape).astype(np.dtype(dtype).newbyteorder("="))
