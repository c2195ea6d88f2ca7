"""Which triangles are compressed together: `triangle_clusters`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.ssdf_lighting.datasets import clusters_dataset, distance_blocks
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import NOTES, Pictures, Progress, Result
from pipelines.ssdf_lighting import figures
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr


class ClusterSettings(Settings):
    """How triangles are put together."""

    clusters: int = Field(256, ge=1, le=65_535, description="Clusters of triangles")
    space: Literal["distances", "positions"] = Field(
        "distances",
        description="Triangles are alike in their SSDFs, or, as in the paper, near each other",
    )
    shared_error: float = Field(
        0.003, gt=0.0, le=0.1, description="Error of the shared basis alone, rad"
    )
    cluster_seed: int = Field(0, ge=0, description="Seed of k-means++")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"clusters": 24, "shared_error": 0.006},
        "paper": {"clusters": 64, "space": "positions"},
    }


def _unused(version: StoredVersion) -> float:
    return figures.unused_share(version.dataset["cluster"].values)


def _compactness(version: StoredVersion) -> float:
    from pipelines.ssdf_lighting.compression.triangle_clusters import (
        leading_coordinates,
        within_cluster_spread,
    )

    clusters, mesh = version.dataset, version.input("scene_mesh")
    if version.record["settings"]["space"] == "positions":
        features = mesh["vertices"].values
    else:
        features = leading_coordinates(clusters["coordinates"].values)
    return within_cluster_spread(features, mesh["triangles"].values, clusters["cluster"].values)


def _basis_error(version: StoredVersion) -> float:
    """Error of the shared basis on sampled vertices, over the error it was made for."""
    clusters, matrix = version.dataset, version.input("ssdf_matrix")["distances"]
    rows = figures.sampled_rows(len(matrix), 512)
    error = figures.shared_basis_rmse(
        matrix[rows].values, clusters["coordinates"].values[rows], clusters["shared"].values
    )
    return error / version.record["settings"]["shared_error"]


def _cluster_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.ssdf_lighting.drawing.pictures import basis_picture, cluster_sizes_picture

    return {
        "shared-basis": basis_picture(dataset["shared"].values.T[:24]),
        "cluster-sizes": cluster_sizes_picture(dataset["vertex_cluster"].values),
    }


@SSDF.asset(
    schemas.TRIANGLE_CLUSTERS,
    by=("scene",),
    settings=ClusterSettings,
    inputs=("scene_mesh", "ssdf_matrix"),
    pictures=_cluster_pictures,
    checks=(
        Check("unused", "Share of the cluster numbers without a triangle.", _unused, at_most=0.0),
        Check(
            "compactness",
            "Spread of what was clustered inside the clusters, over that of everything.",
            _compactness,
            at_most=0.9,
            change=0.02,
        ),
        Check(
            "basis_error",
            "Error of the shared basis on sampled vertices, over the error it was made for.",
            _basis_error,
            at_most=2.0,
        ),
    ),
)
def triangle_clusters(
    settings: ClusterSettings,
    progress: Progress,
    scene_mesh: xr.Dataset,
    ssdf_matrix: xr.Dataset,
) -> Result:
    """Find the scene's own basis, and cluster the triangles in it or in space."""
    from pipelines.ssdf_lighting.compression import shared_basis, triangle_clusters

    sizes = ssdf_matrix.sizes
    basis = shared_basis.shared_basis(
        lambda: (block for _, block in distance_blocks(ssdf_matrix)),
        (sizes["vertex"], sizes["direction"]),
        settings.shared_error,
        lambda fraction: progress(0.8 * fraction),
    )
    vertices, triangles = scene_mesh["vertices"].values, scene_mesh["triangles"].values
    count, seed = min(settings.clusters, len(triangles)), settings.cluster_seed
    if settings.space == "positions":
        found = triangle_clusters.clusters_by_position(vertices, triangles, count, seed)
    else:
        found = triangle_clusters.clusters_by_distance(basis.coordinates, triangles, count, seed)
    fewer = (
        f"{count} clusters instead of {settings.clusters}: there are {len(triangles)} triangles."
    )
    notes = [fewer] if count < settings.clusters else []
    return clusters_dataset(found, basis), {"components": len(basis.sigma), NOTES: notes}
