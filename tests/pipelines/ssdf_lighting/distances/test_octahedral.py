"""The octahedral square against counting, quadrature, great circles and the sphere's topology."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipelines.ssdf_lighting.distances.octahedral import (
    bilinear_taps,
    delaunay_triangles,
    directions_of,
    resolution_of,
    solid_angles,
    square_of,
    texel_directions,
)

Floats = NDArray[np.float64]

RESOLUTIONS = [4, 6, 16, 64]
places = st.floats(-1, 1)
coordinates = st.floats(-1, 1).filter(lambda x: x == 0 or abs(x) > 1e-9)


def unit_vectors(count: int, seed: int = 0) -> Floats:
    vectors = np.random.default_rng(seed).standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def angles(one: Floats, other: Floats) -> Floats:
    return 2 * np.arcsin(np.minimum(np.linalg.norm(one - other, axis=-1) / 2, 1.0))


# ---- directions and the square ---------------------------------------------------------------


@given(coordinates, coordinates, coordinates, st.floats(1e-3, 1e3))
@settings(max_examples=300)
def test_directions_come_back_from_the_square(x: float, y: float, z: float, length: float) -> None:
    vector = np.array([x, y, z])
    assume(np.abs(vector).max() > 1e-3)
    place = square_of(length * vector)
    assert (np.abs(place) <= 1 + 1e-12).all()
    np.testing.assert_allclose(
        directions_of(place), vector / np.linalg.norm(vector), rtol=0, atol=1e-12
    )


@given(places, places)
@settings(max_examples=300)
def test_places_come_back_from_the_sphere(x: float, y: float) -> None:
    """Inside the square; on its border two places are one direction."""
    assume(max(abs(x), abs(y)) < 1 - 1e-9)
    direction = directions_of([x, y])
    assert np.linalg.norm(direction) == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(square_of(direction), [x, y], rtol=0, atol=1e-12)


def test_axes_lie_where_the_description_says() -> None:
    """z in the middle, x to the right, y downwards, -z in all four corners."""
    np.testing.assert_allclose(
        directions_of([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]),
        [(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)],
    )
    np.testing.assert_allclose(
        directions_of([(1, 1), (1, -1), (-1, 1), (-1, -1)]), [(0, 0, -1)] * 4, atol=1e-15
    )
    n = 6
    grid = texel_directions(n).reshape(n, n, 3)
    assert (grid[:, n // 2 :, 0] > 0).all()
    assert (grid[:, : n // 2, 0] < 0).all()
    assert (grid[n // 2 :, :, 1] > 0).all()
    assert (grid[: n // 2, :, 1] < 0).all()
    upper = np.add.outer(np.abs(np.arange(n) - 2.5), np.abs(np.arange(n) - 2.5)) < 3
    np.testing.assert_array_equal(grid[..., 2] > 1e-12, upper)


@given(places)
def test_the_border_is_glued_to_itself_about_its_middle(along: float) -> None:
    for side in (-1.0, 1.0):
        for one, other in [((side, along), (side, -along)), ((along, side), (-along, side))]:
            np.testing.assert_allclose(directions_of(one), directions_of(other), atol=1e-15)


@pytest.mark.parametrize("n", RESOLUTIONS)
def test_texel_directions_are_different_and_even_about_the_origin(n: int) -> None:
    found = texel_directions(n)
    assert found.shape == (n * n, 3)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-14)
    distance, _ = cKDTree(found).query(found, k=2)
    assert distance[:, 1].min() > 0.5 / n
    opposite, _ = cKDTree(found).query(-found)
    np.testing.assert_allclose(opposite, 0, atol=1e-14)
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 0


# ---- texels ----------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [*RESOLUTIONS, 128])
def test_solid_angles_sum_to_the_sphere_and_differ_five_to_one(n: int) -> None:
    found = solid_angles(n)
    assert found.shape == (n * n,)
    assert found.sum() == pytest.approx(4 * math.pi, rel=1e-12)
    assert (found > 0).all()
    if n >= 64:
        assert found.max() / found.min() == pytest.approx(3**1.5, rel=0.1)
    grid = found.reshape(n, n)
    for alike in (grid.T, grid[::-1], grid[:, ::-1]):
        np.testing.assert_allclose(alike, grid, rtol=1e-9)


@pytest.mark.parametrize("n", [4, 6, 10])
def test_solid_angles_are_the_integrals_of_the_map_over_the_texels(n: int) -> None:
    """Gauss-Legendre quadrature of |d1 x d2| / r³ over both halves of each texel, as cut by the
    octahedron's edges, where the integrand has kinks."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    s, t = (nodes + 1) / 2, (nodes + 1) / 2
    s, t = (part.ravel() for part in np.meshgrid(s, t, indexing="ij"))
    w = np.multiply.outer(weights, weights).ravel() / 4 * s  # Duffy: (s, s t) is a triangle
    a, b = s * (1 - t), s * t

    def integral(corner: Floats, one: Floats, other: Floats) -> float:
        at = corner + np.multiply.outer(a, one - corner) + np.multiply.outer(b, other - corner)
        # Within the triangle the map to the octahedron is linear: take its slopes from corners.
        x, y = at.T
        z = 1 - np.abs(x) - np.abs(y)
        radius = np.where(z < 0, np.hypot(1 - np.abs(x), 1 - np.abs(y)), np.hypot(x, y))
        length = np.sqrt(radius**2 + z**2)
        # A face of the octahedron: distance 1 / sqrt(3) from the origin, sqrt(3) times as large
        # as its shadow: dω = sqrt(3) dx dy / (sqrt(3) length³).
        doubled = abs(np.linalg.det(np.stack([one - corner, other - corner])))
        return float((w * doubled / length**3).sum())

    expected = np.empty((n, n))
    steps = np.arange(n + 1) * 2 / n - 1
    for row in range(n):
        for column in range(n):
            left, right, top, bottom = steps[[column, column + 1, row, row + 1]]
            nw, ne = np.array([left, top]), np.array([right, top])
            sw, se = np.array([left, bottom]), np.array([right, bottom])
            if (left + right) * (top + bottom) > 0:
                halves = [(nw, ne, sw), (se, ne, sw)]
            else:
                halves = [(ne, nw, se), (sw, nw, se)]
            expected[row, column] = sum(integral(*half) for half in halves)
    np.testing.assert_allclose(solid_angles(n).reshape(n, n), expected, rtol=1e-10)


