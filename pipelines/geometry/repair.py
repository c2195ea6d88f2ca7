"""Triangle meshes from files made fit for tracing: merged, cleaned and consistently oriented.

Files split vertices along the seams of textures, repeat triangles, leave some without area and turn
some over. Here such a mesh becomes surfaces whose triangles agree on which side is outside; what
cannot be mended (borders, edges of many triangles, surfaces with one side) stays and is told.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry.mesh_edges import (
    MeshEdges,
    connected_components,
    consistent_orientation,
    first_rows,
    flip_triangles,
    mesh_edges,
)
from pipelines.geometry.meshes import check_mesh
from pipelines.geometry.rays import seen_from_outside

# More pairs of vertices within the tolerance than this, and than vertices, are not listed at once.
_MANY_PAIRS = 1_000_000

# Twice a triangle's area over the squared longest side, and a closed surface's volume over the
# sum of its parts' volumes: what rounding leaves of nothing. Slivers and bubbles have far more.
_NOTHING = 1e-12

# Straight lines from afar, and the share of those that meet an open piece in front up to which it
# is inside out. Into a scan's holes one looks with a hundredth of them, into a box without its lid
# with a sixth, and a sheet is met on either side by half of them.
_LINES = 1 << 15
_SELDOM = 0.05
_LEAST_LINES = 20
# The sum of a piece's areas as vectors over its area, which is how much of it is open: above this
# it is a sheet, of which one side may be hidden on purpose (a floor under houses), and no body.
_SHEET = 0.95

_EPSILON = float(np.finfo(np.float64).eps)
_TINY = float(np.finfo(np.float64).tiny)


class RepairedMesh(NamedTuple):
    """A mesh whose triangles agree with their neighbours.

    vertices: (V', 3) float64, each position once, all used, in the given order.
    triangles: (F', 3) int32, counter-clockwise from outside.
    kept: (F',) int64, the row of the given triangle that each is, ascending.
    corners: (F', 3) int64, the given vertex that each corner is: what files say of vertices that
        are one here (texture coordinates, colours) is found by it.
    notes: what was done or found, a sentence for each kind, with counts.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    kept: NDArray[np.int64]
    corners: NDArray[np.int64]
    notes: tuple[str, ...]


def repair_mesh(
    vertices: ArrayLike, triangles: ArrayLike, *, tolerance: float = 1e-7
) -> RepairedMesh:
    """Merge, clean and orient a triangle mesh.

    vertices (V, 3), in any unit; triangles (F, 3) integers; ``tolerance`` in diagonals of the box
    around the triangles.

    - Vertices at most the tolerance apart become one, at the first one's position, also in chains:
      the two sides of a texture's seam are one surface then. Vertices in no triangle are dropped.
    - Triangles with repeated corners or without area are dropped, and all but the first of those
      with the same three corners, in whatever order.
    - Triangles that share an edge with one other triangle are made to agree with it. What hangs
      together by such edges is a piece; edges in more than two triangles separate pieces.
    - A closed piece, without borders, faces outwards: it has positive volume. So cavities face
      into the material around them; `solids.make_closed_mesh` knows better. An open piece, and a
      closed one that is flat, faces where most of its area did, unless it is a body whose front
      is hardly ever seen from outside the mesh (a scan with holes that is inside out): it is turned
      over then. A piece with one side only (a Moebius strip) stays as it is.

    Triangles keep their order and their first corner; those that are turned over have their second
    and third swapped. A repaired mesh is not changed by another repair.

    Raises ValueError for arrays that are not a mesh (see `meshes.check_mesh`), for a negative
    or infinite tolerance, and for a mesh of which nothing is left.

    >>> from pipelines.geometry.shapes import square
    >>> flat = square(2)
    >>> triangles = flat.triangles.copy()
    >>> triangles[3] = triangles[3, ::-1]  # turned over
    >>> mesh = repair_mesh(flat.vertices, triangles)
    >>> mesh.triangles.shape, mesh.notes[0]
    ((8, 3), "1 triangle of open pieces turned over to face as most of their piece's area.")
    """
    mesh = clean_mesh(vertices, triangles, tolerance=tolerance)
    faces, notes = mesh.triangles.astype(np.int64), list(mesh.notes)
    turned = _orient(mesh.vertices, faces, notes)
    corners = mesh.corners.copy()
    flip_triangles(corners, turned)
    return mesh._replace(triangles=faces.astype(np.int32), corners=corners, notes=tuple(notes))


def clean_mesh(
    vertices: ArrayLike, triangles: ArrayLike, *, tolerance: float = 1e-7, flat: bool = False
) -> RepairedMesh:
    """Merge vertices and drop triangles as `repair_mesh` does, with the same arguments and errors,
    and leave all facing as they do; with ``flat``, keep triangles without area whose corners are
    three: dropped from a closed surface they would leave slits."""
    points, faces = np.array(vertices, np.float64), np.array(triangles)
    check_mesh(points, faces)
    if not 0 <= tolerance < np.inf:
        raise ValueError(f"tolerance is {tolerance}; expected a finite number of at least 0")
    notes: list[str] = []
    given = faces.astype(np.int64)
    points, faces = _merged(points, given, tolerance, notes)
    kept = _worth_keeping(points, faces, flat, notes)
    if len(kept) == 0:
        raise ValueError("no triangle has an area; expected at least one that has")
    points, faces = _compact(points, faces[kept])
    return RepairedMesh(points, faces.astype(np.int32), kept, given[kept], tuple(notes))


# --- Merging and dropping -----------------------------------------------------------------------


def _merged(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], tolerance: float, notes: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """One vertex for those at the same place, the first one; all of them in triangles."""
    points, faces = _compact(vertices + 0.0, triangles)  # no -0.0
    place = _equal_rows(points)
    apart = int(place.max()) + 1
    place = _joined(points, place, tolerance)
    first = first_rows(place)
    if merged := apart - len(first):
        things = _count(merged, "vertex", "vertices")
        notes.append(f"{things} merged with others within {tolerance:g} of the mesh's extent.")
    order = np.argsort(first)
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    return points[first[order]], number[place][faces]


def _joined(
    points: NDArray[np.float64], place: NDArray[np.int64], tolerance: float
) -> NDArray[np.int64]:
    """``place`` (V,), the numbers of the places that points (V, 3) are at, with one number for
    those places that are linked by steps of at most tolerance x extent."""
    from scipy.spatial import cKDTree

    low, high = points.min(axis=0), points.max(axis=0)
    step = tolerance * float(np.linalg.norm(high - low))
    if tolerance < _EPSILON or step == 0:
        return place
    while True:
        these = points[first_rows(place)] - low
        tree = cKDTree(these, balanced_tree=False)
        pairs = (tree.count_neighbors(tree, step) - len(these)) // 2
        if pairs == 0:
            return place
        if pairs > max(_MANY_PAIRS, len(these)):
            # Far more pairs than places: crowds. What shares a cell is near enough to be one, and
            # leaves fewer pairs.
            cell = _equal_rows(np.floor(these / (step / 2)))
            if cell.max() + 1 < len(these):
                place = cell[place]
                continue
        near = np.asarray(tree.query_pairs(step, output_type="ndarray"), np.int64)
        return connected_components(near, len(these))[place]


def _worth_keeping(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], flat: bool, notes: list[str]
) -> NDArray[np.int64]:
    """Rows of the triangles with an area, or with three corners if ``flat``, each set of three
    corners once."""
    three = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    kept = np.flatnonzero(three if flat else _have_areas(vertices, triangles))
    if dropped := len(triangles) - len(kept):
        things = _count(dropped, "triangle", "triangles")
        notes.append(f"{things} dropped: repeated corners or no area.")
    corners = np.sort(triangles[kept], axis=1)
    kept = kept[np.sort(first_rows(_equal_rows(corners)))]
    if repeated := len(corners) - len(kept):
        things = _count(repeated, "triangle", "triangles")
        notes.append(f"{things} dropped: the same corners as others.")
    return kept


def _have_areas(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(F,): whether the corners of each triangle are not on a line as far as doubles can tell,
    whose rounding at the vertices' own distance from the origin counts too."""
    scale = float(np.ptp(vertices, axis=0).max())
    if scale == 0:
        return np.zeros(len(triangles), bool)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    sides = [(b - a) / scale, (c - b) / scale, (a - c) / scale]
    longest = np.sqrt(np.max([np.einsum("fi,fi->f", side, side) for side in sides], axis=0))
    doubled = np.linalg.norm(np.cross(sides[0], sides[1]), axis=1)
    farthest = np.abs(vertices).max(axis=1)[triangles].max(axis=1)
    rounding = 2 * _EPSILON * farthest / scale
    has_area: NDArray[np.bool_] = doubled > longest * (_NOTHING * longest + rounding)
    return has_area


def _compact(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Without the vertices that are in no triangle."""
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    return vertices[used], (np.cumsum(used) - 1)[triangles]


def _equal_rows(rows: NDArray[np.float64] | NDArray[np.int64]) -> NDArray[np.int64]:
    """For rows (N, 3) a number (N,) that equal ones share, from 0 without gaps."""
    order = np.lexsort(rows.T)
    ordered = rows[order]
    differs = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.empty(len(rows), np.int64)
    number[order] = np.concatenate([[0], np.cumsum(differs)])[: len(rows)]
    return number


# --- Orienting ----------------------------------------------------------------------------------


def _orient(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], notes: list[str]
) -> NDArray[np.bool_]:
    """Turn triangles over, in place, as `repair_mesh` says; (F,): which of them."""
    edge = mesh_edges(triangles)
    piece, turned, one_sided = consistent_orientation(edge.pairs(), edge.forwards)
    turned &= ~one_sided[piece]
    area, volume = _areas_and_volumes(vertices, triangles, piece)
    volume = np.where(turned, -volume, volume)
    closed = _closed(edge, piece, turned) & ~one_sided
    signed, unsigned = np.bincount(piece, volume), np.bincount(piece, np.abs(volume))
    solid = closed & (np.abs(signed) > _NOTHING * unsigned)
    majority = np.bincount(piece, np.where(turned, -area, area))
    wrong = np.where(solid, signed < 0, majority < 0) & ~one_sided
    turned ^= wrong[piece]
    flip_triangles(triangles, turned)
    open_ones = ~solid & ~one_sided
    inside_out = np.zeros(len(solid), bool)
    if open_ones.any():
        inside_out = open_ones & _hardly_seen_in_front(vertices, triangles, piece)
        flip_triangles(triangles, inside_out[piece])
        turned ^= inside_out[piece]

    if outwards := int((turned & solid[piece]).sum()):
        things = _count(outwards, "triangle", "triangles")
        notes.append(f"{things} of closed pieces turned over to face outwards.")
    if outwards := int((turned & inside_out[piece]).sum()):
        things = _count(outwards, "triangle", "triangles")
        notes.append(f"{things} of open pieces turned over: they were seen from behind.")
    if agreeing := int((turned & (open_ones & ~inside_out)[piece]).sum()):
        things = _count(agreeing, "triangle", "triangles")
        notes.append(f"{things} of open pieces turned over to face as most of their piece's area.")
    if strips := int(one_sided.sum()):
        things = _count(strips, "piece has", "pieces have")
        notes.append(f"{things} one side only (like a Moebius strip): left as given.")
    if many := int((edge.uses > 2).sum()):
        things = _count(many, "edge is", "edges are")
        notes.append(f"{things} in more than two triangles: pieces end there.")
    if border := int((edge.uses == 1).sum()):
        things = _count(border, "border edge", "border edges")
        notes.append(f"the mesh is open along {things}.")
    return turned


def _hardly_seen_in_front(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], piece: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(pieces,): whether a piece is a body seen from behind by who looks at the mesh from afar."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    facing = np.cross(b - a, c - a)
    pieces = int(piece.max()) + 1
    total = np.stack([np.bincount(piece, axis, pieces) for axis in facing.T], axis=1)
    area = np.bincount(piece, np.linalg.norm(facing, axis=1), pieces)
    is_body = np.linalg.norm(total, axis=1) <= _SHEET * area
    if not is_body.any():
        return is_body
    seen = seen_from_outside(vertices, triangles, _LINES)
    front = np.einsum("ni,ni->n", facing[seen.triangle], seen.direction) < 0
    number = piece[seen.triangle]
    met = np.bincount(number, minlength=pieces)
    in_front = np.bincount(number[front], minlength=pieces)
    hardly: NDArray[np.bool_] = (met >= _LEAST_LINES) & (in_front <= _SELDOM * met) & is_body
    return hardly


def _closed(
    edge: MeshEdges, piece: NDArray[np.int64], turned: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(pieces,): whether a piece passes each of its edges as often in one sense as in the other.

    So a piece that only touches itself or another along an edge is closed: its volume is as
    well defined as that of one whose edges are in two triangles each.
    """
    closed = np.ones(piece.max() + 1, bool)
    number = np.repeat(np.arange(len(edge.uses)), edge.uses)
    odd = edge.uses[number] != 2  # where there are two they agree
    number, half_edge = number[odd], edge.half_edges[odd]
    triangle = half_edge // 3
    sense = np.where(edge.forwards[half_edge] != turned[triangle], 1, -1)
    key = number * len(closed) + piece[triangle]
    passed, place = np.unique(key, return_inverse=True)
    balance = np.bincount(place.reshape(-1), sense, len(passed))
    closed[passed[balance != 0] % len(closed)] = False
    return closed


def _areas_and_volumes(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], piece: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(F,) twice: doubled areas, and six times the volumes between triangles and a corner of their
    piece, in units of the mesh's size: small pieces far from the origin lose nothing."""
    scale = max(float(np.ptp(vertices, axis=0).max()), _TINY)
    corner = vertices[triangles[first_rows(piece), 0]][piece]
    a, b, c = ((vertices[triangles[:, k]] - corner) / scale for k in range(3))
    area: NDArray[np.float64] = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    volume: NDArray[np.float64] = np.einsum("fi,fi->f", a, np.cross(b, c))
    return area, volume


def _count(number: int, one: str, more: str) -> str:
    return f"{number} {one if number == 1 else more}"
