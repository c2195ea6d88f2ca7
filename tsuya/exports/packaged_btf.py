"""The compressed BTF that a package holds: as its file, and to be decoded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from storage.packages import Package

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.neural_btf.compressed import CompressedBtf
    from storage.btf_file import BtfFile, Quantised
    from storage.btf_file.contents import Tensor


def packaged_btf(package: Package) -> CompressedBtf:
    """The runtime BTF of a `neural_btf` package. Raises BadInput."""
    from assets_defs.neural_btf.datasets import runtime_btf

    return runtime_btf(packaged_file(package))


def packaged_file(package: Package) -> BtfFile:
    """What the `.tbtf` file holds that a `neural_btf` package was made of. Raises BadInput."""
    import numpy as np

    from storage.btf_file import BtfFile
    from storage.packages.neural_btf import PACKAGE, STUDENT
    from storage.readers.bad_input import BadInput

    if package.meta["schema"] != PACKAGE.number:
        expected = f"{PACKAGE.number}, as this Tsuya makes them: make the package again"
        raise BadInput(package.name, "schema", f"{package.meta['schema']}", expected)
    height, width = (int(package.parameter(name)) for name in ("height", "width"))
    has = package.parts
    return BtfFile(
        _decoder(package),
        _tensor(package, "latents", package.array("latent_steps")),
        height,
        width,
        float(package.parameter("alpha")),
        package.array("ids").astype(np.int32) if "ids" in has else None,
        _mips(package, height, width) if "mips" in has else (),
        package.array("parallax") if "parallax" in has else None,
        float(package.parameter("least")),
        float(package.parameter("largest")),
        _decoder(package, STUDENT) if f"{STUDENT}steps" in has else {},
    )


def _decoder(package: Package, prefix: str = "") -> Mapping[str, Tensor]:
    from storage.packages.neural_btf import TENSORS

    steps = package.array(f"{prefix}steps")
    return {
        name: _tensor(package, prefix + name, step)
        for name, step in zip(TENSORS, steps, strict=True)
    }


def _tensor(package: Package, name: str, step: NDArray[np.float32]) -> Tensor:
    import numpy as np

    from storage.btf_file import Quantised

    numbers = package.array(name)
    if numbers.dtype == np.float32:
        return numbers
    return Quantised(numbers.astype(np.int32), step)


def _mips(package: Package, height: int, width: int) -> tuple[Quantised, ...]:
    import numpy as np

    from storage.btf_file import Quantised
    from storage.btf_file.contents import level_size

    symbols, step = package.array("mips").astype(np.int32), package.array("mip_steps")
    levels: list[Quantised] = []
    first = 0
    while first < len(symbols):
        rows, columns = level_size(height, width, len(levels) + 1)
        levels.append(Quantised(symbols[first : first + rows * columns], step))
        first += rows * columns
    return tuple(levels)
