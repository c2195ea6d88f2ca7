"""Billboards as quads of one mesh: which of them are in view, and sending only these."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.drawing.culling import visible_billboards
from pipelines.street_billboards.drawing.stage_camera import check_middle

QUAD = np.array([0, 1, 2, 0, 2, 3])
"""Corners of the two triangles of a quad's four vertices."""


def quads_in_view(
    billboards: Billboards,
    drawable: NDArray[np.bool_],
    intrinsics: NDArray[np.floating],
    to_world: NDArray[np.floating],
    width: int,
    height: int,
) -> NDArray[np.int64]:
    """Numbers of the ``drawable`` (b,) billboards that a camera sees, nearest first.

    intrinsics (3, 3) in pixels, to_world (4, 4). Raises ValueError where the principal point is not
    in the picture's middle.
    """
    check_middle("column", float(intrinsics[0, 2]), width)
    check_middle("row", float(intrinsics[1, 2]), height)
    seen = visible_billboards(billboards, intrinsics, to_world, width, height)
    return seen[drawable[seen]]


def send_quads(actor: Any, quads: NDArray[np.int64]) -> None:
    """Draw these quads of the actor's mesh only, in this order."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import VTK_INT
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    corners = (4 * quads[:, None] + QUAD).astype(np.int32).ravel()
    cells = vtkCellArray()
    cells.SetData(3, numpy_to_vtk(corners, deep=True, array_type=VTK_INT))
    mesh = actor.GetMapper().GetInput()
    mesh.SetPolys(cells)
    mesh.Modified()
