"""Scratch layers against search without a grid, closed forms and counting."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.coverage import (
    coverage_maps,
    filtered_coverage,
    flatten_mips,
    mip_pyramid,
    visible_areas,
)
from pipelines.glass_scratches.layers.feature_noise import KNOTS, noise_along
from pipelines.glass_scratches.layers.feature_search import (
    LayerArrays,
    nearest_feature,
    scratch_at,
)
from pipelines.glass_scratches.layers.features import (
    Features,
    Layers,
    layer_arrays,
    layers_of_features,
)
from pipelines.glass_scratches.layers.pictures import WHITE, layer_stages, layers_picture
from pipelines.glass_scratches.layers.scratch_layers import make_layers, solve_thresholds
from pipelines.glass_scratches.layers.settings import LayerSpec

Floats = NDArray[np.float64]

COARSE = LayerSpec(length=0.4, width=0.05, threshold=0.3, layers=3)
WORN = LayerSpec(
    length=0.5, width=0.02, threshold=0.3, layers=3, curvature=0.8, digs=0.2, fading=0.7,
    breaks=0.3, spread=0.5,
)  # fmt: skip
SPECS = {
    "setting 1": LayerSpec(),
    "setting 2": LayerSpec(length=0.6, width=0.01),
    "wide": COARSE,
    "long": LayerSpec(length=1.0, width=0.01, threshold=0.5),
    "curved": replace(COARSE, curvature=1.2),
    "pits": replace(COARSE, digs=1.0),
    "spread": replace(COARSE, spread=1.0, curvature=1.5),
    "worn": WORN,
}


@njit
def _asked(
    arrays: LayerArrays, layers: NDArray[np.int64], points: Floats, found: Floats, item: Floats
) -> None:
    for k in range(len(points)):
        found[k] = scratch_at(arrays, layers[k], points[k, 0], points[k, 1])
        item[k] = nearest_feature(arrays, layers[k], points[k, 0], points[k, 1])[0]


def ask(layers: Layers, number: NDArray[np.integer], points: Floats) -> tuple[Floats, Floats]:
    """(opacity, across, angle) (N, 3) and the feature's number (N,) at points (N, 2)."""
    found, item = np.empty((len(points), 3)), np.empty(len(points))
    _asked(layer_arrays(layers), np.asarray(number, np.int64), points, found, item)
    return found, item


def one_scratch(
    half_length: float = 0.2,
    half_width: float = 0.03,
    angle: float = 0.6,
    curvature: float = 0.0,
    centre: tuple[float, float] = (0.9, 0.15),
    strength: float = 1.0,
    seed: int = 7,
    fading: float = 0.0,
    breaks: float = 0.0,
) -> Layers:
    def column(value: float) -> NDArray[np.float32]:
        return np.array([value], np.float32)

    features = Features(
        layer=np.zeros(1, np.int32),
        centre=np.array([centre], np.float32),
        turn=column(0.0),
        half_length=column(half_length),
        half_width=column(half_width),
        curvature=column(curvature),
        strength=column(strength),
        seed=np.array([seed], np.uint32),
        is_dig=np.zeros(1, np.bool_),
    )
    return layers_of_features(column(angle), features, fading=fading, breaks=breaks)


# ---- search without a grid ---------------------------------------------------------------------


def hashed(a: int, b: int) -> float:
    mask = 2**64 - 1
    z = (((a << 32) ^ (b % 2**32)) + 0x9E3779B97F4A7C15) & mask
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
    return ((z ^ (z >> 31)) >> 11) / 2**53


def noise(seed: int, place: float) -> float:
    """Rank of the mix of two uniform numbers, from the area of a trapezium."""
    knot = math.floor(place)
    t = place - knot
    w = t * t * (3 - 2 * t)
    x = (1 - w) * hashed(seed, knot) + w * hashed(seed, knot + 1)
    a, b = sorted((w, 1 - w))
    rising, level = min(x, a), min(max(x - a, 0), b - a)
    falling = max(x - b, 0)
    height = 1 / b
    area = 0.0 if a == 0 else height * rising**2 / (2 * a)
    return area + height * level + (height * (falling - falling**2 / (2 * a)) if a else 0.0)


