"""Figures of streets, each computed apart from what made it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, encode_srgb

Picture = NDArray[np.uint8]


class Likeness(NamedTuple):
    """How a picture differs from the true one, over some of their pixels."""

    psnr: float
    """dB, of 8-bit codes."""
    ssim: float
    flip: float
    """Mean of the FLIP map, 0 = alike."""


def evened(picture: Picture, truth: Picture, where: NDArray[np.bool_]) -> Picture:
    """The picture (y, x, 3) at the exposure of the true one: one factor of linear light a channel.

    The factor is the ratio of the sums over ``where`` (y, x).
    """
    mine, theirs = decode_srgb(picture[where] / 255.0), decode_srgb(truth[where] / 255.0)
    factor = theirs.sum(axis=0) / np.maximum(mine.sum(axis=0), 1e-9)
    linear = decode_srgb(picture / 255.0) * factor
    return np.rint(encode_srgb(linear) * 255.0).astype(np.uint8)


def likeness(picture: Picture, truth: Picture, where: NDArray[np.bool_]) -> Likeness:
    """Compare 8-bit sRGB pictures (y, x, 3) over the pixels ``where`` (y, x)."""
    from flip_evaluator import evaluate
    from skimage.metrics import structural_similarity

    _, ssim = structural_similarity(picture, truth, channel_axis=2, full=True)
    flip, _, _ = evaluate(
        (truth / 255.0).astype(np.float32),
        (picture / 255.0).astype(np.float32),
        "LDR",
        applyMagma=False,
    )
    return Likeness(
        psnr(picture, truth, where), float(ssim[where].mean()), float(flip[..., 0][where].mean())
    )


def psnr(picture: Picture, truth: Picture, where: NDArray[np.bool_]) -> float:
    """PSNR of 8-bit codes over the pixels ``where``, dB."""
    return psnr_of(squares(picture, truth, where))


def squares(picture: Picture, truth: Picture, where: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Squared differences of codes (n, 3) over the pixels ``where``; they may be pooled."""
    return (picture[where].astype(np.float64) - truth[where]) ** 2


def psnr_of(squared: NDArray[np.float64]) -> float:
    """PSNR of squared differences of 8-bit codes, dB."""
    return 10.0 * math.log10(255.0**2 / max(float(squared.mean()), 1e-12))


def near(mask: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """Pixels (y, x) within a distance of some of the mask."""
    from scipy.ndimage import distance_transform_edt

    if not mask.any():
        return np.zeros_like(mask)
    return np.asarray(distance_transform_edt(~mask) <= pixels)
