"""Solids to be made of glass: a plate, and the Utah teapot with walls."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.meshes import grid_triangles
from pipelines.geometry.solids import Solid, make_closed_mesh, make_solid
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

if TYPE_CHECKING:
    from manifold3d import Manifold

# Of the teapot's parts, in degrees: the lid's rim and the groove around it are sharper, the
# profiles of its round parts, in few segments, are not.
_PARTS_CREASE = 60.0

# How far handle and spout go on into the body, in radii of the teapot: deep enough to cross all
# of the thickest wall, while both ends of the handle stay under its surface.
_DEPTH_OF_JOINTS = 0.1


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

    >>> solid = glass_teapot(segments=4)
    >>> solid.vertices.shape, solid.corner_normals.shape
    ((872, 3), (1744, 3, 3))
    """
    if segments < 4:
        raise ValueError(f"segments is {segments}; expected at least 4")
    if not 0.005 <= thickness <= 0.08:
        raise ValueError(f"thickness is {thickness} radii; expected 0.005 to 0.08")
    body = swept_grid((RIM, UPPER_BODY, LOWER_BODY, BOTTOM), segments)
    lid = swept_grid((LID,), segments)
    knob = swept_grid((KNOB,), segments)
    handle = tube_grid(HANDLE, segments, first_column=0)
    spout, bore = _spout(segments, thickness)

    pot = _as_manifold(np.concatenate([knob, lid[1:], body]))
    grip = _as_manifold(_capped(_rooted(_rooted(handle)[::-1])))
    hollow = _as_manifold(_hollow(np.concatenate([lid, body]), thickness), inside_out=True)
    # The bore's own wall lies within the spout's and vanishes in it: nothing has to coincide.
    return _as_solid(pot + grip - _as_manifold(bore) + _as_manifold(spout) - hollow)


# --- Parts of the teapot ------------------------------------------------------------------------
# Grids as in `grid_charts`.


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
    rings = tube_grid(SPOUT, segments, first_column=segments)
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

    solid = make_solid(grid.reshape(-1, 3), grid_triangles(*grid.shape[:2]), crease=_PARTS_CREASE)
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
    closed = make_closed_mesh(table[:, :3] - TEAPOT_CENTRE, same[corners])
    return Solid(closed.vertices, closed.triangles, normals.astype(np.float32))
