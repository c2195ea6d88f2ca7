"""The ray caster against a ray of its own kind by hand, and the stage against both."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.drawing.colour import encode_srgb
from pipelines.drawing.stage import Camera
from pipelines.geometry.shapes import square
from pipelines.photo_fur.attenuation import Attenuation, Tails
from pipelines.photo_fur.frames import BACKGROUND, SQUARE_VIEWS, draw_frames, view_cameras
from pipelines.photo_fur.photograph import FurPhotograph, fur_photograph
from pipelines.photo_fur.ray_cast import Square, aslant_rmse, cast_square
from pipelines.photo_fur.shells import make_shell_mesh
from pipelines.photo_fur.stage_view import Fill

SIZE = (96, 128)


def tufts(seed: int = 0) -> FurPhotograph:
    from scipy.ndimage import gaussian_filter

    random = np.random.default_rng(seed)
    grey = gaussian_filter(random.random((48, 48)), 1.0, mode="wrap")
    grey = 0.05 + 0.9 * (grey - grey.min()) / np.ptp(grey)
    return fur_photograph((grey[..., None] * [0.9, 0.7, 0.5]).astype(np.float32))


def stage_and_square(
    photo: FurPhotograph, fill: Fill, tails: Tails
) -> tuple[np.ndarray, Camera, Square]:
    mesh = make_shell_mesh(square(4), 6, thickness=0.15, repeats=1.3)
    frames = draw_frames(photo, mesh, SQUARE_VIEWS, size=SIZE, fill=fill, tails=tails)
    camera = view_cameras(SQUARE_VIEWS, mesh.vertices.reshape(-1, 3), SIZE[1] / SIZE[0])[-1]
    return frames.pictures[-1], camera, Square(photo, mesh, fill, tails)


@pytest.mark.parametrize("tails", ["end layers", "dropped"])
@pytest.mark.parametrize("fill", ["columns", "bands"])
def test_the_stage_shows_what_is_cast_and_nothing_else(fill: Fill, tails: Tails) -> None:
    photo = tufts()
    picture, camera, cast = stage_and_square(photo, fill, tails)
    assert aslant_rmse(picture, cast_square(cast, camera, SIZE, 2)) < 0.006
    random = np.random.default_rng(1)
    shuffled = random.permutation(photo.luminance.ravel()).reshape(photo.luminance.shape)
    upside_down = photo.attenuation.brightest * photo.attenuation.darkest / photo.luminance
    thinner = cast.mesh._replace(thickness=0.12)
    other: Fill = "bands" if fill == "columns" else "columns"
    for null in (
        cast._replace(photograph=photo._replace(luminance=shuffled)),
        cast._replace(photograph=photo._replace(luminance=upside_down)),
        cast._replace(mesh=thinner),
        cast._replace(fill=other),
    ):
        assert aslant_rmse(picture, cast_square(null, camera, SIZE, 2)) > 0.012


def test_holes_and_dropped_tails_show_what_is_behind() -> None:
    photo = tufts(2)
    opaque = np.ones(photo.luminance.shape, bool)
    opaque[10:20, 15:35] = False
    picture, camera, cast = stage_and_square(photo._replace(opaque=opaque), "columns", "dropped")
    assert aslant_rmse(picture, cast_square(cast, camera, SIZE, 2)) < 0.006
    whole = cast._replace(photograph=photo)
    assert aslant_rmse(picture, cast_square(whole, camera, SIZE, 2)) > 0.02


def test_a_ray_by_hand() -> None:
    """One grey in the third of four layers, seen at 30 degrees above the horizon: columns of it are
    met at the third layer, at that angle's sine of its brightness; rays beside it go through."""
    grey = np.full((8, 8, 3), 0.3, np.float32)
    medium = Attenuation(0.3 * np.exp(0.625 * 2), 0.3 * np.exp(-0.375 * 2))
    photo = FurPhotograph(grey, grey[..., 0], medium)
    cast = Square(photo, make_shell_mesh(square(1), 4, thickness=0.1), "columns", "end layers")
    eye = (0.0, -5 * np.cos(np.pi / 6), 5 * np.sin(np.pi / 6))
    camera = Camera(eye, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 40.0, None)
    found = cast_square(cast, camera, (51, 51), 1).codes
    np.testing.assert_allclose(found[25, 25], encode_srgb(np.full(3, 0.15)), atol=2e-3)
    np.testing.assert_allclose(found[0, 0], encode_srgb(np.array(BACKGROUND)), atol=1e-12)