def state(layers: Layers, i: int, s: float) -> tuple[float, float]:
    """Opacity and relative width along a scratch."""
    features = layers.features
    opacity = float(features.strength[i])
    if features.is_dig[i]:
        return opacity, 1.0
    seed = int(features.seed[i])
    place = KNOTS * (s + 1) / 2 + hashed(seed, -1)
    left = 1.0
    if layers.breaks:
        left = (noise(seed, place) - layers.breaks) / (0.5 * (1 - layers.breaks))
    way = (1 + (s if seed % 2 else -s)) / 2
    kept = (1 - way**2) * (1 - 0.6 * noise(seed ^ 0x5BD1E995, place))
    left = min(max(left, 0.0), 1.0)
    return opacity * (1 - layers.fading + layers.fading * kept), 1 - (1 - left) ** 2


def search(layers: Layers, layer: int, x: float, y: float) -> tuple[float, float, float, int]:
    """All features, all nine copies of each; arcs by the centre of their circle."""
    best = (1.0, (0.0, 0.0, 0.0, -1))
    features = layers.features
    own = np.flatnonzero(features.layer == layer)
    way = float(layers.angle[layer]) + features.turn[own].astype(np.float64)
    bend = features.curvature[own].astype(np.float64)
    length, width = features.half_length[own], features.half_width[own]
    for shift_x in (-1, 0, 1):
        for shift_y in (-1, 0, 1):
            d = (x + shift_x, y + shift_y) - features.centre[own].astype(np.float64)
            px = d[:, 0] * np.cos(way) + d[:, 1] * np.sin(way)
            py = d[:, 1] * np.cos(way) - d[:, 0] * np.sin(way)
            with np.errstate(divide="ignore", invalid="ignore"):
                radius = 1 / bend
                out = radius - np.sign(radius) * np.hypot(px, py - radius)
                around = radius * np.arctan2(px * np.sign(radius), np.abs(radius - py))
            # Behind the circle's centre no scratch reaches.
            around[(bend != 0) & ((radius - py) * np.sign(radius) < 0)] = np.inf
            u, v = np.where(bend == 0, px, around), np.where(bend == 0, py, out)
            near = (u / length) ** 2 + (v / width) ** 2 < 1
            for k in np.flatnonzero(near):
                s = u[k] / length[k]
                opacity, wide = state(layers, own[k], s)
                if wide <= 0:
                    continue
                distance = s**2 + (v[k] / (wide * width[k])) ** 2
                if distance < best[0]:
                    across = v[k] / (wide * width[k] * math.sqrt(1 - s**2))
                    best = (distance, (opacity, across, way[k] + bend[k] * u[k], own[k]))
    return best[1]


@pytest.mark.parametrize("name", SPECS)
def test_the_grid_finds_what_a_search_of_everything_finds(name: str) -> None:
    layers = make_layers(SPECS[name], 11)
    rng = np.random.default_rng(5)
    # Half of the points in scratches, so that thin ones are met.
    features = layers.features
    chosen = rng.integers(0, len(features.layer), 150)
    offset = 1.2 * features.half_width[chosen] * rng.standard_normal(150)
    along = features.half_length[chosen] * rng.uniform(-1, 1, 150)
    way = layers.angle[features.layer[chosen]] + features.turn[chosen]
    inside = features.centre[chosen] + np.stack(
        [along * np.cos(way) - offset * np.sin(way), along * np.sin(way) + offset * np.cos(way)], -1
    )
    points = np.concatenate([inside % 1.0, rng.random((150, 2))])
    number = np.concatenate([features.layer[chosen], rng.integers(0, SPECS[name].layers, 150)])
    found, item = ask(layers, number, points)
    expected = np.array([search(layers, k, x, y) for k, (x, y) in zip(number, points, strict=True)])
    assert 50 < np.sum(item >= 0) < 300
    np.testing.assert_array_equal(item, expected[:, 3])
    # Directions are kept as float32 cosines: parts of 1e-7 of a half length, in half widths.
    slack = 4e-7 * (1 + (features.half_length / features.half_width).max())
    # A place across is v over a width that goes to 0 at the tips.
    near_tip = np.abs(found[:, 1]) > 0.999
    difference = np.abs(found - expected[:, :3])
    assert difference[~near_tip].max() < 50 * slack


