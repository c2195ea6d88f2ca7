"""Figures of textures: nothing where they are right, much where they are spoilt."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.street_billboards.capture.point_fusion import RgbdViews
from pipelines.street_billboards.textures.atlases import pack_pages
from pipelines.street_billboards.textures.figures import (
    decoded_rmse,
    sampling_error,
    unpacked_error,
)
from pipelines.street_billboards.textures.texture_tables import SEEN, SIDE, UNSEEN, ViewTextures
from pipelines.street_billboards.textures.view_textures import view_textures
from tests.pipelines.street_billboards.compressed_street import random_textures
from tests.pipelines.street_billboards.painted_wall import VOXEL, Scene, on_the_wall

MIXED = np.arange(9) % 3 == 0


# ---- pages -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("colour", "tint_side"), [("ycocg", 16), ("ycocg", 8), ("ycocg", 32), ("rgb", 32)]
)
def test_pages_read_as_they_were_packed(colour: str, tint_side: int) -> None:
    textures = random_textures(MIXED, colour=colour, tint_side=tint_side)
    assert unpacked_error(pack_pages(textures), textures) < 1e-3
    # On several pages, too.
    textures = random_textures(MIXED, colour=colour, tint_side=tint_side, ranks=(6, 1, 3))
    small = pack_pages(textures, 96)
    assert len(small) > 1
    assert unpacked_error(small, textures) < 1e-3


def spoilt_byte(part: str) -> float:
    """The error when one byte of the first billboard's part of a page is another."""
    textures = random_textures(MIXED, ranks=(4, 2, 2), most_views=4, opaque=True)
    page = pack_pages(textures)[0]
    if part in ("detail", "tint"):
        atlas = getattr(page, part)
        texels = atlas.texels.copy()
        texels[5, 5] ^= 0xC0
        page = page._replace(**{part: atlas._replace(texels=texels)})
    else:
        bytes_ = getattr(page, part).copy()
        bytes_[0, 0, 0] ^= 0x40
        page = page._replace(**{part: bytes_})
    return unpacked_error([page], textures)


@pytest.mark.parametrize("part", ["detail", "tint", "views", "masks"])
def test_a_spoilt_byte_shows(part: str) -> None:
    assert spoilt_byte(part) > 3.0
    if part == "masks":
        assert spoilt_byte(part) == 255.0


def test_a_record_of_another_billboard_shows() -> None:
    textures = random_textures(np.zeros(4, bool), ranks=(4, 2, 2), most_views=1, opaque=True)
    page = pack_pages(textures)[0]
    assert unpacked_error([page._replace(records=page.records[::-1])], textures) > 10.0


# ---- decoding --------------------------------------------------------------------------------


def by_hand(textures, billboard: int, view: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """The formula of ``CompressedTextures``, for R, G, B at full resolution."""
    row = textures.first[billboard] + view
    made = np.zeros((SIDE, SIDE, 3))
    for c in range(3):
        made[..., c] = textures.means[row, c]
        plane = sum(int(r) for r in textures.ranks[:billboard, c])
        weight = sum(
            int(textures.ranks[b, c]) * int(textures.first[b + 1] - textures.first[b])
            for b in range(billboard)
        ) + view * int(textures.ranks[billboard, c])
        for k in range(int(textures.ranks[billboard, c])):
            made[..., c] += (
                textures.scales[c][plane + k]
                * ((float(textures.weights[c][weight + k]) - 128) / 127)
                * ((textures.planes[c][plane + k].astype(float) - 128) / 127)
            )
    return np.clip(made, 0, 255)


def test_decoded_rmse_by_hand() -> None:
    textures = random_textures(np.zeros(5, bool), colour="rgb", tint_side=32, contrast=20.0)
    rng = np.random.default_rng(0)
    # Views that were sampled are fewer than those that are stored.
    views, first, squares = [], [0], []
    for b in range(5):
        stored = textures.first[b + 1] - textures.first[b]
        for view in range(0, stored, 2):
            truth = by_hand(textures, b, view)
            colours = np.clip(np.rint(truth + rng.normal(0, 6, truth.shape)), 0, 255)
            states = rng.integers(0, 3, (SIDE, SIDE))
            squares.append(((colours - truth)[states == SEEN] ** 2).ravel())
            colours[states != SEEN] = 0  # means nothing
            views.append((textures.direction[textures.first[b] + view], colours, states))
        first.append(len(views))
    sampled = ViewTextures(
        np.array(first),
        np.array([view[0] for view in views], np.uint8),
        np.array([view[1] for view in views], np.uint8),
        np.array([view[2] for view in views], np.uint8),
        np.ones(len(views), np.float32),
    )
    expected = np.sqrt(np.concatenate(squares).mean())
    assert decoded_rmse(sampled, textures) == pytest.approx(expected, rel=1e-5)
    unseen = sampled._replace(states=np.full_like(sampled.states, UNSEEN))
    assert decoded_rmse(unseen, textures) == 0.0


# ---- sampling --------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[False, True], ids=["still", "turning"])
def street(request: pytest.FixtureRequest):  # type: ignore[no-untyped-def]
    spots = [(x, -5.0, 0.3) for x in (-2.0, 0.0, 2.0)]
    photographs = Scene().photographs(spots, size=(140, 120))
    walls = on_the_wall([(x, 0.0, 0.4) for x in (-0.7, 0.2, 0.9)], turns=request.param)
    views = view_textures(walls, VOXEL, photographs)
    frames = RgbdViews(
        photographs.depth,
        photographs.deviation,
        photographs.pixels,
        photographs.intrinsics,
        photographs.to_world,
    )
    return walls, views, frames, photographs.exposure_lut


def test_right_textures_differ_little_from_the_photographs(street) -> None:  # type: ignore[no-untyped-def]
    walls, views, frames, codes = street
    assert sampling_error(walls, views, frames, codes) < 2.0


@pytest.mark.parametrize("kind", ["mirrored", "upside down", "of another"])
def test_wrong_textures_differ_much(street, kind: str) -> None:  # type: ignore[no-untyped-def]
    walls, views, frames, codes = street
    changes = {
        "mirrored": views.colours[:, :, ::-1],
        "upside down": views.colours[:, ::-1],
        "of another": np.roll(views.colours, views.first[1], axis=0),
    }
    wrong = views._replace(colours=np.ascontiguousarray(changes[kind]))
    assert sampling_error(walls, wrong, frames, codes) > 5.0


def test_exposures_count(street) -> None:  # type: ignore[no-untyped-def]
    walls, views, frames, codes = street
    brighter = np.minimum(codes.astype(int) + 30, 255).astype(np.uint8)
    assert sampling_error(walls, views, frames, brighter) > 20.0


def test_nothing_asked_is_no_praise(street) -> None:  # type: ignore[no-untyped-def]
    walls, views, frames, codes = street
    nothing = ViewTextures(np.zeros(4, np.int64), *(values[:0] for values in views[1:]))
    assert sampling_error(walls, nothing, frames, codes) == 255.0
