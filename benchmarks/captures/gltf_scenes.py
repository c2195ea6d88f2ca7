"""Cases of glTF: nodes, scenes, skins, morph targets, and what a scene holds besides meshes."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import FILES, Case
from benchmarks.captures.gltf_containers import is_the_pyramid
from benchmarks.captures.gltf_writing import (
    PYRAMID,
    SIDES,
    GltfWriter,
    are_triangles,
    moved,
    one_mesh,
    pyramid_at,
)
from storage.readers.meshes import MeshFile, read_mesh

_Build = Callable[[GltfWriter], object]
_Right = Callable[[MeshFile], bool]
_ROOT = math.sqrt(0.5)
_QUARTER = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], float)
"""A quarter turn about z, as a matrix; as a quaternion it is (0, 0, _ROOT, _ROOT)."""
_QUARTER_TURN = [0, 0, _ROOT, _ROOT]
_MIRROR = np.diag([-1.0, 1, 1, 1])


def _case(file: str, kind: str, build: _Build, *says: str, right: _Right = is_the_pyramid) -> Case:
    """``build`` changes a document with the pyramid at one node."""

    def write(path: Path) -> None:
        made = one_mesh()
        build(made)
        made.write(path)

    return Case(file, kind, read_mesh, "told" if says else "read", says, right, write)


def _refused(file: str, kind: str, build: _Build, *says: str) -> Case:
    case = _case(file, kind, build, *says)
    return Case(file, kind, read_mesh, "refused", says, None, case.write)


def _at(*matrices: NDArray[np.float64]) -> _Right:
    """The pyramid is where these put it, and nowhere else."""
    return lambda found: are_triangles(found.vertices[found.triangles], pyramid_at(*matrices))


def _has(corners: NDArray[Any]) -> _Right:
    """The pyramid has these corners (5, 3) in the place of its own."""
    expected = np.asarray(corners, float)[SIDES]
    return lambda found: are_triangles(found.vertices[found.triangles], expected)


def _nodes(*nodes: dict[str, Any], **extra: Any) -> _Build:
    """Nodes in the place of the document's one."""
    return lambda made: made.document.update({"nodes": list(nodes)} | extra)


def _columns(matrix: NDArray[np.float64]) -> list[float]:
    return [float(value) for value in matrix.T.ravel()]


# --- What is written ----------------------------------------------------------------------------


def _chain(length: int) -> _Build:
    """Nodes below each other, each moved by one along x; the last has the mesh."""
    nodes: list[dict[str, Any]] = [
        {"children": [row + 1], "translation": [1, 0, 0]} for row in range(length)
    ]
    return _nodes(*nodes, {"mesh": 0})


def _instances(made: GltfWriter, **attributes: NDArray[Any]) -> None:
    """EXT_mesh_gpu_instancing; integers are normalised."""
    rows = {
        name: made.accessor(values, **({"normalized": True} if values.dtype.kind == "i" else {}))
        for name, values in attributes.items()
    }
    entry = {"EXT_mesh_gpu_instancing": {"attributes": rows}}
    made.document["nodes"][0] |= {"extensions": entry, "translation": [0, 0, 1]}
    made.document["extensionsUsed"] = [*entry]


def _turned_instances(made: GltfWriter) -> None:
    turns = np.array([[0, 0, 0, 127], [0, 0, 90, 90]], np.int8)
    moves = np.array([[5, 0, 0], [0, 5, 0]], np.float32)
    scales = np.array([[1, 1, 1], [2, 2, 2]], np.float32)
    _instances(made, TRANSLATION=moves, ROTATION=turns, SCALE=scales)


def _million_instances(made: GltfWriter) -> None:
    """Of nothing but zeros, which take no bytes."""
    _instances(made)
    row = made.add("accessors", componentType=5126, count=10_000_000, type="VEC3")
    extension = made.document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]
    extension["attributes"] = {"TRANSLATION": row}


def _apex_moved(values: NDArray[Any], **node: Any) -> _Build:
    """A morph target that moves corners by these; the mesh's own weight is a half."""

    def build(made: GltfWriter) -> None:
        mesh = made.document["meshes"][0]
        mesh["primitives"][0]["targets"] = [{"POSITION": made.accessor(values)}]
        mesh["weights"] = [0.5]
        made.document["nodes"][0] |= node

    return build


