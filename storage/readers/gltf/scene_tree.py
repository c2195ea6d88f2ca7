"""Which meshes a glTF's scene places where: its tree of nodes, their matrices, and instances."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.gltf.accessors import Accessors
from storage.readers.gltf.document import INSTANCING, VISIBILITY

MOST_NODES = 500_000
"""Each takes a kilobyte."""

_WAY_OUT = ": export it anew (Blender, gltf-transform)"


class Tree(NamedTuple):
    """``levels``: all nodes, those without a parent first, then their children, and so on;
    ``parents`` (N,) int64, -1 where there is none; ``drawn``: nodes of the scene that have a
    mesh, in the order of the file; ``hidden``: the meshes of those that the file hides."""

    levels: list[NDArray[np.int64]]
    parents: NDArray[np.int64]
    drawn: list[int]
    hidden: list[int]


class Group(NamedTuple):
    """Nodes that place one mesh in one shape: with the same skin and the same weights."""

    mesh: int
    skin: int | None
    weights: tuple[float, ...]
    nodes: list[int]


def scene_tree(file: Path, document: dict[str, Any]) -> Tree:
    """The nodes of the scene that the file wants shown, else of its first, else all.

    Raises BadInput where a node has two parents or is below itself, or where there are too many.
    """
    nodes = document.get("nodes", [])
    if len(nodes) > MOST_NODES:
        raise BadInput(file, "number of nodes", f"{len(nodes)}", f"at most {MOST_NODES}")
    parents = np.full(len(nodes), -1, np.int64)
    for number, node in enumerate(nodes):
        for child in node.get("children", ()):
            if parents[child] >= 0:
                found = f"a child of nodes {parents[child]} and {number}"
                raise BadInput(file, f"nodes[{child}]", found, "one parent at most" + _WAY_OUT)
            parents[child] = number
    levels = []
    level = [number for number in range(len(nodes)) if parents[number] < 0]
    while level:
        levels.append(np.array(level, np.int64))
        level = [child for number in level for child in nodes[number].get("children", ())]
    if sum(map(len, levels)) < len(nodes):
        raise BadInput(file, "tree of nodes", "a circle", "no node below itself" + _WAY_OUT)
    shown = _shown(document, levels, parents)
    states = [node.get("extensions", {}).get(VISIBILITY, {}) for node in nodes]
    visible = shown & np.array([state.get("visible", True) for state in states], bool)
    for level_nodes in levels[1:]:
        above = parents[level_nodes]
        visible[level_nodes] &= visible[above] | ~shown[above]
    meshes = np.array(["mesh" in node for node in nodes], bool)
    drawn = np.flatnonzero(visible & meshes).tolist()
    hidden = [nodes[number]["mesh"] for number in np.flatnonzero(shown & meshes & ~visible)]
    return Tree(levels, parents, drawn, hidden)


def _shown(
    document: dict[str, Any], levels: list[NDArray[np.int64]], parents: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each node is in the scene."""
    scenes = document.get("scenes", [])
    shown = np.full(len(parents), not scenes)
    if scenes:
        shown[scenes[document.get("scene", 0)].get("nodes", [])] = True
        for level in levels[1:]:
            shown[level] |= shown[parents[level]]
    return shown


def groups(document: dict[str, Any], tree: Tree) -> list[Group]:
    """The drawn nodes by the shape that they place, in the order of their first ones."""
    found: dict[tuple[int, int | None, tuple[float, ...]], Group] = {}
    for number in tree.drawn:
        node = document["nodes"][number]
        mesh, skin = node["mesh"], node.get("skin")
        weights = tuple(node.get("weights") or document["meshes"][mesh].get("weights") or ())
        group = Group(mesh, skin, weights, [])
        found.setdefault((mesh, skin, weights), group).nodes.append(number)
    return list(found.values())


# --- Matrices -----------------------------------------------------------------------------------


def world_matrices(document: dict[str, Any], tree: Tree) -> NDArray[np.float64]:
    """(N, 4, 4), from each node to the scene."""
    nodes = document.get("nodes", [])
    matrices = _local_matrices(nodes)
    for level in tree.levels[1:]:
        matrices[level] = matrices[tree.parents[level]] @ matrices[level]
    return matrices


def _local_matrices(nodes: list[dict[str, Any]]) -> NDArray[np.float64]:
    moves = np.array([node.get("translation", (0, 0, 0)) for node in nodes], float)
    turns = np.array([node.get("rotation", (0, 0, 0, 1)) for node in nodes], float)
    scales = np.array([node.get("scale", (1, 1, 1)) for node in nodes], float)
    matrices = composed(moves.reshape(-1, 3), turns.reshape(-1, 4), scales.reshape(-1, 3))
    for number, node in enumerate(nodes):
        if "matrix" in node:
            matrices[number, :3] = np.reshape(node["matrix"], (4, 4)).T[:3]
    return matrices


def composed(
    moves: NDArray[np.float64], turns: NDArray[np.float64], scales: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Translations (n, 3), quaternions (n, 4) x, y, z, w and scales (n, 3) to (n, 4, 4):
    scaled first, then turned, then moved. Quaternions of any length turn alike; 0 does not."""
    length = np.linalg.norm(turns, axis=1, keepdims=True)
    unit = np.divide(turns, length, out=np.zeros_like(turns), where=length > 0)
    axis, real = unit[:, :3], unit[:, 3]
    matrices = np.zeros((len(moves), 4, 4))
    matrices[:, 3, 3] = 1
    across = np.cross(axis[:, None, :], np.eye(3)).transpose(0, 2, 1)  # v -> axis x v
    matrices[:, :3, :3] = np.eye(3) + 2 * (real[:, None, None] * across + across @ across)
    matrices[:, :3, :3] *= scales[:, None, :]
    matrices[:, :3, 3] = moves
    return matrices


def instance_counts(document: dict[str, Any], accessors: Accessors, node: int) -> list[int]:
    """How many elements the attributes of a node's instances have: as many as there are instances,
    each. None where the node places its mesh once, without any."""
    return [accessors.count(row) for row in _instancing(document, node).values()]


def placements(
    document: dict[str, Any], accessors: Accessors, world: NDArray[np.float64], node: int
) -> NDArray[np.float64]:
    """(n, 4, 4): the matrices with which a node places its mesh, one or one for each instance."""
    attributes = _instancing(document, node)
    if not attributes:
        return world[node][None]
    count = min(instance_counts(document, accessors, node))

    def values(name: str, width: int, default: float) -> NDArray[np.float64]:
        if name not in attributes:
            return np.full((count, width), default)
        what = f"{name} of instances"
        return accessors.floats(attributes[name], (width,), what)[:count]

    turns = values("ROTATION", 4, 0.0)
    return world[node] @ composed(values("TRANSLATION", 3, 0.0), turns, values("SCALE", 3, 1.0))


def _instancing(document: dict[str, Any], node: int) -> dict[str, int]:
    extensions = document["nodes"][node].get("extensions", {})
    attributes: dict[str, int] = extensions.get(INSTANCING, {}).get("attributes", {})
    return attributes
