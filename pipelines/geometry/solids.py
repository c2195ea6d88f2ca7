"""Closed triangle meshes with an inside, to be made of glass: a plate, a teapot, and files' meshes.

Light that is refracted has to know on which side of each surface the material lies: a ray must
enter and leave by turns. So the surfaces here have no border, cross no other, and are oriented
such that triangles are counter-clockwise seen from outside the material, which is the inside of a
cavity too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry import repair, shapes
from pipelines.geometry.teapot_patches import (
    BOTTOM,
    HANDLE,
    KNOB,
    LID,
    LOWER_BODY,
    RIM,
    SPOUT,
    UPPER_BODY,
)

if TYPE_CHECKING:
    from manifold3d import Manifold

# Of the teapot's parts, in degrees: the lid's rim and the groove around it are sharper, the
# profiles of its round parts, in few segments, are not.
_PARTS_CREASE = 60.0

# How far handle and spout go on into the body, in radii of the teapot: deep enough to cross all
# of the thickest wall, while both ends of the handle stay under its surface.
_DEPTH_OF_JOINTS = 0.1

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
    (F, 3) int32, counter-clockwise seen from outside the material."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]


# --- Closed meshes ------------------------------------------------------------------------------


def check_closed(vertices: ArrayLike, triangles: ArrayLike) -> ClosedMesh:
    """Make sure that a mesh encloses a volume, and orient it.

    vertices (V, 3), triangles (F, 3) integers. Vertices at equal positions are merged (files
    split them along the seams of their texture coordinates), those in no triangle are dropped,
    and so are triangles with two corners at one position. The others keep their order; those
    that have to be turned over have their second and third corner swapped.

    Of surfaces inside one another the outermost faces outwards, the next one into the cavity that
    it bounds, and so on by turns, however they faced. It is not checked that no surface crosses
    another or itself.

    Raises ValueError for arrays that are not a mesh (see `shapes.check_arrays`), for an open
    mesh, for edges in more than two triangles, for a surface with one side only (a Klein bottle)
    and for one that encloses no volume.
    """
    points, faces = np.array(vertices, np.float64), np.array(triangles)
    shapes.check_arrays(points, faces)
    points, faces = _welded(points, faces)
    surface = _oriented(faces)
    parts = _signed_volumes(points, faces)
    volume = np.bincount(surface, parts)
    # A flat surface's parts cancel out but for rounding; the least of bubbles leaves far more.
    flat = ~(np.abs(volume) > 1e-12 * np.bincount(surface, np.abs(parts)))
    if flat.any():
        raise ValueError(
            f"{int(flat.sum())} of {len(volume)} surfaces enclose no volume; "
            "expected surfaces around some material"
        )
    is_cavity = _depths(points, faces, surface) % 2 == 1
    repair.turn_over(faces, ((volume < 0) != is_cavity)[surface])
    return ClosedMesh(points, faces.astype(np.int32))


def make_solid(vertices: ArrayLike, triangles: ArrayLike, *, crease: float = 35.0) -> Solid:
    """A solid from a closed mesh, vertices (V, 3) and triangles (F, 3), as `check_closed` has it.

    A corner's normal is the mean, weighted by the angles at the vertex, of the normals of those
    triangles around the vertex that turn by at most ``crease`` degrees from the corner's own.
    Raises ValueError as `check_closed` does, and for a crease outside 0 to 180 degrees.
    """
    if not 0 <= crease <= 180:
        raise ValueError(f"crease is {crease} degrees; expected 0 to 180")
    mesh = check_closed(vertices, triangles)
    return Solid(*mesh, creased_normals(*mesh, crease).astype(np.float32))


def _welded(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    used, number = np.unique(triangles, return_inverse=True)
    positions, place = np.unique(vertices[used] + 0.0, axis=0, return_inverse=True)  # no -0.0
    faces = place.reshape(-1)[number.reshape(triangles.shape)]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if len(faces) == 0:
        raise ValueError("no triangle has three corners apart; expected a closed mesh")
    return positions, faces


def _oriented(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Turn triangles over, in place, until all neighbours agree; the surface (F,) each is part of.

    Raises ValueError where an edge is not shared by exactly two triangles, and for surfaces that
    have one side only.
    """
    edges = repair.edges(triangles)
    if (edges.uses > 2).any():
        raise ValueError(
            f"{int((edges.uses > 2).sum())} edges are in more than two triangles; "
            "expected two at each edge of a closed mesh"
        )
    if (edges.uses < 2).any():
        raise ValueError(
            f"the mesh is open along {int((edges.uses < 2).sum())} border edges; "
            "expected two triangles at each edge of a closed mesh"
        )
    surface, turned, one_sided = repair.sides(edges.pairs(), edges.forwards)
    if one_sided.any():
        raise ValueError(
            f"{int(one_sided.sum())} of {len(one_sided)} surfaces have one side only; "
            "expected an inside and an outside"
        )
    repair.turn_over(triangles, turned)
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
    parts = [triangles[surface == number] for number in range(surface.max() + 1)]
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
    by_triangle = shapes.angle_weighted_normals(vertices, triangles)
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


