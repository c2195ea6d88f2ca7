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
from pipelines.glass_scratches.tables.lobe import Lobe, make_lobe

if TYPE_CHECKING:
    from pipelines.geometry.solids import Solid
    from pipelines.glass_scratches.tables.bsdf_table import BsdfTable


class ScratchMaterial(NamedTuple):
    """What lies on the glass.

    layers, coverage: the scratches of a tile, and maps (L, R, R) float32 of their layers.
    table: what they do to light. lobe: the same for sampling.
    """

    layers: Layers
    coverage: NDArray[np.float32]
    table: BsdfTable
    lobe: Lobe


class ScratchedGlass(NamedTuple):
    """One scratched solid: its shape, its surface to be traced, and itself on the stage."""

    solid: Solid
    surface: ScratchedSurface
    actor: ScratchedActor


def scratch_material(table: BsdfTable, layers: Layers, *, resolution: int = 512) -> ScratchMaterial:
    """Scratches of ``layers`` that have this table.

    ``resolution`` of the layers' maps, a power of two. Raises ValueError as `coverage_maps` does.
    """
    return ScratchMaterial(layers, coverage_maps(layers, resolution), table, make_lobe(table))


def scratched_glass(
    solid: Solid, material: ScratchMaterial, *, tile: float = 1.0
) -> ScratchedGlass:
    """A solid with scratches all over it, ``tile`` scene units a tile.

    Raises ValueError as `make_scratched_surface` and `ScratchedActor` do.
    """
    surface = make_scratched_surface(
        layer_arrays(material.layers), material.coverage, material.lobe, tile=tile
    )
    actor = ScratchedActor(
        solid, material.coverage, material.layers.angle, material.table, tile=tile
    )
    return ScratchedGlass(solid, surface, actor)
