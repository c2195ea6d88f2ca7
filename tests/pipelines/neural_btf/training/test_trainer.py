"""Training against gradients worked out by hand, and runs that must not differ."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf.abrdf import PhotographBlocks, standardised, transposed
from pipelines.neural_btf.abrdf_pool import AbrdfPool, mean_abrdfs
from pipelines.neural_btf.clusters import AbrdfClusters, single_texel_clusters, warm_start
from pipelines.neural_btf.decoder_arrays import LATENTS, direction_inputs
from pipelines.neural_btf.latent_texture import between_texels, parallax_terms
from pipelines.neural_btf.network import Decoder, decoder_arrays, encoder_of, encoder_vector
from pipelines.neural_btf.principal_abrdfs import summarise_abrdfs
from pipelines.neural_btf.training import batches
from pipelines.neural_btf.training import trainer as trainer_module
from pipelines.neural_btf.training.data import (
    AbrdfScale,
    TrainingData,
    TrainingTargets,
    training_data,
)
from pipelines.neural_btf.training.latent_lookup import latents_beside, parallax_offsets
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import TrainedNetwork, Trainer, train

SIDE = 8
WIDTHS = (4, 6)
PAIRS: Pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))

FAST = TrainingPlan(
    "fast", 30, 0.01, batch_texels=8, batch_images=16, widths=WIDTHS, parallax=False
)
ENCODER_FIRST = dataclasses.replace(
    FAST, warm_start="encoder", encoder_share=0.4, encoder_steps=10, seed=3
)
PAPER = TrainingPlan("paper", 12, 0.05, batch_texels=5, batch_images=0, widths=WIDTHS)
PLANS = pytest.mark.parametrize(
    "plan",
    [
        dataclasses.replace(FAST, encoder_steps=10),
        dataclasses.replace(FAST, parallax=True),
        ENCODER_FIRST,
        PAPER,
    ],
    ids=["fast", "parallax", "encoder first", "paper"],
)


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Steps of these sizes are slower with more; a numba loop before may have asked for more."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def photographs() -> NDArray[np.float16]:
    """8 x 8 texels of four colours, each of its own gloss and lean, under 15 x 15 directions."""
    random = np.random.default_rng(0)
    texel_class = random.integers(0, 4, SIDE * SIDE)
    colour = random.uniform(0.05, 0.6, (4, 3))[texel_class]
    gloss = np.array([0.0, 0.2, 0.6, 1.0])[texel_class]
    normals = np.array([(0.3, 0, 1), (-0.3, 0, 1), (0, 0.3, 1), (0, -0.3, 1)])[texel_class]
    normals = normals + 0.03 * random.standard_normal(normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    light, view = unit_vectors(PAIRS.light), unit_vectors(PAIRS.view)
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shaded = np.maximum(light @ normals.T, 0)
    shine = np.maximum(half @ normals.T, 0) ** 20 * gloss
    images = shaded[..., None] * colour + (shaded * shine)[..., None]
    return images.reshape(len(light), SIDE, SIDE, 3).astype(np.float16)


IMAGES = photographs()


def data_of(clusters: int | None = None, *, budget: int | None = None) -> TrainingData:
    """All texels, each with its own latents, or in clusters with their means as targets."""
    found = summarise_abrdfs(PhotographBlocks.of_array(IMAGES), components=LATENTS)
    abrdfs = transposed(IMAGES)
    texels, count = abrdfs.shape[:2]
    pool = AbrdfPool.of_array(abrdfs)
    if budget is not None:
        pool = AbrdfPool(lambda a, b: abrdfs[a:b], texels, count, block=4, budget=budget, seed=1)
    groups = single_texel_clusters(found.scores)
    if clusters is not None:
        ids = np.arange(texels, dtype=np.int32) % clusters
        medians = [
            np.median(abrdfs[ids == one].astype(np.float32), axis=0) for one in range(clusters)
        ]
        groups = AbrdfClusters(
            ids, np.bincount(ids), np.stack(medians), warm_start(found.scores[:clusters])
        )
    scale = AbrdfScale(found.statistics.mean, found.statistics.deviation, found.alpha)
    return training_data(pool, groups, scale, direction_inputs(PAIRS), (SIDE, SIDE), FAST)


@pytest.fixture(scope="module")
def data() -> TrainingData:
    return data_of()


def assert_equal_bits(one: TrainedNetwork, two: TrainedNetwork) -> None:
    np.testing.assert_array_equal(one.latents, two.latents)
    assert (one.parallax is None) == (two.parallax is None)
    if one.parallax is not None and two.parallax is not None:
        np.testing.assert_array_equal(one.parallax, two.parallax)
    np.testing.assert_array_equal(encoder_vector(one.encoder), encoder_vector(two.encoder))
    for name, part in decoder_arrays(one.decoder).items():
        np.testing.assert_array_equal(part, decoder_arrays(two.decoder)[name])
    np.testing.assert_array_equal(one.curve_step, two.curve_step)
    np.testing.assert_array_equal(one.curve_rmse, two.curve_rmse)
    assert one.encoder_residual == two.encoder_residual


def restored(found: TrainedNetwork) -> NDArray[np.float32]:
    with torch.no_grad():
        grid = found.decoder.grid(
            torch.from_numpy(found.latents), torch.from_numpy(direction_inputs(PAIRS))
        )
    return grid.numpy()


def x3_of(abrdfs: NDArray[np.floating], data: TrainingData) -> torch.Tensor:
    return torch.from_numpy(standardised(abrdfs, data.scale.mean, data.scale.deviation))


def rmse(one: NDArray[np.floating], two: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean((one.astype(np.float64) - two) ** 2)))


# ---- what is learnt --------------------------------------------------------------------------


def test_fast_training_restores_better_than_the_best_rank_2_matrix(data: TrainingData) -> None:
    plan = dataclasses.replace(FAST, steps=300, batch_texels=16, batch_images=64)
    found = train(data, plan)
    targets = transposed(IMAGES).astype(np.float64) / data.scale.alpha
    matrix = targets.reshape(len(targets), -1)
    lengths = np.linalg.svd(matrix - matrix.mean(axis=0), compute_uv=False)
    best_of_rank_2 = np.sqrt(np.sum(lengths[2:] ** 2) / matrix.size)
    error = rmse(restored(found), targets)
    assert error < 0.2 * targets.std()
    assert error < best_of_rank_2


def moved_stripes(texels: float) -> NDArray[np.float16]:
    """A matt surface of soft coloured stripes, which move by so many texels along x, times the
    view's stereographic x."""
    moves = texels * direction_inputs(PAIRS)[:, 2]
    columns = 2 * np.pi * (np.arange(SIDE) + moves[:, None]) / SIDE
    rows = 2 * np.pi * np.arange(SIDE) / SIDE
    random = np.random.default_rng(4)
    waves = [np.exp(1j * times * columns)[..., None] for times in (1, 2, 3)]
    phases = random.standard_normal((3, 3)) + 1j * random.standard_normal((3, 3))
    across = sum((wave * of_wave).imag for wave, of_wave in zip(waves, phases, strict=True)) / 3
    colour = 0.5 + 0.2 * across[:, None] + 0.1 * np.sin(rows)[None, :, None, None]
    return (colour * np.cos(PAIRS.light[:, 0])[:, None, None, None]).astype(np.float16)


