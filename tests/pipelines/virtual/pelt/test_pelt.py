"""The virtual pelt against closed forms, brute force and the symmetries it must have."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pipelines.geometry import rays
from pipelines.virtual.pelt import prisms
from pipelines.virtual.pelt.hairs import Hairs, grow_hairs
from pipelines.virtual.pelt.pelt import Pelt, make_pelt, photograph_hairs
from pipelines.virtual.pelt.scattering import BACKSCATTER

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
NO_HAIRS = Hairs(*(np.zeros(shape, np.float32) for shape in ((0, 4, 3), (0, 4), (0, 3))))


def generator() -> np.random.Generator:
    return np.random.default_rng(5)


def straight_hair(height: float, radius: float, albedo: tuple[float, float, float]) -> Hairs:
    """One endless horizontal hair along x at y = 1/2: its end meets the next tile's beginning."""
    points = np.stack([np.linspace(0, 1, 5), np.full(5, 0.5), np.full(5, height)], axis=-1)
    return Hairs(
        points[None].astype(np.float32),
        np.full((1, 5), radius, np.float32),
        np.array([albedo], np.float32),
    )


@pytest.fixture(scope="module")
def pelt() -> Pelt:
    return make_pelt(64, 300, 16, 3)


# --------------------------------------------------------------------------------------------
# The pelt as a whole


def test_picture_and_depth_are_well_formed(pelt) -> None:
    assert pelt.radiance.shape == (64, 64, 3)
    assert pelt.depth.shape == (64, 64)
    assert pelt.radiance.dtype == pelt.depth.dtype == np.float32
    for values in pelt:
        assert np.isfinite(values).all()
        assert values.min() >= 0
        assert values.max() <= 1
    assert (pelt.radiance == 1).any(axis=-1).mean() < 0.005
    assert 0.15 < (pelt.radiance @ LUMINANCE).mean() < 0.6
    assert pelt.depth.min() < 0.35
    assert 0.3 < np.median(pelt.depth) < 0.8


def test_equal_arguments_give_equal_bits_and_other_seeds_other_fur() -> None:
    first, again, other = (make_pelt(24, 60, 4, seed) for seed in (1, 1, 2))
    for a, b, c in zip(first, again, other, strict=True):
        np.testing.assert_array_equal(a, b)
        assert np.mean(a != c) > 0.5


def test_progress_rises_to_one() -> None:
    done: list[float] = []
    make_pelt(8, 20, 6, 0, progress=done.append)
    assert len(done) == 6
    assert done[-1] == pytest.approx(1)
    assert all(a < b for a, b in zip([0.0, *done], done, strict=False))


def test_brightness_mostly_falls_with_depth(pelt) -> None:
    """The claim of the fur model; rank correlation in plain NumPy."""
    luminance = (pelt.radiance @ LUMINANCE).ravel()
    hair = pelt.depth.ravel() < 1
    ranks = [np.argsort(np.argsort(a[hair])) for a in (luminance, -pelt.depth.ravel())]
    correlation = np.corrcoef(*ranks)[0, 1]
    assert 0.4 < correlation < 0.99  # not 1: the light has never been told the depth


@pytest.mark.parametrize("arguments", [(0, 10, 1), (8, 0, 1), (8, 10, 0)])
def test_empty_requests_are_refused(arguments) -> None:
    with pytest.raises(ValueError, match="at least 1, found 0"):
        make_pelt(*arguments, seed=0)


# --------------------------------------------------------------------------------------------
# Hairs


def test_hairs_grow_from_the_skin_and_taper() -> None:
    hairs = grow_hairs(500, generator())
    roots = hairs.points[:, 0]
    assert (roots[:, :2] >= 0).all()
    assert (roots[:, :2] < 1).all()
    assert (roots[:, 2] == 0).all()
    assert (hairs.points[:, 1:, 2] > 0).all()
    assert (hairs.radii[:, -1] < 0.3 * hairs.radii.max(axis=1)).all()
    assert (hairs.radii > 0).all()
    assert (hairs.albedo > 0).all()
    assert (hairs.albedo < 1).all()
    assert (np.diff(hairs.albedo, axis=1) < 0).all()  # one hue: red over green over blue


def test_fewer_hairs_are_a_smaller_cut_of_the_same_fur() -> None:
    """The length of a hair times the square root of their number stays."""

    def relative_length(count: int) -> float:
        steps = np.diff(grow_hairs(count, generator()).points, axis=1)
        return float(np.linalg.norm(steps, axis=-1).sum(axis=1).mean()) * math.sqrt(count)

    assert relative_length(400) == pytest.approx(relative_length(6400), rel=0.1)


