"""What a glTF's geometry would take: a file of a megabyte can place a thousand copies of a mesh."""

from __future__ import annotations

from typing import Any

from storage.readers.gltf.accessors import Accessors
from storage.readers.gltf.document import DRACO, MESHOPT
from storage.readers.gltf.primitives import FAN, STRIP, is_surface, joint_sets, uv_sets
from storage.readers.gltf.scene_tree import Group, instance_counts
from storage.readers.opening import check_memory

_VERTEX_BYTES, _CORNER_BYTES = 80, 110  # of what is placed, measured up to a scene's triangles
_SET_BYTES = 40  # of each corner's texture coordinates, or colour
_READ_BYTES = 64  # of each element of an accessor of up to four numbers
_MATRIX_BYTES = 400
_PRIMITIVE_BYTES = 20_000  # it takes a fifth of a millisecond; what is many takes memory, too
_INSTANCE_BYTES = 500
_MEMORY_PER_BYTE = 64  # plain files take 40 at most


def check_sizes(document: dict[str, Any], accessors: Accessors, groups: list[Group]) -> None:
    """Raise BadInput where the groups' meshes, once for each place, take more than the file may."""
    views = document.get("bufferViews", ())
    packed = [
        extensions[name]
        for extensions in (view.get("extensions", {}) for view in views)
        for name in MESHOPT
        if name in extensions
    ]
    needed = sum(2 * view["count"] * view["byteStride"] for view in packed)
    corners = instances = 0
    sets: set[int] = set()
    for skin in {group.skin for group in groups if group.skin is not None}:
        entry = document["skins"][skin]
        needed += _MATRIX_BYTES * len(entry["joints"])
        if "inverseBindMatrices" in entry:
            needed += _MATRIX_BYTES * accessors.count(entry["inverseBindMatrices"])
    for group in groups:
        places = 0
        for node in group.nodes:
            counts = instance_counts(document, accessors, node)
            places += min(counts, default=1)
            needed += _READ_BYTES * sum(counts)
        instances += places
        for primitive in document["meshes"][group.mesh]["primitives"]:
            if is_surface(primitive):
                posed = group.skin is not None and joint_sets(primitive)
                copies = 1 if posed else places  # a skin is where its joints are
                vertices, its_corners = _size(primitive, accessors)
                read = sum(map(accessors.count, _read(primitive, group)))
                needed += _PRIMITIVE_BYTES + _READ_BYTES * read
                needed += copies * (_VERTEX_BYTES * vertices + _CORNER_BYTES * its_corners)
                corners += copies * its_corners
                sets.update(uv_sets(primitive))
                sets.update({-1} if "COLOR_0" in primitive["attributes"] else ())
    needed += _INSTANCE_BYTES * instances + _SET_BYTES * len(sets) * corners
    file, file_bytes = accessors.buffers.file, accessors.buffers.file_bytes()
    found = f"{len(groups)} meshes in {instances} places"
    check_memory(file, "geometry", found, needed, file_bytes, _MEMORY_PER_BYTE)


def _size(primitive: dict[str, Any], accessors: Accessors) -> tuple[int, int]:
    """Vertices and corners of triangles."""
    vertices = accessors.count(primitive["attributes"]["POSITION"])
    corners = accessors.count(primitive["indices"]) if "indices" in primitive else vertices
    if primitive.get("mode") in (STRIP, FAN):  # a triangle for each corner
        corners *= 3
    if DRACO in primitive.get("extensions", {}):  # what has seams is split by its decoder
        vertices = max(vertices, corners)
    return vertices, corners


def _read(primitive: dict[str, Any], group: Group) -> list[int]:
    """The accessors of a primitive that are read."""
    attributes = primitive["attributes"]
    names = ["POSITION", "COLOR_0", *(f"TEXCOORD_{number}" for number in uv_sets(primitive))]
    if group.skin is not None:
        for number in joint_sets(primitive):
            names += [f"JOINTS_{number}", f"WEIGHTS_{number}"]
    read = [attributes[name] for name in names if name in attributes]
    for target, weight in zip(primitive.get("targets", ()), group.weights, strict=False):
        read += [target[name] for name in names if weight and name in target]
    return read
