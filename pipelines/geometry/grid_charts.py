"""Charts: texture coordinates of surfaces that are grids, made for the built-in shapes.

The closed charts made here lie evenly about u = 0: their two ends show the same column, so that the
seam cannot be seen, also after the coordinates were scaled about 0 (for smaller fur, or a
photograph that is not square). Charts are nearly isometric, and seen from outside the photograph is
not mirrored but where it repeats (see `meshes`).

A grid is (rows, columns, 3): positions, seen from outside row by row downwards and columns to the
left (or that, turned). Rows of closed surfaces end where they begin; a row at a pole repeats one
position.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.meshes import Mesh, grid_triangles, make_mesh

_TINY = float(np.finfo(np.float64).tiny)


class Chart(NamedTuple):
    """A grid and its texture coordinates (rows, columns, 2)."""

    grid: NDArray[np.float64]
    uvs: NDArray[np.float64]


def cylinder_chart(grid: NDArray[np.float64]) -> Chart:
    """Mercator's projection of a surface swept around the z axis: conformal."""
    radius = np.hypot(grid[..., 0], grid[..., 1]).mean(axis=1)
    heights = -_running_sum(2 * _steps_down(grid) / (radius[1:] + radius[:-1]))
    angles = np.unwrap(np.arctan2(grid[..., 1] + 0.0, grid[..., 0]), axis=1)
    return _to_scale(grid, np.stack(np.broadcast_arrays(angles, heights[:, None]), axis=-1))


def upper_disc_chart(grid: NDArray[np.float64]) -> Chart:
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
    return Chart(grid, around_pole.uvs + 0.5)


def lower_disc_chart(grid: NDArray[np.float64]) -> Chart:
    """The same for a surface that ends in its lower pole. As it is seen from below, u has the
    other sign, which is the same column of the photograph."""
    uvs = upper_disc_chart(grid[::-1]).uvs[::-1]
    return Chart(grid, uvs * [-1, 1])


def tube_chart(grid: NDArray[np.float64]) -> Chart:
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
    doubled_area = np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=-1, keepdims=True)
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


def _to_scale(grid: NDArray[np.float64], uvs: NDArray[np.float64]) -> Chart:
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
    return Chart(grid, uvs * np.exp(0.5 * np.average(ratios, weights=area[there])))


def mesh_of_charts(charts: Sequence[Chart]) -> Mesh:
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
