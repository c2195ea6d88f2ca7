"""Closed triangle meshes with an inside, to be made of glass.

Light that is refracted has to know on which side of each surface the material lies: a ray must
enter and leave by turns. So the surfaces here have no border, cross no other, and are oriented
such that triangles are counter-clockwise seen from outside the material, which is the inside of a
cavity too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry.lids import lids_over_holes
from pipelines.geometry.mesh_edges import consistent_orientation, flip_triangles, mesh_edges
from pipelines.geometry.meshes import angle_weighted_normals
from pipelines.geometry.repair import clean_mesh

_TINY = float(np.finfo(np.float64).tiny)


class Solid(NamedTuple):
    """A closed surface around some material.

    vertices: (V, 3) float64, each position once.
    triangles: (F, 3) int32, counter-clockwise seen from outside the material.
    corner_normals: (F, 3, 3) float32, unit shading normals of the triangles' corners, pointing
        out of the material; smooth but across creases.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    corner_normals: NDArray[np.float32]


class ClosedMesh(NamedTuple):
    """A closed, oriented surface: ``vertices`` (V, 3) float64, each position once; ``triangles``
    (F, 3) int32, counter-clockwise seen from outside the material; ``notes``, what was mended, a
    sentence each."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    notes: tuple[str, ...] = ()


# --- Closed meshes ------------------------------------------------------------------------------


def make_closed_mesh(vertices: ArrayLike, triangles: ArrayLike) -> ClosedMesh:
    """A mesh that encloses a volume, oriented; refused where it does not.

    vertices (V, 3), triangles (F, 3) integers: merged and cleaned as by `repair.repair_mesh`, but
    that triangles without area stay where the surface is not closed without them. The others keep
    their order; those that have to be turned over have their second and third corner swapped. Small
    holes get lids (see `lids.lids_over_holes`), after all other triangles.

    Of surfaces inside one another the outermost faces outwards, the next one into the cavity that
    it bounds, and so on by turns, however they faced. It is not checked that no surface crosses
    another or itself.

    Raises ValueError for arrays that are not a mesh (see `meshes.check_mesh`), for an open
    mesh, for edges in more than two triangles, for a surface with one side only (a Klein bottle)
    and for one that encloses no volume.

    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> inside_out = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
    >>> mesh = make_closed_mesh(corners, inside_out)
    >>> bool(np.linalg.det(mesh.vertices[mesh.triangles]).sum() > 0)
    True
    """
    mesh = clean_mesh(vertices, triangles)
    if not _is_closed(mesh.triangles):
        with_flat = clean_mesh(vertices, triangles, flat=True)
        mesh = with_flat if _is_closed(with_flat.triangles) else mesh
    points, faces, notes = mesh.vertices, mesh.triangles.astype(np.int64), list(mesh.notes)
    lids = None if _is_closed(faces) else lids_over_holes(points, faces)
    if lids is not None:
        points = np.concatenate([points, lids.vertices])
        faces = np.concatenate([faces, lids.triangles])
        holes = f"{len(lids.vertices)} hole{'s' if len(lids.vertices) > 1 else ''}"
        notes.append(f"{holes} closed by lids, at most {lids.share:.2g} of a surface.")
    given = faces.copy()
    surface = _oriented(faces)
    parts = _signed_volumes(points, faces)
    volume = np.bincount(surface, parts)
    # A flat surface's parts cancel out but for rounding; the least of bubbles leaves far more.
    flat = ~(np.abs(volume) > 1e-12 * np.bincount(surface, np.abs(parts)))
    if flat.any():
        raise ValueError(
            f"{int(flat.sum())} of {len(volume)} surfaces enclose no volume; "
            "expected surfaces around some material: give a sheet some thickness"
        )
    is_cavity = _depths(points, faces, surface) % 2 == 1
    flip_triangles(faces, ((volume < 0) != is_cavity)[surface])
    turned = int((faces != given).any(axis=1).sum())
    if turned:
        things = f"{turned} triangle{'s' if turned > 1 else ''}"
        notes.append(f"{things} turned over to face out of the material.")
    return ClosedMesh(points, faces.astype(np.int32), tuple(notes))


def make_solid(vertices: ArrayLike, triangles: ArrayLike, *, crease: float = 35.0) -> Solid:
    """A solid from a mesh that `make_closed_mesh` accepts: vertices (V, 3), triangles (F, 3).

    A corner's normal is the mean, weighted by the angles at the vertex, of the normals of those
    triangles around the vertex that turn by at most ``crease`` degrees from the corner's own.
    Raises ValueError as `make_closed_mesh` does, and for a crease outside 0 to 180 degrees.
    """
    return smooth_solid(make_closed_mesh(vertices, triangles), crease)


def smooth_solid(mesh: ClosedMesh, crease: float = 35.0) -> Solid:
    """A closed mesh with the normals that `make_solid` gives it, and the same errors."""
    if not 0 <= crease <= 180:
        raise ValueError(f"crease is {crease} degrees; expected 0 to 180")
    normals = creased_normals(mesh.vertices, mesh.triangles, crease)
    return Solid(mesh.vertices, mesh.triangles, normals.astype(np.float32))


def _is_closed(triangles: NDArray[np.integer]) -> bool:
    return bool((mesh_edges(triangles.astype(np.int64)).uses == 2).all())


def _oriented(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Turn triangles over, in place, until all neighbours agree; the surface (F,) each is part of.

    Raises ValueError where an edge is not shared by exactly two triangles, and for surfaces that
    have one side only.
    """
    edges = mesh_edges(triangles)
    if (edges.uses > 2).any():
        raise ValueError(
            f"{int((edges.uses > 2).sum())} edges are in more than two triangles; "
            "expected two at each edge of a closed mesh: join parts that touch by a Boolean union, "
            "or remove non-manifold edges in Blender or MeshLab"
        )
    if (edges.uses < 2).any():
        raise ValueError(
            f"the mesh is open along {int((edges.uses < 2).sum())} border edges; "
            "expected two triangles at each edge of a closed mesh: fill its holes in Blender or "
            "MeshLab, or give a sheet some thickness"
        )
    surface, turned, one_sided = consistent_orientation(edges.pairs(), edges.forwards)
    if one_sided.any():
        raise ValueError(
            f"{int(one_sided.sum())} of {len(one_sided)} surfaces have one side only; "
            "expected an inside and an outside"
        )
    flip_triangles(triangles, turned)
    return surface


