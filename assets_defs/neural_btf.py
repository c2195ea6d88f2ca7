"""BTFs compressed by a neural network (docs/btf.md): the graph's assets and checks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check, Checked
from assets_defs.pictures import table
from assets_defs.settings import Preset, Settings
from assets_defs.system import Dimension, Metadata, Source, System
from pipelines.neural_btf.virtual_cloth import MATERIALS
from storage.readers.btf import open_btf
from storage.schemas import neural_btf as schemas
from storage.versions import Slot
from storage.work_state import WorkState

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.directions import Pairs
    from pipelines.neural_btf.compressed import CompressedBtf
    from pipelines.neural_btf.training import TrainingData

NONE = "none"
"""The column of the tables without clusters: every texel has its own latents."""
_BAND_BYTES = 1 << 20
_BLOCK_BYTES = 96 << 20
_POOL_BYTES = 6 << 30

Pictures = dict[str, "NDArray[np.uint8]"]
Result = tuple["xr.Dataset", Metadata]


def _check_material(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        open_btf(source.path, settings.get("crop"))
    elif settings.get("crop") is not None:
        raise ValueError(f"crop is set for {source.name}; expected a BTF of yours.")


def _check_clusters(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Refuse more clusters than texels before anything is made."""
    if "clusters" not in sources or sources["clusters"].key == NONE:
        return
    taken_in = settings["btf_images"]
    assert isinstance(taken_in, ImageSettings)
    path = sources["material"].path
    if path is None:
        texels = taken_in.texels**2
    else:
        measured = open_btf(path, taken_in.crop)
        texels = measured.height * measured.width
    if int(sources["clusters"].key) > texels:
        raise ValueError(
            f"{sources['material'].name}: clusters is {sources['clusters'].key}; "
            f"expected at most {texels}, the number of texels."
        )


BTF = System(
    name="neural_btf",
    title="BTFs compressed by a neural network",
    dimensions=(
        Dimension(
            "material",
            builtin=tuple(MATERIALS),
            examples=tuple(MATERIALS),
            default="knit",
            suffixes=(".zip", ".btf"),
            folders=True,
            check=_check_material,
        ),
        Dimension(
            "clusters",
            builtin=(NONE, "100", "500", "1000", "2000"),
            examples=(NONE, "100"),
            default=NONE,
            suffixes=(),
            numbers=True,
            check=lambda source, settings: None,
        ),
    ),
    check=_check_clusters,
)


# ---- btf_images ------------------------------------------------------------------------------


class ImageSettings(Settings):
    """How the BTF is taken in, or measured on the virtual gonioreflectometer."""

    crop: tuple[int, int, int, int] | None = Field(
        None, description="Left, top, width, height in pixels; whole photographs by default"
    )
    texels: int = Field(48, ge=4, le=1024, description="Virtual cloth: texels a side")
    directions: Literal[15, 81, 151] = Field(
        81, description="Virtual cloth: directions of lights, and of views (15, 81 or 151)"
    )
    samples: int = Field(2, ge=1, le=256, description="Virtual cloth: rays a texel")
    cloth_seed: int = Field(0, ge=0, description="Virtual cloth: seed")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"texels": 12, "directions": 15, "samples": 1},
        "paper": {"texels": 100, "samples": 4},
    }


def _pairs(dataset: xr.Dataset) -> Pairs:
    from pipelines.directions import Pairs

    return Pairs(dataset["light"].values, dataset["view"].values)


def _image_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import photograph_sheet, shown_images

    shown = dataset["images"][shown_images(_pairs(dataset))]
    return {"photographs": photograph_sheet(shown.values)}


def _missing_pairs(checked: Checked) -> float:
    from pipelines.neural_btf.figures import missing_pairs

    return missing_pairs(_pairs(checked.dataset))


def _dark_share(checked: Checked) -> float:
    images = checked.dataset["images"]
    return float((images.max(dim=("y", "x", "channel")) <= 0).mean().compute())


def _mean_radiance(checked: Checked) -> float:
    return float(checked.dataset["images"].mean(dtype="float64").compute())


