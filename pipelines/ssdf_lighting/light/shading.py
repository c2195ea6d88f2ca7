"""Lights that are spherical Gaussians on surfaces that know how far the edge of the sky is.

Section 4, "Use": light times lobe of the surface is an SG; what the scene leaves of it follows from
d at its axis alone (Wang et al. 2009). A lobe here says how bright it is if nothing but the surface
itself hides light, and its own horizon. d knows that horizon too, so only the ratio of the two
visible shares is taken, and it is 1 where d is the horizon.

The gloss. Narrow lights see the lobe's value at one direction, wide ones its integral. The product
of the light's SG (λ) and the lobe's (κ) knows the integral; it is mended by the true BRDF's value
over the SG's at the product's axis, to the power λ / (λ + κ).

:mod:`.stage_view` does the same in a shader.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.light.cosine_lobes import CosineLobes, cosine_lobes
from pipelines.ssdf_lighting.light.gloss_lobes import GlossLobes, gloss_lobes
from pipelines.ssdf_lighting.light.microfacets import LEAST_VIEW, Materials, check_materials, gloss
from pipelines.ssdf_lighting.light.spherical_gaussians import (
    Lights,
    VisibleTable,
    integral,
    product,
    visible_share,
)

FloatArray = NDArray[np.float64]

_LEAST_WHOLE = 1e-3


class LobeTables(NamedTuple):
    """What lobes are made from: ``cosine`` has a row a light, ``gloss`` a row a material."""

    cosine: CosineLobes
    gloss: GlossLobes


class Lobes(NamedTuple):
    """SGs whose visible part is seen at P points: L = 2 N, first N of the matt part, one a light,
    then N of the gloss.

    axes: (P, L, 3) float64 unit vectors; 0 where the material has no gloss.
    sharpness: (P, L) float64.
    weights: (P, L, 3) float64 radiance, if nothing but the surface itself hides light.
    horizons: (P, L) float64 radians, from the axis to the surface's own horizon.
    """

    axes: FloatArray
    sharpness: FloatArray
    weights: FloatArray
    horizons: FloatArray


def lobe_tables(materials: Materials, lights: Lights) -> LobeTables:
    """Make the tables; they depend on the lights' sharpness alone, not on where they are.

    Raises ValueError for materials that are none.
    """
    check_materials(materials)
    return LobeTables(cosine_lobes(lights.sharpness), gloss_lobes(materials))


def lobes(
    normals: FloatArray,
    views: FloatArray,
    material: NDArray[np.integer],
    materials: Materials,
    lights: Lights,
    *,
    tables: LobeTables | None = None,
) -> Lobes:
    """The lobes at P points.

    normals, views: (P, 3) unit vectors, views towards the camera.
    material: (P,) rows of ``materials``.
    tables: of the same materials and lights; made here if not given.
    """
    made = lobe_tables(materials, lights) if tables is None else tables
    parts = (
        _matt(normals, materials.albedo[material], lights, made.cosine),
        _glossy(normals, views, material, materials, lights, made.gloss),
    )
    return Lobes(*(np.concatenate(both, axis=1) for both in zip(*parts, strict=True)))


def shaded(lobes: Lobes, distances: NDArray[np.floating], table: VisibleTable) -> FloatArray:
    """Radiance (P, 3) float64, where d at the lobes' axes is ``distances`` (P, L), radians."""
    shares = visible_share(table, distances, lobes.sharpness)
    whole = visible_share(table, lobes.horizons, lobes.sharpness)
    visible = np.minimum(shares / np.maximum(whole, _LEAST_WHOLE), 1.0)
    return np.einsum("pl,plc->pc", visible, lobes.weights)


def matt_axes(normals: FloatArray, lights: Lights, cosine: CosineLobes) -> FloatArray:
    """Axes (P, N, 3) of the matt lobes at normals (P, 3)."""
    return _matt(normals, np.ones((len(normals), 3)), lights, cosine)[0]