def test_solid_angles_are_shares_of_directions_drawn_evenly() -> None:
    n, drawn = 6, 400_000
    places = (square_of(unit_vectors(drawn)) + 1) * (n / 2)
    column, row = np.minimum(places.astype(int), n - 1).T
    counts = np.bincount(row * n + column, minlength=n * n)
    expected = drawn * solid_angles(n) / (4 * math.pi)
    chi_squared = ((counts - expected) ** 2 / expected).sum()
    assert chi_squared < n * n + 5 * math.sqrt(2 * n * n)
    even = drawn / (n * n)
    assert ((counts - even) ** 2 / even).sum() > 10_000  # the test can tell


@pytest.mark.parametrize("n", [4, 6, 16])
def test_borders_of_texels_are_arcs_of_great_circles(n: int) -> None:
    """Between crossings of the octahedron's edges: never inside a side of a texel."""
    steps = np.arange(n + 1) * 2 / n - 1
    share = np.linspace(0, 1, 7)
    for line in steps:
        for first in steps[:-1]:
            along = first + share * 2 / n
            for side in (
                np.stack([along, np.full_like(along, line)], -1),
                np.stack([np.full_like(along, line), along], -1),
            ):
                arc = directions_of(side)
                normal = np.cross(arc[0], arc[-1])
                normal /= np.linalg.norm(normal)
                np.testing.assert_allclose(arc @ normal, 0, atol=1e-14)


@pytest.mark.parametrize("n", [4, 16, 64, 384])
def test_resolutions_of_square_counts(n: int) -> None:
    assert resolution_of(n * n) == n


@pytest.mark.parametrize("count", [-16, 0, 1, 4, 9, 15, 17, 25, 4095, 4097, 63 * 63])
def test_other_counts_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match=rf"^directions is {count}; expected the square of an"):
        resolution_of(count)


# ---- Delaunay triangles ----------------------------------------------------------------------


@pytest.mark.parametrize("n", RESOLUTIONS)
def test_triangles_are_a_closed_surface_around_the_sphere(n: int) -> None:
    corners = delaunay_triangles(n)
    points = texel_directions(n)
    assert len(corners) == 2 * n * n - 4  # Euler: V - E + F = 2 with 2 E = 3 F
    assert (np.bincount(corners.ravel(), minlength=n * n) >= 3).all()
    sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    directed = sides[:, 0].astype(np.int64) * n * n + sides[:, 1]
    assert len(np.unique(directed)) == len(directed)
    back = sides[:, 1].astype(np.int64) * n * n + sides[:, 0]
    np.testing.assert_array_equal(np.sort(directed), np.sort(back))
    # Every triangle faces outwards, and together they cover the sphere once.
    a, b, c = points[corners].transpose(1, 0, 2)
    volume = np.einsum("fi,fi->f", a, np.cross(b, c))
    assert (volume > -1e-12).all()
    sums = 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1)
    assert (2 * np.arctan2(volume, sums)).sum() == pytest.approx(4 * math.pi, rel=1e-9)


