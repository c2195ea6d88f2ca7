"""The plug-in `tsuya_scratches`: sampling, energy, and pictures against the path tracer."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import orbit
from pipelines.geometry.solid_shapes import plate
from pipelines.glass_scratches.drawing.path_tracing import trace_picture
from pipelines.glass_scratches.layers.scratch_layers import make_layers
from pipelines.glass_scratches.layers.settings import LayerSpec
from pipelines.glass_scratches.scratched_glass import (
    ScratchMaterial,
    scratch_material,
    scratched_glass,
)
from pipelines.glass_scratches.tables.bsdf_table import BsdfTable
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.lobe import Direction, make_lobe
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.glass_scratches.tables.sampling import evaluate, pdf
from pipelines.light.environment_sampling import make_environment_sampler
from tests.tsuya.exports.bsdf_sampling import draw, integrate, interaction, mitsuba, p_value
from tsuya.exports.mitsuba.folder import SIZES_XML, sensor_xml, write_folder, write_ply
from tsuya.exports.mitsuba.scratches import SCENE, write_environment

TILE = 1.0
VIEWS = np.array([[0.3, 0.2, 0.9], [-0.8, 0.4, 0.35], [0.1, -0.5, -0.8], [0.6, 0.5, -0.3]])
SIGNIFICANCE = 0.01
"""That a right plug-in fails any of the tests of a case."""


@functools.cache
def material(roughness: float) -> ScratchMaterial:
    profile = built_in_profile("v", 10.0, 4.0)
    table = glass_table(profile, bins=16, index=1.5, roughness=roughness, facets=60, rays=4000)
    layers = make_layers(LayerSpec(length=0.4, width=0.04, coverage=0.15, layers=2), seed=2)
    return scratch_material(table, layers, resolution=64)


def arrays(of: ScratchMaterial) -> dict[str, Any]:
    return {
        "table": of.table.rho.astype(np.float32),
        "leans": of.table.leans.astype(np.float32),
        "keeps": np.array(of.table.keeps, np.float64),
        "angles": of.layers.angle,
        "coverage": np.rint(of.coverage * 255).astype(np.uint8),
        "index": of.table.refractive_index,
        "tile": TILE,
    }


def plug_in() -> Any:
    mitsuba()
    return importlib.import_module("tsuya.exports.mitsuba.tsuya_scratches")


def loaded(folder: Path, roughness: float) -> Any:
    mi = mitsuba()
    plug_in()
    np.savez(folder / "data.npz", **arrays(material(roughness)))
    return mi.load_dict({"type": "tsuya_scratches", "filename": str(folder / "data.npz")})


def points(bsdf: Any) -> list[tuple[Any, float]]:
    """Views from both sides of places with scratches, and the square of the index around each."""
    rng, found = np.random.default_rng(3), []
    squared = material(1.0).table.refractive_index ** 2
    for view in VIEWS / np.linalg.norm(VIEWS, axis=1, keepdims=True):
        clear = 1.0
        while clear > 0.8:
            si = interaction(view, place=(*rng.random(2), 0.0))
            clear, _ = bsdf.glass.lobes(list(si.p), list(si.n), si.sh_frame)
        found.append((si, 1.0 if view[2] > 0 else squared))
    return found


@pytest.fixture
def wide_lobes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where walls keep the lean its lobe is too narrow for integrals over the sphere."""
    monkeypatch.setattr(plug_in(), "_BLUR", 0.15)


@pytest.mark.slow
@pytest.mark.parametrize("roughness", [1.0, 0.4])
@pytest.mark.usefixtures("wide_lobes")
def test_samples_are_those_of_the_density(roughness: float, tmp_path: Path) -> None:
    bsdf = loaded(tmp_path, roughness)
    densities = [(si, integrate(bsdf, si).density) for si, _ in points(bsdf)]
    found = [(draw(bsdf, si, 6000, seed), density) for si, density in densities for seed in (1, 2)]
    bound = 1 - (1 - SIGNIFICANCE) ** (1 / len(found))
    assert all(p_value(drawn, density) > bound for drawn, density in found)
    # Its null: samples of one view are not those of another.
    assert p_value(found[0][0], found[2][1]) < 1e-6


