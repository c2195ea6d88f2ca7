"""Small pictures of glass against closed forms of slabs, the white furnace, and each other."""

from __future__ import annotations

import functools
import math

import numba
import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera, orbit
from pipelines.geometry.solid_shapes import glass_teapot, plate
from pipelines.geometry.solids import Solid
from pipelines.glass_scratches.drawing import path_tracing
from pipelines.glass_scratches.drawing.path_state import ScratchedSurface
from pipelines.glass_scratches.drawing.path_tracing import (
    Strategy,
    TracedPicture,
    make_scratched_surface,
    trace_picture,
)
from pipelines.glass_scratches.drawing.smooth_glass import reflectance
from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.feature_search import LayerArrays, scratch_at
from pipelines.glass_scratches.layers.features import layer_arrays
from pipelines.glass_scratches.layers.scratch_layers import make_layers
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.tables.bins import bin_weights
from pipelines.glass_scratches.tables.fresnel import fresnel_factors, interpolated_fresnel
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.lobe import make_lobe
from pipelines.glass_scratches.tables.paper_table import paper_bsdf_table
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table
from pipelines.light.built_in_environments import sky, uniform
from pipelines.light.environment_lookup import (
    radiance_from_directions,
    smooth_radiance_from_direction,
)
from pipelines.light.environment_maps import Radiance
from pipelines.light.environment_sampling import EnvironmentSampler, make_environment_sampler

Floats = NDArray[np.float64]

BINS = 32
INDEX = 1.5
CLEAN = LayerSpec(threshold=1e-6, length=0.5, width=0.1, layers=1)
WORN = LayerSpec(length=0.3, width=0.05, coverage=0.3, layers=3)
EVERYWHERE = LayerSpec(length=1.0, width=0.5, coverage=0.6, layers=10)
"""Ten layers, of which each covers more than a half: 0.4^10 is left."""


@functools.cache
def surface(
    spec: LayerSpec,
    *,
    walls: str = "glass",
    roughness: float = 1.0,
    albedo: float = 1.0,
    resolution: int = 64,
    tile: float = 1.0,
    index: float = INDEX,
) -> ScratchedSurface:
    profile = built_in_profile("v", 10.0, 4.0)
    if walls == "paper":
        made = paper_bsdf_table(
            scratch_brdf_table(profile, bins=BINS, albedo=albedo, facets=30),
            fresnel_factors(BINS, index, "paper"),
            index,
        )
    else:
        made = glass_table(
            profile,
            bins=BINS,
            index=index,
            roughness=roughness,
            albedo=albedo,
            facets=30,
            rays=3000,
            seed=1,
        )
    layers = make_layers(spec, 1)
    maps = coverage_maps(layers, resolution)
    return make_scratched_surface(layer_arrays(layers), maps, make_lobe(made), tile=tile)


def halves(front: float, back: float) -> EnvironmentSampler:
    """One radiance from where y < 0, another from where y > 0."""
    radiance = np.empty((16, 32, 3), np.float32)
    radiance[:, :16], radiance[:, 16:] = back, front
    return make_environment_sampler(radiance)


def facing(degrees: float = 0.0, height: float = 0.5) -> Camera:
    """Orthographic, at the plate's middle, so many degrees off its normal -y."""
    return orbit((0.0, 0.0, 0.0), 5.0, -90.0 + degrees, 0.0, height=height)


def picture(
    solid: Solid,
    made: ScratchedSurface,
    light: EnvironmentSampler,
    camera: Camera,
    *,
    size: int = 16,
    samples: int = 64,
    seed: int = 0,
    strategy: Strategy = "importance",
) -> TracedPicture:
    return trace_picture(
        solid, made, light, camera, width=size, height=size, samples=samples, seed=seed,
        strategy=strategy,
    )  # fmt: skip