@pytest.mark.parametrize("n", RESOLUTIONS)
def test_circles_around_triangles_are_empty(n: int) -> None:
    """Brute force: no direction lies beyond the plane of a triangle."""
    points, corners = texel_directions(n), delaunay_triangles(n)
    a, b, c = points[corners].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    level = np.einsum("fi,fi->f", normal, a)
    for first in range(0, len(corners), 1024):
        block = slice(first, first + 1024)
        over = points @ normal[block].T - level[block]
        assert over.max() < 1e-9


# ---- taps ------------------------------------------------------------------------------------


@given(coordinates, coordinates, coordinates, st.sampled_from(RESOLUTIONS))
@settings(max_examples=200)
def test_weights_are_shares_of_four_near_texels(x: float, y: float, z: float, n: int) -> None:
    vector = np.array([x, y, z])
    assume(np.abs(vector).max() > 1e-3)
    vector /= np.linalg.norm(vector)
    found = bilinear_taps(vector, n)
    assert found.texels.shape == found.weights.shape == (4,)
    assert found.weights.sum() == pytest.approx(1, abs=1e-12)
    assert (found.weights >= -1e-12).all()
    assert ((found.texels >= 0) & (found.texels < n * n)).all()
    # Across the square's border, too, they are near on the sphere: within a texel's longest
    # diagonal, (1, 1, -2) 2 / n at 1 / sqrt(3) from the origin, in the middle of a face.
    away = angles(texel_directions(n)[found.texels], vector)
    assert away[found.weights > 1e-9].max() < math.sqrt(18) * 2 / n * (1 + 1e-6)


@pytest.mark.parametrize("n", RESOLUTIONS)
def test_middles_of_texels_are_read_exactly(n: int) -> None:
    found = bilinear_taps(texel_directions(n), n)
    values = np.random.default_rng(n).standard_normal(n * n)
    np.testing.assert_allclose(
        (values[found.texels] * found.weights).sum(axis=1), values, atol=1e-11
    )


@pytest.mark.parametrize("n", [4, 16])
def test_what_is_read_is_continuous_all_over_the_sphere(n: int) -> None:
    """Random values: a wrong neighbour is a step of about 1. Directions on both sides of the
    folds, of the square's border and of the lines between middles of texels."""
    rng = np.random.default_rng(n)
    values = rng.standard_normal(n * n)

    def read(directions: Floats) -> Floats:
        found = bilinear_taps(directions, n)
        return (values[found.texels] * found.weights).sum(axis=-1)

    on_lines = rng.uniform(-1, 1, (3000, 3))
    on_lines[:1000, rng.integers(0, 3, 1)] = 0  # the planes between the octants
    for axis in range(3):
        on_lines[axis * 500 : (axis + 1) * 500, axis] = 0
    between = (rng.integers(0, n, 1000) + 0.5) * 2 / n - 1
    on_lines[2000:] = directions_of(np.stack([between, rng.uniform(-1, 1, 1000)], -1))
    on_lines /= np.linalg.norm(on_lines, axis=1, keepdims=True)
    aside = 1e-7 * rng.standard_normal(on_lines.shape)
    slope = 2 * n * np.abs(values).max()  # of the interpolation, at most, with some room
    steps = np.abs(read(on_lines + aside) - read(on_lines - aside))
    assert steps.max() < 5 * slope * 1e-6
    # And everywhere around the border, where both readings are of one direction.
    along = rng.uniform(-1, 1, 500)
    for side in (-1.0, 1.0):
        border = np.stack([np.full(500, side), along], -1)
        just_inside = [
            directions_of(border * [1 - 1e-9, 1]) for border in (border, border * [1, -1])
        ]
        np.testing.assert_allclose(read(just_inside[0]), read(just_inside[1]), atol=1e-6)


def test_a_smooth_function_is_read_with_an_error_that_falls_by_four() -> None:
    directions = unit_vectors(4000)

    def smooth(ways: Floats) -> Floats:
        return np.sin(2 * ways[..., 0]) + ways[..., 1] * ways[..., 2]

    errors = []
    for n in (16, 32, 64):
        found = bilinear_taps(directions, n)
        read = (smooth(texel_directions(n))[found.texels] * found.weights).sum(axis=1)
        errors.append(float(np.sqrt(((read - smooth(directions)) ** 2).mean())))
    # The map has kinks along the octahedron's edges, on a share of 1 / n of the sphere.
    assert errors[0] / errors[1] > 3
    assert errors[1] / errors[2] > 3
    assert errors[2] < 2e-3
