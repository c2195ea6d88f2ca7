"""The transposition to ABRDFs, and their clusters: `abrdf_matrix`, `abrdf_clusters`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    image_blocks,
)
from assets_defs.neural_btf.declaration import BTF, NONE
from assets_defs.settings import Settings
from assets_defs.system import Metadata
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

# ---- abrdf_matrix ----------------------------------------------------------------------------


class MatrixSettings(Settings):
    """What the clustering sees of the ABRDFs."""

    components: int = Field(32, ge=8, le=512, description="Principal components (unsaid in paper)")
    space: Literal["log", "standardised", "linear"] = Field(
        "log", description="Values of the principal components: x2, x3 or x1 (unsaid in the paper)"
    )


def _explained(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return float((dataset["singular_values"] ** 2).sum() / dataset["total_variation"])


def _sampled(
    checked: StoredVersion,
) -> tuple[xr.Dataset, NDArray[np.int64], NDArray[np.floating]]:
    """A few photographs, from the first to the last."""
    import numpy as np

    images = checked.input("btf_images")["images"]
    numbers = np.unique(np.linspace(0, len(images) - 1, 5).astype(int))
    return checked.dataset, numbers, images[numbers].values


def _transposition_error(checked: StoredVersion) -> float:
    from pipelines.neural_btf.figures import transposition_error

    dataset, numbers, images = _sampled(checked)
    return transposition_error(dataset["abrdfs"][:, numbers].values, images)


def _statistics_error(checked: StoredVersion) -> float:
    from pipelines.neural_btf.figures import statistics_error

    dataset, numbers, images = _sampled(checked)
    return statistics_error(
        dataset["mean"][numbers].values, dataset["deviation"][numbers].values, images
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
def abrdf_matrix(
    settings: MatrixSettings, progress: Callable[[float], None], btf_images: xr.Dataset
) -> Result:
    """Transpose photographs to ABRDFs, band by band; statistics and principal components."""
    import numpy as np
    import xarray as xr

    from pipelines.lowrank import principal_components
    from pipelines.neural_btf import abrdf

    images = btf_images["images"]
    count, height, width, _ = images.shape
    found = []
    variation = 0.0
    for block in image_blocks(images):
        found.append(abrdf.statistics(block))
        centred = abrdf.columns(block, settings.space)
        centred -= centred.mean(axis=0)
        variation += float(np.sum(centred.astype(np.float64) ** 2))
        progress(0.3 * sum(len(part.mean) for part in found) / count)
    rank = min(settings.components, height * width, 3 * count)
    parts = principal_components(
        lambda: (abrdf.columns(block, settings.space) for block in image_blocks(images)), rank
    )
    progress(0.9)
    matrix = abrdf.texel_rows(images.data)
    texels = max(1, (8 << 20) // (count * 3 * 2))
    dataset = xr.Dataset(
        {
            "abrdfs": (("texel", "image", "channel"), matrix.rechunk({0: texels, 1: -1, 2: -1})),
            "mean": (("image", "channel"), np.concatenate([part.mean for part in found])),
            "deviation": (("image", "channel"), np.concatenate([part.deviation for part in found])),
            "alpha": ((), max(float(part.largest.max()) for part in found)),
            "scores": (("texel", "component"), parts.scores),
            "singular_values": (("component",), parts.singular_values),
            "total_variation": ((), variation),
            "light": btf_images["light"],
            "view": btf_images["view"],
            "height": ((), np.int32(height)),
            "width": ((), np.int32(width)),
        }
    )
    return dataset, {"bytes raw, float32": count * height * width * 3 * 4}


# ---- abrdf_clusters --------------------------------------------------------------------------


class ClusterSettings(Settings):
    """How texels are put together."""

    representative: Literal["median", "mean", "medoid"] = Field(
        "median", description="What stands for a cluster; the median is element-wise (our reading)"
    )
    cluster_seed: int = Field(0, ge=0, description="Seed of k-means++")


def _cluster_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import cluster_map

    height, width = dataset.attrs["height"], dataset.attrs["width"]
    return {"clusters": cluster_map(dataset["ids"].values, height, width)}


def _smallest_cluster(checked: StoredVersion) -> float:
    import numpy as np

    dataset = checked.dataset
    counted = np.bincount(dataset["ids"].values, minlength=dataset.sizes["cluster"])
    return float(counted.min() if (counted == dataset["sizes"].values).all() else 0)


def _spread_ratio(checked: StoredVersion) -> float:
    from pipelines.neural_btf.figures import spread_ratio

    scores = checked.input("abrdf_matrix")["scores"].values
    return spread_ratio(scores, checked.dataset["ids"].values)


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
    progress: Callable[[float], None],
    btf_images: xr.Dataset,
    abrdf_matrix: xr.Dataset,
) -> Result:
    """Cluster the ABRDFs by k-means++ on their principal components, and take representatives."""
    import numpy as np
    import xarray as xr

    from pipelines.clustering import k_means_plus_plus
    from pipelines.neural_btf import representatives as standing
    from pipelines.neural_btf.abrdf import transposed
    from pipelines.neural_btf.training import warm_start

    scores = abrdf_matrix["scores"].values
    shape = {name: int(abrdf_matrix[name]) for name in ("height", "width")}
    if keys["clusters"] == NONE:
        ids = np.arange(len(scores), dtype=np.int32)
        variables = {
            "ids": ("texel", ids),
            "sizes": ("cluster", np.ones(len(scores), np.int64)),
            "start": (("cluster", "latent"), warm_start(scores)),
        }
        return xr.Dataset(variables, attrs=shape), {"clusters": len(scores)}
    clusters = int(keys["clusters"])
    ids = k_means_plus_plus(scores, clusters, settings.cluster_seed)
    progress(0.3)
    order, starts = standing.members(ids, clusters)
    centres = standing.cluster_means(scores, order, starts)
    if settings.representative == "medoid":
        chosen = standing.medoids(scores, order, starts)
        values = abrdf_matrix["abrdfs"][chosen].values.astype(np.float32)
    else:
        of_block = {"median": standing.cluster_medians, "mean": standing.cluster_means}
        summary = of_block[settings.representative]
        parts = []
        for block in image_blocks(btf_images["images"]):
            columns = transposed(block.astype(np.float32))
            reduced = summary(columns.reshape(len(columns), -1), order, starts)
            parts.append(reduced.reshape(clusters, -1, 3))
            progress(0.3 + 0.7 * sum(p.shape[1] for p in parts) / len(btf_images["images"]))
        values = np.concatenate(parts, axis=1)
    sizes = np.diff(starts)
    variables = {
        "ids": ("texel", ids),
        "sizes": ("cluster", sizes),
        "representatives": (("cluster", "image", "channel"), values),
        "start": (("cluster", "latent"), warm_start(centres)),
    }
    return xr.Dataset(variables, attrs=shape), {"clusters": clusters, "largest": int(sizes.max())}
