"""What distances are stored as, against its rivals: a row of figures for each, one setting a row.

Bytes of the file and of what stays while a scene is drawn, seconds to decode, multiplications a
look-up, PSNR of relit pictures and of irradiance, frames a second. The rivals: the bits of
visibility without loss (`compression.visibility_bits`), summed as they are and as distances rebuilt
from them; one PCA; a basis that moves along the mesh; spherical harmonics of visibility times
cosine. All are quantised by the search for one step and coded by the same coder; the last three get
the bytes of ours. The null is a hemisphere without shadows.

Irradiance is judged at vertices and inside triangles, under spherical Gaussians of several
sharpnesses, against many rays; errors are shares of what a surface facing the light would get.
"""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from assets_defs.ssdf_lighting.datasets import scene_of, shared_basis_of, visible_of
from pipelines.geometry.rays import build_scene
from pipelines.ssdf_lighting.compression import compact as coding
from pipelines.ssdf_lighting.compression.bits_file import CodedBits, bits_to_bytes
from pipelines.ssdf_lighting.compression.compact_file import to_bytes
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.entropy_coding import decode, encode
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.compression.triangle_clusters import clusters_by_position
from pipelines.ssdf_lighting.compression.visibility_bits import (
    decode_visibility,
    encode_visibility,
)
from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions
from pipelines.ssdf_lighting.distances.rebuilt import rebuilt_distances, visible_at
from pipelines.ssdf_lighting.distances.visibility import LIFT, RayOrigins, visible_directions
from pipelines.ssdf_lighting.drawing.frames import DistancesAlong
from pipelines.ssdf_lighting.light.cosine_lobes import cosine_lobes
from pipelines.ssdf_lighting.light.spherical_gaussians import visible_share, visible_table

FloatArray = NDArray[np.float64]

_REBUILT = 512
"""Vertices whose distances are rebuilt at a time."""
_POINTS = 160
"""Vertices, and as many points inside triangles, whose irradiance is judged."""
_FINE = 3
"""Rays a side of a texel for the truth."""
_SHARPNESS = (3.0, 10.0, 30.0, 100.0, 300.0)
_AXES = 6
_BITS_ROWS = (48, 64)
"""Rows of directions of files of bits."""
_STEPS = (0.05, 0.1, 0.16, 0.25, 0.4)
"""Steps of ours that are tried."""
_DEGREES = 10
"""Bands of spherical harmonics: 100 coefficients a vertex."""


class Judged(NamedTuple):
    """Points whose irradiance is judged.

    corners: (P, 3) vertices and shares (P, 3) that a point lies between; normals: (P, 3).
    truth: (P, L), share of what a surface facing the light would get; whole: (L,) that.
    axes: (P, L, 3), sharpness: (P, L) of light times cosine; bright, horizons: (P, L), what the
        open hemisphere would give, and how far the surface's own horizon is.
    ways: (F, 3) rays' directions; falling: (L, F) radiance times solid angle.
    """

    corners: NDArray[np.int64]
    shares: FloatArray
    normals: FloatArray
    truth: FloatArray
    whole: FloatArray
    axes: FloatArray
    sharpness: FloatArray
    bright: FloatArray
    horizons: FloatArray
    ways: FloatArray
    falling: FloatArray


