"""Lines on a smoother ground: where a picture has ridges, of which direction and how wide.

Filters are second derivatives of a Gaussian across the line, averaged along it, of several widths
and directions. A point is kept where the answer is largest across the line *and* among the
directions, so two scratches that cross go on through their crossing: each is a chain of points in
the space of place and direction.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import gaussian_filter

FloatArray = NDArray[np.float32]

DIRECTIONS = 24
"""Of the filters, over half a turn."""
WIDTHS = (0.8, 1.3, 2.0, 3.2, 5.0)
"""Standard deviations of the filters across, pixels: bars twice as wide answer most."""
_GROUND = 0.03
"""Standard deviation of what is ground, over the longer side."""
_DARKEST = 1e-3
"""Of the mean luminance: what is darker than this has no contrast of its own."""
_MOST_CONTRAST = 1.0
_SEEN, SURE = 3.0, 6.0
"""An answer over its deviation by noise: at a point, and at the best point of a scratch."""


class Ridges(NamedTuple):
    """Points of lines: n in all.

    place: (n, 2) float64 x, y in pixels, y downwards, a pixel's centre at + 0.5.
    angle: (n,) float64 in [0, pi), radians from x towards *up*.
    answer: (n,) float32, about half of the line's contrast. score: (n,) float32, answer over its
    deviation by noise. half_width: (n,) float32, standard deviation of the filter, pixels.
    """

    place: NDArray[np.float64]
    angle: NDArray[np.float64]
    answer: FloatArray
    score: FloatArray
    half_width: FloatArray


def line_contrast(luminance: NDArray[np.floating]) -> FloatArray:
    """How much brighter each pixel (y, x) is than the ground around it: 0.1 is a tenth.

    The ground is the smoothed picture, twice: of what stands out of the first, little counts in
    the second. Contrasts are cut at 1, so that a lamp's mirror image is no stronger than a line.
    """
    value = np.log(np.maximum(luminance, _DARKEST * float(luminance.mean()))).astype(np.float32)
    sigma = _GROUND * max(value.shape)
    ground = gaussian_filter(value, sigma, mode="nearest")
    away = value - ground
    usual = 2.0 * 1.4826 * float(np.median(np.abs(away))) + 1e-6
    ground += gaussian_filter(np.clip(away, -usual, usual), sigma, mode="nearest")
    return np.clip(np.expm1(value - ground), -_MOST_CONTRAST, _MOST_CONTRAST).astype(np.float32)


def find_ridges(contrast: FloatArray, *, dark: bool) -> Ridges:
    """Points on bright lines of a picture (y, x) of contrasts, or on dark ones.

    Those whose answer stands 3 deviations out of the answers everywhere (by their median: lines
    are few). Within the border, where filters see beyond the picture, there are no points.
    """
    answers, scores, widths = _answers(-contrast if dark else contrast)
    kept = _largest_across(answers) & (scores > _SEEN)
    kept &= (answers >= np.roll(answers, 1, axis=0)) & (answers > np.roll(answers, -1, axis=0))
    direction, row, column = np.nonzero(kept)
    # Between the directions and across the line a parabola tells the peak.
    before, here, after = (
        answers[(direction + k) % DIRECTIONS, row, column].astype(np.float64) for k in (-1, 0, 1)
    )
    angle = np.pi / DIRECTIONS * (direction + _peak(before, here, after))
    return Ridges(
        np.stack([column + 0.5, row + 0.5], axis=1),
        np.mod(angle, np.pi),
        answers[kept],
        scores[kept],
        widths[kept],
    )


def is_dark(contrast: FloatArray) -> bool:
    """Whether lines darker than their ground outweigh brighter ones, by the third moment of the
    fine parts: noise has none."""
    fine = contrast - gaussian_filter(contrast, 4.0)
    return bool(np.mean(gaussian_filter(fine, 0.7).astype(np.float64) ** 3) < 0.0)


def _peak(
    before: NDArray[np.float64], here: NDArray[np.float64], after: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where a parabola through three values has its peak, from the middle one, in [-0.5, 0.5]."""
    bow = np.minimum(before - 2.0 * here + after, -1e-12)
    return np.clip(0.5 * (before - after) / bow, -0.5, 0.5)


def _answers(contrast: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Largest answer of all widths, its score and the width, each (DIRECTIONS, y, x)."""
    height, width = contrast.shape
    margin = math.ceil(4 * WIDTHS[-1])
    shape = [next_fast_len(side + margin, real=True) for side in (height, width)]
    extra = [(0, size - side) for size, side in zip(shape, contrast.shape, strict=True)]
    spectrum = rfft2(np.pad(contrast, extra))  # beyond the border lies ground
    down = np.fft.fftfreq(shape[0])[:, None] * 2 * np.pi
    right = np.fft.rfftfreq(shape[1])[None] * 2 * np.pi
    best = np.zeros((DIRECTIONS, height, width), np.float32)
    score, chosen = np.zeros_like(best), np.zeros_like(best)
    for sigma in WIDTHS:
        along = 3.0 * sigma + 3.0
        for k in range(DIRECTIONS):
            cosine, sine = math.cos(np.pi * k / DIRECTIONS), math.sin(np.pi * k / DIRECTIONS)
            u, v = cosine * right - sine * down, sine * right + cosine * down
            square = (sigma * v) ** 2
            gain = (square * np.exp(-0.5 * (square + (along * u) ** 2))).astype(np.float32)
            answer = irfft2(spectrum * gain, s=shape)[:height, :width]
            noise = 1.4826 * float(np.median(np.abs(answer[::3, ::3]))) + 1e-9
            better = answer > best[k]
            best[k][better] = answer[better]
            chosen[k][better] = sigma
            np.maximum(score[k], answer / noise, out=score[k])
    border = math.ceil(2 * WIDTHS[0])
    for edge in (
        np.s_[:, :border],
        np.s_[:, -border:],
        np.s_[:, :, :border],
        np.s_[:, :, -border:],
    ):
        score[edge] = 0.0
    return best, score, chosen


def _largest_across(answers: FloatArray) -> NDArray[np.bool_]:
    """Whether a point's answer is not below those of its neighbours across the line."""
    kept = np.empty(answers.shape, bool)
    for k, answer in enumerate(answers):
        right = round(-math.sin(np.pi * k / DIRECTIONS))
        down = round(-math.cos(np.pi * k / DIRECTIONS))
        aside = np.roll(answer, (down, right), axis=(0, 1))
        other = np.roll(answer, (-down, -right), axis=(0, 1))
        kept[k] = (answer >= aside) & (answer > other)
    return kept
