"""The stage against closed forms: Lambert, the pinhole, texture filters, the sky, box averages."""

from __future__ import annotations

import hashlib
import itertools
import math
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing import graphics_driver
from pipelines.drawing.glsl import Shader
from pipelines.drawing.graphics_driver import NoGraphicsError
from pipelines.drawing.stage import (
    Camera,
    Light,
    Stage,
    Vector,
    Wrap,
    fitting_distance,
    orbit,
    surface,
    texture,
)
from pipelines.geometry.rays import build_scene, first_hits

Picture = NDArray[np.float32]
CHECKOUT = Path(__file__).parents[3]
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
UPWARDS = np.tile([0.0, 0.0, 1.0], (4, 1))
FROM_ABOVE = orbit((0, 0, 0), 5, azimuth=-90, elevation=90, height=2)
"""Shows the square CORNERS from edge to edge, +x to the right and +y up."""


def shot(
    *actors: Any,
    lights: tuple[Light, ...] = (),
    camera: Camera = FROM_ABOVE,
    size: tuple[int, int] = (8, 8),
    background: Any = (0.0, 0.0, 0.0),
    supersampling: int = 1,
) -> Picture:
    """One picture; size = (width, height)."""
    with Stage(*size, background=background, supersampling=supersampling) as stage:
        stage.add(*actors)
        stage.light(*lights)
        stage.look(camera)
        return stage.radiance()


def unlit_square(colour: Vector = (1.0, 1.0, 1.0), size: float = 1.0, height: float = 0.0) -> Any:
    """A square on z = height that shows its colour."""
    return surface(CORNERS * size + [0, 0, height], TRIANGLES, colour=colour, lit=False)


def painted_square(
    image: Any, *, span: tuple[float, float] = (0.0, 1.0), shown: str = "texel.rgb"
) -> Any:
    """A square from above that shows what its texture says at texture coordinates in ``span``."""
    uv = span[0] + (CORNERS[:, :2] + 1) / 2 * (span[1] - span[0])
    shader = Shader(
        vertex={"TCoord::Dec": "in vec2 uv; out vec2 uvOut;", "TCoord::Impl": "uvOut = uv;"},
        fragment={
            "TCoord::Dec": "in vec2 uvOut;",
            "Color::Impl": f"""//VTK::Color::Impl
  vec4 texel = texture(image, uvOut);
  ambientColor = vec3(0.0);
  diffuseColor = {shown};
""",
        },
    )
    return surface(
        CORNERS,
        TRIANGLES,
        attributes={"uv": uv},
        textures={"image": image},
        shader=shader,
        lit=False,
    )


def unit(vector: Any) -> NDArray[np.float64]:
    return np.asarray(vector, float) / np.linalg.norm(vector)


