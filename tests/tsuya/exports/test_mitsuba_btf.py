"""The plug-in `tsuya_btf`: sampling, values, and a picture against the stage's."""

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from assets_defs.neural_btf.datasets import runtime_btf
from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import Camera, orbit
from pipelines.geometry.meshes import grid_triangles
from pipelines.light.directions import all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.compression import compress_photographs
from pipelines.neural_btf.draping.draped_cloth import DrapedCloth
from pipelines.neural_btf.draping.scene import camera_rays, scene_of, seen
from pipelines.neural_btf.material import surface_radiance
from pipelines.neural_btf.surface_lookup import in_frames
from pipelines.neural_btf.training.plan import TrainingPlan
from storage.btf_file import write_btf_file
from storage.packages import Mesh
from tests.btf_packages import random_file
from tests.storage.btf_file.page_decoder import PageFile
from tests.tsuya.exports.bsdf_sampling import draw, integrate, interaction, mitsuba, p_value
from tsuya.exports.mitsuba.btf import plug_in_arrays, write_btf_folder

VIEWS = unit_vectors(np.radians([[5, 0], [35, 130], [60, -70], [80, 20]]))
SIGNIFICANCE = 0.01
"""That a right plug-in fails any of the tests of a case."""


@functools.cache
def cloth() -> CompressedBtf:
    """Texels of several colours and slopes, matt and glossy."""
    rng = np.random.default_rng(4)
    pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))
    light, view = unit_vectors(pairs.light), unit_vectors(pairs.view)
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    normals = np.dstack([rng.uniform(-0.3, 0.3, (6, 8, 2)), np.ones((6, 8))])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    matt = np.maximum(np.einsum("nk,yxk->nyx", light, normals), 0.0)
    gloss = np.maximum(np.einsum("nk,yxk->nyx", half, normals), 0.0) ** 40
    photographs = matt[..., None] * (rng.uniform(0.1, 0.9, (6, 8, 3)) + gloss[..., None])
    return compress_photographs(photographs, pairs, plan=TrainingPlan(steps=150))


@pytest.fixture(scope="module")
def bsdf(tmp_path_factory: pytest.TempPathFactory) -> Any:
    mi = mitsuba()
    importlib.import_module("tsuya.exports.mitsuba.tsuya_btf")
    path = tmp_path_factory.mktemp("btf") / "data.npz"
    np.savez(path, **plug_in_arrays(cloth()))
    return mi.load_dict({"type": "tsuya_btf", "filename": str(path), "tiles": 2.0})


def test_samples_are_those_of_the_density(bsdf: Any) -> None:
    densities = [(si, integrate(bsdf, si).density) for si in map(interaction, VIEWS)]
    found = [(draw(bsdf, si, 6000, seed), density) for si, density in densities for seed in (1, 2)]
    bound = 1 - (1 - SIGNIFICANCE) ** (1 / len(found))
    assert all(p_value(drawn, density) > bound for drawn, density in found)
    # Its null: samples of one view are not those of another.
    assert p_value(found[0][0], found[4][1]) < 1e-6


