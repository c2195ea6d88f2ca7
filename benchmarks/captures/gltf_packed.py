"""Cases of glTF: geometry as integers, and packed by Draco and meshopt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.captures.case import Case
from benchmarks.captures.gltf_geometry import (
    UVS,
    built,
    built_refused,
    has_uvs,
    is_stored,
    one_node,
)
from benchmarks.captures.gltf_writing import PYRAMID, SIDES, GltfWriter
from storage.readers.meshes import read_mesh

_UP_TO_ONE = {"normalized": True}


def _quantised(kind: str, divisor: float, **entry: Any) -> Callable[[GltfWriter], object]:
    """KHR_mesh_quantization: integers, with a node that makes them as large as they were."""

    def build(made: GltfWriter) -> None:
        stored = np.zeros((5, 4), kind)  # a fourth makes a row a multiple of four bytes
        stored[:, :3] = np.round(PYRAMID * 20)
        stride = stored.itemsize * 4
        view = made.view(stored.tobytes(), byteStride=stride)
        primitive = made.primitive()
        position = made.accessor(stored[:, :3], bufferView=view, **entry)
        primitive["attributes"]["POSITION"] = position
        one_node(made, primitive)
        made.document["nodes"][0]["scale"] = [divisor / 20] * 3
        made.document |= {"extensionsRequired": ["KHR_mesh_quantization"]}

    return build


def _packed_uvs(made: GltfWriter) -> None:
    """Texture coordinates of 12 bits, which a texture's transform makes as large as they were."""
    uv = made.accessor(np.round(UVS * 4096).astype(np.uint16), **_UP_TO_ONE)
    transform = {"KHR_texture_transform": {"scale": [65535 / 4096] * 2, "offset": [0.5, 0.25]}}
    texture = {"index": 0, "extensions": transform}
    made.add("materials", pbrMetallicRoughness={"baseColorTexture": texture})
    one_node(made, made.primitive(TEXCOORD_0=uv) | {"material": 0})


def _draco(made: GltfWriter) -> None:
    import DracoPy

    packed = DracoPy.encode(
        PYRAMID, SIDES.astype(np.uint32), quantization_bits=0, tex_coord=UVS.astype(np.float64)
    )
    by_kind = {
        each["attribute_type"]: each["unique_id"] for each in DracoPy.decode(packed).attributes
    }
    entry = {
        "bufferView": made.view(packed),
        "attributes": {"POSITION": by_kind[0], "TEXCOORD_0": by_kind[3]},
    }
    nothing: dict[str, Any] = {"bufferView": None}
    attributes = {
        "POSITION": made.accessor(PYRAMID, **nothing),
        "TEXCOORD_0": made.accessor(UVS, **nothing),
    }
    indices = made.accessor(SIDES.reshape(-1), **nothing)
    extensions = {"KHR_draco_mesh_compression": entry}
    one_node(made, {"attributes": attributes, "indices": indices, "extensions": extensions})
    made.document |= {"extensionsRequired": ["KHR_draco_mesh_compression"]}


def _draco_spoilt(made: GltfWriter) -> None:
    _draco(made)
    made.binary = made.binary[:12] + bytes(len(made.binary) - 12)


def _meshopt(name: str, version: int, mode: str) -> Callable[[GltfWriter], object]:
    """Corners packed as attributes, indices as triangles or as a sequence, in a second buffer."""
    import meshopt

    def build(made: GltfWriter) -> None:
        primitive = made.primitive()
        packed = [
            (meshopt.encode_gltf_buffer(PYRAMID, "ATTRIBUTES", version), 5, 12, "ATTRIBUTES"),
            (meshopt.encode_gltf_buffer(SIDES.reshape(-1), mode), 18, 2, mode),
        ]
        _packed_views(made, name, packed)
        one_node(made, primitive)

    return build


def _meshopt_filtered(made: GltfWriter) -> None:
    """Positions as mantissas of 15 bits with exponents."""
    import meshopt

    primitive = made.primitive()
    filtered = meshopt.encode_filter_exp(PYRAMID, 15)
    data = meshopt.encode_gltf_buffer(filtered, "ATTRIBUTES")
    indices = meshopt.encode_gltf_buffer(SIDES.reshape(-1), "TRIANGLES")
    packed = [(data, 5, 12, "ATTRIBUTES"), (indices, 18, 2, "TRIANGLES")]
    _packed_views(made, "EXT_meshopt_compression", packed)
    first = made.document["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]
    first["filter"] = "EXPONENTIAL"
    one_node(made, primitive)


def _packed_views(made: GltfWriter, name: str, packed: list[tuple[bytes, int, int, str]]) -> None:
    """All views' bytes go; what is packed lies in the first buffer, the views in one of nothing."""
    made.binary = b""
    views = made.document["bufferViews"]
    for view, (data, count, stride, mode) in zip(views, packed, strict=True):
        made.binary += bytes(-len(made.binary) % 4)
        entry: dict[str, Any] = {"buffer": 0, "byteOffset": len(made.binary)}
        entry |= {"byteLength": len(data), "count": count, "byteStride": stride, "mode": mode}
        made.binary += data
        view |= {"buffer": 1, "extensions": {name: entry}}
    nothing = {"byteLength": 96, "extensions": {name: {"fallback": True}}}
    made.document["buffers"] = [{"byteLength": len(made.binary)}, nothing]
    made.document |= {"extensionsUsed": [name], "extensionsRequired": [name]}


def _meshopt_spoilt(made: GltfWriter) -> None:
    _meshopt("EXT_meshopt_compression", 0, "TRIANGLES")(made)
    made.binary = b"\xff" + made.binary[1:]


PACKED: tuple[Case, ...] = (
    Case("glb_quantized.glb", "quantised positions", read_mesh, "read", (),
         is_stored("glb_quantized.glb", "<i2", 544, 4, 2 / 32767)),
    built("gltf_q_bytes.glb", "quantised positions", _quantised("i1", 1)),
    built("gltf_q_norm.glb", "quantised positions", _quantised("u1", 255, **_UP_TO_ONE)),
    built("gltf_q_short.glb", "quantised positions", _quantised("<i2", 32767, **_UP_TO_ONE)),
    built(
        "gltf_q_uvs.glb", "texture coordinates in integers", _packed_uvs,
        right=has_uvs(UVS + np.array([0.5, 0.25])),
    ),
    built("gltf_draco.glb", "Draco", _draco, right=has_uvs(UVS)),
    built_refused(
        "gltf_draco_spoilt.glb", "Draco", _draco_spoilt, "damaged", "export it without compression"
    ),
    built("gltf_meshopt.glb", "meshopt", _meshopt("EXT_meshopt_compression", 0, "TRIANGLES")),
    built("gltf_meshopt_1.glb", "meshopt", _meshopt("KHR_meshopt_compression", 1, "INDICES")),
    built("gltf_meshopt_filter.glb", "meshopt", _meshopt_filtered),
    built_refused(
        "gltf_meshopt_spoilt.glb", "meshopt", _meshopt_spoilt, "damaged", "without compression"
    ),
)  # fmt: skip