def direction(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Unit vector; degrees, azimuth from +x towards +y."""
    around, above = math.radians(azimuth), math.radians(elevation)
    return np.array(
        [math.cos(above) * math.cos(around), math.cos(above) * math.sin(around), math.sin(above)]
    )


# ---- light -----------------------------------------------------------------------------------


def test_a_lambertian_plane_reflects_albedo_times_cosine() -> None:
    albedo, colour = (0.2, 0.5, 0.8), (1.0, 2.5, 0.3)
    rng = np.random.default_rng(0)
    with Stage(6, 6) as stage:
        stage.add(surface(CORNERS, TRIANGLES, normals=UPWARDS, colour=albedo))
        stage.look(FROM_ABOVE)
        for towards in [*rng.normal(size=(12, 3)), np.array([0.0, 0.0, 1.0])]:
            stage.light(Light((towards[0], towards[1], towards[2]), colour))
            cosine = max(0.0, float(towards[2] / np.linalg.norm(towards)))
            expected = np.broadcast_to(np.multiply(albedo, colour) * cosine, (6, 6, 3))
            np.testing.assert_allclose(stage.radiance()[..., :3], expected, atol=1e-5)


def test_lights_add_up_and_replace_the_ones_before() -> None:
    first, second = Light((1, 0, 1), (1.0, 0.0, 0.5)), Light((0, -3, 4), (0.0, 2.0, 0.5))
    with Stage(4, 4) as stage:
        stage.add(surface(CORNERS, TRIANGLES, normals=UPWARDS))
        stage.look(FROM_ABOVE)
        stage.light(Light(colour=(9.0, 9.0, 9.0)))
        stage.light(first, second)
        cosines = math.sqrt(0.5), 0.8
        expected = [cosines[0], 2 * cosines[1], 0.5 * sum(cosines)]
        np.testing.assert_allclose(stage.radiance()[2, 2, :3], expected, atol=1e-5)


@pytest.mark.parametrize("elevation", [90.0, 60.0, 25.0])
def test_a_light_along_the_view_shines_from_the_camera(elevation: float) -> None:
    plane = surface(CORNERS * 50, TRIANGLES, normals=UPWARDS)
    camera = orbit((0, 0, 0), 5, 30, elevation, height=1)
    picture = shot(plane, lights=(Light(),), camera=camera)
    np.testing.assert_allclose(picture[..., :3], math.sin(math.radians(elevation)), atol=1e-5)


def test_without_lights_a_lit_surface_is_black_and_an_unlit_one_is_not() -> None:
    with Stage(4, 4) as stage:  # light() was never called
        stage.add(surface(CORNERS, TRIANGLES, normals=UPWARDS))
        stage.look(FROM_ABOVE)
        np.testing.assert_array_equal(stage.radiance()[2, 2], [0, 0, 0, 1])
        stage.light(Light())
        np.testing.assert_allclose(stage.radiance()[2, 2], 1.0)
        stage.light()
        np.testing.assert_array_equal(stage.radiance()[2, 2], [0, 0, 0, 1])
    np.testing.assert_allclose(shot(unlit_square((0.1, 0.2, 0.3)))[2, 2], [0.1, 0.2, 0.3, 1])


def test_normals_are_interpolated() -> None:
    """Between normals that lean to either side the cosine is that of their normalised mean."""
    lean = np.where(CORNERS[:, :1] < 0, [[-0.6, 0.0, 0.8]], [[0.6, 0.0, 0.8]])
    light = unit([1, 0, 2])
    picture = shot(
        surface(CORNERS, TRIANGLES, normals=lean), lights=(Light(tuple(light)),), size=(16, 16)
    )
    x = (np.arange(16) + 0.5) / 8 - 1
    normal = np.stack([0.6 * x, 0 * x, np.full(16, 0.8)], axis=1)
    expected = np.maximum(normal @ light / np.linalg.norm(normal, axis=1), 0)
    np.testing.assert_allclose(picture[0, :, 0], expected, atol=1e-5)


def test_a_mesh_without_normals_has_those_of_its_triangles() -> None:
    light = unit([1, -1, 3])
    tilted = CORNERS @ np.array([[1, 0, 0.5], [0, 1, -0.25], [0, 0, 1]])
    picture = shot(surface(tilted, TRIANGLES), lights=(Light(tuple(light)),))
    expected = unit([-0.5, 0.25, 1]) @ light
    np.testing.assert_allclose(picture[..., 0], expected, atol=1e-5)


def test_radiance_beyond_white_survives_and_the_frame_is_its_encoding() -> None:
    colours = np.random.default_rng(1).uniform(0, 1.4, (8, 8, 3)).astype(np.float32)
    colours[0, 0] = (0.0, 1.0, 300.0)
    square = painted_square(texture(colours, interpolate=False))
    with Stage(8, 8) as stage:
        stage.add(square)
        stage.look(FROM_ABOVE)
        np.testing.assert_array_equal(stage.radiance()[..., :3], colours)
        frame = stage.frame()
    assert frame.dtype == np.uint8
    clipped = np.clip(colours.astype(np.float64), 0, 1)
    encoded = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    np.testing.assert_array_equal(frame, np.floor(encoded * 255 + 0.5))


# ---- cameras ---------------------------------------------------------------------------------

ORBITS = [(0.0, 0.0), (90.0, 0.0), (-90.0, 30.0), (135.0, -50.0), (20.0, 75.0), (200.0, 89.0)]


@pytest.mark.parametrize(("azimuth", "elevation"), ORBITS)
def test_an_orbiting_camera_stands_where_the_angles_say(azimuth: float, elevation: float) -> None:
    camera = orbit((1, 2, 3), 7, azimuth, elevation)
    expected = np.array([1, 2, 3]) + 7 * direction(azimuth, elevation)
    np.testing.assert_allclose(camera.position, expected, atol=1e-12)
    assert camera.target == (1, 2, 3)
    assert camera.up == (0, 0, 1)


def projected(point: Any, camera: Camera, width: int, height: int) -> NDArray[np.float64]:
    """Column and row of a point: a pinhole, or parallel rays where the camera has a height."""
    forward = unit(np.subtract(camera.target, camera.position))
    right = unit(np.cross(forward, camera.up))
    upward = np.cross(right, forward)
    offset = np.subtract(point, camera.position)
    half = (
        camera.height / 2
        if camera.height is not None
        else (offset @ forward) * math.tan(math.radians(camera.view_angle / 2))
    )
    x, y = offset @ right / half, offset @ upward / half
    return np.array([width / 2 + x * height / 2, height / 2 - y * height / 2])


@pytest.mark.parametrize("height", [None, 3.0])
@pytest.mark.parametrize("size", [(96, 64), (48, 80)])
@pytest.mark.parametrize(("azimuth", "elevation"), [*ORBITS, (-90.0, 90.0), (10.0, -90.0)])
def test_points_are_projected_as_by_a_pinhole(
    azimuth: float, elevation: float, size: tuple[int, int], height: float | None
) -> None:
    """The coverage's centre of mass of a small octahedron is the projection of its centre."""
    camera = orbit((0.2, -0.1, 0.3), 6, azimuth, elevation, view_angle=25, height=height)
    axes = np.concatenate([np.eye(3), -np.eye(3)]) * 0.12
    faces = [[a, b, c] for a, b, c in itertools.product((0, 3), (1, 4), (2, 5))]
    rng = np.random.default_rng(2)
    with Stage(*size, supersampling=4) as stage:
        stage.look(camera)
        for centre in rng.uniform(-0.5, 0.5, (3, 3)):
            ball = surface(axes + centre, faces, lit=False)
            stage.add(ball)
            covered = stage.radiance()[..., 3]
            stage.remove(ball)
            sums = covered.sum(axis=0), covered.sum(axis=1)
            found = [np.average(np.arange(len(line)) + 0.5, weights=line) for line in sums]
            expected = projected(centre, camera, *size)
            np.testing.assert_allclose(found, expected, atol=0.15)
        assert not stage.radiance().any()


@pytest.mark.parametrize("size", [(60, 40), (30, 50)])
@pytest.mark.parametrize(("azimuth", "elevation"), [*ORBITS, (30.0, 90.0), (70.0, -90.0)])
def test_the_fitting_distance_puts_the_outermost_point_on_the_edge(
    azimuth: float, elevation: float, size: tuple[int, int]
) -> None:
    points = np.random.default_rng(9).normal(size=(40, 3)) * [3, 1, 0.3]
    target, lens = (0.5, -1.0, 2.0), 35.0
    distance = fitting_distance(
        points, target, azimuth, elevation, view_angle=lens, aspect=size[0] / size[1]
    )
    camera = orbit(target, distance, azimuth, elevation, view_angle=lens)
    forward = unit(np.subtract(camera.target, camera.position))
    places = np.array([projected(point, camera, *size) for point in points]) / size
    assert ((points - camera.position) @ forward > 0).all()
    assert places.min() > -1e-9
    assert places.max() < 1 + 1e-9
    assert min(places.min(), 1 - places.max()) == pytest.approx(0, abs=1e-9)


def test_straight_down_y_is_up_and_x_to_the_right() -> None:
    marks = surface(np.array([[0.5, 0, 0]]) + CORNERS * 0.2, TRIANGLES, colour=(1, 0, 0), lit=False)
    above = surface(np.array([[0, 0.5, 0]]) + CORNERS * 0.2, TRIANGLES, colour=(0, 1, 0), lit=False)
    picture = shot(marks, above, camera=orbit((0, 0, 0), 5, 77, 90, height=2))
    np.testing.assert_array_equal(picture[4, 6, :3], [1, 0, 0])
    np.testing.assert_array_equal(picture[1, 4, :3], [0, 1, 0])


def test_the_height_of_an_orthographic_picture_is_in_scene_units() -> None:
    """A square 1.5 units high, in a picture 2.4 units high and wider than high."""
    camera = orbit((0, 0, 0), 50, -90, 90, height=2.4)
    covered = shot(unlit_square(size=0.75), camera=camera, size=(100, 80))[..., 3]
    assert covered.any(axis=1).sum() == round(80 * 1.5 / 2.4)
    assert covered.any(axis=0).sum() == round(80 * 1.5 / 2.4)


def test_the_view_angle_is_vertical() -> None:
    distance = 1 / math.tan(math.radians(20))
    camera = orbit((0, 0, 0), distance, -90, 90, view_angle=40)
    covered = shot(unlit_square(), camera=camera, size=(60, 40))[..., 3]
    inside = np.abs(np.arange(60) - 29.5) < 20
    np.testing.assert_array_equal(covered, np.broadcast_to(inside, (40, 60)))


def test_what_is_added_or_moved_away_after_the_camera_was_set_is_not_clipped() -> None:
    with Stage(8, 8) as stage:
        stage.look(orbit((0, 0, 0), 5000, -90, 90, height=2))
        small = unlit_square(size=0.5)
        stage.add(small)
        assert stage.radiance()[4, 4, 3] == 1
        stage.add(unlit_square(height=-4000), unlit_square((0, 1, 0), height=4000))
        np.testing.assert_array_equal(stage.radiance()[4, 4, :3], [0, 1, 0])
        assert stage.radiance()[..., 3].all()


def test_the_nearer_surface_hides_the_farther() -> None:
    near, far = unlit_square((1, 0, 0), 0.5, 0.1), unlit_square((0, 0, 1), 1.0, -0.1)
    for order in ((near, far), (far, near)):
        picture = shot(*order)
        np.testing.assert_array_equal(picture[4, 4], [1, 0, 0, 1])
        np.testing.assert_array_equal(picture[0, 0], [0, 0, 1, 1])


# ---- textures --------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_a_texel_a_pixel_shows_the_picture_with_row_0_at_the_top(
    dtype: type, channels: int
) -> None:
    rng = np.random.default_rng(3)
    image = rng.integers(0, 256, (6, 9, channels)).astype(dtype)
    scale = 255 if dtype is np.uint8 else 1
    grey = channels == 1
    for channel in range(3 if grey else channels):
        shown = f"vec3(texel[{channel}])"
        square = painted_square(texture(image, interpolate=False), shown=shown)
        square.SetScale(9 / 6, 1, 1)
        picture = shot(square, size=(9, 6))
        expected = image[..., 0 if grey else channel] / scale
        np.testing.assert_allclose(picture[..., 0], expected, rtol=1e-6)


