"""What is kept of a trained network: `compressed_btf`, one file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    abrdf_reader,
    btf_file_of,
    compressed_btf_dataset,
    compressed_btf_of,
    float_btf_file,
    pairs_of,
    quantised_btf_file,
    runtime_btf,
    trained_network_of,
)
from assets_defs.neural_btf.declaration import BTF
from assets_defs.neural_btf.network import stored_training_data
from assets_defs.settings import Preset, Settings
from assets_defs.system import Pictures, Progress, Result
from pipelines.neural_btf import figures, file_figures
from pipelines.neural_btf.clusters import warm_start
from pipelines.neural_btf.decoder_arrays import LATENTS, direction_inputs
from pipelines.neural_btf.representatives import cluster_means, cluster_members
from pipelines.neural_btf.training.plan import FineTuningPlan, TrainingPlan
from storage.btf_file import Quantised, write_btf_file
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion
from storage.work_state import WorkState

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.neural_btf.training.fine_tuning import QuantisedNetwork

_MIP_BYTES = 2 << 30


class FileSettings(Settings):
    """How a network becomes a file."""

    form: Literal["quantised", "float32"] = Field(
        "quantised", description="quantised: trained on, knowing it; float32: the paper's, as it is"
    )
    latents: int = Field(
        8, ge=8, le=32, multiple_of=4, description="Quantised: latents a texel; 8 in the network"
    )
    share: float = Field(
        0.1565,
        gt=0.03,
        le=1.0,
        description="Quantised: bytes over those of the paper's decoder and latents",
    )
    file_steps: int = Field(150, ge=1, description="Quantised: steps of gradient descent")
    file_rate: float = Field(0.003, gt=0.0, le=1.0, description="Quantised: learning rate")
    student: bool = Field(
        True,
        description="Quantised: with a small decoder for live views; without, more bits for texels",
    )
    file_seed: int = Field(0, ge=0, description="Quantised: seed of its batches")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"file_steps": 200, "share": 0.25},
        "paper": {"latents": 16, "file_steps": 16_000, "file_rate": 0.01},
    }


# ---- checks ----------------------------------------------------------------------------------


def _size_ratio(version: StoredVersion) -> float:
    btf = btf_file_of(version.dataset)
    clusters = len(btf.latents.symbols if isinstance(btf.latents, Quantised) else btf.latents)
    table = figures.table_bytes(clusters, btf.height * btf.width)
    return version.dataset.sizes["byte"] / table


def _rmse_over_network(version: StoredVersion) -> float:
    matrix = version.input("abrdf_matrix")
    network = runtime_btf(
        float_btf_file(version.input("neural_btf"), version.input("abrdf_clusters"), matrix)
    )
    return file_figures.rmse_ratio(
        compressed_btf_of(version.dataset),
        network,
        abrdf_reader(matrix),
        direction_inputs(pairs_of(matrix)),
    )


def _curve_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import loss_curve

    if "curve_step" not in dataset:
        return {}
    return {"loss": loss_curve(dataset["curve_step"].values, dataset["curve_rmse"].values)}


# ---- compressed_btf --------------------------------------------------------------------------


def fine_tuning_plan(settings: FileSettings, clusters: int, texels: int) -> FineTuningPlan:
    """The plan that the settings describe."""
    index = math.ceil(math.log2(clusters)) * texels / 8 if clusters < texels else 0.0
    return FineTuningPlan(
        file_bytes=settings.share * figures.table_bytes(clusters, clusters) + index,
        steps=settings.file_steps,
        rate=settings.file_rate,
        student=settings.student,
        seed=settings.file_seed,
    )


def quantised_network(
    settings: FileSettings,
    work: WorkState,
    progress: Progress,
    abrdf_matrix: xr.Dataset,
    abrdf_clusters: xr.Dataset,
    neural_btf: xr.Dataset,
) -> QuantisedNetwork:
    """Train a stored network on, rounded; a run that was killed goes on where it was."""
    import numpy as np

    from pipelines.neural_btf.mips import averaged_abrdfs
    from pipelines.neural_btf.training.fine_tuning import fine_tune

    data = stored_training_data(TrainingPlan(), abrdf_matrix, abrdf_clusters)
    views = np.unique(data.directions[:, 2:], axis=0, return_inverse=True)[1].ravel()
    coarse = averaged_abrdfs(abrdf_reader(abrdf_matrix), data.size, views, budget=_MIP_BYTES)

    clusters, texels = abrdf_clusters.sizes["cluster"], abrdf_clusters.sizes["texel"]
    plan = fine_tuning_plan(settings, clusters, texels)
    scores = cluster_means(
        abrdf_matrix["scores"].values,
        cluster_members(abrdf_clusters["ids"].values, clusters),
    )
    more = warm_start(scores, settings.latents)[:, LATENTS:]

    def file_bytes(network: QuantisedNetwork) -> int:
        return len(write_btf_file(quantised_btf_file(network, abrdf_clusters, abrdf_matrix)))

    with work.alone():
        return fine_tune(
            data,
            trained_network_of(neural_btf, len(data.directions)),
            more,
            coarse,
            plan,
            file_bytes,
            resume=work.read(),
            keep=work.keep,
            progress=progress,
        )


@BTF.asset(
    schemas.COMPRESSED_BTF,
    by=("material", "clusters"),
    settings=FileSettings,
    inputs=("abrdf_matrix", "abrdf_clusters", "neural_btf"),
    kinds=frozenset({"zarr", "pytorch"}),
    pictures=_curve_pictures,
    checks=(
        Check(
            "size_ratio",
            "Bytes of the whole file over decoder, latents and index list of the paper's table 1.",
            _size_ratio,
            at_most=1.02,
            change=0.01,
        ),
        Check(
            "rmse_over_network",
            "RMSE of texels and pairs over that of the float network that it was made from.",
            _rmse_over_network,
            at_most=1.1,
            change=0.02,
        ),
    ),
)
def compressed_btf(
    settings: FileSettings,
    progress: Progress,
    work: WorkState,
    abrdf_matrix: xr.Dataset,
    abrdf_clusters: xr.Dataset,
    neural_btf: xr.Dataset,
) -> Result:
    """Train decoder and latents to be rounded, and write the file that is needed at run time."""
    inputs = abrdf_matrix, abrdf_clusters, neural_btf
    if settings.form == "float32":
        dataset = compressed_btf_dataset(float_btf_file(neural_btf, abrdf_clusters, abrdf_matrix))
    else:
        network = quantised_network(settings, work, progress, *inputs)
        btf = quantised_btf_file(network, abrdf_clusters, abrdf_matrix)
        dataset = compressed_btf_dataset(btf, (network.curve_step, network.curve_rmse))
    values, stored = abrdf_matrix["abrdfs"].size, dataset.sizes["byte"]
    return dataset, {
        "file bytes": stored,
        "ratio to float32": values * 4 / stored,
        "ratio to 8 bit": values / stored,
    }
