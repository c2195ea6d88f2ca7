"""How hair lies on a body: a smooth field of directions along the surface.

The smoothest field that heeds its guides, after Knöppel et al., "Globally Optimal Direction Fields"
(2013): directions are complex numbers in a plane at each vertex, neighbours are compared after the
plane of one is turned into that of the other, and what is minimised is their squared differences
plus the squared differences from the guides. Unlike an average of angles this is linear, and puts
singularities where the guides and the surface's shape leave least to pay. There are always some on
a closed body other than a torus: their indices add up to its Euler characteristic (Poincaré, Hopf).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import edge_vertices
from pipelines.geometry.meshes import joined_vertices

Complex = NDArray[np.complex128]

_LEAST_GUIDE = 1e-3
"""Of the strongest guide: without any the field would not be determined."""


class LieField(NamedTuple):
    """How hair lies."""

    tangents: NDArray[np.float64]
    """(V, 3), unit, across the normals: where tips point."""
    singular_triangles: NDArray[np.int64]
    """(S,): triangles about whose middle the direction turns round."""
    indices: NDArray[np.int64]
    """(S,): how often; 1 for a crown, -1 for a saddle."""


def lie_field(
    vertices: NDArray[np.floating],
    normals: NDArray[np.floating],
    triangles: NDArray[np.integer],
    guides: NDArray[np.floating],
    smoothness: float,
) -> LieField:
    """The smoothest directions that heed ``guides``.

    vertices, normals (V, 3): copies of a vertex have equal coordinates and normals. triangles
    (F, 3). guides (V, 3): wanted directions; what is along the normal is left out, and longer ones
    count for more. smoothness: a length in mesh units: shorter turns of the guides are evened out.
    Raises ValueError for a smoothness that is not positive, and without any guide.

    >>> from pipelines.geometry.shapes import square
    >>> flat = square(4)
    >>> east = np.tile([1.0, 0.0, 0.5], (len(flat.vertices), 1))
    >>> lie = lie_field(flat.vertices, flat.normals, flat.triangles, east, smoothness=0.1)
    >>> lie.tangents[0, :2].round(6).tolist(), lie.indices.tolist()
    ([1.0, 0.0], [])
    """
    if not smoothness > 0:
        raise ValueError(f"smoothness is {smoothness:g}; expected a positive length.")
    first, position = joined_vertices(vertices, normals)
    frames = _frames(normals[first])
    wanted = _in_planes(guides, position, frames)
    longest = np.abs(wanted).max(initial=0.0)
    if longest <= 1e-12:
        raise ValueError("guides are all along the normals; expected directions on the surface.")
    corners = position[triangles].astype(np.int64)
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    field = _smoothest(vertices[first], corners, frames, wanted / longest, smoothness)
    places, indices = _singularities(field, position[triangles].astype(np.int64), frames)
    across, along = frames[:, 0], frames[:, 1]
    directions = field.real[:, None] * across + field.imag[:, None] * along
    return LieField(directions[position], places, indices)


def nose_to_tail(vertices: NDArray[np.floating]) -> NDArray[np.float64]:
    """Unit vector (3,) from the nose of a body to its tail, as most bodies have them: along the
    longer side of its box on the ground, away from where it is higher."""
    points = np.asarray(vertices, np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    axis = int(np.argmax((high - low)[:2] * (1.0, 1.0 - 1e-9)))
    share = (points[:, axis] - low[axis]) / max(high[axis] - low[axis], 1e-30)
    ahead, behind = points[share > 0.75, 2], points[share < 0.25, 2]
    way = np.zeros(3)
    way[axis] = -1.0 if ahead.max() > behind.max() + 1e-6 * (high[2] - low[2]) else 1.0
    return way


def guides_backwards(
    normals: NDArray[np.floating], backwards: NDArray[np.floating], gravity: float = 0.5
) -> NDArray[np.float64]:
    """Guides (V, 3) from nose to tail and, by a share ``gravity``, downwards: as most animals have
    it. ``backwards`` (3,): from the nose to the tail.

    Where the surface faces the nose or the tail the guides are short, and the rest decides.
    """
    way = np.asarray(backwards, np.float64)
    wanted = way / np.linalg.norm(way) + gravity * np.array([0.0, 0.0, -1.0])
    wanted = wanted / np.linalg.norm(wanted)
    upright = np.asarray(normals, np.float64)
    along: NDArray[np.float64] = wanted - (upright @ wanted)[:, None] * upright
    return along


# ---- planes ----------------------------------------------------------------------------------


def _frames(normals: NDArray[np.floating]) -> NDArray[np.float64]:
    """(P, 3, 3): two unit vectors across each normal, and the normal; right-handed."""
    x, y, z = np.asarray(normals, np.float64).T
    sign = np.where(z < 0, -1.0, 1.0)
    turn = -1.0 / (sign + z)
    across = np.stack([1.0 + sign * x * x * turn, sign * x * y * turn, -sign * x], axis=-1)
    along = np.stack([x * y * turn, sign + y * y * turn, -y], axis=-1)
    return np.stack([across, along, np.stack([x, y, z], axis=-1)], axis=1)


def _in_planes(
    guides: NDArray[np.floating], position: NDArray[np.int64], frames: NDArray[np.float64]
) -> Complex:
    """Mean guide (P,) of each position's copies, in its plane."""
    count = len(frames)
    summed = np.stack([np.bincount(position, guides[:, axis], count) for axis in range(3)], -1)
    mean = summed / np.bincount(position, minlength=count)[:, None]
    found: Complex = np.einsum("pi,pi->p", mean, frames[:, 0]) + 1j * np.einsum(
        "pi,pi->p", mean, frames[:, 1]
    )
    return found


