"""Scenes to be lit: objects on a floor that are built in, and what a user's mesh becomes.

A scene is brought to a size of its own: the middle of its box is the origin and the sphere around
that has radius 1, so that a mesh in millimetres or a kilometre wide, or far from its origin, keeps
all its digits in single precision. z is up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry import shapes
from pipelines.geometry.meshes import check_mesh
from pipelines.geometry.refinement import refine_mesh
from pipelines.geometry.repair import RepairedMesh, repair_mesh
from pipelines.geometry.solids import creased_normals
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.surface_textures import SurfaceTextures

FloatArray = NDArray[np.float64]

SCENES = ("teapot", "court")

_CREASE = 40.0
"""Degrees between triangles from which on an edge is sharp."""
_ALIKE = 1e-6
"""Normals that differ by less are one."""


class Scene(NamedTuple):
    """Surfaces with normals, and what they are made of.

    vertices: (V, 3) float64, each position once but along creases, where each side has its own.
    triangles: (F, 3) int32, counter-clockwise from outside. normals: (V, 3) float64, unit.
    part: (F,) int32, row of ``materials``.
    middle: (3,), scale: the given position of a vertex is ``vertex * scale + middle``.
    notes: what was repaired, one sentence each.
    textures: of the triangles' corners (F, 3), where materials vary.
    """

    vertices: FloatArray
    triangles: NDArray[np.int32]
    normals: FloatArray
    part: NDArray[np.int32]
    materials: Materials
    middle: FloatArray
    scale: float
    notes: tuple[str, ...]
    textures: SurfaceTextures | None = None


class LitMesh(NamedTuple):
    """What is drawn, each vertex of one material and at one place of its textures.

    vertices: (V, 3). triangles: (F, 3), each inside one object. normals: (V, 3), unit.
    object_of_vertex: (V,), row of ``materials``. textures: of the vertices (V,).
    """

    vertices: FloatArray
    triangles: NDArray[np.integer]
    normals: FloatArray
    object_of_vertex: NDArray[np.integer]
    materials: Materials
    textures: SurfaceTextures | None = None


class SplitScene(NamedTuple):
    """``mesh``: a scene as it is drawn, vertices doubled where parts meet; ``source``: (V,) int64,
    the scene's vertex of each of them."""

    mesh: LitMesh
    source: NDArray[np.int64]


def make_scene(
    vertices: ArrayLike,
    triangles: ArrayLike,
    part: ArrayLike,
    materials: Materials,
    textures: SurfaceTextures | None = None,
    longest: float = math.inf,
) -> Scene:
    """Repair, centre and scale a mesh (see `repair.repair_mesh`), and split it along sharp edges.

    vertices (V, 3); triangles (F, 3) and part (F,) integers; textures of the triangles' corners.
    Edges longer than ``longest`` scene radii are cut: light is found at vertices. Raises ValueError
    for what is no mesh.
    """
    points = np.array(vertices, np.float64)
    corners = np.asarray(triangles)
    check_mesh(points, corners)
    used = points[np.unique(corners)]
    middle = (used.min(axis=0) + used.max(axis=0)) / 2.0
    scale = float(np.linalg.norm(used - middle, axis=1).max())
    if not scale > 0.0:
        raise ValueError("all vertices are at one position; expected a mesh of some size.")
    points = (points - middle) / scale
    mended = repair_mesh(points, corners)
    smooth = creased_normals(mended.vertices, mended.triangles, _CREASE)
    rows = mended.kept
    if textures is not None:
        textures = _repaired_textures(textures, corners, mended)
    if longest < math.inf:
        fine = refine_mesh(mended.vertices, mended.triangles, longest)
        rows, smooth = rows[fine.owner], _unit(fine.weights @ smooth[fine.owner])
        if textures is not None:
            textures = _refined_textures(textures, fine.owner, fine.weights)
        points, corners = fine.vertices, fine.triangles
    else:
        points, corners = mended.vertices, mended.triangles
    keys = np.column_stack([corners.ravel(), np.rint(smooth.reshape(-1, 3) / _ALIKE)])
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return Scene(
        points[corners.ravel()[first]],
        number.reshape(-1, 3).astype(np.int32),
        smooth.reshape(-1, 3)[first],
        np.asarray(part, np.int32)[rows],
        materials,
        middle,
        scale,
        mended.notes,
        textures,
    )


def _repaired_textures(
    textures: SurfaceTextures, given: NDArray[np.integer], mended: RepairedMesh
) -> SurfaceTextures:
    """``given`` (F, 3), the triangles before the repair, which turns some of them over."""
    same = mended.corners[:, :, None] == given[mended.kept][:, None, :]
    rows, order = mended.kept[:, None], same.argmax(axis=2)
    return textures._replace(uvs=textures.uvs[rows, order], colours=textures.colours[rows, order])