def test_the_noise_along_a_scratch_is_that_of_its_definition_and_uniform() -> None:
    rng = np.random.default_rng(2)
    places = rng.uniform(0, 8, 300)
    seeds = rng.integers(0, 2**32, 300)
    found = [noise_along(s, p) for s, p in zip(seeds.tolist(), places, strict=True)]
    expected = [noise(s, p) for s, p in zip(seeds.tolist(), places, strict=True)]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    for place in (0.0, 0.1, 0.37, 0.5, 0.9):
        values = np.sort([noise_along(seed, place) for seed in range(20_000)])
        # Kolmogorov and Smirnov: 1.63 / sqrt(n) is met by chance once in a hundred.
        assert np.abs(values - np.linspace(0, 1, 20_000)).max() < 2.0 / math.sqrt(20_000)
    steps = np.array([noise_along(3, p) for p in np.linspace(0, 6, 60_001)])
    assert np.abs(np.diff(steps)).max() < 2e-3


# ---- closed forms ------------------------------------------------------------------------------


@pytest.mark.parametrize("half_length", [0.2, 0.5])
def test_a_straight_scratch_covers_exactly_its_ellipse(half_length: float) -> None:
    half_width, angle, centre = 0.03, 0.6, (0.9, 0.15)
    layers = one_scratch(half_length, half_width, angle, centre=centre)
    rng = np.random.default_rng(0)
    u, v = half_length * rng.uniform(-1.2, 1.2, 4000), half_width * rng.uniform(-1.2, 1.2, 4000)
    x = centre[0] + u * math.cos(angle) - v * math.sin(angle)
    y = centre[1] + u * math.sin(angle) + v * math.cos(angle)
    found, _ = ask(layers, np.zeros(4000), np.stack([x, y], axis=-1))
    distance = (u / half_length) ** 2 + (v / half_width) ** 2
    clear = np.abs(distance - 1) > 1e-4
    np.testing.assert_array_equal(found[clear, 0], (distance < 1)[clear])
    inside = distance < 0.99
    np.testing.assert_allclose(found[inside, 2], np.float32(angle))
    edge = half_width * np.sqrt(1 - (u[inside] / half_length) ** 2)
    np.testing.assert_allclose(found[inside, 1], v[inside] / edge, atol=1e-4)


@pytest.mark.parametrize("curvature", [-3.0, 0.001, 5.0])
def test_an_arc_covers_the_ellipse_in_its_own_coordinates(curvature: float) -> None:
    half_length, half_width, angle, centre = 0.2, 0.04, 2.0, (0.02, 0.97)
    layers = one_scratch(half_length, half_width, angle, curvature, centre)
    rng = np.random.default_rng(1)
    u, v = half_length * rng.uniform(-1.2, 1.2, 4000), half_width * rng.uniform(-1.2, 1.2, 4000)
    # Walk the arc in small straight steps, then step aside to the left.
    steps = 4000
    heading = angle + curvature * u[:, None] * (np.arange(steps) + 0.5) / steps
    x = centre[0] + (u[:, None] / steps * np.cos(heading)).sum(axis=1)
    y = centre[1] + (u[:, None] / steps * np.sin(heading)).sum(axis=1)
    end = angle + curvature * u
    points = np.stack([x - v * np.sin(end), y + v * np.cos(end)], axis=-1)
    found, _ = ask(layers, np.zeros(4000), points)
    distance = (u / half_length) ** 2 + (v / half_width) ** 2
    clear = np.abs(distance - 1) > 1e-4
    np.testing.assert_array_equal(found[clear, 0], (distance < 1)[clear])
    inside = distance < 0.99
    np.testing.assert_allclose(found[inside, 2], end[inside], atol=1e-5)


def test_the_covered_points_of_a_scratch_lie_along_its_layers_direction() -> None:
    spec = LayerSpec(length=0.8, width=0.03, threshold=0.4, layers=5)
    layers = make_layers(spec, 2)
    rng = np.random.default_rng(3)
    for layer in range(5):
        first = int(np.flatnonzero(layers.features.layer == layer)[0])
        near = rng.uniform(-0.4, 0.4, (60_000, 2))
        _, item = ask(layers, np.full(60_000, layer), layers.features.centre[first] + near)
        _, vectors = np.linalg.eigh(np.cov(near[item == first].T))
        found = math.atan2(vectors[1, 1], vectors[0, 1])
        away = (found - layers.angle[layer] + math.pi / 2) % math.pi - math.pi / 2
        assert abs(away) < 0.02