@BTF.asset(
    schemas.BTF_IMAGES,
    by=("material",),
    settings=ImageSettings,
    from_source=True,
    pictures=_image_pictures,
    checks=(
        Check(
            "missing_pairs",
            "Pairs of light and view that are missing or there twice.",
            _missing_pairs,
            at_most=0.0,
        ),
        Check(
            "dark_share",
            "Share of the photographs that are black: their light or their file failed.",
            _dark_share,
            at_most=0.0,
        ),
        Check(
            "mean_radiance",
            "Mean of all values.",
            _mean_radiance,
            at_least=0.001,
            at_most=10.0,
            change=0.005,
        ),
    ),
)
def btf_images(
    settings: ImageSettings, source: Source, progress: Callable[[float], None]
) -> Result:
    """Open the photographs, or photograph the virtual cloth; both lazily, view by view."""
    import xarray as xr

    from pipelines.directions import Pairs, all_pairs, hemisphere_table

    if source.path is None:
        directions = hemisphere_table(settings.directions)
        pairs = all_pairs(directions, directions)
        height = width = settings.texels
        read = _virtual_photographs(source.key, settings, directions, progress)
        about = {"layout": "virtual gonioreflectometer", "colour": "linear RGB"}
        lights = len(directions)
    else:
        measured = open_btf(source.path, settings.crop)
        pairs = Pairs(measured.light, measured.view)
        height, width = measured.height, measured.width
        read = _told(measured.read, measured.images, progress)
        about = {"layout": measured.layout, "colour": measured.colour}
        lights = measured.lights_per_view
    dataset = xr.Dataset(
        {
            "images": (
                ("image", "y", "x", "channel"),
                _lazy_images(read, len(pairs.light), lights, height, width),
            ),
            "light": (("image", "angle"), pairs.light),
            "view": (("image", "angle"), pairs.view),
        },
        attrs={"name": source.name, **about},
    )
    return dataset, {"photographs": len(pairs.light), "texels": height * width, **about}


def _virtual_photographs(
    material: str,
    settings: ImageSettings,
    directions: NDArray[np.float64],
    progress: Callable[[float], None],
) -> Callable[[int, int], NDArray[np.float32]]:
    """Photographs first … last - 1, all of one view."""
    import threading

    from pipelines.neural_btf.gonioreflectometer import Gonioreflectometer
    from pipelines.neural_btf.virtual_cloth import make_cloth

    lock = threading.Lock()  # the gonioreflectometer uses all cores by itself
    size = (settings.texels, settings.texels)
    cloth = make_cloth(material, settings.cloth_seed)
    gonio = Gonioreflectometer(cloth, directions, size, settings.samples, settings.cloth_seed)
    done: set[int] = set()

    def read(first: int, last: int) -> NDArray[np.float32]:
        view, light = divmod(first, len(directions))
        if light or last - first != len(directions):
            raise IndexError(f"photographs {first} to {last} are not one view's")
        with lock:
            photographs = gonio.photographs(directions[view])
            done.add(view)
            progress(len(done) / len(directions))
        return photographs

    return read


def _told(
    read: Callable[[int, int], NDArray[np.float32]],
    images: int,
    progress: Callable[[float], None],
) -> Callable[[int, int], NDArray[np.float32]]:
    """The same reader, which tells how far it has come."""
    done: set[int] = set()

    def telling(first: int, last: int) -> NDArray[np.float32]:
        photographs = read(first, last)
        done.update(range(first, last))
        progress(len(done) / images)
        return photographs

    return telling


