"""What live views are given, and shells that are lifted and lit by their shader."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipelines.drawing.colour import decode_srgb, encode_srgb
from pipelines.drawing.stage import Camera
from pipelines.photo_fur import live_parts
from pipelines.photo_fur.frames import BACKGROUND
from pipelines.photo_fur.laid_fur import FEWEST_SHELLS, rows_of_fur, shells_seen
from pipelines.photo_fur.live_parts import (
    LAMP,
    NIGHT,
    FurLook,
    FurScene,
    input_picture,
    nearer,
    shell_sources,
)
from pipelines.photo_fur.stage_view import Fill, FurLight, Look
from tests.fur_packages import packed_tufts, tufts

SIZE = (96, 128)
LIT = FurLight(headlight=0.4, lamp=0.9, light=LAMP)


@pytest.fixture(scope="module")
def scene() -> FurScene:
    packed = packed_tufts(thickness=0.2)
    return FurScene(tufts(), packed.mesh, packed.fur(), "end layers")


def _psnr(one: np.ndarray, other: np.ndarray) -> float:
    error = np.mean((one.astype(np.float64) - other) ** 2)
    return float(10 * np.log10(255**2 / max(error, 1e-9)))


@pytest.mark.parametrize("fill", ["columns", "bands"])
def test_shells_that_light_themselves_are_the_stages(scene: FurScene, fill: Fill) -> None:
    """VTK offsets nothing and lights nothing here: the shader does both."""
    camera = scene.reference_views("plain", fill, (12, 16))[
        4
    ].camera  # close: all of the picture is fur
    look = FurLook(9, fill, LIT, thickness=1.4)
    expected = scene.frame(look, camera, SIZE)
    assert _psnr(scene.live_frame(look, camera, SIZE, BACKGROUND), expected) > 45
    for null in (
        replace(look, thickness=1.0),
        replace(look, layers=6),
        replace(look, light=replace(LIT, light=(0.6, 0.6, 0.52))),
        replace(look, light=replace(LIT, headlight=0.5)),
    ):
        assert _psnr(scene.live_frame(null, camera, SIZE, BACKGROUND), expected) < 37


def test_a_sky_lights_all_alike(scene: FurScene) -> None:
    camera = scene.reference_views("plain", "columns", (12, 16))[0].camera
    look = FurLook(6, "columns", FurLight(sky=1.0, headlight=0.0))
    whole = decode_srgb(scene.live_frame(look, camera, SIZE) / 255.0)
    half = scene.live_frame(replace(look, light=FurLight(sky=0.5, headlight=0.0)), camera, SIZE)
    is_fur = np.abs(whole - NIGHT).max(axis=2) > 0.01
    assert 0.1 < is_fur.mean() < 0.9
    inner = is_fur & np.roll(is_fur, 1, 0) & np.roll(is_fur, -1, 0)
    inner &= np.roll(is_fur, 1, 1) & np.roll(is_fur, -1, 1)
    # Rims mix with the background.
    differing = np.abs(half / 255.0 - encode_srgb(whole / 2)).max(axis=2)[inner]
    assert np.quantile(differing, 0.9) < 1.5 / 255


def test_reference_views_show_each_setting_changed(scene: FurScene) -> None:
    views = {view.name: view for view in scene.reference_views("full", "columns", (24, 32))}
    assert list(views) == [
        *("front", "right", "back", "left", "close"),
        *("full", "wind", "far", "plain", "other_shells"),
    ]
    assert {view.look.layers for view in views.values()} == {6, 3}
    assert views["other_shells"].look.fill == "bands"
    assert {name for name, view in views.items() if view.look.look == "plain"} == {
        "plain",
        "other_shells",
    }
    assert views["close"].look.light.lamp > 0
    assert views["wind"].look.wind.strength > 0
    assert all(view.frame.shape == (24, 32, 3) for view in views.values())
    assert len({view.frame.tobytes() for view in views.values()}) == len(views)


def test_far_away_fewer_shells_look_alike(scene: FurScene, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is drawn from there is nearly what all shells are; one shell is not."""
    near = {view.name: view for view in scene.reference_views("full", "columns", (12, 16))}["full"]
    camera = nearer(near.camera, 8.0)
    seen = shells_seen(rows_of_fur(camera, scene.fur.skin, scene.fur.thickness, 2 * SIZE[0]))
    assert seen == FEWEST_SHELLS
    few = scene.frame(near.look, camera, SIZE)
    box = np.nonzero((few != few[0, 0]).any(axis=-1))
    crop = tuple(slice(each.min() - 1, each.max() + 2) for each in box)
    assert min(few[crop].shape[:2]) >= 7
    others = []
    for shells in (40, 1):
        monkeypatch.setattr(live_parts, "shells_seen", lambda _, shells=shells: shells)
        others.append(scene.frame(near.look, camera, SIZE)[crop])
    assert _psnr(few[crop], others[0]) > 30
    assert _psnr(few[crop], others[1]) < 25


def test_rows_of_fur_are_those_of_a_ruler_at_the_nearest_point() -> None:
    corners = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0]])
    camera = Camera((5.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 60.0, None)
    seen = 2 * 4 * np.tan(np.pi / 6)
    assert rows_of_fur(camera, corners, 0.1, 300) == pytest.approx(0.1 * 300 / seen)
    flat = replace(camera, height=2.5)
    assert rows_of_fur(flat, corners, 0.1, 300) == pytest.approx(12)
    inside = replace(camera, position=(0.5, 0.0, 0.0))
    assert np.isfinite(rows_of_fur(inside, corners, 0.1, 300))


def test_transparent_pixels_show_the_background(scene: FurScene) -> None:
    photograph = scene.photograph
    assert photograph.opaque is not None
    shown = input_picture(photograph)
    expected = np.rint(255 * encode_srgb(np.array(BACKGROUND)))
    assert (shown[~photograph.opaque] == expected).all()


@pytest.mark.parametrize("look", ["full", "plain"])
def test_sources_stand_by_themselves(look: Look) -> None:
    vertex, fragment = shell_sources(look)
    assert "#include" not in vertex + fragment
    assert "void placeVertex()" in vertex
    assert "vec3 surfaceColour()" in fragment
