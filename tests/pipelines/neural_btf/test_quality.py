"""Figures of quality: known errors, nulls, and what must not win: noise, blur, sharpening."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.neural_btf.quality import (
    error_figures,
    grazing_figures,
    judged_images,
    picture_errors,
    quality,
    shuffled,
    worst_tenth,
)
from pipelines.neural_btf.quality_sums import Comparison, compare

TABLE = hemisphere_table(15)
PAIRS = all_pairs(TABLE, TABLE)
SIZE = (10, 9)
ALPHA = 2.0
Abrdfs = NDArray[np.float32]


def material(seed: int = 0, size: tuple[int, int] = SIZE) -> Abrdfs:
    """ABRDFs (texel, image, 3) of a print of some relief: detail, lit differently."""
    random = np.random.default_rng(seed)
    texels = size[0] * size[1]
    colour = random.uniform(0.2, 1.0, (texels, 1, 3))
    lit = np.clip(np.cos(PAIRS.light[:, 0]) + random.normal(0, 0.3, (texels, 225)), 0.05, None)
    return (colour * lit[..., None]).astype(np.float32)


def judge(
    restored: Abrdfs, truth: Abrdfs, size: tuple[int, int] = SIZE, block: int = 30
) -> dict[str, float]:
    return quality(
        lambda a, b: restored[a:b], lambda a, b: truth[a:b], PAIRS, size, ALPHA, block=block
    )


def compared(
    restored: Abrdfs, truth: Abrdfs, block: int = 30, size: tuple[int, int] = SIZE
) -> Comparison:
    return compare(
        lambda a, b: restored[a:b],
        lambda a, b: truth[a:b],
        PAIRS,
        size,
        judged=judged_images(PAIRS),
        block=block,
    )


def noise(amount: float, seed: int = 7, like: Abrdfs | None = None) -> Abrdfs:
    shape = material().shape if like is None else like.shape
    return np.random.default_rng(seed).normal(0, amount, shape).astype(np.float32)


def flat(truth: Abrdfs) -> Abrdfs:
    return np.broadcast_to(truth.mean(axis=0), truth.shape).astype(np.float32)


def blurred(truth: Abrdfs, share: float) -> Abrdfs:
    return (truth * (1 - share) + flat(truth) * share).astype(np.float32)


# ---- the whole ---------------------------------------------------------------------------------


def test_what_is_restored_exactly_is_perfect_in_every_figure() -> None:
    truth = material()
    found = judge(truth, truth)
    for name in ("rmse", "rmse_over_deviation", "rmse_over_null", "rmse_over_null_60", "flip"):
        assert found[name] == pytest.approx(0.0, abs=1e-6), name
    for name in ("worst_photographs", "worst_texels", "flip_60"):
        assert found[name] == pytest.approx(0.0, abs=1e-6), name
    for name in ("ssim", "ssim_60", "grazing_detail", "grazing_energy"):
        assert found[name] == pytest.approx(1.0, abs=1e-6), name
    assert found["psnr"] > 100


def test_every_null_is_worse_than_a_good_restoration_and_mean_colours_have_one() -> None:
    truth = material()
    found = judge(truth + noise(0.02), truth)
    assert found["rmse_over_null"] < 0.2
    assert found["rmse_over_null_shuffled"] > 1.2
    for name, value in found.items():
        stem, _, kind = name.rpartition("_")
        if kind not in ("null", "shuffled") or stem not in found:
            continue
        better = value < found[stem] if stem[:4] in ("psnr", "ssim") else value > found[stem]
        assert better, (name, value, found[stem])
    own = judge(flat(truth), truth)
    assert own["rmse_over_null"] == pytest.approx(1.0, rel=1e-5)
    assert own["rmse_over_null_60"] == pytest.approx(1.0, rel=1e-5)
    assert own["grazing_detail"] == own["grazing_energy"] == 0.0
    for name in ("rmse", "worst_photographs", "worst_texels", "rmse_over_deviation"):
        assert own[name] == pytest.approx(own[f"{name}_null"], rel=1e-5), name
    for name in ("psnr", "ssim", "flip", "psnr_60", "ssim_60", "flip_60"):
        assert own[name] == pytest.approx(own[f"{name}_null"], rel=1e-3), name


@pytest.mark.parametrize("block", [1, 9, 20, 1000])
def test_figures_do_not_depend_on_the_block(block: int) -> None:
    truth = material()
    restored = truth + noise(0.1)
    whole, parts = judge(restored, truth, block=90), judge(restored, truth, block=block)
    assert whole.keys() == parts.keys()
    for name, value in whole.items():
        assert parts[name] == pytest.approx(value, rel=1e-5), name


@pytest.mark.parametrize("spoil", [blurred, lambda truth, share: truth + noise(0.3 * share)])
def test_figures_grow_worse_with_blur_and_with_noise(spoil: Callable[..., Abrdfs]) -> None:
    truth = material()
    all_found = [judge(spoil(truth, share), truth) for share in (0.1, 0.3, 0.6, 0.9)]
    for name in ("rmse", "rmse_over_null", "rmse_over_null_60", "worst_photographs",
                 "worst_texels", "flip", "flip_60"):  # fmt: skip
        values = [found[name] for found in all_found]
        assert values == sorted(values), name
    for name in ("psnr", "ssim", "grazing_detail", "psnr_60", "ssim_60"):
        values = [found[name] for found in all_found]
        assert values == sorted(values, reverse=True), name


# ---- values ------------------------------------------------------------------------------------


def test_a_constant_error_has_its_closed_forms() -> None:
    truth = material()
    found = judge(truth + np.float32(0.05), truth)
    assert found["rmse"] == pytest.approx(0.05 / ALPHA, rel=1e-5)
    deviation = float(truth.astype(np.float64).std())
    assert found["rmse_over_deviation"] == pytest.approx(0.05 / deviation, rel=1e-5)
    assert found["worst_photographs"] == pytest.approx(0.05 / deviation, rel=1e-5)
    assert found["worst_texels"] == pytest.approx(0.05 / deviation, rel=1e-5)
    contrast = math.sqrt(np.mean(truth.astype(np.float64).var(axis=0)))
    assert found["rmse_null"] == pytest.approx(contrast / ALPHA, rel=1e-5)
    assert found["rmse_over_null"] == pytest.approx(0.05 / contrast, rel=1e-5)


def test_the_mean_of_all_values_has_one_over_the_deviation() -> None:
    truth = material()
    assert judge(np.full_like(truth, truth.mean()), truth)["rmse_over_deviation"] == pytest.approx(
        1.0, rel=1e-5
    )


def test_errors_by_photograph_and_texel_are_those_of_whole_arrays() -> None:
    truth = material()
    restored = truth + noise(0.1)
    found = compared(restored, truth, block=20)
    squares = (restored.astype(np.float64) - truth) ** 2
    centred = (truth.astype(np.float64) - truth.mean(axis=0, dtype=np.float64)) ** 2
    np.testing.assert_allclose(found.of_image, squares.mean(axis=(0, 2)), rtol=1e-4)
    np.testing.assert_allclose(found.of_texel, squares.mean(axis=(1, 2)), rtol=1e-4)
    np.testing.assert_allclose(found.flat_of_image, centred.mean(axis=(0, 2)), rtol=1e-4)
    np.testing.assert_allclose(found.flat_of_texel, centred.mean(axis=(1, 2)), rtol=1e-4)


def test_the_shuffled_null_is_what_shuffling_gives_on_average() -> None:
    truth = material()
    restored = (blurred(truth, 0.4) + 0.1).astype(np.float32)
    expected = compared(restored, truth).shuffled_of_image.mean()
    random = np.random.default_rng(3)
    drawn = [
        float(np.mean((restored[random.permutation(len(truth))] - truth) ** 2)) for _ in range(200)
    ]
    spread = np.std(drawn, ddof=1) / math.sqrt(len(drawn))
    assert abs(np.mean(drawn) - expected) < 4 * spread
    assert spread < 0.01 * expected


def test_the_worst_tenth_is_the_mean_of_the_largest() -> None:
    squared = np.arange(1.0, 101.0)
    order = np.random.default_rng(0).permutation(100)
    assert worst_tenth(squared[order]) == pytest.approx(math.sqrt(np.arange(91.0, 101.0).mean()))
    assert worst_tenth(np.array([4.0, 1.0])) == 2.0


def test_photographs_without_contrast_are_not_asked_for_their_noise() -> None:
    """A plain paint: its restoration is right but for noise, of which nothing can be restored."""
    cosine = np.cos(PAIRS.light[:, 0])[None, :, None] * np.ones((90, 1, 3))
    truth = (cosine + noise(0.003)).astype(np.float32)
    found = judge(cosine.astype(np.float32), truth)
    assert found["rmse_over_null"] < 0.3
    assert judge(cosine.astype(np.float32) * 0.8, truth)["rmse_over_null"] > 1


def test_values_that_are_all_equal_have_finite_figures() -> None:
    truth = np.full((90, 225, 3), 0.5, np.float32)
    found = error_figures(compared(truth, truth), ALPHA)
    assert found["rmse_over_null"] == found["worst_texels"] == 0.0


# ---- gradients ---------------------------------------------------------------------------------


def test_gradients_are_those_of_whole_photographs() -> None:
    truth = material()
    restored = truth + noise(0.2)
    found = compared(restored, truth, block=20)
    np.testing.assert_array_equal(found.grazing, np.flatnonzero(PAIRS.view[:, 0] > 1.0))
    one, other = (
        part.reshape(*SIZE, 225, 3)[:, :, found.grazing].astype(np.float64)
        for part in (truth, restored)
    )

    def product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        down = ((a[1:] - a[:-1]) * (b[1:] - b[:-1])).sum(axis=(0, 1, 3))
        across = ((a[:, 1:] - a[:, :-1]) * (b[:, 1:] - b[:, :-1])).sum(axis=(0, 1, 3))
        return np.asarray(down + across)

    np.testing.assert_allclose(found.gradients.measured, product(one, one), rtol=1e-4)
    np.testing.assert_allclose(found.gradients.restored, product(other, other), rtol=1e-4)
    np.testing.assert_allclose(found.gradients.shared, product(one, other), rtol=1e-4)


@pytest.mark.parametrize(("gain", "detail"), [(0.5, 0.5), (1.0, 1.0), (2.0, 0.5)])
def test_detail_too_weak_or_too_strong_is_lost(gain: float, detail: float) -> None:
    truth = material()
    found = judge(flat(truth) + gain * (truth - flat(truth)), truth)
    assert found["grazing_detail"] == pytest.approx(detail, rel=1e-4)
    assert found["grazing_energy"] == pytest.approx(gain**2, rel=1e-4)


def test_noise_adds_energy_but_no_detail() -> None:
    size = (40, 40)
    truth = material(size=size)

    def found(restored: Abrdfs) -> dict[str, float]:
        return grazing_figures(compared(restored, truth, block=400, size=size))

    soft = blurred(truth, 0.5)
    noisy = found(soft + noise(0.25, like=truth))
    assert noisy["grazing_energy"] > found(soft)["grazing_energy"] + 0.4
    assert noisy["grazing_detail"] < found(soft)["grazing_detail"] + 0.01
    assert abs(found(flat(truth) + noise(0.4, like=truth))["grazing_detail"]) < 0.02
    order = np.random.default_rng(5).permutation(len(truth))
    assert abs(found(truth[order])["grazing_detail"]) < 0.05


def test_without_grazing_views_there_are_no_figures_of_them() -> None:
    steep = all_pairs(TABLE[:7], TABLE)
    truth = material()[:, : len(steep.light)]
    found = quality(lambda a, b: truth[a:b], lambda a, b: truth[a:b], steep, SIZE, ALPHA)
    assert not [name for name in found if "60" in name or "grazing" in name]
    assert found["ssim"] == pytest.approx(1.0)


# ---- pictures ----------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [41, 81, 151])
def test_judged_photographs_go_from_above_to_grazing(count: int) -> None:
    table = hemisphere_table(count)
    pairs = all_pairs(table, table)
    numbers = judged_images(pairs)
    assert len(numbers) == 24
    theta = np.degrees(pairs.view[numbers, 0])
    assert np.sum(theta >= 59.5) == 8
    assert theta.min() == 0.0
    assert theta.max() == pytest.approx(75.0)
    assert np.degrees(pairs.light[numbers, 0]).max() == pytest.approx(75.0)


def test_judged_photographs_of_81_directions_are_the_documented_ones() -> None:
    table = hemisphere_table(81)
    pairs = all_pairs(table, table)
    numbers = judged_images(pairs)
    angles = np.degrees(np.hstack([pairs.view, pairs.light])[numbers]).round()
    found = {tuple(row) for row in angles.astype(int).tolist()}
    for row in ((0, 0, 15, 0), (15, 60, 60, 234), (60, 324, 60, 144), (75, 45, 75, 315)):
        assert row in found


def test_a_photograph_counts_once() -> None:
    few = Pairs(np.zeros((3, 2)), np.zeros((3, 2)))
    np.testing.assert_array_equal(judged_images(few), [0])


def test_pictures_are_exposed_by_what_was_measured() -> None:
    truth = np.random.default_rng(0).random((2, 12, 12, 3), np.float32)
    dim = np.stack([truth[0], truth[1] * np.float32(0.01)])
    bright = picture_errors(dim, dim * np.float32(0.7))
    alike = picture_errors(truth, truth * np.float32(0.7))
    for one, other in zip(bright, alike, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-3)
    assert (alike.flip > 0.05).all()


def test_small_photographs_have_no_ssim() -> None:
    small = (5, 6)
    truth = material(size=small)
    found = judge(truth + noise(0.1, like=truth), truth, small)
    assert not [name for name in found if name.startswith("ssim")]
    assert found["flip"] > 0
    assert found["psnr"] < 40


def test_shuffled_photographs_have_their_texels_in_one_other_order() -> None:
    images = np.random.default_rng(0).random((3, 6, 7, 3), np.float32)
    found = shuffled(images).reshape(3, 42, 3)
    texels = images[0].reshape(42, 3)
    order = [int(np.flatnonzero((texels == row).all(axis=1))[0]) for row in found[0]]
    assert sorted(order) == list(range(42))
    assert order != list(range(42))
    np.testing.assert_array_equal(found, images.reshape(3, 42, 3)[:, order])