@pytest.mark.parametrize("breaks", [0.2, 0.6])
def test_the_share_of_the_length_that_is_missing_is_what_was_asked_for(breaks: float) -> None:
    middle = np.linspace(-0.999, 0.999, 500)
    missing = []
    for seed in range(200):
        layers = one_scratch(0.25, 0.01, 0.0, centre=(0.5, 0.5), seed=seed, breaks=breaks)
        points = np.stack([0.5 + 0.25 * middle, np.full(500, 0.5)], axis=-1)
        missing.append(np.mean(ask(layers, np.zeros(500), points)[0][:, 0] == 0))
    assert np.mean(missing) == pytest.approx(breaks, abs=4 * np.std(missing) / math.sqrt(200))


def test_fading_leaves_one_end_strong_and_takes_the_other() -> None:
    ends = []
    for seed in range(60):
        layers = one_scratch(0.25, 0.01, 0.0, centre=(0.5, 0.5), seed=seed, fading=1.0)
        points = np.array([(0.5 - 0.2475, 0.5), (0.5, 0.5), (0.5 + 0.2475, 0.5)])
        opacity = ask(layers, np.zeros(3), points)[0][:, 0]
        ends.append((min(opacity[[0, 2]]), max(opacity[[0, 2]])))
        assert opacity.min() > 0.0
    assert np.max(ends, axis=0)[0] < 0.05
    assert np.min(ends, axis=0)[1] > 0.35


# ---- coverage ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("length", "width", "threshold"), [(0.1, 0.02, 0.3), (0.3, 0.004, 0.15)])
def test_the_mean_coverage_is_that_of_a_poisson_process(
    length: float, width: float, threshold: float
) -> None:
    spec = LayerSpec(length=length, width=width, threshold=threshold, layers=40)
    found = coverage_maps(make_layers(spec, 1), 64, 25).mean(axis=(1, 2), dtype=np.float64)
    error = found.std(ddof=1) / math.sqrt(len(found))
    expected = 1 - math.exp(-math.pi * threshold**2)
    assert error < 0.03 * expected
    assert found.mean() == pytest.approx(expected, abs=3.5 * error)


def test_spread_keeps_the_mean_area() -> None:
    layers = make_layers(LayerSpec(length=0.03, width=0.002, layers=8, spread=0.4, digs=0.5), 4)
    features = layers.features
    area = features.half_length * features.half_width.astype(np.float64)
    scratch = area[~features.is_dig] / (0.03 * 0.002 * 0.1**2)
    assert scratch.mean() == pytest.approx(1.0, abs=4 * scratch.std() / math.sqrt(len(scratch)))
    pit = area[features.is_dig]
    assert (pit > 0).all()
    np.testing.assert_array_equal(
        features.half_length[features.is_dig],
        features.half_width[features.is_dig],
    )
    assert 0.0 < features.strength.min() < features.strength.max() <= 1.0


@pytest.mark.parametrize(
    ("spec", "coverage"),
    [
        (LayerSpec(length=0.6, width=0.01), 0.02),
        (LayerSpec(length=0.2, width=0.05), 0.6),
        (replace(WORN, digs=0.5), 0.15),
        *(
            pytest.param(*each, marks=pytest.mark.slow)
            for each in (
                (LayerSpec(length=0.5, width=0.02, curvature=1.0, spread=0.4), 0.1),
                (LayerSpec(length=0.4, width=0.01, fading=0.8, breaks=0.4), 0.05),
                (LayerSpec(length=0.1, width=0.1, digs=1.0), 0.3),
            )
        ),
    ],
)
def test_a_layer_covers_what_was_asked_for(spec: LayerSpec, coverage: float) -> None:
    spec = replace(spec, coverage=coverage, layers=2)
    found = coverage_maps(make_layers(spec, 6), 512, 16).mean(axis=(1, 2), dtype=np.float64)
    np.testing.assert_allclose(found, coverage, rtol=0.01)
    thresholds = solve_thresholds(spec, 6)
    assert thresholds.shape == (2,)
    if spec.spread == spec.digs == 0:
        made = make_layers(spec, 6)
        np.testing.assert_allclose(
            made.features.half_width, spec.width * thresholds[made.features.layer], rtol=1e-6
        )


