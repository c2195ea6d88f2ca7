"""Rays and distances: `visibility`, `ssdf_matrix`. Vertices go by blocks, so memory is bounded."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.ssdf_lighting.meshes import scene_of
from assets_defs.system import Metadata
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_BLOCK = 256
"""Vertices of a block: 4 MB of distances along 4096 directions."""


# ---- visibility ------------------------------------------------------------------------------


class VisibilitySettings(Settings):
    """The directions."""

    directions: int = Field(
        4096, ge=16, le=147_456, description="Directions: the square of an even number"
    )
    byte_budget: int = Field(
        8_000_000_000, ge=1, description="Bytes that the SSDFs may take in single precision"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"directions": 1024},
    }


def _visibility_error(checked: StoredVersion) -> float:
    from pipelines.ssdf_lighting.figures import visibility_error

    scene = scene_of(checked.input("scene_mesh"))
    dataset = checked.dataset
    return visibility_error(
        scene.vertices,
        scene.triangles,
        dataset["origin"].values,
        dataset["sealed"].values,
        unpacked(dataset),
        dataset["direction"].values,
    )


def _visible_share(checked: StoredVersion) -> float:
    """Of the sphere, mean of the vertices."""
    import numpy as np

    dataset = checked.dataset
    weights = dataset["solid_angle"].values / (4 * np.pi)
    return float(np.mean(unpacked(dataset) @ weights))


def unpacked(visibility: xr.Dataset) -> NDArray[np.bool_]:
    """Visibility (vertices, directions) of a `visibility` dataset."""
    import numpy as np

    bits = np.unpackbits(visibility["visible"].values, axis=1)
    return bits[:, : visibility.sizes["direction"]].astype(bool)


def _visibility_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.ssdf_lighting.drawing.pictures import sky_picture

    return {"visible-share": sky_picture(unpacked(dataset))}


@SSDF.asset(
    schemas.VISIBILITY,
    by=("scene",),
    settings=VisibilitySettings,
    inputs=("scene_mesh",),
    pictures=_visibility_pictures,
    checks=(
        Check(
            "visibility_error",
            "Share of sampled rays that meet a triangle where none is, or none, by brute force.",
            _visibility_error,
            at_most=0.01,
        ),
        Check(
            "visible_share",
            "Share of the sphere that is seen, mean over the vertices.",
            _visible_share,
            at_least=0.02,
            at_most=0.98,
            change=0.005,
        ),
    ),
)
def visibility(
    settings: VisibilitySettings, progress: Callable[[float], None], scene_mesh: xr.Dataset
) -> Result:
    """Cast a ray from every vertex in every direction."""
    import numpy as np
    import xarray as xr

    from pipelines.geometry.rays import build_scene
    from pipelines.ssdf_lighting.distances.octahedral import (
        resolution_of,
        solid_angles,
        texel_directions,
    )
    from pipelines.ssdf_lighting.distances.visibility import (
        RayOrigins,
        ray_origins,
        stand_ins,
        visible_directions,
    )

    scene = scene_of(scene_mesh)
    n = resolution_of(settings.directions)
    rays = build_scene(scene.vertices, scene.triangles)
    origins = ray_origins(rays, scene.vertices, scene.triangles, scene.normals)
    bits = np.empty((len(scene.vertices), (n * n + 7) // 8), np.uint8)
    share = np.empty(len(bits))
    for first in range(0, len(bits), _BLOCK):
        block = slice(first, first + _BLOCK)
        some = RayOrigins(origins.points[block], origins.sealed[block])
        seen = visible_directions(rays, some, texel_directions(n))
        bits[block], share[block] = np.packbits(seen, axis=1), seen.mean(axis=1)
        progress(first / len(bits))
    # What is stored for a buried vertex is what another one sees: origin and all.
    stored = stand_ins(
        rays,
        scene.vertices,
        scene.triangles,
        scene.normals,
        origins,
        share,
        texel_directions(n),
    )
    dataset = xr.Dataset(
        {
            "visible": (("vertex", "byte"), bits[stored]),
            "origin": (("vertex", "axis"), origins.points[stored]),
            "sealed": (("vertex",), origins.sealed[stored]),
            "stored": (("vertex",), stored.astype(np.int32)),
            "direction": (("direction", "axis"), texel_directions(n)),
            "solid_angle": (("direction",), solid_angles(n)),
        }
    )
    return dataset, {
        "rays": len(bits) * n * n,
        "sealed vertices": int(origins.sealed.sum()),
        "buried vertices": int((stored != np.arange(len(stored))).sum()),
    }


# ---- ssdf_matrix -----------------------------------------------------------------------------


class MatrixSettings(Settings):
    """What distances are measured to."""

    edges: Literal["refined", "samples"] = Field(
        "refined",
        description="To the edge of visibility between the directions, found by more rays, or, "
        "as in the paper, to the nearest direction of the other visibility",
    )


def _distance_error(checked: StoredVersion) -> float:
    from pipelines.ssdf_lighting.figures import distance_error, sampled_rows

    seen = checked.input("visibility")
    rows = sampled_rows(seen.sizes["vertex"], 12)
    return distance_error(
        checked.dataset["distances"].isel(vertex=rows).values,
        unpacked(seen.isel(vertex=rows)),
        refined=checked.record["settings"]["edges"] == "refined",
    )


def _sign_error(checked: StoredVersion) -> float:
    """Share of all distances whose sign is not that of the visibility."""
    import numpy as np

    distances, seen = checked.dataset["distances"], checked.input("visibility")
    wrong = 0
    for first in range(0, len(distances), _BLOCK):
        block = slice(first, first + _BLOCK)
        signs = distances[block].values > 0
        wrong += int(np.count_nonzero(signs != unpacked(seen.isel(vertex=block))))
    return wrong / distances.size


@SSDF.asset(
    schemas.SSDF_MATRIX,
    by=("scene",),
    settings=MatrixSettings,
    inputs=("scene_mesh", "visibility"),
    checks=(
        Check(
            "distance_error",
            "On sampled vertices, against all pairs of directions: the largest difference "
            "(samples), or how far beyond what the cells allow (refined), rad.",
            _distance_error,
            at_most=1e-5,
        ),
        Check(
            "sign_error",
            "Share of the distances whose sign is not that of the visibility.",
            _sign_error,
            at_most=0.0,
        ),
    ),
)
def ssdf_matrix(
    settings: MatrixSettings,
    progress: Callable[[float], None],
    scene_mesh: xr.Dataset,
    visibility: xr.Dataset,
) -> Result:
    """Measure the distances, block by block, as the store takes them."""
    import dask
    import dask.array as da
    import numpy as np
    import xarray as xr

    from pipelines.geometry.rays import build_scene
    from pipelines.ssdf_lighting.distances.refined import refined_distances
    from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
    from pipelines.ssdf_lighting.distances.visibility import RayOrigins

    scene = scene_of(scene_mesh)
    rays = build_scene(scene.vertices, scene.triangles)
    origins, sealed = visibility["origin"].values, visibility["sealed"].values
    count, directions = len(scene.vertices), visibility.sizes["direction"]
    done, lock = [0], threading.Lock()

    def block_of(first: int) -> NDArray[np.float32]:
        block = slice(first, first + _BLOCK)
        seen = unpacked(visibility.isel(vertex=block))
        if settings.edges == "samples":
            distances = distances_to_samples(seen)
        else:
            distances = refined_distances(
                rays, RayOrigins(origins[block], sealed[block]), scene.normals[block], seen
            )
        with lock:
            done[0] += len(seen)
            progress(done[0] / count)
        return distances

    blocks = [
        da.from_delayed(
            dask.delayed(block_of, pure=False)(first),
            (min(_BLOCK, count - first), directions),
            np.float32,
        )
        for first in range(0, count, _BLOCK)
    ]
    dataset = xr.Dataset({"distances": (("vertex", "direction"), da.concatenate(blocks))})
    return dataset, {"bytes": count * directions * 4}
