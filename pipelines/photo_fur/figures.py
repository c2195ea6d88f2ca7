"""Figures that tell whether a stored result is right, each computed apart from what made it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.photo_fur.attenuation import Attenuation, Tails
from pipelines.photo_fur.laying import Laying


def contrast(luminance: NDArray[np.floating]) -> float:
    """Michelson contrast of the 1 % and 99 % luminances, in [0, 1]."""
    low, high = np.quantile(luminance, [0.01, 0.99])
    return float((high - low) / (high + low))


def clipped_share(radiance: NDArray[np.floating]) -> float:
    """Share of the pixels (y, x, channel) that are pure white."""
    return float((radiance >= 1.0).all(axis=-1).mean())


def unevenness(grey: NDArray[np.floating], fur: NDArray[np.bool_] | None = None) -> float:
    """Deviation over the fur (y, x) of the logarithm of the light's slope in a luminance (y, x)."""
    from pipelines.photo_fur.suitability import light_slope

    slope = light_slope(grey, fur)
    return float((slope if fur is None else slope[fur]).std())


def kept_share(pixels_per_layer: NDArray[np.integer], histogram: NDArray[np.integer]) -> float:
    """Share of the pixels between Imin and Imax: those of all layers among all in the histogram."""
    return float(pixels_per_layer.sum() / histogram.sum())


def decay_error(boundaries: NDArray[np.float64], brightest: float, coefficient: float) -> float:
    """Largest relative step of I(n) (Eq. 4) from Eq. 1 at the depths of Eq. 3."""
    depth = np.linspace(0.0, 1.0, len(boundaries))
    return float(np.abs(boundaries / (brightest * np.exp(-coefficient * depth)) - 1.0).max())


def depth_rank_correlation(luminance: NDArray[np.floating], depth: NDArray[np.floating]) -> float:
    """Spearman rank correlation of darkness with true depth: 1 = brightness orders depth."""
    from scipy.stats import spearmanr

    return float(spearmanr(-luminance.ravel(), depth.ravel()).statistic)


def estimated_depth(
    luminance: NDArray[np.floating], attenuation: Attenuation
) -> NDArray[np.float64]:
    """Depth by Eq. 1 as a fraction of the thickness: 0 at Imax and above, 1 at Imin and below."""
    inside = np.clip(luminance, attenuation.darkest, attenuation.brightest)
    return np.log(attenuation.brightest / inside) / attenuation.coefficient


class DepthFigures(NamedTuple):
    """How near depth by Eq. 1 comes to the true one."""

    rank_correlation: float
    """Of darkness with depth: 1 = brightness orders depth."""
    rmse: float
    """In thicknesses."""
    rmse_constant: float
    """Of the true depth's mean everywhere."""


def depth_figures(
    luminance: NDArray[np.floating], attenuation: Attenuation, depth: NDArray[np.floating]
) -> DepthFigures:
    """Compare Eq. 1 with the true depth of each pixel."""
    step = estimated_depth(luminance, attenuation) - depth
    return DepthFigures(
        depth_rank_correlation(luminance, depth),
        float(np.sqrt(np.mean(step**2))),
        float(np.std(depth, dtype=np.float64)),
    )


def partition_error(
    layer: NDArray[np.uint8],
    masks: NDArray[np.bool_],
    opaque: NDArray[np.bool_] | None = None,
) -> float:
    """Share of the pixels whose masks do not say once, and only once, what ``layer`` says; those
    that are not ``opaque`` have to be in none."""
    times = masks.sum(axis=0)
    first = masks.argmax(axis=0) + 1
    wrong = np.where(layer == 0, times != 0, (times != 1) | (first != layer))
    if opaque is not None:
        wrong |= ~opaque & (times != 0)
    return float(wrong.mean())


def interval_error(
    layer: NDArray[np.uint8],
    luminance: NDArray[np.floating],
    boundaries: NDArray[np.float64],
    tails: Tails,
    opaque: NDArray[np.bool_] | None = None,
) -> float:
    """Share of the pixels outside their layer's interval of luminance (section 3.2); those that
    are not ``opaque`` have no layer."""
    bounds = boundaries.copy()
    if tails == "end layers":
        bounds[0], bounds[-1] = np.inf, -np.inf
    above, below = bounds[np.maximum(layer, 1) - 1], bounds[np.maximum(layer, 1)]
    at_the_skin = (layer == len(bounds) - 1) & (luminance == below)
    inside = (luminance <= above) & ((luminance > below) | at_the_skin)
    outside = (luminance > bounds[0]) | (luminance < bounds[-1])
    wrong = np.where(layer == 0, ~outside, ~inside)
    if opaque is not None:
        wrong = np.where(opaque, wrong, layer != 0)
    return float(wrong.mean())


def step_error(
    shells: NDArray[np.floating], normals: NDArray[np.floating], thickness: float
) -> float:
    """Largest distance, per thickness, of a shell's vertex from where Eq. 3 puts it."""
    layers = len(shells)
    heights = thickness * (1.0 - np.arange(1, layers + 1) / layers)
    expected = shells[-1].astype(np.float64) + heights[:, None, None] * normals
    return float(np.linalg.norm(shells - expected, axis=-1).max() / thickness)


