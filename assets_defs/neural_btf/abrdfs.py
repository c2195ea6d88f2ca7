"""The transposition to ABRDFs, and their clusters: `abrdf_matrix`, `abrdf_clusters`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    abrdf_clusters_dataset,
    abrdf_matrix_dataset,
    photograph_blocks,
)
from assets_defs.neural_btf.declaration import BTF, NONE
from assets_defs.neural_btf.photographs import texels_and_photographs
from assets_defs.settings import Settings
from assets_defs.sources import Source
from assets_defs.system import Pictures, Progress, Result
from pipelines.neural_btf import figures
from pipelines.neural_btf.abrdf import AbrdfSpace
from pipelines.neural_btf.representatives import Representative
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray


# ---- abrdf_matrix ----------------------------------------------------------------------------


class MatrixSettings(Settings):
    """What the clustering sees of the ABRDFs."""

    components: int = Field(32, ge=8, le=512, description="Principal components (unsaid in paper)")
    space: AbrdfSpace = Field(
        "log", description="Values of the principal components: x2, x3 or x1 (unsaid in the paper)"
    )


def _sampled_images(version: StoredVersion) -> tuple[NDArray[np.int64], NDArray[np.floating]]:
    """Numbers of a few photographs, from the first to the last, and the photographs."""
    import numpy as np

    images = version.input("btf_images")["images"]
    numbers = np.unique(np.linspace(0, len(images) - 1, 5).astype(int))
    return numbers, images[numbers].values


def _transposition_error(version: StoredVersion) -> float:
    numbers, images = _sampled_images(version)
    return figures.transposition_error(version.dataset["abrdfs"][:, numbers].values, images)


def _statistics_error(version: StoredVersion) -> float:
    numbers, images = _sampled_images(version)
    mean, deviation = (version.dataset[name][numbers].values for name in ("mean", "deviation"))
    return figures.statistics_error(mean, deviation, images)


def _explained(version: StoredVersion) -> float:
    dataset = version.dataset
    return figures.explained_share(
        dataset["singular_values"].values, float(dataset["total_variation"])
    )


@BTF.asset(
    schemas.ABRDF_MATRIX,
    by=("material",),
    settings=MatrixSettings,
    inputs=("btf_images",),
    checks=(
        Check(
            "transposition_error",
            "Largest difference between photographs and ABRDFs, on five photographs.",
            _transposition_error,
            at_most=0.0,
        ),
        Check(
            "statistics_error",
            "Largest difference of mu and sigma from those of five photographs.",
            _statistics_error,
            at_most=1e-5,
        ),
        Check(
            "explained",
            "Share of the variation that the principal components hold.",
            _explained,
            at_least=0.02,
            change=0.01,
        ),
    ),
)
def abrdf_matrix(settings: MatrixSettings, progress: Progress, btf_images: xr.Dataset) -> Result:
    """Transpose photographs to ABRDFs, band by band; statistics and principal components."""
    from pipelines.neural_btf.principal_abrdfs import summarise_abrdfs

    summary = summarise_abrdfs(
        photograph_blocks(btf_images["images"]),
        components=settings.components,
        space=settings.space,
        progress=progress,
    )
    dataset = abrdf_matrix_dataset(summary, btf_images)
    return dataset, {"bytes raw, float32": btf_images["images"].size * 4}


# ---- abrdf_clusters --------------------------------------------------------------------------


class ClusterSettings(Settings):
    """How texels are put together."""

    representative: Representative = Field(
        "median", description="What stands for a cluster; the median is element-wise (our reading)"
    )
    cluster_seed: int = Field(0, ge=0, description="Seed of k-means++")


@BTF.before_work
def _check_clusters(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Refuse more clusters than texels before anything is made."""
    if "clusters" not in sources or sources["clusters"].key == NONE:
        return
    material, clusters = sources["material"], int(sources["clusters"].key)
    texels, _ = texels_and_photographs(material, settings["btf_images"])
    if clusters > texels:
        raise ValueError(
            f"{material.name}: clusters is {clusters}; expected at most {texels}, the number of "
            "texels."
        )


def _cluster_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import cluster_map

    height, width = dataset.attrs["height"], dataset.attrs["width"]
    return {"clusters": cluster_map(dataset["ids"].values, height, width)}


def _smallest_cluster(version: StoredVersion) -> float:
    dataset = version.dataset
    return figures.smallest_cluster(dataset["ids"].values, dataset["sizes"].values)


def _spread_ratio(version: StoredVersion) -> float:
    scores = version.input("abrdf_matrix")["scores"].values
    return figures.spread_ratio(scores, version.dataset["ids"].values)


@BTF.asset(
    schemas.ABRDF_CLUSTERS,
    by=("material", "clusters"),
    settings=ClusterSettings,
    inputs=("btf_images", "abrdf_matrix"),
    pictures=_cluster_pictures,
    checks=(
        Check(
            "smallest_cluster",
            "Members of the smallest cluster; 0 where the sizes are wrong.",
            _smallest_cluster,
            at_least=1.0,
        ),
        Check(
            "spread_ratio",
            "Squared distance to the own cluster's mean over that to the mean of all.",
            _spread_ratio,
            at_most=0.95,
            change=0.01,
        ),
    ),
)
def abrdf_clusters(
    settings: ClusterSettings,
    keys: Mapping[str, str],
    progress: Progress,
    btf_images: xr.Dataset,
    abrdf_matrix: xr.Dataset,
) -> Result:
    """Cluster the ABRDFs by k-means++ on their principal components, and take representatives."""
    from pipelines.neural_btf.clusters import cluster_abrdfs, single_texel_clusters

    scores = abrdf_matrix["scores"].values
    size = (int(abrdf_matrix["height"]), int(abrdf_matrix["width"]))
    if keys["clusters"] == NONE:
        return abrdf_clusters_dataset(single_texel_clusters(scores), size), {
            "clusters": len(scores)
        }
    found = cluster_abrdfs(
        photograph_blocks(btf_images["images"]),
        scores,
        int(keys["clusters"]),
        representative=settings.representative,
        seed=settings.cluster_seed,
        progress=progress,
    )
    shown = {"clusters": len(found.sizes), "largest": int(found.sizes.max())}
    return abrdf_clusters_dataset(found, size), shown