@pytest.mark.parametrize("roughness", [1.0, 0.4])
@pytest.mark.usefixtures("wide_lobes")
def test_weights_are_value_over_density_and_all_light_goes_somewhere(
    roughness: float, tmp_path: Path
) -> None:
    mi, bsdf = mitsuba(), loaded(tmp_path, roughness)
    for si, squared in points(bsdf):
        drawn, of_all = draw(bsdf, si, 6000, 5), integrate(bsdf, si)
        scattered = drawn.is_valid & ~drawn.is_delta
        for number in np.flatnonzero(scattered)[:200]:
            wo = mi.Vector3f(*drawn.directions[number])
            value, density = bsdf.eval_pdf(mi.BSDFContext(), si, wo)
            assert density == pytest.approx(drawn.densities[number], rel=1e-4)
            assert np.allclose(np.array(value) / density, drawn.weights[number], rtol=1e-3)
        assert of_all.density.sum() + drawn.is_delta.mean() == pytest.approx(1.0, abs=0.02)
        mean = (drawn.weights * scattered[:, None]).mean(axis=0)
        assert np.allclose(mean, of_all.value.sum(axis=0), atol=0.03)
        # In a white furnace radiance is the square of the index: 1 outside.
        around = np.where(
            drawn.directions[:, 2] > 0, 1.0, material(1.0).table.refractive_index ** 2
        )
        assert (drawn.weights[:, 0] * around).mean() == pytest.approx(squared, rel=0.03)


def directions(count: int, seed: int) -> NDArray[np.float64]:
    found = np.random.default_rng(seed).normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def of_mean(table: BsdfTable) -> Any:
    """The tracer's lobe with one place: the mean across the opening."""
    return make_lobe(table._replace(across=table.rho[:, None].astype(np.float32)))


def along_lights(view: NDArray[np.float64], *, keeps: bool) -> NDArray[np.float64]:
    """Lights (n, 3), all around, or with about the view's lean mirrored."""
    if not keeps:
        return directions(40, 8)
    index = material(1.0).table.refractive_index
    lean = -view[0] * (index if view[2] < 0 else 1.0)
    made = []
    for n, (turn, off) in enumerate(np.random.default_rng(8).random((40, 2))):
        u = (lean + 0.02 * (off - 0.5)) / (index if n % 2 else 1.0)
        if abs(u) < 1:
            angle, rest = np.pi * (turn - 0.5), np.sqrt(1 - u * u)
            up = -1 if n % 2 else 1
            made.append((u, rest * np.sin(angle), up * rest * np.cos(angle)))
    return np.array(made)