def test_texture_coordinates_start_at_the_bottom_left() -> None:
    """Only the lower left quarter of the coordinates is shown."""
    image = np.arange(16, dtype=np.float32).reshape(4, 4, 1)
    square = painted_square(texture(image, interpolate=False), span=(0, 0.5), shown="texel.rrr")
    picture = shot(square, size=(2, 2))
    np.testing.assert_array_equal(picture[..., 0], [[8, 9], [12, 13]])


@pytest.mark.parametrize("channels", [3, 4])
def test_srgb_codes_are_decoded_when_sampled_and_alpha_is_not(channels: int) -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(channels, axis=2)
    value = codes[..., :3] / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    for srgb, expected in ((True, linear), (False, value)):
        image = texture(codes, interpolate=False, srgb=srgb)
        picture = shot(painted_square(image), size=(16, 16))
        # Mesa's own curve is up to a third of a code beside the standard's.
        np.testing.assert_allclose(picture[..., :3], expected, atol=1.5e-3)
        if channels == 4:
            image = texture(codes, interpolate=False, srgb=srgb)
            alpha = shot(painted_square(image, shown="vec3(texel.a)"), size=(16, 16))
            np.testing.assert_allclose(alpha[..., :3], value, atol=1e-6)


def test_every_srgb_code_comes_back_from_the_stage() -> None:
    codes = np.random.default_rng(4).permutation(256).astype(np.uint8).reshape(16, 16, 1)
    codes = codes.repeat(3, axis=2)
    with Stage(16, 16) as stage:
        stage.add(painted_square(texture(codes, interpolate=False, srgb=True)))
        stage.look(FROM_ABOVE)
        np.testing.assert_array_equal(stage.frame(), codes)