def test_visible_areas_add_up_to_the_coverage_of_the_maps() -> None:
    layers = make_layers(WORN, 8)
    maps = coverage_maps(layers, 256, 36).mean(axis=(1, 2), dtype=np.float64)
    for layer in range(3):
        areas = np.empty(np.sum(layers.features.layer == layer))
        own = layers.features.layer == layer
        features = Features(*(column[own] for column in layers.features))
        alone = layers_of_features(
            layers.angle[layer : layer + 1],
            features._replace(layer=np.zeros(len(areas), np.int32)),
            fading=WORN.fading,
            breaks=WORN.breaks,
        )
        visible_areas(layer_arrays(alone), 0, 4000, areas)
        assert areas.sum() == pytest.approx(maps[layer], rel=5e-3)


def test_the_pyramid_keeps_the_mean_at_every_level() -> None:
    maps = coverage_maps(make_layers(WORN, 1), 64, 4)
    levels = mip_pyramid(maps)
    assert [level.shape for level in levels] == [(3, 64 >> k, 64 >> k) for k in range(7)]
    for level in levels:
        np.testing.assert_allclose(
            level.mean(axis=(1, 2), dtype=np.float64),
            maps.mean(axis=(1, 2), dtype=np.float64),
            rtol=1e-6,
        )
    block = maps[1, 16:24, 40:48].mean(dtype=np.float64)
    assert levels[3][1, 2, 5] == pytest.approx(block, rel=1e-6)


@pytest.mark.parametrize("level", [2, 3, 5])
def test_filtered_coverage_is_the_mean_opacity_over_the_texel(level: int) -> None:
    layers = make_layers(WORN, 5)
    flat, offsets = flatten_mips(mip_pyramid(coverage_maps(layers, 128, 64)))
    size = 128 >> level
    rng = np.random.default_rng(9)
    for layer, x, y in ((0, 0.3, 0.7), (1, 0.99, 0.01), (2, 0.51, 0.49)):
        column, row = math.floor(x * size), math.floor(y * size)
        points = (rng.random((60_000, 2)) + np.array([column, row])) / size
        opacity = ask(layers, np.full(60_000, layer), points)[0][:, 0]
        error = max(opacity.std() / math.sqrt(60_000), 1e-3)
        found = filtered_coverage(flat, offsets, 128, layer, level, x, y)
        assert found == pytest.approx(opacity.mean(), abs=4.5 * error)
        for far in ((x + 2, y), (x - 1, y - 3)):
            assert filtered_coverage(flat, offsets, 128, layer, level, *far) == found


def test_levels_beyond_the_pyramid_are_its_first_and_last() -> None:
    levels = mip_pyramid(np.arange(32, dtype=np.float32).reshape(2, 4, 4))
    flat, offsets = flatten_mips(levels)
    np.testing.assert_array_equal(offsets, [0, 32, 40, 42])
    assert filtered_coverage(flat, offsets, 4, 1, -3, 0.3, 0.9) == 16 + 3 * 4 + 1
    assert filtered_coverage(flat, offsets, 4, 1, 9, 0.3, 0.9) == 16 + 7.5


def test_row_0_of_the_maps_lies_at_y_0() -> None:
    layers = one_scratch(0.05, 0.02, 0.0, centre=(0.7, 0.1))
    maps = coverage_maps(layers, 10, 16)
    row, column = np.unravel_index(np.argmax(maps[0]), (10, 10))
    assert row in (0, 1)
    assert column in (6, 7)
    assert maps[0, 5:].max() == 0.0


# ---- layers as a whole -------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["wide", "worn"])
def test_a_tile_repeats_in_both_directions(name: str) -> None:
    layers = make_layers(SPECS[name], 3)
    rng = np.random.default_rng(4)
    # Multiples of 2^-20 survive the shift exactly.
    points = rng.integers(0, 2**20, (4000, 2)) / 2**20
    number = rng.integers(0, 3, 4000)
    here, _ = ask(layers, number, points)
    for shift in ((1, -3), (-2, 0), (0, 5)):
        there, _ = ask(layers, number, points + shift)
        np.testing.assert_array_equal(here, there)


