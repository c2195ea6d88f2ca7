"""The street as drawn against textures decoded on the processor, both ways of drawing it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.stage import Stage
from pipelines.geometry.cameras import project_points
from pipelines.street_billboards.billboards import Billboards, axes_facing
from pipelines.street_billboards.drawing import quads
from pipelines.street_billboards.drawing.culling import NEAR, visible_billboards
from pipelines.street_billboards.drawing.processor_street import ProcessorStreet
from pipelines.street_billboards.drawing.shader_street import ShaderStreet
from pipelines.street_billboards.drawing.stage_camera import stage_camera
from pipelines.street_billboards.textures.atlases import pack_pages
from pipelines.street_billboards.textures.decoding import decode_views
from pipelines.street_billboards.textures.texture_tables import SIDE, CompressedTextures
from tests.pipelines.street_billboards.compressed_street import (
    facing,
    placed_camera,
    random_textures,
    scattered,
)

Picture = tuple[NDArray[np.uint8], NDArray[np.bool_]]
SIZE = (160, 120)
STILL, TURNING = np.array([False]), np.array([True])


def picture(street: Any, intrinsics: Any, pose: Any, size: tuple[int, int] = SIZE) -> Picture:
    """The frame, and the pixels that are covered."""
    with Stage(*size) as stage:
        stage.add(*street.actors)
        street.look(intrinsics, pose, *size)
        stage.look(stage_camera(intrinsics, pose, size[1]))
        covered = stage.radiance()[..., 3] > 0
        return stage.frame(), covered


def decoded(textures: CompressedTextures, billboard: int, position: float) -> NDArray[np.uint8]:
    rgba = np.empty((1, SIDE, SIDE, 4), np.uint8)
    decode_views(textures, np.array([billboard]), np.array([position]), rgba)
    return rgba[0]


def from_the_front(
    textures: CompressedTextures, position: float, *, street: Any = ShaderStreet
) -> Picture:
    """The first billboard, three pixels a texel, from this place in its fan."""
    turns = bool(np.diff(textures.first_mask)[0] > 1)
    fan, side = 17, 3 * SIDE
    azimuth = (fan + position) * 6.0
    angle = np.radians(azimuth)
    square = facing(azimuth, fan, turns=turns)
    eye = 2.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
    # One row of pixels more all around.
    camera = placed_camera(eye, (0, 0, 0), (side + 2, side + 2), side)
    frame, covered = picture(street(square, textures), *camera, size=(side + 2, side + 2))
    assert not covered[[0, -1]].any()
    assert not covered[:, [0, -1]].any()
    return frame[1:-1, 1:-1], covered[1:-1, 1:-1]


# ---- one billboard -----------------------------------------------------------------------------


@pytest.mark.parametrize(("colour", "tint_side"), [("ycocg", 16), ("ycocg", 32), ("rgb", 32)])
@pytest.mark.parametrize(
    "ranks",
    [
        (0, 0, 0),
        (3, 0, 2),
        *(pytest.param(r, marks=pytest.mark.slow) for r in ((4, 1, 1), (0, 2, 1), (16, 5, 7))),
    ],
)
@pytest.mark.parametrize("turns", [STILL, TURNING])
def test_a_square_shows_its_decoded_texels(
    colour: str, tint_side: int, ranks: tuple[int, int, int], turns: NDArray[np.bool_]
) -> None:
    textures = random_textures(
        turns, seed=sum(ranks), colour=colour, tint_side=tint_side, ranks=ranks
    )
    for position in (-3.0, float(textures.direction[-1]), 40.0):
        frame, covered = from_the_front(textures, position)
        expected = decoded(textures, 0, position)
        opaque = expected[..., 3] > 0
        assert np.array_equal(covered[1::3, 1::3], opaque)
        off = np.abs(frame[1::3, 1::3].astype(int) - expected[..., :3])[opaque]
        assert off.max() <= 1


@pytest.mark.parametrize("turns", [STILL, TURNING])
def test_between_directions_views_are_interpolated(turns: NDArray[np.bool_]) -> None:
    textures = random_textures(turns, seed=3, ranks=(5, 2, 1), most_views=2)
    textures = textures._replace(first=np.array([0, 2]))
    assert len(textures.direction) == 2, "the seed makes two views"
    low, high = (float(value) for value in textures.direction)
    seen = []
    for share in (0.1, 0.3, 0.45, 0.7):
        position = low + share * (high - low)
        frame, covered = from_the_front(textures, position)
        expected = decoded(textures, 0, position)
        opaque = expected[..., 3] > 0
        assert np.array_equal(covered[1::3, 1::3], opaque)
        assert np.abs(frame[1::3, 1::3].astype(int) - expected[..., :3])[opaque].max() <= 1
        seen.append(frame[48, 48].astype(int))
    assert np.abs(np.diff(seen, axis=0)).sum() > 0


def test_a_neighbouring_tile_is_never_seen() -> None:
    turns = np.zeros(25, bool)
    textures = random_textures(turns, seed=5, ranks=(4, 2, 2), opaque=True, most_views=1)
    square = scattered(25, seed=5, all_turn=False)
    square.centre[:] = [100.0, 0.0, 0.0]
    square.centre[12] = 0.0
    square.half_s[12], square.half_t[12] = [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]
    camera = placed_camera((2.0, 0.0, 0.0), (0, 0, 0), (100, 100), 97.3)
    frames = []
    for value in (0, 255):
        planes = tuple(
            np.where((np.arange(len(p)) // (len(p) // 25) == 12)[:, None, None], p, np.uint8(value))
            for p in textures.planes
        )
        changed = textures._replace(planes=(planes[0], planes[1], planes[2]))
        frames.append(picture(ShaderStreet(square, changed), *camera, size=(100, 100))[0])
    assert np.array_equal(frames[0], frames[1])
    assert frames[0].any()


def test_outlines_are_smooth_between_texels() -> None:
    textures = random_textures(STILL, seed=6, ranks=(1, 0, 0))
    _, covered = from_the_front(textures, 0.0)
    # A disc: the outline of bits alone would have steps of three pixels in each row.
    widths = covered.sum(axis=1)
    steps = np.abs(np.diff(widths[widths > 0]))
    assert np.median(steps[: len(steps) // 4]) < 6
    assert (np.diff(widths[::3]) != 0).sum() < (np.diff(widths) != 0).sum()


@pytest.mark.parametrize("street", [ShaderStreet, ProcessorStreet])
@pytest.mark.parametrize("place", [(2, 0, 0), (-1, 2, 1), (0.3, -0.2, 2.5), (1, 1, -2), (3, 0, 1)])
def test_a_turning_square_faces_the_eye(street: Any, place: tuple[float, ...]) -> None:
    textures = random_textures(TURNING, seed=7, ranks=(1, 1, 1), opaque=True)
    square = facing(0.0, 0, half=0.4, turns=True)
    eye = np.array(place, np.float64)
    # The camera looks beside it: what faces is the square, not its picture.
    intrinsics, pose = placed_camera(eye, (0.2, 0.1, 0.15), SIZE, 120.0)
    _, covered = picture(street(square, textures), intrinsics, pose)
    row, column = axes_facing(square.centre[0], eye)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * 0.4 @ np.stack([row, column])
    pixels, _ = project_points(intrinsics, pose, corners)
    expected = inside(pixels, SIZE)
    assert expected.sum() > 300
    assert (covered != expected).sum() <= 6


def inside(corners: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Pixels whose middle is in the convex polygon (n, 2)."""
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    sides = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    return np.all(np.array(sides) > 0, axis=0) | np.all(np.array(sides) < 0, axis=0)