# --- Shapes -------------------------------------------------------------------------------------


def plate(width: float, depth: float, thickness: float) -> Solid:
    """A box of 12 triangles about the origin that stands upright: ``width`` along x, ``depth``
    along z, and ``thickness`` along y, so that it faces -y and +y.

    Raises ValueError for lengths that are not positive and finite.
    """
    size = np.array([width, thickness, depth], np.float64)
    if not (np.isfinite(size).all() and (size > 0).all()):
        raise ValueError(
            f"the plate is {width} x {depth} x {thickness}; expected positive, finite lengths"
        )
    from trimesh.creation import box  # takes half a second, and the teapot does without

    cuboid = box(extents=size)
    return make_solid(cuboid.vertices, cuboid.faces)


def glass_teapot(segments: int = 12, thickness: float = 0.035) -> Solid:
    """The Utah teapot blown from glass: one closed surface, placed as `shapes.teapot` is.

    z is up, the spout points along +x, and the sphere around the middle of its box has radius 1.
    Patches are divided into ``segments`` as there. Walls are ``thickness`` radii thick; lid and
    body are one, hollow together, the knob and the handle are solid. The spout's channel leads
    from its lip, which is as Newell left it, into the hollow; its walls are thinner where the
    spout is narrow.

    Normals are those of the parts, interpolated, and creased only at the groove around the lid,
    at the corners of the hollow below it and where parts meet.

    Raises ValueError for less than four segments or a thickness outside 0.005 to 0.08.
    """
    if segments < 4:
        raise ValueError(f"segments is {segments}; expected at least 4")
    if not 0.005 <= thickness <= 0.08:
        raise ValueError(f"thickness is {thickness} radii; expected 0.005 to 0.08")
    body = shapes.swept((RIM, UPPER_BODY, LOWER_BODY, BOTTOM), segments)
    lid = shapes.swept((LID,), segments)
    knob = shapes.swept((KNOB,), segments)
    handle = shapes.closed_ring(HANDLE, segments, first_column=0)
    spout, bore = _spout(segments, thickness)

    pot = _as_manifold(np.concatenate([knob, lid[1:], body]))
    grip = _as_manifold(_capped(_rooted(_rooted(handle)[::-1])))
    hollow = _as_manifold(_hollow(np.concatenate([lid, body]), thickness), inside_out=True)
    # The bore's own wall lies within the spout's and vanishes in it: nothing has to coincide.
    return _as_solid(pot + grip - _as_manifold(bore) + _as_manifold(spout) - hollow)


# --- Parts of the teapot ------------------------------------------------------------------------
# Grids as in pipelines.geometry.shapes.


def _hollow(outside: NDArray[np.float64], thickness: float) -> NDArray[np.float64]:
    """The grid of the hollow inside a swept grid (rows from its top, without the knob)."""
    from manifold3d import CrossSection, FillRule, JoinType

    profile = np.stack([np.hypot(*outside[:, 0, :2].T), outside[:, 0, 2]], axis=-1)
    whole = np.concatenate([profile, profile[::-1] * [-1, 1]])
    # Mitred: the hollow's corners below the groove are sharp like those of the groove.
    inset = CrossSection([whole], FillRule.NonZero).offset(-thickness, JoinType.Miter)
    half = inset ^ CrossSection.square((2.0, 2.0))
    (outline,) = half.simplify(thickness * 1e-3).to_polygons()
    # Counter-clockwise, begun where it leaves the axis at the bottom: from there up to the top.
    on_axis = outline[:, 0] < 1e-9
    lowest = np.argmin(np.where(on_axis, outline[:, 1], np.inf))
    radius, height = np.roll(np.where(on_axis[:, None], [0, 1], 1) * outline, -lowest, axis=0).T
    # Newell's circles are none: the hollow's are like them, for a wall as thick all around.
    widest = np.argmax(profile[:, 0])
    circle = outside[widest, :, :2] / profile[widest, 0]
    rows = [radius[::-1, None, None] * circle, np.tile(height[::-1, None, None], (len(circle), 1))]
    return np.concatenate(rows, axis=-1)