def _signed_volumes(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(F,): six times the volumes between the triangles and one point amid the vertices."""
    volumes: NDArray[np.float64] = np.linalg.det((vertices - vertices.mean(axis=0))[triangles])
    return volumes


def _depths(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], surface: NDArray[np.int64]
) -> NDArray[np.int64]:
    """How many other surfaces each one lies in."""
    ends = np.cumsum(np.bincount(surface))
    parts = np.split(triangles[np.argsort(surface, kind="stable")], ends[:-1])
    low = np.array([vertices[part].min(axis=(0, 1)) for part in parts])
    high = np.array([vertices[part].max(axis=(0, 1)) for part in parts])
    depths = np.zeros(len(parts), np.int64)
    for inner, part in enumerate(parts):
        around = ((low <= low[inner]) & (high >= high[inner])).all(axis=1)
        around[inner] = False
        # More than one vertex, in case that one touches the other surface.
        samples = vertices[part[:: max(len(part) // 8, 1), 0]]
        for outer in np.flatnonzero(around):
            turns = _winding_numbers(samples, vertices[parts[outer]])
            depths[inner] += np.median(np.abs(turns)) > 0.5
    return depths


def _winding_numbers(
    points: NDArray[np.float64], corners: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How often a closed surface of triangles' corners (F, 3, 3) winds around points (N, 3):
    (N,), 0 outside and 1 or -1 inside.

    The sum of the solid angles of the triangles (Van Oosterom and Strackee, "The solid angle of a
    plane triangle", 1983): unlike a ray it cannot slip through an edge.
    """
    numbers = np.empty(len(points))
    for row, point in enumerate(points):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = np.einsum("fi,fi->f", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("fi,fi->f", *pair) for pair in ((a, b), (b, c), (c, a)))
        angle = np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
        numbers[row] = angle.sum() / (2 * np.pi)
    return numbers


def creased_normals(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], crease: float
) -> NDArray[np.float64]:
    """Unit normals (F, 3, 3) of corners: see `make_solid`. Triangles without area join in with all
    around a vertex."""
    by_triangle = angle_weighted_normals(vertices, triangles)
    weighted, summed = by_triangle.reshape(-1, 3), by_triangle.sum(axis=1)
    face = summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), _TINY)
    own = face.repeat(3, axis=0)
    flat = (own == 0).all(axis=1)
    least = np.cos(np.radians(crease)) - 1e-9
    vertex = triangles.reshape(-1)
    by_vertex = np.argsort(vertex, kind="stable")
    count = np.bincount(vertex)
    begin = np.cumsum(count) - count
    total = np.zeros_like(weighted)
    # Round by round, each corner meets the next one around its vertex: all pairs in little memory.
    for turn in range(count.max()):
        corner = np.flatnonzero(count[vertex] > turn)
        other = by_vertex[begin[vertex[corner]] + turn]
        near = np.einsum("ij,ij->i", own[corner], own[other]) >= least
        near |= flat[corner]
        total[corner[near]] += weighted[other[near]]
    length = np.linalg.norm(total, axis=1, keepdims=True)
    fallback = np.where(flat[:, None], [0.0, 0.0, 1.0], own)
    normals = np.where(length > 1e-9, total / np.maximum(length, 1e-9), fallback)
    return normals.reshape(*triangles.shape, 3)