def test_weights_are_value_over_density_and_keep_energy(bsdf: Any) -> None:
    mi = mitsuba()
    for view in VIEWS:
        si = interaction(view, uv=(0.3, 0.7))
        drawn, of_all = draw(bsdf, si, 6000, 5), integrate(bsdf, si)
        assert drawn.is_valid.all()
        assert of_all.density.sum() == pytest.approx(1.0, abs=2e-3)
        assert of_all.density[: len(of_all.density) // 2].sum() == 0  # below the surface
        for number in range(100):
            value, density = bsdf.eval_pdf(
                mi.BSDFContext(), si, mi.Vector3f(*drawn.directions[number])
            )
            assert density == pytest.approx(drawn.densities[number], rel=1e-4)
            assert np.allclose(np.array(value) / density, drawn.weights[number], rtol=1e-3)
        albedo = of_all.value.sum(axis=0)
        assert (albedo > 0).all()
        error = drawn.weights.std(axis=0) / math.sqrt(len(drawn.weights))
        assert (np.abs(drawn.weights.mean(axis=0) - albedo) < 4.5 * error + 0.005 * albedo).all()


def test_at_a_low_view_fitted_shares_leave_less_noise_than_the_cosine(bsdf: Any) -> None:
    rng = np.random.default_rng(0)
    (view,) = unit_vectors(np.radians([[70.0, 20.0]]))
    variance, by_cosine = [], []
    for _ in range(30):
        drawn = draw(bsdf, interaction(view, uv=rng.random(2)), 150, int(rng.integers(1 << 30)))
        weights = drawn.weights.mean(axis=1)
        variance.append(weights.var())
        # That of samples by the cosine, from these by their chances.
        chance = drawn.directions[:, 2] / np.pi / drawn.densities
        by_cosine.append(np.mean(weights**2 / chance) - np.mean(weights) ** 2)
    assert np.mean(variance) < 0.85 * np.mean(by_cosine)


def test_values_are_the_decoders(bsdf: Any) -> None:
    mi, btf, rng = mitsuba(), cloth(), np.random.default_rng(9)
    light, view = (
        unit_vectors(np.stack([np.arccos(rng.uniform(0.27, 1, 40)), rng.uniform(0, 6.28, 40)], -1))
        for _ in range(2)
    )
    uvs = rng.uniform(-1.5, 1.5, (40, 2))
    expected = np.maximum(btf.radiance_at(2 * uvs, light, view), 0) / np.pi
    swapped = np.maximum(btf.radiance_at(2 * uvs, view, light), 0) / np.pi
    context = mi.BSDFContext()
    found = np.array(
        [
            bsdf.eval(context, interaction(v, uv=uv), mi.Vector3f(*towards))
            for towards, v, uv in zip(light, view, uvs, strict=True)
        ]
    )
    assert np.allclose(found, expected, atol=1e-5)
    assert not np.allclose(found, swapped, atol=1e-2)
    below = interaction(-view[0])
    assert not np.array(bsdf.eval(context, below, mi.Vector3f(*light[0]))).any()


def test_values_are_those_of_the_page_of_the_file(tmp_path: Path) -> None:
    mi, file, rng = mitsuba(), random_file(channels=24), np.random.default_rng(2)
    page = PageFile(write_btf_file(file))
    np.savez(tmp_path / "data.npz", **plug_in_arrays(runtime_btf(file)))
    plugged = mi.load_dict({"type": "tsuya_btf", "filename": str(tmp_path / "data.npz")})
    found, expected = [], []
    for _ in range(40):
        light, view = unit_vectors(np.stack([rng.uniform(0, 1.3, 2), rng.uniform(0, 6, 2)], -1))
        uv = rng.uniform(-1.5, 1.5, 2)
        value = plugged.eval(mi.BSDFContext(), interaction(view, uv=uv), mi.Vector3f(*light))
        found.append(np.array(value) * np.pi)
        expected.append(page.radiance((float(uv[0]), float(uv[1])), light, view))
    assert np.allclose(found, expected, atol=2e-4)
    # Its nulls: bounds hold some and leave some; values differ from place to place.
    bounds = file.alpha * np.array([[file.least], [file.largest]])
    held = np.isclose(np.ravel(expected), bounds).any(axis=0).mean()
    assert 0.02 < held < 0.9
    assert not np.allclose(found, np.roll(expected, 1, axis=0), atol=0.1)


def folded_sheet(tiles: float, aspect: float) -> DrapedCloth:
    """2 wide and 1.5 high with soft folds along y; tiles over its width."""
    x, y = np.meshgrid(np.linspace(-1, 1, 160), np.linspace(-0.75, 0.75, 160))
    phase = 2.3 * math.pi * x
    slope = 0.05 * 2.3 * math.pi * np.cos(phase)
    one, none = np.ones_like(x), np.zeros_like(x)
    vectors = (
        np.stack(parts, axis=-1).reshape(-1, 3)
        for parts in ((x, y, 0.05 * np.sin(phase)), (-slope, none, one), (one, none, slope))
    )
    vertices, normals, tangents = vectors
    return DrapedCloth(
        vertices,
        grid_triangles(160, 160),
        normals / np.linalg.norm(normals, axis=1, keepdims=True),
        tangents / np.linalg.norm(tangents, axis=1, keepdims=True),
        np.stack([x, y / aspect], axis=-1).reshape(-1, 2) * tiles / 2,
    )


def drawn_sheet(
    btf: CompressedBtf, sheet: DrapedCloth, camera: Camera, size: tuple[int, int], light: Any
) -> Any:
    """Radiance (y, x, 3) under a directional light, 16 rays a pixel."""
    y, x = np.divmod(np.arange(16 * size[0] * size[1]), 4 * size[0])
    ways = camera_rays(camera, size, (np.stack([x, y], axis=-1) + 0.5) / 4)
    which, sights = seen(scene_of(sheet), camera, ways)
    towards = in_frames(sights.frame, np.broadcast_to(light, (len(which), 3)))
    fine = np.zeros((len(ways), 3))
    fine[which] = surface_radiance(btf, sights.places, towards, sights.view)
    return fine.reshape(size[1], 4, size[0], 4, 3).mean(axis=(1, 3))


@pytest.mark.reads_back("mitsuba")
def test_the_cloth_looks_like_the_stages(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    mi, btf, width, tiles = mitsuba(), cloth(), 96, 1.0
    importlib.import_module("tsuya.exports.mitsuba.tsuya_btf")
    sheet = folded_sheet(tiles, btf.height / btf.width)
    mesh = Mesh(sheet.vertices, sheet.triangles, sheet.normals, sheet.places)
    camera = orbit((0.0, 0.0, 0.0), 3.6, -90.0, 62.0, view_angle=24.0)
    lights = unit_vectors(np.radians([[50.0, 135.0], [50.0, 45.0]]))
    towards = lights[0].tolist()
    write_btf_folder(btf, mesh, tmp_path, camera=camera, light=towards, tiles=1.0, exposure=1.0)
    size = {"width": str(width), "height": str(width * 3 // 4), "samples": "16"}
    plugged = np.array(mi.render(mi.load_file(str(tmp_path / "scene.xml"), **size)), np.float64)
    inside = binary_erosion(plugged.max(axis=2) > 0, iterations=2)
    assert inside.mean() > 0.5
    shown = to_8bit(plugged * auto_exposure(plugged[inside].astype(np.float32))).astype(float)

    def psnr(light: int) -> float:
        linear = drawn_sheet(btf, sheet, camera, (width, width * 3 // 4), lights[light])
        own = to_8bit(linear * auto_exposure(linear[inside].astype(np.float32))).astype(float)
        return float(10 * np.log10(255**2 / np.mean((shown - own)[inside] ** 2)))

    figures = {"inside the cloth": psnr(0), "inside the cloth, null": psnr(1)}
    record_property("mitsuba_psnr_db", figures)
    assert psnr(0) >= 35
    assert psnr(1) < 25  # its null: the light a quarter further round