def _lazy_images(
    read: Callable[[int, int], NDArray[np.float32]],
    images: int,
    block: int,
    height: int,
    width: int,
) -> Any:
    """A lazy array (image, y, x, channel) float16, read a view at a time.

    Its chunks are bands of rows of a view's photographs: the transposition to texels reads one
    band of all views at a time, and no more.
    """
    import dask
    import dask.array as da
    import numpy as np

    from pipelines.neural_btf.abrdf import check_values

    def half(first: int, last: int) -> NDArray[np.float16]:
        values = read(first, last)
        check_values(values)
        return values.astype(np.float16)

    parts = []
    for first in range(0, images, block):
        last = min(first + block, images)
        shape = (last - first, height, width, 3)
        parts.append(da.from_delayed(dask.delayed(half)(first, last), shape, np.float16))
    rows = -(-_BAND_BYTES // (block * width * 3 * 2))
    return da.concatenate(parts).rechunk({1: min(rows, height)})


# ---- abrdf_matrix ----------------------------------------------------------------------------


class MatrixSettings(Settings):
    """What the clustering sees of the ABRDFs."""

    components: int = Field(32, ge=8, le=512, description="Principal components (unsaid in paper)")
    space: Literal["log", "standardised", "linear"] = Field(
        "log", description="Values of the principal components: x2, x3 or x1 (unsaid in the paper)"
    )


def _reader(array: xr.DataArray) -> Callable[[int, int], NDArray[np.floating]]:
    """First to last - 1 of the first dimension, as they are wanted."""
    return lambda first, last: array[first:last].values


def _image_blocks(images: xr.DataArray) -> Iterator[NDArray[np.float16]]:
    """Photographs a chunk at a time, all texels."""
    start = 0
    for count in images.chunks[0] if images.chunks else (len(images),):
        yield images[start : start + count].values
        start += count


def _explained(checked: Checked) -> float:
    dataset = checked.dataset
    return float((dataset["singular_values"] ** 2).sum() / dataset["total_variation"])


def _sampled(checked: Checked) -> tuple[xr.Dataset, NDArray[np.int64], NDArray[np.floating]]:
    """A few photographs, from the first to the last."""
    import numpy as np

    images = checked.input("btf_images")["images"]
    numbers = np.unique(np.linspace(0, len(images) - 1, 5).astype(int))
    return checked.dataset, numbers, images[numbers].values


def _transposition_error(checked: Checked) -> float:
    from pipelines.neural_btf.figures import transposition_error

    dataset, numbers, images = _sampled(checked)
    return transposition_error(dataset["abrdfs"][:, numbers].values, images)


def _statistics_error(checked: Checked) -> float:
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
    for block in _image_blocks(images):
        found.append(abrdf.statistics(block))
        centred = abrdf.columns(block, settings.space)
        centred -= centred.mean(axis=0)
        variation += float(np.sum(centred.astype(np.float64) ** 2))
        progress(0.3 * sum(len(part.mean) for part in found) / count)
    rank = min(settings.components, height * width, 3 * count)
    parts = principal_components(
        lambda: (abrdf.columns(block, settings.space) for block in _image_blocks(images)), rank
    )
    progress(0.9)
    matrix = images.data.transpose(1, 2, 0, 3).reshape(height * width, count, 3)
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


def _smallest_cluster(checked: Checked) -> float:
    import numpy as np

    dataset = checked.dataset
    counted = np.bincount(dataset["ids"].values, minlength=dataset.sizes["cluster"])
    return float(counted.min() if (counted == dataset["sizes"].values).all() else 0)


def _spread_ratio(checked: Checked) -> float:
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
        for block in _image_blocks(btf_images["images"]):
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


# ---- neural_btf ------------------------------------------------------------------------------


class NetworkSettings(Settings):
    """How the network is trained."""

    training: Literal["fast", "paper"] = Field(
        "fast", description="paper: SGD on five ABRDFs through the encoder; fast: see docs/btf.md"
    )
    steps: int = Field(600, ge=1, description="Fast: steps of gradient descent")
    rate: float = Field(0.01, gt=0.0, le=1.0, description="Fast: largest learning rate")
    batch_texels: int = Field(64, ge=1, description="Fast: texels of a batch")
    batch_images: int = Field(128, ge=1, description="Fast: photographs of a batch")
    warm_start: Literal["pca", "encoder", "random"] = Field(
        "pca", description="Fast: where the latents start"
    )
    encoder_share: float = Field(
        0.25, ge=0.0, le=1.0, description="Warm start encoder: share of the steps through it"
    )
    encoder_steps: int = Field(
        60, ge=0, description="Fast: steps of fitting the encoder to the latents at the end"
    )
    paper_steps: int = Field(2000, ge=1, description="Paper: steps of gradient descent")
    paper_rate: float = Field(0.08, gt=0.0, le=1.0, description="Paper: learning rate")
    paper_batch: int = Field(
        5, ge=2, description="Paper: ABRDFs of a batch, each with all its directions (our reading)"
    )
    targets: Literal["texels", "representatives"] = Field(
        "texels", description="Paper: fit every texel, or its cluster's representative (unsaid)"
    )
    widths: list[int] = Field(
        [], description="Channels of the encoder's blocks (unsaid); empty: 8, 16, 16, …"
    )
    network_seed: int = Field(0, ge=0, description="Seed of the network and its batches")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"steps": 120, "batch_images": 64, "encoder_steps": 10, "paper_steps": 30},
        "paper": {"steps": 16_000, "encoder_steps": 300, "paper_steps": 200_000},
    }


def _curve_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.pictures import loss_curve

    return {"loss": loss_curve(dataset["curve_step"].values, dataset["curve_rmse"].values)}


