"""Hairs of a patch of fur, grown as curves.

The patch is the tile [0, 1] x [0, 1] of the plane z = 0 (the skin), continued periodically in x
and y. One unit is the side of the tile. Hairs of a kind always stand equally dense in units of
their own length: fewer hairs are a smaller cut-out of the same fur, not sparser fur.

Two populations, guard hairs and a finer, shorter, more unruly undercoat. A hair rises from its
root, leans over towards its tip and follows the lie: a smooth periodic field of headings, to
which each clump adds its own turn, tilt and length and each hair a little of its own. Clumps,
and finer tufts, draw their hairs together towards the tips (a Voronoi cell each, pulled to
the hair nearest its centre). Hairs are triangular prisms tapering to the tip. One hue; each
hair's albedo is that hue more or less deep.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

FloatArray = NDArray[np.float32]

# The fur. Lengths are in nominal hair lengths, angles in radians.
CLUMPS_PER_SQUARE_LENGTH = 18.0
TUFTS_PER_SQUARE_LENGTH = 90.0
POINTS_PER_HAIR = 12


class FurKind(NamedTuple):
    """What kinds of fur differ in."""

    hairs_per_square_length: float = 800.0
    """Density: of a square as wide as a nominal hair is long."""
    undercoat_share: float = 0.6
    """Of the hairs."""
    curl: float = 1.0
    """Times a hair's waviness."""
    tip_tilt: float = 67.0
    """Degrees from upright, of a tip."""
    colour_spread: float = 0.10
    """Deviation of a hair's depth of hue, as a power."""
    hue: tuple[float, float, float] = (0.49, 0.31, 0.165)
    """Albedo of a typical hair, linear RGB: golden brown."""


GOLDEN = FurKind()


class Hairs(NamedTuple):
    """H hairs of one tile as curves of P points, from root to tip.

    points: (H, P, 3) float32, in tile sides; roots in [0, 1) x [0, 1) x {0}, the rest may reach
        beyond the tile and comes back on the other side.
    radii: (H, P) float32, of the prism's circumscribed tube, in tile sides.
    albedo: (H, 3) float32, linear RGB in [0, 1].
    """

    points: FloatArray
    radii: FloatArray
    albedo: FloatArray


class _Coat(NamedTuple):
    """How one population of hairs grows; also one array of each figure with a value a hair."""

    length: float | np.ndarray
    radius: float | np.ndarray
    turn_spread: float | np.ndarray  # of a hair's heading about its clump's
    tilt_spread: float | np.ndarray  # of the tip's tilt about its clump's
    waviness: float | np.ndarray  # amplitude of the heading's wave along the hair
    waves: float | np.ndarray  # periods of that wave in a hair
    cohesion: float | np.ndarray  # how far clumps and tufts draw it in


_GUARD = _Coat(1.0, 0.0115, 0.12, 0.08, 0.25, 1.0, 0.75)
_UNDERCOAT = _Coat(0.55, 0.0075, 0.35, 0.20, 0.40, 1.3, 0.50)

_ROOT_TILT = 24.0 / 67.0  # of the tip's


def grow_hairs(count: int, rng: np.random.Generator, kind: FurKind = GOLDEN) -> Hairs:
    """Grow ``count`` hairs of two populations on the unit tile.

    Returns hairs of POINTS_PER_HAIR points. Raises ValueError for a count below 1.

    >>> hairs = grow_hairs(20, np.random.default_rng(0))
    >>> hairs.points.shape, hairs.radii.shape, hairs.albedo.shape
    ((20, 12, 3), (20, 12), (20, 3))
    """
    if count < 1:
        raise ValueError(f"hairs: expected at least 1, found {count}")
    length = math.sqrt(kind.hairs_per_square_length / count)
    roots = rng.random((count, 2))
    population = (rng.random(count) < kind.undercoat_share).astype(np.intp)
    coat = _Coat(*np.array([_GUARD, _UNDERCOAT]).T[:, population])
    clump, clump_guides = _cells(roots, CLUMPS_PER_SQUARE_LENGTH / length**2, rng)
    tuft, tuft_guides = _cells(roots, TUFTS_PER_SQUARE_LENGTH / length**2, rng)

    points = _curves(roots, length, coat, clump, rng, kind)
    points = _draw_together(points, clump_guides[clump], coat.cohesion, 1.2, rng)
    points = _draw_together(points, tuft_guides[tuft], coat.cohesion, 1.5, rng)

    along = np.linspace(0, 1, POINTS_PER_HAIR)
    taper = (1 - 0.85 * along**2.5) * (0.75 + 0.25 * np.minimum(1, 4 * along))
    thickness = length * coat.radius * rng.uniform(0.8, 1.25, count)
    clump_shade = rng.normal(0, 0.06, len(clump_guides))
    shade = np.exp(rng.normal(0, kind.colour_spread, count) + clump_shade[clump])
    # A power of the hue, not a multiple: more pigment of the same kind (Beer), never above 1.
    albedo = np.asarray(kind.hue) ** shade[:, None]
    return Hairs(
        points.astype(np.float32),
        (thickness[:, None] * taper).astype(np.float32),
        albedo.astype(np.float32),
    )