# ---- many --------------------------------------------------------------------------------------


def share_alike(one: NDArray[np.uint8], other: NDArray[np.uint8], codes: int = 1) -> float:
    """Share of pixels (…, 3) that differ by so many codes at most."""
    return float((np.abs(one.astype(int) - other) <= codes).all(axis=-1).mean())


def a_street(
    count: int, seed: int, colour: str = "ycocg", tint_side: int = 16
) -> tuple[Billboards, CompressedTextures]:
    placed = scattered(count, seed=seed)
    return placed, random_textures(placed.turns, seed=seed, colour=colour, tint_side=tint_side)


@pytest.mark.parametrize(("colour", "tint_side"), [("ycocg", 32), ("rgb", 32), ("ycocg", 16)])
def test_shader_and_processor_draw_the_same(colour: str, tint_side: int) -> None:
    placed, textures = a_street(1500, 8, colour, tint_side)
    camera = placed_camera((0.5, -1.0, 0.3), (9, 2, 0), SIZE, 100.0)
    mine, cover = picture(ShaderStreet(placed, textures), *camera)
    rival, rival_cover = picture(ProcessorStreet(placed, textures), *camera)
    assert (cover != rival_cover).sum() <= 10
    both = cover & rival_cover
    assert both.mean() > 0.3
    assert share_alike(mine[both], rival[both], 1) >= 0.995


@pytest.mark.parametrize("street", [ShaderStreet, ProcessorStreet])
def test_several_pages_draw_the_same_picture(street: Any) -> None:
    placed, textures = a_street(120, 9)
    camera = placed_camera((-9.0, -2.0, 0.3), (9, 2, 0), SIZE, 90.0)
    one, many = street(placed, textures), street(placed, textures, most_texels=256)
    assert len(one.actors) == 1
    assert len(many.actors) > 1
    (frame, cover), (frames, covers) = picture(one, *camera), picture(many, *camera)
    assert np.array_equal(cover, covers)
    assert cover.any()
    # Planes in other places are rounded otherwise.
    assert share_alike(frame, frames) >= 0.999


def test_packed_pages_are_drawn_like_textures() -> None:
    placed, textures = a_street(60, 10)
    camera = placed_camera((-9.0, -2.0, 0.3), (9, 2, 0), SIZE, 90.0)
    frame, _ = picture(ShaderStreet(placed, textures), *camera)
    again, _ = picture(ShaderStreet(placed, pack_pages(textures)), *camera)
    assert np.array_equal(frame, again)
    with pytest.raises(ValueError, match="found textures of 60 billboards; expected 61"):
        ShaderStreet(scattered(61), pack_pages(textures))