def _turns(
    frames: NDArray[np.float64], begin: NDArray[np.int64], end: NDArray[np.int64]
) -> Complex:
    """(E,): by what a direction at ``begin`` is multiplied to be the one at ``end``, its plane
    turned by the least rotation that takes one normal to the other."""
    here, there = frames[begin], frames[end]
    axis = np.cross(here[:, 2], there[:, 2])
    cosine = np.einsum("ei,ei->e", here[:, 2], there[:, 2])
    across = here[:, 0]
    share = np.einsum("ei,ei->e", axis, across) / np.maximum(1.0 + cosine, 1e-9)
    moved = cosine[:, None] * across + np.cross(axis, across) + share[:, None] * axis
    turned = np.einsum("ei,ei->e", moved, there[:, 0]) + 1j * np.einsum(
        "ei,ei->e", moved, there[:, 1]
    )
    found: Complex = turned / np.maximum(np.abs(turned), 1e-30)
    return found


# ---- the field -------------------------------------------------------------------------------


def _smoothest(
    points: NDArray[np.floating],
    triangles: NDArray[np.int64],
    frames: NDArray[np.float64],
    wanted: Complex,
    smoothness: float,
) -> Complex:
    """Unit directions (P,): solves (A W + s^2 L) z = A W g for areas A, guides' weights W and the
    Laplacian L of turned neighbours."""
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import splu

    count = len(points)
    area, edges, weights = _areas_and_weights(points, triangles)
    begin, end = edges.T
    turn = _turns(frames, begin, end)
    rows = np.concatenate([begin, end, begin, end])
    columns = np.concatenate([begin, end, end, begin])
    values = np.concatenate([weights, weights, -weights * turn.conj(), -weights * turn])
    laplacian = coo_array((values, (rows, columns)), shape=(count, count)).tocsc()
    heed = area * np.maximum(np.abs(wanted), _LEAST_GUIDE)
    right = area * wanted
    system = (diags_array(heed) + smoothness**2 * laplacian).tocsc()
    field: Complex = splu(system).solve(right)
    unit: Complex = np.where(np.abs(field) > 1e-12, field / np.maximum(np.abs(field), 1e-30), 1.0)
    return unit


def _areas_and_weights(
    points: NDArray[np.floating], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Area (P,) of each vertex, edges (E, 2), and their cotangent weights (E,), none negative."""
    from scipy.sparse import coo_array

    corners = points[triangles]
    after = np.roll(corners, -1, axis=1) - corners
    before = np.roll(corners, 1, axis=1) - corners
    doubled = np.linalg.norm(np.cross(after, before), axis=-1)
    cotangents = np.einsum("fci,fci->fc", after, before) / np.maximum(doubled, 1e-30)
    area = np.bincount(triangles.ravel(), np.repeat(doubled[:, 0] / 6, 3), len(points))
    area = np.maximum(area, 1e-6 * area.max())
    edges = edge_vertices(triangles)
    opposite = np.sort(np.stack([np.roll(triangles, -1, 1), np.roll(triangles, 1, 1)], -1), axis=-1)
    pairs = opposite.reshape(-1, 2)
    summed = coo_array((cotangents.ravel() / 2, pairs.T), shape=(len(points),) * 2).tocsr()
    found = np.asarray(summed[edges[:, 0], edges[:, 1]]).reshape(-1)
    return area, edges, np.maximum(found, 1e-3)


def _singularities(
    field: Complex, triangles: NDArray[np.int64], frames: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles about which the field turns round, and how often.

    Around a triangle the field's turns against its neighbours' planes, plus the turn of the planes
    themselves, are a multiple of a whole turn.
    """
    turned, curved = np.zeros(len(triangles)), np.ones(len(triangles), np.complex128)
    for corner in range(3):
        begin, end = triangles[:, corner], triangles[:, (corner + 1) % 3]
        turn = _turns(frames, begin, end)
        turned += np.angle(field[end] / (turn * field[begin]))
        curved *= turn
    index = np.rint((turned + np.angle(curved)) / (2 * np.pi)).astype(np.int64)
    (places,) = np.nonzero(index)
    return places, index[places]
