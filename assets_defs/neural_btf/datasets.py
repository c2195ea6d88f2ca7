"""Stored datasets of this system and the objects of `pipelines`, in both directions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from pipelines.light.directions import Pairs
from pipelines.neural_btf.abrdf import PhotographBlocks, check_values, transposed_view
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import DECODER_ARRAY_NAMES, DecoderArrays
from storage.btf_file.contents import BtfFile
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.neural_btf.clusters import AbrdfClusters
    from pipelines.neural_btf.draping.frames import ClothFrames
    from pipelines.neural_btf.principal_abrdfs import AbrdfSummary
    from pipelines.neural_btf.restoration import RestorationErrors
    from pipelines.neural_btf.training.fine_tuning import QuantisedNetwork
    from pipelines.neural_btf.training.trainer import TrainedNetwork

_PIXELS = ("y", "x")
_ABRDFS = ("texel", "image", "channel")
_BAND_BYTES = 1 << 20
_ABRDF_CHUNK_BYTES = 8 << 20


# ---- photographs -----------------------------------------------------------------------------


class LazyPhotographs(NamedTuple):
    """Photographs of a material, measured or virtual; none is made before ``read``."""

    pairs: Pairs
    height: int
    width: int
    lights_per_view: int
    read: Callable[[int, int], NDArray[np.float32]]
    """Photographs first … last - 1, all of one view: (image, y, x, 3) linear RGB."""
    about: dict[str, str]
    """Where they come from, in words."""
    notes: tuple[str, ...] = ()
    """Sentences on what was converted, mended or left out of a user's files."""


def btf_images_dataset(photographs: LazyPhotographs, name: str) -> xr.Dataset:
    """`btf_images` of photographs that are read while they are stored."""
    import xarray as xr

    return xr.Dataset(
        {
            "images": (("image", *_PIXELS, "channel"), _lazy_images(photographs)),
            "light": (("image", "angle"), photographs.pairs.light),
            "view": (("image", "angle"), photographs.pairs.view),
        },
        attrs={"name": name, **photographs.about},
    )


