"""Figures of quality: how near what is restored is to what was measured, by one function for all.

Ours and every rival give a reader of restored ABRDFs, and are measured alike. Beside each figure
stands its *null*, the same figure of a restoration that knows nothing of the texels: ``_null`` is
the mean colour of every photograph (the mean ABRDF for every texel is the same), ``_shuffled`` what
was restored, its texels in an order drawn by lot. ``_60`` are views at 60 degrees and more alone.

| figure | what |
|---|---|
| ``rmse`` | root of the mean squared error over alpha (Eq. 10) |
| ``rmse_over_deviation`` | over the deviation of all values: the mean of all values has 1 |
| ``rmse_over_null``, ``rmse_over_null_60`` | over the null's: mean colours have 1 |
| ``worst_photographs``, ``worst_texels`` | RMSE of the worst tenth, over that deviation |
| ``psnr``, ``ssim``, ``flip`` | of the judged photographs as pictures, `judged_images` |
| ``grazing_detail`` | gradients that are kept and right, at views of 60 degrees and more |
| ``grazing_energy`` | energy of gradients there, right or not |

Pictures are exposed one by one as all pictures are (99 % of the measured values reach 0.8), and
encoded in 8-bit sRGB. PSNR is of the squared errors of all judged pictures together, SSIM
and FLIP are means over them. For FLIP a texel is seen as large as four pixels, as pictures of
restorations show it: at one pixel, sight would blur what is to be judged, and a flat colour would
look good. SSIM is left out for photographs under 7 x 7 texels, figures of grazing views where
there are none.

With gradients g (differences to the texel beside and below) of a photograph, measured and restored,
``grazing_detail`` is ``<g_m, g_r> / max(<g_m, g_m>, <g_r, g_r>)``, mean over the photographs: 1
only where they are equal. Blurring lowers the product; noise adds nothing to it and may raise the
divisor; gradients made too strong raise the divisor more. ``grazing_energy`` is the sum of
``<g_r, g_r>`` over that of ``<g_m, g_m>``: noise adds to it, so it proves nothing by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.picture_metrics import (
    SSIM_SIDE,
    flip_map,
    psnr_of_squared_errors,
    ssim_map,
)
from pipelines.light.directions import Pairs
from pipelines.neural_btf.abrdf_pool import AbrdfReader
from pipelines.neural_btf.pictures import TEXELS_PER_DEGREE, nearest_images
from pipelines.neural_btf.quality_sums import GRAZING, Comparison, compare

_Photographs = NDArray[np.float32]

_JUDGED_VIEWS = ((0, 0), (15, 60), (30, 150), (45, 240), (60, 324), (75, 45))
_JUDGED_LIGHTS = ((15, 0), (45, 90), (60, 180), (75, 270))
"""Degrees: theta, and phi from the view's: from behind the camera, from the side, against it."""
_WORST = 0.1
_LEAST_CONTRAST = 0.1
"""Of the deviation of all values: photographs of less contrast are judged as if they had it."""


def judged_images(pairs: Pairs) -> NDArray[np.int64]:
    """Numbers of the photographs that are judged as pictures, sorted: 24 of a table of 81.

    Those nearest to six views, from above to 75 degrees, each under four lights: from behind the
    camera at 15 degrees, from its left at 45, against it at 60, from its right at 75. Of a small
    table several may be the same photograph, which counts once.

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> [len(judged_images(all_pairs(t, t))) for t in map(hemisphere_table, (15, 41, 81))]
    [24, 24, 24]
    """
    wanted = [
        (view, phi, light, phi + turn)
        for view, phi in _JUDGED_VIEWS
        for light, turn in _JUDGED_LIGHTS
    ]
    return np.unique(nearest_images(pairs, wanted))


def quality(
    restore: AbrdfReader,
    measured: AbrdfReader,
    pairs: Pairs,
    size: tuple[int, int],
    alpha: float,
    *,
    block: int = 400,
    progress: Callable[[float], None] = lambda fraction: None,
) -> dict[str, float]:
    """All figures of the table above, with their nulls.

    Both readers give ABRDFs (texel, image, 3) of texels first … last - 1 in radiance, row by row;
    ``size`` are rows and columns, ``alpha`` is the largest value. About ``block`` texels are in
    memory at a time.

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> table = hemisphere_table(15)
    >>> truth = np.random.default_rng(0).random((64, 225, 3), np.float32)
    >>> found = quality(lambda a, b: truth[a:b] + np.float32(0.1), lambda a, b: truth[a:b],
    ...                 all_pairs(table, table), (8, 8), alpha=2.0)
    >>> round(found["rmse"], 4), round(found["grazing_detail"], 4)
    (0.05, 1.0)
    """
    compared = compare(
        restore, measured, pairs, size, judged=judged_images(pairs), block=block, progress=progress
    )
    return quality_figures(compared, pairs, alpha)


def quality_figures(compared: Comparison, pairs: Pairs, alpha: float) -> dict[str, float]:
    """The same of a comparison of the photographs `judged_images`."""
    return (
        error_figures(compared, alpha)
        | grazing_figures(compared)
        | picture_figures(compared, pairs.view[judged_images(pairs), 0] >= GRAZING)
    )


