"""The plate and the glass teapot: closed, as thick as asked, and what light meets in them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.geometry import shapes
from pipelines.geometry.rays import FirstHits, build_scene, first_hits
from pipelines.geometry.solid_shapes import glass_teapot, plate
from pipelines.geometry.solids import Solid, make_closed_mesh
from pipelines.geometry.teapot_patches import TEAPOT_CENTRE
from tests.pipelines.geometry.solid_figures import assert_closed, face_normals, volume

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


@cache
def teapot() -> Solid:
    return glass_teapot()


def cast(solid: Solid, origins: Array, directions: Array) -> FirstHits:
    return first_hits(build_scene(solid.vertices, solid.triangles), origins, directions)


def on_sphere(count: int, seed: int, radius: float = 1.0) -> Array:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    scaled: Array = radius * points / np.linalg.norm(points, axis=1, keepdims=True)
    return scaled


# --- Plate --------------------------------------------------------------------------------------


def test_the_plate_stands_upright() -> None:
    solid = plate(3.0, 2.0, 0.25)
    assert_closed(solid)
    assert solid.triangles.shape == (12, 3)
    assert volume(solid.vertices, solid.triangles) == pytest.approx(3.0 * 2.0 * 0.25)
    np.testing.assert_allclose(solid.vertices.max(axis=0), [1.5, 0.125, 1.0])
    np.testing.assert_allclose(solid.vertices.min(axis=0), [-1.5, -0.125, -1.0])
    hit = cast(solid, np.array([[0.1, -5, 0.2], [0.1, 5, 0.2]]), np.array([[0, 1, 0], [0, -1, 0]]))
    np.testing.assert_allclose(hit.distance, 5 - 0.125, rtol=1e-6)
    np.testing.assert_allclose(
        solid.corner_normals[hit.triangle, 0], [[0, -1, 0], [0, 1, 0]], atol=1e-6
    )


@pytest.mark.parametrize("size", [(0, 1, 1), (1, -1, 1), (1, 1, float("inf"))])
def test_plates_without_size(size: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="expected positive, finite lengths"):
        plate(*size)


# --- Teapot -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("segments", "thickness"), [(4, 0.035), (5, 0.02), (8, 0.005), (8, 0.08), (12, 0.035)]
)
def test_the_teapot_is_one_closed_surface(segments: int, thickness: float) -> None:
    solid = glass_teapot(segments, thickness)
    assert_closed(solid)
    assert volume(solid.vertices, solid.triangles) > thickness
    # V - E + F = 0: a ring, which the handle makes it; the hollow is open through the spout.
    assert len(solid.vertices) == len(solid.triangles) / 2
    alone = make_closed_mesh(solid.vertices, solid.triangles)
    np.testing.assert_array_equal(alone.triangles, solid.triangles)


def test_each_teapot_is_the_same() -> None:
    for ours, again in zip(teapot(), glass_teapot(), strict=True):
        np.testing.assert_array_equal(ours, again)


def test_the_glass_teapot_looks_like_the_teapot_from_outside() -> None:
    origins, targets = on_sphere(20_000, 1, radius=3.0), on_sphere(20_000, 2, radius=0.5)
    pot = shapes.teapot(12)
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    there = first_hits(build_scene(pot.vertices, pot.triangles), origins, directions).distance
    here = cast(teapot(), origins, directions).distance
    assert ((there < np.inf) == (here < np.inf)).mean() > 0.998
    hit = (there < np.inf) & (here < np.inf)
    assert hit.mean() > 0.5
    # Not those that look through the gap around the lid or into the spout.
    assert (np.abs(there[hit] - here[hit]) < 0.01).mean() > 0.98


@pytest.mark.parametrize("thickness", [0.02, 0.035, 0.06])
def test_walls_are_as_thick_as_asked(thickness: float) -> None:
    """Along the normals of the body, all around but at the handle and the spout."""
    solid = glass_teapot(12, thickness)
    azimuth = np.radians(np.concatenate([np.arange(35, 146), np.arange(215, 326)]))
    across = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1)
    axis = np.array([-TEAPOT_CENTRE[0], 0, 0])
    for height in (-0.3, -0.2, 0.0, 0.15):
        outer = cast(solid, axis + across * 2 + [0, 0, height], -across)
        inwards = -face_normals(solid)[outer.triangle]
        surface = axis + across * (2 - outer.distance[:, None]) + [0, 0, height]
        inner = cast(solid, surface + 1e-3 * inwards, inwards)
        wall = inner.distance + 1e-3
        assert np.abs(wall / thickness - 1).max() < 0.25
        assert (np.einsum("ni,ni->n", face_normals(solid)[inner.triangle], inwards) > 0.9).all()


@pytest.mark.parametrize("thickness", [0.02, 0.05, 0.08])
def test_the_bodys_wall_is_even(thickness: float) -> None:
    """Along the normals where lines from the side meet the body: half of the walls differ from what
    was asked for by less than 2 %, nine in ten by less than 6 %."""
    solid = glass_teapot(14, thickness)
    azimuth = np.radians(np.concatenate([np.arange(35, 146), np.arange(215, 326)]))
    azimuth, height = (each.ravel() for each in np.meshgrid(azimuth, np.linspace(-0.36, 0.2, 23)))
    across = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1)
    start = np.array([-TEAPOT_CENTRE[0], 0, 0]) + across * 2
    start[:, 2] += height
    outer = cast(solid, start, -across)
    inwards = -face_normals(solid)[outer.triangle]
    surface = start - across * outer.distance[:, None]
    wall = cast(solid, surface + 1e-4 * inwards, inwards).distance + 1e-4
    off = np.abs(wall / thickness - 1)
    assert np.median(off) < 0.02
    assert np.quantile(off, 0.9) < 0.06


def test_lengths_inside_make_up_the_volume() -> None:
    """Parallel lines, evenly apart, against the divergence theorem; a filled pot has far more."""
    solid = glass_teapot(10, 0.05)
    places = (np.arange(400) + 0.5) / 200 - 1
    y, z = (each.ravel() for each in np.meshgrid(places, places))
    here = np.stack([np.full(len(y), -2.0), y, z], axis=-1)
    alive, inside = np.arange(len(y)), np.zeros(len(y), bool)
    glass, first, last = np.zeros(len(y)), np.full(len(y), np.nan), np.full(len(y), np.nan)
    while len(alive):
        hit = cast(solid, here[alive], np.array([1.0, 0.0, 0.0]))
        met = np.isfinite(hit.distance)
        alive, far = alive[met], hit.distance[met] + 1e-6
        glass[alive] += np.where(inside[alive], far, 0.0)
        here[alive, 0] += far
        inside[alive] = face_normals(solid)[hit.triangle[met], 0] < 0
        first[alive] = np.where(np.isnan(first[alive]), here[alive, 0], first[alive])
        last[alive] = here[alive, 0]
    cell = (2.0 / 400) ** 2
    enclosed = volume(solid.vertices, solid.triangles)
    assert glass.sum() * cell == pytest.approx(enclosed, rel=0.01)
    assert np.nansum(last - first) * cell > 3 * enclosed


def test_one_sees_straight_through_the_hollow_body() -> None:
    """By Snell's law at four surfaces, against a filled body's two: walls hardly turn light."""
    solid = glass_teapot(14, 0.05)
    azimuth = np.radians(np.repeat(np.arange(60, 121, 3), 9))
    height = np.tile(np.linspace(-0.25, 0.1, 9), 21)
    came = -np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1)
    start = np.array([-TEAPOT_CENTRE[0] + 0.1, 0, 0]) - 2 * came  # beside the axis
    start[:, 2] += height

    def turned(surfaces: int, skipped: tuple[int, ...]) -> Array:
        here, way = start, came
        for number in range(surfaces):
            hit = cast(solid, here, way)
            here = here + (hit.distance[:, None] + 1e-5) * way
            if number not in skipped:
                way = _refracted(way, face_normals(solid)[hit.triangle])
        return np.degrees(np.arccos(np.clip(np.einsum("ni,ni->n", way, came), -1, 1)))

    assert np.nanmedian(turned(4, ())) < 4.0
    assert np.nanmedian(turned(4, (1, 2))) > 10.0


def _refracted(way: Array, normal: Array) -> Array:
    """Into glass against the normal, out of it along it; NaN where all is reflected."""
    cosine = np.einsum("ni,ni->n", way, normal)[:, None]
    ratio = np.where(cosine < 0, 1 / 1.5, 1.5)
    with np.errstate(invalid="ignore"):
        behind = np.sqrt(1 - ratio**2 * (1 - cosine**2))
    bent: Array = ratio * way + (np.sign(cosine) * behind - ratio * cosine) * normal
    return bent


def test_bottom_lid_knob_and_handle() -> None:
    """What a plumb line and a level one through the handle meet."""
    solid = teapot()

    def crossings(origin: tuple[float, float, float], direction: tuple[int, int, int]) -> Array:
        found: list[float] = []
        passed = 0.0
        way = np.array([direction], np.float64)
        while True:
            hit = cast(solid, np.array([origin]) + passed * way, way).distance[0]
            if not np.isfinite(hit):
                return np.array(found)
            passed += float(hit) + 1e-4
            found.append(passed)

    middle = -float(TEAPOT_CENTRE[0])
    knob = np.diff(crossings((middle + 1e-3, 2e-3, 2.0), (0, 0, -1)))
    assert len(knob) == 3  # glass from the knob's top to the lid's underside, hollow, bottom
    assert knob[0] == pytest.approx(0.17, abs=0.03)
    assert knob[2] == pytest.approx(0.035, rel=0.1)
    lid = np.diff(crossings((middle + 0.2, 2e-3, 2.0), (0, 0, -1)))
    assert len(lid) == 3
    assert lid[0] == pytest.approx(0.035, rel=0.1)
    handle = np.diff(crossings((-2.0, 1e-3, 0.0), (1, 0, 0)))
    assert handle[0] == pytest.approx(0.1, abs=0.03)


def test_light_enters_the_hollow_through_the_spout() -> None:
    """Down the channel and around its bend, not through glass: down from the lip, each step
    sees the next."""
    scale = 3.34029113
    newell = np.array([[3.05, 0, 2.6], [2.95, 0, 2.38], [2.75, 0, 2.2], [2.57, 0, 1.8]])
    newell = np.concatenate([newell, [[2.4, 0, 1.4], [2.0, 0, 1.05], [0.0, 0, 1.0]]])
    path = newell / scale - TEAPOT_CENTRE
    ways = np.diff(path, axis=0)
    assert (cast(teapot(), path[:-1], ways).distance > 1).all()


def test_rays_enter_and_leave_by_turns() -> None:
    solid = teapot()
    scene = build_scene(solid.vertices, solid.triangles)
    normals = face_normals(solid)
    origins, targets = on_sphere(20_000, 3, radius=2.0), on_sphere(20_000, 4, radius=0.6)
    ways = targets - origins
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    inside = np.zeros(len(origins), bool)
    right = np.ones(len(origins), bool)
    crossed = 0
    here, alive = origins.copy(), np.arange(len(origins))
    while len(alive):
        hit = first_hits(scene, here[alive], ways[alive])
        met = np.isfinite(hit.distance)
        right[alive[~met]] &= ~inside[alive[~met]]  # a line that ends has left
        alive = alive[met]
        crossed += len(alive)
        leaves = np.einsum("ni,ni->n", ways[alive], normals[hit.triangle[met]]) > 0
        right[alive] &= leaves == inside[alive]
        inside[alive] = ~leaves
        here[alive] += ways[alive] * (hit.distance[met, None] + 2e-6)
    assert crossed > 2 * len(origins)
    assert (~right).mean() < 0.002


def test_the_teapots_normals_are_smooth_but_where_parts_meet() -> None:
    solid = teapot()
    normals, faces = solid.corner_normals.astype(np.float64), face_normals(solid)
    agreement = np.einsum("fci,fi->fc", normals, faces)
    assert agreement.min() > 0.7  # never turned away, on the slivers along the seams neither
    start, end = solid.triangles, np.roll(solid.triangles, -1, axis=1)
    corner = np.stack([start.ravel(), end.ravel()], axis=-1)
    order = np.lexsort(np.sort(corner, axis=1).T)
    first, second = order[::2], order[1::2]  # half-edges: this one's start is the other's end
    follower = 3 * (second // 3) + (second + 1) % 3
    flat = normals.reshape(-1, 3)
    jump = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", flat[first], flat[follower]), -1, 1)))
    length = np.linalg.norm(
        solid.vertices[corner[first, 0]] - solid.vertices[corner[first, 1]], axis=1
    )
    creased = jump > 1
    assert creased.any()
    assert jump[creased].min() > 5
    # The groove's two edges, the hollow's corners below it, and where parts meet: about 20 long.
    assert 10 < length[creased].sum() < 25
    assert length[creased].sum() / length.sum() < 0.05


@pytest.mark.parametrize(
    ("segments", "thickness", "reason"),
    [
        (3, 0.035, "segments is 3; expected at least 4"),
        (8, 0.004, "thickness is 0.004 radii; expected 0.005 to 0.08"),
        (8, float("nan"), "thickness is nan"),
    ],
)
def test_teapots_that_cannot_be_blown(segments: int, thickness: float, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        glass_teapot(segments, thickness)
