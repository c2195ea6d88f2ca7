"""Pictures of a street from all its viewpoints: which camera took which, and how they compare."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.picture_metrics import image_metrics
from pipelines.geometry.cameras import moved_left
from pipelines.street_billboards.drawing.street_stage import StreetStage, flight_poses
from pipelines.street_billboards.figures import match_exposure
from pipelines.street_billboards.frames import (
    StreetFrames,
    Viewpoints,
    draw_frames,
    draw_view,
    viewpoints,
)
from pipelines.street_billboards.street_model import StreetModel
from pipelines.street_billboards.textures.atlases import pack_pages
from tests.pipelines.street_billboards.compressed_street import (
    placed_camera,
    random_textures,
    scattered,
)

SIZE = (64, 48)
OFFSETS = (0.5, 1.5, 3.0)


@pytest.fixture(scope="module")
def street() -> StreetModel:
    made = scattered(60, reach=5.0)
    textures = random_textures(made.turns)
    sky = np.full((16, 32, 3), 0.4, np.float32)
    return StreetModel(made, pack_pages(textures), textures, sky)


@pytest.fixture(scope="module")
def views() -> Viewpoints:
    made = [placed_camera((x, -9.0, 0.5), (0, 0, 0), SIZE, 50.0) for x in np.arange(7) - 3.0]
    held_out = np.array([False, True, False, False, True, False, False])
    return viewpoints(
        made[0][0],
        np.stack([pose for _, pose in made]),
        held_out,
        SIZE,
        offsets=OFFSETS,
        flight_frames=4,
        swerve=1.0,
    )


@pytest.fixture(scope="module")
def truth(street: StreetModel, views: Viewpoints) -> np.ndarray:
    """What the cameras would have taken, half as bright, one of them noisy."""
    rng = np.random.default_rng(0)
    pictures = [draw_view(street, views.intrinsics, pose, SIZE) for pose in views.held_out]
    dark = np.stack(pictures).astype(int) // 2
    dark[1] += rng.integers(0, 40, dark[1].shape)
    return dark.astype(np.uint8)


@pytest.fixture(scope="module")
def drawn(street: StreetModel, views: Viewpoints, truth: np.ndarray) -> StreetFrames:
    return draw_frames(street, views, truth, supersampling=1)


def test_viewpoints_are_on_the_path_beside_it_and_along_the_seen_part(views: Viewpoints) -> None:
    places = views.held_out[:, :3, 3]
    np.testing.assert_allclose(places[:, 0], [-2.0, 1.0])
    assert views.beside.shape == (2, 3, 4, 4)
    for held, poses in zip(views.held_out, views.beside, strict=True):
        for offset, pose in zip(OFFSETS, poses, strict=True):
            np.testing.assert_array_equal(pose, moved_left(held, offset))
    # The first two frames' ground was seen by nobody.
    assert len(views.flight) == 4
    assert views.flight[0, 0, 3] == -1.0
    every = np.stack(
        [placed_camera((x, -9.0, 0.5), (0, 0, 0), SIZE, 50.0)[1] for x in range(-1, 4)]
    )
    np.testing.assert_allclose(views.flight, flight_poses(every, 4, 1.0))


def test_every_picture_is_from_its_own_place(
    street: StreetModel, views: Viewpoints, drawn: StreetFrames
) -> None:
    with StreetStage(street.billboards, street.pages, street.sky, SIZE) as stage:

        def picture(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            view = stage.view(views.intrinsics, pose)
            return to_8bit(view.with_sky), view.covered > 0.5

        for number in range(2):
            alone = to_8bit(stage.view(views.intrinsics, views.held_out[number]).alone)
            np.testing.assert_array_equal(drawn.alone[number], alone)
            covered = picture(views.held_out[number])[1]
            np.testing.assert_array_equal(drawn.covered[number], covered)
            assert 0.05 < covered.mean() < 0.95
            for place in range(3):
                shown, covered = picture(views.beside[number, place])
                np.testing.assert_array_equal(drawn.beside[number, place], shown)
                np.testing.assert_array_equal(drawn.beside_covered[number, place], covered)
        for number in range(4):
            np.testing.assert_array_equal(drawn.flight[number], picture(views.flight[number])[0])


def test_pictures_are_compared_at_the_true_ones_exposure(
    street: StreetModel, views: Viewpoints, truth: np.ndarray, drawn: StreetFrames
) -> None:
    for number in range(2):
        shown = draw_view(street, views.intrinsics, views.held_out[number], SIZE, supersampling=1)
        where = drawn.covered[number]
        expected = match_exposure(shown, truth[number], where)
        np.testing.assert_array_equal(drawn.rendered[number], expected)
        assert drawn.metrics[number] == image_metrics(expected, truth[number], where)
    assert drawn.metrics[0].psnr > drawn.metrics[1].psnr + 3.0


def test_shader_and_processor_draw_the_first_held_out_frame(drawn: StreetFrames) -> None:
    assert drawn.shaded.shape == drawn.decoded.shape == (SIZE[1], SIZE[0], 3)
    assert (np.abs(drawn.shaded.astype(int) - drawn.decoded).max(axis=-1) > 8).mean() < 0.02
    np.testing.assert_array_equal(drawn.shaded, drawn.alone[0])
    assert 0 < drawn.visible_billboards <= 60
    assert drawn.renderer


def test_progress_rises(street: StreetModel, views: Viewpoints, truth: np.ndarray) -> None:
    told: list[float] = []
    draw_frames(street, views, truth, supersampling=1, progress=told.append)
    assert told == [number / 12 for number in range(12)]
