"""Numbers in [0, 1) for the events of paths: stratified over a pixel's paths at first, then random.

The stratified ones are the R2 sequence (Roberts, "The unreasonable effectiveness of quasirandom
sequences", 2018), in an order and from an origin that are random for each pixel and each pair.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

AXIS, CHOICE, DIRECTION, LIGHT, WALL, ROULETTE = range(6)
"""Pairs of numbers that an event may use, by what they decide."""
PAIRS = 6
_STRATIFIED = 4
"""Events of a path whose numbers are stratified."""


class PathEvent(NamedTuple):
    """Whose numbers: the pixel's ``seed``, the path's ``number``, ``samples`` of a pixel, and how
    many events the path had before."""

    seed: int
    number: int
    samples: int
    depth: int


@njit(cache=True, nogil=True, inline="always")
def mixed(z):  # type: ignore[no-untyped-def]
    """splitmix64's output function."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True, nogil=True, inline="always")
def unit(z):  # type: ignore[no-untyped-def]
    """The upper 53 bits of a number as a double in [0, 1)."""
    return np.float64(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@njit(cache=True, nogil=True)
def permuted(index, count, key):  # type: ignore[no-untyped-def]
    """Where a permutation of 0 … count - 1, one for each key, sends an index.

    Rounds of steps that can each be undone, on as many bits as the count has, until the result lies
    inside. Events whose orders differed only by a shift would have their numbers tied to each
    other: each pixel would keep an error that its variance does not tell.
    """
    bits = 1
    while (1 << bits) < count:
        bits += 1
    mask, half = np.uint64((1 << bits) - 1), np.uint64((bits + 1) // 2)
    x = np.uint64(index)
    while True:
        turn = key
        for _ in range(4):
            turn = mixed(turn + np.uint64(0x9E3779B97F4A7C15))
            x = (x * (turn | np.uint64(1)) + (turn >> np.uint64(32))) & mask
            x ^= x >> half
        if x < np.uint64(count):
            return np.int64(x)


@njit(cache=True, nogil=True)
def _pair(pixel_seed, sample, samples, pair):  # type: ignore[no-untyped-def]
    """Two numbers of the R2 sequence (Roberts), its order and origin at random for pixel, pair."""
    h = mixed(pixel_seed + np.uint64(pair + 1) * np.uint64(0x9E3779B97F4A7C15))
    index = np.float64(permuted(sample, samples, h))
    u = unit(mixed(h + np.uint64(1))) + index * 0.7548776662466927
    v = unit(mixed(h + np.uint64(2))) + index * 0.5698402909980532
    return u - np.floor(u), v - np.floor(v)


@njit(cache=True, nogil=True, parallel=True)
def jitter_pixels(pixels, samples, seed, jitter, seeds):  # type: ignore[no-untyped-def]
    """Fill ``jitter`` (pixels * samples, 2), places in the pixels, and ``seeds`` of the pixels."""
    for row in prange(len(pixels)):
        pixel_seed = mixed(
            np.uint64(pixels[row]) * np.uint64(0xD1342543DE82EF95) + np.uint64(seed + 1)
        )
        for sample in range(samples):
            number = row * samples + sample
            jitter[number, 0], jitter[number, 1] = _pair(pixel_seed, sample, samples, 0)
            seeds[number] = pixel_seed


@njit(cache=True, nogil=True)
def path_numbers(event, pair):  # type: ignore[no-untyped-def]
    """Two numbers for a path's event: stratified over the pixel's paths at first, then random."""
    seed, samples = event.seed, event.samples
    sample = event.number % samples
    which = 1 + PAIRS * event.depth + pair
    if event.depth < _STRATIFIED:
        return _pair(seed, sample, samples, which)
    h = mixed(seed + np.uint64(which * samples + sample + 1) * np.uint64(0x9E3779B97F4A7C15))
    return unit(mixed(h + np.uint64(1))), unit(mixed(h + np.uint64(2)))
