"""Figures that profiles, tables, samplers, layers, solids and pictures are judged by."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.drawing.picture_metrics import flip_map
from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.layers.features import Layers
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.tables import bsdf_table, sampling
from pipelines.glass_scratches.tables.bins import bin_weights
from pipelines.glass_scratches.tables.bsdf_table import BsdfTable, side_ratio, side_weights
from pipelines.glass_scratches.tables.glass_paths import shoot_glass_paths
from pipelines.glass_scratches.tables.glass_table import STEEPEST
from pipelines.glass_scratches.tables.groove_walls import groove_walls
from pipelines.glass_scratches.tables.lobe import Direction, Lobe
from pipelines.glass_scratches.tables.monte_carlo import shoot_paths
from pipelines.glass_scratches.tables.radiosity import leaving_share
from pipelines.glass_scratches.tables.table_2d import Table2D

BLOCKS = 16
_INCIDENCES, _PATHS = 16, 20_000
_OTHER_SEED = 987_654_321


def block_means(rho: NDArray[np.float64], blocks: int = BLOCKS) -> NDArray[np.float64]:
    """The table (M, M) averaged over blocks x blocks blocks of bins, weighted by the cosines.

    >>> block_means(np.ones((32, 32)), 4).shape
    (4, 4)
    """
    weight = bin_weights(len(rho))
    size = len(rho) // blocks
    shape = (blocks, size, blocks, size)
    summed = (rho * weight[:, None] * weight).reshape(shape).sum(axis=(1, 3))
    blocked = weight.reshape(blocks, size).sum(axis=1)
    return summed / (blocked[:, None] * blocked)


def energy_error(table: Table2D | BsdfTable) -> float:
    """Largest part of a beam that neither leaves nor stays."""
    if isinstance(table, BsdfTable):
        return bsdf_table.energy_error(table)
    return float(abs(leaving_share(table.rho) + table.absorbed - 1).max())


def reciprocity_error(table: Table2D | BsdfTable) -> float:
    """Largest difference of a table from its transpose, over its largest value: radiance over n².

    Of the paper's table that of block means, beyond five standard errors, over the largest block.
    """
    if isinstance(table, BsdfTable):
        return bsdf_table.asymmetry(table)
    blocks = min(BLOCKS, len(table.rho) // 2)
    mean = block_means(table.rho, blocks)
    error = np.sqrt(_block_variance(table.standard_error, blocks))
    beyond = np.abs(mean - mean.T) - 5 * np.sqrt(error**2 + error.T**2)
    return float(max(beyond.max(), 0.0) / mean.max())


def _block_variance(standard_error: NDArray[np.float64], blocks: int) -> NDArray[np.float64]:
    """Variance of block means, were the bins independent; they share their rays, which only makes
    it smaller."""
    weight = bin_weights(len(standard_error))
    size = len(weight) // blocks
    part = (standard_error * weight[:, None] * weight) ** 2
    summed = part.reshape(blocks, size, blocks, size).sum(axis=(1, 3))
    blocked = weight.reshape(blocks, size).sum(axis=1)
    return summed / (blocked[:, None] * blocked) ** 2


def paths_z_rms(
    profile: NDArray[np.float64],
    table: Table2D | BsdfTable,
    *,
    albedo: float,
    roughness: float,
    seed: int = 0,
) -> float:
    """RMS z-score of a table against new paths from 16 incidences, in 16 blocks of exits a side.

    Of walls of glass the table of the middle lean, and the same ground walls that ``seed`` gave;
    the paths' own seed is not one that a table is made with.
    """
    bins = table.rho.shape[-1] // (2 if isinstance(table, BsdfTable) else 1)
    size = table.rho.shape[-1]
    chosen = np.unique(np.linspace(0, size - 1, _INCIDENCES).round().astype(np.int64))
    if isinstance(table, BsdfTable):
        middle = len(table.leans) // 2
        lean = float(table.leans[middle])
        slope = 0.0 if roughness == 1.0 else STEEPEST * roughness
        shot = shoot_glass_paths(
            groove_walls(profile, slope, seed),
            lean,
            bins=bins,
            index=table.refractive_index,
            rays=_PATHS,
            albedo=albedo,
            even=roughness == 1.0,
            seed=_OTHER_SEED,
            incidence=chosen,
        ).leaving
        weight = side_weights(bins, side_ratio(lean, table.refractive_index, keeps=table.keeps))
        rho, standard_error = table.rho[middle], table.standard_error[middle]
    else:
        shot = shoot_paths(
            profile,
            bins=bins,
            rays=_PATHS,
            paths_per_ray=1,
            albedo=albedo,
            seed=_OTHER_SEED,
            incidence=chosen,
        ).leaving
        weight, rho, standard_error = bin_weights(bins) / np.pi, table.rho, table.standard_error
    seen = shot.sum(axis=1)[chosen].T / _PATHS
    expected, own = ((part * weight[:, None])[:, chosen] for part in (rho, standard_error))
    return _block_z_rms(seen, expected, own, min(BLOCKS, bins // 2) * (size // bins))


def _block_z_rms(
    seen: NDArray[np.float64],
    expected: NDArray[np.float64],
    own: NDArray[np.float64],
    blocks: int,
) -> float:
    """RMS z-score of parts of beams (bins, beams), counted of so many paths a beam."""
    shape = (blocks, len(seen) // blocks, seen.shape[1])
    found, likely = (part.reshape(shape).sum(axis=1) for part in (seen, expected))
    variance = (own**2).reshape(shape).sum(axis=1)
    least = np.maximum(likely, 1.0 / _PATHS)
    z = (found - likely) / np.sqrt(least * np.maximum(1 - least, 1e-3) / _PATHS + variance)
    return float(np.sqrt(np.mean(z**2)))


def sampler_p_value(lobe: Lobe, samples: int = 40_000) -> float:
    """p-value of a chi-square test: sampled lights in cells of (phi, lean) against the density.

    For a few views of both sides, and places across the opening; the least p-value times their
    number.
    """
    from scipy.stats import chi2

    views = ((0.0, 0.0, 1.0), (0.4, 0.9, 1.0), (-0.7, -0.5, 1.0), (0.2, -0.4, -1.0))
    columns, rows = 2 * min(16, len(lobe.sines) // 2), 12
    least, tested = 1.0, 0
    for number, (theta, phi, side) in enumerate(views):
        view = Direction(
            np.sin(theta), np.cos(theta) * np.sin(phi), side * np.cos(theta) * np.cos(phi)
        )
        for place in (1, lobe.rho.shape[1] // 2):
            u = np.random.default_rng(number).random((samples, 4))
            found, expected = np.zeros((2, rows, columns))
            _count(lobe, place, view, u, found)
            _expect(lobe, place, view, expected)
            expected *= samples
            order = np.argsort(expected.ravel())
            # Cells with few expected are joined until there are enough in each.
            groups = np.cumsum(expected.ravel()[order]) // 8
            seen = np.bincount(groups.astype(np.int64), found.ravel()[order])
            hoped = np.bincount(groups.astype(np.int64), expected.ravel()[order])
            used = hoped > 4
            statistic = float(((seen - hoped)[used] ** 2 / hoped[used]).sum())
            least = min(least, float(chi2.sf(statistic, max(int(used.sum()) - 1, 1))))
            tested += 1
    return min(1.0, least * tested)


def block_z_rms(
    maps: NDArray[np.float32], others: NDArray[np.float32], *, samples: int, blocks: int = 8
) -> float:
    """RMS z-score between two pictures of the same coverage, (L, R, R) and (L, Q, Q), in blocks.

    ``samples`` points a layer made each of them. Binomial variance is more than stratified points
    have: 1 is the most that equal coverages give.
    """
    one, other = (_blocks(picture.astype(np.float64), blocks) for picture in (maps, others))
    share = np.clip((one + other) / 2, 1.0 / samples, 1.0)
    variance = 2 * share * (1 - share) * blocks**2 / samples
    return float(np.sqrt(np.mean((one - other) ** 2 / variance)))


def _blocks(maps: NDArray[np.float64], blocks: int) -> NDArray[np.float64]:
    size = maps.shape[1] // blocks
    return maps.reshape(len(maps), blocks, size, blocks, size).mean(axis=(2, 4))


def brightest_excess(
    picture: NDArray[np.floating], error: NDArray[np.floating], block: int = 8
) -> float:
    """How far the brightest block x block pixels of a picture (H, W) lie above 1, in their standard
    errors (but at least in thousandths of radiance)."""
    height, width = (side - side % block for side in picture.shape)
    shape = (height // block, block, width // block, block)
    mean = picture[:height, :width].reshape(shape).mean(axis=(1, 3), dtype=np.float64)
    variance = (error[:height, :width].astype(np.float64) ** 2).reshape(shape).sum(axis=(1, 3))
    return float(((mean - 1) / np.maximum(np.sqrt(variance) / block**2, 1e-3)).max())


def profile_aspect(points: NDArray[np.float64]) -> float:
    """Depth of a profile (n, 2) of v, n over its opening's width.

    >>> profile_aspect(np.array([[0.0, 0.0], [5.0, -4.0], [10.0, 0.0]]))
    0.4
    """
    return float(-points[:, 1].min() / (points[-1, 0] - points[0, 0]))


def opening_tilt(points: NDArray[np.float64]) -> float:
    """How far a profile's ends, or anything between, lie off n = 0, in its units."""
    return float(abs(points[[0, -1], 1]).max() + max(points[:, 1].max(), 0.0))


