"""Numbers in [0, 1) for the events of paths: stratified over a pixel's paths at first, then random.

The stratified ones are the R2 sequence (Roberts, "The unreasonable effectiveness of quasirandom
sequences", 2018), in an order and from an origin that are random for each pixel and each pair.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

_STEPS = np.array(
    [65537, 66047, 66571, 67129, 67651, 68171, 68711, 69257, 69809, 70351, 70901, 71437, 71987,
     72547, 73079, 73613, 74159, 74717, 75253, 75793, 76333, 76871, 77417, 77969, 78511, 79063,
     79609, 80153, 80701, 81239, 81817, 82351]
)  # fmt: skip
"""Primes above any number of samples allowed, so that steps of each are a permutation. Equal steps
for two events would tie their numbers to each other."""
_STRATIFIED = 4
"""Events of a path whose numbers are stratified."""


@njit(cache=True, inline="always")
def mixed(z):  # type: ignore[no-untyped-def]
    """splitmix64's output function."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True, inline="always")
def unit(z):  # type: ignore[no-untyped-def]
    """The upper 53 bits of a number as a double in [0, 1)."""
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@njit(cache=True)
def _pair(pixel_seed, sample, samples, pair):  # type: ignore[no-untyped-def]
    """Two numbers of the R2 sequence (Roberts), its order and origin at random for pixel, pair."""
    h = mixed(pixel_seed + np.uint64(pair + 1) * np.uint64(0x9E3779B97F4A7C15))
    step = _STEPS[np.int64(h >> np.uint64(50)) % len(_STEPS)]
    index = (sample * step + np.int64((h >> np.uint64(20)) & np.uint64(0xFFFFFF))) % samples
    u = unit(mixed(h + np.uint64(1))) + index * 0.7548776662466927
    v = unit(mixed(h + np.uint64(2))) + index * 0.5698402909980532
    return u - np.floor(u), v - np.floor(v)


@njit(cache=True, parallel=True)
def jitter_pixels(pixels, samples, seed, jitter, seeds):  # type: ignore[no-untyped-def]
    """Fill ``jitter`` (pixels * samples, 2), places in the pixels, and ``seeds`` of the pixels."""
    for row in prange(len(pixels)):
        pixel_seed = mixed(
            np.uint64(pixels[row]) * np.uint64(0xD1342543DE82EF95) + np.uint64(seed + 1)
        )
        for sample in range(samples):
            number = row * samples + sample
            jitter[number] = _pair(pixel_seed, sample, samples, 0)
            seeds[number] = pixel_seed


@njit(cache=True)
def path_numbers(seed, number, samples, depth, pair):  # type: ignore[no-untyped-def]
    """Two numbers for a path's event: stratified over the pixel's paths at first, then random."""
    sample = number % samples
    which = 1 + 4 * depth + pair
    if depth < _STRATIFIED:
        return _pair(seed, sample, samples, which)
    h = mixed(seed + np.uint64(which * samples + sample + 1) * np.uint64(0x9E3779B97F4A7C15))
    return unit(mixed(h + np.uint64(1))), unit(mixed(h + np.uint64(2)))