def test_codes_are_decoded_before_they_are_filtered() -> None:
    image = np.array([[[0] * 3, [255] * 3]], np.uint8)
    half = shot(painted_square(texture(image, srgb=True)), size=(3, 1))[0, 1, 0]
    assert half == pytest.approx(0.5, abs=4e-3)  # decoding the mean code would give 0.21


def test_float_textures_are_not_clamped() -> None:
    values = [[[-3.5, 1e-7, 6e4], [2.0, 1e30, 0.1]], [[1.0, 1.5, 0.0], [-1e30, 255.0, 7.7]]]
    image = np.array(values, np.float32)
    picture = shot(painted_square(texture(image, interpolate=False)), size=(2, 2))
    np.testing.assert_array_equal(picture[..., :3], image)


def wrapped(index: NDArray[np.int64], size: int, wrap: Wrap) -> NDArray[np.int64]:
    """The texel that stands at an index beyond the edges."""
    if wrap == "clamp":
        return np.clip(index, 0, size - 1)
    if wrap == "repeat":
        return index % size
    there_and_back = index % (2 * size)
    return np.where(there_and_back < size, there_and_back, 2 * size - 1 - there_and_back)


@pytest.mark.parametrize("wrap", ["clamp", "repeat", "mirrored"])
@pytest.mark.parametrize("interpolate", [True, False], ids=["linear", "nearest"])
def test_filters_and_wraps_are_their_closed_forms(wrap: Wrap, interpolate: bool) -> None:
    rng = np.random.default_rng(5)
    image = rng.random((4, 5, 3)).astype(np.float32)
    low, high, pixels = -1.7, 2.6, 61
    square = painted_square(texture(image, wrap=wrap, interpolate=interpolate), span=(low, high))
    picture = shot(square, size=(pixels, pixels))[..., :3]

    bottom_up = image[::-1].astype(np.float64)
    coordinate = low + (np.arange(pixels) + 0.5) / pixels * (high - low)

    def weights(size: int) -> NDArray[np.float64]:
        """(pixel, texel): how much of each texel a pixel shows."""
        place = coordinate * size
        shares = np.zeros((pixels, size))
        every = np.arange(pixels)
        if interpolate:
            first = np.floor(place - 0.5).astype(int)
            part = place - 0.5 - first
            np.add.at(shares, (every, wrapped(first, size, wrap)), 1 - part)
            np.add.at(shares, (every, wrapped(first + 1, size, wrap)), part)
        else:
            shares[every, wrapped(np.floor(place).astype(int), size, wrap)] = 1
        return shares

    expected = np.einsum("ya,xb,abc->yxc", weights(4), weights(5), bottom_up)[::-1]
    # A graphics card may weigh texels in steps of 1/256.
    np.testing.assert_allclose(picture, expected, atol=6e-3 if interpolate else 1e-6)


def test_a_mipmap_averages_what_is_smaller_than_a_pixel() -> None:
    image = np.random.default_rng(10).random((64, 64, 3)).astype(np.float32)
    blocks = image.reshape(4, 16, 4, 16, 3).mean(axis=(1, 3))
    smooth = shot(painted_square(texture(image, mipmap=True)), size=(4, 4))[..., :3]
    np.testing.assert_allclose(smooth, blocks, atol=0.05)
    rough = shot(painted_square(texture(image)), size=(4, 4))[..., :3]
    assert np.abs(rough - blocks).max() > 0.1


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((4, 4, 3)),
        np.zeros((4, 4, 3), np.uint16),
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 5), np.float32),
        np.zeros((4, 4, 0), np.uint8),
    ],
    ids=["float64", "uint16", "no axis of channels", "five channels", "no channels"],
)
def test_a_texture_of_another_type_is_refused(image: NDArray[Any]) -> None:
    with pytest.raises(ValueError, match=r"^texture is .*; expected uint8 or float32 \(y, x,"):
        texture(image)