def _loss_ratio(checked: Checked) -> float:
    curve = checked.dataset["curve_rmse"].values
    tenth = max(1, len(curve) // 10)
    return float(curve[-tenth:].mean() / curve[:tenth].mean())


def _encoder_residual(checked: Checked) -> float | None:
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
        _reader(abrdfs),
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
        directions=direction_inputs(_pairs(abrdf_matrix)),
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


def compressed(dataset: xr.Dataset) -> CompressedBtf:
    """The runtime BTF that a `compressed_btf` dataset holds."""
    from pipelines.neural_btf.compressed import CompressedBtf
    from pipelines.neural_btf.network import decoder_of

    arrays = {
        str(name): dataset[name].values
        for name in dataset
        if str(name).startswith(("weight_", "bias_"))
    }
    return CompressedBtf(
        decoder_of(arrays),
        dataset["latents"].values,
        dataset["ids"].values if "ids" in dataset else None,
        float(dataset["alpha"]),
        int(dataset["height"]),
        int(dataset["width"]),
    )


def payload_bytes(dataset: xr.Dataset) -> int:
    """Bytes of decoder, latents and index list of a `compressed_btf` dataset (table 1)."""
    return sum(
        int(dataset[name].nbytes)
        for name in dataset
        if str(name).startswith(("weight_", "bias_")) or name in ("latents", "ids")
    )


def _bytes_over_table(checked: Checked) -> float:
    from pipelines.neural_btf.figures import table_bytes

    dataset = checked.dataset
    texels = int(dataset["height"]) * int(dataset["width"])
    return abs(payload_bytes(dataset) - table_bytes(dataset.sizes["cluster"], texels))


def _decoding_error(checked: Checked) -> float:
    """Largest step between the stored form's and the trained network's values, 64 texels."""
    import numpy as np

    from pipelines.neural_btf.figures import decoded_plainly
    from pipelines.neural_btf.network import direction_inputs

    stored = compressed(checked.dataset)
    trained = checked.input("neural_btf").load()
    ids = checked.input("abrdf_clusters")["ids"].values
    directions = direction_inputs(_pairs(checked.input("abrdf_matrix")))[::97]
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


# ---- restored_images -------------------------------------------------------------------------


class RestoreSettings(Settings):
    """Nothing to choose: figure 7's pairs, and the errors of all photographs."""


def _restored_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.directions import Pairs
    from pipelines.neural_btf.pictures import error_picture, restored_picture

    shown = Pairs(dataset["pair_light"].values, dataset["pair_view"].values)
    return {
        "restored": restored_picture(dataset["original"].values, dataset["restored"].values, shown),
        "errors": error_picture(
            dataset["rmse_texel"].values,
            dataset["rmse_image"].values,
            Pairs(dataset["light"].values, dataset["view"].values),
        ),
    }


def _rmse(checked: Checked) -> float:
    return float(checked.dataset["rmse"])


def _rmse_over_none(checked: Checked) -> float | None:
    """Against the same material's version without clusters, if it was made alike."""
    from storage.errors import NoVersionError

    clusters, material = checked.slot.partition.split(".", 1)
    if clusters == NONE:
        return None
    store, names = checked.store, ("neural_btf", "restored_images")
    try:
        slots = {name: Slot(BTF.name, name, f"{NONE}.{material}") for name in names}
        other = store.record(slots["neural_btf"])
        without = float(store.open(slots["restored_images"])["rmse"])
        own_slot = Slot(BTF.name, "neural_btf", checked.slot.partition)
        own = store.record(own_slot)
    except NoVersionError:
        return None
    alike = [
        (
            record["settings"],
            next(i["content"] for i in record["inputs"] if i["asset"] == "abrdf_matrix"),
        )
        for record in (own, other)
    ]
    return float(checked.dataset["rmse"]) / without if alike[0] == alike[1] else None


def _worst(name: str) -> Callable[[Checked], float]:
    def worst(checked: Checked) -> float:
        return float(checked.dataset[name].max())

    return worst


_worst_image = _worst("rmse_image")
_worst_texel = _worst("rmse_texel")


@BTF.asset(
    schemas.RESTORED_IMAGES,
    by=("material", "clusters"),
    settings=RestoreSettings,
    inputs=("btf_images", "abrdf_matrix", "compressed_btf"),
    pictures=_restored_pictures,
    checks=(
        Check(
            "rmse",
            "RMSE of all photographs, values over alpha.",
            _rmse,
            at_most=0.12,
            change=0.002,
        ),
        Check(
            "rmse_over_none",
            "RMSE over that of the same material without clusters.",
            _rmse_over_none,
            at_most=1.5,
            change=0.05,
        ),
        Check(
            "worst_image",
            "RMSE of the worst pair of directions.",
            _worst_image,
            at_most=0.5,
            change=0.05,
        ),
        Check(
            "worst_texel",
            "RMSE of the worst texel.",
            _worst_texel,
            at_most=0.5,
            change=0.05,
        ),
    ),
)
def restored_images(
    settings: RestoreSettings,
    progress: Callable[[float], None],
    btf_images: xr.Dataset,
    abrdf_matrix: xr.Dataset,
    compressed_btf: xr.Dataset,
) -> Result:
    """Restore figure 7's photographs, and compare all of them with what was measured."""
    import numpy as np
    import xarray as xr

    from pipelines.directions import Pairs
    from pipelines.neural_btf.compressed import restoration_errors
    from pipelines.neural_btf.pictures import PAPER_PAIRS, nearest_images

    stored = compressed(compressed_btf)
    pairs = _pairs(btf_images)
    chosen = nearest_images(pairs, PAPER_PAIRS)
    shown = Pairs(pairs.light[chosen], pairs.view[chosen])
    abrdfs = abrdf_matrix["abrdfs"]
    texels = max(1, _BLOCK_BYTES // (abrdfs.shape[1] * 3 * 4))
    errors = restoration_errors(stored, _reader(abrdfs), pairs, block=texels, progress=progress)
    pixels = ("y", "x")
    dataset = xr.Dataset(
        {
            "original": (
                ("pair", *pixels, "channel"),
                btf_images["images"][chosen].values.astype(np.float32),
            ),
            "restored": (("pair", *pixels, "channel"), stored.photographs(shown)),
            "pair_light": (("pair", "angle"), shown.light),
            "pair_view": (("pair", "angle"), shown.view),
            "rmse": ((), errors.rmse),
            "rmse_image": ("image", errors.of_image),
            "rmse_texel": (pixels, errors.of_texel.reshape(stored.height, stored.width)),
            "light": btf_images["light"],
            "view": btf_images["view"],
        }
    )
    worst = int(errors.of_image.argmax())
    rows = [
        {
            "image": int(number),
            "view theta": float(np.degrees(pairs.view[number, 0])),
            "view phi": float(np.degrees(pairs.view[number, 1])),
            "light theta": float(np.degrees(pairs.light[number, 0])),
            "light phi": float(np.degrees(pairs.light[number, 1])),
            "RMSE": float(errors.of_image[number]),
        }
        for number in (*chosen, worst)
    ]
    return dataset, {"RMSE over alpha": errors.rmse, "pairs shown, and the worst": table(rows)}


# ---- cloth_frames ----------------------------------------------------------------------------


class ClothSettings(Settings):
    """The panel and its pictures."""

    width: int = Field(480, ge=32, le=8192, description="Width of the pictures, pixels")
    frames: int = Field(6, ge=1, le=720, description="Lights around the panel")
    tiles: float = Field(4.0, gt=0.0, le=100.0, description="Tiles over the panel's width")
    supersampling: int = Field(2, ge=1, le=8, description="Samples a pixel along each axis")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"width": 64, "frames": 2, "supersampling": 1},
        "paper": {"width": 960, "frames": 24},
    }


