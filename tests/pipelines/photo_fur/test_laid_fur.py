"""Fur laid in patches: figures against plane geometry, pictures against the photograph itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb
from pipelines.drawing.stage import Stage, orbit
from pipelines.geometry.shapes import sphere, square
from pipelines.photo_fur import figures
from pipelines.photo_fur.laid_fur import (
    BEND,
    FEWEST_SHELLS,
    MOST_SHELLS,
    Hair,
    LaidFur,
    Wind,
    laid_fur,
    laid_surface,
    middle_depth,
    shells_seen,
)
from pipelines.photo_fur.laying import Body, Laying, Piece, choose_patches, lay
from pipelines.photo_fur.photograph import FurPhotograph, fur_photograph
from pipelines.photo_fur.stage_view import FurLight, fur_texture

EAST = np.array([1.0, 0.0, 0.0])
LAYERS = 12


def photograph() -> FurPhotograph:
    """Streaks along x, brown, of all brightnesses."""
    rows = np.random.default_rng(0).random((64, 1))
    grey = (
        0.08 + 0.8 * np.repeat(rows, 64, axis=1) + 0.02 * np.random.default_rng(1).random((64, 64))
    )
    return fur_photograph((grey[..., None] * [0.9, 0.7, 0.5]).astype(np.float32))


def flat_laying(directions: NDArray[np.floating]) -> tuple[NDArray[np.float64], Laying]:
    mesh = square(16)
    places = np.random.default_rng(2).uniform(0.3, 0.7, (len(directions), 2))
    tangents = np.tile(EAST, (len(mesh.vertices), 1))
    body = Body(mesh.vertices, mesh.triangles, tangents, mesh.normals)
    patches = choose_patches(body, Piece(places, directions), spacing=0.25)
    return mesh.vertices, lay(body, patches, spacing=0.25, width=1.0)


def flat_fur(points: NDArray[np.float64], laying: Laying) -> LaidFur:
    """Hair to the east on a plane."""
    count = len(points)
    hair = Hair(np.tile(EAST, (count, 1)), np.ones(count))
    return laid_fur(points, np.tile([0.0, 0.0, 1.0], (count, 1)), hair, laying, 0.05, LAYERS)


def test_weighted_median_is_that_of_repeated_values() -> None:
    random = np.random.default_rng(3)
    values, times = random.random(40), random.integers(1, 9, 40)
    repeated = np.sort(np.repeat(values, times))
    found = figures.weighted_median(values, times.astype(float))
    assert found in (repeated[(len(repeated) - 1) // 2], repeated[len(repeated) // 2])


def test_guide_error_is_the_angle_and_a_right_one_for_hair_that_lies_anyhow() -> None:
    guides = np.random.default_rng(4).standard_normal((4000, 3)) * [1, 1, 0]
    angle = np.radians(20)
    turned = guides @ np.array(
        [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    unit = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    assert figures.guide_error(guides, unit) == pytest.approx(20)
    anyhow = np.random.default_rng(5).permutation(unit)
    assert figures.guide_error(guides, anyhow) == pytest.approx(90, abs=4)


def test_a_plane_has_hairs_of_one_width_along_the_lie() -> None:
    points, laying = flat_laying(np.full(50, 0.3))
    tangents = np.tile(EAST, (len(points), 1))
    lies, sure = np.full((64, 64), 0.3), np.ones((64, 64))
    assert figures.strand_scale_spread(points, laying) == pytest.approx(1, abs=1e-4)
    assert figures.laid_lie_error(points, tangents, laying, lies, sure) < 0.01
    _, anyhow = flat_laying(np.random.default_rng(6).uniform(0, 2 * np.pi, 50))
    assert figures.laid_lie_error(points, tangents, anyhow, lies, sure) > 45


def test_widths_of_hair_are_told_apart() -> None:
    points, laying = flat_laying(np.zeros(50))
    stretched = points * [1, 1, 1]
    stretched[points[:, 0] > points[:, 0].mean(), 1] *= 4
    assert figures.strand_scale_spread(stretched, laying) == pytest.approx(2, rel=0.1)


def drawn(light: FurLight, elevation: float, photo: FurPhotograph) -> NDArray[np.float64]:
    """Linear radiance (y, x, 3) of a flat fur, nothing beside it."""
    points, laying = flat_laying(np.zeros(50))
    fur = flat_fur(points, laying)
    image = fur_texture(photo, LAYERS, tails="end layers")
    middle = tuple(points.mean(axis=0).tolist())
    with Stage(96, 96, background=(0.0, 0.0, 0.0), supersampling=2) as stage:
        stage.add(laid_surface(fur, image, photo.attenuation, light))
        stage.look(orbit(middle, 5.0, -90.0, elevation, height=0.5 * float(np.ptp(points[:, 0]))))
        return decode_srgb(stage.frame().astype(np.float64) / 255)


def test_from_above_under_light_from_above_it_is_as_bright_as_the_photograph() -> None:
    """The photograph was taken so; patches show the higher of two hairs where they meet."""
    photo = photograph()
    found = drawn(FurLight(sky=0.0, headlight=1.0, lamp=0.0), 90.0, photo)
    expected = photo.radiance.mean(axis=(0, 1))
    np.testing.assert_allclose(found.mean(axis=(0, 1)), expected, rtol=0.25)
    np.testing.assert_allclose(
        found.mean(axis=(0, 1)) / found.mean(), expected / expected.mean(), rtol=0.02
    )
    assert found.std() > 0.3 * photo.radiance.std()


def test_fur_is_darker_under_light_from_the_side_and_black_without() -> None:
    photo = photograph()

    def mean(*towards: float) -> float:
        way = np.array(towards) / np.linalg.norm(towards)
        lamp = FurLight(sky=0.0, headlight=0.0, lamp=1.0, light=tuple(way.tolist()))
        return float(drawn(lamp, 90.0, photo).mean())

    above, aslant, low, below = mean(0, 0, 1), mean(0, 1, 1), mean(0, 4, 1), mean(0, 0, -1)
    assert above > aslant > 1.3 * low > 0
    assert below == 0


def test_hair_scatters_more_light_across_than_along_itself() -> None:
    """A lamp aslant across the hair, and one as much aslant from where the tips point."""
    photo = photograph()
    across, along = (
        drawn(FurLight(0.0, 0.0, 1.0, way), 90.0, photo).mean()
        for way in ((0.0, 0.7071, 0.7071), (0.7071, 0.0, 0.7071))
    )
    assert across > 1.15 * along


def test_a_photograph_that_is_not_square_is_not_drawn_out() -> None:
    """Twice the same photograph, side by side and one above the other: seen at the same width of
    one, hairs are equally wide."""

    def spectrum(times: tuple[int, int]) -> NDArray[np.float64]:
        one = photograph().radiance
        points, laying = flat_laying(np.zeros(50))
        scale = np.float32(1 / times[1])
        laying = laying._replace(uvs=laying.uvs * scale)
        fur = flat_fur(points, laying)
        photo = fur_photograph(np.tile(one, (*times, 1)))
        image = fur_texture(photo, LAYERS, tails="end layers")
        with Stage(96, 96, background=(0.0, 0.0, 0.0), supersampling=2) as stage:
            stage.add(laid_surface(fur, image, photo.attenuation, FurLight()))
            middle = tuple(points.mean(axis=0).tolist())
            height = 0.5 * float(np.ptp(points[:, 0]))
            stage.look(orbit(middle, 5.0, -90.0, 90.0, height=height))
            green = stage.frame()[..., 1].astype(np.float64)
        found: NDArray[np.float64] = np.abs(np.fft.rfft(green - green.mean(), axis=0)).mean(axis=1)
        return found

    def middle_frequency(values: NDArray[np.float64]) -> float:
        return float((values * np.arange(len(values))).sum() / values.sum())

    single = middle_frequency(spectrum((1, 1)))
    assert middle_frequency(spectrum((1, 2))) == pytest.approx(single, rel=0.1)
    assert middle_frequency(spectrum((2, 1))) == pytest.approx(single, rel=0.1)


def test_reach_holds_all_that_is_drawn() -> None:
    mesh = sphere(8)
    laying = Laying(*(np.zeros(0, int) for _ in Laying._fields))  # type: ignore[arg-type]
    fur = LaidFur(
        mesh.vertices.astype(np.float32),
        mesh.normals,
        mesh.normals,
        laying,
        np.ones(len(mesh.vertices)),
        0.1,
        4,
    )
    assert np.linalg.norm(fur.reach, axis=1).max() == pytest.approx(1 + 0.1 * (1 + BEND), abs=1e-5)


def seen_from(photo: FurPhotograph, elevation: float, **options: Any) -> NDArray[np.float64]:
    """Linear radiance (y, x, 3) of a flat fur under an even sky."""
    points, laying = flat_laying(np.zeros(50))
    fur = flat_fur(points, laying)
    image = fur_texture(photo, LAYERS, tails="end layers")
    middle = tuple(points.mean(axis=0).tolist())
    with Stage(96, 96, background=(0.0, 0.0, 0.0), supersampling=2) as stage:
        sky = FurLight(sky=1.0, headlight=0.0)
        stage.add(laid_surface(fur, image, photo.attenuation, sky, **options))
        stage.look(orbit(middle, 5.0, -90.0, elevation, height=0.5 * float(np.ptp(points[:, 0]))))
        return decode_srgb(stage.frame().astype(np.float64) / 255)


def test_wind_blows_tips_and_not_the_skin() -> None:
    """More wind moves more, another moment is another gust, and hair on the skin stays: of a
    photograph that is dark all over, at the depth of the skin, nothing moves."""
    photo = photograph()
    calm = seen_from(photo, 60.0)
    np.testing.assert_array_equal(seen_from(photo, 60.0, wind=Wind(0.0, 3.0)), calm)
    breeze, gale = (
        np.abs(seen_from(photo, 60.0, wind=Wind(strength, 1.0)) - calm).mean()
        for strength in (0.2, 1.5)
    )
    assert gale > 1.5 * breeze > 0.002
    later = seen_from(photo, 60.0, wind=Wind(1.5, 2.5))
    assert np.abs(later - seen_from(photo, 60.0, wind=Wind(1.5, 1.0))).mean() > 0.002
    skin = photo._replace(luminance=np.full_like(photo.luminance, photo.attenuation.darkest))
    still, blown = (seen_from(skin, 60.0, wind=Wind(strength, 1.0)) for strength in (0.0, 1.5))
    assert np.abs(blown - still).mean() < 0.1 * gale


def test_few_shells_are_as_bright_as_many() -> None:
    photo = photograph()
    many, some, few = (seen_from(photo, 50.0, shells=shells).mean() for shells in (36, 12, 5))
    assert few == pytest.approx(some, rel=0.1)
    assert many == pytest.approx(some, rel=0.15)


def test_depths_of_codes() -> None:
    codes = np.zeros((2, 2, 4), np.uint8)
    codes[..., 3] = [[63, 126], [189, 255]]  # quarters of 252; 255 is no hair
    assert middle_depth(codes, 4) == pytest.approx(0.5)
    codes[..., 3] = 255
    assert middle_depth(codes, 4) == 0.5


def test_fewer_shells_are_seen_of_thinner_fur() -> None:
    found = [shells_seen(rows) for rows in (0.1, 3, 6, 9, 12, 15, 1000)]
    assert found == sorted(found)
    assert found[0] == FEWEST_SHELLS
    assert found[-1] == MOST_SHELLS
