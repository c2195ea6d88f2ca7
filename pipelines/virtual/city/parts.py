"""What the built-in city is put together from: panels, boxes, prisms, blobs, and their joining.

Metres, z up. All surfaces are grids of quadrilaterals that are seen from their front: rows rise,
columns run to the right as seen from outside.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry.meshes import grid_triangles

FloatArray = NDArray[np.float64]

TEXTURE_SIZES: dict[str, tuple[float, float]] = {
    "brick": (1.155, 0.825),
    "plaster": (1.5, 1.5),
    "asphalt": (0.85, 0.85),
    "paving": (3.6, 1.6),
    "leaves": (1.1, 1.1),
    "wood": (1.2, 1.2),
    "metal": (0.7, 0.7),
    "roof": (2.0, 2.2),
    "paint": (2.5, 2.5),
    "interior": (2.4, 1.8),
    "shop": (3.0, 2.2),
    "astronaut": (1.0, 1.0),
    "chelsea": (1.0, 1.0),
    "coffee": (1.0, 1.0),
    "rocket": (1.0, 1.0),
    "page": (1.0, 1.0),
    "coins": (1.0, 1.0),
}
"""Metres to a repeat of each texture, across and up. Posters are fitted instead."""
MATERIALS = tuple(TEXTURE_SIZES)
"""Names of the textures; ``City.material`` counts them."""
POSTERS = ("astronaut", "chelsea", "coffee", "rocket")
MEAN_TEXEL = 0.4
"""Mean linear value of the textures that are tinted."""
_SHOWN_AS_THEY_ARE = (*POSTERS, "page", "coins", "interior", "shop")
_LONGEST_EDGE = 1.0


class Look(NamedTuple):
    """How a surface looks: a texture of MATERIALS, its mean linear albedo, its gloss."""

    material: str
    albedo: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Pictures (posters, interiors) are multiplied by it."""
    gloss: float = 0.0


class Part(NamedTuple):
    """A triangle mesh with looks; fields as those of ``City``."""

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32]
    tint: NDArray[np.float32]
    gloss: NDArray[np.float32]
    triangles: NDArray[np.int32]
    material: NDArray[np.int32]
    pole: NDArray[np.bool_]


# ---- joining and moving ------------------------------------------------------------------------


def join_parts(parts: Iterable[Part]) -> Part:
    """All parts as one; at least one."""
    every = list(parts)
    starts = np.cumsum([0, *(len(part.vertices) for part in every)])[:-1]
    triangles = np.concatenate([p.triangles + s for p, s in zip(every, starts, strict=True)])
    fields = {
        name: np.concatenate([getattr(part, name) for part in every])
        for name in Part._fields
        if name != "triangles"
    }
    return Part(**fields, triangles=triangles.astype(np.int32))


def copy_part(part: Part, offsets: ArrayLike) -> Part:
    """A part at each offset (n, 3), n >= 1."""
    places = np.asarray(offsets, np.float32).reshape(-1, 3)
    n = len(places)
    starts = np.arange(n, dtype=np.int32) * len(part.vertices)
    return Part(
        vertices=(part.vertices[None] + places[:, None]).reshape(-1, 3),
        normals=np.tile(part.normals, (n, 1)),
        uvs=np.tile(part.uvs, (n, 1)),
        tint=np.tile(part.tint, (n, 1)),
        gloss=np.tile(part.gloss, n),
        triangles=(part.triangles[None] + starts[:, None, None]).reshape(-1, 3),
        material=np.tile(part.material, n),
        pole=np.tile(part.pole, n),
    )


def place_part(part: Part, offset: ArrayLike, degrees: float = 0.0, roll: float = 0.0) -> Part:
    """A part rolled about x by ``roll``, turned about z by ``degrees``, then moved."""
    a, b = math.radians(degrees), math.radians(roll)
    about_z = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, math.cos(b), -math.sin(b)], [0, math.sin(b), math.cos(b)]])
    turn = (about_z @ about_x).astype(np.float32)
    return part._replace(
        vertices=part.vertices @ turn.T + np.asarray(offset, np.float32),
        normals=part.normals @ turn.T,
    )


