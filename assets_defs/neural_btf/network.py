"""Training, and what is kept of it: `neural_btf`, `compressed_btf`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    compressed,
    pairs_of,
    payload_bytes,
    reader,
)
from assets_defs.neural_btf.declaration import BTF, NetworkSettings
from assets_defs.settings import Settings
from assets_defs.system import Metadata
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion
from storage.work_state import WorkState

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.neural_btf.training import TrainingData

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_POOL_BYTES = 6 << 30


# ---- neural_btf ------------------------------------------------------------------------------


def _curve_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import loss_curve

    return {"loss": loss_curve(dataset["curve_step"].values, dataset["curve_rmse"].values)}


def _loss_ratio(checked: StoredVersion) -> float:
    curve = checked.dataset["curve_rmse"].values
    tenth = max(1, len(curve) // 10)
    return float(curve[-tenth:].mean() / curve[:tenth].mean())


def _encoder_residual(checked: StoredVersion) -> float | None:
    dataset = checked.dataset
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
            "RMSE of the encoder's latents against the stored ones, in their deviations.",
            _encoder_residual,
            at_most=2.0,
            change=0.2,
        ),
    ),
)
def neural_btf(
    settings: NetworkSettings,
    progress: Callable[[float], None],
    work: WorkState,
    abrdf_matrix: xr.Dataset,
    abrdf_clusters: xr.Dataset,
) -> Result:
    """Train the network; a run that was killed goes on where it was."""
    import xarray as xr

    from pipelines.neural_btf.network import decoder_arrays, encoder_vector
    from pipelines.neural_btf.training import train

    data = training_data(settings, abrdf_matrix, abrdf_clusters)
    plan = training_plan(settings, abrdf_matrix.sizes["image"])
    trained = train(data, plan, resume=work.read(), keep=work.keep, progress=progress)
    variables = {
        **_decoder_variables(decoder_arrays(trained.decoder)),
        "latents": (("cluster", "latent"), trained.latents),
        "encoder": ("parameter", encoder_vector(trained.encoder)),
        "curve_step": ("point", trained.curve_step),
        "curve_rmse": ("point", trained.curve_rmse),
    }
    if trained.encoder_residual is not None:
        variables["encoder_residual"] = ((), trained.encoder_residual)
    dataset = xr.Dataset(variables, attrs={"widths": list(plan.widths)})
    return dataset, {"RMSE of the last batches": float(trained.curve_rmse[-1])}


def training_plan(settings: NetworkSettings, images: int) -> Any:
    """The plan that the settings describe, for a number of photographs."""
    from pipelines.neural_btf.network import encoder_blocks
    from pipelines.neural_btf.training import Plan

    paper = settings.training == "paper"
    return Plan(
        training=settings.training,
        steps=settings.paper_steps if paper else settings.steps,
        rate=settings.paper_rate if paper else settings.rate,
        batch_texels=settings.paper_batch if paper else settings.batch_texels,
        batch_images=settings.batch_images,
        widths=tuple(settings.widths) or (8, *(16,) * (encoder_blocks(images) - 1)),
        warm_start=settings.warm_start,
        encoder_share=settings.encoder_share,
        encoder_steps=settings.encoder_steps,
        seed=settings.network_seed,
    )


def training_data(
    settings: NetworkSettings, abrdf_matrix: xr.Dataset, abrdf_clusters: xr.Dataset
) -> TrainingData:
    """What the network is fitted to, by the settings."""
    import numpy as np

    from pipelines.neural_btf.network import direction_inputs
    from pipelines.neural_btf.pool import AbrdfPool, mean_abrdfs
    from pipelines.neural_btf.training import TrainingData

    abrdfs = abrdf_matrix["abrdfs"]
    texels, images, _ = abrdfs.shape
    ids = abrdf_clusters["ids"].values
    sizes = abrdf_clusters["sizes"].values
    seen = abrdf_clusters.get("representatives")
    representatives = None if seen is None else seen.values
    pool = AbrdfPool(
        reader(abrdfs),
        texels,
        images,
        block=abrdfs.chunks[0][0] if abrdfs.chunks else texels,
        budget=_POOL_BYTES,
        seed=settings.network_seed,
    )
    owner, weights = ids.astype(np.int64), np.ones(texels)
    if representatives is not None:
        if settings.training == "fast":
            pool = AbrdfPool.of_array(mean_abrdfs(pool, ids, len(sizes)))
            owner, weights = np.arange(len(sizes)), sizes.astype(np.float64)
        elif settings.targets == "representatives":
            pool = AbrdfPool.of_array(representatives.astype(np.float16))
            owner, weights = np.arange(len(sizes)), sizes.astype(np.float64)
    return TrainingData(
        pool=pool,
        owner=owner,
        weights=weights,
        representatives=representatives,
        mean=abrdf_matrix["mean"].values,
        deviation=abrdf_matrix["deviation"].values,
        directions=direction_inputs(pairs_of(abrdf_matrix)),
        alpha=float(abrdf_matrix["alpha"]),
        start=abrdf_clusters["start"].values,
    )


def _decoder_variables(arrays: Mapping[str, NDArray[np.float32]]) -> dict[str, Any]:
    """A decoder's arrays with the dimensions that the schemas give them."""
    declared = schemas.COMPRESSED_BTF.variables
    return {name: (declared[name].dims, values) for name, values in arrays.items()}