def matt_light(
    normals: FloatArray,
    distances: NDArray[np.floating],
    lights: Lights,
    cosine: CosineLobes,
    table: VisibleTable,
) -> FloatArray:
    """Radiance (P, 3) float64 of matt surfaces of albedo 1 with normals (P, 3), where d along the
    axes of their matt lobes is ``distances`` (P, N). ``cosine`` is of the lights' sharpness."""
    found = Lobes(*_matt(normals, np.ones((len(normals), 3)), lights, cosine))
    return shaded(found, distances, table)


def _matt(
    normals: FloatArray, albedo: FloatArray, lights: Lights, fitted: CosineLobes
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    cosine = np.clip(normals @ lights.axes.T, -1.0, 1.0)
    place = (cosine + 1) / 2 * (fitted.along.shape[1] - 1)
    rows = np.broadcast_to(np.arange(len(lights.sharpness)), cosine.shape)
    irradiance, sharpness, along, up = (_between(values, rows, place) for values in fitted)
    axes = _unit(along[..., None] * lights.axes + up[..., None] * normals[:, None])
    weights = irradiance[..., None] * lights.amplitudes * (albedo / np.pi)[:, None]
    return axes, sharpness, weights, _above(axes, normals)


def _glossy(
    normals: FloatArray,
    views: FloatArray,
    material: NDArray[np.integer],
    materials: Materials,
    lights: Lights,
    fitted: GlossLobes,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    n_o = np.sum(normals * views, axis=-1)
    mirrored = 2 * n_o[:, None] * normals - views
    n_o = np.clip(n_o, LEAST_VIEW, 1.0)
    kappa, along, up, amplitude = (
        _between(values, material, n_o * (fitted.along.shape[1] - 1)) for values in fitted
    )
    towards = _unit(along[:, None] * mirrored + up[:, None] * normals)[:, None]
    kappa, amplitude = kappa[:, None], amplitude[:, None]
    axes, sharpness, scale = product(towards, kappa, lights.axes, lights.sharpness)
    halves = _unit(axes + views[:, None])
    true = gloss(
        np.sum(axes * normals[:, None], axis=-1),
        n_o[:, None],
        np.sum(halves * normals[:, None], axis=-1),
        np.sum(halves * views[:, None], axis=-1),
        materials.specular[material][:, None],
        materials.roughness[material][:, None],
    )
    fit = amplitude + kappa * (np.sum(axes * towards, axis=-1) - 1)
    narrow = lights.sharpness / (lights.sharpness + kappa)
    mended = np.exp(amplitude + narrow * (np.log(np.maximum(true, 1e-30)) - fit))
    has_gloss = (materials.specular[material] > 0)[:, None]
    shown = has_gloss & (true > 0)
    reflected = np.where(shown, integral(sharpness) * scale * mended, 0.0)
    axes = np.where(has_gloss[..., None], axes, 0.0)
    coloured = lights.amplitudes
    if materials.tint is not None:
        coloured = coloured * materials.tint[material][:, None]
    return (
        axes,
        np.where(has_gloss, sharpness, 0.0),
        reflected[..., None] * coloured,
        _above(axes, normals),
    )


def _between(
    values: FloatArray, rows: NDArray[np.integer], place: NDArray[np.floating]
) -> FloatArray:
    """Values (rows, columns) at places between the columns, linearly."""
    left = np.clip(place.astype(np.int64), 0, values.shape[1] - 2)
    part = place - left
    between: FloatArray = (1 - part) * values[rows, left] + part * values[rows, left + 1]
    return between


def _above(axes: FloatArray, normals: FloatArray) -> FloatArray:
    height = np.einsum("plc,pc->pl", axes, normals)
    return np.arcsin(np.clip(height, -1.0, 1.0))


def _unit(vectors: FloatArray) -> FloatArray:
    length: FloatArray = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.maximum(length, 1e-30)
