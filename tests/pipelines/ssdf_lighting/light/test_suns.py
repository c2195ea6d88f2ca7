"""Suns taken out of maps, and the penumbra of what they become, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.light.built_in_environments import lamps, sky, uniform
from pipelines.light.environment_maps import rotate_environment, solid_angles
from pipelines.ssdf_lighting.distances.edge_share import edge_share
from pipelines.ssdf_lighting.light.spherical_gaussians import (
    integral,
    visible_integral,
    visible_share,
    visible_table,
)
from pipelines.ssdf_lighting.light.suns import SUN_RADIUS, sharpness_of_disc, split_suns

Array = NDArray[np.float64]
SUN = {"sun_azimuth": 33.3, "sun_elevation": 41.7}


def towards(azimuth: float, elevation: float) -> Array:
    a, e = math.radians(azimuth), math.radians(elevation)
    return np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])


def flux_of_map(light: NDArray[np.floating]) -> Array:
    return np.einsum("h,hwc->c", solid_angles(len(light)), light.astype(np.float64))


def disc_share(offset: Array) -> Array:
    """Share of a disc of radius 1 on the lit side of a straight edge ``offset`` from its middle."""
    x = np.clip(offset, -1.0, 1.0)
    return 0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / math.pi


@pytest.mark.parametrize("height", [128, 512, 1024])
def test_a_sun_of_half_a_degree_keeps_place_flux_and_colour(height: int) -> None:
    with_sun = sky(height, **SUN, sun_radius=0.2665)
    found = split_suns(with_sun, 4)
    assert len(found.suns.sharpness) == 1
    off = math.degrees(math.acos(min(float(found.suns.axes[0] @ towards(33.3, 41.7)), 1.0)))
    assert off < 0.25 * 180 / height
    flux = integral(found.suns.sharpness)[:, None] * found.suns.amplitudes
    np.testing.assert_allclose(flux[0] + flux_of_map(found.rest), flux_of_map(with_sun), rtol=1e-6)
    # By its definition: 5 times the luminance of the dome's irradiance on the ground, of which
    # 1.0 of mean luminance over the half sphere gives about pi.
    assert 2.5 * math.pi < flux[0].mean() < 6.5 * math.pi
    assert found.rest.max() < 0.01 * with_sun.max()


def test_the_width_is_that_of_the_disc_or_of_the_texels() -> None:
    wide = split_suns(sky(1024, **SUN, sun_radius=1.2), 1).suns.sharpness[0]
    # Its edge is soft from 0.8 of the radius on: as wide as a disc of about 0.9.
    assert sharpness_of_disc(math.radians(1.2)) < wide < sharpness_of_disc(math.radians(0.96))
    texel = math.pi / 128
    coarse = split_suns(sky(128, **SUN, sun_radius=0.2665), 1).suns.sharpness[0]
    assert 12.0 / (5.0 * texel**2) < coarse <= 12.0 / texel**2
    fine = split_suns(sky(2048, **SUN, sun_radius=0.2), 1).suns.sharpness[0]
    assert fine == sharpness_of_disc(SUN_RADIUS)


def test_two_suns_come_brightest_first_wherever_the_map_begins() -> None:
    light = uniform(256).copy()
    light[100, 3:5] = 9e5
    light[60, 200] = 4e5
    for turn in (0.0, 2.0, -45.0):
        found = split_suns(rotate_environment(light, turn), 8)
        flux = (integral(found.suns.sharpness)[:, None] * found.suns.amplitudes).mean(axis=1)
        assert len(flux) == 2
        assert flux[0] > flux[1]
        np.testing.assert_allclose(found.rest, 1.0, rtol=1e-6)


@pytest.mark.parametrize(
    "light", [lamps(256), uniform(64), lamps(16)], ids=["lamps", "even", "few"]
)
def test_what_is_wide_is_no_sun(light: NDArray[np.float32]) -> None:
    found = split_suns(light, 8)
    assert found.suns.axes.shape == (0, 3)
    np.testing.assert_array_equal(found.rest, light)


def test_no_more_than_asked_for() -> None:
    assert len(split_suns(sky(256, **SUN), 0).suns.sharpness) == 0


def test_the_penumbra_is_that_of_the_disc() -> None:
    """Behind a half plane: the same width, and nowhere off by more than 4.5 % of the sun."""
    sharp = sharpness_of_disc(SUN_RADIUS)
    offset = np.linspace(-3.0, 3.0, 241)
    true = disc_share(offset)
    for found in (
        visible_integral(offset * SUN_RADIUS, sharp) / integral(sharp),
        visible_share(visible_table(), offset * SUN_RADIUS, sharp),
        edge_share(offset * SUN_RADIUS, sharp),
    ):
        assert np.abs(found - true).max() < 0.045
        # The variance of the edge's profile, of the derivative: a² / 4.
        steps = np.diff(found)
        middles = 0.5 * (offset[1:] + offset[:-1])
        assert float(steps @ middles**2) == pytest.approx(0.25, rel=0.05)
    # A null: lights that were the sharpest before are far off.
    blunt = visible_integral(offset * SUN_RADIUS, 300.0) / integral(300.0)
    assert np.abs(blunt - true).max() > 0.3
