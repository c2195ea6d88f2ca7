"""The fur as drawn against the photograph, the layers' masks and the closed form of the medium."""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import Camera, Light, Stage, Wrap, orbit
from pipelines.photo_fur.attenuation import (
    DROPPED,
    Attenuation,
    Tails,
    layer_masks,
    layer_of,
)
from pipelines.photo_fur.frames import (
    BACKGROUND,
    ROUND_VIEWS,
    SQUARE_VIEWS,
    View,
    draw_frames,
    stretched,
    top_view_size,
)
from pipelines.photo_fur.photograph import FurPhotograph, fur_photograph
from pipelines.photo_fur.shells import ShellMesh, shell_vertices
from pipelines.photo_fur.stage_view import Fill, fur_surface, fur_texture

FILLS: tuple[Fill, ...] = ("columns", "bands")
THICKNESS = 0.1
SIZE = 24
RED = (1.0, 0.0, 0.0)


def random_photograph(seed: int, shape: tuple[int, int] = (SIZE, SIZE)) -> FurPhotograph:
    """Random colours, evenly spread in sRGB; a tenth of the pixels is tail at each end."""
    encoded = np.random.default_rng(seed).random((*shape, 3))
    encoded *= np.random.default_rng(seed + 1).random((*shape, 1))
    return fur_photograph((encoded**2.2).astype(np.float32), tail=0.1)


class Skin(NamedTuple):
    """A mesh to grow fur on."""

    vertices: NDArray[np.float64]
    normals: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uvs: NDArray[np.float64]


def flat_skin(segments: int = 2) -> Skin:
    """The unit square about the origin, its texture coordinates from 0 to 1."""
    steps = np.linspace(0.0, 1.0, segments + 1)
    u, v = np.meshgrid(steps, steps)
    uvs = np.stack([u.ravel(), v.ravel()], axis=1)
    vertices = np.column_stack([uvs - 0.5, np.zeros(len(uvs))])
    corner = np.arange((segments + 1) ** 2).reshape(segments + 1, -1)
    a, b, c, d = (
        part.ravel()
        for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    )
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Skin(vertices, np.tile([0.0, 0.0, 1.0], (len(vertices), 1)), triangles, uvs)


def fur(
    photo: FurPhotograph,
    layers: int,
    *,
    fill: Fill,
    tails: Tails = "end layers",
    wrap: Wrap = "mirrored",
    lit: bool = False,
    repeats: float = 1.0,
    interpolate: bool = False,
    only: int | None = None,
) -> Any:
    """The fur of the flat skin; with ``only``, every other layer is far outside the picture."""
    skin = flat_skin()
    shells = shell_vertices(skin.vertices, skin.normals, THICKNESS, layers)
    if only is not None:
        shells[np.arange(1, layers + 1) != only] += np.float32([50, 0, 0])
    image = fur_texture(photo, layers, tails=tails)
    return fur_surface(
        shells,
        skin.normals,
        skin.triangles,
        skin.uvs * repeats,
        image,
        photo.attenuation,
        fill=fill,
        wrap=wrap,
        interpolate=interpolate,
        lit=lit,
    )


FROM_ABOVE = orbit((0, 0, 0), 5, azimuth=-90, elevation=90, height=1)


def drawn(
    actor: Any, *, size: int = SIZE, camera: Camera = FROM_ABOVE, lights: tuple[Light, ...] = ()
) -> NDArray[np.float32]:
    """Radiance and coverage from straight above, a texel a pixel, before red."""
    with Stage(size, size, background=RED) as stage:
        stage.add(actor)
        stage.light(*lights)
        stage.look(camera)
        return stage.radiance()


# ---- all layers ------------------------------------------------------------------------------


@pytest.mark.parametrize("fill", FILLS)
@pytest.mark.parametrize(("layers", "seed"), [(1, 0), (2, 1), (8, 2), (15, 3), (250, 4)])
def test_from_above_the_square_is_the_8_bit_photograph(layers: int, seed: int, fill: Fill) -> None:
    photo = random_photograph(seed)
    picture = drawn(fur(photo, layers, fill=fill))
    np.testing.assert_array_equal(to_8bit(picture[..., :3]), to_8bit(photo.radiance))
    np.testing.assert_array_equal(picture[..., 3], 1)


