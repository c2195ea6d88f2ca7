"""Distances of a lit scene's package, decoded."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from storage.packages import Package

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.ssdf_lighting.compression.decoder_tables import DecoderTables

_ROWS = 1024
"""Vertices whose distances are in memory together."""


def decoder_tables(package: Package) -> DecoderTables:
    """The tables of either form. Raises BadInput, ValueError for what is damaged."""
    import numpy as np

    from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca
    from pipelines.ssdf_lighting.compression.decoder import Decoder

    if "ssdf" in package.parts:
        return Decoder.of_file(package.array("ssdf").tobytes()).tables
    names = ("vectors", "first", "row_vertex", "row_first", "weights")
    parts = {name: package.array(name) for name in names}
    parts |= {name: parts[name].astype(np.float32) for name in ("vectors", "weights")}
    pca = ClusteredPca(**parts, relative_error=np.zeros(len(parts["first"]) - 1))
    return Decoder.of_pca(pca, int(parts["row_vertex"].max()) + 1).tables


def sky_shares(package: Package, tables: DecoderTables) -> NDArray[np.float32]:
    """(V,) of the mesh's vertices: the part of the sky above that each sees, by the cosine.

    A direction at the edge counts as half visible, one half a texel off as whole.
    """
    import numpy as np

    from pipelines.ssdf_lighting.compression.decoder_tables import decoded_rows
    from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions

    mesh = package.mesh("mesh")
    assert mesh.normals is not None
    n = tables.resolution
    ways, areas = texel_directions(n), solid_angles(n)
    texel = math.sqrt(4 * math.pi / n**2)
    rows = mesh.attributes["SOURCE"].astype(np.int64)
    shares = np.empty(len(rows), np.float32)
    for first in range(0, len(rows), _ROWS):
        part = slice(first, first + _ROWS)
        visible = np.clip(decoded_rows(tables, rows[part]) / texel + 0.5, 0.0, 1.0)
        falling = np.maximum(mesh.normals[part] @ ways.T, 0.0) * areas
        shares[part] = (visible * falling).sum(axis=1) / falling.sum(axis=1)
    return shares
