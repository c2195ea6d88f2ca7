"""What a restored BTF is worth beyond its own photographs: unseen directions, unseen texels.

`heldout_directions`: light and view both off the grid that was trained on. `encoder_promise`:
texels that were not there while the networks were trained. `level_figures`: far views. Each beside
nulls.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, all_pairs, unit_vectors
from pipelines.neural_btf.abrdf import PhotographBlocks, standardised, transposed
from pipelines.neural_btf.abrdf_pool import AbrdfPool
from pipelines.neural_btf.clusters import single_texel_clusters
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.principal_abrdfs import summarise_abrdfs
from pipelines.neural_btf.quality import error_figures
from pipelines.neural_btf.quality_levels import level_errors, restored_levels
from pipelines.neural_btf.quality_sums import compare
from pipelines.neural_btf.restoration import restored_abrdfs
from pipelines.neural_btf.training.data import AbrdfScale, training_data
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import TrainedNetwork, train
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.weaves import make_cloth

Images = NDArray[np.floating]

LEFT_OUT = 0.1
"""Of the texels, for the encoder."""
_LEVEL_PHOTOGRAPHS = 243
_COMPONENTS = 8
_NONE: NDArray[np.int64] = np.zeros(0, np.int64)


# ---- directions off the grid -------------------------------------------------------------------


def turned_table(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """A hemisphere table (n, 2), each ring turned by half its step: no direction stays but the top.

    The thetas are the same, so that photographs are as grazing as before; without the direction
    from above, which cannot be turned.

    >>> turned_table(np.radians([[0.0, 0.0], [30.0, 0.0], [30.0, 180.0]])).round(3).tolist()
    [[0.524, 1.571], [0.524, 4.712]]
    """
    found = []
    for theta in np.unique(table[:, 0].round(9)):
        ring = table[np.isclose(table[:, 0], theta)]
        if theta > 0:
            found.append(ring + np.array([0.0, np.pi / len(ring)]))
    return np.concatenate(found)


def heldout_directions(
    stored: CompressedBtf,
    images: Images,
    table: NDArray[np.float64],
    material: str,
    *,
    samples: int,
    views: int = 12,
    seed: int = 0,
) -> dict[str, float]:
    """Errors off the grid over the contrast of the photographs there, and on it.

    ``images`` are the virtual cloth's photographs of ``table`` x ``table`` that ``stored`` was
    trained on, with so many ``samples`` a texel and the cloth's ``seed``; some ``views`` of the
    turned table are photographed under all its lights. A ratio of 1: directions in between are
    restored as well as those that were seen. Errors are over those of each photograph's mean
    colour: that null has 1. ``nearest`` takes the nearest direction seen instead: a BTF that
    cannot interpolate.
    """
    turned = turned_table(table)
    size = stored.height, stored.width
    chosen = turned[np.unique(np.linspace(0, len(turned) - 1, views).astype(int))]
    instrument = Gonioreflectometer(make_cloth(material, seed), turned, size, samples)
    away = np.concatenate([instrument.photographs(view) for view in chosen])
    pairs = all_pairs(chosen, turned)
    same = np.isin(table[:, 0].round(6), np.unique(chosen[:, 0].round(6)))
    kept = np.repeat(same, len(table)) & np.tile(table[:, 0] > 0, len(table))
    seen = all_pairs(table, table)
    grid = Pairs(seen.light[kept], seen.view[kept])
    nearest = all_pairs(*(_nearest(table, asked) for asked in (chosen, turned)))
    found = {
        "heldout_contrast_error": contrast_error(stored, away, pairs),
        "heldout_contrast_error_nearest": contrast_error(stored, away, pairs, asked=nearest),
        "grid_contrast_error": contrast_error(stored, images[kept], grid),
    }
    ratio = found["heldout_contrast_error"] / found["grid_contrast_error"]
    return found | {"heldout_contrast_ratio": ratio}


def _nearest(table: NDArray[np.float64], asked: NDArray[np.float64]) -> NDArray[np.float64]:
    """The table's directions nearest to those asked for, (n, 2)."""
    return table[(unit_vectors(asked) @ unit_vectors(table).T).argmax(axis=1)]


def contrast_error(
    stored: CompressedBtf, images: Images, pairs: Pairs, *, asked: Pairs | None = None
) -> float:
    """RMSE of photographs (pair, y, x, 3) over that of their mean colours: ``rmse_over_null``.

    ``asked``: the pairs that are restored in place of ``pairs``.
    """
    values = transposed(images)
    compared = compare(
        restored_abrdfs(stored, asked or pairs),
        lambda a, b: values[a:b],
        pairs,
        (stored.height, stored.width),
        judged=_NONE,
        block=400,
    )
    return error_figures(compared, stored.alpha)["rmse_over_null"]


# ---- texels that were not there ----------------------------------------------------------------


