"""The compressed BTF that a package holds, to be decoded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from storage.packages import Package

if TYPE_CHECKING:
    from pipelines.neural_btf.compressed import CompressedBtf


def packaged_btf(package: Package) -> CompressedBtf:
    """The runtime BTF of a `neural_btf` package. Raises BadInput."""
    from pipelines.neural_btf.compressed import CompressedBtf
    from pipelines.neural_btf.decoder_arrays import DECODER_ARRAY_NAMES

    return CompressedBtf(
        {name: package.array(name) for name in DECODER_ARRAY_NAMES},
        package.array("latents"),
        package.array("ids") if "ids" in package.parts else None,
        float(package.parameter("alpha")),
        int(package.parameter("height")),
        int(package.parameter("width")),
    )
