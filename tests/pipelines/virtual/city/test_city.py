"""The built-in city: what is where, in what light, and that pictures agree with its geometry."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry.cameras import moved_left, unproject_depth
from pipelines.geometry.rays import build_scene, first_hits
from pipelines.virtual.city.bend import STRAIGHT, Bend, bent_points, turned_vectors
from pipelines.virtual.city.city import BEFORE, BEYOND, City, make_city
from pipelines.virtual.city.drive import plan_drive
from pipelines.virtual.city.light import sky_visibility
from pipelines.virtual.city.materials import city_textures, even_brightness, make_tileable
from pipelines.virtual.city.parts import MATERIALS, MEAN_TEXEL, POSTERS, Look, box, panel
from pipelines.virtual.city.photographing import CityStage
from storage.readers.street_photographs import street_photographs

Photographs = dict[str, NDArray[np.uint8]]
WIDTH, HEIGHT = 160, 100


@pytest.fixture(scope="module")
def short() -> City:
    return make_city(12.0, seed=5)


@pytest.fixture(scope="module")
def photographs() -> Photographs:
    return street_photographs()


# ---- geometry ----------------------------------------------------------------------------------


def test_arrays_fit_together(short: City) -> None:
    count, triangles = len(short.vertices), len(short.triangles)
    for name, width in (("vertices", 3), ("normals", 3), ("uvs", 2), ("tint", 3)):
        values = getattr(short, name)
        assert values.shape == (count, width)
        assert values.dtype == np.float32
        assert np.isfinite(values).all()
    assert short.sky_visibility.shape == short.gloss.shape == (count,)
    assert short.triangles.shape == (triangles, 3)
    assert 0 <= short.triangles.min() <= short.triangles.max() < count
    assert set(np.unique(short.material)) <= set(range(len(MATERIALS)))
    assert short.pole.dtype == np.bool_
    assert 0.0 <= short.sky_visibility.min() < short.sky_visibility.max() <= 1.0
    np.testing.assert_allclose(np.linalg.norm(short.normals, axis=1), 1.0, atol=1e-4)


def test_triangles_are_wound_as_their_normals_say(short: City) -> None:
    """They are drawn from their front only."""
    a, b, c = np.moveaxis(short.vertices[short.triangles].astype(float), 1, 0)
    across = np.cross(b - a, c - a)
    area = np.linalg.norm(across, axis=1) / 2
    along = np.einsum("ij,ij->i", across, short.normals[short.triangles].mean(axis=1))
    large = area > 1e-5
    assert (along[large] > 0).mean() > 0.999
    assert area[along <= 0].sum() < 1e-3 * area.sum()


def test_the_same_seed_gives_the_same_city_and_another_another(short: City) -> None:
    again, other = make_city(12.0, seed=5), make_city(12.0, seed=6)
    for mine, theirs in zip(short, again, strict=True):
        np.testing.assert_array_equal(mine, theirs)
    assert other.vertices.shape != short.vertices.shape


def test_a_longer_city_begins_with_the_same_poles(short: City) -> None:
    longer = make_city(30.0, seed=5)

    def poles(which: City) -> NDArray[np.float64]:
        points = which.vertices[np.unique(which.triangles[which.pole])].astype(float)
        return np.unique(points[points[:, 0] < 30.0].round(4), axis=0)

    np.testing.assert_array_equal(poles(short), poles(longer))


def test_the_street_reaches_as_far_as_it_should(short: City) -> None:
    _, y, z = short.vertices.T
    road = short.vertices[(z == 0.0) & (np.abs(y) == 3.5)]
    assert road[:, 0].min() == -BEFORE
    assert road[:, 0].max() == 12.0 + BEYOND


def test_the_cars_way_is_free(short: City) -> None:
    """No vertex is over the road where the car drives, nor does a ray along it meet anything."""
    x, y, z = short.vertices.T
    driven = (x > -5) & (x < 12 + BEYOND - 2) & (np.abs(y) < 2.7) & (z > 0.03) & (z < 3.0)
    assert not driven.any()
    scene = build_scene(short.vertices, short.triangles)
    y, z = np.meshgrid(np.linspace(-2.7, 1.9, 24), np.linspace(0.1, 3.0, 15))
    starts = np.stack([np.zeros(y.size), y.ravel(), z.ravel()], axis=1)
    assert (first_hits(scene, starts, [1.0, 0.0, 0.0]).distance > 12 + BEYOND - 2).all()


def test_the_street_is_closed(short: City) -> None:
    """From the road all rays that do not rise meet something."""
    scene = build_scene(short.vertices, short.triangles)
    angle = np.linspace(0, 2 * np.pi, 721)
    for rise in (-0.3, -0.02, 0.02):
        ways = np.stack([np.cos(angle), np.sin(angle), np.full_like(angle, rise)], axis=1)
        assert (first_hits(scene, [6.0, -1.75, 1.9], ways).triangle >= 0).all()


def test_thin_poles_stand_along_both_pavements(short: City) -> None:
    points = short.vertices[np.unique(short.triangles[short.pole])]
    assert points[:, 2].max() > 3.0
    for side in (-1, 1):
        row = points[points[:, 1] * side > 0]
        assert np.abs(np.abs(row[:, 1]) - 4.2).max() <= 0.081
        x = np.sort(row[:, 0])
        starts = np.flatnonzero(np.diff(x, prepend=-np.inf) > 1.0)
        thickness = [group.max() - group.min() for group in np.split(x, starts[1:])]
        assert len(thickness) >= 4
        assert 0.0999 <= min(thickness) <= max(thickness) <= 0.1601
        assert 9.0 - 0.2 <= np.diff(x[starts]).min() <= np.diff(x[starts]).max() <= 14.0 + 0.2


@pytest.mark.parametrize("length", [0.0, -3.0, np.nan, np.inf])
def test_a_length_must_be_positive(length: float) -> None:
    with pytest.raises(ValueError, match="expected metres"):
        make_city(length)


# ---- light -------------------------------------------------------------------------------------


def test_open_ground_sees_all_of_the_sky_and_a_wall_its_share() -> None:
    ground = panel((-50, -50, 0), (100, 0, 0), (0, 100, 0), Look("asphalt"), longest=200.0)
    seen = sky_visibility(ground.vertices, ground.normals, ground.triangles)
    np.testing.assert_allclose(seen, 1.0, atol=0.01)
    wall = panel((-1, 0, 1), (2, 0, 0), (0, 0, 2), Look("asphalt"))
    seen = sky_visibility(wall.vertices, wall.normals, wall.triangles)
    # CIE's overcast sky on an upright wall: 0.396 of the light on the ground.
    np.testing.assert_allclose(seen, 0.396, atol=0.02)


def test_inside_a_box_it_is_dark() -> None:
    room = box((1, 1, 1), (0, 0, 0), Look("asphalt"))
    seen = sky_visibility(room.vertices, room.normals, room.triangles)
    np.testing.assert_array_equal(seen, 0.0)


def test_under_cars_it_is_darker_than_on_the_road(short: City) -> None:
    x, y, z = short.vertices.T
    open_ = (z == 0) & (np.abs(y) < 2.0) & (x > 0) & (x < 12)
    assert short.sky_visibility[open_].min() > 0.3


# ---- textures ----------------------------------------------------------------------------------


def test_every_material_has_a_texture_of_the_mean_that_tints_expect(
    photographs: Photographs,
) -> None:
    textures = city_textures(photographs)
    for name in MATERIALS:
        assert textures[name].dtype == np.uint8
        assert textures[name].ndim == 3
    from pipelines.drawing.colour import decode_srgb

    for name in ("brick", "plaster", "asphalt", "paving", "metal", "stains"):
        mean = decode_srgb(textures[name] / 255.0).mean()
        assert mean == pytest.approx(MEAN_TEXEL, rel=0.08)
    with pytest.raises(ValueError, match="missing gravel"):
        city_textures({name: a for name, a in photographs.items() if name != "gravel"})


def test_repeatable_pictures_have_no_seam(photographs: Photographs) -> None:
    image = make_tileable(even_brightness(photographs["gravel"].astype(np.float32)))
    for axis in (0, 1):
        inside = np.abs(np.diff(image, axis=axis)).mean()
        first, last = np.take(image, 0, axis), np.take(image, -1, axis)
        assert np.abs(first - last).mean() < 1.3 * inside


# ---- pictures ----------------------------------------------------------------------------------


def _bent(city: City, bend: Bend) -> City:
    """The city made with a bend, but for its light."""
    along = city.vertices[:, 0]
    return city._replace(
        vertices=bent_points(city.vertices, bend).astype(np.float32),
        normals=turned_vectors(city.normals, along, bend).astype(np.float32),
        bend=bend,
    )


def test_a_bent_city_is_the_straight_one_bent(short: City) -> None:
    bend = Bend(2.0, 10.0, 0.3)
    made, expected = make_city(12.0, 5, bend), _bent(short, bend)
    np.testing.assert_array_equal(made.vertices, expected.vertices)
    np.testing.assert_array_equal(made.normals, expected.normals)
    np.testing.assert_array_equal(made.triangles, short.triangles)
    assert np.abs(made.sky_visibility - short.sky_visibility).mean() < 0.02


def test_what_panes_mirror_is_looked_up_in_the_straight_street(
    short: City, photographs: Photographs
) -> None:
    """A bend of nearly nothing is drawn by other shaders, and looks the same."""
    drive = plan_drive(2, 3.0, WIDTH, HEIGHT)
    pictures = []
    for which in (short, _bent(short, Bend(2.0, 10.0, 1e-7))):
        with CityStage(which, photographs, WIDTH, HEIGHT) as stage:
            pictures.append(stage.shoot(drive.intrinsics[0], drive.poses[0, 1]).radiance)
    assert np.abs(pictures[0] - pictures[1]).mean() < 1e-4
    assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 0.02).mean() < 2e-3


@pytest.mark.parametrize("bend", [STRAIGHT, Bend(2.0, 10.0, 0.3)])
def test_depth_and_poles_are_those_of_rays(
    short: City, photographs: Photographs, bend: Bend
) -> None:
    if bend.angle:
        short = _bent(short, bend)
    drive = plan_drive(4, 3.0, WIDTH, HEIGHT, bend=bend)
    k, pose = drive.intrinsics[0], moved_left(drive.poses[2, 1], 0.4)
    with CityStage(short, photographs, WIDTH, HEIGHT) as stage:
        shot = stage.shoot(k, pose, labels=True)
    ways = unproject_depth(k, pose, np.ones((HEIGHT, WIDTH))) - pose[:3, 3]
    scene = build_scene(short.vertices, short.triangles)
    hits = first_hits(scene, pose[:3, 3], ways.reshape(-1, 3))
    expected = hits.distance.reshape(HEIGHT, WIDTH)
    sky = np.isinf(expected)
    assert 0.02 < sky.mean() < 0.4
    assert (sky == np.isinf(shot.depth)).mean() > 0.995
    both = ~sky & np.isfinite(shot.depth)
    error = np.abs(shot.depth[both] - expected[both])
    assert (error < 1e-3 * expected[both]).mean() > 0.985  # the others are at edges
    assert np.median(error[expected[both] > 20]) < 0.005
    pole = np.where(hits.triangle >= 0, short.pole[hits.triangle], False).reshape(HEIGHT, WIDTH)
    assert pole.mean() > 0.002
    assert (pole != shot.pole).sum() <= 0.15 * pole.sum()


def test_pictures_are_bright_rich_and_the_same_again(short: City, photographs: Photographs) -> None:
    drive = plan_drive(4, 3.0, WIDTH, HEIGHT)
    with CityStage(short, photographs, WIDTH, HEIGHT) as stage:
        first = stage.shoot(drive.intrinsics[0], drive.poses[0, 0])
        other = stage.shoot(drive.intrinsics[0], drive.poses[3, 2])
        again = stage.shoot(drive.intrinsics[0], drive.poses[0, 0])
    assert first.radiance.shape == (HEIGHT, WIDTH, 3)
    assert first.radiance.dtype == np.float32
    assert first.depth.shape == first.pole.shape == (0, 0)
    np.testing.assert_array_equal(first.radiance, again.radiance)
    assert not np.array_equal(first.radiance, other.radiance)
    assert np.isfinite(first.radiance).all()
    assert 0.05 < np.median(first.radiance) < 0.5
    road = first.radiance[-25:, 60:100, 1]
    assert road.std() / road.mean() > 0.05


@pytest.mark.slow
def test_panes_look_different_from_another_place_and_walls_do_not(
    photographs: Photographs,
) -> None:
    """Two cameras at one place of a wall; the point is seen from two sides."""
    full = make_city(12.0, seed=5)
    matt = full._replace(gloss=np.zeros_like(full.gloss))
    drive = plan_drive(4, 3.0, WIDTH, HEIGHT)
    pictures = []
    for which in (full, matt):
        with CityStage(which, photographs, WIDTH, HEIGHT) as stage:
            shot = stage.shoot(drive.intrinsics[0], drive.poses[0, 1])
            pictures.append(shot.radiance)
    more = (pictures[0] - pictures[1]).max(axis=2)
    assert more.min() > -1e-4
    assert 0.01 < (more > 0.01).mean() < 0.3


def test_other_cameras_are_refused(short: City, photographs: Photographs) -> None:
    drive = plan_drive(1, 3.0, WIDTH, HEIGHT)
    with CityStage(short, photographs, WIDTH, HEIGHT) as stage:
        for place, value in (((0, 0), 90.0), ((0, 2), 70.0), ((1, 2), 52.0)):
            wrong = drive.intrinsics[0].copy()
            wrong[place] = value
            with pytest.raises(ValueError, match="expected square pixels"):
                stage.shoot(wrong, drive.poses[0, 0])


def test_posters_are_photographs() -> None:
    assert set(POSTERS) <= set(MATERIALS)
