"""Evaluate, sample and pdf against each other, quadrature and the laws of a BSDF."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from pipelines.glass_scratches.figures import sampler_p_value
from pipelines.glass_scratches.tables import sampling
from pipelines.glass_scratches.tables.fresnel import fresnel_factors
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.lobe import Direction, Lobe, make_lobe
from pipelines.glass_scratches.tables.paper_table import paper_bsdf_table
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table

Floats = NDArray[np.float64]

BINS, INDEX, PLACE = 16, 1.5, 5
WALLS = ["paper", "even", "ground", "clear"]
VIEWS = [(0.0, 0.0, 1.0), (0.6, 0.5, 1.0), (-0.4, 0.3, -1.0), (0.9, -0.2, -1.0)]
"""theta along the scratch, phi across it, radians; outside or inside. The last one leans by more
than 1."""


@functools.cache
def lobe(walls: str, albedo: float = 1.0) -> Lobe:
    profile = built_in_profile("v", 10.0, 4.0)
    if walls == "paper":
        table = scratch_brdf_table(profile, bins=BINS, albedo=albedo, facets=60)
        factors = fresnel_factors(BINS, INDEX, "paper")
        return make_lobe(paper_bsdf_table(table, factors, INDEX))
    roughness = {"even": 1.0, "ground": 0.5, "clear": 0.0}[walls]
    return make_lobe(
        glass_table(
            profile,
            bins=BINS,
            index=INDEX,
            roughness=roughness,
            albedo=albedo,
            facets=60,
            rays=4000,
        )
    )


def direction(theta: float, phi: float, side: float) -> Direction:
    across = np.cos(theta)
    return Direction(np.sin(theta), across * np.sin(phi), side * across * np.cos(phi))


@njit
def _values(
    table: Lobe, place: int, view: Direction, lights: Floats, parts: Floats, density: Floats
) -> None:
    for i in range(len(lights)):
        light = Direction(lights[i, 0], lights[i, 1], lights[i, 2])
        parts[i] = sampling.evaluate(table, place, view, light)
        density[i] = sampling.pdf(table, place, view, light)


def values(table: Lobe, view: Direction, lights: Floats) -> tuple[Floats, Floats]:
    parts, density = np.empty(len(lights)), np.empty(len(lights))
    _values(table, PLACE, view, lights, parts, density)
    return parts, density


@njit
def _samples(table: Lobe, view: Direction, numbers: Floats, found: Floats) -> None:
    for i in range(len(numbers)):
        four = (numbers[i, 0], numbers[i, 1], numbers[i, 2], numbers[i, 3])
        found[i] = sampling.sample(table, PLACE, view, four)


def samples(table: Lobe, view: Direction, count: int) -> Floats:
    found = np.empty((count, 3))
    _samples(table, view, np.random.default_rng(3).random((count, 4)), found)
    return found


@pytest.mark.parametrize("walls", WALLS)
def test_samples_fall_as_the_pdf_has_them(walls: str) -> None:
    assert sampler_p_value(lobe(walls)) > 1e-4


def test_a_wrong_sampler_is_found_out() -> None:
    right = lobe("even")
    skewed = right._replace(cdf=(right.cdf.astype(np.float64) ** 1.1).astype(np.float32))
    assert sampler_p_value(skewed) < 1e-6


@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("view", VIEWS)
def test_the_weight_of_a_sample_is_the_share(walls: str, view: tuple[float, float, float]) -> None:
    """Without absorption 1, up to float32: by Eq. 5 only the light is left to look up."""
    table, towards = lobe(walls), direction(*view)
    lights = samples(table, towards, 400)
    assert np.allclose(np.linalg.norm(lights, axis=1), 1.0)
    parts, density = values(table, towards, lights)
    assert (density > 0).all()
    np.testing.assert_allclose(parts / density, 1.0, rtol=2e-3)


@pytest.mark.parametrize("walls", WALLS)
@pytest.mark.parametrize("view", VIEWS)
def test_in_even_light_a_view_gets_what_walls_do_not_keep(
    walls: str, view: tuple[float, float, float]
) -> None:
    """By directions drawn evenly over the sphere, not by the sampler; walls that keep the lean are
    asked in a narrow band around it."""
    table, towards = lobe(walls), direction(*view)
    rng = np.random.default_rng(1)
    count = 400_000
    u = rng.uniform(-1, 1, count)
    whole = 4 * np.pi
    total = 0.0
    for side in (1.0, -1.0):
        scale = 1.0 if side > 0 else INDEX
        if table.keeps:
            lean = -towards.u * (1.0 if towards.n > 0 else INDEX) + rng.uniform(-0.06, 0.06, count)
            inside = np.abs(lean) < scale
            u = np.where(inside, lean / scale, 0.0)
            whole = 0.12 / scale * 2 * np.pi
        turn = rng.uniform(0, np.pi, count)
        across = np.sqrt(1 - u * u)
        lights = np.stack([u, across * np.cos(turn), side * across * np.sin(turn)], axis=1)
        parts = values(table, towards, lights)[0]
        if table.keeps:
            parts = np.where(inside, parts, 0.0)
        total += parts.mean() * whole / 2
    assert total == pytest.approx(1.0, abs=0.02)


def test_grey_walls_keep_a_part() -> None:
    for walls in ("even", "clear"):
        for view in VIEWS[:3]:
            towards = direction(*view)
            lights = samples(lobe(walls, 0.6), towards, 200)
            parts, density = values(lobe(walls, 0.6), towards, lights)
            assert 0.2 < (parts / density).mean() < 0.95


def test_light_and_view_may_be_swapped() -> None:
    """f / n² of walls of glass: evaluate is f cos, over n² of the light's side."""
    table = lobe("even")
    means = table._replace(rho=table.rho.mean(axis=1, keepdims=True).repeat(16, axis=1))
    rng = np.random.default_rng(2)
    ways = rng.normal(size=(60, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    f = np.empty((60, 60))
    for row, way in enumerate(ways):
        f[row] = values(means, Direction(*way), ways)[0]
    squared = np.where(ways[:, 2] > 0, 1.0, INDEX**2)
    f /= np.abs(ways[:, 2]) * squared
    np.testing.assert_allclose(f, f.T, rtol=1e-4)


def test_clear_walls_turn_the_lean_over() -> None:
    for view in VIEWS[:3]:
        towards = direction(*view)
        lights = samples(lobe("clear"), towards, 300)
        scale = np.where(lights[:, 2] > 0, 1.0, INDEX)
        lean = towards.u * (1.0 if towards.n > 0 else INDEX)
        assert np.abs(lights[:, 0] * scale + lean).max() < 0.05  # five deviations of the blur


def test_walls_that_scatter_evenly_forget_the_lean() -> None:
    """What is seen of a light does not depend on the view's theta."""
    table = lobe("even")
    lights = np.array([direction(0.3, 0.2, 1.0), direction(-0.5, 0.4, -1.0)])
    one, other = (values(table, direction(theta, 0.1, 1.0), lights)[0] for theta in (0.0, 1.2))
    np.testing.assert_allclose(one, other, rtol=1e-6)
