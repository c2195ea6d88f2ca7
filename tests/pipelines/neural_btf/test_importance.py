"""Directions drawn from a table: their density by chi-square, sums, and a closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chisquare

from pipelines.light.directions import unit_vectors
from pipelines.neural_btf.importance import (
    LIGHT_CELLS,
    VIEW_CELLS,
    ImportanceTable,
    importance_table,
)
from pipelines.neural_btf.material import FlatColour

VIEWS = unit_vectors(np.radians([[3, 10], [40, 130], [62, -70], [88, 20]]))
DRAWN = 40_000


class Glossy:
    """V = cos (0.2 + 8 max(h . z', 0)^60), half vectors about a normal that differs by place."""

    def radiance_at(self, places, light, view, footprint=None):  # type: ignore[no-untyped-def]
        """Grey (n, 3)."""
        across, along = np.sin(6.28 * places[:, 0]), np.cos(6.28 * places[:, 1])
        normal = np.stack([0.3 * across, 0.3 * along, np.ones_like(across)], axis=-1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        half = light + view
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        shine = 8 * np.maximum(np.sum(half * normal, axis=1), 0) ** 60
        return (light[:, 2] * (0.2 + shine))[:, None] * np.ones(3, np.float32)


@pytest.fixture(scope="module")
def table() -> ImportanceTable:
    return importance_table(Glossy())


def grid(steps: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middles of cells of the sphere, (n, 3), even in z and azimuth, and their solid angle."""
    z, phi = np.meshgrid(
        (np.arange(2 * steps) + 0.5) / steps - 1,
        (np.arange(4 * steps) + 0.5) * (2 * math.pi / (4 * steps)),
        indexing="ij",
    )
    sine = np.sqrt(1 - z**2)
    ways = np.stack([sine * np.cos(phi), sine * np.sin(phi), z], axis=-1).reshape(-1, 3)
    return ways, np.full(len(ways), 4 * math.pi / len(ways))


def uniforms(seed: int) -> NDArray[np.float64]:
    return np.random.default_rng(seed).random((DRAWN, 2))


@pytest.mark.parametrize("number", range(len(VIEWS)))
def test_the_density_is_one_in_all_and_none_below(table: ImportanceTable, number: int) -> None:
    ways, solid = grid(300)
    view = np.broadcast_to(VIEWS[number], ways.shape)
    density = table.pdf(ways, view)
    assert (density * solid).sum() == pytest.approx(1.0, abs=3e-3)
    assert (density[ways[:, 2] < 0] == 0).all()
    assert (density[ways[:, 2] > 0] > 0).all()


@pytest.mark.parametrize("number", range(len(VIEWS)))
def test_samples_are_those_of_the_density(table: ImportanceTable, number: int) -> None:
    """By chi-square, in cells that are none of the table's; the null: those of another view."""
    view = VIEWS[number : number + 1]
    drawn = table.sample(np.repeat(view, DRAWN, axis=0), uniforms(number))
    np.testing.assert_allclose(np.linalg.norm(drawn, axis=1), 1, atol=1e-12)
    assert (drawn[:, 2] >= 0).all()
    ways, solid = grid(300)
    edges = np.linspace(0, 1, 8), np.linspace(-math.pi, math.pi, 14)

    def shares(vectors: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        azimuth = np.arctan2(vectors[:, 1], vectors[:, 0])
        return np.histogram2d(vectors[:, 2], azimuth, bins=edges, weights=weights)[0].ravel()

    up = ways[:, 2] > 0
    found = shares(drawn, np.ones(DRAWN))
    p_values = []
    for seen in (view, VIEWS[number - 1 : number] if number else VIEWS[1:2]):
        density = table.pdf(ways[up], np.repeat(seen, up.sum(), axis=0))
        expected = shares(ways[up], density * solid[up])
        p_values.append(chisquare(found, expected / expected.sum() * DRAWN).pvalue)
    assert p_values[0] > 0.001
    assert p_values[1] < 1e-9


def test_of_a_matt_colour_directions_are_by_the_cosine() -> None:
    table = importance_table(FlatColour((0.3, 0.3, 0.3)))
    np.testing.assert_allclose(table.shares, 1 / 288, rtol=1e-2)  # held at the horizon
    ways, _ = grid(20)
    view = np.broadcast_to(VIEWS[1], ways.shape)
    expected = np.maximum(ways[:, 2], 0) / math.pi
    np.testing.assert_allclose(table.pdf(ways, view), expected, rtol=1e-2)
    drawn = table.sample(np.repeat(VIEWS[1:2], DRAWN, axis=0), uniforms(0))
    assert drawn[:, 2].mean() == pytest.approx(2 / 3, abs=0.006)


def test_a_table_that_is_drawn_from_finds_what_is_reflected(table: ImportanceTable) -> None:
    """The mean of V / (pi density) against a sum over the sphere, and with less variance than by
    the cosine."""
    view, place = VIEWS[1], np.array([[0.1, 0.2]])
    ways, solid = grid(300)
    up = ways[:, 2] > 0

    def values(light: NDArray[np.float64]) -> NDArray[np.float64]:
        seen = np.repeat(view[None], len(light), axis=0)
        return Glossy().radiance_at(np.repeat(place, len(light), axis=0), light, seen)[:, 0]

    expected = (values(ways[up]) * solid[up]).sum() / math.pi
    seen = np.repeat(view[None], DRAWN, axis=0)
    light = table.sample(seen, uniforms(5))
    terms = values(light) / (math.pi * table.pdf(light, seen))
    assert terms.mean() == pytest.approx(expected, abs=4.5 * terms.std() / math.sqrt(DRAWN))
    even = ImportanceTable(np.full((*VIEW_CELLS, *LIGHT_CELLS), 1 / 288, np.float32))
    light = even.sample(seen, uniforms(6))
    by_cosine = values(light) / (math.pi * even.pdf(light, seen))
    assert terms.var() < 0.5 * by_cosine.var()


def test_numbers_at_the_ends_of_the_interval_are_drawn(table: ImportanceTable) -> None:
    ends = np.array([[0.0, 0.0], [1 - 1e-16, 1 - 1e-16], [0.0, 1 - 1e-16]])
    view = np.repeat(VIEWS[2:3], 3, axis=0)
    light = table.sample(view, ends)
    assert np.isfinite(light).all()
    assert (table.pdf(light, view) >= 0).all()
