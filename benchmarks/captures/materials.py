"""Materials of scenes: of OBJ's libraries, of PLY and of glTF, with their textures."""

from __future__ import annotations

from benchmarks.captures import gltf_looks, gltf_textures, material_libraries, material_maps

CASES = (
    *material_libraries.CASES,
    *material_maps.CASES,
    *gltf_textures.CASES,
    *gltf_looks.CASES,
)