def _cloth_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.contact_sheet import contact_sheet

    count = dataset.sizes["frame"]
    shown = sorted({round(i * count / 6) for i in range(6)} & set(range(count)))
    return {"frames": contact_sheet(dataset["frames"].values[shown])}


def _coverage(checked: Checked) -> float:
    return float(checked.dataset["coverage"])


def _mean_brightness(checked: Checked) -> float:
    return float(checked.dataset["frames"].values.mean() / 255.0)


@BTF.asset(
    schemas.CLOTH_FRAMES,
    by=("material", "clusters"),
    settings=ClothSettings,
    inputs=("compressed_btf",),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_cloth_pictures,
    checks=(
        Check(
            "coverage",
            "Share of the picture with cloth: nothing drawn is 0.",
            _coverage,
            at_least=0.3,
            change=0.01,
        ),
        Check(
            "mean_brightness",
            "Mean of all pictures' 8-bit codes, in [0, 1].",
            _mean_brightness,
            at_least=0.02,
            at_most=0.95,
            change=0.01,
        ),
    ),
)
def cloth_frames(
    settings: ClothSettings,
    progress: Callable[[float], None],
    compressed_btf: xr.Dataset,
) -> Result:
    """Draw a folded panel of the decoded material under a light that moves around it."""
    import xarray as xr

    from pipelines.neural_btf.panel import draw_frames, moving_lights

    lights = moving_lights(settings.frames)
    drawn = draw_frames(
        compressed(compressed_btf),
        lights,
        width=settings.width,
        tiles=settings.tiles,
        supersampling=settings.supersampling,
        progress=progress,
    )
    dataset = xr.Dataset(
        {
            "frames": (("frame", "y", "x", "channel"), drawn.pictures),
            "light_direction": (("frame", "angle"), lights),
            "coverage": ((), drawn.coverage),
        }
    )
    return dataset, {"frames": settings.frames}
