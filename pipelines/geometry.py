"""Triangle meshes to draw on: a square, a sphere, the Utah teapot, and what any mesh needs.

Texture coordinates (u, v) count photographs: (0, 0) is the bottom left and (1, 1) the top right
corner of one, u to the right. Outside [0, 1] the photograph is repeated, mirrored at every whole
number, which makes its value an even function of u. The closed charts made here lie evenly about
u = 0, so that their two ends show the same column and the seam cannot be seen, also after the
coordinates are scaled about 0. On surfaces, charts are (near to) conformal: the photograph is
scaled and turned, but neither stretched nor mirrored, seen from outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.teapot_patches import (
    BOTTOM,
    HANDLE,
    KNOB,
    LID,
    LOWER_BODY,
    RIM,
    SPOUT,
    UPPER_BODY,
    Profile,
    swept_quarter,
)

# The middle of the box around Newell's teapot, and the radius of the sphere around it.
_TEAPOT_CENTRE = (0.2169, 0.0, 1.575)
_TEAPOT_RADIUS = 3.3


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh. ``vertices`` (V, 3) float64; ``triangles`` (F, 3) int32, counter-clockwise
    from outside; ``uvs`` (V, 2) float64, in photographs; ``normals`` (V, 3) float64, unit.

    Vertices are split where texture coordinates jump; such copies have the same position and
    the same normal, so that surfaces offset along the normals stay closed.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    uvs: NDArray[np.float64]
    normals: NDArray[np.float64]


# --- What any mesh needs ------------------------------------------------------------------------


def make_mesh(vertices: ArrayLike, triangles: ArrayLike, uvs: ArrayLike | None = None) -> Mesh:
    """A mesh with normals and, where ``uvs`` is None, with texture coordinates.

    ``vertices`` (V, 3), ``triangles`` (F, 3) integers, ``uvs`` (V, 2) as described above, or None:
    then :func:`unwrap` makes them. Raises ValueError for other shapes, for references to vertices
    that do not exist and for numbers that are not finite.
    """
    points = np.array(vertices, np.float64)
    faces = np.array(triangles)
    _check_arrays(points, faces)
    if uvs is None:
        points, faces, coordinates = unwrap(points, faces)
    else:
        coordinates = np.array(uvs, np.float64)
    if coordinates.shape != (len(points), 2) or not np.isfinite(coordinates).all():
        raise ValueError(
            f"uvs have the shape {coordinates.shape}; expected ({len(points)}, 2) finite numbers"
        )
    return Mesh(points, faces.astype(np.int32), coordinates, vertex_normals(points, faces))


def vertex_normals(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Unit normals (V, 3) of vertices (V, 3) and triangles (F, 3): the mean of the triangles'
    normals, weighted by their angles at the vertex, over all vertices at the same position.

    Copies of a vertex (equal coordinates) share the triangles, so that they get one normal.
    Where those cancel out, as on a sheet with two sides, each copy keeps to its own triangles;
    a vertex without any gets (0, 0, 1). Independent of how the surface is cut into triangles
    (Thürmer and Wüthrich, "Computing vertex normals from polygonal facets", 1998).
    """
    _, position = np.unique(vertices + 0.0, axis=0, return_inverse=True)  # + 0.0: no -0.0
    position = position.reshape(-1)
    weighted = _angle_weighted_normals(vertices, triangles)
    own = np.zeros_like(vertices)
    np.add.at(own, triangles, weighted)
    shared = np.zeros_like(vertices)
    np.add.at(shared, position, own)
    summed = np.where(_length(shared[position]) > 1e-9, shared[position], own)
    length = _length(summed)
    return np.where(length > 1e-9, summed / np.maximum(length, 1e-9), [0.0, 0.0, 1.0])