def encoder_promise(
    images: Images, pairs: Pairs, plan: TrainingPlan, *, seed: int = 0
) -> dict[str, float]:
    """Whether the encoder can encode texels that it was not trained on.

    Figures are RMSE over that of the texels' mean ABRDF. A random tenth of the texels is left out;
    the rest is trained without parallax, which needs neighbours. Left-out texels are decoded from
    what the encoder says (``encoded``), beside what can be had (``fitted``: their latents are
    trained, the decoder stays) and what needs no encoder: ``linear``, least squares from principal
    components to latents; ``nearest``, the latents of the trained texel whose components are
    nearest; ``mean``, the mean latents, which know nothing. ``trained`` are the trained texels by
    their own latents, ``trained_encoded`` by the encoder.
    """
    flat = images.reshape(len(images), -1, 1, 3).astype(np.float16)
    order = np.random.default_rng(seed).permutation(flat.shape[1])
    count = max(1, round(LEFT_OUT * len(order)))
    unseen, seen = (transposed(flat[:, part]) for part in (order[:count], order[count:]))
    summary = summarise_abrdfs(PhotographBlocks.of_array(flat[:, order[count:]]))
    scale = AbrdfScale(summary.statistics.mean, summary.statistics.deviation, summary.alpha)
    directions = direction_inputs(pairs)
    data = training_data(
        AbrdfPool.of_array(seen),
        single_texel_clusters(summary.scores),
        scale,
        directions,
        (len(seen), 1),
        replace(plan, parallax=False),
    )
    trained = train(data, replace(plan, parallax=False))

    def error(latents: NDArray[np.float32], wanted: NDArray[np.float16]) -> float:
        return _error_over_null(trained, latents, wanted, directions, scale.alpha)

    inputs = [standardised(part, scale.mean, scale.deviation) for part in (seen, unseen)]
    encoded = [_encoded(trained, part) for part in inputs]
    known, new = _components(*inputs)
    nearest = ((new[:, None] - known[None]) ** 2).sum(axis=2).argmin(axis=1)
    design = [np.column_stack([part, np.ones(len(part))]) for part in (known, new)]
    factors = np.linalg.lstsq(design[0], trained.latents, rcond=None)[0]
    mean = np.repeat(trained.latents.mean(axis=0, keepdims=True), len(unseen), axis=0)
    return {
        "encoder_trained": error(trained.latents, seen),
        "encoder_trained_encoded": error(encoded[0], seen),
        "encoder_encoded": error(encoded[1], unseen),
        "encoder_linear": error((design[1] @ factors).astype(np.float32), unseen),
        "encoder_nearest": error(trained.latents[nearest], unseen),
        "encoder_mean": error(mean, unseen),
        "encoder_fitted": error(_fitted(trained, mean, unseen, directions, scale.alpha), unseen),
    }


def _encoded(trained: TrainedNetwork, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
    import torch

    trained.encoder.eval()
    with torch.no_grad():
        parts = [trained.encoder(torch.from_numpy(part)) for part in np.array_split(inputs, 16)]
    return np.asarray(torch.cat(parts).numpy())


def _components(
    seen: NDArray[np.float32], unseen: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Scores of both on the first principal components of the first; standardised ABRDFs."""
    flat = [part.reshape(len(part), -1) for part in (seen, unseen)]
    _, _, axes = np.linalg.svd(flat[0], full_matrices=False)
    return flat[0] @ axes[:_COMPONENTS].T, flat[1] @ axes[:_COMPONENTS].T


def _fitted(
    trained: TrainedNetwork,
    start: NDArray[np.float32],
    wanted: NDArray[np.float16],
    directions: NDArray[np.float32],
    alpha: float,
    steps: int = 300,
) -> NDArray[np.float32]:
    """Latents (n, 8) trained for ABRDFs (n, image, 3) over so many steps, the decoder as it is."""
    import torch

    latents = torch.from_numpy(start.copy()).requires_grad_()
    optimiser = torch.optim.Adam([latents], lr=0.03)
    targets = torch.from_numpy(wanted.astype(np.float32) / np.float32(alpha))
    inputs, random = torch.from_numpy(directions), np.random.default_rng(0)
    for _ in range(steps):
        drawn = random.integers(0, len(directions), min(256, len(directions)))
        loss = ((trained.decoder.grid(latents, inputs[drawn]) - targets[:, drawn]) ** 2).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    return latents.detach().numpy()


def _error_over_null(
    trained: TrainedNetwork,
    latents: NDArray[np.float32],
    wanted: NDArray[np.float16],
    directions: NDArray[np.float32],
    alpha: float,
) -> float:
    """RMSE of ABRDFs (n, image, 3) over that of their mean."""
    import torch

    truth = wanted.astype(np.float32) / np.float32(alpha)
    squared = 0.0
    with torch.no_grad():
        for part in np.array_split(np.arange(len(truth)), max(1, len(truth) // 32)):
            found = trained.decoder.grid(
                torch.from_numpy(latents[part]), torch.from_numpy(directions)
            )
            squared += float(((found.numpy() - truth[part]) ** 2).sum(dtype=np.float64))
    null = float(((truth - truth.mean(axis=0)) ** 2).sum(dtype=np.float64))
    return float(np.sqrt(squared / null))


# ---- far views ---------------------------------------------------------------------------------


def level_figures(
    stored: CompressedBtf, pairs: Pairs, read: Callable[[NDArray[np.integer]], Images]
) -> dict[str, Any]:
    """``mip_error_ratio`` of some 243 photographs; ``read`` gives those of given numbers."""
    chosen = np.unique(np.linspace(0, len(pairs.light) - 1, _LEVEL_PHOTOGRAPHS).astype(int))
    some = Pairs(pairs.light[chosen], pairs.view[chosen])
    measured = read(chosen).astype(np.float32)
    return level_errors(measured, stored.photographs(some), restored_levels(stored, some)).figures