# ---- attributes and shaders ------------------------------------------------------------------


@pytest.mark.parametrize("components", [1, 2, 3, 4])
def test_attributes_reach_the_vertex_shader(components: int) -> None:
    """Values linear in x and y are interpolated to the same linear function."""
    rng = np.random.default_rng(6)
    factors = rng.normal(size=(2, components)) * 3
    offset = rng.normal(size=components) * 1000
    values = CORNERS[:, :2] @ factors + offset
    kind = "float" if components == 1 else f"vec{components}"
    name = f"{kind} measured"
    x = (np.arange(8) + 0.5) / 4 - 1
    seen = []
    for component in range(components):
        pick = "passed" if components == 1 else f"passed[{component}]"
        shader = Shader(
            vertex={
                "TCoord::Dec": f"in {name}; out {kind} passed;",
                "TCoord::Impl": "passed = measured;",
            },
            fragment={
                "TCoord::Dec": f"in {kind} passed;",
                "Color::Impl": f"//VTK::Color::Impl\ndiffuseColor = vec3({pick});\n",
            },
        )
        given = values[:, 0] if components == 1 else values
        square = surface(
            CORNERS, TRIANGLES, attributes={"measured": given}, shader=shader, lit=False
        )
        seen.append(shot(square)[..., 0])
    expected = (
        x[None, :, None] * factors[0] + (-x)[:, None, None] * factors[1] + offset
    )  # row 0 is y = +1
    np.testing.assert_allclose(np.stack(seen, axis=-1), expected, rtol=1e-5, atol=1e-3)


def test_two_textures_and_a_lit_shader_stand_beside_vtks_own_code() -> None:
    """The shader sets the albedo only; VTK's own code shades it."""
    first = texture(np.full((1, 1, 3), 0.5, np.float32))
    second = texture(np.full((1, 1, 3), 0.25, np.float32))
    code = """//VTK::Color::Impl
  diffuseColor = texture(one, vec2(0.5)).rgb * vec3(1.0, 0.0, 1.0)
               + texture(two, vec2(0.5)).rgb * vec3(0.0, 1.0, 1.0);
"""
    square = surface(
        CORNERS,
        TRIANGLES,
        normals=UPWARDS,
        textures={"one": first, "two": second},
        shader=Shader(fragment={"Color::Impl": code}),
    )
    picture = shot(square, lights=(Light((0, 3, 4)),))
    np.testing.assert_allclose(picture[4, 4, :3], [0.4, 0.2, 0.6], rtol=1e-5)


def test_shaders_see_the_mesh_where_it_is() -> None:
    """VTK would shift a small mesh that lies far away to the origin."""
    shader = Shader(
        vertex={"TCoord::Dec": "out vec3 place;", "TCoord::Impl": "place = vertexMC.xyz;"},
        fragment={
            "TCoord::Dec": "in vec3 place;",
            "Color::Impl": "//VTK::Color::Impl\ndiffuseColor = place;\n",
        },
    )
    centre = np.array([4000.0, -2000.0, 500.0])
    square = surface(CORNERS + centre, TRIANGLES, shader=shader, lit=False)
    picture = shot(square, camera=orbit(tuple(centre), 5, -90, 90, height=2))
    np.testing.assert_allclose(picture[4, 4, :3], centre + np.array([0.125, -0.125, 0]), atol=1e-2)


def test_a_vertex_shader_moves_the_surface() -> None:
    """Half the size by VTK's own position, overwritten."""
    code = "//VTK::PositionVC::Impl\n  gl_Position.xy *= 0.5;\n"
    square = surface(
        CORNERS, TRIANGLES, shader=Shader(vertex={"PositionVC::Impl": code}), lit=False
    )
    covered = shot(square)[..., 3]
    expected = np.zeros((8, 8))
    expected[2:6, 2:6] = 1
    np.testing.assert_array_equal(covered, expected)


# ---- background and coverage -----------------------------------------------------------------


def test_coverage_is_1_on_surfaces_and_0_beside_them() -> None:
    expected = np.zeros((8, 8))
    expected[2:6, 2:6] = 1
    for background in ((0.0, 0.0, 0.0), (0.3, 0.2, 4.0), np.full((4, 8, 3), 0.7, np.float32)):
        picture = shot(unlit_square(size=0.5), background=background)
        np.testing.assert_array_equal(picture[..., 3], expected)
        away = np.asarray(background).reshape(-1, 3)[0]
        np.testing.assert_allclose(picture[0, 0, :3], away, rtol=1e-6)


def test_discarded_fragments_show_the_background() -> None:
    code = "//VTK::Color::Impl\n  if (gl_FragCoord.x < 4.0) discard;\n"
    shader = Shader(fragment={"Color::Impl": code})
    square = surface(CORNERS, TRIANGLES, shader=shader, lit=False)
    picture = shot(square, background=(0.2, 0.4, 0.6))
    np.testing.assert_allclose(picture[:, :4], np.broadcast_to([0.2, 0.4, 0.6, 0], (8, 4, 4)))
    np.testing.assert_array_equal(picture[:, 4:], 1)