def _cells(
    roots: np.ndarray, expected: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Split roots into periodic Voronoi cells: each root's cell (H,), each cell's guide hair."""
    centres = rng.random((max(1, round(expected)), 2))
    cell = cKDTree(centres, boxsize=1.0).query(roots)[1]
    guides = cKDTree(roots, boxsize=1.0).query(centres)[1]
    return cell, guides


def _curves(
    roots: np.ndarray,
    length: float,
    coat: _Coat,
    clump: np.ndarray,
    rng: np.random.Generator,
    kind: FurKind,
) -> np.ndarray:
    """Let hairs follow the lie of the fur from their roots: (H, P, 3)."""
    count, clumps = len(roots), int(clump.max()) + 1
    lie = _lie_of_the_fur(length, rng)
    turn = rng.normal(0, 0.22, clumps)[clump] + coat.turn_spread * rng.normal(0, 1, count)
    rise = rng.uniform(-0.12, 0.12, clumps)[clump]
    mean_tilt = math.radians(kind.tip_tilt)
    root_tilt = _ROOT_TILT * mean_tilt + rise + rng.uniform(-0.12, 0.12, count)
    # Bounded scatter: a single upright or overlong hair would set the top plane for all others.
    spread = coat.tilt_spread * rng.uniform(-1.7, 1.7, count)
    tip_tilt = mean_tilt + rise + spread
    step = length * coat.length / (POINTS_PER_HAIR - 1)
    step = step * rng.uniform(0.88, 1.12, clumps)[clump] * rng.uniform(0.82, 1.12, count)
    # Neighbours wave nearly in phase: locks, not frizz.
    waviness = kind.curl * coat.waviness * rng.uniform(0.6, 1.4, clumps)[clump]
    phase = rng.uniform(0, 2 * math.pi, clumps)[clump] + rng.normal(0, 0.5, count)
    waves = coat.waves * rng.uniform(0.8, 1.2, count)
    bend = rng.normal(0, 0.25, count)

    points = np.zeros((count, POINTS_PER_HAIR, 3))
    points[:, 0, :2] = roots
    for i in range(1, POINTS_PER_HAIR):
        along = (i - 0.5) / (POINTS_PER_HAIR - 1)
        angle = 2 * math.pi * waves * along + phase
        heading = lie(points[:, i - 1, :2]) + turn + bend * (along - 0.5)
        heading += waviness * np.sin(angle)
        tilt = root_tilt + (tip_tilt - root_tilt) * along**0.8 + 0.4 * waviness * np.cos(angle)
        tilt = np.clip(tilt, math.radians(3), math.radians(88))
        across = step * np.sin(tilt)
        growth = (across * np.cos(heading), across * np.sin(heading), step * np.cos(tilt))
        points[:, i] = points[:, i - 1] + np.stack(growth, axis=-1)
    return points


def _lie_of_the_fur(length: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """Make a smooth periodic field of headings: a function of positions (N, 2)."""
    frequencies = np.array([(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (-1, 2)])
    amplitudes = 0.45 * rng.normal(0, 1, len(frequencies)) / np.linalg.norm(frequencies, axis=1)
    # A small tile has long hairs: turn less across it, so that the lie bends alike along a hair.
    amplitudes *= min(1.0, 0.2 / length)
    phases = rng.uniform(0, 2 * math.pi, len(frequencies))
    mean = rng.uniform(0, 2 * math.pi)

    def heading(position: np.ndarray) -> np.ndarray:
        turns: np.ndarray = np.cos(2 * math.pi * position @ frequencies.T + phases) @ amplitudes
        return mean + turns

    return heading


def _draw_together(
    points: np.ndarray,
    guide: np.ndarray,
    cohesion: np.ndarray | float,
    onset: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """Pull each hair towards its guide hair, the more the nearer the tip (power ``onset``)."""
    roots = points[:, 0, :2]
    guides = points[guide]
    guides[..., :2] += np.round(roots - roots[guide])[:, None]  # the guide's nearest copy
    strength = np.clip(cohesion * rng.uniform(0.4, 1.25, len(points)), 0, 0.95)
    along = np.linspace(0, 1, points.shape[1])
    pull = strength[:, None, None] * along[:, None] ** onset * np.array([1, 1, 0.5])
    drawn: np.ndarray = points + pull * (guides - points)
    return drawn
