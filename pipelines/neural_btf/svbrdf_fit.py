"""A BTF as what every engine draws: base colour, metallic, roughness and normal of each texel.

The model is glTF 2.0's (appendix B): a Lambertian lobe under a GGX lobe (Walter et al. 2007,
masking correlated by height, Schlick's Fresnel), F0 of 0.04 or, as far as the texel is metallic,
its base colour. Values are radiance under a directional light that would give a white Lambertian
surface the cosine of its angle, as a BTF's are. What a BTF has beyond it, parallax, shadows between
yarns, lobes off the mirror direction, is lost: `svbrdf_errors` says how much that is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

_STEPS = 300
_RATE = 0.08
_PAIRS_A_STEP = 64
_OUTLYING = 4.0
_LEAST_ROUGHNESS = 0.08
_LEAST_COSINE = 1e-3
_STEEPEST = 0.9
"""Slope that a normal starts with at most."""


class Svbrdf(NamedTuple):
    """Maps (texel, …) float32: ``base_colour`` (M, 3) linear, ``metallic`` (M,), ``roughness``
    (M,), all in [0, 1], and ``normal`` (M, 3), unit vectors: x along u, y along v."""

    base_colour: NDArray[np.float32]
    metallic: NDArray[np.float32]
    roughness: NDArray[np.float32]
    normal: NDArray[np.float32]


class SvbrdfErrors(NamedTuple):
    """RMSE over alpha of the maps, and of their null: one Lambertian colour for all texels."""

    rmse: float
    flat_rmse: float


def fit_svbrdf(
    values: NDArray[np.floating],
    light: NDArray[np.floating],
    view: NDArray[np.floating],
    *,
    seed: int = 0,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Svbrdf:
    """Maps whose values are nearest to ``values`` (texel, pair, 3) for unit vectors (pair, 3).

    Descent from Lambertian colours and photometric normals; the loss grows as the square for small
    steps and as their length for large ones (Charbonnier), so that single outliers do not lead.
    Raises ValueError for less than eight pairs.
    """
    if len(light) < 8:
        raise ValueError(f"there are {len(light)} pairs of directions; expected at least 8.")
    rng = np.random.default_rng(seed)
    target = torch.from_numpy(np.maximum(values, 0.0).astype(np.float32))
    lights, views = (torch.from_numpy(np.asarray(way, np.float32)) for way in (light, view))
    albedo, slopes = _start(np.asarray(target), np.asarray(light, np.float64))
    wanted = [
        torch.logit(torch.from_numpy(albedo).clamp(0.02, 0.98)),
        torch.full((len(albedo), 1), -2.0),
        torch.full((len(albedo), 1), 0.5),
        torch.from_numpy(slopes),
    ]
    parameters = [part.float().requires_grad_() for part in wanted]
    optimiser = torch.optim.Adam(parameters, lr=_RATE)
    falling = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, _STEPS, eta_min=_RATE / 50)
    # Steps of several times a texel's own spread (by its median) are taken for outliers.
    middle = target.median(dim=1, keepdim=True).values
    spread = (target - middle).abs().median(dim=1, keepdim=True).values
    scale = (_OUTLYING * spread).clamp(min=1e-3)
    count = min(_PAIRS_A_STEP, len(light))
    for step in range(_STEPS):
        progress(step / _STEPS)
        chosen = torch.from_numpy(rng.choice(len(light), count, replace=False))
        found = _values(_maps(parameters), lights[chosen], views[chosen])
        residual = (found - target[:, chosen]) / scale
        # Weighted back by the scale, so that the sum is over radiance again.
        loss = (((1 + residual**2).sqrt() - 1) * scale**2).sum(dim=0).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        falling.step()
    with torch.no_grad():
        base, metallic, roughness, normal = _maps(parameters)
    return Svbrdf(base.numpy(), metallic[:, 0].numpy(), roughness[:, 0].numpy(), normal.numpy())


def svbrdf_values(
    maps: Svbrdf, light: NDArray[np.floating], view: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Values (texel, pair, 3) of maps for unit vectors (pair, 3) to light and view.

    >>> white = Svbrdf(*(np.ones(shape, np.float32) for shape in ((2, 3), 2, 2)), np.eye(3)[[2, 2]])
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> shown = svbrdf_values(white._replace(metallic=np.zeros(2)), up, up)
    >>> np.allclose(shown[0, 0], 0.97, atol=0.005)
    True
    """
    parts = [torch.from_numpy(np.asarray(part, np.float32)) for part in maps]
    parts[1:3] = [part[:, None] for part in parts[1:3]]
    ways = [torch.from_numpy(np.asarray(way, np.float32)) for way in (light, view)]
    with torch.no_grad():
        found: NDArray[np.float32] = _values(tuple(parts), *ways).numpy()
    return found