# --------------------------------------------------------------------------------------------
# Depth


def test_depth_is_the_first_triangle_below_each_pixel(monkeypatch) -> None:
    """Every triangle against vertical rays, in the plane, in float64."""
    meshes = []

    def keep(vertices, triangles):
        meshes.append((np.asarray(vertices, np.float64), triangles))
        return rays.build_scene(vertices, triangles)

    monkeypatch.setattr(prisms, "build_scene", keep)
    size = 48
    depth = photograph_hairs(grow_hairs(40, generator()), size, 1, generator()).depth
    corners = meshes[0][0][meshes[0][1]]
    top = corners[..., 2].max()
    rng = generator()
    agree = 0
    for row, column in rng.integers(0, size, (40, 2)):
        here = np.array([(column + 0.5) / size, 1 - (row + 0.5) / size])
        a, b, c = (corners[:, k, :2] - here for k in range(3))

        def area(p: np.ndarray, q: np.ndarray) -> np.ndarray:
            return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]

        weights = np.stack([area(b, c), area(c, a), area(a, b)], axis=-1)
        total = weights.sum(axis=1)
        weights = weights[total != 0] / total[total != 0, None]
        under = (weights >= 0).all(axis=1)
        heights = (weights * corners[total != 0, :, 2]).sum(axis=1)[under]
        agree += abs(depth[row, column] - (1 - heights.max() / top)) < 1e-4
    assert agree >= 39  # a ray through an edge may go either way in float32
    assert 0.01 < (depth == 1).mean() < 0.99


def test_depth_of_a_lone_hair_is_that_of_its_prism() -> None:
    """A triangular prism with its ridge up: the height falls with slope sqrt(3) from the ridge."""
    size, height, radius = 64, 0.3, 0.1
    picture = photograph_hairs(straight_hair(height, radius, (1, 1, 1)), size, 1, generator())
    away = np.abs((np.arange(size) + 0.5) / size - 0.5)
    top = height + radius
    expected = np.where(away < math.sqrt(3) / 2 * radius, math.sqrt(3) * away / top, 1.0)
    np.testing.assert_allclose(picture.depth, np.repeat(expected[:, None], size, 1), atol=1e-5)
    assert (picture.depth[away > radius] == 1).all()


# --------------------------------------------------------------------------------------------
# Periodicity


def test_moving_the_fur_by_pixels_rolls_the_picture() -> None:
    """The tile has no border: hairs pushed over it come back on the other side."""
    size, down, right = 32, 11, 20
    hairs = grow_hairs(80, generator())
    points = hairs.points.copy()
    roots = points[:, :1, :2]
    shift = (roots + np.array([right, -down]) / size) % 1 - roots
    points[..., :2] += shift
    assert (np.ptp(shift, axis=0) > 0.5).all()  # some did cross the border
    still, moved = (
        photograph_hairs(h, size, 32, generator()) for h in (hairs, hairs._replace(points=points))
    )
    expected = np.roll(still.depth, (down, right), axis=(0, 1))
    assert np.mean(np.abs(moved.depth - expected) > 1e-3) < 0.01
    expected = np.roll(still.radiance, (down, right), axis=(0, 1))
    unrolled = np.abs(moved.radiance - still.radiance).mean()
    assert np.abs(moved.radiance - expected).mean() < 0.4 * unrolled  # Monte Carlo noise is left


def test_no_seam_at_the_border() -> None:
    """Neighbours across the border differ as much as neighbours inside."""
    pelt = make_pelt(96, 400, 8, 4)
    for picture in (pelt.radiance @ LUMINANCE, pelt.depth):
        for axis in (0, 1):
            step = np.abs(picture - np.roll(picture, 1, axis=axis)).mean(axis=1 - axis)
            inside = step[1:]
            assert abs(step[0] - inside.mean()) < 4 * inside.std()


# --------------------------------------------------------------------------------------------
# Light


@pytest.mark.parametrize("exponent", [0.0, 2.0, 20.0])
def test_open_white_skin_has_radiance_one(exponent) -> None:
    picture = photograph_hairs(
        NO_HAIRS, 32, 16, generator(), source_exponent=exponent, skin_albedo=(1, 0.5, 0.25)
    )
    np.testing.assert_allclose(picture.radiance.mean(axis=(0, 1)), (1, 0.5, 0.25), rtol=5e-3)
    assert (picture.depth == 1).all()


