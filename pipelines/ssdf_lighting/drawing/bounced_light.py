"""What a scene's surfaces reflect onto each other under some lights, through its distances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.light.cosine_lobes import cosine_lobes
from pipelines.ssdf_lighting.light.interreflection import BounceFactors, bounced
from pipelines.ssdf_lighting.light.shading import matt_axes, matt_light
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, visible_table
from pipelines.ssdf_lighting.scene import Scene


class BouncedLight:
    """Reflected light at a scene's vertices, for lights that differ from the first in their axes
    and amplitudes only."""

    def __init__(self, scene: Scene, factors: BounceFactors, lights: Lights) -> None:
        self._factors, self._cosine = factors, cosine_lobes(lights.sharpness)
        self._table = visible_table()
        # Each once, in order: distances are decoded block by block.
        self._vertices, self._place = np.unique(
            factors.samples.astype(np.int64), return_inverse=True
        )
        self._normals = scene.normals[self._vertices]

    def at_vertices(
        self,
        lights: Lights,
        distances_along: Callable[[NDArray[np.int64], NDArray[np.float32]], NDArray[np.floating]],
    ) -> NDArray[np.float32]:
        """What albedo 1 would show of it, (V, 3). ``distances_along`` tells d (P, L) of vertices
        (P,) along axes (P, L, 3)."""
        axes = matt_axes(self._normals, lights, self._cosine).astype(np.float32)
        distances = distances_along(self._vertices, axes)
        light = matt_light(self._normals, distances, lights, self._cosine, self._table)
        return bounced(self._factors, light[self._place.reshape(self._factors.samples.shape)])
