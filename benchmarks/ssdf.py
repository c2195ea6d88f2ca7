"""Figures of SSDF lighting: the paper's table, bytes at equal error, speed, and pictures.

The default scale judges the default scene as it is stored and drawn. ``--scale paper`` adds the
paper's table, what each idea of the compact form is worth, general codecs and edges against finer
directions, and makes the scene four and sixteen times as fine, too. docs/ssdf.md says what each
figure means.
"""

from __future__ import annotations

import functools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from assets_defs.ssdf_lighting.datasets import distance_blocks, shared_basis_of, visible_of
from assets_defs.ssdf_lighting.graph import SSDF
from assets_defs.workspace import CHECKOUT, Workspace
from benchmarks.ssdf_distances import edge_figures, slit_figures
from benchmarks.ssdf_precompute import SCENE
from benchmarks.ssdf_seams import seam_figures
from benchmarks.ssdf_thin import thin_figures
from pipelines.ssdf_lighting.compression import compact as coding
from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca, clustered_pca
from pipelines.ssdf_lighting.compression.compact_file import to_bytes
from pipelines.ssdf_lighting.compression.compact_memory import pack
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.triangle_clusters import (
    clusters_by_distance,
    clusters_by_position,
)
from pipelines.ssdf_lighting.distances.signed_distance import distances_to_samples
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights
from pipelines.ssdf_lighting.figures import compression_errors

PAPER_CLUSTERS, PAPER_VALUES, PAPER_CONTRIBUTION = 64, 48, 0.9
PAPER_ERRORS = {"error_48": 0.312758, "error_90": 1.4008}
PAPER_MB = {"raw": 266.0, "48": 66.4, "90": 22.2}
"""The paper's table, MB of 2^20 bytes."""
FACTORS = {"default": (1,), "paper": (1, 2, 4, 16)}
SINGLE_FACTORS = (1, 4, 16)
CURVE_VALUES = (4, 8, 16, 32, 48, 64, 96)
CURVE_CLUSTERS = (1, 4, 16, 64, 256)
CURVE_STEPS = (0.1, 0.15, 0.25, 0.4, 0.6, 1.0)


def run(scale: str) -> dict[str, Any]:
    """All figures."""
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        made = {
            factor: _precomputed(Path(folder) / f"{factor}x", factor) for factor in FACTORS[scale]
        }
        figures |= _precompute_figures(made)
        store = Workspace(Path(folder) / "1x").store

        def stored(asset: str) -> xr.Dataset:
            return store.open(SSDF.slot(asset, {"scene": SCENE}))

        if scale == "paper":
            matrix = stored("ssdf_matrix")["distances"].values
            for part in (_tables, _compact, _curve):
                _timed(figures, part.__name__, functools.partial(part, stored, matrix, figures))
            np.save(Path(folder) / "matrix.npy", matrix)
            _timed(figures, "codecs", lambda: _codecs(Path(folder) / "matrix.npy", figures))
            _timed(figures, "single", lambda: _single(Path(folder)))
            _timed(figures, "edges", lambda: edge_figures(stored))
        figures |= slit_figures()
        _timed(figures, "seams", lambda: seam_figures(stored))
        _timed(figures, "thin", thin_figures)
        from benchmarks.ssdf_page import page_figures
        from benchmarks.ssdf_pictures import picture_figures
        from benchmarks.ssdf_probe import probe_figures
        from benchmarks.ssdf_relit import relit_judge
        from benchmarks.ssdf_rivals import rival_figures

        _timed(figures, "pictures", lambda: picture_figures(stored))
        _timed(figures, "rivals", lambda: rival_figures(stored, relit_judge(stored), scale))
        _timed(figures, "page", lambda: page_figures(stored))
        _timed(figures, "probe", probe_figures)
    return figures


