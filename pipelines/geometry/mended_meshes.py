"""Meshes of users for what takes texture coordinates: repaired, and mapped where they are not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.geometry.meshes import Mesh, check_mesh, make_mesh
from pipelines.geometry.repair import RepairedMesh, repair_mesh
from pipelines.geometry.texture_coordinates import texture_stretch, unwrap

MOST_STRETCH = 3.0
"""Median ratio of a texture's stretch along and across, up to which it is used as it is."""

_NOTHING = 1e-12  # twice a triangle's area on the texture over its longest side squared


class MendedMesh(NamedTuple):
    """``mesh``, and what was mended: ``notes``, one sentence for each kind."""

    mesh: Mesh
    notes: tuple[str, ...]


def mend_mesh(
    vertices: ArrayLike, triangles: ArrayLike, uvs: ArrayLike | None = None
) -> MendedMesh:
    """Repair a mesh (see `repair.repair_mesh`), and give it texture coordinates where it has none.

    ``vertices`` (V, 3), ``triangles`` (F, 3) integers, ``uvs`` (V, 2) as `meshes.Mesh` has them,
    not finite where there are none, or None. Triangles without an area on the texture are
    unwrapped anew, at the others' scale; all are, if these are most of the surface or if the
    texture is stretched beyond ``MOST_STRETCH``. Normals are smooth across seams. Raises
    ValueError as `repair_mesh`, and for uvs of another shape.

    >>> from pipelines.geometry.shapes import square
    >>> flat = square(2)
    >>> mesh, notes = mend_mesh(flat.vertices, flat.triangles, flat.uvs * 0.0)
    >>> notes[-1]
    'Its texture coordinates have no area: unwrapped anew.'
    """
    points, faces = np.array(vertices, np.float64), np.asarray(triangles)
    check_mesh(points, faces)
    mended = _from_lowest_corner(repair_mesh(points, faces))
    notes = list(mended.notes)
    if uvs is None:
        corner_uvs = _unwrapped(mended.vertices, mended.triangles)
    else:
        given = np.array(uvs, np.float64)
        if given.shape != (len(points), 2):
            raise ValueError(f"uvs have the shape {given.shape}; expected ({len(points)}, 2)")
        corner_uvs = _mapped(mended.vertices, mended.triangles, given[mended.corners], notes)
    rows = np.column_stack([mended.triangles.ravel(), corner_uvs.reshape(-1, 2) + 0.0])
    _, first, corner = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    split = mended.vertices[mended.triangles.ravel()[first]]
    mesh = make_mesh(split, corner.reshape(-1, 3), corner_uvs.reshape(-1, 2)[first])
    return MendedMesh(mesh, tuple(notes))


def _from_lowest_corner(mesh: RepairedMesh) -> RepairedMesh:
    """Each triangle's corners from the first vertex on: charts and pictures depend a little on
    where a triangle begins, and a file that is inside out begins elsewhere than its twin."""
    order = (np.arange(3) + mesh.triangles.argmin(axis=1)[:, None]) % 3
    return mesh._replace(
        triangles=np.take_along_axis(mesh.triangles, order, axis=1),
        corners=np.take_along_axis(mesh.corners, order, axis=1),
    )


def _mapped(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    uvs: NDArray[np.float64],
    notes: list[str],
) -> NDArray[np.float64]:
    """Texture coordinates (F, 3, 2) of all corners, from those given."""
    area = _doubled_areas(vertices[triangles])
    mapped = _have_area(uvs)
    if area[~mapped].sum() > 0.5 * area.sum():
        notes.append("Its texture coordinates have no area: unwrapped anew.")
        return _unwrapped(vertices, triangles)
    stretch = texture_stretch(
        vertices[triangles[mapped]].reshape(-1, 3),
        np.arange(3 * mapped.sum()).reshape(-1, 3),
        uvs[mapped].reshape(-1, 2),
    )
    if not stretch <= MOST_STRETCH:
        notes.append(
            f"Its texture coordinates stretch a photograph {stretch:.3g} times: unwrapped anew."
        )
        return _unwrapped(vertices, triangles)
    if mapped.all():
        return uvs
    rest = np.flatnonzero(~mapped)
    things = f"{len(rest)} triangle{'s' if len(rest) > 1 else ''}"
    notes.append(f"{things} without area on the texture unwrapped anew.")
    used, corner = np.unique(triangles[rest], return_inverse=True)
    patch = _unwrapped(vertices[used], corner.reshape(-1, 3))
    wanted = _doubled_areas(uvs[mapped]).sum() / area[mapped].sum()
    found = _doubled_areas(patch).sum() / area[rest].sum()
    result = uvs.copy()
    result[rest] = patch * np.sqrt(wanted / found)
    return result


def _unwrapped(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    _, faces, uvs = unwrap(vertices, triangles)
    return uvs[faces]


def _have_area(uvs: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(F,): whether corners (F, 3, 2) are finite and not on a line."""
    finite = np.asarray(np.isfinite(uvs).all(axis=(1, 2)))
    known = np.where(finite[:, None, None], uvs, 0.0)
    longest: NDArray[np.float64] = (
        ((known - np.roll(known, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    )
    have: NDArray[np.bool_] = _doubled_areas(known) > _NOTHING * longest  # so no number has none
    return have


def _doubled_areas(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of triangles (F, 3, 2 or 3)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    if corners.shape[2] == 2:
        flat: NDArray[np.float64] = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        return flat
    areas: NDArray[np.float64] = np.linalg.norm(np.cross(a, b), axis=1)
    return areas