def judged_points(scene: Any, seen: xr.Dataset) -> Judged:
    """The points, the lights, and the truth by rays."""
    random = np.random.default_rng(0)
    count = len(scene.vertices)
    fit = (seen["stored"].values == np.arange(count)) & ~seen["sealed"].values
    vertices = random.permutation(np.flatnonzero(fit))[:_POINTS]
    faces = random.permutation(np.flatnonzero(fit[scene.triangles].all(axis=1)))[:_POINTS]
    corners = np.concatenate([np.repeat(vertices[:, None], 3, axis=1), scene.triangles[faces]])
    shares = np.concatenate([np.tile([1.0, 0.0, 0.0], (len(vertices), 1)),
                             random.dirichlet(np.ones(3), len(faces))])  # fmt: skip
    normals = np.einsum("pk,pkc->pc", shares, scene.normals[corners])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    a, b, c = scene.vertices[scene.triangles[faces]].transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    lift = LIFT * np.linalg.norm(b - a, axis=1, keepdims=True)
    inside = np.einsum("pk,pkc->pc", shares[len(vertices) :],
                       scene.vertices[scene.triangles[faces]]) + lift * facing  # fmt: skip
    starts = np.concatenate([seen["origin"].values[vertices], inside.astype(np.float32)])

    axes = random.normal(size=(_AXES, 3))
    axes[:, 2] = np.abs(axes[:, 2])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    axes = np.repeat(axes, len(_SHARPNESS), axis=0)
    sharpness = np.tile(_SHARPNESS, _AXES)
    n = _FINE * math.isqrt(seen.sizes["direction"])
    ways, areas = texel_directions(n), solid_angles(n)
    falling = np.exp(sharpness[:, None] * (axes @ ways.T - 1.0)) * areas
    whole = (falling * np.maximum(axes @ ways.T, 0.0)).sum(axis=1)
    rays = build_scene(scene.vertices, scene.triangles)
    truth = np.empty((len(corners), len(axes)))
    for point, start in enumerate(starts):
        free = visible_directions(rays, RayOrigins(start[None], np.zeros(1, bool)), ways)[0]
        truth[point] = falling @ (free * np.maximum(normals[point] @ ways.T, 0.0))

    fitted = cosine_lobes(sharpness)
    cosine = np.clip(normals @ axes.T, -1.0, 1.0)
    columns = np.linspace(-1.0, 1.0, fitted.along.shape[1])
    bright, sharp, along, up = (
        np.stack([np.interp(cosine[:, k], columns, rows[k]) for k in range(len(axes))], axis=1)
        for rows in fitted
    )
    lobes = along[..., None] * axes + up[..., None] * normals[:, None]
    lobes /= np.linalg.norm(lobes, axis=2, keepdims=True)
    horizons = np.arcsin(np.clip(np.einsum("plc,pc->pl", lobes, normals), -1.0, 1.0))
    return Judged(
        corners, shares, normals, truth / whole, whole, lobes, sharp, bright / whole, horizons,
        ways, falling,
    )  # fmt: skip


def _db(judged: Judged, found: FloatArray) -> float:
    return float(-10.0 * np.log10(((found - judged.truth) ** 2).mean()))


def irradiance_db(judged: Judged, distances_along: DistancesAlong) -> float:
    """PSNR (dB) of irradiance by distances, interpolated between vertices."""
    axes = judged.axes.astype(np.float32)
    d = sum(
        judged.shares[:, k, None] * distances_along(judged.corners[:, k], axes) for k in range(3)
    )
    table = visible_table()
    visible = visible_share(table, d, judged.sharpness) / np.maximum(
        visible_share(table, judged.horizons, judged.sharpness), 1e-3
    )
    return _db(judged, judged.bright * np.minimum(visible, 1.0))


def bits_db(judged: Judged, visible: NDArray[np.bool_]) -> float:
    """PSNR (dB) of irradiance by bits (V, n²): whole texels are lit or not."""
    n = math.isqrt(visible.shape[1])
    found = np.empty(judged.truth.shape)
    for point, (corners, shares) in enumerate(zip(judged.corners, judged.shares, strict=True)):
        square = (shares @ visible[corners]).reshape(n, n)
        fine = np.repeat(np.repeat(square, _FINE, axis=0), _FINE, axis=1).ravel()
        falling = np.maximum(judged.normals[point] @ judged.ways.T, 0.0)
        found[point] = judged.falling @ (fine * falling) / judged.whole
    return _db(judged, found)


# ---- rows ----------------------------------------------------------------------------------------


