"""Textures of glTF: formats, samplers, sets of texture coordinates, transforms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.captures.case import Case
from benchmarks.captures.gltf_writing import GltfWriter
from benchmarks.captures.looks import (
    BLUE,
    GREEN,
    GREY,
    MIDDLE,
    RED,
    Seen,
    both,
    encoded,
    has,
    is_everywhere,
    linear,
    picture,
    plain,
    shows,
)
from storage.readers.scenes import read_scene

_SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.uint16)
_FROM_TOP = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
"""As glTF counts: what the picture's lower left corner has is (0, 1)."""
MATT = {"metallicFactor": 0.0}
OAK = {"index": 0}
_TEXTURED = MATT | {"baseColorTexture": OAK}
Check = Callable[[Any], bool]


def gltf_case(
    name: str,
    kind: str,
    material: dict[str, Any],
    is_right: Check,
    ends: Any = "read",
    says: tuple[str, ...] = (),
    *,
    image: bytes | None = None,
    other: bytes | None = None,
    sampler: dict[str, int] | None = None,
    texture: dict[str, Any] | None = None,
    uvs: Any = _FROM_TOP,
    second: Any = None,
    colours: Any = None,
    required: tuple[str, ...] = (),
) -> Case:
    """A square with one material. image, other: pictures 0 and 1; uvs, second: its texture
    coordinates; ``texture``: texture 0, if it is not the first image."""

    def write(path: Path) -> None:
        made = GltfWriter(scene=0, scenes=[{"nodes": [0]}])
        arrays = {"TEXCOORD_0": uvs, "TEXCOORD_1": second, "COLOR_0": colours}
        attributes = {
            key: made.accessor(value) for key, value in arrays.items() if value is not None
        }
        primitive = made.primitive(_SQUARE, _TRIANGLES, **attributes)
        primitive["material"] = made.add("materials", name="wood", **material)
        made.node(mesh=made.mesh(primitive))
        for number, data in enumerate((image or encoded(picture()), other)):
            if data is not None:
                made.add("images", bufferView=made.view(data), mimeType="image/png")
                made.add("textures", source=number)
        if required:
            made.document["extensionsRequired"] = list(required)
        if sampler is not None:
            made.document["textures"][0]["sampler"] = made.add("samplers", **sampler)
        if texture is not None:
            made.document["textures"][0] = texture
        used = [*material.get("extensions", {}), *(texture or {}).get("extensions", {})]
        if used:
            made.document["extensionsUsed"] = used
        made.write(path)

    return Case(name, kind, read_scene, ends, says, is_right, write)


def textured(**entry: Any) -> dict[str, Any]:
    """A matt material with texture 0, and more."""
    return {"pbrMetallicRoughness": _TEXTURED} | entry


def extension(name: str, **entry: Any) -> dict[str, Any]:
    """An extension of a material or a texture."""
    return {"extensions": {name: entry}}


def _transformed(**entry: Any) -> dict[str, Any]:
    texture = OAK | extension("KHR_texture_transform", **entry)
    return {"pbrMetallicRoughness": MATT | {"baseColorTexture": texture}}


def has_shares(*values: float | None) -> Check:
    """Shares of specular, roughness and metal; None: whatever it is."""

    def is_right(scene: Any) -> bool:
        seen = Seen(scene, (0.25, 0.75))
        return all(
            value is None or abs(seen.share(channel) - value) < 0.01
            for channel, value in enumerate(values)
        )

    return is_right


def _bends(scene: Any) -> bool:
    codes = Seen(scene, (0.25, 0.75)).codes("normal")
    return codes is not None and codes.tolist() == list(MIDDLE)


_FLAT = encoded(plain(MIDDLE))
_ORM = encoded(plain((10, 64, 200)))
_TWICE = _FROM_TOP * 2 - 0.5