@pytest.mark.parametrize("fill", FILLS)
@pytest.mark.parametrize(
    ("wrap", "padding"), [("mirrored", "symmetric"), ("repeat", "wrap"), ("clamp", "edge")]
)
def test_beyond_its_edges_the_photograph_is_continued(wrap: Wrap, padding: Any, fill: Fill) -> None:
    photo = random_photograph(5)
    picture = drawn(fur(photo, 6, fill=fill, wrap=wrap, repeats=2.0), size=2 * SIZE)
    # Texture coordinates begin at the bottom: the photograph goes on upwards and to the right.
    expected = np.pad(photo.radiance, ((SIZE, 0), (0, SIZE), (0, 0)), mode=padding)
    np.testing.assert_array_equal(to_8bit(picture[..., :3]), to_8bit(expected))


@pytest.mark.parametrize("fill", FILLS)
@pytest.mark.parametrize("layers", [1, 7, 100])
def test_dropped_tails_show_the_background_exactly_there(layers: int, fill: Fill) -> None:
    photo = random_photograph(6)
    picture = drawn(fur(photo, layers, fill=fill, tails="dropped"))
    dropped = (photo.luminance > photo.attenuation.brightest) | (
        photo.luminance < photo.attenuation.darkest
    )
    assert 0.1 < dropped.mean() < 0.25
    np.testing.assert_array_equal(picture[..., 3], ~dropped)
    np.testing.assert_array_equal(picture[dropped][:, :3], np.tile(RED, (dropped.sum(), 1)))
    shown = to_8bit(picture[..., :3])
    np.testing.assert_array_equal(shown[~dropped], to_8bit(photo.radiance)[~dropped])


def test_enlarged_fur_shows_its_texels_or_what_lies_between_them() -> None:
    photo = random_photograph(16, (6, 6))
    sharp = drawn(fur(photo, 4, fill="columns"), size=30)[..., :3]
    expected = photo.radiance.repeat(5, axis=0).repeat(5, axis=1)
    np.testing.assert_array_equal(to_8bit(sharp), to_8bit(expected))
    smooth = drawn(fur(photo, 1, fill="columns", interpolate=True), size=30)[..., :3]
    np.testing.assert_allclose(smooth[2::5, 2::5], sharp[2::5, 2::5], atol=6e-3)
    between = (0.6 * sharp[2, 2] + 0.4 * sharp[2, 7], 0.4 * sharp[2, 2] + 0.6 * sharp[2, 7])
    np.testing.assert_allclose(smooth[2, 4:6], between, atol=6e-3)


def test_lit_fur_is_lambertian() -> None:
    """Under light along a leaning view every pixel has the cosine of the lean."""
    photo = random_photograph(7)
    camera = orbit((0, 0, 0), 5, -60, 40, height=1)
    unlit = drawn(fur(photo, 5, fill="columns"), camera=camera)
    lit = drawn(fur(photo, 5, fill="columns", lit=True), camera=camera, lights=(Light(),))
    covered = unlit[..., 3] > 0
    assert covered.any()
    np.testing.assert_array_equal(lit[..., 3] > 0, covered)
    expected = unlit[covered][:, :3] * math.sin(math.radians(40))
    np.testing.assert_allclose(lit[covered][:, :3], expected, rtol=1e-5)


# ---- one layer alone -------------------------------------------------------------------------

LAYERS = 6


@pytest.mark.parametrize("tails", ["end layers", "dropped"])
def test_a_layer_of_bands_shows_its_mask_and_nothing_else(tails: Tails) -> None:
    photo = random_photograph(8)
    masks = layer_masks(layer_of(photo.luminance, photo.attenuation, LAYERS, tails=tails), LAYERS)
    whole = drawn(fur(photo, LAYERS, fill="bands", tails=tails))
    for number, mask in enumerate(masks, start=1):
        alone = drawn(fur(photo, LAYERS, fill="bands", tails=tails, only=number))
        np.testing.assert_array_equal(alone[..., 3], mask)
        np.testing.assert_array_equal(alone[mask], whole[mask])