def _timed(figures: dict[str, Any], name: str, part: Callable[[], dict[str, Any]]) -> None:
    start = time.perf_counter()
    figures |= part()
    print(f"{name.strip('_')}: {time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)


# ---- making it -------------------------------------------------------------------------------


def _precomputed(folder: Path, factor: int) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.ssdf_precompute", str(folder), str(factor)]
    done = subprocess.run(command, cwd=CHECKOUT, check=True, stdout=subprocess.PIPE, text=True)
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    print(f"{factor}x: {found['total_seconds']:.0f} s", file=sys.stderr, flush=True)
    return found


def _precompute_figures(made: dict[int, dict[str, Any]]) -> dict[str, Any]:
    found = {
        "vertices": made[1]["vertices"],
        "precompute_s": made[1]["total_seconds"],
        "precompute_steps": {str(factor): one["seconds"] for factor, one in made.items()},
        "peak_rss_mb": made[1]["peak_rss_mb"],
        "peak_rss_mb_all": {str(factor): one["peak_rss_mb"] for factor, one in made.items()},
    }
    if len(made) > 1:
        vertices, seconds = (
            np.log([one[name] for one in made.values()]) for name in ("vertices", "total_seconds")
        )
        found["growth_exponent"] = float(np.polyfit(vertices, seconds, 1)[0])
    return found


# ---- bytes and error -------------------------------------------------------------------------


def _rmse(matrix: NDArray[np.float32], decode: Callable[..., NDArray[np.float32]]) -> float:
    squares, weights = 0.0, root_weights(matrix.shape[1])
    for first in range(0, len(matrix), 1024):
        rows = np.arange(first, min(first + 1024, len(matrix)))
        off = (decode(rows) - matrix[rows]) * weights
        squares += float((off.astype(np.float64) ** 2).sum())
    return (squares / matrix.size) ** 0.5


def _tables(
    stored: Callable[[str], xr.Dataset], matrix: NDArray[np.float32], figures: dict[str, Any]
) -> dict[str, Any]:
    """The paper's table, on refined distances and on those to the samples."""
    mesh = stored("scene_mesh")
    triangles = mesh["triangles"].values
    clusters = clusters_by_position(mesh["vertices"].values, triangles, PAPER_CLUSTERS, 0).triangle
    found: dict[str, Any] = {
        "raw_bytes": matrix.nbytes,
        "paper_mb": PAPER_MB,
        "paper_errors": PAPER_ERRORS,
    }
    seen = stored("visibility")
    samples = np.concatenate(
        [
            distances_to_samples(visible_of(seen.isel(vertex=slice(first, first + 1024))))
            for first in range(0, len(matrix), 1024)
        ]
    )
    for label, rows in (("", matrix), ("_samples", samples)):
        for name, values, contribution in (
            ("48", PAPER_VALUES, None),
            ("90", None, PAPER_CONTRIBUTION),
        ):
            pca = clustered_pca(
                functools.partial(np.take, rows, axis=0),
                triangles,
                clusters,
                values=values,
                contribution=contribution,
            )
            found |= {
                f"bytes_{name}{label}": pca.nbytes,
                f"error_{name}{label}": float(pca.relative_error.sum()),
                f"rmse_{name}{label}": _rmse_of_pca(rows, pca),
                f"values_{name}{label}": len(pca.vectors) / PAPER_CLUSTERS,
            }
    return found


def _rmse_of_pca(matrix: NDArray[np.float32], pca: ClusteredPca) -> float:
    return _rmse(matrix, Decoder.of_pca(pca, len(matrix)).distances)


def _dense(cluster: NDArray[np.integer]) -> NDArray[np.int32]:
    return np.unique(cluster, return_inverse=True)[1].astype(np.int32)


def _compact(
    stored: Callable[[str], xr.Dataset], matrix: NDArray[np.float32], figures: dict[str, Any]
) -> dict[str, Any]:
    """The compact form at the error of the paper's 48 values, and what each idea in it is worth."""
    basis = shared_basis_of(stored("triangle_clusters"))
    mesh = stored("scene_mesh")
    triangles = mesh["triangles"].values
    target = figures["rmse_48"]
    cluster = _dense(stored("triangle_clusters")["vertex_cluster"].values)
    best = coding.quantise_to_rmse(basis, cluster, target)
    file, memory = to_bytes(best), pack(best)
    decoder = Decoder.of_file(file)
    from_file = coding.decoded_coordinates(best)
    vectors = coding.shared_vectors(best) / root_weights(matrix.shape[1])
    errors = (
        _rmse(matrix, lambda rows: from_file[rows] @ vectors),
        _rmse(matrix, decoder.distances),
    )
    errors_in_memory = compression_errors(
        distance_blocks(stored("ssdf_matrix")), decoder.distances, mesh["normals"].values
    )
    found: dict[str, Any] = {
        "file_bytes": len(file),
        "memory_bytes": memory.nbytes,
        "runtime_bytes": decoder.resident_bytes,
        "best_rmse_file": errors[0],
        "best_rmse_memory": errors[1],
        "best_rmse_ratio": max(errors) / target,
        "best_wrong_visibility": errors_in_memory.wrong_visibility,
        "best_values": len(best.weights) / len(matrix),
        "file_ratio_48": figures["bytes_48"] / len(file),
    }
    # One idea less at a time, at the same error.
    positions = clusters_by_position(mesh["vertices"].values, triangles, PAPER_CLUSTERS, 0)
    alike = clusters_by_distance(basis.coordinates, triangles, PAPER_CLUSTERS, 0)
    for name, labels in (("64_positions", positions.vertex), ("64_distances", alike.vertex)):
        one = coding.quantise_to_rmse(basis, _dense(labels), target)
        found[f"file_bytes_{name}"] = len(to_bytes(one))
        found[f"memory_bytes_{name}"] = pack(one).nbytes
        found[f"values_{name}"] = len(one.weights) / len(matrix)
    found["file_bytes_8_bit"] = sum(part.size for part in best[1:] if part.ndim)
    import lzma

    codes = np.concatenate([part.ravel() for part in best[1:]]).astype("<i2").tobytes()
    found["file_bytes_lzma"] = len(lzma.compress(codes, preset=9))
    return found


def _curve(
    stored: Callable[[str], xr.Dataset], matrix: NDArray[np.float32], figures: dict[str, Any]
) -> dict[str, Any]:
    """Bytes against error: the paper's form for m values, ours for several steps, by clusters."""
    basis = shared_basis_of(stored("triangle_clusters"))
    mesh = stored("scene_mesh")
    triangles, vertices = mesh["triangles"].values, mesh["vertices"].values
    directions = matrix.shape[1]
    curve: dict[str, Any] = {}
    for count in CURVE_CLUSTERS:
        near = clusters_by_position(vertices, triangles, count, 0).triangle
        members = [np.unique(triangles[near == number]) for number in range(count)]
        rows = sum(len(one) for one in members)
        spectra = [
            np.linalg.svd(basis.coordinates[one], compute_uv=False).astype(np.float64)
            for one in members
        ]
        lost = basis.lost * rows / len(matrix)
        paper = []
        for values in CURVE_VALUES:
            kept = sum(min(values, len(one)) for one in spectra)
            used = sum(len(own) * min(values, len(own)) for own in members)
            squares = lost + sum(float((one[values:] ** 2).sum()) for one in spectra)
            paper.append(
                [values, 4 * (kept * directions + used), (squares / (rows * directions)) ** 0.5]
            )
        alike = _dense(clusters_by_distance(basis.coordinates, triangles, count, 0).vertex)
        factors = coding.cluster_factors(basis, alike)
        ours = []
        for step in CURVE_STEPS:
            made = coding.quantise(basis, alike, factors, step)
            error = (coding.squared_error(basis, made) / matrix.size) ** 0.5
            ours.append([step, len(to_bytes(made)), pack(made).nbytes, error])
        curve[str(count)] = {"paper": paper, "ours": ours}
    return {"curve": curve}


def _codecs(matrix: Path, figures: dict[str, Any]) -> dict[str, Any]:
    rmse = max(figures["best_rmse_file"], figures["best_rmse_memory"])
    command = [sys.executable, "-m", "benchmarks.ssdf_codecs", str(matrix), str(rmse)]
    done = subprocess.run(command, cwd=CHECKOUT, check=True, stdout=subprocess.PIPE, text=True)
    sizes = json.loads(done.stdout.splitlines()[-1])
    return {
        "codec_bytes": sizes,
        "codec_bytes_ratio": sizes["zfp"] / figures["memory_bytes"],
        "jxl_bytes_ratio": sizes["jxl"] / figures["memory_bytes"],
    }


def _single(folder: Path) -> dict[str, Any]:
    """One PCA of everything (Wang et al.) against clusters, by size of the mesh.

    Both at the error of the graph's own setting, by the same coder: one cluster against as many
    as the graph makes.
    """
    found: dict[str, Any] = {
        "single_pca_file_ratio": {},
        "single_pca_memory_ratio": {},
        "single_pca_resident_ratio": {},
        "single_pca_multiplies_ratio": {},
        "single_pca_values": {},
        "clusters_values": {},
    }
    for factor in SINGLE_FACTORS:
        store = Workspace(folder / f"{factor}x").store
        made = store.open(SSDF.slot("triangle_clusters", {"scene": SCENE}))
        compressed = store.open(SSDF.slot("ssdf_basis", {"scene": SCENE}))
        basis = shared_basis_of(made)
        rmse = float(compressed["rmse"])
        own = coding.quantise_to_rmse(basis, _dense(made["vertex_cluster"].values), rmse)
        one = coding.quantise_to_rmse(basis, np.zeros(len(basis.coordinates), np.int32), rmse)
        count = len(basis.coordinates)
        values = len(one.weights) / count, len(own.weights) / count
        label = f"{factor}x"
        found["single_pca_file_ratio"][label] = len(to_bytes(one)) / len(to_bytes(own))
        found["single_pca_memory_ratio"][label] = pack(one).nbytes / pack(own).nbytes
        found["single_pca_resident_ratio"][label] = (
            Decoder.of_file(to_bytes(one)).resident_bytes
            / Decoder.of_file(to_bytes(own)).resident_bytes
        )
        found["single_pca_multiplies_ratio"][label] = values[0] / values[1]
        found["single_pca_values"][label], found["clusters_values"][label] = values
    return found
