"""What textures say at vertices, where lobes are made: averaged over what is around them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.scene import LitMesh
from pipelines.ssdf_lighting.surface_textures import Looks, Sampler


def vertex_looks(mesh: LitMesh) -> Iterator[tuple[NDArray[np.int64], Looks]]:
    """The vertices of each material that varies, and what they look like."""
    if mesh.textures is None:
        return
    triangles = np.asarray(mesh.triangles)
    uvs = mesh.textures.uvs
    apart = np.zeros((len(mesh.vertices), 2))
    for one, other in ((0, 1), (1, 2), (2, 0)):
        ends = triangles[:, one], triangles[:, other]
        length = np.linalg.norm(uvs[ends[0]] - uvs[ends[1]], axis=2)
        for end in ends:
            np.maximum.at(apart, end, length)
    for material in mesh.textures.materials:
        rows = np.flatnonzero(np.asarray(mesh.object_of_vertex) == material.row)
        yield rows, Sampler(material).looks_at(uvs[rows], mesh.textures.colours[rows], apart[rows])
