"""What surfaces send to each other: `bounce_factors`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from assets_defs.ssdf_lighting.datasets import (
    bounce_dataset,
    bounce_of,
    ray_origins_of,
    scene_of,
    visible_of,
)
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import Progress, Result
from pipelines.ssdf_lighting import figures
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

_ROWS = 512
"""Vertices whose sums are checked."""


def _closure_error(version: StoredVersion) -> float:
    from pipelines.ssdf_lighting.light.interreflection import factor_sums

    seen = version.input("visibility")
    rows = figures.sampled_rows(seen.sizes["vertex"], _ROWS)
    rows = rows[~seen["sealed"].values[rows]]
    some = seen.isel(vertex=rows)
    return figures.closure_error(
        factor_sums(bounce_of(version.dataset))[rows],
        visible_of(some),
        version.input("scene_mesh")["normals"].values[rows],
        seen["direction"].values,
        seen["solid_angle"].values,
    )


class BounceSettings(Settings):
    """How finely surfaces light each other."""

    patches: int = Field(
        256, ge=1, le=1024, description="Patches of even light that surfaces are cut into"
    )


@SSDF.asset(
    schemas.BOUNCE_FACTORS,
    by=("scene",),
    settings=BounceSettings,
    inputs=("scene_mesh", "visibility"),
    checks=(
        Check(
            "closure_error",
            "How far what patches and sky fill of a vertex's hemisphere is from all of it, RMS.",
            _closure_error,
            at_most=0.03,
        ),
    ),
)
def bounce_factors(
    settings: BounceSettings, progress: Progress, scene_mesh: xr.Dataset, visibility: xr.Dataset
) -> Result:
    """Cast rays from every vertex to the patches of the scene's surfaces."""
    from pipelines.ssdf_lighting.light.interreflection import bounce_factors as made

    factors = made(scene_of(scene_mesh), ray_origins_of(visibility), settings.patches, progress)
    return bounce_dataset(factors), {"patches": len(factors.albedo), "bytes": factors.nbytes}
