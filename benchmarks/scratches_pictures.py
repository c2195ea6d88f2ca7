"""Figures of the pictures: what the denoiser makes of 64 paths a pixel, beside many.

At the paper's scale pictures have 180 x 180 pixels and references 4096 paths a pixel: the better
part of an hour. Else they have 80 x 80 and 1024, and the figures' names end in ``_small``: a
denoiser has less to go by, the fewer pixels a thing has.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance, to_8bit
from pipelines.geometry.solid_shapes import glass_teapot, plate
from pipelines.geometry.solids import Solid
from pipelines.glass_scratches.drawing.denoising import denoised
from pipelines.glass_scratches.drawing.frames import object_cameras, picture_exposure, trace_view
from pipelines.glass_scratches.drawing.path_tracing import TracedPicture
from pipelines.glass_scratches.scratched_glass import ScratchMaterial, scratched_glass
from pipelines.light.environment_sampling import EnvironmentSampler, make_environment_sampler
from pipelines.light.room import room

SAMPLES = 64
SIZES = {"default": (80, 1024), "paper": (180, 4096)}
"""Pixels a side, paths a pixel of the reference."""
CLEAN_SIZES = {"default": 128, "paper": 512}
SCRATCHED, UNSCRATCHED = 0.5, 0.2
"""Shares of paths that meet a scratch: a pixel with more than the one shows scratches, with less
than the other none."""
_NEIGHBOURS = 11
"""Pixels a side in which unscratched ones tell what would be there without."""

WAYS = ("clean", "without_scratches", "blurred", "noisy")

Codes = NDArray[np.float64]


class Judged(NamedTuple):
    """8-bit codes (H, W, 3) of one view: by many paths, and by few, in four ways; and where
    scratches are."""

    reference: Codes
    clean: Codes
    without_scratches: Codes
    noisy: Codes
    blurred: Codes
    scratched: NDArray[np.float32]


def picture_figures(material: ScratchMaterial, scale: str) -> dict[str, Any]:
    """Denoised pictures of plate and teapot in the room against many paths a pixel, and beside
    them the same without scratches among the features, blurred to the same noise, and as traced."""
    light = make_environment_sampler(room(1024))
    solids = {"plate": plate(1.5, 1.1, 0.05), "teapot": glass_teapot(14, 0.05)}
    far, close = (
        {name: _judged(solid, material, light, view, scale=scale) for name, solid in solids.items()}
        for view in range(2)
    )
    views = {
        f"{name}_{view}": one
        for view, seen in (("far", far), ("close", close))
        for name, one in seen.items()
    }
    psnrs = {way: {name: psnr(one, way) for name, one in views.items()} for way in WAYS}
    kept = {way: {name: contrast_kept(one, way) for name, one in close.items()} for way in WAYS}
    figures = {
        "denoised_psnr_db": min(psnr(one, "clean") for one in far.values()),
        "denoised_psnr_null_noisy_db": min(psnr(one, "noisy") for one in far.values()),
        "denoised_psnr_null_blurred_db": min(psnr(one, "blurred") for one in far.values()),
        "scratch_contrast_kept": min(kept["clean"].values()),
        "scratch_contrast_null_no_feature": min(kept["without_scratches"].values()),
        "scratch_contrast_null_blurred": min(kept["blurred"].values()),
        "denoised_views": {"psnr_db": psnrs, "contrast_kept": kept},
        **_clean_picture(solids, material, light, CLEAN_SIZES[scale]),
    }
    end = "" if scale == "paper" else "_small"
    return {f"{name}{end}": value for name, value in figures.items()}


def _judged(
    solid: Solid, material: ScratchMaterial, light: EnvironmentSampler, view: int, *, scale: str
) -> Judged:
    size, reference = SIZES[scale]
    glass = scratched_glass(solid, material)
    camera = object_cameras(solid)[view]
    few, many = (
        trace_view(glass, light, camera, size=size, samples=samples, seed=seed)
        for seed, samples in enumerate((SAMPLES, reference))
    )
    exposure = picture_exposure(many.radiance)
    clean = denoised(few)
    # All paths are to the denoiser like those that met no scratch.
    blind = denoised(few._replace(scratched=np.zeros_like(few.scratched), smooth=few.radiance))
    blurred = _blurred_to(few.radiance, many.radiance, clean, exposure)
    return Judged(
        reference=_codes(many.radiance, exposure),
        clean=_codes(clean, exposure),
        without_scratches=_codes(blind, exposure),
        noisy=_codes(few.radiance, exposure),
        blurred=_codes(blurred, exposure),
        scratched=many.scratched,
    )


def _codes(radiance: NDArray[Any], exposure: float) -> Codes:
    return to_8bit(radiance * exposure).astype(np.float64)


def _blurred_to(
    noisy: NDArray[np.float32],
    reference: NDArray[np.float32],
    clean: NDArray[np.float32],
    exposure: float,
) -> NDArray[Any]:
    """The picture as traced, under the Gaussian that leaves as much noise as the denoiser left
    error: what differs from the reference under the same Gaussian."""
    error = np.std(_codes(clean, exposure) - _codes(reference, exposure))
    low, high = 0.05, 20.0
    for _ in range(20):
        sigma = np.sqrt(low * high)
        one, other = (cv2.GaussianBlur(each, (0, 0), sigma) for each in (noisy, reference))
        left = np.std(_codes(one, exposure) - _codes(other, exposure))
        low, high = (sigma, high) if left > error else (low, sigma)
    return cv2.GaussianBlur(noisy, (0, 0), high)


def psnr(one: Judged, way: str) -> float:
    """Of all of a view's pixels, decibels."""
    error = np.mean((getattr(one, way) - one.reference) ** 2)
    return float(10 * np.log10(255.0**2 / error))