def outward_share(shells: NDArray[np.floating], triangles: NDArray[np.integer]) -> float:
    """Share of the surface, as seen from all around the mesh without its fur, whose hair stands
    towards the viewer; 1 of a body. shells (N, V, 3), the last one on the surface; (F, 3)."""
    from pipelines.geometry.rays import seen_from_outside

    surface = shells[-1].astype(np.float64)
    hair = (shells[0].astype(np.float64) - surface)[triangles].sum(axis=1)
    seen = seen_from_outside(surface, triangles, 1 << 14)
    return float(np.mean(np.einsum("ni,ni->n", hair[seen.triangle], seen.direction) < 0))


def guide_error(guides: NDArray[np.floating], tangents: NDArray[np.floating]) -> float:
    """Median angle in degrees between guides (V, 3) and the hair's directions (V, 3), weighted by
    the guides' lengths; 90 of hair that lies anyhow."""
    length = np.linalg.norm(guides, axis=1)
    cosine = np.einsum("vi,vi->v", guides, tangents) / np.maximum(length, 1e-12)
    return weighted_median(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), length)


def weighted_median(values: NDArray[np.floating], weights: NDArray[np.floating]) -> float:
    """The value (n,) below which half of the weights (n,) lie."""
    order = np.argsort(values)
    summed = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(summed, summed[-1] / 2)])


class LaidGradients(NamedTuple):
    """How a photograph runs over the surface: of each triangle the patch that weighs most."""

    triangle: NDArray[np.int64]
    """(n,)."""
    corner: NDArray[np.int64]
    """(n,): a split vertex of it."""
    place: NDArray[np.float64]
    """(n, 2): in the photograph, widths from its lower left."""
    gradient: NDArray[np.float64]
    """(n, 2, 3): photograph widths a mesh unit."""
    area: NDArray[np.float64]
    """(n,): of the triangle, times the patch's weight."""


def laid_gradients(skin: NDArray[np.floating], laying: Laying) -> LaidGradients:
    """Gradients of a laying's coordinates over the skin (V, 3)."""
    corners = skin[laying.vertex].astype(np.float64)[laying.triangles]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(one, two)
    doubled = np.linalg.norm(normal, axis=1)
    uvs = laying.uvs.astype(np.float64)[laying.triangles]
    weight = laying.weights[laying.triangles]
    (triangle,) = np.nonzero(doubled > 1e-12 * doubled.max())
    slot = weight.mean(axis=1).argmax(axis=1)[triangle]
    frame = np.stack([one, two, normal], axis=1)[triangle]
    uv = uvs[triangle, :, slot]
    steps = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0], 0 * uv[:, 0]], axis=1)
    gradient = np.linalg.solve(frame, steps).transpose(0, 2, 1).astype(np.float64)
    area = doubled[triangle] / 2 * weight[triangle, :, slot].mean(axis=1)
    return LaidGradients(
        triangle, laying.triangles[triangle, 0].astype(np.int64), uv.mean(axis=1), gradient, area
    )


def strand_scale_spread(skin: NDArray[np.floating], laying: Laying) -> float:
    """Width of hairs at the 90th over that at the 10th percentile of the surface: of the square
    root of the area that the photograph takes."""
    found = laid_gradients(skin, laying)
    across = np.cross(found.gradient[:, 0], found.gradient[:, 1])
    scale = np.sqrt(np.linalg.norm(across, axis=1))
    order = np.argsort(scale)
    summed = np.cumsum(found.area[order]) / found.area.sum()
    low, high = (scale[order][np.searchsorted(summed, share)] for share in (0.1, 0.9))
    return float(high / max(low, 1e-12))


def laid_lie_error(
    skin: NDArray[np.floating],
    tangents: NDArray[np.floating],
    laying: Laying,
    direction: NDArray[np.floating],
    coherence: NDArray[np.floating],
) -> float:
    """Median angle in degrees, over the surface, between the field's tangents (V, 3) and the laid
    photograph's hair, whose direction and coherence (y, x) are as of `photograph_lie`."""
    found = laid_gradients(skin, laying)
    along = np.einsum("nuk,nk->nu", found.gradient, tangents[laying.vertex[found.corner]])
    height, width = direction.shape
    columns = np.clip((found.place[:, 0] * width).astype(int), 0, width - 1)
    rows = np.clip(height - 1 - (found.place[:, 1] * width).astype(int), 0, height - 1)
    apart = np.arctan2(along[:, 1], along[:, 0]) - direction[rows, columns]
    degrees = np.degrees(np.abs(np.angle(np.exp(1j * apart))))
    return weighted_median(degrees, found.area * coherence[rows, columns])


def mean_brightness(pictures: NDArray[np.uint8], background: NDArray[np.uint8]) -> float:
    """Mean of the pictures' 8-bit codes, in [0, 1], but for pixels of the background's codes (3,);
    0 where there is nothing else."""
    fur = pictures[(pictures != background).any(axis=-1)]
    return float(fur.mean(dtype=np.float64) / 255.0) if len(fur) else 0.0