# ---- values ----------------------------------------------------------------------------------


def error_figures(compared: Comparison, alpha: float) -> dict[str, float]:
    """Errors of values, over alpha, over the deviation of all values, over the null's."""
    deviation = max(compared.variance**0.5, np.finfo(np.float64).tiny)
    own, flat = compared.of_image, compared.flat_of_image
    shuffled = compared.shuffled_of_image
    found = {
        "rmse": _root(own) / alpha,
        "rmse_null": _root(flat) / alpha,
        "rmse_shuffled": _root(shuffled) / alpha,
        "rmse_over_deviation": _root(own) / deviation,
        "rmse_over_deviation_null": _root(flat) / deviation,
        "rmse_over_null": over_null(own, flat, deviation),
        "rmse_over_null_shuffled": over_null(shuffled, flat, deviation),
        "worst_photographs": worst_tenth(own) / deviation,
        "worst_photographs_null": worst_tenth(flat) / deviation,
        "worst_texels": worst_tenth(compared.of_texel) / deviation,
        "worst_texels_null": worst_tenth(compared.flat_of_texel) / deviation,
    }
    if len(compared.grazing):
        away = compared.grazing
        found["rmse_over_null_60"] = over_null(own[away], flat[away], deviation)
        found["rmse_over_null_60_shuffled"] = over_null(shuffled[away], flat[away], deviation)
    return found


def over_null(squared: NDArray[np.float64], flat: NDArray[np.float64], deviation: float) -> float:
    """RMSE over that of the mean colours, of mean squared errors (image,) of both.

    That of the mean colours is the photographs' contrast; where it is under a tenth of the
    deviation of all values, that tenth counts: nothing but noise may be left to restore.
    """
    return _root(squared) / max(_root(flat), _LEAST_CONTRAST * deviation)


def worst_tenth(squared: NDArray[np.float64]) -> float:
    """Root of the mean of the largest tenth, at least one, of mean squared errors (n,).

    >>> worst_tenth(np.array([1.0, 9.0, *[0.0] * 18]))
    2.23606797749979
    """
    count = max(1, round(_WORST * len(squared)))
    return _root(np.sort(squared)[-count:])


def _root(squared: NDArray[np.float64]) -> float:
    return float(np.sqrt(squared.mean()))


def grazing_figures(compared: Comparison) -> dict[str, float]:
    """How much of the photographs' gradients is there at grazing views; {} without such views."""
    measured, restored, shared = compared.gradients
    if not len(compared.grazing) or not measured.any():
        return {}
    larger = np.maximum(measured, restored)
    there = larger > 0
    return {
        "grazing_detail": float(np.mean(shared[there] / larger[there])),
        "grazing_energy": float(restored.sum() / measured.sum()),
    }


# ---- pictures --------------------------------------------------------------------------------


class PictureErrors(NamedTuple):
    """Of photographs as pictures, one number each."""

    squared: NDArray[np.float64]
    """Mean squared difference of 8-bit codes."""
    ssim: NDArray[np.float64]
    """NaN under 7 x 7 texels."""
    flip: NDArray[np.float64]


def picture_errors(measured: _Photographs, restored: _Photographs) -> PictureErrors:
    """Compare photographs (n, y, x, 3), each exposed by the measured one."""
    rows = []
    for truth, given in zip(measured, restored, strict=True):
        exposure = auto_exposure(truth)
        right, picture = to_8bit(truth * exposure), to_8bit(given * exposure)
        squared = float(np.mean((picture.astype(np.float64) - right) ** 2))
        large = min(right.shape[:2]) >= SSIM_SIDE
        ssim = float(ssim_map(picture, right).mean()) if large else np.nan
        rows.append((squared, ssim, float(flip_map(picture, right, TEXELS_PER_DEGREE).mean())))
    return PictureErrors(*np.array(rows).reshape(-1, 3).T)


def picture_figures(compared: Comparison, grazing: NDArray[np.bool_]) -> dict[str, float]:
    """PSNR, SSIM and FLIP of the judged photographs, of their nulls, of ``grazing`` (j,) alone."""
    measured, restored = compared.measured, compared.restored
    flat = np.broadcast_to(measured.mean(axis=(1, 2), keepdims=True), measured.shape)
    found: dict[str, float] = {}
    for null, given in (("", restored), ("_null", flat), ("_shuffled", shuffled(restored))):
        errors = picture_errors(measured, given)
        for part, chosen in (("", np.ones_like(grazing)), ("_60", grazing)):
            if not chosen.any():
                continue
            found[f"psnr{part}{null}"] = psnr_of_squared_errors(errors.squared[chosen])
            found[f"ssim{part}{null}"] = float(errors.ssim[chosen].mean())
            found[f"flip{part}{null}"] = float(errors.flip[chosen].mean())
    return {name: value for name, value in found.items() if np.isfinite(value)}


def shuffled(photographs: _Photographs) -> _Photographs:
    """Photographs (n, y, x, 3), their texels in one order drawn by lot."""
    rows = photographs.reshape(len(photographs), -1, 3)
    order = np.random.default_rng(0).permutation(rows.shape[1])
    return rows[:, order].reshape(photographs.shape)