CASES = (
    gltf_case("glb_texture.glb", "texture of a glTF", textured(), shows()),
    gltf_case(
        "glb_texture_factor.glb",
        "texture of a glTF",
        {"pbrMetallicRoughness": _TEXTURED | {"baseColorFactor": [0.5, 0.25, 1, 1]}},
        shows(times=(0.5, 0.25, 1)),
    ),
    gltf_case("glb_texture.gltf", "texture of a glTF", textured(), shows()),
    gltf_case(
        "glb_jpeg.glb",
        "format of a glTF's texture",
        textured(),
        is_everywhere(linear(BLUE), 0.03),
        image=encoded(plain(BLUE, 16), "JPEG", quality=95),
    ),
    gltf_case(
        "glb_webp.glb",
        "format of a glTF's texture",
        textured(),
        shows(),
        image=encoded(picture(), "WEBP", lossless=True),
        texture=extension("EXT_texture_webp", source=0),
    ),
    gltf_case(
        "glb_basis_with_fallback.glb",
        "format of a glTF's texture",
        textured(),
        shows(),
        other=b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80),
        texture={"source": 0} | extension("KHR_texture_basisu", source=1),
    ),
    gltf_case(
        "glb_basis_alone.glb",
        "format of a glTF's texture",
        {"pbrMetallicRoughness": _TEXTURED | {"baseColorFactor": [0.5, 0.25, 1, 1]}},
        is_everywhere((0.5, 0.25, 1)),
        "told",
        ("KTX 2, which is not read: convert it to PNG",),
        image=b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80),
        texture=extension("KHR_texture_basisu", source=0),
    ),
    gltf_case(
        "glb_basis_required.glb",
        "format of a glTF's texture",
        textured(),
        shows(),
        "refused",
        ("KHR_texture_basisu", "PNG, JPEG or WebP"),
        image=b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80),
        texture=extension("KHR_texture_basisu", source=0),
        required=("KHR_texture_basisu",),
    ),
    gltf_case(
        "glb_broken_texture.glb",
        "damaged texture of a glTF",
        textured(),
        is_everywhere((1, 1, 1)),
        "told",
        ("image 0 is left out: it is damaged",),
        image=encoded(picture())[:50],
    ),
    gltf_case(
        "glb_no_image.glb",
        "damaged texture of a glTF",
        {"pbrMetallicRoughness": MATT | {"baseColorTexture": {"index": 7}}},
        is_everywhere((1, 1, 1)),
        "told",
        ("no such image",),
    ),
    gltf_case(
        "glb_repeat.glb",
        "wrap mode",
        textured(),
        shows({(0.125, 0.5): GREY, (0.875, 0.5): BLUE}),
        uvs=_TWICE,
        second=None,
    ),
    gltf_case(
        "glb_mirror.glb",
        "wrap mode",
        textured(),
        shows({(0.1, 0.4): BLUE, (0.9, 0.4): GREY, (0.1, 0.1): BLUE, (0.1, 0.9): RED}),
        sampler={"wrapS": 33648, "wrapT": 33648},
        uvs=_TWICE,
    ),
    gltf_case(
        "glb_clamp_one_axis.glb",
        "wrap mode",
        textured(),
        shows({(0.1, 0.6): RED, (0.9, 0.6): GREEN, (0.4, 0.9): BLUE, (0.4, 0.1): RED}),
        sampler={"wrapS": 33071, "wrapT": 10497},
        uvs=_TWICE,
    ),
    gltf_case(
        "glb_second_set.glb",
        "set of texture coordinates",
        {"pbrMetallicRoughness": MATT | {"baseColorTexture": {"index": 0, "texCoord": 1}}},
        shows(),
        uvs=np.zeros((4, 2), np.float32),
        second=_FROM_TOP,
    ),
    gltf_case(
        "glb_missing_set.glb",
        "set of texture coordinates",
        {"pbrMetallicRoughness": MATT | {"baseColorTexture": {"index": 0, "texCoord": 3}}},
        is_everywhere((1, 1, 1)),
        "told",
        ("no texture coordinates of set 3",),
    ),
    gltf_case(
        "glb_two_sets.glb",
        "set of texture coordinates",
        {
            "pbrMetallicRoughness": _TEXTURED,
            "normalTexture": {"index": 1, "texCoord": 1},
        },
        both(shows(), _bends),
        other=_FLAT,
        second=_FROM_TOP[::-1].copy(),
    ),
    gltf_case(
        "glb_offset.glb",
        "texture transform",
        _transformed(offset=[0.5, 0]),
        shows({(0.25, 0.75): GREEN, (0.75, 0.75): RED}),
    ),
    gltf_case(
        "glb_scale.glb",
        "texture transform",
        _transformed(scale=[0.5, 0.5]),
        # The quarter of the picture that is next to its upper left corner.
        is_everywhere(linear(RED)),
    ),
    gltf_case(
        "glb_turned.glb",
        "texture transform",
        # (u, t) to (t, -u): what is seen is turned clockwise.
        _transformed(rotation=float(np.pi / 2)),
        shows({(0.25, 0.75): BLUE, (0.75, 0.75): RED, (0.75, 0.25): GREEN, (0.25, 0.25): GREY}),
    ),
    gltf_case(
        "glb_transform_set.glb",
        "texture transform",
        _transformed(texCoord=1),
        shows(),
        uvs=np.zeros((4, 2), np.float32),
        second=_FROM_TOP,
    ),
    gltf_case(
        "glb_three_mappings.glb",
        "texture transform",
        {
            "pbrMetallicRoughness": _TEXTURED
            | {
                "metallicRoughnessTexture": OAK
                | extension("KHR_texture_transform", offset=[0.1, 0])
            },
            "normalTexture": {"index": 1} | extension("KHR_texture_transform", offset=[0.2, 0]),
        },
        shows(),
        "told",
        ("image 1 is left out: .* this is a third",),
        other=_FLAT,
    ),
    gltf_case(
        "glb_metal_roughness.glb",
        "texture of metal and roughness",
        {"pbrMetallicRoughness": {"metallicRoughnessTexture": OAK, "roughnessFactor": 0.5}},
        both(has_shares(1, 64 / 255, 200 / 255), has(metal=1, roughness=0.5**2 * (64 / 255) ** 2)),
        image=_ORM,
    ),
    gltf_case(
        "glb_normals.glb",
        "normals of a glTF",
        {"pbrMetallicRoughness": MATT, "normalTexture": {"index": 0, "scale": 0.5}},
        both(_bends, has(bend=0.5)),
        image=_FLAT,
    ),
    gltf_case(
        "glb_coloured.glb",
        "colours of a glTF's vertices",
        textured(),
        shows(times=(0.2, 0.4, 0.8)),
        colours=np.tile(np.array([0.2, 0.4, 0.8], np.float32), (4, 1)),
    ),
    gltf_case(
        "glb_coloured_bytes.glb",
        "colours of a glTF's vertices",
        {"pbrMetallicRoughness": MATT | {"baseColorFactor": [0.5, 0.5, 0.5, 1]}},
        is_everywhere(np.array([0.2, 0.4, 0.8]) / 2),
        colours=np.tile(np.array([0.2, 0.4, 0.8, 1], np.float32), (4, 1)),
    ),
)
