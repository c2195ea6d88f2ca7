"""How a picture differs from the true one: PSNR, SSIM, FLIP, of 8-bit sRGB codes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]

SSIM_SIDE = 7
"""Pixels of SSIM's window: smaller pictures have none."""


class ImageMetrics(NamedTuple):
    """How a picture differs from the true one, over some of their pixels."""

    psnr: float
    """dB, of 8-bit codes."""
    ssim: float
    flip: float
    """Mean of the FLIP map, 0 = alike."""


def image_metrics(picture: Picture, truth: Picture, where: NDArray[np.bool_]) -> ImageMetrics:
    """Compare 8-bit sRGB pictures (y, x, 3) over the pixels ``where`` (y, x)."""
    return ImageMetrics(
        psnr(picture, truth, where),
        float(ssim_map(picture, truth)[where].mean()),
        float(flip_map(picture, truth)[where].mean()),
    )


def ssim_map(picture: Picture, truth: Picture) -> NDArray[np.float64]:
    """SSIM (y, x) of pictures (y, x, 3) of at least 7 x 7 pixels, mean of the channels.

    Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
    Similarity" (2004), with a box of 7 x 7 pixels. Raises ValueError for smaller pictures.
    """
    from skimage.metrics import structural_similarity

    _, ssim = structural_similarity(picture, truth, channel_axis=2, full=True)
    return np.asarray(ssim, np.float64).mean(axis=2)


def flip_map(
    picture: Picture, truth: Picture, pixels_per_degree: float = 67.0
) -> NDArray[np.float32]:
    """FLIP (y, x) of pictures (y, x, 3), 0 = alike, seen at so many pixels a degree of sight.

    67 are the authors': a 4K screen of 0.7 m from 0.7 m. Fewer: the picture is seen enlarged.
    Andersson et al., "FLIP: A Difference Evaluator for Alternating Images" (2020).
    """
    from flip_evaluator import evaluate

    flip, _, _ = evaluate(
        (truth / 255.0).astype(np.float32),
        (picture / 255.0).astype(np.float32),
        "LDR",
        applyMagma=False,
        parameters={"ppd": pixels_per_degree},
    )
    return np.asarray(flip[..., 0], np.float32)


def psnr(picture: Picture, truth: Picture, where: NDArray[np.bool_]) -> float:
    """PSNR of 8-bit codes over the pixels ``where``, dB."""
    return psnr_of_squared_errors(squared_errors(picture, truth, where))


def squared_errors(
    picture: Picture, truth: Picture, where: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Squared differences of codes (n, 3) over the pixels ``where``; they may be pooled."""
    return (picture[where].astype(np.float64) - truth[where]) ** 2


def psnr_of_squared_errors(squared: NDArray[np.float64]) -> float:
    """PSNR of squared differences of 8-bit codes, dB."""
    return 10.0 * math.log10(255.0**2 / max(float(squared.mean()), 1e-12))
