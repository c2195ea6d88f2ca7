"""Rays and distances: `visibility`, `ssdf_matrix`. Vertices go by blocks, so memory is bounded."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.ssdf_lighting.datasets import (
    ray_origins_of,
    scene_of,
    visibility_dataset,
    visible_of,
)
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import Pictures, Progress, Result
from pipelines.ssdf_lighting import figures, thin_figures
from pipelines.ssdf_lighting.distances.octahedral import resolution_of
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

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


def check_size(name: str, vertices: int, settings: VisibilitySettings) -> None:
    """Raises ValueError where the matrix needs more bytes than allowed, and for a number of
    directions that is no octahedral map's."""
    resolution_of(settings.directions)
    needed = vertices * settings.directions * 4
    if needed > settings.byte_budget:
        raise ValueError(
            f"{name}: the SSDFs of {vertices} vertices and {settings.directions} directions need "
            f"{needed} bytes; expected at most byte_budget, {settings.byte_budget}."
        )


def _visibility_error(version: StoredVersion) -> float:
    mesh, seen = version.input("scene_mesh"), version.dataset
    return figures.visibility_error(
        mesh["vertices"].values,
        mesh["triangles"].values,
        seen["origin"].values,
        seen["sealed"].values,
        visible_of(seen),
        seen["direction"].values,
    )


def _visible_share(version: StoredVersion) -> float:
    solid_angle = version.dataset["solid_angle"].values
    return figures.visible_sphere_share(visible_of(version.dataset), solid_angle)


def _visibility_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.ssdf_lighting.drawing.pictures import sky_picture

    return {"visible-share": sky_picture(visible_of(dataset))}


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
def visibility(settings: VisibilitySettings, progress: Progress, scene_mesh: xr.Dataset) -> Result:
    """Cast a ray from every vertex in every direction."""
    from pipelines.ssdf_lighting.distances.visibility import scene_visibility

    scene, n = scene_of(scene_mesh), resolution_of(settings.directions)
    found = scene_visibility(scene.vertices, scene.triangles, scene.normals, n, progress)
    return visibility_dataset(found, n), {
        "rays": len(found.stored) * settings.directions,
        "sealed vertices": found.sealed,
        "buried vertices": found.buried,
    }


# ---- ssdf_matrix -----------------------------------------------------------------------------


class MatrixSettings(Settings):
    """What distances are measured to."""

    edges: Literal["refined", "samples"] = Field(
        "refined",
        description="To the edge of visibility between the directions, found by more rays, or, "
        "as in the paper, to the nearest direction of the other visibility",
    )


def _distance_error(version: StoredVersion) -> float:
    seen = version.input("visibility")
    rows = figures.sampled_rows(seen.sizes["vertex"], 12)
    return figures.distance_error(
        version.dataset["distances"].isel(vertex=rows).values,
        visible_of(seen.isel(vertex=rows)),
        refined=version.record["settings"]["edges"] == "refined",
    )


def _missed_share(version: StoredVersion) -> float:
    if version.record["settings"]["edges"] == "samples":
        return 0.0  # by their definition they know nothing of what is between the directions
    return thin_figures.missed_share(*_sampled_distances(version))


def _made_up_share(version: StoredVersion) -> float:
    return thin_figures.made_up_share(*_sampled_distances(version))


def _sampled_distances(
    version: StoredVersion,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64], NDArray[np.integer]]:
    """Distances and origins of sampled vertices that are not sealed; the mesh."""
    seen, mesh = version.input("visibility"), version.input("scene_mesh")
    rows = figures.sampled_rows(seen.sizes["vertex"], 48)
    rows = rows[~seen["sealed"].values[rows]]
    return (
        version.dataset["distances"].isel(vertex=rows).values,
        seen["origin"].values[rows],
        mesh["vertices"].values,
        mesh["triangles"].values,
    )


def _sign_error(version: StoredVersion) -> float:
    distances, seen = version.dataset["distances"], version.input("visibility")
    return figures.sign_error(
        (distances[block].values, visible_of(seen.isel(vertex=block)))
        for block in _blocks(len(distances))
    )


def _blocks(count: int) -> Iterator[slice]:
    for first in range(0, count, _BLOCK):
        yield slice(first, min(first + _BLOCK, count))


@SSDF.asset(
    schemas.SSDF_MATRIX,
    by=("scene",),
    settings=MatrixSettings,
    inputs=("scene_mesh", "visibility"),
    checks=(
        Check(
            "distance_error",
            "On sampled vertices, against all pairs of directions: the largest difference "
            "(samples), or how far beyond them (refined), rad.",
            _distance_error,
            at_most=1e-5,
        ),
        Check(
            "sign_error",
            "Share of the distances whose sign is not that of the visibility.",
            _sign_error,
            at_most=0.0,
        ),
        Check(
            "missed_share",
            "Share of sampled points of the mesh that lie where d says that the sky is open "
            "(refined).",
            _missed_share,
            at_most=0.003,
        ),
        Check(
            "made_up_share",
            "Share of sampled open directions around which, a little farther than d, nothing is.",
            _made_up_share,
            at_most=0.02,
        ),
    ),
)
def ssdf_matrix(
    settings: MatrixSettings,
    progress: Progress,
    scene_mesh: xr.Dataset,
    visibility: xr.Dataset,
) -> Result:
    """Measure the distances, block by block, as the store takes them."""
    import xarray as xr

    count, directions = visibility.sizes["vertex"], visibility.sizes["direction"]
    measure = _measure(settings, scene_mesh, visibility)
    distances = _lazy_rows(measure, (count, directions), progress)
    dataset = xr.Dataset({"distances": (("vertex", "direction"), distances)})
    return dataset, {"bytes": count * directions * 4}


def _measure(
    settings: MatrixSettings, scene_mesh: xr.Dataset, visibility: xr.Dataset
) -> Callable[[slice], NDArray[np.float32]]:
    """A function that measures the distances of a block of vertices."""
    from pipelines.ssdf_lighting.distances.refined import occluders, refined_distances
    from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
    from pipelines.ssdf_lighting.distances.visibility import RayOrigins

    scene, origins = scene_of(scene_mesh), ray_origins_of(visibility)
    around = occluders(scene.vertices, scene.triangles)

    def distances(block: slice) -> NDArray[np.float32]:
        seen = visible_of(visibility.isel(vertex=block))
        if settings.edges == "samples":
            return distances_to_samples(seen)
        some = RayOrigins(origins.points[block], origins.sealed[block])
        return refined_distances(around, some, scene.normals[block], seen)

    return distances


def _lazy_rows(
    measure: Callable[[slice], NDArray[np.float32]], shape: tuple[int, int], progress: Progress
) -> object:
    """A lazy array of float32 whose blocks of rows are measured when they are asked for."""
    import dask
    import dask.array as da
    import numpy as np

    done, lock = [0], threading.Lock()

    def measured(block: slice) -> NDArray[np.float32]:
        rows = measure(block)
        with lock:
            done[0] += len(rows)
            progress(done[0] / shape[0])
        return rows

    return da.concatenate(
        [
            da.from_delayed(
                dask.delayed(measured, pure=False)(block),
                (block.stop - block.start, shape[1]),
                np.float32,
            )
            for block in _blocks(shape[0])
        ]
    )