def across_error(across: NDArray[np.float32], rho: NDArray[np.float64]) -> float:
    """Largest difference of the mean of tables across the opening (S, places, M, M) from the tables
    (S, M, M), over the largest value."""
    mean = across.mean(axis=1, dtype="float64")
    return float(abs(mean - rho.transpose(0, 2, 1)).max() / rho.max())


def coverage_error(maps: NDArray[np.float32], spec: LayerSpec) -> float | None:
    """Relative difference of maps' (L, R, R) coverage from what was asked for, mean of layers.

    For a threshold, from what Poisson points give; None where that has no closed form.
    """
    found = maps.mean(axis=(1, 2), dtype=np.float64)
    wanted = spec.coverage
    if wanted is None:
        if any((spec.digs, spec.fading, spec.breaks, spec.spread)):
            return None
        wanted = 1 - np.exp(-np.pi * spec.threshold**2)
    return float(np.abs(found / wanted - 1).mean())


def coverage_map_z(maps: NDArray[np.float32], layers: Layers, samples: int) -> float:
    """RMS z-score of the means of maps (L, R, R), of ``samples`` a texel, over 8 x 8 blocks against
    the scratches sampled anew."""
    again = coverage_maps(layers, maps.shape[1] // 2, 4 * samples)
    return block_z_rms(maps, again, samples=samples * maps[0].size)


def edge_error(triangles: NDArray[np.integer]) -> float:
    """Share of the sides of triangles (F, 3) without a partner of the opposite sense.

    >>> edge_error(np.array([[0, 1, 2], [0, 2, 1]])), edge_error(np.array([[0, 1, 2]]))
    (0.0, 1.0)
    """
    corners = np.asarray(triangles, np.int64)
    count = int(corners.max()) + 1
    one, other = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    return float(1 - np.isin(one * count + other, other * count + one).mean())


def enclosed_volume(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> float:
    """Volume inside a closed surface (V, 3), (F, 3), by the divergence theorem."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def denoised_change(clean: NDArray[np.floating], traced: NDArray[np.floating]) -> float:
    """Largest relative change of the mean radiance of views (V, H, W, 3) by a denoiser.

    >>> traced = np.ones((2, 4, 4, 3), np.float32)
    >>> round(denoised_change(traced * np.float32(0.75), traced), 6)
    0.25
    """
    before, after = (each.mean(axis=(1, 2, 3), dtype=np.float64) for each in (traced, clean))
    return float(np.abs(after / before - 1).max())


def stage_flip(traced: NDArray[np.uint8], stage: NDArray[np.uint8]) -> float:
    """FLIP of pictures (views, H, W, 3) of the stage against traced ones, mean of whole frames."""
    return float(
        np.mean([flip_map(one, true).mean() for one, true in zip(stage, traced, strict=True)])
    )


def impossible_share(radiance: NDArray[np.floating]) -> float:
    """Share of the radiance that is not finite, or negative."""
    return float(np.mean(~np.isfinite(radiance) | (radiance < 0)))


@njit(cache=True, nogil=True)
def _cell(lobe, light, rows, columns):  # type: ignore[no-untyped-def]
    """A light's row, by its lean over all that its side has, and column, of both sides."""
    row = min(int((light.u + 1.0) / 2.0 * rows), rows - 1)
    bins = len(lobe.sines) - 1
    return row, sampling.side_bin(light, bins) * columns // (2 * bins)


@njit(cache=True, nogil=True)
def _count(lobe, place, view, u, found):  # type: ignore[no-untyped-def]
    rows, columns = found.shape
    for i in range(len(u)):
        light = sampling.sample(lobe, place, view, (u[i, 0], u[i, 1], u[i, 2], u[i, 3]))
        row, column = _cell(lobe, light, rows, columns)
        found[row, column] += 1.0


@njit(cache=True, nogil=True)
def _expect(lobe, place, view, part):  # type: ignore[no-untyped-def]
    """Integral of the density over cells of equal steps of u and equal phi, by the midpoints of
    narrow strips: the measure of a direction is du dphi."""
    rows, columns = part.shape
    bins = len(lobe.sines) - 1
    fine = 400
    for row in range(rows):
        for strip in range(fine):
            along = 2.0 * (row + (strip + 0.5) / fine) / rows - 1.0
            rest = np.sqrt(1.0 - along * along)
            for both in range(2 * bins):
                low, high = lobe.sines[both % bins], lobe.sines[both % bins + 1]
                # In a bin the density falls with cos phi alone, whose mean is known.
                middle = 0.5 * (np.arcsin(high) + np.arcsin(low))
                up = rest * np.cos(middle)
                side = 1.0 if both < bins else -1.0
                light = Direction(along, rest * np.sin(middle), side * up)
                density = sampling.pdf(lobe, place, view, light) / np.cos(middle)
                size = (high - low) * 2.0 / (rows * fine)
                _, column = _cell(lobe, light, rows, columns)
                part[row, column] += density * size
