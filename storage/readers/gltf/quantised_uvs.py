"""Texture coordinates that were stored as integers, as they were before."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

_TEXTURES = ("normalTexture", "occlusionTexture", "emissiveTexture")


def unquantised(
    document: dict[str, Any], primitive: dict[str, Any], uvs: NDArray[np.float64]
) -> NDArray[np.float64]:
    """TEXCOORD_0 (V, 2), v from the bottom, of a primitive, by what its material says of textures.

    Who makes integers of a mesh (gltfpack, gltf-transform) leaves the numbers that make them as
    large as they were as the offset and scale of a KHR_texture_transform. Transforms of texture
    coordinates that are floats are the texture's own, and do not count here.
    """
    accessor = document["accessors"][primitive["attributes"]["TEXCOORD_0"]]
    transform = _transform(document, primitive)
    if accessor["componentType"] == 5126 or not transform:
        return uvs
    offset, scale = _pair(transform, "offset", 0.0), _pair(transform, "scale", 1.0)
    from_top = np.column_stack([uvs[:, 0], 1 - uvs[:, 1]]) * scale + offset
    return np.column_stack([from_top[:, 0], 1 - from_top[:, 1]])


def _transform(document: dict[str, Any], primitive: dict[str, Any]) -> dict[str, Any]:
    """The first one of the material's textures that lie by TEXCOORD_0; empty without any."""
    materials, number = document.get("materials"), primitive.get("material")
    if not isinstance(materials, list) or type(number) is not int:
        return {}
    material = _object(materials[number]) if 0 <= number < len(materials) else {}
    block = _object(material.get("pbrMetallicRoughness"))
    infos = [block.get("baseColorTexture"), block.get("metallicRoughnessTexture")]
    infos += [material.get(name) for name in _TEXTURES]
    for info in map(_object, infos):
        transform = _object(_object(info.get("extensions")).get("KHR_texture_transform"))
        if transform and transform.get("texCoord", info.get("texCoord", 0)) == 0:
            return transform
    return {}


def _object(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _pair(transform: dict[str, Any], name: str, default: float) -> NDArray[np.float64]:
    pair = transform.get(name)
    plain = isinstance(pair, list) and len(pair) == 2 and all(map(_is_number, pair))
    return np.array(pair if plain else [default] * 2, np.float64)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) < 1e300 and math.isfinite(value)