def _sparse_target(made: GltfWriter) -> None:
    """A morph target that has the apex alone."""
    _apex_moved(_UP)(made)
    target = made.document["accessors"][-1]
    del target["bufferView"]
    target["sparse"] = {
        "count": 1,
        "indices": {"bufferView": made.view(b"\4\0\0\0"), "componentType": 5125},
        "values": {"bufferView": made.view(_UP[4:].tobytes())},
    }


def _skin(
    made: GltfWriter,
    joints: NDArray[np.uint8],
    weights: NDArray[Any],
    inverse: list[NDArray[np.float64]] | None,
    *nodes: dict[str, Any],
) -> None:
    """A skin whose joints are ``nodes``; ``joints`` and ``weights`` (5, 4 n), of each corner."""
    primitive = made.document["meshes"][0]["primitives"][0]
    for row in range(joints.shape[1] // 4):
        its = slice(4 * row, 4 * row + 4)
        normalised = {"normalized": True} if weights.dtype.kind == "u" else {}
        primitive["attributes"] |= {
            f"JOINTS_{row}": made.accessor(joints[:, its]),
            f"WEIGHTS_{row}": made.accessor(weights[:, its], **normalised),
        }
    skin: dict[str, Any] = {"joints": list(range(1, 1 + len(nodes)))}
    if inverse is not None:
        columns = np.array([_columns(matrix) for matrix in inverse], np.float32)
        skin["inverseBindMatrices"] = made.accessor(columns)
    made.document["skins"] = [skin]
    made.document["nodes"][0] |= {"skin": 0, "translation": [100, 100, 100]}  # has no say
    made.document["nodes"] += nodes
    made.document["scenes"] = [{"nodes": [0, 1]}]


def _two_joints(made: GltfWriter) -> None:
    """The base stands; the apex is half on a joint that is 4 further up, but bound 1 up."""
    joints = np.tile(np.array([0, 1, 0, 0], np.uint8), (5, 1))
    weights = np.tile(np.array([255, 0, 0, 0], np.uint8), (5, 1))
    weights[4] = 128, 128, 0, 0  # whose sum is not 255
    hips = {"children": [2], "translation": [0, 0, 1]}
    head = {"translation": [0, 0, 3]}
    _skin(made, joints, weights, [moved(0, 0, -1), moved(0, 0, -1)], hips, head)


def _eight_joints(made: GltfWriter) -> None:
    """The fifth of eight joints of a corner has all of the apex."""
    joints = np.zeros((5, 8), np.uint8)
    joints[:, 4] = 1
    weights = np.zeros((5, 8), np.float32)
    weights[:4, 0] = weights[4, 4] = 1
    _skin(made, joints, weights, None, {"children": [2]}, {"translation": [0, 0, 7]})


def _mirroring_joint(made: GltfWriter) -> None:
    joints, weights = np.zeros((5, 4), np.uint8), np.zeros((5, 4), np.float32)
    weights[:, 0] = 2
    _skin(made, joints, weights, None, {"scale": [-1, 1, 1]})


def _bad_joint(made: GltfWriter) -> None:
    joints = np.full((5, 4), 3, np.uint8)
    _skin(made, joints, np.full((5, 4), 0.25, np.float32), None, {})


def _two_scenes(**scene: int) -> _Build:
    nodes = {"mesh": 0}, {"mesh": 0, "translation": [9, 0, 0]}
    return _nodes(*nodes, scenes=[{"nodes": [0]}, {"nodes": [1]}], **scene)


def _without_scenes(made: GltfWriter) -> None:
    made.document["nodes"].append({"mesh": 0, "translation": [9, 0, 0]})
    del made.document["scene"], made.document["scenes"]


def _first_scene(made: GltfWriter) -> None:
    _two_scenes()(made)
    del made.document["scene"]


def _stage(made: GltfWriter) -> None:
    """Camera, lamp and movement, as modellers export them."""
    lamps = {"KHR_lights_punctual": {"lights": [{"type": "point"}, {"type": "spot"}]}}
    made.document |= {
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "animations": [{"channels": [], "samplers": []}],
        "extensions": lamps,
        "extensionsUsed": ["KHR_lights_punctual"],
    }
    made.document["nodes"].append({"camera": 0})


def _hidden(made: GltfWriter) -> None:
    """The parent is hidden, and with it the child."""
    off = {"extensions": {"KHR_node_visibility": {"visible": False}}, "children": [2], "mesh": 0}
    made.document["nodes"] += [off, {"mesh": 0, "translation": [9, 0, 0]}]
    made.document |= {"scenes": [{"nodes": [0, 1]}], "extensionsUsed": ["KHR_node_visibility"]}


def _variants(made: GltfWriter) -> None:
    held = {"KHR_materials_variants": {"variants": [{"name": "red"}, {"name": "blue"}]}}
    made.document |= {"extensions": held, "extensionsUsed": [*held]}


def _levels_of_detail(made: GltfWriter) -> None:
    made.document["nodes"][0]["extensions"] = {"MSFT_lod": {"ids": [1]}}
    coarse = made.mesh(made.primitive(triangles=SIDES[:2]))
    made.node(mesh=coarse)
    made.document["extensionsUsed"] = ["MSFT_lod"]


def _extension(kind: str, name: str) -> _Build:
    return lambda made: made.document.update({kind: [name]})


_UP = np.zeros((5, 3), np.float32)
_UP[4] = 0, 0, 2
_HALF_UP, _TWICE_UP = PYRAMID + _UP / 2, PYRAMID + 2 * _UP
_BOTH = np.concatenate([np.eye(4)[None], moved(9, 0, 0)[None]])
_MORPHED, _SKINNED = "in the shape of the file's weights", "1 mesh with a skin: posed as the joints"
_PARENT: dict[str, Any] = {"children": [1], "rotation": _QUARTER_TURN, "scale": [2, 2, 2]}


def _three_ellipsoids(found: MeshFile) -> bool:
    """Whether the shared file's ellipsoid stands at x = -2, 0 and 2, and nothing else."""
    data = (FILES / "glb_gpu_instancing_required.glb").read_bytes()
    binary = data[data.index(b"BIN\0") + 4 :]
    corners = np.frombuffer(binary, "<f4", 544 * 3).reshape(-1, 3).astype(float)
    triangles = corners[np.frombuffer(binary, "<u4", 2880, 6528).reshape(-1, 3)]
    expected = np.concatenate([triangles + np.array([x, 0, 0]) for x in (-2, 0, 2)])
    return np.allclose(found.vertices[found.triangles], expected, atol=1e-6)


def _rest_pose(found: MeshFile) -> bool:
    """The file's own numbers, turned by -90 degrees about x and a hundredth as large."""
    data = (FILES / "glb_skin_rest_pose.glb").read_bytes()
    binary = data[data.index(b"BIN\0") + 4 :]
    x, y, z = np.frombuffer(binary, "<f4", 544 * 3).reshape(-1, 3).T.astype(float) / 100
    corners = np.column_stack([x, z, -y])
    expected = corners[np.frombuffer(binary, "<u4", 2880, 6528).reshape(-1, 3)]
    return np.allclose(found.vertices[found.triangles], expected, atol=1e-5)


SCENES: tuple[Case, ...] = (
    Case(
        "glb_gpu_instancing_required.glb", "instances", read_mesh, "read", (), _three_ellipsoids
    ),
    Case("glb_skin_rest_pose.glb", "skins", read_mesh, "told", (_SKINNED,), _rest_pose),
    _case(
        "gltf_parts.glb", "nodes below nodes",
        _nodes(_PARENT, {"mesh": 0, "translation": [1, 2, 3]}),
        right=_at(_QUARTER @ np.diag([2.0, 2, 2, 1]) @ moved(1, 2, 3)),
    ),
    _case(
        "gltf_matrix.glb", "nodes below nodes",
        _nodes({"mesh": 0, "matrix": _columns(moved(1, 2, 3) @ _QUARTER)}),
        right=_at(moved(1, 2, 3) @ _QUARTER),
    ),
    _case("gltf_deep.glb", "nodes below nodes", _chain(300), right=_at(moved(300, 0, 0))),
    _case(
        "gltf_mirror.glb", "mirroring nodes", _nodes({"mesh": 0, "scale": [-1, 1, 1]}),
        right=_at(_MIRROR),
    ),
    _case(
        "gltf_long_quaternion.glb", "quaternions that are not of length 1",
        _nodes({"mesh": 0, "rotation": [0, 0, 2, 2]}), right=_at(_QUARTER),
    ),
    _case(
        "gltf_scaled_to_nothing.glb", "hidden nodes",
        _nodes({"mesh": 0}, {"mesh": 0, "scale": [0, 0, 0]}, scenes=[{"nodes": [0, 1]}]),
        "1 mesh is hidden by the file and left out",
    ),
    _case("gltf_hidden.glb", "hidden nodes", _hidden, "2 meshes are hidden by the file"),
    _case("gltf_second_scene.glb", "several scenes", _two_scenes(scene=1),
          "1 other scene is left out", right=_at(moved(9, 0, 0))),
    _case("gltf_first_scene.glb", "several scenes", _first_scene, "1 other scene is left out"),
    _refused(
        "gltf_empty_scene.glb", "nothing in the scene", _nodes({"mesh": 0}, scenes=[{}]),
        "without triangles: 1 mesh is not in the scene", "export the mesh in it",
    ),
    _case("gltf_without_scenes.glb", "no scene", _without_scenes, right=_at(*_BOTH)),
    _case(
        "gltf_instances.glb", "instances", _turned_instances,
        right=_at(moved(5, 0, 1), moved(0, 5, 1) @ _QUARTER @ np.diag([2.0, 2, 2, 1])),
    ),
    _refused(
        "gltf_million_instances.glb", "more than the memory holds", _million_instances,
        "in 10000000 places", "at most 1024 MiB",
    ),
    _case("gltf_morph.glb", "morph targets", _apex_moved(_UP), _MORPHED, right=_has(_HALF_UP)),
    _case("gltf_morph_node.glb", "morph targets", _apex_moved(_UP, weights=[2.0]), _MORPHED,
          right=_has(_TWICE_UP)),
    _case("gltf_morph_sparse.glb", "morph targets", _sparse_target, _MORPHED, right=_has(_HALF_UP)),
    _case("gltf_skin.glb", "skins", _two_joints, _SKINNED, right=_has(PYRAMID + 0.75 * _UP)),
    _case("gltf_skin_8.glb", "skins", _eight_joints, _SKINNED, right=_has(PYRAMID + 3.5 * _UP)),
    _case("gltf_skin_mirror.glb", "skins", _mirroring_joint, _SKINNED, right=_at(_MIRROR)),
    _refused(
        "gltf_skin_joint.glb", "references to no joint", _bad_joint, "joint 3", "joints 0 to 0"
    ),
    _case("gltf_stage.glb", "cameras, lights, movement", _stage, "1 camera is left out",
          "2 lights are left out", "1 animation is left out"),
    _case("gltf_variants.glb", "variants of materials", _variants, "Of 2 material variants"),
    _case("gltf_lod.glb", "levels of detail", _levels_of_detail, "the finest is read"),
    _case(
        "gltf_ours.glb", "extensions of one writer", _extension("extensionsUsed", "ACME_fuzz"),
        "Extensions that are not read: ACME_fuzz",
    ),
    _refused(
        "gltf_ours_required.glb", "extensions of one writer",
        _extension("extensionsRequired", "ACME_fuzz"), "ACME_fuzz", "export it anew with that",
    ),
    _refused(
        "gltf_splats.glb", "splats", _extension("extensionsRequired", "KHR_gaussian_splatting"),
        "KHR_gaussian_splatting", "a mesh of triangles: splats have no surface",
    ),
    _refused(
        "gltf_two_parents.glb", "nodes without an order",
        _nodes({"children": [2]}, {"children": [2]}, {"mesh": 0}),
        r"nodes.2. is a child of nodes 0 and 1", "one parent at most: export it anew",
    ),
    _refused(
        "gltf_circle.glb", "nodes without an order", _nodes({"children": [1]}, {"children": [0]}),
        "circle", "no node below itself: export it anew",
    ),
)  # fmt: skip