# ---- compressed_btf --------------------------------------------------------------------------


class PackSettings(Settings):
    """Nothing to choose: the payload is the paper's."""


def _bytes_over_table(checked: StoredVersion) -> float:
    from pipelines.neural_btf.figures import table_bytes

    dataset = checked.dataset
    texels = int(dataset["height"]) * int(dataset["width"])
    return abs(payload_bytes(dataset) - table_bytes(dataset.sizes["cluster"], texels))


def _decoding_error(checked: StoredVersion) -> float:
    """Largest step between the stored form's and the trained network's values, 64 texels."""
    import numpy as np

    from pipelines.neural_btf.figures import decoded_plainly
    from pipelines.neural_btf.network import direction_inputs

    stored = compressed(checked.dataset)
    trained = checked.input("neural_btf").load()
    ids = checked.input("abrdf_clusters")["ids"].values
    directions = direction_inputs(pairs_of(checked.input("abrdf_matrix")))[::97]
    texels = np.unique(np.linspace(0, stored.texels - 1, 64).astype(int))
    arrays = {str(name): trained[name].values for name in trained}
    expected = decoded_plainly(arrays, arrays["latents"][ids[texels]], directions)
    found = np.concatenate([stored.abrdfs(texel, texel + 1, directions) for texel in texels])
    return float(np.abs(found - expected).max())


@BTF.asset(
    schemas.COMPRESSED_BTF,
    by=("material", "clusters"),
    settings=PackSettings,
    inputs=("abrdf_matrix", "abrdf_clusters", "neural_btf"),
    checks=(
        Check(
            "bytes_over_table",
            "Bytes of decoder, latents and index list, difference from the paper's table 1.",
            _bytes_over_table,
            at_most=0.0,
        ),
        Check(
            "decoding_error",
            "Largest difference of decoded values from the trained network's, over alpha.",
            _decoding_error,
            at_most=1e-4,
        ),
    ),
)
def compressed_btf(
    settings: PackSettings,
    abrdf_matrix: xr.Dataset,
    abrdf_clusters: xr.Dataset,
    neural_btf: xr.Dataset,
) -> Result:
    """Put together what is needed at run time."""
    return packed(neural_btf, abrdf_clusters, abrdf_matrix)


def packed(neural_btf: xr.Dataset, abrdf_clusters: xr.Dataset, abrdf_matrix: xr.Dataset) -> Result:
    """The runtime BTF as a dataset, and its bytes."""
    kept = [name for name in schemas.COMPRESSED_BTF.variables if name in neural_btf]
    dataset = neural_btf[kept].assign(
        {name: abrdf_matrix[name] for name in ("alpha", "height", "width")}
    )
    texels = abrdf_clusters.sizes["texel"]
    if abrdf_clusters.sizes["cluster"] < texels:
        dataset["ids"] = abrdf_clusters["ids"]
    dataset.attrs = {}
    payload = payload_bytes(dataset)
    images = abrdf_matrix.sizes["image"]
    shown = {
        "payload bytes": payload,
        "ratio to float32": images * texels * 12 / payload,
        "ratio to 8 bit": images * texels * 3 / payload,
    }
    return dataset, shown