def _spout(segments: int, thickness: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Grids of the spout, a tube with its wall, and of what to drill out of the body for it."""
    rings = shapes.closed_ring(SPOUT, segments, first_column=segments)
    outer, lip = rings[: segments + 1], rings[segments + 1 :]
    middle = (outer[:, :1] + outer[:, segments : segments + 1]) / 2
    # Rings are wide in one direction and narrow in the other; both are shrunk by about the
    # thickness where there is room for it, and never to nothing.
    half = _half_widths(outer)
    shrunk = half / (half + thickness)
    # The lip ends in a ring of its own, with which the channel begins.
    at_lip = _half_widths(lip[-1:]) / half[-1]
    way = np.clip(np.linspace(2.0, 0.0, segments + 1), 0.0, 1.0)[:, None]
    scale = at_lip + (shrunk - at_lip) * way**2 * (3 - 2 * way)
    channel = middle + (outer - middle) * scale[:, None, [0, 1, 0]]
    channel[-1] = lip[-1]
    outer, channel = _rooted(outer), _rooted(channel)
    tube = np.concatenate([outer, lip, channel[-2::-1], outer[:1]])
    return tube, _capped((outer + channel) / 2)


def _half_widths(rings: NDArray[np.float64]) -> NDArray[np.float64]:
    """(rows, 2): in the plane of symmetry y = 0, and along y."""
    across = rings[:, 0] - rings[:, rings.shape[1] // 2]
    return np.stack([np.linalg.norm(across, axis=-1), np.ptp(rings[..., 1], axis=1)], axis=-1) / 2


def _rooted(tube: NDArray[np.float64]) -> NDArray[np.float64]:
    """A tube's grid with a ring more at its beginning, straight on from the first one."""
    back = (tube[0] - tube[1]).mean(axis=0)
    return np.concatenate([tube[:1] + _DEPTH_OF_JOINTS * back / np.linalg.norm(back), tube])


def _capped(tube: NDArray[np.float64]) -> NDArray[np.float64]:
    """A tube's grid with fans at both ends, rows of one position each."""
    ends = [np.broadcast_to(ring[:-1].mean(axis=0), ring.shape) for ring in (tube[0], tube[-1])]
    return np.stack([ends[0], *tube, ends[1]])


def _as_manifold(grid: NDArray[np.float64], *, inside_out: bool = False) -> Manifold:
    """A closed grid for boolean operations, which interpolate its normals where they cut it.

    ``inside_out`` are the normals of what is taken away, for they point out of what is left.
    """
    from manifold3d import Error, Manifold, Mesh64

    solid = make_solid(
        grid.reshape(-1, 3), shapes.grid_triangles(*grid.shape[:2]), crease=_PARTS_CREASE
    )
    normals = solid.corner_normals.reshape(-1, 3) * (-1 if inside_out else 1)
    corners = np.concatenate([solid.triangles.reshape(-1, 1), normals], axis=1)
    distinct, number = np.unique(corners, axis=0, return_inverse=True)
    position = distinct[:, 0].astype(np.int64)
    # Copies of a vertex that differ in their normals are one to the topology: the first of them.
    first = np.searchsorted(position, position)
    copies = np.flatnonzero(first != np.arange(len(first)))
    made = Manifold(
        Mesh64(
            np.concatenate([solid.vertices[position], distinct[:, 1:]], axis=1),
            number.reshape(-1, 3).astype(np.uint64),
            merge_from_vert=copies.astype(np.uint64),
            merge_to_vert=first[copies].astype(np.uint64),
        )
    )
    if made.status() != Error.NoError:
        raise AssertionError(f"a part of the teapot is not closed: {made.status()}")
    return made


def _as_solid(made: Manifold) -> Solid:
    """The result of boolean operations, moved to where the teapot is to stand."""
    mesh = made.to_mesh64()
    table, corners = mesh.vert_properties, mesh.tri_verts.astype(np.int64)
    same = np.arange(len(table))
    same[np.asarray(mesh.merge_from_vert, np.int64)] = mesh.merge_to_vert
    normals = table[corners, 3:]
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    closed = check_closed(table[:, :3] - shapes.TEAPOT_CENTRE, same[corners])
    return Solid(*closed, normals.astype(np.float32))
