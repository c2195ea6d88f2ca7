"""Datasets of this system as the types of `pipelines`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.light.directions import Pairs
    from pipelines.neural_btf.compressed import CompressedBtf


def pairs_of(dataset: xr.Dataset) -> Pairs:
    """Light and view of a dataset's photographs."""
    from pipelines.light.directions import Pairs

    return Pairs(dataset["light"].values, dataset["view"].values)


def reader(array: xr.DataArray) -> Callable[[int, int], NDArray[np.floating]]:
    """First to last - 1 of the first dimension, as they are wanted."""
    return lambda first, last: array[first:last].values


def image_blocks(images: xr.DataArray) -> Iterator[NDArray[np.float16]]:
    """Photographs a chunk at a time, all texels."""
    start = 0
    for count in images.chunks[0] if images.chunks else (len(images),):
        yield images[start : start + count].values
        start += count


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
