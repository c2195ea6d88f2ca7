"""What the browser's decoder of SSDFs must find, by Python: viewer/tests/ssdf_lighting.json.

python -m tests.viewer.ssdf_fixture
"""

from __future__ import annotations

import base64
import hashlib
import json
from typing import Any

import numpy as np

from assets_defs.workspace import CHECKOUT
from pipelines.light.built_in_environments import sky
from pipelines.light.environment_maps import texel_directions
from pipelines.ssdf_lighting.compression.compact_file import compress, from_bytes
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.resident import resampled
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights
from pipelines.ssdf_lighting.drawing.pictures import cluster_colours
from pipelines.ssdf_lighting.drawing.stage_view import matt_rows
from pipelines.ssdf_lighting.light.cosine_lobes import cosine_lobes
from pipelines.ssdf_lighting.light.environment_fit import fit_lights
from pipelines.ssdf_lighting.light.interreflection import BounceFactors, bounced
from pipelines.ssdf_lighting.light.sphere_maps import downsampled
from pipelines.ssdf_lighting.light.spherical_gaussians import softened
from pipelines.ssdf_lighting.light.suns import split_suns

NAME = "ssdf_lighting.json"
_SIDE = 8
_VERTICES = 120
_SHARPNESS = [3.0, 40.0, 300.0]
_COLUMNS = [0, 100, 256, 300, 512]


def made_file() -> bytes:
    """A small file. Its last bits differ between processors: matrix products round otherwise."""
    random = np.random.default_rng(7)
    walk = np.cumsum(random.normal(size=(_VERTICES, _SIDE**2)), axis=1)
    matrix = np.asarray(walk.astype(np.float32) / 5, np.float32)
    triangles = np.stack([np.arange(_VERTICES - 2) + k for k in range(3)], axis=1)
    return compress(matrix, triangles, clusters=7, rmse=0.05)


def values(file: bytes) -> dict[str, Any]:
    """All values of a file, as JSON has them."""
    codes, decoder = from_bytes(file), Decoder.of_file(file)
    lobes = cosine_lobes(_SHARPNESS)
    environment = downsampled(sky(64, sun_azimuth=40.0, sun_elevation=35.0), 16)
    environment = environment.astype(np.float16).astype(np.float64)
    return {
        "file": base64.b64encode(file).decode(),
        "codes": _digest(
            *(codes.shared, codes.shared_level, codes.centre, codes.basis, codes.level),
            *(codes.ranks, codes.cluster, codes.weights),
        ),
        "step": codes.step,
        "root_weight": root_weights(_SIDE**2).tolist(),
        "distances": decoder.distances(np.arange(0, _VERTICES, 9)).round(6).tolist(),
        **_halved(),
        "sharpness": _SHARPNESS,
        "columns": _COLUMNS,
        "axes": np.stack([lobes.along, lobes.up], axis=-1)[:, _COLUMNS].tolist(),
        "matt": matt_rows(lobes)[:, ::256].tolist(),
        "colours": cluster_colours(6).tolist(),
        "environment": environment.ravel().tolist(),
        "irradiance_error": fit_lights(
            environment, 6, least_sharpness=3.0, most_sharpness=300.0
        ).errors.irradiance_error,
        "suns": _suns(),
        "bounce": _bounce(),
    }


def _suns() -> dict[str, Any]:
    """Two discs, the smaller one brighter, and what is found of them."""
    height, discs = 90, [[40.0, 30.0, 2.2, 900.0], [-100.0, 50.0, 1.6, 2000.0]]
    ways = texel_directions(height)
    radiance = np.full((height, 2 * height, 3), 0.5)
    for azimuth, elevation, radius, value in np.radians(discs) * [1, 1, 1, 180 / np.pi]:
        level = np.cos(elevation)
        axis = [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)]
        radiance[ways @ np.array(axis) > np.cos(radius)] += value * np.array([1.0, 0.8, 0.5])
    suns = split_suns(radiance, 4).suns
    soft = softened(suns, 0.006)
    return {
        "height": height,
        "discs": discs,
        **{name: values.tolist() for name, values in suns._asdict().items()},
        "soft_sharpness": soft.sharpness.tolist(),
        "soft_amplitudes": soft.amplitudes.tolist(),
    }


def _bounce() -> dict[str, Any]:
    """Small form factors, and what they make of light."""
    random = np.random.default_rng(3)
    factors = BounceFactors(
        random.integers(-20, 100, (6, 3)).astype(np.int8),
        np.array([0.002, 0.001, 0.003], np.float32),
        random.uniform(0.0, 0.5, (3, 4)).astype(np.float32),
        random.uniform(0.0, 0.4, (4, 3)).astype(np.float32),
        random.uniform(0.1, 0.8, (4, 3)).astype(np.float32),
        np.zeros((4, 2), np.int32),
    )
    direct = random.uniform(0.0, 2.0, (4, 2, 3))
    parts = {name: part.ravel().tolist() for name, part in factors._asdict().items()}
    found = bounced(factors, direct)
    return {**parts, "direct": direct.ravel().tolist(), "found": found.ravel().tolist()}


def _halved() -> dict[str, Any]:
    rows = np.random.default_rng(3).normal(size=(2, 256)).round(4).astype(np.float32)
    return {
        "halved_rows": rows.tolist(),
        "halved_root_weight": root_weights(256).tolist(),
        "halved": resampled(rows, 8).tolist(),
    }


def _digest(*arrays: Any) -> str:
    """SHA-256 of whole numbers after one another, 32 bits each."""
    whole = b"".join(np.ascontiguousarray(each, "<i4").tobytes() for each in arrays)
    return hashlib.sha256(whole).hexdigest()


if __name__ == "__main__":
    (CHECKOUT / "viewer" / "tests" / NAME).write_text(json.dumps(values(made_file())) + "\n")