def mark_as_pole(part: Part) -> Part:
    """The part, marked as a thin pole."""
    return part._replace(pole=np.ones(len(part.triangles), np.bool_))


# ---- surfaces ----------------------------------------------------------------------------------


def grid_surface(
    points: FloatArray,
    uvs: FloatArray,
    look: Look,
    *,
    normals: FloatArray | None = None,
    kept: NDArray[np.bool_] | None = None,
) -> Part:
    """A surface through points (r, c, 3) with texture coordinates (r, c, 2).

    normals (r, c, 3) follow from the grid where none are given; kept (r - 1, c - 1): cells that
    exist.
    """
    rows, columns = points.shape[:2]
    if normals is None:
        normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
        normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    triangles = grid_triangles(rows, columns)
    if kept is not None:
        triangles = triangles[np.repeat(kept.reshape(-1), 2)]
    used, triangles = np.unique(triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    scale = 1.0 if look.material in _SHOWN_AS_THEY_ARE else 1.0 / MEAN_TEXEL
    count = len(triangles)
    return Part(
        vertices=points.reshape(-1, 3)[used].astype(np.float32),
        normals=normals.reshape(-1, 3)[used].astype(np.float32),
        uvs=uvs.reshape(-1, 2)[used].astype(np.float32),
        tint=np.tile(np.array(look.albedo, np.float32) * np.float32(scale), (len(used), 1)),
        gloss=np.full(len(used), look.gloss, np.float32),
        triangles=triangles.astype(np.int32),
        material=np.full(count, MATERIALS.index(look.material), np.int32),
        pole=np.zeros(count, np.bool_),
    )


def subdivide_lines(
    lines: Sequence[float] | FloatArray, longest: float = _LONGEST_EDGE
) -> FloatArray:
    """Rising positions with others put between them, so that no step is longer than ``longest``."""
    steps = [
        np.linspace(a, b, max(1, math.ceil((b - a) / longest - 1e-6)), endpoint=False)
        for a, b in itertools.pairwise(lines)
    ]
    return np.append(np.concatenate(steps), lines[-1])


def panel(
    corner: ArrayLike,
    along: ArrayLike,
    up: ArrayLike,
    look: Look,
    *,
    shift: tuple[float, float] = (0.0, 0.0),
    longest: float = _LONGEST_EDGE,
    fitted: bool = False,
) -> Part:
    """A rectangle (parallelogram) from its lower left corner; its front shows ``along`` x ``up``.

    shift: of the texture, in metres; fitted: the texture is shown once, from edge to edge.
    """
    first, right, rise = (np.asarray(v, np.float64) for v in (corner, along, up))
    width, height = float(np.linalg.norm(right)), float(np.linalg.norm(rise))
    s = subdivide_lines([0.0, width], longest) / width
    t = subdivide_lines([0.0, height], longest) / height
    points = first + s[None, :, None] * right + t[:, None, None] * rise
    size = (width, height) if fitted else TEXTURE_SIZES[look.material]
    across, upwards = np.meshgrid(s * width + shift[0], t * height + shift[1])
    uvs = np.stack([across / size[0], upwards / size[1]], axis=-1)
    normal = np.cross(right, rise)
    normal /= np.linalg.norm(normal)
    return grid_surface(points, uvs, look, normals=np.broadcast_to(normal, points.shape))


def wall_with_holes(
    columns: Sequence[float] | FloatArray,
    rows: Sequence[float] | FloatArray,
    holes: NDArray[np.bool_],
    look: Look,
) -> Part:
    """A wall in the plane y = 0 that is seen from -y, without the cells ``holes``.

    columns (c + 1,), rows (r + 1,): lines in metres; holes (r, c). One grid: no cracks.
    """
    xs, zs = subdivide_lines(columns), subdivide_lines(rows)
    middle_x, middle_z = (xs[1:] + xs[:-1]) / 2, (zs[1:] + zs[:-1]) / 2
    open_ = holes[
        np.searchsorted(rows, middle_z)[:, None] - 1, np.searchsorted(columns, middle_x)[None] - 1
    ]
    x, z = np.meshgrid(xs, zs)
    points = np.stack([x, np.zeros_like(x), z], axis=-1)
    size = TEXTURE_SIZES[look.material]
    uvs = np.stack([x / size[0], z / size[1]], axis=-1)
    normals = np.broadcast_to(np.array([0.0, -1.0, 0.0]), points.shape)
    return grid_surface(points, uvs, look, normals=normals, kept=~open_)


def box(
    low: ArrayLike,
    high: ArrayLike,
    look: Look,
    *,
    faces: str = "-x+x-y+y-z+z",
    longest: float = 1.0,
) -> Part:
    """An upright box from its lowest to its highest corner; ``faces`` names those that exist."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    x, y, z = np.diag(b - a)
    frames = {
        "-y": (a, x, z),
        "+y": (a + x + y, -x, z),
        "-x": (a + y, -y, z),
        "+x": (a + x, y, z),
        "+z": (a + z, x, y),
        "-z": (a + y, x, -y),
    }
    shift = (float(a[0]), float(a[2]))
    return join_parts(
        panel(*frames[faces[i : i + 2]], look, shift=shift, longest=longest)
        for i in range(0, len(faces), 2)
    )


def tube(
    start: ArrayLike, end: ArrayLike, radius: float, look: Look, *, sides: int = 10, rings: int = 2
) -> Part:
    """A round bar between two points, without its ends."""
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    axis = (b - a) / np.linalg.norm(b - a)
    other = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    u = np.cross(axis, other)
    u /= np.linalg.norm(u)
    v = np.cross(axis, u)
    angle = np.linspace(0.0, 2 * np.pi, sides + 1)
    around = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    t = np.linspace(0.0, 1.0, rings)
    points = a + t[:, None, None] * (b - a) + radius * around[None]
    size = TEXTURE_SIZES[look.material]
    across, upwards = np.meshgrid(angle * radius / size[0], t * np.linalg.norm(b - a) / size[1])
    return grid_surface(
        points,
        np.stack([across, upwards], axis=-1),
        look,
        normals=np.broadcast_to(around[None], points.shape),
    )


def blob(
    centre: ArrayLike,
    radius: float,
    look: Look,
    generator: np.random.Generator,
    *,
    bumps: float = 0.12,
    segments: int = 18,
) -> Part:
    """A bumpy ball."""
    theta = np.linspace(np.pi, 0.0, segments // 2 + 2)[:, None]
    phi = np.linspace(0.0, 2 * np.pi, segments + 1)[None]
    direction = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1
    )
    waves = generator.normal(size=(6, 3)) * 4.0
    phases = generator.uniform(0.0, 2 * np.pi, 6)
    bump = np.sin(direction @ waves.T + phases).sum(axis=-1) * (bumps / 2.5)
    points = np.asarray(centre) + radius * (1.0 + bump)[..., None] * direction
    right = np.roll(points[:, :-1], -1, axis=1) - np.roll(points[:, :-1], 1, axis=1)
    right = np.concatenate([right, right[:, :1]], axis=1)
    normals = np.cross(right, np.gradient(points, axis=0))
    normals[[0, -1]] = direction[[0, -1]]
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    size = TEXTURE_SIZES[look.material][0]
    turns = np.round(2 * np.pi * radius / size)
    uvs = np.stack(
        np.broadcast_arrays(phi / (2 * np.pi) * turns, (np.pi - theta) * radius / size), axis=-1
    )
    return grid_surface(points, uvs + generator.uniform(0, 1, 2), look, normals=normals)
