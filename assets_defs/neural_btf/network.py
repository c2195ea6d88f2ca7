"""Training: `neural_btf`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    abrdf_clusters_of,
    abrdf_reader,
    neural_btf_dataset,
    pairs_of,
)
from assets_defs.neural_btf.declaration import BTF
from assets_defs.neural_btf.photographs import texels_and_photographs
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import Pictures, Progress, Result
from pipelines.neural_btf import figures
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.training.plan import Targets, Training, TrainingPlan, WarmStart
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion
from storage.work_state import WorkState

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.neural_btf.training.data import TrainingData

POOL_BYTES = 6 << 30


# ---- neural_btf ------------------------------------------------------------------------------


class NetworkSettings(Settings):
    """How the network is trained."""

    training: Training = Field(
        "fast", description="paper: SGD on five ABRDFs through the encoder; fast: see docs/btf.md"
    )
    steps: int = Field(250, ge=1, description="Fast: steps of gradient descent")
    rate: float = Field(0.01, gt=0.0, le=1.0, description="Fast: largest learning rate")
    batch_texels: int = Field(64, ge=1, description="Fast: texels of a batch")
    batch_images: int = Field(128, ge=1, description="Fast: photographs of a batch")
    parallax: bool = Field(
        True, description="Fast, without clusters: look latents up beside a texel, by the view"
    )
    warm_start: WarmStart = Field("pca", description="Fast: where the latents start")
    encoder_share: float = Field(
        0.25, ge=0.0, le=1.0, description="Warm start encoder: share of the steps through it"
    )
    encoder_steps: int = Field(
        25, ge=0, description="Fast: steps of fitting the encoder to the latents at the end"
    )
    paper_steps: int = Field(2000, ge=1, description="Paper: steps of gradient descent")
    paper_rate: float = Field(0.08, gt=0.0, le=1.0, description="Paper: learning rate")
    paper_batch: int = Field(
        5, ge=2, description="Paper: ABRDFs of a batch, each with all its directions (our reading)"
    )
    targets: Targets = Field(
        "texels", description="Paper: fit every texel, or its cluster's representative (unsaid)"
    )
    widths: list[int] = Field(
        [],
        max_length=9,
        description="Channels of the encoder's blocks (unsaid); empty: 8, 16, 16, …",
    )
    network_seed: int = Field(0, ge=0, description="Seed of the network and its batches")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"steps": 500, "batch_images": 64, "encoder_steps": 40, "paper_steps": 30},
        "paper": {"steps": 16_000, "encoder_steps": 300, "paper_steps": 200_000},
    }


@BTF.before_work
def _check_widths(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Refuse too deep an encoder before anything is made."""
    if "clusters" not in sources:
        return
    network = settings["neural_btf"]
    assert isinstance(network, NetworkSettings)
    _, images = texels_and_photographs(sources["material"], settings["btf_images"])
    if 3 ** len(network.widths) > images or any(width < 1 for width in network.widths):
        raise ValueError(
            f"{sources['material'].name}: widths is {network.widths}; expected fewer positive "
            f"numbers, as every block leaves a third of {images} photographs."
        )


def training_plan(settings: NetworkSettings) -> TrainingPlan:
    """The plan that the settings describe."""
    paper = settings.training == "paper"
    return TrainingPlan(
        training=settings.training,
        steps=settings.paper_steps if paper else settings.steps,
        rate=settings.paper_rate if paper else settings.rate,
        batch_texels=settings.paper_batch if paper else settings.batch_texels,
        batch_images=settings.batch_images,
        widths=tuple(settings.widths),
        warm_start=settings.warm_start,
        encoder_share=settings.encoder_share,
        encoder_steps=settings.encoder_steps,
        parallax=settings.parallax,
        targets=settings.targets,
        seed=settings.network_seed,
    )


def stored_training_data(
    plan: TrainingPlan, abrdf_matrix: xr.Dataset, abrdf_clusters: xr.Dataset
) -> TrainingData:
    """What the network is fitted to by a plan; of a large matrix a part at a time is in memory."""
    from pipelines.neural_btf.abrdf_pool import AbrdfPool
    from pipelines.neural_btf.training.data import AbrdfScale, training_data

    abrdfs = abrdf_matrix["abrdfs"]
    texels, images, _ = abrdfs.shape
    pool = AbrdfPool(
        abrdf_reader(abrdf_matrix),
        texels,
        images,
        block=abrdfs.chunks[0][0] if abrdfs.chunks else texels,
        budget=POOL_BYTES,
        seed=plan.seed,
    )
    return training_data(
        pool,
        abrdf_clusters_of(abrdf_clusters),
        AbrdfScale(
            abrdf_matrix["mean"].values,
            abrdf_matrix["deviation"].values,
            float(abrdf_matrix["alpha"]),
        ),
        direction_inputs(pairs_of(abrdf_matrix)),
        (int(abrdf_matrix["height"]), int(abrdf_matrix["width"])),
        plan,
    )


def _curve_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import loss_curve

    return {"loss": loss_curve(dataset["curve_step"].values, dataset["curve_rmse"].values)}


def _loss_ratio(version: StoredVersion) -> float:
    return figures.loss_ratio(version.dataset["curve_rmse"].values)


def _encoder_residual(version: StoredVersion) -> float | None:
    dataset = version.dataset
    return float(dataset["encoder_residual"]) if "encoder_residual" in dataset else None


@BTF.asset(
    schemas.NEURAL_BTF,
    by=("material", "clusters"),
    settings=NetworkSettings,
    inputs=("abrdf_matrix", "abrdf_clusters"),
    kinds=frozenset({"zarr", "pytorch"}),
    pictures=_curve_pictures,
    checks=(
        Check(
            "loss_ratio",
            "RMSE of the last tenth of training over that of the first.",
            _loss_ratio,
            at_most=0.95,
            change=0.05,
        ),
        Check(
            "encoder_residual",
            "RMSE of the encoder's latents against the stored ones, in their deviations: the mean "
            "latents have 1.",
            _encoder_residual,
            at_most=0.8,
            change=0.1,
        ),
    ),
)
def neural_btf(
    settings: NetworkSettings,
    progress: Progress,
    work: WorkState,
    abrdf_matrix: xr.Dataset,
    abrdf_clusters: xr.Dataset,
) -> Result:
    """Train the network; a run that was killed goes on where it was."""
    from pipelines.neural_btf.training.trainer import train

    plan = training_plan(settings)
    data = stored_training_data(plan, abrdf_matrix, abrdf_clusters)
    with work.alone():
        trained = train(data, plan, resume=work.read(), keep=work.keep, progress=progress)
    shown = {"RMSE of the last batches": float(trained.curve_rmse[-1])}
    return neural_btf_dataset(trained), shown
