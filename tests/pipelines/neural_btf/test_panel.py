"""The panel against its own formula, seen through a pinhole camera written down a second time."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb
from pipelines.light.directions import unit_vectors
from pipelines.neural_btf.panel import (
    BACKGROUND,
    LIGHT_THETA,
    Frames,
    draw_frames,
    folded_panel,
    moving_lights,
)

WIDTH, HEIGHT = 128, 96


def height_of(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    return 0.05 * np.sin(2.3 * math.pi * (x + 0.12 * np.sin(2 * y)))


def normals_of(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    step = 1e-5
    slope_x = (height_of(x + step, y) - height_of(x - step, y)) / (2 * step)
    slope_y = (height_of(x, y + step) - height_of(x, y - step)) / (2 * step)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=-1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


class Seen(NamedTuple):
    """Where the pixels' middle rays meet the surface."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    inside: NDArray[np.bool_]
    """Well on the panel."""
    outside: NDArray[np.bool_]
    """Well beside it."""


def pinhole() -> Seen:
    """From 3.6 away, 62° above the horizon, from -y; 24° are the picture's height."""
    above, half = math.radians(62), math.tan(math.radians(12))
    eye = 3.6 * np.array([0, -math.cos(above), math.sin(above)])
    forward, right = -eye / 3.6, np.array([1.0, 0, 0])
    up = np.cross(right, forward)
    across = ((np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1) * half * WIDTH / HEIGHT
    down = (1 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2) * half
    rays = forward + across[None, :, None] * right + down[:, None, None] * up
    z = np.zeros((HEIGHT, WIDTH))
    for _ in range(60):  # the folds are shallow: a fixed point
        place = eye + rays * ((z - eye[2]) / rays[..., 2])[..., None]
        z = height_of(place[..., 0], place[..., 1])
    x, y = place[..., 0], place[..., 1]
    edge = np.maximum(np.abs(x), np.abs(y) / 0.75)
    return Seen(x, y, edge < 0.97, edge > 1.03)


class FakeBtf:
    """Answers as a material would; remembers what it was asked."""

    def __init__(self, answer: Any, height: int = 4, width: int = 4) -> None:
        self.answer, self.height, self.width = answer, height, width
        self.asked: list[tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]] = []

    def radiance(
        self, texels: NDArray[np.int64], light: NDArray[np.float64], view: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Grey radiance (n, 3) of texels."""
        self.asked.append((texels, light, view))
        grey = np.asarray(self.answer(texels, light, view), np.float32)
        return np.broadcast_to(grey[:, None], (len(texels), 3))


def lambertian(texels: Any, light: NDArray[np.float64], view: Any) -> NDArray[np.float64]:
    return light[:, 2]


def frames_of(
    btf: FakeBtf, lights: NDArray[np.float64], *, tiles: float = 2.0, supersampling: int = 1
) -> Frames:
    return draw_frames(
        btf,  # type: ignore[arg-type]
        lights, width=WIDTH, tiles=tiles, supersampling=supersampling,
        progress=lambda share: None,
    )  # fmt: skip


# ---- lights and surface ----------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 4, 24])
def test_lights_go_once_around_the_panel_from_the_upper_left(count: int) -> None:
    vectors = unit_vectors(moving_lights(count))
    np.testing.assert_allclose(vectors[:, 2], math.cos(math.radians(50)))
    assert vectors[0, 0] == pytest.approx(-vectors[0, 1])
    assert vectors[0, 1] > 0
    level = vectors[:, :2] / math.sin(LIGHT_THETA)
    nearest = np.sort(level @ level.T, axis=1)
    if count > 2:
        np.testing.assert_allclose(level.sum(axis=0), 0, atol=1e-12)
        np.testing.assert_allclose(nearest[:, -2], math.cos(2 * math.pi / count), atol=1e-12)
        turn = level[0, 0] * level[1, 1] - level[0, 1] * level[1, 0]
        assert turn < 0  # clockwise: over the top to the right


def test_vertices_lie_on_the_folds_and_fill_the_panel() -> None:
    x, y, z = folded_panel(3, 1.0).vertices.T
    np.testing.assert_allclose(z, height_of(x, y), atol=1e-12)
    assert (x.min(), x.max(), y.min(), y.max()) == (-1, 1, -0.75, 0.75)


def test_normals_are_square_to_the_surface_and_point_to_the_viewer() -> None:
    panel = folded_panel(3, 1.0)
    x, y, _ = panel.vertices.T
    np.testing.assert_allclose(panel.normals, normals_of(x, y), atol=1e-8)


def test_tangents_lie_on_the_surface_along_u() -> None:
    """A small step along the tangent changes u and leaves v and the surface as they are."""
    panel = folded_panel(3, 1.0)
    np.testing.assert_allclose(np.linalg.norm(panel.tangents, axis=1), 1)
    np.testing.assert_allclose(np.sum(panel.tangents * panel.normals, axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(panel.tangents[:, 1], 0, atol=1e-12)  # v goes with y alone
    assert (panel.tangents[:, 0] > 0.9).all()


def test_triangles_face_the_viewer_and_cover_the_panel_once() -> None:
    panel = folded_panel(3, 1.0)
    a, b, c = (panel.vertices[panel.triangles[:, corner], :2] for corner in range(3))
    (ab_x, ab_y), (ac_x, ac_y) = (b - a).T, (c - a).T
    areas = (ab_x * ac_y - ab_y * ac_x) / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(2 * 1.5)


@pytest.mark.parametrize(("tiles", "aspect"), [(1, 1.0), (3.5, 0.5), (2, 2.0)])
def test_tiles_keep_their_shape(tiles: float, aspect: float) -> None:
    panel = folded_panel(tiles, aspect)
    u, v = panel.uvs.T
    assert np.ptp(u) == pytest.approx(tiles)
    tile_width, tile_height = 2 / np.ptp(u), 1.5 / np.ptp(v)
    assert tile_height / tile_width == pytest.approx(aspect)


# ---- pictures --------------------------------------------------------------------------------


def test_a_lambertian_cloth_is_shaded_by_the_cosine_with_one_exposure() -> None:
    """Also where the light is lower than 75° from a fold's normal, down to its horizon."""
    seen = pinhole()
    lights = np.radians([[50, 135], [50, 300], [20, 0], [82, 180]])
    pictures = decode_srgb(frames_of(FakeBtf(lambertian), lights).pictures / 255)[..., 0]
    cosines = np.maximum(
        np.einsum("yxk,lk->lyx", normals_of(seen.x, seen.y), unit_vectors(lights)), 0
    )
    assert (cosines[3][seen.inside] == 0).any()
    factor = 0.8 / np.quantile(cosines[:, ~seen.outside], 0.99)
    shown = cosines[:, seen.inside] * factor < 0.99
    expected = (cosines[:, seen.inside] * factor)[shown]
    np.testing.assert_allclose(pictures[:, seen.inside][shown], expected, atol=0.02)


def test_beside_the_cloth_is_the_background() -> None:
    found = frames_of(FakeBtf(lambertian), moving_lights(1))
    beside = decode_srgb(found.pictures[0][pinhole().outside] / 255)
    np.testing.assert_allclose(beside, np.broadcast_to(BACKGROUND, beside.shape), atol=2e-3)


@pytest.mark.parametrize("supersampling", [1, 2])
def test_the_cloth_covers_what_the_camera_sees_of_it(supersampling: int) -> None:
    seen = pinhole()
    share = float((np.maximum(np.abs(seen.x), np.abs(seen.y) / 0.75) < 1).mean())
    found = frames_of(FakeBtf(lambertian), moving_lights(1), supersampling=supersampling)
    assert found.pictures.shape == (1, HEIGHT, WIDTH, 3)
    assert found.pictures.dtype == np.uint8
    assert found.coverage == pytest.approx(share, abs=0.01)
    assert found.coverage > 0.3


@pytest.mark.parametrize("tiles", [2.0, 3.0])
@pytest.mark.parametrize(("height", "width"), [(4, 4), (2, 4)])
def test_the_first_texel_is_at_the_upper_left_of_every_tile(
    tiles: float, height: int, width: int
) -> None:
    btf = FakeBtf(lambda texels, light, view: texels == 0, height, width)
    picture = frames_of(btf, moving_lights(1), tiles=tiles).pictures[0, ..., 0]
    seen = pinhole()
    right = np.mod(seen.x * tiles / 2, 1)  # share of a tile, from its left
    below = np.mod(-seen.y * tiles / 2 * width / height, 1)  # and from its upper edge
    first = (right < 1 / width) & (below < 1 / height)
    margin = 0.04
    clear = seen.inside.copy()
    for place, count in ((right, width), (below, height)):
        clear &= np.abs(np.mod(place * count + 0.5, 1) - 0.5) > margin * count
    assert clear[seen.inside].mean() > 0.3
    assert first[clear].any()
    np.testing.assert_array_equal(picture[clear] > 128, first[clear])


def test_directions_are_unit_and_no_lower_than_was_measured() -> None:
    btf = FakeBtf(lambertian)
    lights = np.radians([[50, 135], [85, 180], [85, 0]])
    frames_of(btf, lights)
    assert len(btf.asked) == 3
    for texels, light, view in btf.asked:
        assert texels.min() >= 0
        assert texels.max() < 16
        for vectors in (light, view):
            np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-6)
            assert vectors[:, 2].min() >= math.cos(math.radians(75)) - 1e-9
    lowest = [light[:, 2].min() for _, light, _ in btf.asked]
    assert lowest[1] == pytest.approx(math.cos(math.radians(75)))