class _Rows:
    """Makes rows of the scene's rivals."""

    def __init__(self, stored: Callable[[str], xr.Dataset], relit: Callable[..., Any]) -> None:
        made = stored("triangle_clusters")
        self.scene = scene_of(stored("scene_mesh"))
        self.seen = stored("visibility")
        self.visible = visible_of(self.seen)
        self.matrix = stored("ssdf_matrix")["distances"]
        self.basis = shared_basis_of(made)
        self.cluster = np.unique(made["vertex_cluster"].values, return_inverse=True)[1]
        self.rmse = float(stored("ssdf_basis")["rmse"])
        self.file = stored("ssdf_basis")["file"].values.tobytes()
        self.judged = judged_points(self.scene, self.seen)
        self.relit = relit

    def of_file(self, file: bytes) -> dict[str, Any]:
        """Of a file in either version."""
        decoder = Decoder.of_file(file)
        begin = time.process_time()
        resident = decoder.resident_bytes
        seconds = time.process_time() - begin
        return {
            "file_bytes": len(file),
            "resident_bytes": resident,
            "decode_s": seconds,
            "multiplications": 4.0 * (1.0 + len(decoder.tables.weights) / len(self.cluster)),
            **self.relit(decoder.distances_along),
            "irradiance_db": irradiance_db(self.judged, decoder.distances_along),
        }

    def of_bits(self, n: int) -> dict[str, Any]:
        """Of a file of bits in n x n directions, drawn from what is rebuilt from it."""
        blocks = (
            self.matrix[k : k + _REBUILT].values for k in range(0, len(self.visible), _REBUILT)
        )
        seen = np.concatenate([visible_at(block, n) for block in blocks])
        rebuilt_distances(seen[:1])  # compiles it
        coded = CodedBits(seen, self.cluster.astype(np.int32))
        return self.of_file(bits_to_bytes(coded, self.scene.triangles))

    def of_bytes(self, labels: NDArray[np.integer], budget: int) -> dict[str, Any]:
        """Of other clusters, at about the same bytes."""
        codes = coding.quantise_to_bytes(
            self.basis,
            np.unique(labels, return_inverse=True)[1].astype(np.int32),
            lambda tried: len(to_bytes(tried)),
            budget,
        )
        return self.of_file(to_bytes(codes))

    def bits(self) -> dict[str, dict[str, Any]]:
        """The bits of visibility, without loss: summed, and as distances rebuilt from them."""
        codes = encode_visibility(self.visible, self.scene.triangles)
        count, n = len(self.visible), math.isqrt(self.visible.shape[1])
        begin = time.perf_counter()
        found = decode_visibility(*codes, count, n)
        seconds = time.perf_counter() - begin
        if not np.array_equal(found, self.visible):
            raise ValueError("the bits of visibility: decoded they are others than before.")
        blocks = range(0, count, _REBUILT)
        matrix = np.concatenate([rebuilt_distances(found[k : k + _REBUILT]) for k in blocks])
        rebuilt = time.perf_counter() - begin
        along = functools.partial(matrix_along, matrix)
        return {
            "bits": {
                "file_bytes": sum(map(len, codes)),
                "resident_bytes": self.visible.size // 8,
                "decode_s": seconds,
                "multiplications": float(self.visible.shape[1]),
                "irradiance_db": bits_db(self.judged, found),
            },
            "bits_as_distances": {
                "file_bytes": sum(map(len, codes)),
                "resident_bytes": matrix.nbytes,
                "decode_s": rebuilt,
                "multiplications": 4.0,
                **self.relit(along),
                "irradiance_db": irradiance_db(self.judged, along),
            },
        }

    def harmonics(self, budget: int) -> dict[str, Any]:
        """Visibility times cosine in spherical harmonics, its codes in as many bytes; matt only."""
        n = math.isqrt(self.visible.shape[1])
        ways, areas = texel_directions(n), solid_angles(n)
        bands = np.repeat(np.arange(_DEGREES), 2 * np.arange(_DEGREES) + 1)
        basis = harmonics_of(ways)
        transfer = np.empty((len(self.visible), len(bands)))
        for first in range(0, len(transfer), 1024):
            part = slice(first, first + 1024)
            falling = np.maximum(self.scene.normals[part] @ ways.T, 0.0) * areas
            transfer[part] = (self.visible[part] * falling) @ basis
        contexts = np.tile(np.arange(len(bands)), len(transfer))

        def coded(step: float) -> bytes:
            codes = np.rint(transfer / step).astype(np.int64)
            codes[1:] -= codes[:-1].copy()
            return encode(codes.ravel(), contexts)

        low, high = 1e-4, 1.0
        for _ in range(16):
            step = math.sqrt(low * high)
            low, high = (step, high) if len(coded(step)) > budget else (low, step)
        code = coded(high)
        begin = time.perf_counter()
        codes = np.cumsum(decode(code, contexts).reshape(transfer.shape), axis=0)
        seconds = time.perf_counter() - begin
        lights = self.judged.falling @ harmonics_of(self.judged.ways)
        own = np.einsum("pk,pkb->pb", self.judged.shares, codes[self.judged.corners] * high)
        return {
            "file_bytes": len(code),
            "resident_bytes": transfer.size * (1 if np.abs(codes).max() < 128 else 2),
            "decode_s": seconds,
            "multiplications": float(len(bands)),
            "irradiance_db": _db(self.judged, np.maximum(own @ lights.T, 0.0) / self.judged.whole),
        }