def test_a_constant_environment_fills_every_direction() -> None:
    environment = np.empty((16, 32, 3), np.float32)
    environment[:] = (0.5, 2.5, 40.0)
    for azimuth, elevation in [*ORBITS, (0.0, 90.0), (0.0, -90.0)]:
        camera = orbit((3, 2, 1), 4, azimuth, elevation, view_angle=100)
        picture = shot(camera=camera, background=environment)
        np.testing.assert_allclose(picture[..., :3], np.broadcast_to(environment[0, 0], (8, 8, 3)))


def test_the_environment_lies_where_the_stage_says() -> None:
    """An environment that holds its own directions shows every pixel's direction."""
    height, width = 90, 180
    azimuth = 180 - (np.arange(width) + 0.5) / width * 360
    elevation = 90 - (np.arange(height) + 0.5) / height * 180
    grid = [[direction(a, e) for a in azimuth] for e in elevation]
    environment = np.array(grid, np.float32)
    size = (24, 16)
    for around, above in ORBITS:
        camera = orbit((1, -2, 3), 5, around, above, view_angle=60)
        picture = shot(camera=camera, background=environment, size=size)[..., :3]
        for row, column in itertools.product((0, 7, 15), (0, 10, 23)):
            seen = unit(picture[row, column])
            target = np.add(camera.position, seen)
            found = projected(target, camera, *size)
            np.testing.assert_allclose(found, [column + 0.5, row + 0.5], atol=0.1)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (90, 0), (-120, 35), (45, -70)])
def test_a_bright_patch_of_the_sky_appears_where_the_pinhole_puts_it(
    azimuth: int, elevation: int
) -> None:
    environment = np.zeros((180, 360, 3), np.float32)
    column, row = 180 - azimuth, 90 - elevation  # a texel a degree, azimuth 0 in the middle
    environment[row - 3 : row + 3, column - 3 : column + 3] = 5.0
    towards = direction(azimuth, elevation)
    position = np.array([10.0, 20.0, -5.0])
    aside = direction(azimuth + 14, elevation + 9)
    camera = Camera(tuple(position), tuple(position + aside), view_angle=60)
    picture = shot(camera=camera, background=environment, size=(120, 90))
    rows, columns = np.nonzero(picture[..., 0] > 2.5)
    expected = projected(position + towards, camera, 120, 90)
    np.testing.assert_allclose([columns.mean() + 0.5, rows.mean() + 0.5], expected, atol=0.8)


def test_an_environment_is_seen_from_inside_and_not_mirrored() -> None:
    """What is right of the middle of the panorama is to the right of a camera that looks at +x."""
    environment = np.zeros((32, 64, 3), np.float32)
    environment[:, 32:, 0] = 1.0
    environment[:16, :, 1] = 1.0
    picture = shot(camera=Camera((0, 0, 0), (1, 0, 0)), background=environment)
    np.testing.assert_array_equal(picture[6, [1, 6], 0], [0, 1])
    np.testing.assert_array_equal(picture[[1, 6], 6, 1], [1, 0])


def test_zenith_and_nadir_do_not_mix() -> None:
    environment = np.zeros((32, 64, 3), np.float32)
    environment[:16] = 1.0
    for elevation, expected in ((90, 1.0), (-90, 0.0)):
        target = (0, 0, 1 if elevation > 0 else -1)
        camera = Camera((0, 0, 0), target, up=(0, 1, 0), view_angle=4)
        picture = shot(camera=camera, background=environment, size=(9, 9))
        np.testing.assert_array_equal(picture[..., :3], expected)


# ---- supersampling ---------------------------------------------------------------------------


def scene() -> list[Any]:
    """Edges, colours beyond white, a texture and shading."""
    rng = np.random.default_rng(7)
    image = (rng.random((8, 8, 3)) * 3).astype(np.float32)
    triangle = surface(
        [[-0.9, -0.7, 0.3], [0.8, -0.2, 0.1], [-0.1, 0.9, 0.6]],
        [[0, 1, 2]],
        normals=[[0, 0, 1], [0.6, 0, 0.8], [0, 0.6, 0.8]],
        colour=(0.9, 0.4, 0.1),
    )
    square = painted_square(texture(image, wrap="repeat"), span=(0.3, 2.1))
    square.SetScale(0.8)
    return [square, triangle]


SCENE_LIGHTS = (Light((1, 2, 3), (2.0, 1.5, 1.0)), Light())
SCENE_CAMERA = orbit((0, 0, 0), 4, -70, 50)


