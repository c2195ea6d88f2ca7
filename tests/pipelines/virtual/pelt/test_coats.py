"""Pelts on bodies against closed forms and against the photograph from above."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest

from pipelines.virtual.pelt.coats import (
    RADII,
    Body,
    View,
    bent,
    make_coat,
    oblique_view,
    photograph_coat,
)
from pipelines.virtual.pelt.hairs import Hairs, grow_hairs
from pipelines.virtual.pelt.pelt import SKIN_ALBEDO, photograph_hairs
from pipelines.virtual.pelt.scattering import Source

BODIES: tuple[Body, ...] = get_args(Body)
BARE = Hairs(*(np.zeros(shape, np.float32) for shape in ((0, 4, 3), (0, 4), (0, 3))))


def generator() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.mark.parametrize("body", BODIES)
def test_bending_keeps_heights_and_the_distance_from_the_middle(body: Body) -> None:
    random = generator()
    flat = random.uniform(-0.6, 0.6, (200, 3)) * (1, 0, 1)
    there = bent(flat, body)
    along = np.linspace(0, 1, 2001)[:, None, None] * flat * (1, 1, 0)
    lengths = np.linalg.norm(np.diff(bent(along, body), axis=0), axis=-1).sum(axis=0)
    np.testing.assert_allclose(lengths, np.abs(flat[:, 0]), atol=1e-6)
    foot = bent(flat * (1, 1, 0), body)
    np.testing.assert_allclose(np.linalg.norm(there - foot, axis=1), np.abs(flat[:, 2]))


@pytest.mark.parametrize("body", BODIES)
def test_normals_point_away_from_the_skin_and_triangles_agree(body: Body) -> None:
    skin = make_coat(BARE, body).skin
    a, b, c = skin.vertices[skin.triangles].swapaxes(0, 1)
    faces = np.cross(b - a, c - a)
    outward = np.einsum("ni,ni->n", faces, skin.normals[skin.triangles].sum(axis=1))
    assert (outward > 0).mean() > 0.995  # at a sphere's rim corners fall together
    np.testing.assert_allclose(np.linalg.norm(skin.normals, axis=1), 1.0)


def test_a_bare_sphere_is_lambertian() -> None:
    """Under a distant lamp: albedo times the cosine, and nothing on the other side."""
    view, size = oblique_view("sphere", 40.0, 30.0), 32
    lamp = np.array([0.6, 0.0, 0.8])
    coat = make_coat(BARE, "sphere")
    seen, covered = photograph_coat(
        coat, view, (size, size), 64, Source(tuple(lamp), 4000.0), generator(), bounces=0
    )
    place = ((np.arange(size) + 0.5) / size - 0.5) * view.height
    right = np.cross(view.up, view.towards)
    flat = place[None, :, None] * right + -place[:, None, None] * np.array(view.up)
    beside = np.sum(flat**2, axis=-1)
    radius = RADII["sphere"]
    toward = np.sqrt(np.maximum(radius**2 - beside, 0))
    normals = (flat + toward[..., None] * np.array(view.towards)) / radius
    expected = np.maximum(normals @ lamp, 0)[..., None] * SKIN_ALBEDO
    inside = beside < (0.9 * radius) ** 2
    np.testing.assert_allclose(seen[inside], expected[inside], atol=0.02)
    assert covered[inside].min() == 1
    assert covered[beside > (1.1 * radius) ** 2].max() == 0


def test_from_straight_above_a_plane_is_the_tile() -> None:
    hairs, size = grow_hairs(2000, generator()), 40
    above = photograph_hairs(hairs, size, 256, generator())
    view = View((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.5, 0.5, 0.0), 1.0)
    seen, covered = photograph_coat(
        make_coat(hairs, "plane"), view, (size, size), 256, Source(), generator()
    )
    assert covered.min() == 1
    assert float(seen.mean()) == pytest.approx(float(above.radiance.mean()), rel=0.02)
    both = np.corrcoef(seen[..., 1].ravel(), above.radiance[..., 1].ravel())[0, 1]
    aside = np.roll(above.radiance[..., 1], 7, axis=1)
    shifted = np.corrcoef(seen[..., 1].ravel(), aside.ravel())[0, 1]
    assert both > 0.9 > 0.7 > shifted


@pytest.mark.parametrize("body", BODIES)
def test_hair_covers_the_skin_and_stands_out(body: Body) -> None:
    coat = make_coat(grow_hairs(400, generator()), body)
    view = oblique_view(body, 50.0, -60.0)
    lit, covered = photograph_coat(coat, view, (24, 32), 8, Source(view.towards, 60.0), generator())
    away = tuple(-part for part in view.towards)
    dark, _ = photograph_coat(coat, view, (24, 32), 8, Source(away, 60.0), generator())
    assert lit.mean() > 3 * dark.mean()
    bare, _ = photograph_coat(
        make_coat(BARE, body), view, (24, 32), 8, Source(view.towards, 60.0), generator()
    )
    assert abs(lit - bare).mean() > 0.1 * bare.mean()
    if body == "sphere":
        alone = math.pi * RADII["sphere"] ** 2 / (view.height**2 * 4 / 3)
        outer = math.pi * (RADII["sphere"] + coat.thickness) ** 2 / (view.height**2 * 4 / 3)
        assert alone < covered.mean() < outer