def unwrap(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Texture coordinates for a mesh that has none, by xatlas.

    Returns vertices (V', 3), split along the charts' borders; triangles (F, 3) in the given
    order; and uvs (V', 2). Charts keep angles and areas as far as xatlas manages; a photograph
    is as wide as the radius of the sphere about the middle of the mesh's box, so that the charts
    together cover more than one. The charts' borders show as seams.

    Raises ValueError for a mesh whose vertices all are at one position.
    """
    import xatlas

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    centred = vertices - (low + high) / 2
    radius = _length(centred).max()
    if not radius > 0:
        raise ValueError("all vertices are at one position; expected a surface")
    atlas = xatlas.Atlas()
    # In units of the radius: xatlas takes floats and has absolute tolerances.
    atlas.add_mesh((centred / radius).astype(np.float32), triangles.astype(np.uint32))
    options = xatlas.PackOptions()
    options.texels_per_unit = 256.0  # sets the packing's precision and the unit of its size
    atlas.generate(pack_options=options)
    sources, faces, uvs = atlas[0]
    size = np.array([atlas.width, atlas.height], np.float64)
    return vertices[sources], faces.astype(np.int64), uvs * size / options.texels_per_unit


def _check_arrays(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> None:
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        raise ValueError(f"vertices have the shape {vertices.shape}; expected (V, 3), finite")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise ValueError(f"triangles have the shape {triangles.shape}; expected (F, 3) integers")
    if len(triangles) == 0:
        raise ValueError("there are no triangles; expected at least one")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise ValueError(
            f"triangles refer to vertices {triangles.min()} to {triangles.max()}; "
            f"expected 0 to {len(vertices) - 1}"
        )


def _angle_weighted_normals(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """(F, 3, 3): each triangle's unit normal times its angle at each corner; 0 without area."""
    corners = vertices[triangles]
    after = np.roll(corners, -1, axis=1) - corners
    before = np.roll(corners, 1, axis=1) - corners
    normal = np.cross(after, before)
    doubled_area = _length(normal)
    angle = np.arctan2(doubled_area, (after * before).sum(axis=-1, keepdims=True))
    return normal / np.maximum(doubled_area, np.finfo(float).tiny) * angle


def _length(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length: NDArray[np.float64] = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return length


# --- Shapes -------------------------------------------------------------------------------------


def square(segments: int = 1) -> Mesh:
    """A unit square in the plane z = 0 about the origin, facing +z, ``segments`` x ``segments``
    pairs of triangles; it shows exactly one photograph, upright seen from +z.

    Raises ValueError for less than one segment.
    """
    _check_segments(segments, 1)
    steps = np.linspace(0.0, 1.0, segments + 1)
    u, v = np.meshgrid(steps, steps[::-1])  # rows downwards, as on all grids here
    grid = np.stack([u - 0.5, v - 0.5, np.zeros_like(u)], axis=-1)
    return _mesh_of_charts([_Chart(grid, np.stack([u, v], axis=-1))])


def sphere(segments: int = 32) -> Mesh:
    """A sphere of radius 1 about the origin: ``segments`` (even) bands between the poles, twice
    as many around.

    Two charts, one a hemisphere, in stereographic projection: conformal, the scale grows by 2
    from pole to equator, on average (by area) a photograph is 1 x 1 unit of length large. Both
    are laid so that their values agree along the equator: no seam can be seen.

    Raises ValueError for an odd number of segments or less than four.
    """
    _check_segments(segments, 4)
    if segments % 2:
        raise ValueError(f"segments is {segments}; expected an even number")
    polar = np.linspace(0.0, np.pi, segments + 1)[:, None]
    azimuth = -np.linspace(0.0, 2 * np.pi, 2 * segments + 1)  # clockwise from above
    across, along = np.cos(azimuth), np.sin(azimuth)
    across[-1], along[-1] = across[0], along[0]
    radius, height = np.sin(polar), np.cos(polar)
    radius[-1], height[segments // 2] = 0.0, 0.0
    grid = np.stack([radius * across, radius * along, height * np.ones_like(across)], axis=-1)
    north, south = grid[: segments // 2 + 1], grid[segments // 2 :]
    return _mesh_of_charts([_upper_disc(north), _lower_disc(south)])


def teapot(segments: int = 8) -> Mesh:
    """The Utah teapot (Newell 1975; see :mod:`pipelines.teapot_patches`), each of its 32 patches
    as ``segments`` x ``segments`` pairs of triangles.

    z is up, the spout points along +x; the middle of its box is the origin, the sphere about it
    has radius 1, and there a photograph is about 1 x 1 unit large. It has
    32 n² + 4 n + 2 positions: 2 082 for 8 segments, the vertices of the paper's teapot.

    Charts: the body and its rim as a cylinder in Mercator's projection, seam below the handle;
    bottom, lid and knob as discs; handle and spout as tubes, seam on their inner and lower
    sides. Lid, body, handle and spout are four surfaces that are not joined, open at the rims
    and inside the body, as Newell left them.

    Raises ValueError for less than two segments.
    """
    _check_segments(segments, 2)
    pot = _mesh_of_charts(
        [
            _upright_cylinder(_swept((RIM, UPPER_BODY, LOWER_BODY), segments)),
            _lower_disc(_swept((BOTTOM,), segments)),
            _upper_disc(_swept((KNOB,), segments)),
            _upper_disc(_swept((LID,), segments)),
            _tube(_closed_ring(HANDLE, segments, first_column=0)),
            _tube(_closed_ring(SPOUT, segments, first_column=segments)),
        ]
    )
    vertices = (pot.vertices - _TEAPOT_CENTRE) / _TEAPOT_RADIUS
    return Mesh(vertices, pot.triangles, pot.uvs / _TEAPOT_RADIUS, pot.normals)


def _check_segments(segments: int, least: int) -> None:
    if segments < least:
        raise ValueError(f"segments is {segments}; expected at least {least}")


# --- Grids --------------------------------------------------------------------------------------
# A grid is (rows, columns, 3): positions, seen from outside row by row downwards and columns to
# the left (or that, turned). Rows of closed surfaces end where they begin; a row at a pole
# repeats one position.


def _bezier(control: NDArray[np.float64], segments: int) -> NDArray[np.float64]:
    """Points (segments + 1, segments + 1, 3) of a bicubic patch's control points (4, 4, 3).

    Summed term by term, in one order for all points: patches meet to the last bit.
    """
    t = np.linspace(0.0, 1.0, segments + 1)
    weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3)
    rows = sum(w[:, None] * control[:, None, j] for j, w in enumerate(weights))
    points: NDArray[np.float64] = sum(w[:, None, None] * rows[i] for i, w in enumerate(weights))
    return points


def _rows_joined(patches: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.concatenate([patches[0], *(patch[1:] for patch in patches[1:])])


def _swept(profiles: Sequence[Profile], segments: int) -> NDArray[np.float64]:
    """Swept patches, one below the other, all around, clockwise from -x."""
    quarter = _rows_joined([_bezier(swept_quarter(p), segments) for p in profiles])
    x, y, z = np.moveaxis(quarter, -1, 0)
    turned = [(-x, -y), (-y, x), (x, y), (y, -x)]  # turns by quarters are exact
    sides = [np.stack([*xy, z], axis=-1) for xy in turned]
    return np.concatenate([sides[0], *(side[:, 1:] for side in sides[1:])], axis=1)


def _closed_ring(
    halves: NDArray[np.float64], segments: int, first_column: int
) -> NDArray[np.float64]:
    """Patches of one half of a tube, one after the other, and their mirror image in y."""
    half = _rows_joined([_bezier(patch, segments) for patch in halves])
    other = half[:, -2:0:-1] * [1, -1, 1]
    ring = np.roll(np.concatenate([half, other], axis=1), -first_column, axis=1)
    return np.concatenate([ring, ring[:, :1]], axis=1)


# --- Charts -------------------------------------------------------------------------------------


class _Chart(NamedTuple):
    """A grid and its texture coordinates (rows, columns, 2)."""

    grid: NDArray[np.float64]
    uvs: NDArray[np.float64]


def _upright_cylinder(grid: NDArray[np.float64]) -> _Chart:
    """Mercator's projection of a surface swept around the z axis: conformal."""
    radius = np.hypot(grid[..., 0], grid[..., 1]).mean(axis=1)
    heights = -_running_sum(2 * _steps_down(grid) / (radius[1:] + radius[:-1]))
    angles = np.unwrap(np.arctan2(grid[..., 1] + 0.0, grid[..., 0]), axis=1)
    return _to_scale(grid, np.stack(np.broadcast_arrays(angles, heights[:, None]), axis=-1))


def _upper_disc(grid: NDArray[np.float64]) -> _Chart:
    """A surface swept around the z axis, from its pole or innermost circle down, as a disc.

    The distance p from the middle grows by dp/ds = sqrt(p / r) along the profile s at radius r,
    half-way (geometrically) between equal distances (1) and a conformal chart (p / r), which
    would swell where a surface falls steeply.
    """
    across = np.hypot(grid[..., 0], grid[..., 1])
    root = np.sqrt(across.mean(axis=1))
    distance = (root[0] + _running_sum(_steps_down(grid) / (root[1:] + root[:-1]))) ** 2
    direction = grid[..., :2] / np.maximum(across, np.finfo(float).tiny)[..., None]
    return _to_scale(grid, distance[:, None, None] * direction)


def _lower_disc(grid: NDArray[np.float64]) -> _Chart:
    """The same for a surface that ends in its lower pole; mirrored, as it is seen from below."""
    uvs = _upper_disc(grid[::-1]).uvs[::-1]
    return _Chart(grid, uvs * [-1, 1])


def _tube(grid: NDArray[np.float64]) -> _Chart:
    """Around a tube u is the arc length from the middle column, so that the chart narrows where
    the tube does; along it v is the rings' mean distance."""
    around = np.linalg.norm(np.diff(grid, axis=1), axis=-1)
    passed = np.pad(np.cumsum(around, axis=1), ((0, 0), (1, 0)))
    u = passed[:, -1:] / 2 - passed
    v = -_running_sum(_steps_down(grid))[:, None]
    return _to_scale(grid, np.stack(np.broadcast_arrays(u, v), axis=-1))


def _steps_down(grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean distances (rows - 1,) from row to row."""
    steps: NDArray[np.float64] = np.linalg.norm(np.diff(grid, axis=0), axis=-1).mean(axis=1)
    return steps


def _running_sum(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([[0.0], np.cumsum(steps)])


def _to_scale(grid: NDArray[np.float64], uvs: NDArray[np.float64]) -> _Chart:
    """Scaled about 0 so that the chart has the area of the surface."""
    faces = _grid_triangles(*grid.shape[:2])
    flat = np.pad(uvs, ((0, 0), (0, 0), (0, 1))).reshape(-1, 3)
    area, chart_area = (
        _length(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])).sum()
        for c in (grid.reshape(-1, 3)[faces], flat[faces])
    )
    return _Chart(grid, uvs * np.sqrt(area / chart_area))


def _grid_triangles(rows: int, columns: int) -> NDArray[np.int64]:
    numbers = np.arange(rows * columns).reshape(rows, columns)
    a, b = numbers[:-1, :-1], numbers[:-1, 1:]
    d, c = numbers[1:, :-1], numbers[1:, 1:]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def _mesh_of_charts(charts: Sequence[_Chart]) -> Mesh:
    """One mesh; within a chart, vertices alike in position and texture coordinates are one, and
    the triangles at poles that this leaves without area are dropped."""
    vertices, triangles, uvs, count = [], [], [], 0
    for chart in charts:
        rows = np.concatenate([chart.grid, chart.uvs], axis=-1).reshape(-1, 5) + 0.0  # no -0.0
        _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        order = np.argsort(first)  # the grid's order, not that of the values
        renumbered = np.argsort(order)[number.reshape(-1)]
        faces = renumbered[_grid_triangles(*chart.grid.shape[:2])]
        distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        vertices.append(rows[first[order], :3])
        uvs.append(rows[first[order], 3:])
        triangles.append(faces[distinct] + count)
        count += len(first)
    return make_mesh(np.concatenate(vertices), np.concatenate(triangles), np.concatenate(uvs))