@pytest.mark.parametrize("n", [2, 3])
def test_supersampling_is_the_box_average_of_a_larger_picture(n: int) -> None:
    environment = np.random.default_rng(8).random((8, 16, 3)).astype(np.float32)
    for background in ((0.1, 0.2, 0.3), environment):
        options = {"lights": SCENE_LIGHTS, "camera": SCENE_CAMERA, "background": background}
        small = shot(*scene(), size=(20, 14), supersampling=n, **options)
        large = shot(*scene(), size=(20 * n, 14 * n), **options)
        expected = large.reshape(14, n, 20, n, 4).mean(axis=(1, 3))
        np.testing.assert_allclose(small, expected, rtol=1e-6)
        assert ((small[..., 3] > 0) & (small[..., 3] < 1)).sum() > 0


def test_light_is_averaged_and_not_its_codes() -> None:
    board = np.indices((16, 16)).sum(axis=0) % 2
    image = board[..., None].repeat(3, axis=2).astype(np.float32)
    with Stage(8, 8, supersampling=2) as stage:
        stage.add(painted_square(texture(image, interpolate=False)))
        stage.look(FROM_ABOVE)
        np.testing.assert_array_equal(stage.frame(), 188)  # 0.5 in linear light


# ---- the same picture, always ----------------------------------------------------------------

_DRAW_AND_HASH = """
import hashlib, importlib.util, sys
spec = importlib.util.spec_from_file_location("tests_of_the_stage", sys.argv[1])
tests = importlib.util.module_from_spec(spec)
spec.loader.exec_module(tests)
print(tests.scene_hash())
"""


def scene_hash() -> str:
    """Hash of the scene's radiance, bit for bit."""
    environment = np.random.default_rng(8).random((8, 16, 3)).astype(np.float32)
    picture = shot(
        *scene(),
        lights=SCENE_LIGHTS,
        camera=SCENE_CAMERA,
        background=environment,
        size=(60, 40),
        supersampling=2,
    )
    return hashlib.sha256(np.ascontiguousarray(picture).tobytes()).hexdigest()