def test_equal_seeds_give_equal_layers_and_others_do_not() -> None:
    one, same, other = make_layers(WORN, 1), make_layers(WORN, 1), make_layers(WORN, 2)
    for a, b in zip(one.features, same.features, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(one.angle, same.angle)
    for name in ("cells", "cell_start", "cell_items", "fading", "breaks"):
        np.testing.assert_array_equal(getattr(one, name), getattr(same, name))
    assert not np.array_equal(one.angle, other.angle)
    assert one.features.centre[0, 0] != other.features.centre[0, 0]


def test_layers_have_the_types_that_were_promised_and_are_sorted() -> None:
    layers = make_layers(WORN, 1)
    features = layers.features
    count = len(features.layer)
    types = {
        "layer": np.int32, "centre": np.float32, "turn": np.float32, "half_length": np.float32,
        "half_width": np.float32, "curvature": np.float32, "strength": np.float32,
        "seed": np.uint32, "is_dig": np.bool_,
    }  # fmt: skip
    for name, dtype in types.items():
        column = getattr(features, name)
        assert (column.dtype, len(column)) == (dtype, count)
    assert (np.diff(features.layer) >= 0).all()
    assert ((features.centre >= 0) & (features.centre < 1)).all()
    assert ((layers.angle >= 0) & (layers.angle < math.pi)).all()
    assert len(layers.cell_start) == 3 * layers.cells**2 + 1
    assert layers.cell_start[-1] == len(layers.cell_items)


def test_directions_of_layers_are_spread_over_the_half_circle() -> None:
    angles = np.sort(make_layers(LayerSpec(length=1.0, width=1.0, layers=16), 5).angle)
    np.testing.assert_array_equal(np.floor(angles * 16 / math.pi), np.arange(16))


def test_scratches_stay_in_their_places_while_settings_are_tried() -> None:
    plain, worn = make_layers(replace(COARSE, threshold=0.1), 3), make_layers(
        replace(COARSE, curvature=0.5, fading=0.3, breaks=0.2, spread=0.3), 3
    )  # fmt: skip
    np.testing.assert_array_equal(plain.features.centre, worn.features.centre)
    np.testing.assert_array_equal(plain.angle, worn.angle)


@settings(deadline=None, max_examples=40)
@given(
    st.builds(
        LayerSpec,
        length=st.floats(0.05, 1.0), width=st.floats(0.02, 1.0), threshold=st.floats(0.01, 0.5),
        layers=st.integers(1, 3), curvature=st.floats(0.0, 1.5), digs=st.floats(0.0, 1.0),
        fading=st.floats(0.0, 1.0), breaks=st.floats(0.0, 0.99), spread=st.floats(0.0, 2.0),
    ),
    st.integers(0, 2**31),
)  # fmt: skip
def test_opacities_places_and_directions_are_valid_for_any_settings(
    spec: LayerSpec, seed: int
) -> None:
    layers = make_layers(spec, seed)
    rng = np.random.default_rng(seed)
    points = rng.uniform(-2, 2, (300, 2))
    found, item = ask(layers, rng.integers(0, spec.layers, 300), points)
    assert np.isfinite(found).all()
    assert ((found[:, 0] >= 0) & (found[:, 0] <= 1)).all()
    assert (np.abs(found[:, 1]) <= 1).all()
    assert (found[item < 0] == 0).all()


# ---- refusals ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"length": 0.0}, "length of the layers is 0; expected more than 0 and at most 1."),
        ({"length": 1.5}, "length of the layers is 1.5; expected more than 0 and at most 1."),
        ({"width": math.nan}, "width of the layers is nan; expected more than 0 and at most 1."),
        ({"threshold": 0.6}, "threshold of the layers is 0.6; expected more than 0, at most 0.5."),
        ({"threshold": 0.0}, "threshold of the layers is 0; expected more than 0, at most 0.5."),
        ({"coverage": 0.7}, "coverage of the layers is 0.7; expected more than 0, at most 0.6."),
        ({"coverage": 0.0}, "coverage of the layers is 0; expected more than 0, at most 0.6."),
        ({"layers": 0}, "layers of the layers is 0; expected 1 to 64."),
        ({"curvature": -0.1}, "curvature of the layers is -0.1; expected 0 to pi / 2 radians."),
        ({"digs": 1.1}, "digs of the layers is 1.1; expected 0 to 1."),
        ({"fading": -1.0}, "fading of the layers is -1; expected 0 to 1."),
        ({"breaks": 1.0}, "breaks of the layers is 1; expected 0 or more and less than 1."),
        ({"spread": 2.5}, "spread of the layers is 2.5; expected 0 to 2."),
        (
            {"length": 0.001, "width": 0.001},
            "layers / (length * width) makes 4000000 scratches; expected at most 2000000.",
        ),
    ],
)
def test_settings_out_of_range_are_refused(changes: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the whole message is compared
        make_layers(replace(LayerSpec(), **changes), 0)  # type: ignore[arg-type]
    assert str(caught.value) == message


def test_a_coverage_that_faded_scratches_cannot_reach_is_refused() -> None:
    spec = LayerSpec(length=0.5, width=0.1, fading=1.0, breaks=0.8, coverage=0.6, layers=1)
    with pytest.raises(
        ValueError, match=r"^coverage of the layers is 0\.6; expected at most 0\.\d"
    ):
        make_layers(spec, 0)


def test_maps_of_a_wrong_size_are_refused() -> None:
    layers = one_scratch()
    for resolution, samples, name in ((0, 4, "resolution"), (4, 0, "samples")):
        with pytest.raises(ValueError, match=f"^{name} of the coverage is 0; expected 1 or more"):
            coverage_maps(layers, resolution, samples)
    for shape in ((1, 6, 6), (1, 4, 8), (8, 8)):
        with pytest.raises(ValueError, match=r"expected \(layers, R, R\), R a power of two"):
            mip_pyramid(np.zeros(shape, np.float32))


# ---- pictures ----------------------------------------------------------------------------------


@pytest.mark.parametrize("spec", [COARSE, replace(WORN, coverage=0.1)])
def test_the_third_stage_is_the_second_thresholded_and_the_layer_itself(spec: LayerSpec) -> None:
    even, stretched, scratches = layer_stages(spec, 3, 64, layer=1)
    assert even.dtype == stretched.dtype == scratches.dtype == np.uint8
    assert set(np.unique(scratches)) == {0, 255}
    threshold = solve_thresholds(spec, 3)[1]
    shown = 255 * threshold / WHITE
    assert stretched[scratches > 0].max() <= math.ceil(shown)
    assert stretched[scratches == 0].min() >= math.floor(shown)
    whole = make_layers(spec, 3)._replace(fading=0.0, breaks=0.0)
    steps = (np.arange(64) + 0.5) / 64
    x, y = np.meshgrid(steps, steps[::-1])
    found, _ = ask(whole, np.ones(64 * 64), np.stack([x, y], axis=-1).reshape(-1, 2))
    assert np.mean((found[:, 0].reshape(64, 64) > 0) != (scratches > 0)) < 1e-3


def test_the_first_stage_is_the_noise_of_a_few_dozen_round_cells() -> None:
    even = layer_stages(COARSE, 3, 96)[0].astype(np.float64) / 255 * WHITE
    # P(F1 > r) = exp(-pi r²): the mean is 1/2.
    assert even.mean() == pytest.approx(0.5, abs=0.1)
    # The way to the nearest feature changes by no more than the step does.
    step = 6 / 96
    assert np.abs(np.diff(even, axis=0)).max() < step + 0.02
    assert np.abs(even[0] - even[-1]).max() < step + 0.02


def test_stages_that_cannot_be_drawn_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^layer of the stages is 3; expected 0 to 2\.$"):
        layer_stages(COARSE, 0, 8, layer=3)
    with pytest.raises(ValueError, match=r"^size of the stages is 0; expected 1 or more\.$"):
        layer_stages(COARSE, 0, 0)


def test_layers_are_drawn_in_the_colours_of_their_directions_y_up() -> None:
    coverage = np.zeros((2, 4, 4), np.float32)
    coverage[0, 0, 1] = coverage[1, 3, 2] = 1.0
    picture = layers_picture(coverage, np.array([0.0, math.pi / 2]))
    assert picture.shape == (4, 4, 3)
    assert picture[3, 1, 0] == 255  # red: along x
    assert picture[0, 2, 1] == picture[0, 2, 2] == 255  # cyan, opposite: along y
    assert (
        picture.astype(int).sum()
        == picture[3, 1].astype(int).sum() + picture[0, 2].astype(int).sum()
    )
    turned = layers_picture(coverage, np.array([math.pi, -math.pi / 2]))
    np.testing.assert_array_equal(turned, picture)
