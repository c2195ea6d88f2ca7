"""Lobes of the gloss for any material: a table between whose rows the shader takes the value."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.light.gloss_lobes import GlossLobes, gloss_lobes
from pipelines.ssdf_lighting.light.microfacets import Materials

ROUGHNESSES: NDArray[np.float64] = np.geomspace(0.05, 1.0, 12)
"""Beckmann's slopes: ln(sharpness) is nearly straight between them in ln(slope)."""
SPECULARS: NDArray[np.float64] = np.geomspace(0.02, 0.99, 5)
"""F0: the amplitude's logarithm is nearly straight between them in ln(F0)."""


@functools.cache
def gloss_grid() -> GlossLobes:
    """Row ``s * len(ROUGHNESSES) + r`` is of ``SPECULARS[s]`` and ``ROUGHNESSES[r]``."""
    count = len(SPECULARS) * len(ROUGHNESSES)
    return gloss_lobes(
        Materials(
            np.zeros((count, 3)),
            np.repeat(SPECULARS, len(ROUGHNESSES)),
            np.tile(ROUGHNESSES, len(SPECULARS)),
        )
    )


def nearest_rows(
    specular: NDArray[np.floating], roughness: NDArray[np.floating]
) -> NDArray[np.int64]:
    """The row of the table (P,) that is nearest to each F0 and slope (P,)."""
    row = np.rint(_place(specular, SPECULARS)) * len(ROUGHNESSES)
    return (row + np.rint(_place(roughness, ROUGHNESSES))).astype(np.int64)


def _place(values: NDArray[np.floating], steps: NDArray[np.float64]) -> NDArray[np.float64]:
    held = np.clip(np.asarray(values, np.float64), steps[0], steps[-1])
    place: NDArray[np.float64] = (
        np.log(held / steps[0]) / np.log(steps[-1] / steps[0]) * (len(steps) - 1)
    )
    return place