def test_lone_hair_has_the_closed_form_of_its_scattering() -> None:
    """Fibre across the view, cos^2 source, light from the upper half only.

    With t from the fibre and p about it, cos(zenith) = sin t cos p: the integral of
    2 cos^2(zenith) (1 + g cos p) sin t is 2 (3 pi / 8) (pi / 2 + 4 g / 3), over pi^2.
    """
    albedo = (0.9, 0.6, 0.3)
    picture = photograph_hairs(
        straight_hair(0.3, 0.08, albedo), 64, 32, generator(), source_exponent=2, bounces=0
    )
    ridge = picture.radiance[30:34].mean(axis=(0, 1))
    expected = np.array(albedo) * (3 / 8 + BACKSCATTER / math.pi)
    np.testing.assert_allclose(ridge, expected, rtol=0.01)


def test_shadow_of_a_lone_hair_has_its_closed_form() -> None:
    """All skin is equally deep, yet darker near the hair: brightness is not made from depth.

    An endless strip between the angles a1 and a2 from the zenith, in the plane across it, takes
    3/4 (S(a2) - S(a1)), S = sin - sin^3 / 3, of what a cos^2 source sends to the skin.
    """
    size, height, radius = 64, 0.15, 0.06
    picture = photograph_hairs(
        straight_hair(height, radius, (0, 0, 0)),
        size,
        64,
        generator(),
        source_exponent=2,
        bounces=0,
        skin_albedo=(1, 1, 1),
    )
    y = 1 - (np.arange(size) + 0.5) / size - 0.5
    corner = math.pi / 2 + 2 * math.pi * np.arange(3) / 3
    blocked = np.zeros(size)
    for tile in (-1, 0, 1):
        across = radius * np.cos(corner) + tile - y[:, None]
        sine = np.sin(np.arctan2(across, height + radius * np.sin(corner)))
        s = sine - sine**3 / 3
        blocked += 0.75 * (s.max(axis=1) - s.min(axis=1))
    # The lens spreads the hair over its neighbours; far from it the next tile's counts as well.
    open_skin = (np.abs(y) > radius + 3 / size) & (np.abs(y) < 0.4)
    assert (picture.depth[open_skin] == 1).all()
    found = picture.radiance[..., 0].mean(axis=1)[open_skin]
    np.testing.assert_allclose(found, 1 - blocked[open_skin], atol=0.01)
    assert np.ptp(found) > 0.1


def test_white_fur_under_an_even_sky_vanishes() -> None:
    """The furnace: where nothing absorbs, what is as bright as its surroundings stays so."""
    hairs = grow_hairs(30, generator())
    # Thin: light that has to find its way out of dense white fur takes hundreds of bounces.
    white = hairs._replace(albedo=np.ones_like(hairs.albedo), radii=0.1 * hairs.radii)
    means = []
    for bounces in (0, 2, 25):
        picture = photograph_hairs(
            white,
            24,
            64,
            generator(),
            source_exponent=0,
            bounces=bounces,
            skin_albedo=(1, 1, 1),
        )
        means.append(picture.radiance.mean())
    assert means[0] < means[1] < means[2]
    assert means[1] < 0.95
    assert means[2] == pytest.approx(1, abs=0.015)


def test_nothing_is_brighter_than_the_source() -> None:
    hairs = grow_hairs(150, generator())
    white = hairs._replace(albedo=np.ones_like(hairs.albedo))
    for exponent in (0.0, 2.0):
        picture = photograph_hairs(
            white, 24, 64, generator(), source_exponent=exponent, skin_albedo=(1, 1, 1)
        )
        assert picture.radiance.max() < (exponent + 2) / 2 * 1.1  # a tenth for the noise
        assert picture.radiance.mean() < 1


def test_another_source_changes_the_light_and_not_the_depth() -> None:
    hairs = grow_hairs(150, generator())
    wide, narrow = (
        photograph_hairs(hairs, 32, 32, generator(), source_exponent=n, bounces=0)
        for n in (0.0, 60.0)
    )
    np.testing.assert_array_equal(wide.depth, narrow.depth)

    def correlation(picture: Pelt) -> float:
        ranks = [
            np.argsort(np.argsort(a.ravel()))
            for a in (picture.radiance @ LUMINANCE, -picture.depth)
        ]
        return float(np.corrcoef(*ranks)[0, 1])

    # Light along the view reaches whatever is seen; light from all round has to find its way in.
    assert correlation(narrow) < correlation(wide) - 0.1