def test_directions_are_given_in_the_frame_of_the_cloth() -> None:
    """x along u, y along v, z up from each fold; the view is that to the camera."""
    btf = FakeBtf(lambertian)
    frames_of(btf, np.radians([[30, 70]]))
    _, light, view = btf.asked[0]
    seen = pinhole()
    edge = np.maximum(np.abs(seen.x), np.abs(seen.y) / 0.75)
    assert (edge < 1).sum() == len(light)  # no pixel of the outline is drawn otherwise
    x, y = seen.x[edge < 1], seen.y[edge < 1]
    up = normals_of(x, y)
    along = np.stack([up[:, 2], 0 * x, -up[:, 0]], axis=-1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    frame = np.stack([along, np.cross(up, along), up], axis=1)
    eye = 3.6 * np.array([0, -math.cos(math.radians(62)), math.sin(math.radians(62))])
    to_eye = eye - np.stack([x, y, height_of(x, y)], axis=-1)
    to_eye /= np.linalg.norm(to_eye, axis=1, keepdims=True)
    np.testing.assert_allclose(light, frame @ unit_vectors((math.radians(30), math.radians(70))),
                               atol=0.02)  # fmt: skip
    np.testing.assert_allclose(view, np.einsum("nij,nj->ni", frame, to_eye), atol=0.02)


def test_a_brighter_material_is_exposed_to_the_same_picture() -> None:
    one = frames_of(FakeBtf(lambertian), moving_lights(2))
    bright = frames_of(FakeBtf(lambda t, light, v: 50 * light[:, 2]), moving_lights(2))
    np.testing.assert_array_equal(one.pictures, bright.pictures)
    assert (one.pictures[0] != one.pictures[1]).any()
