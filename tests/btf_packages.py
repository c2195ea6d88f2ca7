"""Small packages of compressed BTFs of random numbers, without a store."""

from __future__ import annotations

import numpy as np

from assets_defs.neural_btf import package as assets
from assets_defs.neural_btf.datasets import runtime_btf
from pipelines.neural_btf.decoder_arrays import HIDDEN, STUDENT_HIDDEN
from pipelines.neural_btf.latent_texture import level_sizes
from pipelines.neural_btf.live_parts import home_exposure, reference_views, scenery_of
from storage.btf_file import BtfFile, Quantised
from storage.packages import Contents, Package, Source, read_package, write_package
from storage.packages.neural_btf import package_schema

SIZE = (6, 5)
SHARED = 9


def random_decoder(random: np.random.Generator, hidden: int, latents: int) -> dict[str, Quantised]:
    """Whole numbers whose colours are bright, and differ."""
    sizes = (latents + 4, hidden, hidden, hidden, 3)
    tensors = {}
    for layer in range(1, 5):
        inputs, outputs = sizes[layer - 1], sizes[layer]
        width = (2.0 if layer == 4 else 1.4) / np.sqrt(inputs)
        weights = random.normal(0, 40, (outputs, inputs)).round().clip(-127, 127)
        biases = random.integers(20, 60, outputs) if layer == 4 else random.integers(-9, 9, outputs)
        for name, symbols, step in (("weight", weights, width / 40), ("bias", biases, 0.01)):
            tensors[f"{name}_{layer}"] = Quantised(
                np.asarray(symbols, np.int32), np.array(step, np.float32)
            )
    return tensors


def random_file(
    *, shared: bool = False, seed: int = 4, size: tuple[int, int] = SIZE, channels: int = 8
) -> BtfFile:
    """All that a file can hold: whole numbers, coarser levels, parallax, bounds, a student.

    ``shared``: texels share nine latent vectors, and there is no parallax.
    """
    random = np.random.default_rng(seed)
    texels = size[0] * size[1]

    def latents(count: int, steps: np.ndarray) -> Quantised:
        return Quantised(random.integers(-20, 21, (count, channels)).astype(np.int32), steps)

    steps, coarse = random.uniform(0.02, 0.05, (2, channels)).astype(np.float32)
    return BtfFile(
        random_decoder(random, HIDDEN, channels),
        latents(SHARED if shared else texels, steps),
        *size,
        1.75,
        ids=random.integers(SHARED, size=texels).astype(np.int32) if shared else None,
        mips=tuple(latents(rows * columns, coarse) for rows, columns in level_sizes(*size)[1:]),
        parallax=None if shared else random.normal(0, 0.4, (9, 2)).astype(np.float32),
        least=0.125,
        largest=1.5,
        student=random_decoder(random, STUDENT_HIDDEN, channels),
    )


def float_file(*, shared: bool = False, seed: int = 4) -> BtfFile:
    """The paper's form of such a file: float32, no coarser levels, no student."""
    file = runtime_btf(random_file(shared=shared, seed=seed))
    ids = None if file.ids is None else np.asarray(file.ids, np.int32)
    return BtfFile(file.decoder, file.latents, file.height, file.width, file.alpha, ids)


def btf_package(file: BtfFile, *, width: int | None = None, tiles: float = 1.0) -> Package:
    """A file's package; with the stage's reference views where a ``width`` is given."""
    scenery = scenery_of(runtime_btf(file))
    exposure = 1.0 if width is None else home_exposure(scenery, tiles)
    views = () if width is None else reference_views(scenery, tiles, exposure, width)
    values = assets._values(file, scenery)
    values |= {f"reference_{view.name}": view.frame for view in views}
    values["poster"] = values["input"] = np.zeros((8, 8, 3), np.uint8)
    parameters = assets.packed_parameters(file) | {"tiles": tiles, "exposure": exposure}
    contents = Contents(
        "felt",
        [Source("felt", "CC0-1.0")],
        values,
        parameters,
        [assets._view(view) for view in views],
    )
    content = write_package(package_schema(assets.packed_numbers(file)), contents)
    return read_package(content, "felt.tsuya")
