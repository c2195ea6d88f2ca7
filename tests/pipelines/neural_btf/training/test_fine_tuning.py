"""Training that rounds: what comes of it, its size, and runs that must not differ."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from pipelines.light.directions import all_pairs, hemisphere_table
from pipelines.neural_btf.abrdf import PhotographBlocks, transposed
from pipelines.neural_btf.abrdf_pool import AbrdfPool
from pipelines.neural_btf.clusters import cluster_abrdfs, single_texel_clusters
from pipelines.neural_btf.compressed import CompressedBtf, compressed_btf
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.latent_texture import averaged, level_sizes
from pipelines.neural_btf.mips import AveragedAbrdfs, averaged_abrdfs
from pipelines.neural_btf.network import decoder_arrays
from pipelines.neural_btf.principal_abrdfs import summarise_abrdfs
from pipelines.neural_btf.training.data import AbrdfScale, TrainingData, training_data
from pipelines.neural_btf.training.fine_tuning import FineTuning, QuantisedNetwork, fine_tune
from pipelines.neural_btf.training.plan import FineTuningPlan, TrainingPlan
from pipelines.neural_btf.training.trainer import TrainedNetwork, train

SIZE = (8, 6)
PAIRS = all_pairs(hemisphere_table(15), hemisphere_table(15))
DIRECTIONS = direction_inputs(PAIRS)
PLAN = FineTuningPlan(file_bytes=24_000, steps=250, batch_texels=16, batch_images=32)


def photographs() -> NDArray[np.float16]:
    """Soft coloured stripes, each with gloss of its own, matt in between."""
    random = np.random.default_rng(0)
    rows, columns = np.mgrid[:8, :6]
    wave = np.stack([np.sin(columns), np.cos(rows), np.sin(columns + rows)], axis=-1)
    colour = 0.4 + 0.15 * wave + 0.1 * random.random((8, 6, 3))
    shine = np.exp(-4 * np.sum((DIRECTIONS[:, :2] + DIRECTIONS[:, 2:]) ** 2, axis=1))
    matt = np.cos(PAIRS.light[:, 0])[:, None, None, None] * colour
    return (matt + 0.5 * shine[:, None, None, None] * wave[..., :1] ** 2).astype(np.float16)


@functools.cache
def fitted(
    clusters: int | None = None,
) -> tuple[TrainingData, TrainedNetwork, NDArray[np.float32], AveragedAbrdfs]:
    images = photographs()
    blocks = PhotographBlocks.of_array(images)
    summary = summarise_abrdfs(blocks)
    groups = single_texel_clusters(summary.scores)
    if clusters is not None:
        groups = cluster_abrdfs(blocks, summary.scores, clusters)
    abrdfs = transposed(images)
    scale = AbrdfScale(summary.statistics.mean, summary.statistics.deviation, summary.alpha)
    plan = TrainingPlan(steps=500, batch_texels=16, batch_images=32)
    data = training_data(AbrdfPool.of_array(abrdfs), groups, scale, DIRECTIONS, SIZE, plan)
    views = np.repeat(np.arange(15), 15)
    coarse = averaged_abrdfs(lambda a, b: abrdfs[a:b], SIZE, views, budget=1 << 30)
    more = np.random.default_rng(5).standard_normal((len(data.start), 4)).astype(np.float32)
    return data, train(data, plan), more, coarse


def nominal_bytes(network: QuantisedNetwork) -> int:
    """Entropies of all symbols, with no tables."""
    parts = [*(part for part, _ in network.decoder.values()), *network.latents.T]
    parts += [part for part, _ in network.student.values()]
    parts += [channel for level in network.mips[:1] for channel in level.T]
    bits = 0.0
    for part in parts:
        counts = np.unique(part, return_counts=True)[1]
        bits -= (counts * np.log2(counts / counts.sum())).sum()
    return int(bits / 8)


def runtime(network: QuantisedNetwork, data: TrainingData) -> CompressedBtf:
    decoder = {name: symbols * step for name, (symbols, step) in network.decoder.items()}
    latents = (network.latents * network.latent_steps).astype(np.float32)
    found = compressed_btf(decoder, latents, data.ids, data.scale.alpha, SIZE, network.parallax)
    mips = tuple((level * network.mip_steps).astype(np.float32) for level in network.mips)
    student = {name: symbols * step for name, (symbols, step) in network.student.items()}
    return dataclasses.replace(found, mips=mips, student=student)


def rmse(btf: CompressedBtf, wanted: NDArray[np.floating]) -> float:
    found = btf.abrdfs(0, btf.texels, DIRECTIONS)
    return float(np.sqrt(np.mean((found - wanted / btf.alpha) ** 2)))


@pytest.mark.parametrize("clusters", [None, 9])
def test_a_rounded_network_is_as_good_as_the_float_one(clusters: int | None) -> None:
    data, trained, more, coarse = fitted(clusters)
    wanted = transposed(photographs()).astype(np.float32)
    before = compressed_btf(
        decoder_arrays(trained.decoder), trained.latents, data.ids, data.scale.alpha, SIZE,
        trained.parallax,
    )  # fmt: skip
    network = fine_tune(data, trained, more, coarse, PLAN, nominal_bytes)
    after = runtime(network, data)
    assert rmse(after, wanted) < 1.25 * rmse(before, wanted)
    forgotten = dataclasses.replace(after, latents=np.zeros_like(after.latents))
    assert rmse(forgotten, wanted) > 2 * rmse(after, wanted)
    assert after.latents.shape[1] == 12
    student = rmse(after.by_student(), wanted)
    assert student < 0.9 * rmse(forgotten, wanted)


def test_without_a_student_the_bits_go_to_the_texels() -> None:
    data, trained, more, coarse = fitted()
    wanted = transposed(photographs()).astype(np.float32)
    plan = dataclasses.replace(PLAN, file_bytes=20_000)

    def errors(student: bool) -> tuple[QuantisedNetwork, float]:
        settings = dataclasses.replace(plan, student=student)
        network = fine_tune(data, trained, more, coarse, settings, nominal_bytes)
        return network, rmse(runtime(network, data), wanted)

    (beside, with_it), (alone, without_it) = errors(True), errors(False)
    assert beside.student
    assert not alone.student
    assert nominal_bytes(alone) < 1.1 * plan.file_bytes
    assert without_it < 0.93 * with_it


def latent_bytes(network: QuantisedNetwork) -> int:
    """A thousand bytes for each mean absolute symbol: what the decoder takes is left out."""
    levels = np.concatenate([network.latents, *network.mips])
    return int(1000 * np.abs(levels).mean())


def test_training_begins_at_the_wanted_size() -> None:
    data, trained, more, coarse = fitted()
    for wanted in (2400, 9000):
        plan = dataclasses.replace(PLAN, file_bytes=wanted)
        tuning = FineTuning(data, trained, more, coarse, plan, latent_bytes)
        assert 0.6 * wanted < latent_bytes(tuning.result()) <= wanted


def test_far_levels_show_the_mean_of_what_they_cover() -> None:
    data, trained, more, coarse = fitted()
    found = runtime(fine_tune(data, trained, more, coarse, PLAN, nominal_bytes), data)
    assert found.parallax is not None
    for (rows, columns), level in zip(level_sizes(*SIZE)[1:], found.mips, strict=True):
        scale = np.array([columns / SIZE[1], rows / SIZE[0]], np.float32)
        far = dataclasses.replace(
            found, latents=level, height=rows, width=columns, mips=(),
            parallax=found.parallax * scale,
        )  # fmt: skip
        wanted = averaged(transposed(photographs()), SIZE, (rows, columns))
        assert rmse(far, wanted) < 0.35 * rmse(far, np.full_like(wanted, wanted.mean()))


def test_the_price_brings_the_file_towards_the_size_that_is_wanted() -> None:
    data, trained, more, coarse = fitted()
    found = []
    for wanted in (12_000, 20_000):
        plan = dataclasses.replace(PLAN, file_bytes=wanted, steps=400)
        found.append(nominal_bytes(fine_tune(data, trained, more, coarse, plan, nominal_bytes)))
    small, large = found
    assert large == pytest.approx(20_000, rel=0.06)
    assert small < 0.9 * large


def test_a_run_that_is_stopped_and_resumed_gives_the_same_bits() -> None:
    data, trained, more, coarse = fitted()
    plan = dataclasses.replace(PLAN, steps=60)
    whole = fine_tune(data, trained, more, coarse, plan, nominal_bytes)
    for cut in (1, 37, 60):
        first = FineTuning(data, trained, more, coarse, plan, nominal_bytes)
        for _ in range(cut):
            first.step()
        torch.rand(3)  # another run's draws
        again = fine_tune(data, trained, more, coarse, plan, nominal_bytes, resume=first.state())
        np.testing.assert_array_equal(again.latents, whole.latents)
        np.testing.assert_array_equal(again.curve_rmse, whole.curve_rmse)
        for name, (symbols, step) in whole.decoder.items():
            np.testing.assert_array_equal(again.decoder[name][0], symbols)
            assert again.decoder[name][1] == step
