"""Rivals of a BTF: never above their bytes, what is told is what is decoded, nulls are worse."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.btf_rivals.all_rivals import rivals_at
from benchmarks.btf_rivals.budget import filled
from benchmarks.btf_rivals.code_length import SCORES, code_bits, contexts_of
from benchmarks.btf_rivals.components import components_of
from benchmarks.btf_rivals.latent_texture import latent_texture
from benchmarks.btf_rivals.photographs import barycentric_weights, spread_directions
from benchmarks.btf_rivals.rival import MeasuredBtf, Rival, rival_rmse
from benchmarks.btf_rivals.tucker import factorisation
from pipelines.light.directions import Pairs, all_pairs, hemisphere_table, unit_vectors

SIZE = (24, 24)
BUDGET = 5000
NAMES = ["tucker", "tucker_cosines", "latent_texture", "pca", "photographs", "flat", "grey"]


@pytest.fixture(scope="module")
def pairs() -> Pairs:
    table = hemisphere_table(15)
    return all_pairs(table, table)


@pytest.fixture(scope="module")
def cloth(pairs: Pairs) -> NDArray[np.float16]:
    """ABRDFs of 24 x 24 texels: matt and glossy coloured hills that shift with the view."""
    random = np.random.default_rng(7)
    light, view = unit_vectors(pairs.light), unit_vectors(pairs.view)
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    row, column = np.divmod(np.arange(SIZE[0] * SIZE[1]), SIZE[1])
    wave = np.zeros((len(row), len(light), 2))
    for along, across, phase in random.uniform([1, -2, 0], [4, 2, 6], (5, 3)):
        # Looked at from aside, a hill stands elsewhere.
        turn = 2 * np.pi * np.array([along, across]) / SIZE[1]
        angle = (column[:, None] + view[:, 0]) * turn[0] + (row[:, None] + view[:, 1]) * turn[1]
        wave += 0.4 * np.cos(angle + phase)[..., None] * np.array([along, across]) / 4
    normals = np.concatenate([-wave, np.ones_like(wave[..., :1])], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    matt = np.maximum(np.einsum("tpi,pi->tp", normals, light), 0.0)
    gloss = np.maximum(np.einsum("tpi,pi->tp", normals, half), 0.0) ** 30
    colour = 0.3 + 0.1 * random.random((len(row), 1, 3))
    found = matt[..., None] * colour + 0.2 * gloss[..., None]
    return (found + random.normal(0, 0.01, found.shape)).clip(0).astype(np.float16)


@pytest.fixture(scope="module")
def rivals(cloth: NDArray[np.float16], pairs: Pairs) -> dict[str, Rival]:
    found = rivals_at(cloth, SIZE, pairs, BUDGET, steps=400, seed=0)
    return {rival.name: rival for rival in found}


def test_every_rival_is_there(rivals: dict[str, Rival]) -> None:
    assert sorted(rivals) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES[:-2])
def test_bytes_are_used_and_never_exceeded(rivals: dict[str, Rival], name: str) -> None:
    assert 0.97 * BUDGET <= rivals[name].bytes <= BUDGET


@pytest.mark.parametrize("name", NAMES)
def test_any_block_of_texels_is_the_same_and_the_error_is_of_them(
    rivals: dict[str, Rival], cloth: NDArray[np.float16], name: str
) -> None:
    alpha = float(cloth.max())
    whole = rivals[name].restore(0, len(cloth))
    assert whole.shape == cloth.shape
    assert whole.dtype == np.float32
    assert np.allclose(rivals[name].restore(100, 117), whole[100:117], atol=1e-5)
    expected = math.sqrt(np.mean((whole.astype(np.float64) - cloth) ** 2)) / alpha
    assert rival_rmse(rivals[name], cloth, alpha) == pytest.approx(expected, rel=1e-4)


def test_the_nulls_are_the_mean_colours_and_clearly_worse(
    rivals: dict[str, Rival], cloth: NDArray[np.float16]
) -> None:
    alpha = float(cloth.max())
    errors = {name: rival_rmse(rival, cloth, alpha) for name, rival in rivals.items()}
    values = cloth.astype(np.float64)
    assert errors["flat"] == pytest.approx(math.sqrt(values.var(axis=0).mean()) / alpha, rel=1e-3)
    assert errors["grey"] == pytest.approx(values.std() / alpha, rel=1e-3)
    assert errors["grey"] > 1.1 * errors["flat"]
    for name in ("tucker", "tucker_cosines", "pca", "photographs"):
        assert errors[name] < 0.85 * errors["flat"], name
    assert errors["latent_texture"] < errors["flat"]
    assert errors["tucker"] < errors["pca"]


def test_more_bytes_are_never_worse(cloth: NDArray[np.float16], pairs: Pairs) -> None:
    measured = MeasuredBtf(cloth, SIZE, pairs)
    components = components_of(measured)
    for name, cosines in (("tucker", False), ("tucker_cosines", True), ("pca", False)):
        errors = [
            rival_rmse(
                factorisation(name, measured, components, budget, cosines=cosines),
                cloth,
                measured.alpha,
            )
            for budget in (2500, 5000, 10_000)
        ]
        assert errors[0] > errors[1] > errors[2], name


def test_texels_that_lie_apart_cost_cosines_what_they_gain(
    cloth: NDArray[np.float16], pairs: Pairs
) -> None:
    """Cosines live from what neighbours have in common: shuffled texels leave them nothing."""
    order = np.random.default_rng(0).permutation(len(cloth))
    gains = []
    for abrdfs in (cloth, cloth[order]):
        measured = MeasuredBtf(abrdfs, SIZE, pairs)
        components = components_of(measured)
        errors = [
            rival_rmse(
                factorisation("tucker", measured, components, BUDGET, cosines=cosines),
                abrdfs,
                measured.alpha,
            )
            for cosines in (True, False)
        ]
        gains.append(errors[0] / errors[1])
    assert gains[0] < 0.95 < gains[1]


def test_tucker_of_a_low_rank_array_is_near_exact(pairs: Pairs) -> None:
    random = np.random.default_rng(1)
    texels = random.random((SIZE[0] * SIZE[1], 2))
    views, lights = random.random((2, 15, 2))
    tensor = np.einsum("tr,vr,lr,rc->tvlc", texels, views, lights, random.random((2, 3)))
    abrdfs = tensor.reshape(len(texels), -1, 3).astype(np.float16)
    measured = MeasuredBtf(abrdfs, SIZE, pairs)
    found = factorisation("tucker", measured, components_of(measured), 3000, cosines=False)
    plain = factorisation("pca", measured, components_of(measured), 3000, cosines=False)
    error = rival_rmse(found, abrdfs, measured.alpha)
    assert error < 0.004
    assert error < 0.6 * rival_rmse(plain, abrdfs, measured.alpha)


def test_components_start_and_budget_of_a_latent_texture(
    cloth: NDArray[np.float16], pairs: Pairs
) -> None:
    measured = MeasuredBtf(cloth, SIZE, pairs)
    components = components_of(measured)
    short, long = (
        rival_rmse(latent_texture(measured, components, BUDGET, steps=steps), cloth, measured.alpha)
        for steps in (40, 800)
    )
    assert long < 0.9 * short


# ---- the parts -------------------------------------------------------------------------------


def test_code_length_is_that_of_a_code_run_symbol_by_symbol() -> None:
    random = np.random.default_rng(2)
    symbols = np.rint(random.laplace(0, 4, (3, 9, 11))).astype(np.int32)
    contexts = contexts_of(np.abs(symbols), SCORES)
    seen: dict[tuple[int, int], list[float]] = defaultdict(lambda: [0.4, 0.4])
    bits = 0.0
    for symbol, context in zip(symbols.ravel(), contexts.ravel(), strict=True):
        magnitude = abs(int(symbol))
        for bin_ in range(14):
            model = seen[int(context), bin_]
            goes_on = int(magnitude > bin_)
            bits -= math.log2(model[goes_on] / sum(model))
            model[goes_on] += 1
            if not goes_on:
                break
        if magnitude >= 14:
            bits += 2 * (magnitude - 14 + 1).bit_length() - 1
        bits += magnitude > 0
    assert code_bits(symbols, SCORES) == pytest.approx(bits, rel=1e-9)


def test_a_context_knows_only_what_came_before() -> None:
    symbols = np.abs(np.random.default_rng(3).integers(0, 9, (4, 6, 7)))
    for place in np.ndindex(symbols.shape):
        changed = symbols.copy()
        flat = np.ravel_multi_index(place, symbols.shape)
        changed.ravel()[flat:] = 39
        before, after = contexts_of(symbols, SCORES), contexts_of(changed, SCORES)
        assert np.array_equal(before.ravel()[: flat + 1], after.ravel()[: flat + 1])


def test_independent_symbols_cost_no_less_than_their_entropy() -> None:
    random = np.random.default_rng(4)
    symbols = random.choice([-1, 0, 1], p=[0.1, 0.8, 0.1], size=(5, 60, 60))
    entropy = symbols.size * (0.8 * math.log2(1 / 0.8) + 0.2 * math.log2(10))
    assert 0.98 * entropy < code_bits(symbols, SCORES) < 1.03 * entropy


def test_a_budget_is_filled() -> None:
    class Code:
        def __init__(self, step: float) -> None:
            self.bytes = int(100 + 3000 * step**-0.7)

    for budget in (150, 1000, 70_000):
        found = filled(Code, budget, 1.0)
        assert found is not None
        assert 0.97 * budget <= found.bytes <= budget
    assert filled(Code, 90, 1.0) is None


def test_weights_restore_what_is_linear_on_the_plane_inside() -> None:
    table = hemisphere_table(81)
    chosen = spread_directions(table, 16)
    weights = barycentric_weights(table[chosen], table)
    assert np.allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert weights.min() >= -1e-6
    assert (np.count_nonzero(weights > 1e-6, axis=1) <= 3).all()
    assert np.allclose(weights[chosen], np.eye(16), atol=1e-6)
    radius = np.tan(table[:, 0] / 2)
    plane = np.stack([radius * np.cos(table[:, 1]), radius * np.sin(table[:, 1])], axis=1)
    steps = np.linalg.norm(weights @ plane[chosen] - plane, axis=1)
    inner = table[:, 0] < np.radians(60)
    assert steps[inner].max() < 1e-6
    for few in (1, 2):
        some = barycentric_weights(table[chosen[:few]], table)
        assert np.allclose(some.sum(axis=1), 1.0)


def test_directions_are_spread_and_distinct() -> None:
    table = hemisphere_table(81)
    chosen = spread_directions(table, 10)
    assert chosen[0] == 0
    assert len(set(chosen.tolist())) == 10
    vectors = unit_vectors(table[chosen])
    nearest = np.sort(vectors @ vectors.T, axis=1)[:, -2]
    first = unit_vectors(table[:10])
    assert nearest.max() < np.sort(first @ first.T, axis=1)[:, -2].max()


def test_what_is_no_grid_is_refused(cloth: NDArray[np.float16], pairs: Pairs) -> None:
    with pytest.raises(ValueError, match="expected rows x columns"):
        MeasuredBtf(cloth, (24, 23), pairs)
    turned = Pairs(pairs.light[::-1], pairs.view)
    shuffled = Pairs(pairs.light, pairs.view[np.random.default_rng(5).permutation(15 * 15)])
    assert MeasuredBtf(cloth, SIZE, turned).lights.shape == (15, 2)
    with pytest.raises(ValueError, match="no grid"):
        MeasuredBtf(cloth, SIZE, shuffled)


def test_too_small_a_budget_is_said(cloth: NDArray[np.float16], pairs: Pairs) -> None:
    measured = MeasuredBtf(cloth, SIZE, pairs)
    with pytest.raises(ValueError, match="too few"):
        factorisation("tucker", measured, components_of(measured), 10, cosines=False)