@pytest.mark.parametrize("roughness", [1.0, 0.4, 0.0])
def test_a_scratch_scatters_as_the_tracers_does(roughness: float, tmp_path: Path) -> None:
    bsdf, table = loaded(tmp_path, roughness), material(roughness).table
    lobe, scratch = of_mean(table), plug_in().Lobe(1.0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    met = 0
    for view in directions(12, 7):
        for light in along_lights(view, keeps=table.keeps):
            ours = [f(lobe, 0, Direction(*view), Direction(*light)) for f in (evaluate, pdf)]
            found = bsdf.glass.scattered(scratch, tuple(view), tuple(light))
            assert np.allclose(found, ours, rtol=2e-3, atol=1e-5)
            met += ours[0] > 1e-3
    assert met > 40


@pytest.mark.parametrize("roughness", [1.0, 0.4])
def test_light_and_view_may_be_swapped(roughness: float, tmp_path: Path) -> None:
    """Radiance over n² of a beam is the same both ways, but for the bins that the plug-in steps
    between and, where the lean is kept, the tables of two leans."""
    bsdf, table = loaded(tmp_path, roughness), material(roughness).table
    scratch = plug_in().Lobe(1.0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    pairs = []
    for view in directions(12, 9):
        for light in along_lights(view, keeps=table.keeps):
            one = bsdf.glass.scattered(scratch, tuple(view), tuple(light))[0]
            other = bsdf.glass.scattered(scratch, tuple(light), tuple(view))[0]
            sides = [abs(way[2]) * (1.0 if way[2] > 0 else 1.5**2) for way in (light, view)]
            pairs.append((one / sides[0], other / sides[1]))
    one, other = np.array(pairs).T
    assert np.abs(one - other).max() < 0.02 * one.max()
    assert one.max() > 0.05


def test_what_it_cannot_do_is_refused(tmp_path: Path) -> None:
    mi, bsdf = mitsuba(), loaded(tmp_path, 1.0)
    si = points(bsdf)[0][0]
    with pytest.raises(RuntimeError, match="particle"):
        bsdf.eval(mi.BSDFContext(mi.TransportMode.Importance), si, mi.Vector3f(0, 0, 1))


# ---- pictures --------------------------------------------------------------------------------

SIZE = (20, 15)
PLATE = plate(1.6, 1.2, 0.12)
CAMERA = orbit((0.0, 0.0, 0.0), 2.9, -68.0, 20.0, view_angle=30.0)


def evening() -> NDArray[np.float32]:
    """A soft environment: light from above and from one side, warm and cold."""
    rows, columns = 128, 256
    z = np.cos(np.pi * (np.arange(rows) + 0.5) / rows)[:, None, None]
    around = np.cos(2 * np.pi * (np.arange(columns) + 0.5) / columns)[None, :, None]
    warm, cold = np.array([0.9, 0.5, 0.25]), np.array([0.25, 0.4, 0.7])
    light = ((1 + z) / 2) ** 4 * warm + ((1 + around * np.sqrt(1 - z * z)) / 2) ** 4 * cold
    return light.astype(np.float32)


def plugged_picture(folder: Path, of: ScratchMaterial, samples: int) -> NDArray[np.float64]:
    mi = mitsuba()
    plug_in()
    solid = PLATE
    scene = SCENE.format(sizes=SIZES_XML, sensor=sensor_xml(CAMERA), scale=1.0)
    write_folder(folder, "tsuya_scratches", arrays(of), scene)
    write_environment(folder / "environment.exr", evening())
    corners = np.asarray(solid.vertices)[solid.triangles].reshape(-1, 3)
    order = np.arange(len(corners)).reshape(-1, 3)
    write_ply(folder / "object.ply", corners, order, solid.corner_normals.reshape(-1, 3))
    width, height = map(str, SIZE)
    options = {"width": width, "height": height, "samples": str(samples)}
    return np.array(mi.render(mi.load_file(str(folder / "scene.xml"), **options)), np.float64)


def own_picture(of: ScratchMaterial, samples: int) -> NDArray[np.float32]:
    glass = scratched_glass(PLATE, of, tile=TILE)
    return trace_picture(
        glass.solid,
        glass.surface,
        make_environment_sampler(evening()),
        CAMERA,
        width=SIZE[0],
        height=SIZE[1],
        samples=samples,
    ).radiance


def psnr(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Of 8-bit sRGB pictures."""
    step = to_8bit(one).astype(float) - to_8bit(other)
    return float(10 * np.log10(255**2 / np.mean(step**2)))


@pytest.mark.slow
@pytest.mark.reads_back("mitsuba")
def test_the_plate_looks_like_the_path_tracers(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    plugged = plugged_picture(tmp_path, material(1.0), 256)
    found = psnr(plugged, own_picture(material(1.0), 1024))
    null = psnr(plugged, own_picture(material(0.4), 256))  # other walls
    record_property("mitsuba_psnr_db", {"scratched plate": found, "scratched plate, null": null})
    assert found >= 35
    assert null < 30