def harmonics_of(ways: FloatArray) -> FloatArray:
    """Real orthonormal spherical harmonics (D, bands²) of unit vectors (D, 3)."""
    from scipy.special import sph_harm_y

    polar = np.arccos(np.clip(ways[:, 2], -1.0, 1.0))
    azimuth = np.arctan2(ways[:, 1], ways[:, 0])
    columns = []
    for band in range(_DEGREES):
        for order in range(-band, band + 1):
            value = sph_harm_y(band, abs(order), polar, azimuth)
            part = value.imag if order < 0 else value.real
            columns.append(part * (math.sqrt(2.0) if order else 1.0))
    return np.stack(columns, axis=1)


def rival_figures(
    stored: Callable[[str], xr.Dataset],
    relit: Callable[[DistancesAlong], dict[str, Any]],
    scale: str,
) -> dict[str, Any]:
    """`rivals`, rows by name, and what follows from them; at ``scale`` paper all rows.

    relit: of distances along axes, `relit_psnr_db` and `relight_fps`.
    """
    rows = _Rows(stored, relit)
    table = {
        "ours": rows.of_file(rows.file),
        **{f"bits_coding_{n}": rows.of_bits(n) for n in _BITS_ROWS},
        **rows.bits(),
        "no_shadows": {
            "file_bytes": 0,
            "resident_bytes": 0,
            "decode_s": 0.0,
            "multiplications": 0.0,
            **relit(_open_sky),
            "irradiance_db": irradiance_db(rows.judged, _open_sky),
        },
    }
    if scale == "paper":
        table |= _at_equal_bytes(rows)
    return {"rivals": table} | _at_equal_error(rows, table)


def _at_equal_bytes(rows: _Rows) -> dict[str, dict[str, Any]]:
    """One PCA, a basis that moves along the mesh, and harmonics, in the bytes of ours."""
    budget, count = len(rows.file), int(rows.cluster.max()) + 1
    near = clusters_by_position(rows.scene.vertices, rows.scene.triangles, count, 0).vertex
    return {
        "single_pca": rows.of_bytes(np.zeros(len(rows.cluster), np.int32), budget),
        "moving_basis": rows.of_bytes(near, budget),
        "harmonics": rows.harmonics(budget),
    }


def _open_sky(vertices: NDArray[np.int64], axes: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.full(axes.shape[:2], math.pi, np.float32)


def _at_equal_error(rows: _Rows, table: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Bytes of the bits over ours, at the coarsest of ours whose irradiance is not worse."""
    cluster = rows.cluster.astype(np.int32)
    factors = coding.cluster_factors(rows.basis, cluster)
    count = rows.basis.coordinates.shape[0] * rows.basis.vectors.shape[0]
    tried = []
    for step in _STEPS:
        codes = coding.quantise(rows.basis, cluster, factors, step)
        file = to_bytes(codes)
        tried.append(
            {
                "rmse": math.sqrt(coding.squared_error(rows.basis, codes) / count),
                "file_bytes": len(file),
                "irradiance_db": irradiance_db(rows.judged, Decoder.of_file(file).distances_along),
            }
        )
    found: dict[str, Any] = {"ours_by_step": tried}
    for name, rival in (("", "bits_as_distances"), ("_summed", "bits")):
        fit = [row for row in tried if row["irradiance_db"] >= table[rival]["irradiance_db"]]
        ours = min((row["file_bytes"] for row in fit), default=None)
        found[f"bits_bytes_ratio{name}"] = ours and table[rival]["file_bytes"] / ours
    return found
