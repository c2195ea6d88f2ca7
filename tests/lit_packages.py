"""Lit scenes whose distances are known by hand, as the datasets that a package is made of."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from assets_defs.ssdf_lighting import package as lit
from assets_defs.ssdf_lighting.datasets import (
    bounce_dataset,
    file_variables,
    lights_dataset,
    pca_variables,
    scene_dataset,
)
from pipelines.drawing.stage import Camera
from pipelines.light.built_in_environments import sky
from pipelines.ssdf_lighting.compression.clustered_pca import clustered_pca
from pipelines.ssdf_lighting.compression.compact_file import compress
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.drawing.live_parts import ReferenceView
from pipelines.ssdf_lighting.light.environment_fit import Fit
from pipelines.ssdf_lighting.light.fit_quality import FitErrors
from pipelines.ssdf_lighting.light.interreflection import BounceFactors
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import Scene, built_in_scene
from pipelines.ssdf_lighting.surface_textures import SurfaceTextures, Texture, TexturedMaterial
from storage.packages import write_package
from storage.packages.ssdf_lighting import PACKAGE

KEYS = {"scene": "mine", "environment": "sky"}
LIGHTS = Lights(
    np.array(
        [[0.6, 0.0, 0.8], [0.0, -0.8, 0.6], [-0.6, 0.64, 0.48], [0.0, 0.0, 1.0], [0.8, 0, 0.6]]
    ),
    np.array([120.0, 8.0, 4.0, 3.0, 30.0]),
    np.array(
        [[60.0, 50.0, 40.0], [0.5, 0.6, 0.9], [0.4, 0.4, 0.6], [0.3, 0.3, 0.3], [1.0, 2.0, 0.5]]
    ),
)


def scene(*, textured: bool = False) -> Scene:
    """A small teapot on a floor; ``textured``: the pot with all three textures."""
    made = built_in_scene("teapot", 4, 8)
    materials = Materials(
        made.materials.albedo, np.array([0.05, 0.0]), np.array([0.3, 0.3]), np.ones((2, 3))
    )
    if not textured:
        return made._replace(materials=materials)
    random = np.random.default_rng(3)
    places = made.vertices[made.triangles][..., :2].astype(np.float32)
    uvs = np.stack([places, 2 * places], axis=2)
    coarse = random.integers(60, 220, (8, 8, 3)).repeat(8, 0).repeat(8, 1).astype(np.uint8)
    bumps = np.full((64, 64, 3), (128, 128, 250), np.uint8)
    bumps[::8, :, :2] = 90
    pot = TexturedMaterial(
        0,
        (0.9, 0.8, 0.7),
        0.5,
        (0.04, 0.04, 0.04),
        0.6,
        Texture(coarse, ("mirror", "repeat")),
        Texture(coarse[::-1].copy(), ("clamp", "mirror"), 1),
        Texture(bumps),
        0.7,
    )
    colours = np.ones((*made.triangles.shape, 3), np.float32)
    return made._replace(materials=materials, textures=SurfaceTextures(uvs, colours, (pot,)))


def tops(places: np.ndarray) -> np.ndarray:
    """The middles (V, 3) of the halves of the sky that are seen at places (V, 3)."""
    leaning = places * [8.0, 8.0, 0.0] + [0.0, 0.0, 1.0]
    return np.asarray(leaning / np.linalg.norm(leaning, axis=1, keepdims=True))


def distances(lit_scene: Scene, n: int = 32) -> np.ndarray:
    """(V, n²): half of the sky is hidden, behind a plane that leans with the place."""
    height = tops(lit_scene.vertices) @ texel_directions(n).T
    return np.arcsin(np.clip(height, -1.0, 1.0)).astype(np.float32)


def bounce_factors(lit_scene: Scene, patches: int = 3) -> BounceFactors:
    """Patches of no surface that light all vertices, more where these are higher."""
    height = lit_scene.vertices[:, 2:]
    codes = np.rint(np.clip(60 + 60 * height * [[1.0, -1.0]], 0, 127)).astype(np.int8)
    count = len(codes)
    return BounceFactors(
        codes,
        np.full(2, 0.004, np.float32),
        np.linspace(0.2, 0.6, 2 * patches, dtype=np.float32).reshape(2, patches),
        np.full((patches, 2), 0.1, np.float32),
        np.linspace(0.2, 0.8, 3 * patches, dtype=np.float32).reshape(patches, 3),
        np.linspace(0, count - 1, 4 * patches).astype(np.int32).reshape(patches, 4),
    )


def inputs(lit_scene: Scene, n: int = 32, *, paper: bool = False) -> Any:
    """What the package's asset packs; ``paper``: the distances in the paper's form."""
    matrix, corners = distances(lit_scene, n), lit_scene.triangles
    if paper:
        of_triangle = np.arange(len(corners)) % 5
        pca = clustered_pca(lambda rows: matrix[rows], corners, of_triangle, values=8)
        variables = pca_variables(pca)
    else:
        variables = file_variables(compress(matrix, corners, clusters=24, rmse=0.01))
    basis = xr.Dataset(
        {
            **variables,
            **{f"bytes_{name}": ((), np.int64(0)) for name in ("raw", "file", "memory")},
            "rmse": ((), 0.01),
            "wrong_visibility": ((), 0.0),
            "vertex_rmse": (("vertex",), np.zeros(len(matrix), np.float32)),
        }
    )
    cluster = np.arange(len(lit_scene.triangles)) % 3
    return lit._Inputs(
        scene_dataset(lit_scene, "mine"),
        xr.Dataset({"cluster": (("triangle",), cluster.astype(np.int32))}),
        basis,
        bounce_dataset(bounce_factors(lit_scene)),
        lights_dataset(
            sky(64, sun_azimuth=40.0, sun_elevation=35.0),
            Fit(LIGHTS, FitErrors(0.1, 0.1, 0.01, 0.01)),
            0.0,
            "sky",
        ),
        0.5,
    )


def flat_pictures() -> Any:
    """Pictures that no stage has drawn."""
    grey = np.full((6, 8, 3), 128, np.uint8)
    camera = Camera((3.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    return lit._Pictures(camera, [ReferenceView("turn_0", grey, 0.0, True, False)], grey)


def package_bytes(packed: Any, pictures: Any | None = None) -> bytes:
    """The package of what ``inputs`` made."""
    settings = lit.LitPackageSettings()
    made = flat_pictures() if pictures is None else pictures
    return write_package(PACKAGE, lit._contents(settings, KEYS, [], packed, made))
