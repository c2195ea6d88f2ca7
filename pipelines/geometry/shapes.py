"""Triangle meshes to draw on: a square, a sphere, the Utah teapot; texture coordinates as `meshes`
and `grid_charts` have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipelines.geometry.grid_charts import (
    Chart,
    cylinder_chart,
    lower_disc_chart,
    mesh_of_charts,
    tube_chart,
    upper_disc_chart,
)
from pipelines.geometry.meshes import Mesh
from pipelines.geometry.teapot_patches import (
    BOTTOM,
    HANDLE,
    KNOB,
    LID,
    LOWER_BODY,
    RIM,
    SPOUT,
    TEAPOT_CENTRE,
    UPPER_BODY,
    swept_grid,
    tube_grid,
)


def square(segments: int = 1) -> Mesh:
    """A unit square in the plane z = 0 about the origin, facing +z, ``segments`` x ``segments``
    pairs of triangles; it shows exactly one photograph, upright seen from +z.

    Raises ValueError for less than one segment.
    """
    _check_segments(segments, 1)
    steps = np.linspace(0.0, 1.0, segments + 1)
    u, v = np.meshgrid(steps[::-1], steps[::-1])  # downwards and to the left: see `grid_charts`
    grid = np.stack([u - 0.5, v - 0.5, np.zeros_like(u)], axis=-1)
    return mesh_of_charts([Chart(grid, np.stack([u, v], axis=-1))])


def sphere(segments: int = 32) -> Mesh:
    """A sphere of radius 1 about the origin: ``segments`` (even) bands between the poles, twice
    as many around.

    Two charts, one a hemisphere: azimuthal projections about the poles, stretched by 1.34 at
    most, at the equator. On average a photograph is 1 x 1 unit of length large. They are laid
    so that the photograph's values agree along the equator: no seam can be seen.

    Raises ValueError for an odd number of segments or less than four.

    >>> mesh = sphere(segments=8)
    >>> mesh.vertices.shape, mesh.triangles.shape
    ((130, 3), (224, 3))
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
    return mesh_of_charts([upper_disc_chart(north), lower_disc_chart(south)])


def teapot(segments: int = 8) -> Mesh:
    """The Utah teapot (Newell 1975; `teapot_patches`), each of its patches
    as ``segments`` x ``segments`` pairs of triangles.

    z is up, the spout points along +x; the middle of its box is the origin, and the sphere around
    that has radius 1. A photograph is 1 x 1 unit of length large, on average over each chart.

    Body, lid, handle and spout are four surfaces, not joined, open at the rims and inside the
    body, as Newell left them; with n segments they have 32 n² + 4 n + 2 positions, for 8 the
    2082 vertices of the teapot in the fur paper. Charts add copies along their borders: the body
    is a cylinder in Mercator's projection, seam below the handle; bottom, lid and knob are
    discs; handle and spout tubes, seam on the inner and on the lower side.

    Raises ValueError for less than two segments.

    >>> mesh = teapot(segments=8)
    >>> mesh.vertices.shape, mesh.triangles.shape, mesh.uvs.shape
    ((2205, 3), (4032, 3), (2205, 2))
    """
    _check_segments(segments, 2)
    side = cylinder_chart(swept_grid((RIM, UPPER_BODY, LOWER_BODY), segments))
    bottom = lower_disc_chart(swept_grid((BOTTOM,), segments))
    knob = upper_disc_chart(swept_grid((KNOB,), segments))
    lid = upper_disc_chart(swept_grid((LID,), segments))
    handle = tube_chart(tube_grid(HANDLE, segments, first_column=0))
    spout = tube_chart(tube_grid(SPOUT, segments, first_column=segments))
    # Apart, as the handle's end touches the body in one of its vertices: each keeps its normal.
    surfaces = [mesh_of_charts(c) for c in ([side, bottom], [knob, lid], [handle], [spout])]
    pot = _side_by_side(surfaces)
    vertices = pot.vertices - TEAPOT_CENTRE
    return Mesh(vertices, pot.triangles, pot.uvs, pot.normals)


def _check_segments(segments: int, least: int) -> None:
    if segments < least:
        raise ValueError(f"segments is {segments}; expected at least {least}")


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
