"""What is above the built-in city: an overcast sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.light.environment_maps import texel_directions

_CLOUDS = 512


def overcast_sky(height: int) -> NDArray[np.float32]:
    """Radiance (height, 2 height, 3) of a clouded sky; layout of ``environments``."""
    direction = texel_directions(height)
    up = np.maximum(direction[..., 2], 0.0)
    base = (0.75 + 0.35 * up)[..., None] * np.array([0.80, 0.88, 1.0])
    # A flat layer of clouds, seen from below.
    plane = direction[..., :2] / (up + 0.18)[..., None]
    cover = _sampled(_cloud_layer(), plane * 0.16)
    thick = np.clip((cover - 0.35) * 1.6, 0.0, 1.0)[..., None]
    bright = (
        np.array([1.12, 1.12, 1.12])
        * (1.0 - 0.35 * _sampled(_cloud_layer(), plane * 0.31))[..., None]
    )
    fade = np.clip(up * 6.0, 0.0, 1.0)[..., None]
    sky = base + fade * thick * (bright - base)
    return sky.astype(np.float32)


def _cloud_layer() -> NDArray[np.float64]:
    """Noise (512, 512) of many scales that repeats, in [0, 1]."""
    generator = np.random.default_rng(11)
    frequency = np.hypot(np.fft.fftfreq(_CLOUDS)[:, None], np.fft.rfftfreq(_CLOUDS)[None])
    frequency[0, 0] = 1.0
    spectrum = np.fft.rfft2(generator.normal(size=(_CLOUDS, _CLOUDS))) * frequency**-1.6
    spectrum[0, 0] = 0.0
    noise = np.fft.irfft2(spectrum, (_CLOUDS, _CLOUDS))
    return np.clip(0.5 + noise / (4.0 * noise.std()), 0.0, 1.0)


def _sampled(layer: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
    """The layer, which repeats, at places (…, 2), interpolated."""
    position = np.mod(place, 1.0) * _CLOUDS
    low = np.floor(position).astype(int)
    part = position - low
    total = np.zeros(place.shape[:-1])
    for dy in (0, 1):
        for dx in (0, 1):
            weight = (part[..., 0] if dx else 1 - part[..., 0]) * (
                part[..., 1] if dy else 1 - part[..., 1]
            )
            total += weight * layer[(low[..., 1] + dy) % _CLOUDS, (low[..., 0] + dx) % _CLOUDS]
    return total