@pytest.mark.parametrize("texels", [0.0, 1.5])
def test_parallax_that_is_in_the_photographs_is_found(
    texels: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"{__name__}.IMAGES", moved_stripes(texels))
    data = data_of()
    plan = dataclasses.replace(FAST, steps=600, batch_texels=32, batch_images=64, parallax=True)
    found = train(data, plan)
    assert found.parallax is not None
    views = np.unique(data.directions[:, 2:], axis=0)
    across, down = (parallax_terms(views) @ found.parallax).T
    np.testing.assert_allclose(across, texels * views[:, 0], atol=0.2)
    np.testing.assert_allclose(down, 0.0, atol=0.2)


def test_latents_are_looked_up_as_the_runtime_looks_them_up() -> None:
    random = np.random.default_rng(2)
    table = random.standard_normal((15, 8)).astype(np.float32)
    parallax = random.standard_normal((9, 2)).astype(np.float32)
    views, texels = random.uniform(-0.8, 0.8, (4, 2)), np.array([0, 14, 7])
    offsets = parallax_offsets(torch.from_numpy(parallax), torch.from_numpy(views).float())
    given = torch.from_numpy(table), (3, 5), torch.from_numpy(texels), offsets
    found = latents_beside(*given).numpy()
    moves = parallax_terms(views) @ parallax
    for number, move in enumerate(moves):
        expected = between_texels(table, (3, 5), texels // 5 + move[1], texels % 5 + move[0])
        np.testing.assert_allclose(found[:, number], expected, atol=1e-5)


def test_paper_training_lowers_the_error(data: TrainingData) -> None:
    plan = dataclasses.replace(PAPER, steps=150)
    targets = transposed(IMAGES) / data.scale.alpha
    before = rmse(restored(Trainer(data, plan).result()), targets)
    assert rmse(restored(train(data, plan)), targets) < 0.6 * before


def test_rows_count_as_often_as_the_texels_they_stand_for() -> None:
    """Two rows share a latent vector: the best answer is their mean, weighted."""
    count = len(PAIRS.light)
    values = np.stack([np.full((count, 3), 0.2), np.full((count, 3), 1.0)]).astype(np.float16)
    flat = np.zeros((count, 3), np.float32)
    targets = TrainingTargets(
        AbrdfPool.of_array(values), np.zeros(2, np.int64), np.array([3.0, 1.0])
    )
    given = TrainingData(
        targets, None, AbrdfScale(flat, flat + 1, 1.0), direction_inputs(PAIRS),
        np.zeros((1, LATENTS), np.float32), np.zeros(2, np.int32), (1, 2),
    )  # fmt: skip
    plan = dataclasses.replace(FAST, steps=200, batch_texels=256, batch_images=4)
    found = restored(train(given, plan))
    np.testing.assert_allclose(found, (3 * 0.2 + 1.0) / 4, atol=0.03)


def test_the_error_against_means_has_the_gradient_of_that_against_all_members() -> None:
    """The claim of the module: squares against all = squares against the mean + a constant."""
    abrdfs, clusters = transposed(IMAGES), 7
    ids = np.random.default_rng(4).integers(0, clusters, len(abrdfs))
    means = mean_abrdfs(AbrdfPool.of_array(abrdfs), ids, clusters).astype(np.float64)
    share = torch.from_numpy(np.bincount(ids) / len(ids))
    torch.manual_seed(0)
    decoder = Decoder().double()
    latents = torch.randn(clusters, LATENTS, dtype=torch.float64, requires_grad=True)
    directions = torch.from_numpy(direction_inputs(PAIRS)).double()
    parts = [latents, *decoder.parameters()]

    grid = decoder.grid(latents, directions)
    against_all = (grid[ids] - torch.from_numpy(abrdfs).double()).square().mean()
    of_all = torch.autograd.grad(against_all, parts, retain_graph=True)
    squares = (grid - torch.from_numpy(means)).square().mean(dim=(1, 2))
    of_means = torch.autograd.grad((share * squares).sum(), parts)
    for one, two in zip(of_all, of_means, strict=True):
        assert (one - two).abs().max() < 1e-3 * one.abs().max()  # the means are half floats


# ---- one step by hand ------------------------------------------------------------------------


def one_texel(texel: int = 9) -> TrainingData:
    """So that it does not matter which rows are drawn."""
    whole = data_of()
    values = transposed(IMAGES)[texel : texel + 1]
    targets = TrainingTargets(AbrdfPool.of_array(values), np.zeros(1, np.int64), np.ones(1))
    return dataclasses.replace(whole, targets=targets, start=whole.start[texel : texel + 1])


@pytest.mark.parametrize("seen", [None, 30], ids=["own", "another's"])
def test_a_step_of_the_paper_is_plain_gradient_descent(seen: int | None) -> None:
    """The encoder sees the representative, the decoder is to give the texel's own values."""
    data = one_texel()
    if seen is not None:
        data = dataclasses.replace(data, representatives=transposed(IMAGES)[seen : seen + 1])
    trainer = Trainer(data, PAPER)
    encoder = encoder_of(encoder_vector(trainer.encoder), len(PAIRS.light), WIDTHS).train()
    decoder = Decoder()
    decoder.load_state_dict(trainer.decoder.state_dict())

    values = np.repeat(data.targets.pool.part(0)[1], 5, axis=0)
    shown = values if data.representatives is None else data.representatives.repeat(5, axis=0)
    x3 = x3_of(shown, data)
    latents = encoder(x3).repeat_interleave(len(PAIRS.light), dim=0)
    colours = decoder(latents, torch.from_numpy(data.directions).repeat(5, 1))
    wanted = torch.from_numpy(values.astype(np.float32) / data.scale.alpha).reshape(-1, 3)
    parts = [*encoder.parameters(), *decoder.parameters()]
    gradients = torch.autograd.grad((colours - wanted).square().mean(), parts)

    trainer.step()
    stepped = [*trainer.encoder.parameters(), *trainer.decoder.parameters()]
    moved = 0.0
    for part, gradient, after in zip(parts, gradients, stepped, strict=True):
        torch.testing.assert_close(after, part - PAPER.rate * gradient, rtol=1e-5, atol=1e-6)
        moved = max(moved, float((PAPER.rate * gradient).abs().max()))
    assert moved > 1e-3  # far more than the tolerance


def test_the_rate_of_the_paper_does_not_change() -> None:
    """Without a slope in the rate two equal steps from one state are equal, early or late."""
    data = one_texel()
    early, late = Trainer(data, PAPER), Trainer(data, dataclasses.replace(PAPER, steps=10**6))
    for trainer in (early, late):
        for _ in range(6):
            trainer.step()
    torch.testing.assert_close(early.decoder.state_dict(), late.decoder.state_dict())


def test_the_latents_of_the_paper_are_what_the_encoder_says(data: TrainingData) -> None:
    found = train(data, PAPER)
    encoder = encoder_of(encoder_vector(found.encoder), len(PAIRS.light), WIDTHS)
    x3 = x3_of(transposed(IMAGES), data)
    with torch.no_grad():
        np.testing.assert_allclose(found.latents, encoder(x3), atol=1e-5)


def test_the_encoder_sees_the_representatives_not_the_targets() -> None:
    data = data_of(6)
    found = train(data, PAPER)
    assert data.representatives is not None
    encoder = encoder_of(encoder_vector(found.encoder), len(PAIRS.light), WIDTHS)
    with torch.no_grad():
        of_medians, of_means = (
            encoder(x3_of(seen, data)).numpy()
            for seen in (data.representatives, data.targets.pool.part(0)[1])
        )
    np.testing.assert_allclose(found.latents, of_medians, atol=1e-5)
    assert np.abs(of_means - of_medians).max() > 1e-3


# ---- runs that must not differ ---------------------------------------------------------------


@PLANS
@pytest.mark.parametrize("clusters", [None, 6])
def test_a_run_that_is_stopped_and_resumed_gives_the_same_bits(
    plan: TrainingPlan, clusters: int | None
) -> None:
    data = data_of(clusters)
    total = plan.steps + plan.encoder_steps * (plan.training == "fast")
    whole = train(data, plan)
    # In the middle of every stage, and where one gives way to the next.
    for cut in sorted({3, 12, plan.steps, total - 4} - {total}):
        first = Trainer(data, plan)
        for _ in range(cut):
            first.step()
        torch.rand(7)  # another run's draws
        assert_equal_bits(train(data, plan, resume=first.state()), whole)


def test_a_curve_goes_on_in_the_middle_of_a_point(
    data: TrainingData, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trainer_module, "_CURVE_POINTS", 3)
    first = Trainer(data, FAST)
    for _ in range(14):
        first.step()
    assert_equal_bits(train(data, FAST, resume=first.state()), train(data, FAST))


def test_a_matrix_in_parts_is_resumed_with_the_same_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(batches, "_STEPS_A_PART", 5)
    budget = 3 * 4 * len(PAIRS.light) * 3 * 2
    whole = train(data_of(budget=budget), FAST)
    first = Trainer(data_of(budget=budget), FAST)
    for _ in range(13):
        first.step()
    assert_equal_bits(train(data_of(budget=budget), FAST, resume=first.state()), whole)


@PLANS
def test_equal_seeds_give_equal_bits_and_others_others(
    data: TrainingData, plan: TrainingPlan
) -> None:
    one = train(data, plan)
    assert_equal_bits(train(data, plan), one)
    other = train(data, dataclasses.replace(plan, seed=plan.seed + 1))
    assert np.abs(other.latents - one.latents).max() > 1e-3


def test_every_state_that_is_kept_can_be_resumed(
    data: TrainingData, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trainer_module, "KEEP_SECONDS", -1.0)
    plan = dataclasses.replace(ENCODER_FIRST, steps=10, encoder_steps=3)
    states: list[bytes] = []
    whole = train(data, plan, keep=states.append)
    assert len(states) >= 12
    for state in states[:12]:
        assert_equal_bits(train(data, plan, resume=state), whole)


def test_a_state_that_was_kept_after_the_last_step_can_be_resumed(data: TrainingData) -> None:
    plan = dataclasses.replace(FAST, steps=3, encoder_steps=2)
    trainer = Trainer(data, plan)
    while not trainer.finished:
        trainer.step()
    assert_equal_bits(train(data, plan, resume=trainer.state()), train(data, plan))


def test_no_state_is_kept_before_its_time(data: TrainingData) -> None:
    states: list[bytes] = []
    train(data, PAPER, keep=states.append)
    assert states == []


# ---- stopping and telling --------------------------------------------------------------------


@PLANS
def test_training_stops_when_it_is_told_to(data: TrainingData, plan: TrainingPlan) -> None:
    found = train(data, plan, stop=lambda trainer: trainer.steps_done == 7)
    by_hand = Trainer(data, plan)
    for _ in range(7):
        by_hand.step()
    assert found.curve_step.tolist() == list(range(1, 8))
    np.testing.assert_array_equal(found.latents, by_hand.result().latents)
    assert np.abs(found.latents - data.start).max() > 0


def test_progress_rises_to_1(data: TrainingData) -> None:
    told: list[float] = []
    train(data, dataclasses.replace(FAST, steps=80, encoder_steps=20), progress=told.append)
    assert told == [0.2, 0.4, 0.6, 0.8, 1.0]


def test_the_curve_has_about_200_points_and_none_of_the_distillation(data: TrainingData) -> None:
    plan = dataclasses.replace(FAST, steps=400, batch_texels=1, batch_images=1, encoder_steps=3)
    found = train(data, plan)
    assert found.curve_step.tolist() == list(range(2, 401, 2))
    assert found.curve_rmse.shape == (200,)


def test_a_point_of_the_curve_is_the_root_of_the_mean_loss_since_the_last(
    data: TrainingData, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = dataclasses.replace(FAST, steps=12)
    every = train(data, plan)
    monkeypatch.setattr(trainer_module, "_CURVE_POINTS", 4)
    some = train(data, plan)
    assert some.curve_step.tolist() == [3, 6, 9, 12]
    expected = np.sqrt((every.curve_rmse**2).reshape(4, 3).mean(axis=1))
    np.testing.assert_allclose(some.curve_rmse, expected, rtol=1e-5)


# ---- the encoder after the fact --------------------------------------------------------------


def test_the_residual_is_0_in_the_paper_and_none_without_an_encoder(data: TrainingData) -> None:
    assert train(data, PAPER).encoder_residual == pytest.approx(0.0, abs=1e-6)
    assert train(data, FAST).encoder_residual is None


@pytest.mark.parametrize("clusters", [None, 6])
def test_the_residual_is_that_of_the_stored_encoder(clusters: int | None) -> None:
    data = data_of(clusters)
    found = train(data, dataclasses.replace(FAST, encoder_steps=60))
    encoder = encoder_of(encoder_vector(found.encoder), len(PAIRS.light), WIDTHS)
    seen = transposed(IMAGES) if data.representatives is None else data.representatives
    with torch.no_grad():
        said = encoder(x3_of(seen, data)).numpy()
    away = (said - found.latents) / found.latents.std(axis=0)
    assert found.encoder_residual == pytest.approx(rmse(away, np.zeros(1)), rel=1e-3)


def test_distillation_fits_the_encoder_and_leaves_the_rest(data: TrainingData) -> None:
    few, many = (train(data, dataclasses.replace(FAST, encoder_steps=steps)) for steps in (2, 150))
    np.testing.assert_array_equal(few.latents, many.latents)
    for name, part in decoder_arrays(few.decoder).items():
        np.testing.assert_array_equal(part, decoder_arrays(many.decoder)[name])
    assert few.encoder_residual is not None
    assert many.encoder_residual is not None
    assert many.encoder_residual < 0.75 * few.encoder_residual


def test_the_encoder_that_is_given_is_ready_for_use(data: TrainingData) -> None:
    found = train(data, PAPER)
    assert not found.encoder.training


@pytest.mark.filterwarnings("ignore:std")
def test_a_single_latent_vector_can_be_distilled() -> None:
    found = train(one_texel(), dataclasses.replace(FAST, encoder_steps=3))
    assert np.isfinite(encoder_vector(found.encoder)).all()


# ---- warm start ------------------------------------------------------------------------------


def test_the_three_warm_starts_begin_where_they_say(data: TrainingData) -> None:
    plans: list[tuple[str, Any]] = [("pca", FAST), ("random", FAST), ("encoder", ENCODER_FIRST)]
    first = {}
    for name, plan in plans:
        trainer = Trainer(data, dataclasses.replace(plan, warm_start=name))
        while trainer.stages[0][0] == "encoder" and trainer.steps_done < trainer.stages[0][1]:
            trainer.step()
        first[name] = trainer.latents.detach().numpy().copy()
        if name == "encoder":
            x3 = x3_of(transposed(IMAGES), data)
            with torch.no_grad():
                said = trainer.encoder.eval()(x3).numpy()
            np.testing.assert_allclose(first[name], said, atol=1e-5)
    np.testing.assert_array_equal(first["pca"], data.start)
    assert abs(first["random"].mean()) < 4 / np.sqrt(first["random"].size)
    assert first["random"].std() == pytest.approx(1, abs=0.15)
    for one, two in itertools.combinations(first.values(), 2):
        assert np.abs(one - two).max() > 0.1
