"""glTF 2.0, as .glb and as .gltf with the files beside it: triangles as the scene places them.

`reading` goes from a file's bytes to its JSON and its binary chunk (`container`), checks the JSON's
shape once (`document`) and its `extensions`, looks at what is placed how often (`scene_tree`) and
what that takes (`sizes`). Only then are numbers read: `buffers`, `compression` and `accessors` give
arrays, `primitives` geometry, `skins` its pose, and `assembly` joins all.
"""

from __future__ import annotations

from storage.readers.gltf.reading import GltfFile, read_gltf

__all__ = ["SUFFIXES", "GltfFile", "read_gltf"]

SUFFIXES = (".glb", ".gltf")
