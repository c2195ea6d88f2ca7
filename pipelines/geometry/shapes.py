"""Triangle meshes to draw on: a square, a sphere, the Utah teapot, and what any mesh needs.

Texture coordinates (u, v) count photographs: (0, 0) is the bottom left and (1, 1) the top right
corner of one, u to the right. Outside [0, 1] the photograph is repeated, mirrored at every whole
number, which makes its value an even function of u. The closed charts made here lie evenly about
u = 0: their two ends show the same column, so that the seam cannot be seen, also after the
coordinates were scaled about 0 (for smaller fur, or a photograph that is not square). Charts are
nearly isometric, and seen from outside the photograph is not mirrored but where it repeats.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry.teapot_patches import (
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

# The middle of the box around Newell's teapot, and the radius of the sphere around that.
_NEWELL_CENTRE = np.array([0.21703756, 0.0, 1.575])
_NEWELL_RADIUS = 3.34029113

TEAPOT_CENTRE = _NEWELL_CENTRE / _NEWELL_RADIUS
"""(3,): the middle of the teapot's box, in the coordinates of its grids (see `swept`)."""

_TINY = float(np.finfo(np.float64).tiny)


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
    check_arrays(points, faces)
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
    weighted = angle_weighted_normals(vertices, triangles)
    own = np.zeros_like(vertices)
    np.add.at(own, triangles, weighted)
    shared = np.zeros_like(vertices)
    np.add.at(shared, position, own)
    summed = np.where(_length(shared[position]) > 1e-9, shared[position], own)
    length = _length(summed)
    normals: NDArray[np.float64] = np.where(
        length > 1e-9, summed / np.maximum(length, 1e-9), np.array([0.0, 0.0, 1.0])
    )
    return normals