def svbrdf_errors(
    maps: Svbrdf,
    values: NDArray[np.floating],
    light: NDArray[np.floating],
    view: NDArray[np.floating],
    alpha: float,
) -> SvbrdfErrors:
    """Errors of maps against a BTF's ``values`` (texel, pair, 3), best of pairs not fitted to."""
    target = np.maximum(values, 0.0).astype(np.float64)
    cosine = np.asarray(light, np.float64)[:, 2]
    colour = np.einsum("tpc,p->c", target, cosine) / (len(target) * np.sum(cosine**2))
    flat = colour * cosine[:, None]
    steps = svbrdf_values(maps, light, view) - target, flat - target
    rmse, flat_rmse = (float(np.sqrt(np.mean(step**2))) / alpha for step in steps)
    return SvbrdfErrors(rmse, flat_rmse)


def _start(
    target: NDArray[np.float32], light: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lambertian colours (M, 3), and slopes (M, 2) of normals, by least squares over all pairs."""
    cosine = light[:, 2]
    albedo = np.einsum("tpc,p->tc", target, cosine) / np.sum(cosine**2)
    towards = target.mean(axis=2, dtype=np.float64) @ np.linalg.pinv(light).T
    slopes = towards[:, :2] / np.maximum(towards[:, 2:], 1e-4)
    return albedo.astype(np.float32), np.clip(slopes, -_STEEPEST, _STEEPEST).astype(np.float32)


_Maps = tuple[Tensor, ...]


def _maps(parameters: list[Tensor]) -> _Maps:
    base, metallic, roughness, slopes = parameters
    normal = torch.cat([slopes, torch.ones_like(slopes[:, :1])], dim=1)
    rough = _LEAST_ROUGHNESS + (1 - _LEAST_ROUGHNESS) * torch.sigmoid(roughness)
    normal = normal / normal.norm(dim=1, keepdim=True)
    return torch.sigmoid(base), torch.sigmoid(metallic), rough, normal


def _values(maps: _Maps, light: Tensor, view: Tensor) -> Tensor:
    """pi f cos (texel, pair, 3)."""
    base, metallic, roughness, normal = maps
    half = light + view
    half = half / half.norm(dim=1, keepdim=True)
    towards_light = normal @ light.T
    cos_l = towards_light.clamp(min=_LEAST_COSINE)
    cos_v = (normal @ view.T).clamp(min=_LEAST_COSINE)
    cos_h = (normal @ half.T).clamp(min=0.0)
    a2 = roughness**4
    spread = a2 / (cos_h**2 * (a2 - 1) + 1) ** 2  # pi D
    masked = cos_l * (cos_v**2 * (1 - a2) + a2).sqrt() + cos_v * (cos_l**2 * (1 - a2) + a2).sqrt()
    lobe = 0.5 * spread / masked
    grazing = (1 - (light * half).sum(dim=1).clamp(0.0, 1.0)) ** 5
    f0 = 0.04 * (1 - metallic) + base * metallic
    fresnel = f0[:, None] + (1 - f0[:, None]) * grazing[None, :, None]
    matt = (base * (1 - metallic))[:, None] * (1 - fresnel)
    lit = torch.where(towards_light > 0, cos_l, torch.zeros_like(cos_l))
    return (matt + fresnel * lobe[..., None]) * lit[..., None]