def blocks(values: Floats) -> Floats:
    height, width = values.shape
    return values.reshape(height // 4, 4, width // 4, 4).mean(axis=(1, 3))


def block_means(found: TracedPicture) -> tuple[Floats, Floats]:
    """Radiance of 4 x 4 blocks and its standard error."""
    mean = found.radiance.astype(np.float64).mean(axis=2)
    return blocks(mean), np.sqrt(blocks(found.variance.astype(np.float64)) / 16)


@pytest.fixture(scope="module")
def pane() -> Solid:
    return plate(20.0, 20.0, 0.05)


@pytest.fixture(scope="module")
def teapot() -> Solid:
    return glass_teapot(4)


# ---- Fresnel ---------------------------------------------------------------------------------


@pytest.mark.parametrize("index", [1.2, 1.5, 2.4])
def test_reflectance_head_on_and_at_brewsters_angle(index: float) -> None:
    head_on = ((index - 1) / (index + 1)) ** 2
    for ratio in (index, 1 / index):
        assert reflectance(1.0, ratio) == pytest.approx((head_on, 1.0), rel=1e-12)
    brewster = math.atan(index)
    # Light in the plane of incidence is not reflected at all there; the other half is.
    across = ((index**2 - 1) / (index**2 + 1)) ** 2
    part, behind = reflectance(math.cos(brewster), 1 / index)
    assert part == pytest.approx(across / 2, rel=1e-12)
    assert behind == pytest.approx(math.sin(brewster), rel=1e-12)  # at right angles
    assert reflectance(0.0, 1 / index)[0] == 1.0


def test_light_is_reflected_totally_beyond_the_critical_angle() -> None:
    critical = math.asin(1 / INDEX)
    for angle in (critical + 1e-6, 1.2, math.pi / 2):
        assert reflectance(math.cos(angle), INDEX) == (1.0, 0.0)
    part, behind = reflectance(math.cos(critical - 1e-6), INDEX)
    assert 0.9 < part < 1.0
    assert 0.0 < behind < 0.01


def test_both_sides_of_a_surface_reflect_alike() -> None:
    for angle in np.linspace(0, 1.5, 31):
        inside = math.asin(math.sin(angle) / INDEX)
        part, behind = reflectance(math.cos(angle), 1 / INDEX)
        assert behind == pytest.approx(math.cos(inside), rel=1e-12)  # Snell
        assert reflectance(math.cos(inside), INDEX)[0] == pytest.approx(part, rel=1e-9)
        s = (math.sin(angle - inside) / math.sin(angle + inside)) ** 2 if angle else 0.04
        p = (math.tan(angle - inside) / math.tan(angle + inside)) ** 2 if angle else 0.04
        assert part == pytest.approx((s + p) / 2, rel=1e-9)


# ---- clear glass -----------------------------------------------------------------------------


def slab(degrees: float) -> float:
    """What a slab reflects in all, 2 R / (1 + R), R being that of unpolarised light."""
    angle = math.radians(degrees)
    inside = math.asin(math.sin(angle) / INDEX)
    if degrees == 0:
        part = ((INDEX - 1) / (INDEX + 1)) ** 2
    else:
        s = math.sin(angle - inside) / math.sin(angle + inside)
        p = math.tan(angle - inside) / math.tan(angle + inside)
        part = (s * s + p * p) / 2
    return 2 * part / (1 + part)


@pytest.mark.parametrize("degrees", [0.0, 40.0, 75.0])
def test_a_clear_plate_reflects_and_lets_through_what_a_slab_does(
    pane: Solid, degrees: float
) -> None:
    """Light from before and behind it apart: (1 - R) / (1 + R) of the latter."""
    clean = surface(CLEAN)
    reflected = slab(degrees)
    for light, expected in ((halves(1, 0), reflected), (halves(0, 1), 1 - reflected)):
        found = picture(pane, clean, light, facing(degrees), samples=128)
        assert not found.scratched.any()
        mean, error = block_means(found)
        assert np.abs(mean - expected).max() < 5 * error.max()
        assert mean.mean() == pytest.approx(expected, abs=5 * error.mean() / 4)
        assert mean.mean() == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize("degrees", [0.0, 60.0])
def test_a_clear_plate_cannot_be_seen_in_even_light(pane: Solid, degrees: float) -> None:
    found = picture(pane, surface(CLEAN), halves(1, 1), facing(degrees), samples=256)
    mean, error = block_means(found)
    assert np.abs(mean - 1).max() < 5 * error.max()
    assert mean.mean() == pytest.approx(1.0, abs=2e-3)


def test_a_plate_shows_what_lies_straight_behind_it(pane: Solid) -> None:
    """Each of many small lights, as it is looked at: a slab bends light back to where it went."""
    radiance = np.random.default_rng(2).random((16, 32, 3)).astype(np.float32)
    light, clean = make_environment_sampler(radiance), surface(CLEAN)
    for degrees in (13.0, -33.0, 52.0):
        camera = facing(degrees)
        way = -np.array(camera.position) / np.linalg.norm(camera.position)
        seen, mirrored = (
            np.array(smooth_radiance_from_direction(radiance, *each))
            for each in (way, way * [1, -1, 1])
        )
        part = slab(abs(degrees))
        found = picture(pane, clean, light, camera, samples=256).radiance.mean(axis=(0, 1))
        np.testing.assert_allclose(found, (1 - part) * seen + part * mirrored, rtol=0.015)


def test_what_misses_the_glass_is_the_environment_itself(teapot: Solid) -> None:
    """Which is linear between texels: it is looked at amid 8 x 8 texels of one colour."""
    colours = np.random.default_rng(3).random((4, 8, 3)).astype(np.float32)
    radiance = colours.repeat(8, axis=0).repeat(8, axis=1)
    beside = Camera(position=(0.0, -9.0, 5.0), target=(0.12, -9.3, 6.0), height=0.5)
    found = picture(
        teapot, surface(WORN), make_environment_sampler(radiance), beside, size=4, samples=4
    )
    way = np.array([0.12, -0.3, 1.0])
    expected = np.broadcast_to(radiance_from_directions(radiance, way[None])[0], (4, 4, 3))
    np.testing.assert_allclose(found.radiance, expected, rtol=1e-6)
    assert found.variance.max() < 1e-12
    assert found.rays == 4 * 4 * 4


# ---- the white furnace -----------------------------------------------------------------------


@pytest.mark.parametrize("roughness", [1.0, 0.3, 0.0])
@pytest.mark.parametrize("shape", ["plate", "teapot"])
def test_scratched_glass_is_never_brighter_than_even_light(
    shape: str, roughness: float, teapot: Solid
) -> None:
    solid = plate(1.6, 1.2, 0.1) if shape == "plate" else teapot
    camera = orbit((0.0, 0.0, 0.0), 5.0, -60.0, 20.0)
    light = make_environment_sampler(uniform(8))
    found = picture(solid, surface(WORN, roughness=roughness), light, camera, size=24, samples=32)
    assert 0.1 < found.scratched.max() <= 1.0
    mean, error = block_means(found)
    assert (mean < 1 + 5 * error + 1e-6).all()
    assert 0.97 < mean.mean() < 1 + 5 * error.mean() / math.sqrt(mean.size) + 1e-6


def test_grey_walls_take_light_away(teapot: Solid) -> None:
    """Of the paper's only what they reflect, F: the rest goes into the glass and stays. Of walls of
    glass all."""
    camera = orbit((0.0, 0.0, 0.0), 5.0, -60.0, 20.0)
    light = make_environment_sampler(uniform(8))

    def lit(walls: str, albedo: float) -> float:
        made = surface(WORN, walls=walls, albedo=albedo)
        found = picture(teapot, made, light, camera, size=24, samples=32)
        return float(found.radiance[found.scratched > 0.1].mean())

    assert 0.8 < lit("paper", 0.0) < 0.99 * lit("paper", 1.0)
    assert lit("glass", 0.0) < 0.8 * lit("glass", 0.5) < 0.8 * lit("glass", 1.0)


# ---- matt glass ------------------------------------------------------------------------------


def let_out(index: float) -> tuple[Floats, float]:
    """F of views at theta 0 (M,), and (1 - mean F) / n² of what goes out from inside."""
    lean = fresnel_factors(BINS, index, "paper")
    theta = (np.arange(2000) + 0.5) / 2000 * np.pi / 2
    factor = interpolated_fresnel(lean, theta)
    weight = np.cos(theta) ** 2 / (np.cos(theta) ** 2).sum()
    mean = float(weight @ factor @ bin_weights(BINS) / 2)
    return factor[0], (1 - mean) / index**2


@pytest.mark.parametrize(
    ("degrees", "strategy"), [(0.0, "importance"), (50.0, "importance"), (50.0, "uniform")]
)
def test_a_matt_plate_in_closed_form(pane: Solid, degrees: float, strategy: Strategy) -> None:
    """Scratched all over. Inside, light goes out at either face with the chance t, or back to the
    other one: of what entered (1 - F), 1 / (2 - t) comes out behind and the rest before."""
    made = surface(EVERYWHERE, walls="paper")
    light = {"before": halves(1, 0), "behind": halves(0, 1)}
    found = {
        side: picture(pane, made, each, facing(degrees), strategy=strategy, samples=128)
        for side, each in light.items()
    }
    for each in found.values():
        assert each.scratched.mean() > 0.999
    # F depends on the lean along the scratches, which lie in ten directions.
    way = np.array([math.sin(math.radians(degrees)), math.cos(math.radians(degrees))])
    angle = made.layers.angle.astype(np.float64)
    theta = np.arcsin(way[0] * np.cos(angle))
    lean = fresnel_factors(BINS, INDEX, "paper")
    factor = float(interpolated_fresnel(lean, np.abs(theta))[:, BINS // 2].mean())
    head_on, out = let_out(INDEX)
    np.testing.assert_allclose(head_on, 0.04, rtol=1e-9)
    behind = (1 - factor) / (2 - out)
    for side, expected in (("before", 1 - behind), ("behind", behind)):
        mean, error = block_means(found[side])
        assert mean.mean() == pytest.approx(expected, abs=5 * error.mean() / 4)
        assert mean.mean() == pytest.approx(expected, rel=0.04)
        assert (np.abs(mean - expected) < 6 * error).all()


def test_light_from_behind_a_matt_plate_is_not_forgotten(pane: Solid) -> None:
    """A small bright light behind it, which chance alone would seldom meet."""
    radiance = np.zeros((32, 64, 3), np.float32)
    radiance[15:17, 15:17] = 400.0  # about azimuth 90
    light, made = make_environment_sampler(radiance), surface(EVERYWHERE)
    found = picture(pane, made, light, facing(), samples=64)
    chance = picture(pane, made, light, facing(), samples=64, strategy="uniform")
    mean, error = block_means(found)
    # As matt as this it glows evenly.
    assert (mean > 0.5 * mean.mean()).all()
    assert (mean < 1.6 * mean.mean()).all()
    assert mean.mean() > 0.3 * 400 * (np.pi / 32) ** 2 * 4 / np.pi / 3
    other, its_error = block_means(chance)
    z = (mean.mean() - other.mean()) / math.sqrt((error**2).mean() + (its_error**2).mean()) * 4
    assert abs(z) < 4.5
    assert error.mean() < its_error.mean() / 2


# ---- noise -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("spec", "degrees", "light"),
    [(CLEAN, 75.0, (1, 0)), (CLEAN, 0.0, (1, 0)), (EVERYWHERE, 0.0, (0, 1))],
    ids=["clear and grazing", "clear", "matt"],
)
def test_the_noise_of_pixels_is_what_their_variance_says(
    pane: Solid, spec: LayerSpec, degrees: float, light: tuple[float, float]
) -> None:
    """All pixels show the same here. Numbers of one event that are tied to those of another leave
    each pixel its own error, which more samples do not help; stratified ones only lower it."""
    found = picture(pane, surface(spec), halves(*light), facing(degrees), size=8, samples=512)
    spread = found.radiance.mean(axis=2).std(ddof=1)
    # 64 pixels know their spread to 9 %.
    assert spread < 1.3 * math.sqrt(found.variance.mean())
    assert spread > 0


# ---- strategies ------------------------------------------------------------------------------


@pytest.mark.parametrize("walls", ["glass", "paper"])
@pytest.mark.parametrize("shape", ["plate", "teapot"])
def test_importance_and_uniform_sampling_agree(shape: str, walls: str, teapot: Solid) -> None:
    """Of walls that scatter evenly: lobes of those that keep the lean are too thin to be met by
    chance."""
    solid = plate(1.6, 1.2, 0.1) if shape == "plate" else teapot
    camera = orbit((0.0, 0.0, 0.0), 5.0, -60.0, 20.0, view_angle=20.0)
    light = make_environment_sampler(
        sky(32, sun_azimuth=-20.0, sun_elevation=40.0, sun_radius=20.0)
    )
    made = surface(WORN, walls=walls)
    one = picture(solid, made, light, camera, samples=128)
    other = picture(solid, made, light, camera, samples=512, strategy="uniform", seed=1)
    (a, a_error), (b, b_error) = block_means(one), block_means(other)
    error = np.sqrt(a_error**2 + b_error**2)
    z = (a - b)[error > 0] / error[error > 0]
    assert np.abs(z).max() < 4.5
    assert abs((a - b).sum() / np.sqrt((error**2).sum())) < 4
    # Samples are stratified: less noise than their variance has it, never more.
    assert np.sqrt(np.mean(z**2)) < 1.4


# ---- far and near ----------------------------------------------------------------------------


@njit
def _opacities(layers: LayerArrays, points: Floats, found: Floats) -> None:
    for i in range(len(points)):
        left = 1.0
        for layer in range(len(layers.angle)):
            left *= 1.0 - scratch_at(layers, layer, points[i, 0], points[i, 1])[0]
        found[i] = 1.0 - left


def met_in_all(front: float, back: float) -> float:
    """Paths that meet a scratch on either face of a plate seen head-on.

    Of those that find none in front a quarter is reflected there (as many as that at what is seen
    first); inside, R is reflected each time.
    """
    part = ((INDEX - 1) / (INDEX + 1)) ** 2
    # s = back + (1 - back) R (front + (1 - front) R s)
    again = (1 - back) * part
    inside = (back + again * front) / (1 - again * (1 - front) * part)
    return front + (1 - front) * 0.75 * inside


def test_from_afar_the_mean_coverage_is_met() -> None:
    """A pixel as wide as the tile: each layer by its mean, independent of the others."""
    layers = make_layers(WORN, 1)
    mean = coverage_maps(layers, 64, 64).mean(axis=(1, 2))
    union = 1 - float(np.prod(1 - mean))
    made = surface(WORN, tile=0.01)
    found = picture(plate(4.0, 4.0, 0.1), made, halves(1, 1), facing(height=1.0))
    expected = met_in_all(union, union)
    error = math.sqrt(expected * (1 - expected) / (64 * 16 * 16))
    assert found.scratched.mean() == pytest.approx(expected, abs=5 * error + 2e-3)
    assert union > 0.5


@pytest.mark.parametrize("resolution", [4, 128])
def test_near_or_filtered_as_much_is_scratched(resolution: int) -> None:
    """Coarse coverage leaves the features themselves to be asked, fine coverage is averaged."""
    points = np.random.default_rng(4).random((200_000, 2))
    found = np.empty(len(points))
    _opacities(layer_arrays(make_layers(WORN, 1)), points, found)
    union = float(found.mean())
    made = surface(WORN, resolution=resolution)
    # A whole tile in 24 pixels of 1/24 of it.
    shown = picture(
        plate(4.0, 4.0, 0.05), made, halves(1, 1), facing(height=1.0), size=24, samples=64
    )
    expected = met_in_all(union, union)
    # Front and back have scratches at other places, which need not be quite independent.
    assert shown.scratched.mean() == pytest.approx(expected, abs=0.015)
    assert shown.scratched.std() > 0.1


def test_filtered_and_exact_pictures_look_alike() -> None:
    solid, light = plate(4.0, 4.0, 0.05), halves(0.2, 1.0)
    near, filtered = (
        picture(
            solid, surface(WORN, resolution=resolution), light, facing(height=1.0), size=24,
        )
        for resolution in (4, 128)
    )  # fmt: skip
    one, other = (blocks(each.scratched).ravel() for each in (near, filtered))
    assert np.corrcoef(one, other)[0, 1] > 0.9
    assert (near.scratched != filtered.scratched).mean() > 0.5
    assert near.radiance.mean() == pytest.approx(filtered.radiance.mean(), rel=0.02)


# ---- seeds, blocks, threads ------------------------------------------------------------------


def test_the_picture_depends_on_the_seed_alone(
    teapot: Solid, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera = orbit((0.0, 0.0, 0.0), 5.0, -60.0, 20.0)
    light = make_environment_sampler(sky(16, sun_azimuth=0.0, sun_elevation=40.0, sun_radius=20.0))
    made = surface(WORN)

    def again(seed: int = 5) -> TracedPicture:
        return picture(teapot, made, light, camera, size=12, samples=16, seed=seed)

    one = again()
    assert (again(6).radiance != one.radiance).any()
    others = [again()]
    monkeypatch.setattr(path_tracing, "_BLOCK", 100)
    others.append(again())
    monkeypatch.setattr(numba, "get_num_threads", lambda: 3)
    others.append(again())
    for other in others:
        for left, right in zip(one, other, strict=True):
            np.testing.assert_array_equal(left, right)


def test_progress_grows_to_one(pane: Solid) -> None:
    told: list[float] = []
    trace_picture(
        pane, surface(CLEAN), halves(1, 1), facing(), width=4, height=2, samples=4,
        progress=told.append,
    )  # fmt: skip
    assert told[0] == 0.0
    assert told[-1] == 1.0
    assert told == sorted(told)


# ---- surfaces --------------------------------------------------------------------------------


def with_fields(*, tile: float = 1.0, side: int = 8) -> ScratchedSurface:
    layers = layer_arrays(make_layers(CLEAN, 1))
    lobe = surface(CLEAN).lobe
    return make_scratched_surface(layers, np.zeros((1, side, side), np.float32), lobe, tile=tile)


@pytest.mark.parametrize("tile", [0.0, -1.0, math.nan])
def test_a_tile_that_is_not_positive_is_refused(tile: float) -> None:
    message = rf"^tile is {tile:g}; expected more than 0 scene units\.$"
    with pytest.raises(ValueError, match=message):
        with_fields(tile=tile)


def test_coverage_that_is_no_power_of_two_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^shape of the maps is \(1, 6, 6\); expected"):
        with_fields(side=6)
    assert with_fields(side=16).resolution == 16


def test_an_environment_is_as_it_was_written_here() -> None:
    """Which half of the map is y > 0: the tests above lean on it."""
    radiance: Radiance = halves(1, 5).radiance
    np.testing.assert_array_equal(
        radiance_from_directions(radiance, [[0, 1, 0], [0, -1, 0]])[:, 0], [5, 1]
    )
