"""Cloths for the virtual gonioreflectometer: four materials, yarn by yarn.

As different as the four of the neural BTF paper (shantung silk, two knits of wool, corduroy):

``silk``      plain weave of shiny yarns, warp and weft of different colours; the weft has slubs
``twill``     denim: blue warp over three, under one white weft, cotton
``knit``      stockinette of thick three-ply wool
``corduroy``  wales of cut pile that leans one way

A cloth is one mesh for the tile [0, 1] x [0, 1], periodic in x (u, to the right) and y (v, up;
the warp's, the wale's and the pile's way); z points out of the cloth. Parts may stand out of the
tile; they are met again on the opposite side. All is seeded: equal arguments give equal bits on
one machine.

The recipes are ours: shapes and proportions are those of ordinary cloth, seen and not measured.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.virtual.cloth.mesh import Cloth, cloth_of_tubes, cloth_sheet, join_cloths
from pipelines.virtual.cloth.yarns import FloatArray, ply_outline, smooth_noise, sweep, wind_pattern

__all__ = ["MATERIALS", "Cloth", "Recipe", "make_cloth"]


class Recipe(NamedTuple):
    """What a material is, and what makes it."""

    description: str
    make: Callable[[np.random.Generator], Cloth]


def make_cloth(name: str, seed: int) -> Cloth:
    """Make one tile of a built-in material.

    Raises ValueError for a name that is not in ``MATERIALS``.

    >>> cloth = make_cloth("corduroy", seed=0)
    >>> cloth.vertices.shape, cloth.fibres.shape
    ((83521, 3), (83521, 3))
    """
    if name not in MATERIALS:
        raise ValueError(f"material is {name!r}; expected one of {', '.join(MATERIALS)}.")
    return MATERIALS[name].make(np.random.default_rng(seed))


# --------------------------------------------------------------------------------------------
# Weaves


def _grid(cells: int, z: float = 0.0) -> FloatArray:
    axis = np.arange(cells) / cells
    return np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.full((cells, cells), z)], axis=-1)


def _backing(z: float, albedo: tuple[float, float, float]) -> Cloth:
    """Matt cloth behind the yarns: what shows between them."""
    return cloth_sheet(_grid(40, z), fibres=(0.0, 1.0, 0.0), albedo=albedo)


def _ringed(values: FloatArray) -> FloatArray:
    """Repeat the first ring after the last one, as ``sweep`` does with periodic tubes."""
    return np.concatenate([values, values[:, :1]], axis=1)


def _weave_heights(over: NDArray[np.bool_], steps: int, rounding: float) -> FloatArray:
    """Heights (Y, steps), -1 to 1, of yarns that pass over or under at (Y, N) crossings.

    The crossing n of N lies at (n + 1/2) / N. rounding: how much of the way to the neighbouring
        crossing a yarn takes for the change, 0 to 1.
    """
    crossings = over.shape[1]
    place = np.arange(steps) / steps * crossings - 0.5
    low = np.floor(place).astype(np.int64)
    part_way = np.clip(((place - low) - 0.5) / max(rounding, 1e-6) + 0.5, 0.0, 1.0)
    blend = 0.5 - 0.5 * np.cos(np.pi * part_way)
    side = np.where(over, 1.0, -1.0)
    return (1 - blend) * side[:, low % crossings] + blend * side[:, (low + 1) % crossings]


class _Yarns(NamedTuple):
    """One system of parallel yarns of a weave."""

    number: int
    radius: float  # half the width of a yarn
    flatness: float
    colour: tuple[float, float, float]
    specular: tuple[float, float, float]
    roughness: tuple[float, float]
    turns: int  # of fibres about the yarn over the tile
    slubs: float = 0.0  # relative standard deviation of the thickness, long waves
    wander: float = 0.02  # of the yarn's middle, in tile sides times 1/10
    uneven: float = 0.12  # colour from yarn to yarn
    speckle: float = 0.15  # colour within a yarn
    bundles: float = 0.06  # relative height of the fibre bundles
    plies: int = 1


def _woven(
    rng: np.random.Generator,
    yarns: _Yarns,
    over: NDArray[np.bool_],
    amplitude: float,
    way: int,
    rounding: float,
    steps: int = 240,
    corners: int = 32,
) -> Cloth:
    """Make the yarns that run along x (way 0) or y (way 1); ``over``: (Y, crossings)."""
    count = yarns.number
    shape = (count, steps, corners)
    centres = np.zeros((count, steps, 3))
    centres[..., way] = np.arange(steps) / steps
    line = (np.arange(count) + 0.5) / count
    wander = yarns.wander / 10 * smooth_noise(rng, (count, steps), (steps / 20,))
    centres[..., 1 - way] = line[:, None] + wander
    centres[..., 2] = amplitude * _weave_heights(over, steps, rounding)
    waves = smooth_noise(rng, (count, steps), (steps / 13,))
    thick = np.exp(yarns.slubs * (waves + 0.8 * np.maximum(waves - 0.8, 0.0)))
    pattern = smooth_noise(rng, shape, (steps / 24, 1.1))
    relief = ply_outline(yarns.plies, corners) * (1 + yarns.bundles * pattern)
    radii = yarns.radius * thick.clip(0.65, 1.8)[..., None] * wind_pattern(relief, yarns.turns)
    period = (1.0, 0.0, 0.0) if way == 0 else (0.0, 1.0, 0.0)
    tubes = sweep(centres, radii, period=period, flatness=yarns.flatness, turns=yarns.turns)
    shade = wind_pattern(
        0.6 * pattern + 0.8 * smooth_noise(rng, shape, (steps / 48, 0.8)), yarns.turns
    )
    tone = 1 + yarns.uneven * rng.standard_normal((count, 1, 1)) + yarns.speckle * shade
    tone = _ringed(tone.clip(0.25, 2.0))[..., None]
    return cloth_of_tubes(
        tubes,
        albedo=tone * np.array(yarns.colour),
        specular=np.array(yarns.specular) * np.sqrt(tone),
        roughness=yarns.roughness,
    )


def _silk(rng: np.random.Generator) -> Cloth:
    warp = _Yarns(
        number=16, radius=0.0305, flatness=0.25, colour=(0.21, 0.022, 0.075),
        specular=(0.30, 0.13, 0.20), roughness=(0.2, 0.5), turns=2, slubs=0.05, wander=0.03,
        uneven=0.12, speckle=0.14, bundles=0.06,
    )  # fmt: skip
    weft = _Yarns(
        number=12, radius=0.041, flatness=0.25, colour=(0.40, 0.12, 0.035),
        specular=(0.36, 0.22, 0.12), roughness=(0.2, 0.5), turns=1, slubs=0.2, wander=0.07,
        uneven=0.12, speckle=0.14, bundles=0.06,
    )  # fmt: skip
    checks = (np.arange(warp.number)[:, None] + np.arange(weft.number)) % 2 == 0
    return join_cloths(
        _woven(rng, warp, checks, 0.0075, 1, 0.9),
        _woven(rng, weft, ~checks.T, 0.0055, 0, 0.9),
        _backing(-0.02, (0.10, 0.02, 0.03)),
    )


def _twill(rng: np.random.Generator) -> Cloth:
    warp = _Yarns(
        number=12, radius=0.042, flatness=0.75, colour=(0.045, 0.085, 0.22),
        specular=(0.03, 0.03, 0.035), roughness=(0.45, 0.8), turns=10, slubs=0.09, wander=0.04,
        uneven=0.16, speckle=0.3, bundles=0.08,
    )  # fmt: skip
    weft = _Yarns(
        number=12, radius=0.038, flatness=0.8, colour=(0.58, 0.56, 0.5),
        specular=(0.04, 0.04, 0.04), roughness=(0.45, 0.8), turns=-10, slubs=0.1, wander=0.04,
        speckle=0.12, bundles=0.08,
    )  # fmt: skip
    over = (np.arange(12)[:, None] - np.arange(12)) % 4 != 0
    return join_cloths(
        _woven(rng, warp, over, 0.03, 1, 0.9),
        _woven(rng, weft, ~over.T, 0.03, 0, 0.9),
        _backing(-0.075, (0.1, 0.1, 0.12)),
    )


# --------------------------------------------------------------------------------------------
# Knit


def _loop_rows(wales: int, courses: int, steps: int) -> FloatArray:
    """Middle lines (courses, steps, 3) of stockinette, its right side up.

    Each loop is x = t + a sin 2t, y = h cos t, z = -d cos 2t (t over one loop): a common form of
    the plain knit, e.g. Choi and Lo, "An energy model of plain knitted fabric", Textile Research
    Journal 73(8), 2003. Legs lie in front, heads and feet behind.
    """
    width, height = 1.0 / wales, 1.0 / courses
    t = 2 * np.pi * wales * np.arange(steps) / steps
    x = np.arange(steps) / steps + 0.25 * width * np.sin(2 * t)
    y = 0.92 * height * np.cos(t)
    z = -0.036 * np.cos(2 * t)
    rows = np.stack([x, y, z], axis=-1)
    base = (np.arange(courses) + 0.5) / courses
    return rows + np.stack([0 * base, base, 0 * base], axis=-1)[:, None]


def _knit(rng: np.random.Generator) -> Cloth:
    wales, courses, steps, corners = 5, 7, 560, 30
    colour = np.array((0.44, 0.115, 0.05))
    centres = _loop_rows(wales, courses, steps)
    for axis, amount in enumerate((0.003, 0.004, 0.002)):
        centres[..., axis] += amount * smooth_noise(rng, (courses, steps), (steps / wales / 5,))
    shape = (courses, steps, corners)
    turns, plies = 9, 3
    pattern = smooth_noise(rng, shape, (9.0, 0.9))
    furrow = ply_outline(plies, corners, 0.6)
    thick = 1 + 0.05 * smooth_noise(rng, (courses, steps), (14.0,))
    radii = 0.049 * thick[..., None] * wind_pattern(furrow * (1 + 0.07 * pattern), turns)
    tubes = sweep(centres, radii, period=(1.0, 0.0, 0.0), turns=0.4 * turns)
    fine = smooth_noise(rng, shape, (7.0, 0.6))
    # Heather: fibres of other dyes among the rest.
    heather = 0.12 * smooth_noise(rng, (3, *shape), (7.0, 0.6)) ** 2
    tone = (
        1
        + 0.06 * rng.standard_normal((courses, 1, 1))
        + wind_pattern(0.1 * pattern + 0.2 * fine, turns)
    )
    tone *= wind_pattern(np.broadcast_to(furrow**0.7, shape), turns)
    mixed = np.stack([wind_pattern(h, turns) for h in heather], axis=-1)
    albedo = tone.clip(0.3, 1.8)[..., None] * (colour + (0.10, 0.07, 0.05) * mixed)
    yarn = cloth_of_tubes(
        tubes, albedo=_ringed(albedo), specular=(0.035, 0.03, 0.025), roughness=(0.5, 0.9)
    )
    return join_cloths(yarn, _backing(-0.09, (0.25, 0.07, 0.03)))


# --------------------------------------------------------------------------------------------
# Pile


def _corduroy(rng: np.random.Generator) -> Cloth:
    wales, cells = 6, 288
    colour = np.array((0.42, 0.21, 0.075))
    top, lean = 0.085, 0.75  # lean: tangent of the pile's angle from upright, towards +y
    grid = _grid(cells)
    # Tufts stand in rows across the wale; their ends are the bumps of the surface.
    shape = (cells, cells)
    ends = smooth_noise(rng, shape, (2.6, 2.0))
    clumps = smooth_noise(rng, shape, (5.0, 9.0))
    wander = 0.004 * smooth_noise(rng, shape, (30.0, 14.0))
    away = np.abs(((grid[..., 0] + wander) * wales) % 1.0 - 0.5) * 2
    rib = _rib(away / 0.86)
    z = top * rib * (1 + 0.03 * clumps) + 0.005 * np.sqrt(rib) * ends
    z += 0.0015 * (1 - rib) * ends
    # A hand has stroked it here more, there less.
    stroked = lean * (1 + 0.25 * smooth_noise(rng, shape, (24.0, 16.0)))
    grid[..., 1] += stroked * (z - top)
    grid[..., 2] = z
    pile = np.stack([0 * rib, stroked, np.ones(shape)], axis=-1)
    furrow = np.array((0.0, 1.0, 0.0)) * (1 - rib[..., None]) ** 4
    tone = 1 + 0.16 * ends + 0.08 * clumps + 0.10 * smooth_noise(rng, shape, (1.0, 1.0))
    # Down between the tufts and in the furrow less light comes out of the fibres.
    shade = (0.3 + 0.7 * np.sqrt(rib)) * tone.clip(0.4, 1.7)
    return cloth_sheet(
        grid,
        fibres=pile * rib[..., None] + furrow,
        albedo=(shade[..., None] * colour).clip(0.0, 0.9),
        specular=(0.06, 0.05, 0.04),
        roughness=(0.35, 0.75),
    )


def _rib(u: FloatArray) -> FloatArray:
    """Profile of a wale, 1 in the middle and 0 from |u| = 1 on."""
    return np.sqrt((1 - u**2).clip(0.0, None))


MATERIALS: dict[str, Recipe] = {
    "silk": Recipe("shantung silk: shiny plain weave in two colours, slubs in the weft", _silk),
    "twill": Recipe("denim: blue cotton warp over white weft in a diagonal", _twill),
    "knit": Recipe("stockinette of thick three-ply wool", _knit),
    "corduroy": Recipe("corduroy: wales of cut pile that leans one way", _corduroy),
}
