"""How much a GLB's JSON would take: a file of a megabyte can place a thousand copies of a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput
from storage.readers.opening import check_memory

DEEPEST_TREE = 64
"""Nodes below each other."""
MOST_NODES = 50_000
MOST_STEPS = 500_000
"""From the scene down to each of its nodes, all of them together."""

_VERTEX_BYTES, _CORNER_BYTES = 80, 110  # of what is placed, measured up to its triangles
_PRIMITIVE_BYTES = 20_000  # of an object of trimesh's
_MEMORY_PER_BYTE = 64  # plain files take 40 at most
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def check_sizes(file: Path, file_bytes: int, description: dict[str, Any]) -> None:
    """Raise BadInput where the buffers, the accessors and the meshes, once for each node that
    places them, take more than the file may, or where the tree of nodes is none or too deep.

    Raises what indexing raises for JSON that is no glTF.
    """
    accessors = description.get("accessors", [])
    counts = [accessor["count"] for accessor in accessors]
    if any(type(count) is not int or count < 0 for count in counts):
        raise BadInput(file, "count of an accessor", "no count", "a whole number of at least 0")
    needed = sum(view["byteLength"] for view in description.get("bufferViews", ()))
    needed += sum(
        8 * _COMPONENTS[accessor["type"]] * count
        for accessor, count in zip(accessors, counts, strict=True)
    )
    meshes = [
        sum(_primitive_bytes(primitive, counts) for primitive in mesh["primitives"])
        for mesh in description.get("meshes", ())
    ]
    nodes = description.get("nodes", [])
    placed = [node["mesh"] for node in nodes if "mesh" in node]
    needed += sum(meshes) // 4 + sum(meshes[mesh] for mesh in placed if mesh < len(meshes))
    found = f"{len(meshes)} meshes in {len(placed)} places"
    check_memory(file, "geometry", found, needed, file_bytes, _MEMORY_PER_BYTE)
    _check_tree(file, nodes)


def _primitive_bytes(primitive: dict[str, Any], counts: list[int]) -> int:
    vertices = counts[primitive["attributes"]["POSITION"]]
    corners = counts[primitive["indices"]] if "indices" in primitive else vertices
    if primitive.get("mode", 4) == 5:  # a strip: a triangle for each corner
        corners *= 3
    return _PRIMITIVE_BYTES + _VERTEX_BYTES * vertices + _CORNER_BYTES * corners


def _check_tree(file: Path, nodes: list[dict[str, Any]]) -> None:
    """Trimesh looks for the way to each node, and never ends in a chain of thousands."""
    children = [child for node in nodes for child in node.get("children", ())]
    if len(children) > len(set(children)):
        raise BadInput(file, "tree of nodes", "without an order", "one parent at most of each node")
    if len(nodes) > MOST_NODES:
        raise BadInput(file, "number of nodes", f"{len(nodes)}", f"at most {MOST_NODES}")
    level = sorted(set(range(len(nodes))) - set(children))
    steps = depth = seen = 0
    while level:
        depth += 1
        seen += len(level)
        steps += depth * len(level)
        if depth > DEEPEST_TREE or steps > MOST_STEPS:
            found = f"{len(nodes)} nodes, {depth} or more below each other"
            expected = f"at most {DEEPEST_TREE} below each other, {MOST_STEPS} steps in all"
            raise BadInput(file, "tree of nodes", found, expected)
        level = [child for node in level for child in nodes[node].get("children", ())]
    if seen < len(nodes):
        raise BadInput(file, "tree of nodes", "a circle in part", "no node below itself")
