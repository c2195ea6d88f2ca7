"""Whether clusters show: steps of the shading's error across their borders, under a turning sky.

The error is what the compression does to the brightness of the vertices, at each turn of the light.
`figures.seam_ratio` compares its steps across borders with those beside them, where 1 is invisible.
The same edges with one PCA for everything, of the same error, say how much of it is the place. The
null has each cluster's distances off by a constant, as large as the whole error in the mean.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from assets_defs.ssdf_lighting.datasets import decoder_of, scene_of, shared_basis_of
from benchmarks.ssdf_relit import sky_lights
from pipelines.drawing.colour import luminance
from pipelines.ssdf_lighting.compression import compact
from pipelines.ssdf_lighting.compression.compact_file import to_bytes
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.drawing import viewpoints
from pipelines.ssdf_lighting.drawing.camera_rays import view_vectors
from pipelines.ssdf_lighting.figures import seam_ratio
from pipelines.ssdf_lighting.light.shading import lobe_tables, lobes, shaded
from pipelines.ssdf_lighting.light.spherical_gaussians import (
    Lights,
    rotated,
    softened,
    visible_table,
)
from pipelines.ssdf_lighting.scene import Scene

Floats = NDArray[np.float32]
DistancesAlong = Callable[[NDArray[np.int64], Floats], Floats]

TURNS = 8


def seam_figures(stored: Callable[[str], xr.Dataset]) -> dict[str, Any]:
    """The ratio of the stored basis, of one PCA at the same borders, and of the null."""
    scene, basis = scene_of(stored("scene_mesh")), stored("ssdf_basis")
    matrix, decoder = stored("ssdf_matrix")["distances"].values, decoder_of(basis)
    rmse, cluster = float(basis["rmse"]), decoder.resident.cluster
    shared = shared_basis_of(stored("triangle_clusters"))
    one = compact.quantise_to_rmse(shared, np.zeros(len(matrix), np.int32), rmse)
    offset = np.random.default_rng(0).normal(size=int(cluster.max()) + 1) * rmse
    codings: dict[str, DistancesAlong] = {
        "seam_ratio": decoder.distances_along,
        "seam_ratio_single_pca": Decoder.of_file(to_bytes(one)).distances_along,
        "seam_ratio_null": functools.partial(_offset, decoder, offset.astype(np.float32)),
    }
    lights = softened(sky_lights(), rmse)
    right = brightness(scene, lights, functools.partial(matrix_along, matrix))
    return {
        name: seam_ratio(brightness(scene, lights, along) - right, scene.triangles, cluster)
        for name, along in codings.items()
    }


def _offset(decoder: Decoder, offset: Floats, vertices: NDArray[np.int64], axes: Floats) -> Floats:
    return (
        decoder.distances_along(vertices, axes) + offset[decoder.resident.cluster[vertices], None]
    )


def brightness(
    scene: Scene, lights: Lights, distances_along: DistancesAlong
) -> NDArray[np.float64]:
    """Luminance (V, turns) of the vertices under such lights, seen from the usual place."""
    camera = viewpoints.scene_camera(scene, viewpoints.AZIMUTH, viewpoints.ELEVATION, 4.0 / 3.0)
    material = np.zeros(len(scene.vertices), np.int64)
    material[scene.triangles] = scene.part[:, None]
    tables, shares = lobe_tables(scene.materials, lights), visible_table()
    vertices, views = np.arange(len(scene.vertices)), view_vectors(camera, scene.vertices)
    found = []
    for number in range(TURNS):
        turned = rotated(lights, 360.0 * number / TURNS)
        seen = lobes(scene.normals, views, material, scene.materials, turned, tables=tables)
        distances = distances_along(vertices, seen.axes.astype(np.float32))
        found.append(luminance(shaded(seen, distances.astype(np.float64), shares)))
    return np.stack(found, axis=1)
