"""Swept yarns: closed surfaces whose normals and fibres are those of geometry."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.virtual.cloth.yarns import ply_outline, smooth_noise, sweep, wind_pattern

RADIUS = 0.1


def straight(corners: int, *, turns: float = 0.0, flatness: float = 1.0) -> object:
    steps = 40
    centres = np.zeros((1, steps, 3))
    centres[0, :, 0] = np.arange(steps) / steps
    radii = np.full((1, steps, corners), RADIUS)
    return sweep(centres, radii, period=(1.0, 0.0, 0.0), turns=turns, flatness=flatness)


def volume(positions: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (positions.reshape(-1, 3)[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_straight_yarn_is_a_cylinder() -> None:
    tubes = straight(64)
    radial = tubes.positions * (0, 1, 1) / RADIUS
    np.testing.assert_allclose(tubes.normals, radial, atol=1e-12)
    np.testing.assert_allclose(tubes.fibres, np.broadcast_to([1.0, 0, 0], radial.shape), atol=1e-12)
    # Open ends at x = 0 and 1: their fans to the origin add nothing and a third of the volume.
    assert volume(tubes.positions, tubes.triangles()) == pytest.approx(
        2 / 3 * np.pi * RADIUS**2, rel=0.01
    )


def test_twisted_fibres_are_helices() -> None:
    turns = 3.0
    tubes = straight(256, turns=turns)
    slope = np.linalg.norm(tubes.fibres[..., 1:], axis=-1) / tubes.fibres[..., 0]
    np.testing.assert_allclose(slope, 2 * np.pi * RADIUS * turns, rtol=1e-3)


def test_flat_yarn_is_an_ellipse() -> None:
    tubes = straight(64, flatness=0.4)
    y, z = tubes.positions[..., 1], tubes.positions[..., 2]
    np.testing.assert_allclose((y / RADIUS) ** 2 + (z / (0.4 * RADIUS)) ** 2, 1, rtol=1e-9)


def test_last_ring_is_the_first_one_a_period_on() -> None:
    rng = np.random.default_rng(0)
    centres = 0.01 * smooth_noise(rng, (3, 30, 3), (2.0, 0.0))
    centres[..., 0] += np.arange(30) / 30
    radii = 0.1 + 0.01 * smooth_noise(rng, (3, 30, 12), (2.0, 1.0))
    tubes = sweep(centres, radii, period=(1.0, 0.0, 0.0), turns=2)
    np.testing.assert_array_equal(tubes.positions[:, -1], tubes.positions[:, 0] + (1, 0, 0))
    np.testing.assert_array_equal(tubes.normals[:, -1], tubes.normals[:, 0])
    # The seam is no place of its own: moving the start moves everything along.
    moved = np.roll(centres, -7, axis=1)
    moved[:, -7:, 0] += 1
    again = sweep(moved, np.roll(radii, -7, axis=1), period=(1.0, 0.0, 0.0), turns=2)
    np.testing.assert_allclose(again.normals[:, 0], tubes.normals[:, 7], atol=1e-9)


def test_noise_has_its_variance_and_is_periodic() -> None:
    noise = smooth_noise(np.random.default_rng(1), (40, 200, 30), (5.0, 2.0))
    assert noise.mean() == pytest.approx(0, abs=0.05)
    assert noise.std() == pytest.approx(1, abs=0.03)
    step = np.diff(noise, axis=1).std()
    assert (noise[:, 0] - noise[:, -1]).std() == pytest.approx(step, rel=0.1)
    # A Gaussian filter of deviation s leaves the autocorrelation exp(-d^2 / (4 s^2)).
    near = (noise * np.roll(noise, 5, axis=1)).mean()
    assert near == pytest.approx(np.exp(-25 / (4 * 25)), abs=0.05)
    apart = smooth_noise(np.random.default_rng(1), (2, 400), (3.0,))
    assert abs(np.corrcoef(apart)[0, 1]) < 0.4


def test_winding_by_whole_turns() -> None:
    pattern = smooth_noise(np.random.default_rng(2), (1, 48, 24), (0.0, 2.0))
    pattern[:] = pattern[:, :1]
    wound = wind_pattern(pattern, 2)
    np.testing.assert_allclose(wound[:, 0], pattern[:, 0])
    np.testing.assert_allclose(wound[:, 24], pattern[:, 0], atol=1e-12)  # one turn on
    np.testing.assert_allclose(wound[0, 6], np.roll(pattern[0, 0], 6), atol=1e-12)


@pytest.mark.parametrize("plies", [1, 2, 3, 4])
def test_plies_are_circles(plies: int) -> None:
    outline = ply_outline(plies, 240, 0.6)
    assert outline.max() == pytest.approx(1)
    assert outline.min() > 0
    np.testing.assert_allclose(outline, np.roll(outline, 240 // plies), atol=1e-12)
    if plies > 1:  # every point lies 0.6 from the middle of its ply
        angle = 2 * np.pi * np.arange(240) / 240
        points = outline * np.exp(1j * angle)
        middles = 0.4 * np.exp(2j * np.pi * np.arange(plies) / plies)
        nearest = abs(points[:, None] - middles).min(axis=1)
        np.testing.assert_allclose(nearest, 0.6, rtol=1e-9)