def _lazy_images(photographs: LazyPhotographs) -> Any:
    """A lazy array (image, y, x, channel) float16, read a view at a time.

    Its chunks are bands of rows of a view's photographs: the transposition to texels reads one
    band of all views at a time, and no more.
    """
    import dask
    import dask.array as da
    import numpy as np

    pairs, height, width, block, read, *_ = photographs

    def half(first: int, last: int) -> NDArray[np.float16]:
        values = read(first, last)
        check_values(values)
        return values.astype(np.float16)

    parts = []
    for first in range(0, len(pairs.light), block):
        last = min(first + block, len(pairs.light))
        shape = (last - first, height, width, 3)
        parts.append(da.from_delayed(dask.delayed(half)(first, last), shape, np.float16))
    rows = -(-_BAND_BYTES // (block * width * 3 * 2))
    return da.concatenate(parts).rechunk({1: min(rows, height)})


def pairs_of(dataset: xr.Dataset) -> Pairs:
    """Light and view of a dataset's photographs."""
    return Pairs(dataset["light"].values, dataset["view"].values)


def photograph_blocks(images: xr.DataArray) -> PhotographBlocks:
    """Photographs a chunk at a time, all texels."""

    def read() -> Iterator[NDArray[np.float16]]:
        start = 0
        for count in images.chunks[0] if images.chunks else (len(images),):
            yield images[start : start + count].values
            start += count

    return PhotographBlocks(len(images), read)


# ---- ABRDFs and clusters ---------------------------------------------------------------------


def abrdf_matrix_dataset(summary: AbrdfSummary, btf_images: xr.Dataset) -> xr.Dataset:
    """`abrdf_matrix` of photographs, transposed while it is stored, and what is known of them."""
    import numpy as np
    import xarray as xr

    images = btf_images["images"]
    count, height, width, _ = images.shape
    texels = max(1, _ABRDF_CHUNK_BYTES // (count * 3 * 2))
    matrix = transposed_view(images.data).rechunk({0: texels, 1: -1, 2: -1})
    return xr.Dataset(
        {
            "abrdfs": (_ABRDFS, matrix),
            "mean": (("image", "channel"), summary.statistics.mean),
            "deviation": (("image", "channel"), summary.statistics.deviation),
            "alpha": ((), summary.alpha),
            "scores": (("texel", "component"), summary.scores),
            "singular_values": (("component",), summary.singular_values),
            "total_variation": ((), summary.total_variation),
            "light": btf_images["light"],
            "view": btf_images["view"],
            "height": ((), np.int32(height)),
            "width": ((), np.int32(width)),
        }
    )


def abrdf_reader(abrdf_matrix: xr.Dataset) -> Callable[[int, int], NDArray[np.floating]]:
    """ABRDFs of texels first to last - 1, read as they are wanted."""
    abrdfs = abrdf_matrix["abrdfs"]
    return lambda first, last: abrdfs[first:last].values


def abrdf_clusters_dataset(clusters: AbrdfClusters, size: tuple[int, int]) -> xr.Dataset:
    """`abrdf_clusters` of photographs of ``size`` (rows, columns)."""
    import xarray as xr

    variables = {
        "ids": ("texel", clusters.ids),
        "sizes": ("cluster", clusters.sizes),
        "start": (("cluster", "latent"), clusters.start),
    }
    if clusters.representatives is not None:
        variables["representatives"] = (("cluster", "image", "channel"), clusters.representatives)
    return xr.Dataset(variables, attrs={"height": size[0], "width": size[1]})


def abrdf_clusters_of(dataset: xr.Dataset) -> AbrdfClusters:
    """The clusters that an `abrdf_clusters` dataset holds."""
    from pipelines.neural_btf.clusters import AbrdfClusters

    seen = dataset.get("representatives")
    return AbrdfClusters(
        dataset["ids"].values,
        dataset["sizes"].values,
        None if seen is None else seen.values,
        dataset["start"].values,
    )


# ---- network ---------------------------------------------------------------------------------


def neural_btf_dataset(trained: TrainedNetwork) -> xr.Dataset:
    """`neural_btf` of a trained network."""
    import xarray as xr

    from pipelines.neural_btf.network import decoder_arrays, encoder_vector

    variables = {
        **_decoder_variables(decoder_arrays(trained.decoder)),
        "latents": (("cluster", "latent"), trained.latents),
        "encoder": ("parameter", encoder_vector(trained.encoder)),
        "curve_step": ("point", trained.curve_step),
        "curve_rmse": ("point", trained.curve_rmse),
    }
    if trained.parallax is not None:
        variables["parallax"] = (("monomial", "axis"), trained.parallax)
    if trained.encoder_residual is not None:
        variables["encoder_residual"] = ((), trained.encoder_residual)
    return xr.Dataset(variables, attrs={"widths": list(trained.encoder.widths)})


def trained_network_of(dataset: xr.Dataset, images: int) -> TrainedNetwork:
    """The network that a `neural_btf` dataset holds, trained on a number of photographs."""
    from pipelines.neural_btf.network import decoder_of, encoder_of
    from pipelines.neural_btf.training.trainer import TrainedNetwork

    residual, parallax = dataset.get("encoder_residual"), dataset.get("parallax")
    return TrainedNetwork(
        encoder_of(dataset["encoder"].values, images, dataset.attrs["widths"]),
        decoder_of(decoder_arrays_of(dataset)),
        dataset["latents"].values,
        None if parallax is None else parallax.values,
        dataset["curve_step"].values,
        dataset["curve_rmse"].values,
        None if residual is None else float(residual),
    )


def decoder_arrays_of(dataset: xr.Dataset) -> DecoderArrays:
    """The decoder's arrays in a `neural_btf` dataset."""
    return {name: dataset[name].values for name in DECODER_ARRAY_NAMES}


def _decoder_variables(arrays: DecoderArrays) -> dict[str, Any]:
    """A decoder's arrays with the dimensions that the schemas give them."""
    declared = schemas.NEURAL_BTF.variables
    return {name: (declared[name].dims, values) for name, values in arrays.items()}


# ---- compressed BTF --------------------------------------------------------------------------


def float_btf_file(
    neural_btf: xr.Dataset, abrdf_clusters: xr.Dataset, abrdf_matrix: xr.Dataset
) -> BtfFile:
    """The paper's form of a trained network: all numbers in float32, as table 1 counts them."""
    ids, parallax = abrdf_clusters["ids"].values, neural_btf.get("parallax")
    return BtfFile(
        decoder_arrays_of(neural_btf),
        neural_btf["latents"].values,
        **_about(abrdf_matrix),
        ids=ids if abrdf_clusters.sizes["cluster"] < len(ids) else None,
        parallax=None if parallax is None else parallax.values,
    )


def quantised_btf_file(
    network: QuantisedNetwork, abrdf_clusters: xr.Dataset, abrdf_matrix: xr.Dataset
) -> BtfFile:
    """A network that was trained to be quantised."""
    from storage.btf_file import Quantised

    ids = abrdf_clusters["ids"].values
    return BtfFile(
        {name: Quantised(*part) for name, part in network.decoder.items()},
        Quantised(network.latents, network.latent_steps),
        **_about(abrdf_matrix),
        ids=ids if abrdf_clusters.sizes["cluster"] < len(ids) else None,
        mips=tuple(Quantised(level, network.mip_steps) for level in network.mips),
        parallax=network.parallax,
        student={name: Quantised(*part) for name, part in network.student.items()},
    )


def _about(abrdf_matrix: xr.Dataset) -> dict[str, Any]:
    return {
        "height": int(abrdf_matrix["height"]),
        "width": int(abrdf_matrix["width"]),
        "alpha": float(abrdf_matrix["alpha"]),
    }


def compressed_btf_dataset(
    btf: BtfFile, curve: tuple[NDArray[np.int64], NDArray[np.float64]] | None = None
) -> xr.Dataset:
    """`compressed_btf` of what its file holds; ``curve``: steps and RMSE of its training."""
    import numpy as np
    import xarray as xr

    from storage.btf_file import write_btf_file

    variables: dict[str, Any] = {"file": ("byte", np.frombuffer(write_btf_file(btf), np.uint8))}
    if curve is not None:
        variables |= {"curve_step": ("point", curve[0]), "curve_rmse": ("point", curve[1])}
    return xr.Dataset(variables)


def btf_file_of(dataset: xr.Dataset) -> BtfFile:
    """What the file in a `compressed_btf` dataset holds."""
    from storage.btf_file import read_btf_file

    return read_btf_file(dataset["file"].values.tobytes(), "compressed_btf")


def compressed_btf_of(dataset: xr.Dataset) -> CompressedBtf:
    """The runtime BTF that a `compressed_btf` dataset holds."""
    return runtime_btf(btf_file_of(dataset))


def runtime_btf(btf: BtfFile) -> CompressedBtf:
    """The runtime BTF of a file: its numbers as float32."""
    from storage.btf_file import values_of

    return CompressedBtf(
        {name: values_of(part) for name, part in btf.decoder.items()},
        values_of(btf.latents),
        btf.ids,
        btf.alpha,
        btf.height,
        btf.width,
        tuple(values_of(level) for level in btf.mips),
        btf.parallax,
        btf.least,
        btf.largest,
        {name: values_of(part) for name, part in btf.student.items()} or None,
    )


# ---- restored photographs, frames ------------------------------------------------------------


def restored_images_dataset(
    compressed: CompressedBtf,
    errors: RestorationErrors,
    btf_images: xr.Dataset,
    shown: NDArray[np.integer],
) -> xr.Dataset:
    """`restored_images`: the photographs with these numbers restored, and all errors."""
    import numpy as np
    import xarray as xr

    pairs = pairs_of(btf_images)
    chosen = Pairs(pairs.light[shown], pairs.view[shown])
    original = btf_images["images"][shown].values.astype(np.float32)
    return xr.Dataset(
        {
            "original": (("pair", *_PIXELS, "channel"), original),
            "restored": (("pair", *_PIXELS, "channel"), compressed.photographs(chosen)),
            "pair_light": (("pair", "angle"), chosen.light),
            "pair_view": (("pair", "angle"), chosen.view),
            **{name: ((), value) for name, value in errors.quality.items()},
            "rmse_image": ("image", errors.of_image),
            "rmse_texel": (_PIXELS, errors.of_texel.reshape(compressed.height, compressed.width)),
            "light": btf_images["light"],
            "view": btf_images["view"],
        }
    )


def cloth_frames_dataset(frames: ClothFrames) -> xr.Dataset:
    """`cloth_frames` of pictures of the draped cloth."""
    import numpy as np
    import xarray as xr

    from pipelines.neural_btf.draping.frames import CAMERA_AZIMUTH, SUN_AZIMUTH

    turns = 360.0 * np.arange(len(frames.orbit)) / len(frames.orbit)
    return xr.Dataset(
        {
            "orbit": (("frame", *_PIXELS, "channel"), frames.orbit),
            "moving_light": (("frame", *_PIXELS, "channel"), frames.moving_light),
            "closeup": ((*_PIXELS, "channel"), frames.closeup),
            "camera_azimuth": ("frame", CAMERA_AZIMUTH + turns),
            "sun_azimuth": ("frame", SUN_AZIMUTH + turns),
            "compared": (("material", "small_y", "small_x", "channel"), frames.compared),
        }
    )


def _load_trained(version: StoredVersion) -> TrainedNetwork:
    return trained_network_of(version.dataset, version.input("abrdf_matrix").sizes["image"])


LOADERS: dict[str, Callable[[StoredVersion], object]] = {
    "abrdf_clusters": lambda version: abrdf_clusters_of(version.dataset),
    "neural_btf": _load_trained,
    "compressed_btf": lambda version: compressed_btf_of(version.dataset),
}
"""What ``tsuya.load`` gives, by asset: the clusters, the trained network, the runtime BTF."""
