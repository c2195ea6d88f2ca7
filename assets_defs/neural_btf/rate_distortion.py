"""What bytes buy: `rate_distortion`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    abrdf_reader,
    compressed_btf_of,
    float_btf_file,
    pairs_of,
    runtime_btf,
)
from assets_defs.neural_btf.declaration import BTF
from assets_defs.settings import Settings
from assets_defs.system import Pictures, Progress, Result
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.figures import table_bytes
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.neural_btf.compressed import CompressedBtf
    from pipelines.neural_btf.rate_distortion import Curves, Sample

_BITS = (2, 3, 4, 5, 6, 8)
_CLUSTER_BITS = 6
_WEIGHT_BITS = 8
_TEXELS_A_CLUSTER = (100, 50, 20, 10, 5)


class RateSettings(Settings):
    """Nothing to choose."""


def rate_distortion_dataset(curves: Curves) -> xr.Dataset:
    """`rate_distortion` of its curves."""
    import xarray as xr

    dims = {
        "bits": ("bits",),
        "rounded": ("bits", "rate"),
        "clusters": ("clusters",),
        "clustered": ("clusters", "rate"),
        "gained": ("clusters", "rate"),
        "float32": ("rate",),
        "file": ("rate",),
        "null": (),
    }
    return xr.Dataset({name: (dims[name], part) for name, part in curves._asdict().items()})


def curves_of(dataset: xr.Dataset) -> Curves:
    """The curves that a `rate_distortion` dataset holds."""
    from pipelines.neural_btf.rate_distortion import Curves

    return Curves(*(dataset[name].values for name in Curves._fields))


def _pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.neural_btf.rate_distortion import rate_distortion_picture

    return {"rate-distortion": rate_distortion_picture(curves_of(dataset))}


def _file_over_rounding(version: StoredVersion) -> float:
    return curves_of(version.dataset).file_over_rounding


def _file_over_null(version: StoredVersion) -> float:
    curves = curves_of(version.dataset)
    return float(curves.file[1] / curves.null)


def rate_distortion_curves(
    network: CompressedBtf, file: CompressedBtf, file_bytes: int, sample: Sample
) -> Curves:
    """Errors of files of one network, in the paper's form and in others."""
    import numpy as np

    from pipelines.neural_btf import rate_distortion as curves

    def point(btf: CompressedBtf, bits: int) -> tuple[float, float]:
        size, held = _rounded_file(btf, bits)
        return size, curves.rmse(curves.restored(held, sample), sample)

    counts = [network.texels // each for each in _TEXELS_A_CLUSTER]
    counts = [count for count in counts if 1 < count < len(network.latents)]
    shared, gained = [], []
    for count in counts:
        size, held = _rounded_file(curves.clustered(network, count), _CLUSTER_BITS)
        found = curves.restored(held, sample)
        shared.append((size, curves.rmse(found, sample)))
        better = curves.with_gains(found, sample)
        gained.append((size + network.texels, curves.rmse(better, sample)))
    whole = table_bytes(len(network.latents), network.texels)
    return curves.Curves(
        np.array(_BITS),
        np.array([point(network, bits) for bits in _BITS]),
        np.array(counts, np.int64),
        np.array(shared).reshape(-1, 2),
        np.array(gained).reshape(-1, 2),
        np.array([whole, curves.rmse(curves.restored(network, sample), sample)]),
        np.array([file_bytes, curves.rmse(curves.restored(file, sample), sample)]),
        np.array(curves.rmse_null(sample)),
    )


def _rounded_file(btf: CompressedBtf, bits: int) -> tuple[int, CompressedBtf]:
    """Bytes of a file of weights in 8 bits and latents in so many, and what it holds."""
    import numpy as np

    from pipelines.neural_btf.rate_distortion import rounded
    from storage.btf_file import BtfFile, Quantised, write_btf_file

    def whole(values: NDArray[np.floating], bits: int) -> Quantised:
        symbols, steps = rounded(values.reshape(-1, 1), bits)
        return Quantised(symbols.reshape(values.shape), steps.reshape(()))

    file = BtfFile(
        {name: whole(part, _WEIGHT_BITS) for name, part in btf.decoder.items()},
        Quantised(*rounded(btf.latents, bits)),
        btf.height,
        btf.width,
        btf.alpha,
        ids=None if btf.ids is None else btf.ids.astype(np.int32),
        parallax=btf.parallax,
    )
    return len(write_btf_file(file)), runtime_btf(file)


@BTF.asset(
    schemas.RATE_DISTORTION,
    by=("material", "clusters"),
    settings=RateSettings,
    inputs=("abrdf_matrix", "abrdf_clusters", "neural_btf", "compressed_btf"),
    pictures=_pictures,
    checks=(
        Check(
            "file_over_rounding",
            "RMSE of the file over that of the network plainly rounded to as many bytes.",
            _file_over_rounding,
            at_most=1.05,
            change=0.05,
        ),
        Check(
            "file_over_null",
            "RMSE of the file over that of the mean ABRDF for every texel.",
            _file_over_null,
            at_most=0.9,
            change=0.05,
        ),
    ),
)
def rate_distortion(
    settings: RateSettings,
    progress: Progress,
    abrdf_matrix: xr.Dataset,
    abrdf_clusters: xr.Dataset,
    neural_btf: xr.Dataset,
    compressed_btf: xr.Dataset,
) -> Result:
    """Compare the file with what rounding and clusters would make of the same network."""
    from pipelines.neural_btf.rate_distortion import sample_of

    file = compressed_btf_of(compressed_btf)
    read, alpha = abrdf_reader(abrdf_matrix), float(abrdf_matrix["alpha"])
    sample = sample_of(
        lambda first, last: read(first, last) / alpha,
        file.texels,
        direction_inputs(pairs_of(abrdf_matrix)),
    )
    network = runtime_btf(float_btf_file(neural_btf, abrdf_clusters, abrdf_matrix))
    curves = rate_distortion_curves(network, file, compressed_btf.sizes["byte"], sample)
    return rate_distortion_dataset(curves), {"over plain rounding": curves.file_over_rounding}
