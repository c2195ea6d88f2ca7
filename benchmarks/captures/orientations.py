"""Whether photographs are turned upright, however they lie: virtual cloths, all eight ways."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.neural_btf.orientation import ORIENTATIONS, Scores, orientation_scores

_TEXELS = 48
_SAMPLES = 2
_RING = np.radians(45.0)


class Photographed(NamedTuple):
    """A cloth from straight above and from a ring of views; photographs (image, y, x, 3)."""

    pairs: Pairs
    photographs: NDArray[np.float32]


def orientation_right() -> dict[str, Any]:
    """How often the orientation is found, of 4 cloths x 8 orientations.

    ``orientation_margin_least``: of the right one's score over the best wrong one's.
    ``orientation_null_*``: the same photographs dealt at random to lights and views: how often the
    right one is found (chance is an eighth), the median margin, and the share of the deals where
    scores are called clear.
    """
    right, margins, nulls = [], [], []
    chance = np.random.default_rng(0)
    for cloth in photographed_cloths():
        for orientation in ORIENTATIONS:
            scores = scores_of(cloth, orientation)
            right.append(scores.best == orientation and scores.are_clear)
            margins.append(scores.margin(orientation))
        for orientation in ORIENTATIONS:
            dealt = chance.permutation(len(cloth.photographs))
            mixed = cloth._replace(photographs=cloth.photographs[dealt])
            nulls.append((orientation, scores_of(mixed, orientation)))
    return {
        "orientation_right": float(np.mean(right)),
        "orientation_cases": len(right),
        "orientation_margin_least": float(np.min(margins)),
        "orientation_null_right": float(np.mean([s.best == name for name, s in nulls])),
        "orientation_null_margin": float(np.median([s.margin(s.best) for _, s in nulls])),
        "orientation_null_clear": float(np.mean([s.are_clear for _, s in nulls])),
    }


def photographed_cloths(texels: int = _TEXELS, seed: int = 0) -> Iterator[Photographed]:
    """The four virtual cloths, from above and from the ring of views at 45 degrees."""
    from pipelines.virtual.cloth.weaves import MATERIALS

    for material in MATERIALS:
        yield photographed(material, texels, seed)


def photographed(material: str, texels: int = _TEXELS, seed: int = 0) -> Photographed:
    """One virtual cloth under 41 lights."""
    from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
    from pipelines.virtual.cloth.weaves import make_cloth

    lights = hemisphere_table(41)
    views = lights[(lights[:, 0] == 0) | np.isclose(lights[:, 0], _RING)]
    cloth = make_cloth(material, seed)
    gonio = Gonioreflectometer(cloth, lights, (texels, texels), _SAMPLES, seed)
    photographs = np.concatenate([gonio.photographs(view) for view in views])
    return Photographed(all_pairs(views, lights), photographs)


def laid(photographs: NDArray[np.float32], orientation: str) -> NDArray[np.float32]:
    """Upright photographs (image, y, x, 3) as they would lie in files."""
    number = ORIENTATIONS.index(orientation)
    mirrored = photographs[:, :, ::-1] if number >= 4 else photographs
    return np.rot90(mirrored, number % 4, axes=(1, 2))


def scores_of(cloth: Photographed, orientation: str) -> Scores:
    """The scores of a cloth whose photographs lie so in their files."""
    lying = laid(cloth.photographs, orientation)
    scores = orientation_scores(cloth.pairs, lambda images: lying[images])
    assert scores is not None  # a ring of views, lights all around, 48 texels
    return scores