def unwrap(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Texture coordinates for a mesh that has none, by xatlas.

    Returns vertices (V', 3), split along the charts' borders; triangles (F, 3) in the given
    order; and uvs (V', 2). Charts are nearly isometric: a photograph is a square as wide as the
    radius of the sphere around the mesh (about the middle of its box) everywhere. Their borders
    show as seams, and they may overlap on the photograph.

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
    faces = faces.astype(np.int64)
    return vertices[sources], faces, _not_mirrored(uvs * size / options.texels_per_unit, faces)


def _not_mirrored(uvs: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """Charts that show the photograph mirrored (xatlas does not care) turned over in place."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = triangles.ravel(), np.roll(triangles, 1, axis=1).ravel()
    links = coo_array((np.ones(triangles.size), pairs), shape=(len(uvs), len(uvs)))
    count, chart = connected_components(links, directed=False)
    a, b, c = np.moveaxis(uvs[triangles], 1, 0)
    doubled_area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    mirrored = np.bincount(chart[triangles[:, 0]], doubled_area, count) < 0
    left, right = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(left, chart, uvs[:, 0])
    np.maximum.at(right, chart, uvs[:, 0])
    turned = uvs.copy()
    turned[:, 0] = np.where(mirrored[chart], (left + right)[chart] - uvs[:, 0], uvs[:, 0])
    return turned


def check_arrays(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> None:
    """Raise ValueError unless vertices (V, 3) are finite and triangles (F, 3), at least one, are
    integers that refer to them."""
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


def angle_weighted_normals(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """(F, 3, 3): each triangle's unit normal times its angle at each corner; 0 without area."""
    corners = vertices[triangles]
    after = np.roll(corners, -1, axis=1) - corners
    before = np.roll(corners, 1, axis=1) - corners
    normal = np.cross(after, before)
    doubled_area = _length(normal)
    angle = np.arctan2(doubled_area, (after * before).sum(axis=-1, keepdims=True))
    weighted: NDArray[np.float64] = angle * normal / np.maximum(doubled_area, _TINY)
    return weighted


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
    u, v = np.meshgrid(steps[::-1], steps[::-1])  # downwards and to the left: see the grids below
    grid = np.stack([u - 0.5, v - 0.5, np.zeros_like(u)], axis=-1)
    return _mesh_of_charts([_Chart(grid, np.stack([u, v], axis=-1))])


def sphere(segments: int = 32) -> Mesh:
    """A sphere of radius 1 about the origin: ``segments`` (even) bands between the poles, twice
    as many around.

    Two charts, one a hemisphere: azimuthal projections about the poles, stretched by 1.34 at
    most, at the equator. On average a photograph is 1 x 1 unit of length large. They are laid
    so that the photograph's values agree along the equator: no seam can be seen.

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
    """The Utah teapot (Newell 1975; :mod:`pipelines.geometry.teapot_patches`), each of its patches
    as ``segments`` x ``segments`` pairs of triangles.

    z is up, the spout points along +x; the middle of its box is the origin, and the sphere around
    that has radius 1. A photograph is 1 x 1 unit of length large, on average over each chart.

    Body, lid, handle and spout are four surfaces, not joined, open at the rims and inside the
    body, as Newell left them; with n segments they have 32 n² + 4 n + 2 positions, for 8 the
    2082 vertices of the teapot in the fur paper. Charts add copies along their borders: the body
    is a cylinder in Mercator's projection, seam below the handle; bottom, lid and knob are
    discs; handle and spout tubes, seam on the inner and on the lower side.

    Raises ValueError for less than two segments.
    """
    _check_segments(segments, 2)
    side = _upright_cylinder(swept((RIM, UPPER_BODY, LOWER_BODY), segments))
    bottom = _lower_disc(swept((BOTTOM,), segments))
    knob = _upper_disc(swept((KNOB,), segments))
    lid = _upper_disc(swept((LID,), segments))
    handle = _tube(closed_ring(HANDLE, segments, first_column=0))
    spout = _tube(closed_ring(SPOUT, segments, first_column=segments))
    # Apart, as the handle's end touches the body in one of its vertices: each keeps its normal.
    surfaces = [_mesh_of_charts(c) for c in ([side, bottom], [knob, lid], [handle], [spout])]
    pot = _side_by_side(surfaces)
    vertices = pot.vertices - TEAPOT_CENTRE
    return Mesh(vertices, pot.triangles, pot.uvs, pot.normals)


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
    rows = np.zeros((4, segments + 1, 3))
    points = np.zeros((segments + 1, segments + 1, 3))
    for column, weight in enumerate(weights):
        rows += weight[:, None] * control[:, None, column]
    for row, weight in enumerate(weights):
        points += weight[:, None, None] * rows[row]
    return points


def _rows_joined(patches: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.concatenate([patches[0], *(patch[1:] for patch in patches[1:])])


def swept(profiles: Sequence[Profile], segments: int) -> NDArray[np.float64]:
    """Swept patches of the teapot, one below the other, all around, clockwise from -x.

    As a grid; z up, in units of the sphere around the teapot, which stands on z = 0.
    """
    controls = [swept_quarter(profile) / _NEWELL_RADIUS for profile in profiles]
    quarter = _rows_joined([_bezier(control, segments) for control in controls])
    quarter[..., 2] = quarter[:, :1, 2]  # without rounding errors: a pole is one position
    x, y, z = np.moveaxis(quarter, -1, 0)
    turned = [(-x, -y), (-y, x), (x, y), (y, -x)]  # turns by quarters are exact
    sides = [np.stack([*xy, z], axis=-1) for xy in turned]
    return np.concatenate([sides[0], *(side[:, 1:] for side in sides[1:])], axis=1)


def closed_ring(
    halves: NDArray[np.float64], segments: int, first_column: int
) -> NDArray[np.float64]:
    """A tube of the teapot, from the patches of its one half and their mirror image in y.

    As a grid in the coordinates of :func:`swept`, of 2 ``segments`` + 1 rows and columns; the
    halves' column ``first_column`` comes first.
    """
    half = _rows_joined([_bezier(control / _NEWELL_RADIUS, segments) for control in halves])
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
    would swell where a surface falls steeply. The pole is the middle of the photograph, clear of
    the mirrors: in a disc there is no seam to hide.
    """
    across = np.hypot(grid[..., 0], grid[..., 1])
    root = np.sqrt(across.mean(axis=1))
    distance = (root[0] + _running_sum(_steps_down(grid) / (root[1:] + root[:-1]))) ** 2
    direction = grid[..., :2] / np.maximum(across, _TINY)[..., None]
    around_pole = _to_scale(grid, distance[:, None, None] * direction)
    return _Chart(grid, around_pole.uvs + 0.5)


def _lower_disc(grid: NDArray[np.float64]) -> _Chart:
    """The same for a surface that ends in its lower pole. As it is seen from below, u has the
    other sign, which is the same column of the photograph."""
    uvs = _upper_disc(grid[::-1]).uvs[::-1]
    return _Chart(grid, uvs * [-1, 1])


def _tube(grid: NDArray[np.float64]) -> _Chart:
    """A tube cut open along its first column, even about the middle column.

    Begins with the arc length around as u and the rings' mean distance along as v, which a bent
    or tapered tube shears, and relaxes that.
    """
    around = np.linalg.norm(np.diff(grid, axis=1), axis=-1)
    passed = np.pad(np.cumsum(around, axis=1), ((0, 0), (1, 0)))
    u = passed[:, -1:] / 2 - passed
    v = -_running_sum(_steps_down(grid))[:, None]
    plane = _relaxed(grid, u + 1j * v)
    middle = grid.shape[1] // 2
    axis = plane[-1, middle] - plane[0, middle]
    upright = (plane - plane[0, middle]) * -1j * abs(axis) / axis
    even = (upright - upright[:, ::-1].conj()) / 2
    return _to_scale(grid, np.stack([even.real, even.imag], axis=-1))


def _relaxed(
    grid: NDArray[np.float64], plane: NDArray[np.complex128], rounds: int = 20
) -> NDArray[np.complex128]:
    """A chart (rows, columns) u + i v, made as rigid as possible: by turns, the rotation that fits
    each triangle best, and the chart that fits all rotated triangles best (Liu et al., "A
    local/global approach to mesh parameterization", 2008, section 4)."""
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import factorized

    start = grid_triangles(*grid.shape[:2])
    end = np.roll(start, -1, axis=1)
    points = grid.reshape(-1, 3)
    edge = points[end] - points[start]
    length = np.linalg.norm(edge, axis=-1)
    doubled_area = _length(np.cross(edge[:, 0], edge[:, 1]))
    # The cotangent of the angle opposite to each edge. Obtuse angles count as right ones (and a
    # little more, to keep the system regular): negative weights could turn triangles over.
    cosines = -np.einsum("fei,fei->fe", np.roll(edge, -1, axis=1), np.roll(edge, -2, axis=1))
    weight = np.maximum(cosines / doubled_area, 0.02)
    # Each triangle's edges when it is laid flat, the first one along the real axis.
    turn = np.arctan2(doubled_area[:, 0], np.einsum("fi,fi->f", edge[:, 0], edge[:, 1]))
    second = length[:, 1] * np.exp(1j * turn)
    flat = np.stack([length[:, 0] + 0j, second, -length[:, 0] - second], axis=1)

    count = len(points)
    rows, columns = (
        np.concatenate([a.ravel() for a in pair])
        for pair in ((start, end, start, end), (start, end, end, start))
    )
    values = np.concatenate([weight.ravel()] * 2 + [-weight.ravel()] * 2)
    laplacian = coo_array((values, (rows, columns)), shape=(count, count)).tocsc()
    solve = factorized(laplacian[1:, 1:])  # the first vertex stays at 0
    chart = plane.ravel()
    for _ in range(rounds):
        fit = (weight * flat.conj() * (chart[end] - chart[start])).sum(axis=1, keepdims=True)
        wanted = weight * flat * fit / np.abs(fit)
        sums = np.zeros(count, complex)
        np.add.at(sums, end, wanted)
        np.add.at(sums, start, -wanted)
        chart = np.concatenate([[0.0], solve(sums.real[1:]) + 1j * solve(sums.imag[1:])])
    return chart.reshape(plane.shape)


def _steps_down(grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean distances (rows - 1,) from row to row."""
    steps: NDArray[np.float64] = np.linalg.norm(np.diff(grid, axis=0), axis=-1).mean(axis=1)
    return steps


def _running_sum(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([[0.0], np.cumsum(steps)])


def _to_scale(grid: NDArray[np.float64], uvs: NDArray[np.float64]) -> _Chart:
    """Scaled about 0 so that areas on the surface and in the chart agree, in the geometric mean
    over the surface: a few strongly stretched triangles then do not shrink all others."""
    faces = grid_triangles(*grid.shape[:2])
    flat = np.pad(uvs, ((0, 0), (0, 0), (0, 1)))
    area, chart_area = (
        np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1)
        for c in (grid.reshape(-1, 3)[faces], flat.reshape(-1, 3)[faces])
    )
    there = (area > 0) & (chart_area > 0)  # not where a pole takes up a side of a triangle
    ratios = np.log(area[there] / chart_area[there])
    return _Chart(grid, uvs * np.exp(0.5 * np.average(ratios, weights=area[there])))


def grid_triangles(rows: int, columns: int) -> NDArray[np.int64]:
    """Triangles (F, 3) of a grid's positions, numbered row by row; two to each of its cells."""
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
        faces = renumbered[grid_triangles(*chart.grid.shape[:2])]
        distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        vertices.append(rows[first[order], :3])
        uvs.append(rows[first[order], 3:])
        triangles.append(faces[distinct] + count)
        count += len(first)
    return make_mesh(np.concatenate(vertices), np.concatenate(triangles), np.concatenate(uvs))


def turned_up(vertices: ArrayLike) -> NDArray[np.float64]:
    """Vertices (V, 3) of a mesh whose up is +y, turned about x so that it is +z."""
    x, y, z = np.asarray(vertices, dtype=np.float64).T
    return np.stack([x, -z, y], axis=-1)


def texture_stretch(vertices: ArrayLike, triangles: ArrayLike, uvs: ArrayLike) -> float:
    """Median over the triangles of how far the texture is drawn out of shape; 1 = not at all.

    The ratio of the singular values of each triangle's map from texture to surface, weighted by
    the triangle's area. vertices (V, 3), triangles (F, 3), uvs (V, 2). Triangles without area on
    the texture count as infinitely stretched.
    """
    corners = np.asarray(triangles)
    points = np.asarray(vertices, dtype=np.float64)[corners]
    texels = np.asarray(uvs, dtype=np.float64)[corners]
    edges, steps = points[:, 1:] - points[:, :1], texels[:, 1:] - texels[:, :1]
    area = _length(np.cross(edges[:, 0], edges[:, 1]))
    flat = np.abs(np.linalg.det(steps)) <= 1e-14
    steps[flat] = np.eye(2)
    values = np.linalg.svd(np.linalg.solve(steps, edges), compute_uv=False)
    ratio = np.where(flat, np.inf, values[:, 0] / np.maximum(values[:, 1], 1e-300))
    order = np.argsort(ratio)
    middle = np.searchsorted(np.cumsum(area[order]), area.sum() / 2)
    return float(ratio[order][min(middle, len(order) - 1)])


def _side_by_side(meshes: Sequence[Mesh]) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(
            [mesh.triangles + np.int32(start) for mesh, start in zip(meshes, starts, strict=True)]
        ),
        np.concatenate([mesh.uvs for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
    )