def test_pictures_are_the_same_bit_for_bit_in_one_process_and_in_others() -> None:
    """Nor does drawing print anything."""
    command = [sys.executable, "-c", _DRAW_AND_HASH, __file__]
    processes = [
        subprocess.Popen(
            command, cwd=CHECKOUT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    here = {scene_hash(), scene_hash()}
    for process in processes:
        printed, complaints = process.communicate(timeout=60)
        assert process.returncode == 0, complaints
        assert complaints == ""
        here.add(printed.strip())
    assert len(here) == 1


def test_drawing_again_on_one_stage_gives_the_same_bits() -> None:
    with Stage(30, 20) as stage:
        stage.add(*scene())
        stage.light(*SCENE_LIGHTS)
        stage.look(SCENE_CAMERA)
        first = stage.radiance()
        stage.draw()
        np.testing.assert_array_equal(stage.radiance(), first)


def test_stages_at_once_do_not_disturb_each_other() -> None:
    expected = shot(*scene(), lights=SCENE_LIGHTS, camera=SCENE_CAMERA, size=(30, 20))
    with Stage(30, 20) as stage:
        stage.add(*scene())
        stage.light(*SCENE_LIGHTS)
        stage.look(SCENE_CAMERA)
        np.testing.assert_array_equal(stage.radiance(), expected)
        with Stage(17, 9, background=(1, 0, 0), supersampling=2) as other:
            other.add(unlit_square((0, 0, 1), size=0.4))
            other.look(FROM_ABOVE)
            np.testing.assert_array_equal(other.radiance()[0, 0], [1, 0, 0, 0])
            np.testing.assert_array_equal(stage.radiance(), expected)
            np.testing.assert_array_equal(other.radiance()[4, 8], [0, 0, 1, 1])
        np.testing.assert_array_equal(stage.radiance(), expected)


def test_an_actor_goes_from_one_stage_to_the_next() -> None:
    actors = scene()
    options = {"lights": SCENE_LIGHTS, "camera": SCENE_CAMERA, "size": (30, 20)}
    first = shot(*actors, **options)
    assert first[..., 3].any()
    np.testing.assert_array_equal(shot(*actors, **options), first)


def test_stages_in_several_threads_draw_what_one_draws() -> None:
    """Dagster may run steps in threads."""
    expected = shot(*scene(), lights=SCENE_LIGHTS, camera=SCENE_CAMERA, size=(30, 20))
    seen: list[bool] = []

    def draw() -> None:
        for _ in range(3):
            picture = shot(*scene(), lights=SCENE_LIGHTS, camera=SCENE_CAMERA, size=(30, 20))
            seen.append(bool((picture == expected).all()))

    threads = [threading.Thread(target=draw) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert seen == [True] * 9


# ---- the driver ------------------------------------------------------------------------------


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="EGL is Linux's")
def test_without_a_driver_one_sentence_says_what_to_install() -> None:
    code = (
        "from pipelines.drawing.graphics_driver import NoGraphicsError\n"
        "from pipelines.drawing.stage import Stage\n"
        "try: Stage(8, 8)\n"
        "except NoGraphicsError as error: print(error)\n"
    )
    nowhere = {"__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent", "__EGL_VENDOR_LIBRARY_FILENAMES": ""}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=CHECKOUT,
        env=os.environ | nowhere,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    (sentence,) = done.stdout.splitlines()
    assert sentence.startswith("OpenGL cannot be started: EGL found no driver; expected ")
    assert "libegl1" in sentence
    assert "libgl1-mesa-dri" in sentence
    assert sentence.count(". ") == 0


def test_a_failed_look_for_a_driver_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    """A driver installed meanwhile is found: a refusal is not remembered."""
    from vtkmodules import vtkRenderingOpenGL2

    class Driverless:
        def SetOffScreenRendering(self, on: bool) -> None: ...  # noqa: N802

        def Initialize(self) -> None: ...  # noqa: N802

        def SupportsOpenGL(self) -> bool:  # noqa: N802
            return False

        def Finalize(self) -> None: ...  # noqa: N802

    graphics_driver.require_graphics.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(vtkRenderingOpenGL2, "vtkEGLRenderWindow", Driverless)
        with pytest.raises(NoGraphicsError):
            graphics_driver.require_graphics()
    graphics_driver.require_graphics()


def test_the_renderer_has_a_name() -> None:
    with Stage(8, 8) as stage:
        assert stage.renderer_name not in ("", "unknown")


# ---- depth -----------------------------------------------------------------------------------


def test_depth_of_a_plane_is_its_closed_form() -> None:
    """A plane through the picture: 1 / depth is linear in the pixels."""
    camera = Camera((0.0, -4.0, 3.0), (0.0, 0.0, 0.0), view_angle=50)
    with Stage(40, 30) as stage:
        stage.add(unlit_square(size=1.5))
        stage.look(camera)
        stage.draw()
        depth = stage.depth()
    assert depth.shape == (30, 40)
    assert depth.dtype == np.float32
    ahead = unit(np.subtract(camera.target, camera.position))
    right = unit(np.cross(ahead, (0, 0, 1)))
    up = np.cross(right, ahead)
    slope = math.tan(math.radians(25))
    across = (2 * (np.arange(40) + 0.5) / 40 - 1) * slope * 40 / 30
    upwards = (1 - 2 * (np.arange(30) + 0.5) / 30) * slope
    rays = ahead + across[None, :, None] * right + upwards[:, None, None] * up
    expected = -camera.position[2] / rays[..., 2]
    places = np.asarray(camera.position) + expected[..., None] * rays
    inside = (np.abs(places[..., :2]) < 1.5).all(axis=-1)
    assert 100 < inside.sum() < 1100
    np.testing.assert_array_equal(np.isfinite(depth), inside)
    np.testing.assert_allclose(depth[inside], expected[inside], rtol=1e-5)


@pytest.mark.parametrize("environment", [False, True])
def test_depth_is_that_of_rays(environment: bool) -> None:
    rng = np.random.default_rng(3)
    vertices = rng.uniform(-1, 1, (30, 3)).astype(np.float32)
    triangles = np.arange(30).reshape(-1, 3)
    camera = orbit((0, 0, 0), 4, 30, 20, view_angle=35)
    sky = np.ones((4, 8, 3), np.float32)
    with Stage(60, 60, background=sky if environment else (0.0, 0.0, 0.0)) as stage:
        stage.add(surface(vertices, triangles, lit=False))
        stage.look(camera)
        stage.draw()
        depth = stage.depth()
    ahead = unit(np.subtract(camera.target, camera.position))
    right = unit(np.cross(ahead, (0, 0, 1)))
    place = (2 * (np.arange(60) + 0.5) / 60 - 1) * math.tan(math.radians(17.5))
    rays = ahead + place[None, :, None] * right - place[:, None, None] * np.cross(right, ahead)
    scene = build_scene(vertices, triangles)
    expected = first_hits(scene, camera.position, rays.reshape(-1, 3)).distance.reshape(60, 60)
    same = np.isfinite(expected) == np.isfinite(depth)
    assert same.mean() > 0.99
    both = np.isfinite(expected) & np.isfinite(depth)
    assert both.mean() > 0.2
    close = np.abs(depth[both] - expected[both]) < 1e-4 * expected[both]
    assert close.mean() > 0.98  # the others are at edges


def test_depth_with_supersampling_is_a_sample_and_no_average() -> None:
    camera = Camera((0.0, -4.0, 3.0), (0.0, 0.0, 0.0), view_angle=50)
    depths = {}
    for size, n in ((10, 1), (10, 3), (30, 1)):
        with Stage(size, size, supersampling=n) as stage:
            stage.add(unlit_square(size=1.5))
            stage.look(camera)
            stage.draw()
            depths[size, n] = stage.depth()
    np.testing.assert_array_equal(depths[10, 3], depths[30, 1][1::3, 1::3])
    np.testing.assert_allclose(depths[10, 3], depths[10, 1], rtol=1e-5)


def test_depth_of_an_orthographic_picture_and_of_nothing() -> None:
    with Stage(8, 8) as stage:
        square = unlit_square(size=0.5, height=1.25)
        stage.add(square)
        stage.look(FROM_ABOVE)  # 5 above the target
        stage.draw()
        expected = np.full((8, 8), np.inf)
        expected[2:6, 2:6] = 3.75
        np.testing.assert_allclose(stage.depth(), expected, rtol=1e-5)
        stage.remove(square)
        stage.draw()
        assert np.isinf(stage.depth()).all()
