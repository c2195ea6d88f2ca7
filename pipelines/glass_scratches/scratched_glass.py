"""Scratched glass as one thing: what lies on it, and a solid that is ready to be drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.drawing.path_state import ScratchedSurface
from pipelines.glass_scratches.drawing.path_tracing import make_scratched_surface
from pipelines.glass_scratches.drawing.stage_view import ScratchedActor
from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.features import Layers, layer_arrays
from pipelines.glass_scratches.tables.fresnel import Fresnel, FresnelFactors, fresnel_factors
from pipelines.glass_scratches.tables.lobe import Lobe, make_lobe

if TYPE_CHECKING:
    from pipelines.geometry.solids import Solid
    from pipelines.glass_scratches.tables.table_2d import Table2D


class ScratchMaterial(NamedTuple):
    """What lies on the glass.

    layers, coverage: the scratches of a tile, and maps (L, R, R) float32 of their layers.
    rho: (M, M) the 2-D table. lobe: the same for sampling. fresnel: how it goes along the scratch.
    roughness of the scratches' walls; refractive_index of the glass.
    """

    layers: Layers
    coverage: NDArray[np.float32]
    rho: NDArray[np.float64]
    lobe: Lobe
    fresnel: FresnelFactors
    roughness: float
    refractive_index: float


class ScratchedGlass(NamedTuple):
    """One scratched solid: its shape, its surface to be traced, and itself on the stage."""

    solid: Solid
    surface: ScratchedSurface
    actor: ScratchedActor


def scratch_material(
    table: Table2D,
    layers: Layers,
    *,
    resolution: int = 512,
    roughness: float = 1.0,
    refractive_index: float = 1.5,
    fresnel: Fresnel = "paper",
) -> ScratchMaterial:
    """Scratches of ``layers`` whose cross-section has this table.

    ``resolution`` of the layers' maps, a power of two; ``roughness`` is the one that the table was
    made with. Raises ValueError as `coverage_maps`, `make_lobe` and `fresnel_factors` do.
    """
    return ScratchMaterial(
        layers,
        coverage_maps(layers, resolution),
        table.rho,
        make_lobe(table.across, roughness),
        fresnel_factors(len(table.rho), refractive_index, fresnel),
        roughness,
        refractive_index,
    )


def scratched_glass(
    solid: Solid, material: ScratchMaterial, *, tile: float = 1.0
) -> ScratchedGlass:
    """A solid with scratches all over it, ``tile`` scene units a tile.

    Raises ValueError as `make_scratched_surface` and `ScratchedActor` do.
    """
    surface = make_scratched_surface(
        layer_arrays(material.layers),
        material.coverage,
        material.lobe,
        material.fresnel,
        roughness=material.roughness,
        tile=tile,
        index=material.refractive_index,
    )
    actor = ScratchedActor(
        solid,
        material.coverage,
        material.layers.angle,
        material.rho,
        material.fresnel,
        index=material.refractive_index,
        tile=tile,
    )
    return ScratchedGlass(solid, surface, actor)