@pytest.mark.parametrize("seed", range(4))
def test_what_is_left_out_does_not_show(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    placed, textures = a_street(600, 20 + seed)
    rng = np.random.default_rng(seed)
    # Some stand around the camera, above and below it.
    eye = rng.uniform(-3, 3, 3)
    towards = rng.standard_normal((40, 3))
    towards[0] = [0.0, 0.0, 1.0]
    # None reaches the near plane, which is another with another number of billboards.
    towards *= rng.uniform(1.0, 1.8, (40, 1)) / np.linalg.norm(towards, axis=1, keepdims=True)
    placed.centre[:40] = eye + towards
    camera = placed_camera(eye, rng.uniform(-9, 9, 3), SIZE, 80.0)
    sent = ShaderStreet(placed, textures).look(*camera, *SIZE)
    assert 0 < sent < 450
    frame, cover = picture(ShaderStreet(placed, textures), *camera)

    def everything(placed: Billboards, *_: Any) -> NDArray[np.int64]:
        return np.argsort(np.linalg.norm(placed.centre - eye, axis=1))

    monkeypatch.setattr(quads, "visible_billboards", everything)
    whole, whole_cover = picture(ShaderStreet(placed, textures), *camera)
    assert np.array_equal(cover, whole_cover)
    # The stage's near and far planes are others, and so are depths and rounding.
    assert share_alike(frame, whole) >= 0.999


def test_culling_against_points_of_the_rectangles() -> None:
    placed = scattered(3000, seed=30, reach=6.0)
    eye = np.array([0.3, 0.2, -0.1])
    intrinsics, pose = placed_camera(eye, (3, 1, 0.5), SIZE, 100.0)
    found = visible_billboards(placed, intrinsics, pose, *SIZE)
    distances = np.linalg.norm(placed.centre[found] - eye, axis=1)
    assert (np.diff(distances) >= 0).all()
    row, column = axes_facing(placed.centre, eye)
    turns = placed.turns[:, None]
    half_s = np.where(turns, row * placed.half_s[:, :1], placed.half_s)
    half_t = np.where(turns, column * placed.half_t[:, 2:], placed.half_t)
    steps = np.linspace(-1, 1, 15)
    s, t = (grid.ravel()[:, None, None] for grid in np.meshgrid(steps, steps))
    pixels, depth = project_points(intrinsics, pose, placed.centre + s * half_s + t * half_t)
    shown = (depth >= NEAR) & (pixels >= -0.5).all(axis=-1)
    shown &= (pixels <= np.array(SIZE) - 0.5).all(axis=-1)
    shows = shown.any(axis=0)
    assert set(np.flatnonzero(shows)) <= set(found)
    # And few more: what is behind no plane as a whole but beside the picture's corners.
    assert len(found) < 1.15 * shows.sum()


@pytest.mark.parametrize("street", [ShaderStreet, ProcessorStreet])
def test_nothing_in_view_and_no_views_draw_nothing(street: Any) -> None:
    placed = facing(0.0, 0)
    textures = random_textures(STILL, seed=11, opaque=True)
    away = placed_camera((2.0, 0.0, 0.0), (4.0, 0.0, 0.0), SIZE, 90.0)
    made = street(placed, textures)
    assert made.look(*away, *SIZE) == 0
    assert not picture(made, *away)[1].any()
    towards = placed_camera((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), SIZE, 90.0)
    assert picture(made, *towards)[1].any()
    unseen = textures._replace(
        first=np.array([0, 0]),
        direction=textures.direction[:0],
        means=textures.means[:0],
        weights=(textures.weights[0][:0], textures.weights[1][:0], textures.weights[2][:0]),
    )
    blank = street(placed, unseen)
    assert blank.look(*towards, *SIZE) == 0
    assert not picture(blank, *towards)[1].any()


# ---- cameras -----------------------------------------------------------------------------------


def test_other_cameras_are_refused() -> None:
    intrinsics, pose = placed_camera((0, 0, 0), (1, 0, 0), SIZE, 100.0)
    stretched, moved, aside = (intrinsics.copy() for _ in range(3))
    stretched[0, 0] = 101.0
    moved[1, 2] += 2.0
    aside[0, 2] += 2.0
    with pytest.raises(ValueError, match=r"focal lengths 101.0 and 100.0; expected equal"):
        stage_camera(stretched, pose, SIZE[1])
    with pytest.raises(ValueError, match=r"in row 61.5; expected 59.5, the middle of 120"):
        stage_camera(moved, pose, SIZE[1])
    street = ShaderStreet(facing(0.0, 0), random_textures(STILL))
    with pytest.raises(ValueError, match=r"in column 81.5; expected 79.5, the middle of 160"):
        street.look(aside, pose, *SIZE)
