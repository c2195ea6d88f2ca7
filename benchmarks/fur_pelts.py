"""Figures of the fur system on virtual pelts of four kinds that were never looked at: how near the
depth comes, and whether the fur is found when it lies in another photograph."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, luminance
from pipelines.photo_fur.attenuation import (
    CALIBRATED_ENDS,
    PAPER_ENDS,
    Attenuation,
    fit_attenuation,
)
from pipelines.photo_fur.figures import estimated_depth
from pipelines.photo_fur.segmentation import fur_mask
from pipelines.virtual.pelt.hairs import FurKind
from pipelines.virtual.pelt.pelt import Pelt, make_pelt

TAIL = 0.005
LAYERS = 15
HUES = {
    "golden": (0.49, 0.31, 0.165),
    "white": (0.78, 0.74, 0.68),
    "brown": (0.22, 0.13, 0.07),
    "grey": (0.45, 0.43, 0.40),
    "ginger": (0.62, 0.30, 0.11),
}
KINDS = {
    "golden": FurKind(),
    "short": FurKind(tip_tilt=48.0, hairs_per_square_length=600.0, hue=HUES["grey"]),
    "curly": FurKind(curl=2.2, hue=HUES["white"]),
    "mottled": FurKind(colour_spread=0.2, undercoat_share=0.75, hue=HUES["brown"]),
}
"""Of the pelts that are judged; none is among those that the depths are calibrated on."""
_SIDE, _HAIRS = 256, 4000
_CALIBRATING = 24
_FIRST_SEED, _FIRST_CALIBRATING = 2000, 1000
_BACKGROUNDS = ("astronaut", "coffee", "rocket", "chelsea", "brick", "camera")


class Judged(NamedTuple):
    """A pelt with its kind."""

    kind: str
    pelt: Pelt


def judged_pelts(seeds: int, samples: int) -> list[Judged]:
    """So many pelts of each kind."""
    return [
        Judged(name, make_pelt(_SIDE, _HAIRS, samples, _FIRST_SEED + seed, kind))
        for name, kind in KINDS.items()
        for seed in range(seeds)
    ]


def depth_figures(pelts: list[Judged]) -> dict[str, Any]:
    """RMSE of the depth, in thicknesses: calibrated, as the paper reads it, of shuffled pixels, of
    the best constant; and the mean error in layers."""
    figures: dict[str, Any] = {}
    errors = {
        "": [_error(pelt, CALIBRATED_ENDS) for _, pelt in pelts],
        "_paper": [_error(pelt, PAPER_ENDS) for _, pelt in pelts],
        "_null": [_error(_shuffled(pelt), CALIBRATED_ENDS) for _, pelt in pelts],
        "_constant": [pelt.depth - pelt.depth.mean() for _, pelt in pelts],
    }
    for name, each in errors.items():
        figures[f"depth_rmse{name}"] = float(np.mean([np.sqrt((e**2).mean()) for e in each]))
        figures[f"layer_error{name}"] = float(LAYERS * np.mean([np.abs(e).mean() for e in each]))
    kinds = [kind for kind, _ in pelts]
    figures["depth_rmse_kinds"] = {
        kind: float(
            np.mean(
                [
                    np.sqrt((e**2).mean())
                    for k, e in zip(kinds, errors[""], strict=True)
                    if k == kind
                ]
            )
        )
        for kind in KINDS
    }
    return figures | {"depth_pelts": len(pelts)}


def calibrated_ends(samples: int) -> dict[str, Any]:
    """The depths at Imax and Imin that fit a family of pelts best: `CALIBRATED_ENDS`."""
    readings, depths = [], []
    for seed in range(_FIRST_CALIBRATING, _FIRST_CALIBRATING + _CALIBRATING):
        random = np.random.default_rng(seed)
        kind = FurKind(
            random.uniform(500, 1200),
            random.uniform(0.3, 0.8),
            random.uniform(0.5, 2.2),
            random.uniform(45, 75),
            random.uniform(0.05, 0.2),
            HUES[sorted(HUES)[random.integers(len(HUES))]],
        )
        pelt = make_pelt(_SIDE, _HAIRS, samples, seed, kind)
        grey, medium = _read(pelt)
        readings.append(np.log(medium.brightest / np.maximum(grey, 1e-4)) / medium.coefficient)
        depths.append(pelt.depth)
    slope, offset = np.polyfit(np.ravel(readings), np.ravel(depths), 1)
    return {"calibrated_ends": [float(offset), float(offset + slope)], "calibrated_on": len(depths)}


def segmentation_figures(pelts: list[Judged]) -> dict[str, Any]:
    """Intersection over union of the fur found in photographs with a pelt in their middle, which
    has a random outline and is lit unevenly; of the nulls, a disc and the whole picture; and the
    share of pelts alone that are called fur altogether."""
    scores: list[tuple[float, float, float]] = []
    for number, (_, pelt) in enumerate(pelts):
        name = _BACKGROUNDS[number % len(_BACKGROUNDS)]
        picture, true = _composite(pelt, name, np.random.default_rng(number))
        found = fur_mask(picture)
        everywhere = np.ones_like(true)
        guesses = (everywhere if found is None else found, _disc(_SIDE), everywhere)
        scores.append(tuple(_overlap(guess, true) for guess in guesses))  # type: ignore[arg-type]
    mean, least = np.mean(scores, axis=0), np.min(scores, axis=0)
    whole = np.mean([fur_mask(pelt.radiance) is None for _, pelt in pelts])
    return {
        "segmentation_iou": float(mean[0]),
        "segmentation_iou_worst": float(least[0]),
        "segmentation_iou_null_disc": float(mean[1]),
        "segmentation_iou_null_whole": float(mean[2]),
        "segmentation_whole_share": float(whole),
    }


def _read(pelt: Pelt) -> tuple[NDArray[np.floating], Attenuation]:
    grey = luminance(pelt.radiance)
    return grey, fit_attenuation(grey, tail=TAIL)


def _error(pelt: Pelt, ends: tuple[float, float]) -> NDArray[np.floating]:
    grey, medium = _read(pelt)
    return estimated_depth(grey, medium.with_ends_at(ends)) - pelt.depth


def _shuffled(pelt: Pelt) -> Pelt:
    pixels = np.random.default_rng(0).permutation(pelt.radiance.reshape(-1, 3))
    return pelt._replace(radiance=pixels.reshape(pelt.radiance.shape))


def _composite(
    pelt: Pelt, name: str, random: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """A photograph of scikit-image's with the pelt in it, linear, and where it is."""
    from scipy.ndimage import gaussian_filter
    from skimage import data
    from skimage.transform import resize

    picture = getattr(data, name)()
    colours = picture if picture.ndim == 3 else np.dstack([picture] * 3)
    side = min(colours.shape[:2])
    top, left = ((length - side) // 2 for length in colours.shape[:2])
    square = colours[top : top + side, left : left + side]
    behind = decode_srgb(np.asarray(resize(square, (_SIDE, _SIDE), anti_aliasing=True)))
    where = _outline(random)
    share = gaussian_filter(where.astype(np.float64), 0.7)[..., None]
    slope = np.linspace(-0.5, 0.5, _SIDE) * random.uniform(-0.5, 0.5)
    lit = pelt.radiance * np.exp(slope)[:, None]
    return np.clip(share * lit + (1 - share) * behind, 0.0, 1.0), where


def _outline(random: np.random.Generator) -> NDArray[np.bool_]:
    """A random star about the middle, of a quarter to three quarters of the picture."""
    rows, columns = np.mgrid[:_SIDE, :_SIDE] / _SIDE - 0.5
    x, y = columns - random.uniform(-0.08, 0.08), rows - random.uniform(-0.08, 0.08)
    angle, radius = np.arctan2(y, x), np.hypot(x, y)
    reach = 1 + sum(
        0.25 / k * random.normal() * np.cos(k * angle + random.uniform(0, 6.28))
        for k in range(1, 7)
    )
    wide = radius / np.maximum(reach, 0.1)
    return np.asarray(wide < np.quantile(wide, random.uniform(0.25, 0.75)))


def _disc(side: int) -> NDArray[np.bool_]:
    """Half the picture."""
    rows, columns = np.mgrid[:side, :side] / (side - 1) - 0.5
    return np.asarray(np.hypot(rows, columns) < 0.4)


def _overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    return float((one & other).sum() / (one | other).sum())
