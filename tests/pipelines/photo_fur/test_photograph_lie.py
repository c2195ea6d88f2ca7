"""The lie of hair in photographs against stripes and against the hairs of virtual pelts."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.geometry.rays import first_hits
from pipelines.photo_fur.photograph_lie import PhotographLie, photograph_lie, pieces_of
from pipelines.virtual.pelt.hairs import FurKind, grow_hairs
from pipelines.virtual.pelt.pelt import SKIN_ALBEDO, photograph_hairs
from pipelines.virtual.pelt.prisms import build_prism_scene

SIZE = 128
KINDS = (FurKind(), FurKind(curl=1.8, hue=(0.78, 0.74, 0.68)), FurKind(tip_tilt=50.0))


@functools.cache
def pelt(seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Luminance, and towards which direction the hair of each pixel grows, NaN at the skin."""
    random = np.random.default_rng(seed)
    hairs = grow_hairs(1200, random, KINDS[seed % len(KINDS)])
    photograph = photograph_hairs(hairs, SIZE, 16, random)
    fur = build_prism_scene(hairs, SKIN_ALBEDO)
    rows, columns = np.mgrid[:SIZE, :SIZE].reshape(2, -1)
    above = np.stack([(columns + 0.5) / SIZE, 1 - (rows + 0.5) / SIZE, 0 * rows + 2 * fur.top], -1)
    hits = first_hits(fur.scene, above, (0.0, 0.0, -1.0))
    faces = len(fur.fibres.segment)
    copy, face = np.divmod(np.maximum(hits.triangle, 0), faces)
    is_hair = (hits.triangle >= 0) & (hits.triangle < faces * len(fur.fibres.hair))
    copy = np.where(is_hair, copy, 0)
    tangent = fur.fibres.tangents[fur.fibres.hair[copy], fur.fibres.segment[face]]
    towards = np.where(is_hair, np.arctan2(tangent[:, 1], tangent[:, 0]), np.nan)
    return luminance(photograph.radiance), towards.reshape(SIZE, SIZE)


def degrees_apart(lie: PhotographLie, towards: NDArray[np.float64]) -> NDArray[np.float64]:
    apart = np.degrees(np.abs(np.angle(np.exp(1j * (lie.direction - towards)))))
    return apart[np.isfinite(apart)]


@pytest.mark.parametrize("seed", range(6))
def test_hairs_are_found_with_their_sign(seed: int) -> None:
    """Single hairs differ from the lie about them, so the median is no smaller."""
    grey, towards = pelt(seed)
    apart = degrees_apart(photograph_lie(grey), towards)
    assert np.median(apart) < 25
    assert (apart > 90).mean() < 0.1


def test_a_shuffled_photograph_tells_nothing() -> None:
    grey, _ = pelt(0)
    lie = photograph_lie(grey)
    shuffled = np.random.default_rng(0).permutation(grey.ravel()).reshape(grey.shape)
    null = photograph_lie(shuffled)
    assert np.median(null.coherence) < 0.5 * np.median(lie.coherence)
    assert abs(null.slant) < 0.5 * abs(lie.slant)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_turned_photograph_has_its_hair_turned(quarters: int) -> None:
    grey, _ = pelt(1)
    lie, turned = photograph_lie(grey), photograph_lie(np.rot90(grey, quarters))
    expected = np.rot90(lie.direction, quarters) + quarters * np.pi / 2
    assert np.median(degrees_apart(turned, expected)) < 1


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2, 2.5])
def test_stripes_run_along_themselves(angle: float) -> None:
    rows, columns = np.mgrid[:96, :96]
    across = -np.sin(angle) * columns - np.cos(angle) * rows
    lie = photograph_lie(1.5 + np.sin(across / 2.0))
    inside = lie.direction[16:-16, 16:-16]
    np.testing.assert_allclose(np.cos(2 * (inside - angle)), 1.0, atol=2e-3)
    assert lie.coherence[16:-16, 16:-16].min() > 0.95


def test_what_is_not_fur_has_no_say() -> None:
    grey, _ = pelt(0)
    opaque = np.ones(grey.shape, bool)
    opaque[:, 80:] = False
    beside = np.where(opaque, grey, np.random.default_rng(1).random(grey.shape))
    lie, expected = photograph_lie(beside, opaque), photograph_lie(grey)
    left = PhotographLie(lie.direction[:, :64], lie.coherence[:, :64], lie.slant)
    assert np.median(degrees_apart(left, expected.direction[:, :64])) < 6


def test_pieces_lie_within_the_fur() -> None:
    grey, _ = pelt(0)
    opaque = np.zeros(grey.shape, bool)
    opaque[20:100, 10:70] = True
    piece = pieces_of(photograph_lie(grey, opaque), 0.15, opaque)
    x, y = piece.places.T
    assert len(x) > 3
    rows, columns = np.mgrid[:SIZE, :SIZE]
    for column, row in zip(x * SIZE, SIZE - y * SIZE, strict=True):
        disc = np.hypot(columns + 0.5 - column, rows + 0.5 - row) < 0.15 * SIZE
        assert opaque[disc].mean() > 0.7
        assert disc.sum() > 0.98 * np.pi * (0.15 * SIZE) ** 2 - 20  # all in the photograph
    alone = pieces_of(photograph_lie(grey, opaque), 2.0, opaque)
    np.testing.assert_allclose(alone.places.mean(axis=0), [40 / SIZE, 68 / SIZE], atol=0.2)
    with pytest.raises(ValueError, match=r"no part of the photograph is fur; expected a disc"):
        pieces_of(photograph_lie(grey), 0.1, np.zeros(grey.shape, bool))


def test_of_a_coat_of_many_colours_the_pieces_are_of_one() -> None:
    grey, _ = pelt(0)
    radiance = np.repeat(grey[..., None], 3, axis=2)
    radiance[:, : SIZE // 4, 0] *= 3.0  # a red quarter
    lie = photograph_lie(grey)
    every, alike = pieces_of(lie, 0.08), pieces_of(lie, 0.08, None, radiance)
    assert every.places[:, 0].min() < 0.2
    assert alike.places[:, 0].min() > 0.25
    assert 0.4 < len(alike.places) / len(every.places) < 0.65