@pytest.mark.parametrize("tails", ["end layers", "dropped"])
def test_a_layer_of_columns_shows_every_higher_layer_too_as_dark_as_the_medium(
    tails: Tails,
) -> None:
    """A pixel's colour n - own layers further down is the colour times I(n) / I(own layer)."""
    photo = random_photograph(9)
    brightest, darkest = photo.attenuation
    own = layer_of(photo.luminance, photo.attenuation, LAYERS, tails=tails).astype(float)
    masks = layer_masks(own.astype(np.uint8), LAYERS)
    whole = drawn(fur(photo, LAYERS, fill="columns", tails=tails))[..., :3]
    for number in range(1, LAYERS + 1):
        alone = drawn(fur(photo, LAYERS, fill="columns", tails=tails, only=number))
        stands = masks[:number].any(axis=0)
        np.testing.assert_array_equal(alone[..., 3], stands)
        decay = (darkest / brightest) ** ((number - own) / LAYERS)
        expected = (whole * decay[..., None])[stands]
        np.testing.assert_allclose(alone[stands][:, :3], expected, rtol=1e-5)


@pytest.mark.parametrize("fill", FILLS)
@pytest.mark.parametrize("layers", [1, 2, 17, 127, 128, 250])
def test_every_luminance_is_shown_by_the_layer_that_holds_it(layers: int, fill: Fill) -> None:
    """Every code of depth there is, at the first, a middle and the last layer."""
    medium = Attenuation(0.9, 0.01)
    grey = medium.luminance_at(np.linspace(-0.1, 1.1, SIZE * SIZE)).reshape(SIZE, SIZE)
    photo = FurPhotograph(np.repeat(grey[..., None], 3, axis=2), grey, medium)
    own = layer_of(grey, medium, layers, tails="dropped")
    for number in sorted({1, (layers + 1) // 2, layers}):
        alone = drawn(fur(photo, layers, fill=fill, tails="dropped", only=number))
        expected = (own == number) if fill == "bands" else (own >= 1) & (own <= number)
        np.testing.assert_array_equal(alone[..., 3], expected)


def test_from_the_side_bands_are_slices_and_columns_stand_on_the_skin() -> None:
    """Photograph: left half in the top layer, right half in the bottom one. Seen from the front."""
    grey = np.full((SIZE, SIZE), 0.1)
    grey[:, : SIZE // 2] = 0.9
    photo = FurPhotograph(np.repeat(grey[..., None], 3, axis=2), grey, Attenuation(0.9, 0.1))
    # A little from above, so that a shell shows as a line; 1 unit is SIZE pixels.
    camera = orbit((0, 0, 0), 5, -90, 8, height=1)
    tall = 5 * THICKNESS
    skin = flat_skin()
    shells = shell_vertices(skin.vertices, skin.normals, tall, 4)
    pictures = {}
    for fill in FILLS:
        image = fur_texture(photo, 4, tails="end layers")
        actor = fur_surface(
            shells,
            skin.normals,
            skin.triangles,
            skin.uvs,
            image,
            photo.attenuation,
            fill=fill,
            wrap="clamp",
            interpolate=False,
            lit=False,
        )
        pictures[fill] = drawn(actor, size=96, camera=camera)[..., 3].sum(axis=0)
    line = 96 * math.sin(math.radians(8))  # rows that one shell covers
    left, right = slice(2, 46), slice(50, 94)
    np.testing.assert_allclose(pictures["bands"], line, atol=1.01)
    np.testing.assert_allclose(pictures["columns"][right], line, atol=1.01)
    step = 96 * tall / 4 * math.cos(math.radians(8))  # rows from one shell to the next: no gaps
    np.testing.assert_allclose(pictures["columns"][left], 3 * step + line, atol=1.01)


# ---- one draw --------------------------------------------------------------------------------


def test_one_actor_holds_all_shells_and_one_texture() -> None:
    photo, skin, layers = random_photograph(10), flat_skin(3), 15
    shells = shell_vertices(skin.vertices, skin.normals, THICKNESS, layers)
    image = fur_texture(photo, layers, tails="end layers")
    actor = fur_surface(
        shells,
        skin.normals,
        skin.triangles,
        skin.uvs,
        image,
        photo.attenuation,
        fill="columns",
        wrap="mirrored",
        interpolate=True,
        lit=True,
    )
    mesh = actor.GetMapper().GetInput()
    assert mesh.GetNumberOfPoints() == shells.shape[0] * shells.shape[1]
    assert mesh.GetNumberOfCells() == layers * len(skin.triangles)
    assert actor.GetProperty().GetNumberOfTextures() == 1
    assert actor.GetProperty().GetTexture("photograph") is not None
    layer = np.asarray(mesh.point_data["layer"])
    np.testing.assert_array_equal(np.unique(layer), np.arange(1, layers + 1))
    corners = mesh.regular_faces
    np.testing.assert_array_equal(np.ptp(layer[corners], axis=1), 0)
    for number in range(1, layers + 1):
        own = mesh.points[corners[layer[corners[:, 0]] == number]]
        np.testing.assert_array_equal(own, shells[number - 1][skin.triangles])


def test_the_texture_is_the_photograph_with_the_depth_in_alpha() -> None:
    photo = random_photograph(11, (5, 7))
    image = fur_texture(photo, 10, tails="dropped")
    assert image.dtype == np.uint8
    assert image.shape == (5, 7, 4)
    np.testing.assert_array_equal(image[..., :3], to_8bit(photo.radiance))
    own = layer_of(photo.luminance, photo.attenuation, 10, tails="dropped").astype(int)
    np.testing.assert_array_equal(image[..., 3] // 25 + 1, np.where(own == 0, 11, own))


# ---- frames ----------------------------------------------------------------------------------


def frames_of(
    photo: FurPhotograph,
    skin: Skin,
    views: tuple[View, ...],
    *,
    layers: int = 5,
    size: tuple[int, int] = (SIZE, SIZE),
    supersampling: int = 1,
    tails: Tails = "end layers",
    thickness: float = THICKNESS,
    heard: list[float] | None = None,
) -> Any:
    shells = shell_vertices(skin.vertices, skin.normals, thickness, layers)
    mesh = ShellMesh(shells, skin.normals, skin.triangles, skin.uvs, thickness)
    if skin.vertices[:, 2].max() == 0:
        mesh = stretched(mesh, photo.luminance.shape[1] / photo.luminance.shape[0])
    return draw_frames(
        photo,
        mesh,
        views,
        size=size,
        supersampling=supersampling,
        tails=tails,
        fill="columns",
        progress=(heard if heard is not None else []).append,
    )


@pytest.mark.parametrize("shape", [(24, 24), (18, 40), (33, 12)])
def test_the_square_is_shown_from_above_and_from_the_side(shape: tuple[int, int]) -> None:
    photo = random_photograph(12, shape)
    heard: list[float] = []
    frames = frames_of(photo, flat_skin(), SQUARE_VIEWS, size=shape, supersampling=2, heard=heard)
    assert frames.pictures.shape == (2, *shape, 3)
    assert frames.pictures.dtype == np.uint8
    np.testing.assert_array_equal(frames.pictures[0], to_8bit(photo.radiance))
    assert frames.coverage[0] == 1.0
    assert 0.05 < frames.coverage[1] < 0.95
    assert heard == [0.0, 0.5]


def test_where_the_texture_coordinates_go_on_the_photograph_is_mirrored() -> None:
    photo, skin = random_photograph(17), flat_skin()
    twice = skin._replace(uvs=2 * skin.uvs)
    picture = frames_of(photo, twice, SQUARE_VIEWS[:1], size=(2 * SIZE, 2 * SIZE)).pictures[0]
    expected = np.pad(photo.radiance, ((SIZE, 0), (0, SIZE), (0, 0)), mode="symmetric")
    np.testing.assert_array_equal(picture, to_8bit(expected))


def test_coverage_is_the_share_of_pixels_that_are_not_background() -> None:
    photo = random_photograph(13)
    views = (SQUARE_VIEWS[0], *ROUND_VIEWS)
    frames = frames_of(photo, flat_skin(), views, size=(40, 40), tails="dropped")
    background = to_8bit(BACKGROUND)
    expected = (frames.pictures != background).any(axis=-1).mean(axis=(1, 2))
    np.testing.assert_allclose(frames.coverage, expected, atol=1e-12)
    kept = layer_of(photo.luminance, photo.attenuation, 5, tails="dropped") > 0
    exact = frames_of(photo, flat_skin(), SQUARE_VIEWS[:1], tails="dropped").coverage[0]
    assert exact == kept.mean()


@pytest.mark.parametrize("fill", FILLS)
def test_of_a_cut_out_only_what_is_opaque_is_drawn(fill: Fill) -> None:
    photo = random_photograph(19)
    opaque = np.random.default_rng(19).random((SIZE, SIZE)) < 0.5
    hidden = np.where(opaque[..., None], photo.radiance, 0).astype(np.float32)
    picture = drawn(fur(photo._replace(radiance=hidden, opaque=opaque), 5, fill=fill))
    np.testing.assert_array_equal(picture[..., 3] > 0, opaque)
    whole = drawn(fur(photo, 5, fill=fill))
    np.testing.assert_array_equal(picture[opaque], whole[opaque])


def test_the_texture_of_a_cut_out_goes_on_with_the_nearest_colour() -> None:
    photo = random_photograph(20)
    opaque = np.ones((SIZE, SIZE), bool)
    opaque[:, :5] = False
    hidden = np.where(opaque[..., None], photo.radiance, 0).astype(np.float32)
    image = fur_texture(photo._replace(radiance=hidden, opaque=opaque), 5, tails="end layers")
    edge = to_8bit(photo.radiance)[:, 5:6]
    np.testing.assert_array_equal(image[:, :5, :3], np.broadcast_to(edge, (SIZE, 5, 3)))
    assert (image[:, :5, 3] == DROPPED).all()
    assert (image[:, 5:, 3] != DROPPED).all()


def sphere(segments: int = 48) -> Skin:
    """Longitude runs along u from azimuth 0 to 360, latitude along v."""
    u, v = np.meshgrid(np.linspace(0, 1, segments + 1), np.linspace(0, 1, segments // 2 + 1))
    around, above = 2 * np.pi * u, np.pi * (v - 0.5)
    points = np.stack(
        [np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), np.sin(above)], axis=-1
    ).reshape(-1, 3)
    corner = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (
        part.ravel()
        for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    )
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Skin(points, points, triangles, np.stack([u.ravel(), v.ravel()], axis=1))


def test_round_views_show_the_four_sides_whole_and_in_their_order() -> None:
    """A photograph of four colours about the azimuths 0, 90, 180 and 270."""
    colours = np.array([[0.9, 0.1, 0.1], [0.1, 0.9, 0.1], [0.1, 0.1, 0.9], [0.9, 0.9, 0.1]])
    side = np.round(np.arange(64) / 16).astype(int) % 4
    radiance = np.tile(colours[side], (32, 1, 1)).astype(np.float32)
    photo = fur_photograph(radiance, tail=0.0)
    frames = frames_of(photo, sphere(), ROUND_VIEWS, size=(60, 60), thickness=0.05)
    assert [view.azimuth for view in ROUND_VIEWS] == [-90, 0, 90, 180]
    for view, picture in zip(ROUND_VIEWS, frames.pictures, strict=True):
        middle = picture[28:32, 28:32].reshape(-1, 3).mean(axis=0)
        expected = to_8bit(colours[round(view.azimuth / 90) % 4]).astype(float)
        assert np.corrcoef(middle, expected)[0, 1] > 0.99
        covered = (picture != to_8bit(BACKGROUND)).any(axis=-1)
        border = [covered[0], covered[-1], covered[:, 0], covered[:, -1]]
        assert not np.concatenate(border).any()
        assert covered.any(axis=1).sum() >= 54  # and the picture is used


def test_fur_of_more_layers_and_thickness_covers_more_and_never_leaves_the_picture() -> None:
    photo = random_photograph(14)
    for thickness, layers in itertools.product((0.02, 0.5), (2, 12)):
        frames = frames_of(
            photo, sphere(24), ROUND_VIEWS[:1], size=(40, 40), thickness=thickness, layers=layers
        )
        covered = (frames.pictures[0] != to_8bit(BACKGROUND)).any(axis=-1)
        assert not covered[[0, -1]].any()
        assert not covered[:, [0, -1]].any()


def test_the_square_gets_the_photographs_proportions() -> None:
    corners = np.array([[[0, 0, 0], [1, 1, 0.2]]], np.float32)
    none = np.empty((0, 3))
    wide = stretched(ShellMesh(corners, none, none, none, 0.2), 1.5)
    assert wide.vertices.dtype == np.float32
    np.testing.assert_allclose(wide.vertices, [[[0, 0, 0], [1.5, 1, 0.2]]], rtol=1e-6)


@pytest.mark.parametrize("shape", [(24, 24), (100, 60), (384, 500), (383, 900), (2000, 3000)])
def test_small_photographs_are_shown_in_squares_of_pixels(shape: tuple[int, int]) -> None:
    height, width = top_view_size(shape)
    times = height // shape[0]
    assert (height, width) == (times * shape[0], times * shape[1])
    assert times == 1 or min(height, width) <= 384
    assert min(height, width) + min(shape) > 384  # one time more would be too large