def _refined_textures(
    textures: SurfaceTextures, owner: NDArray[np.int64], weights: FloatArray
) -> SurfaceTextures:
    uvs = np.einsum("fkj,fjmc->fkmc", weights, textures.uvs[owner])
    colours = weights @ textures.colours[owner]
    return textures._replace(uvs=uvs.astype(np.float32), colours=colours.astype(np.float32))


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def built_in_scene(name: str, segments: int, floor: int) -> Scene:
    """``teapot``, glossy, on a floor, as in the paper's figure 1; or ``court``: walls that touch,
    with a slit between two of them, a thin screen, a post and a ball.

    ``segments`` of a patch's edge (in the teapot of 20: 12 918 vertices), and ``floor`` squares
    along the floor's side (64: 4225 vertices). Raises ValueError for another name.

    >>> scene = built_in_scene("court", segments=4, floor=8)
    >>> scene.triangles.shape[1], scene.materials.albedo.shape
    (3, (3, 3))
    >>> float(round(np.linalg.norm(scene.vertices, axis=1).max(), 6))
    1.0
    """
    if name == "teapot":
        pot = shapes.teapot(segments)
        low = pot.vertices[:, 2].min()
        ground = _floor(floor, 5.0, low)
        materials = Materials(
            np.array([[0.72, 0.42, 0.28], [0.6, 0.6, 0.58]]), np.array([0.04, 0.0]), np.full(2, 0.2)
        )
        return _joined([(pot.vertices, pot.triangles), ground], materials)
    if name == "court":
        n = max(2, segments // 2)
        ball = shapes.sphere(2 * n)
        walls = [
            _box((-1.2, -0.8, 0.0), (-1.1, 0.06, 1.0), n),
            _box((-1.2, 0.1, 0.0), (-1.1, 0.9, 1.0), n),
            _box((-1.1, 0.8, 0.0), (0.5, 0.9, 0.7), n),
            _box((0.9, -0.9, 0.0), (0.93, 0.3, 0.6), n),
            _box((-0.15, -0.95, 0.0), (0.0, -0.8, 1.3), n),
        ]
        joined = _together(walls)
        materials = Materials(
            np.array([[0.6, 0.6, 0.58], [0.65, 0.55, 0.42], [0.35, 0.5, 0.68]]),
            np.array([0.0, 0.0, 0.06]),
            np.array([0.3, 0.3, 0.15]),
        )
        round_one = (ball.vertices * 0.35 + [0.2, 0.1, 0.35], ball.triangles)
        return _joined([_floor(3 * floor // 4, 4.0, 0.0), joined, round_one], materials)
    raise ValueError(f"scene is {name!r}; expected one of {', '.join(SCENES)}.")


def split_by_part(scene: Scene) -> SplitScene:
    """Double the vertices at which parts, or places in textures, meet: one for each of them."""
    keys = scene.triangles.astype(np.int64) * len(scene.materials.albedo) + scene.part[:, None]
    if scene.textures is not None:
        return _split_by_texture(scene, scene.textures, keys)
    found, number = np.unique(keys, return_inverse=True)
    count = len(scene.materials.albedo)
    source = found // count
    mesh = LitMesh(
        scene.vertices[source],
        number.reshape(scene.triangles.shape).astype(np.int32),
        scene.normals[source],
        (found % count).astype(np.int32),
        scene.materials,
    )
    return SplitScene(mesh, source)


def _split_by_texture(
    scene: Scene, textures: SurfaceTextures, keys: NDArray[np.int64]
) -> SplitScene:
    """``keys`` (F, 3): vertex times materials plus material, so that sources ascend."""
    keys = keys.ravel()
    places = np.concatenate(
        [textures.uvs.reshape(len(keys), -1), textures.colours.reshape(len(keys), -1)], axis=1
    )
    order = np.lexsort((*places.T, keys))
    new = np.ones(len(order), bool)
    new[1:] = keys[order[1:]] != keys[order[:-1]]
    new[1:] |= (places[order[1:]] != places[order[:-1]]).any(axis=1)
    number = np.empty(len(order), np.int32)
    number[order] = np.cumsum(new) - 1
    first = order[new]
    source = scene.triangles.ravel()[first].astype(np.int64)
    mesh = LitMesh(
        scene.vertices[source],
        number.reshape(scene.triangles.shape),
        scene.normals[source],
        np.repeat(scene.part, 3)[first],
        scene.materials,
        textures._replace(
            uvs=textures.uvs.reshape(-1, 2, 2)[first],
            colours=textures.colours.reshape(-1, 3)[first],
        ),
    )
    return SplitScene(mesh, source)


_Mesh = tuple[FloatArray, NDArray[np.int32]]


def _joined(meshes: Sequence[_Mesh], materials: Materials) -> Scene:
    vertices, triangles = _together(meshes)
    part = np.repeat(np.arange(len(meshes)), [len(mesh[1]) for mesh in meshes])
    return make_scene(vertices, triangles, part, materials)


def _together(meshes: Sequence[_Mesh]) -> _Mesh:
    starts = np.cumsum([0, *(len(mesh[0]) for mesh in meshes)])[:-1]
    triangles = [mesh[1] + start for mesh, start in zip(meshes, starts, strict=True)]
    return np.concatenate([mesh[0] for mesh in meshes]), np.concatenate(triangles).astype(np.int32)


def _floor(segments: int, size: float, height: float) -> _Mesh:
    flat = shapes.square(segments)
    return flat.vertices * [size, size, 0.0] + [0.0, 0.0, height], flat.triangles


def _box(low: Sequence[float], high: Sequence[float], segments: int) -> _Mesh:
    """A closed box, each face ``segments`` x ``segments`` pairs of triangles."""
    face = shapes.square(segments)
    unit = face.vertices + np.array([0.0, 0.0, 0.5])
    turns = [
        np.eye(3),
        np.diag([1.0, -1.0, -1.0]),
        *(np.roll(np.diag([1.0, s, s]), k, axis=0) for s in (1.0, -1.0) for k in (1, 2)),
    ]
    sides = [(unit @ turn.T, face.triangles) for turn in turns]
    corners, triangles = _together(sides)
    return (corners + 0.5) * (np.array(high) - low) + low, triangles
