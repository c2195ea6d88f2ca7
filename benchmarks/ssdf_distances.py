"""Figures of the distances: speed against all pairs, error against many more directions, slits."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from assets_defs.ssdf_lighting.datasets import scene_of, visible_of
from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions
from pipelines.ssdf_lighting.distances.refined import occluders, refined_distances
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
from pipelines.ssdf_lighting.distances.visibility import RayOrigins, visible_directions
from pipelines.ssdf_lighting.light.spherical_gaussians import integral, visible_integral

NAIVE_VERTICES, FINE_VERTICES, FINE = 500, 250, 384


def edge_figures(stored: Callable[[str], xr.Dataset]) -> dict[str, Any]:
    """The edge inside a cell against many more directions; speed against all pairs."""
    scene, seen = scene_of(stored("scene_mesh")), stored("visibility")
    around = occluders(scene.vertices, scene.triangles)
    random = np.random.default_rng(0)
    origins = seen["origin"].values

    rows = random.permutation(len(origins))[:NAIVE_VERTICES]
    visible = visible_of(seen)[rows]
    halves = np.array_split(np.arange(len(rows)), 2)
    distances_to_samples(visible[:8])  # compiles
    start = time.perf_counter()
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda half: distances_to_samples(visible[half]), halves))
    samples_s = time.perf_counter() - start
    sealed = seen["sealed"].values

    def refined(of: NDArray[np.int64], visible: NDArray[np.bool_]) -> NDArray[np.float32]:
        return refined_distances(
            around, RayOrigins(origins[of], sealed[of]), scene.normals[of], visible
        )

    refined(rows[:8], visible[:8])
    start = time.perf_counter()
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda half: refined(rows[half], visible[half]), halves))
    refined_s = time.perf_counter() - start
    start = time.perf_counter()
    for one in visible:
        _all_pairs(one)
    naive_s = time.perf_counter() - start

    fine = random.permutation(np.flatnonzero(~sealed))[:FINE_VERTICES]
    visible = visible_of(seen)[fine]
    n = round(visible.shape[1] ** 0.5)
    ours, coarse = refined(fine, visible), distances_to_samples(visible)
    directions, weights = texel_directions(n), solid_angles(n) / (4 * np.pi)
    many = texel_directions(FINE)
    squares = []
    for row, vertex in enumerate(fine):
        some = RayOrigins(origins[vertex : vertex + 1], np.zeros(1, bool))
        there = visible_directions(around.rays, some, many)[0]
        if there.all() or not there.any():
            continue
        exact = np.where(
            visible[row],
            2 * np.arcsin(cKDTree(many[~there]).query(directions)[0] / 2),
            -2 * np.arcsin(cKDTree(many[there]).query(directions)[0] / 2),
        )
        squares.append([weights @ (one[row] - exact) ** 2 for one in (ours, coarse)])
    errors = np.sqrt(np.mean(squares, axis=0))
    medians = np.sqrt(np.median(squares, axis=0))
    return {
        "distance_vs_naive": samples_s / naive_s,
        "refined_vs_naive": refined_s / naive_s,
        "naive_ms": 1000 * naive_s / len(rows),
        "subcell_error_ratio": float(errors[0] / errors[1]),
        "subcell_error": float(errors[0]),
        "sample_error": float(errors[1]),
        "subcell_error_ratio_median_vertex": float(medians[0] / medians[1]),
    }


def slit_figures() -> dict[str, Any]:
    """What the nearest edge alone gets wrong: a light in the middle of a slit, as shares of it.

    A band of half-width a lets f(a) - f(-a) through, the method f(a). Mean for a evenly up to twice
    the light's width, 1 / sqrt(sharpness), and the most, at the thinnest.
    """
    found: dict[str, Any] = {"slit_error": {}, "slit_error_most": 0.0}
    for sharpness in (10.0, 100.0, 300.0):
        half = np.linspace(1e-3, 2.0, 200) / np.sqrt(sharpness)
        over = visible_integral(-half, sharpness) / integral(sharpness)
        found["slit_error"][f"{sharpness:g}"] = float(over.mean())
        found["slit_error_most"] = max(found["slit_error_most"], float(over.max()))
    return found


def _all_pairs(visible: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Distances to samples by one matrix product of all visible and all hidden directions."""
    directions = texel_directions(round(len(visible) ** 0.5)).astype(np.float32)
    near = directions[visible] @ directions[~visible].T
    distances = np.empty(len(visible), np.float32)
    if near.size:
        distances[visible] = np.arccos(np.minimum(near.max(axis=1), 1.0))
        distances[~visible] = -np.arccos(np.minimum(near.max(axis=0), 1.0))
    return distances