def contrast_kept(one: Judged, way: str) -> float:
    """Contrast of scratched pixels over that of the reference: how far they stand out from the
    unscratched ones around them, projected onto how far those of the reference do.

    Noise that is no part of the reference leaves it as it is, on average; what is blurred has less
    than 1. Raises ValueError where no pixel is scratched among unscratched ones.
    """
    pictures = getattr(one, way), one.reference
    found, wanted = (_standing_out(each, one.scratched) for each in pictures)
    if not len(wanted):
        raise ValueError("no pixel shows scratches among some that do not; expected a closer view.")
    return float((found * wanted).sum() / (wanted * wanted).sum())


def _standing_out(codes: Codes, scratched: NDArray[np.float32]) -> Codes:
    bright = luminance(codes)
    free = (scratched < UNSCRATCHED).astype(np.float64)
    box = (_NEIGHBOURS, _NEIGHBOURS)
    around, count = (
        cv2.boxFilter(each, -1, box, normalize=False) for each in (bright * free, free)
    )
    seen = (scratched > SCRATCHED) & (count >= _NEIGHBOURS)
    return np.asarray(bright[seen] - around[seen] / count[seen])


def _clean_picture(
    solids: dict[str, Solid], material: ScratchMaterial, light: EnvironmentSampler, size: int
) -> dict[str, float]:
    """Seconds from a solid to its denoised far view, kernels compiled."""
    figures: dict[str, float] = {}
    for name, solid in solids.items():
        wall, processor = time.perf_counter(), time.process_time()
        glass = scratched_glass(solid, material)
        camera = object_cameras(solid)[0]
        traced: TracedPicture = trace_view(glass, light, camera, size=size, samples=SAMPLES)
        denoised(traced)
        figures[f"clean_picture_{name}_s"] = time.perf_counter() - wall
        figures[f"clean_picture_{name}_cpu_s"] = time.process_time() - processor
    return figures | {"clean_picture_s": max(figures[f"clean_picture_{name}_s"] for name in solids)}
