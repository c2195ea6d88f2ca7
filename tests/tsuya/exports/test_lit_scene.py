"""Lit scenes exported: read back by trimesh, NumPy and OpenUSD."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_defs.ssdf_lighting.datasets import decoder_of
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.decoder_tables import decoded_rows
from storage.packages import Package, read_package
from storage.readers.bad_input import BadInput
from tests import lit_packages
from tsuya.exports import find_format
from tsuya.exports.lit_scene import write_glb, write_usd
from tsuya.exports.lit_tables import decoder_tables


@pytest.fixture(scope="module")
def package() -> Package:
    scene = lit_packages.scene(textured=True)
    return read_package(lit_packages.package_bytes(lit_packages.inputs(scene)))


@pytest.fixture
def plain() -> Package:
    packed = lit_packages.inputs(lit_packages.scene())
    return read_package(lit_packages.package_bytes(packed))


def _written(package: Package, name: str, folder: Path) -> Path:
    target = folder / name
    find_format(name, "ssdf_lighting").write(package, target)
    return target


def _faces(vertices: Any, faces: Any) -> Any:
    """Corners (F, 9) of triangles, in an order of their own."""
    corners = np.asarray(vertices, np.float64)[np.asarray(faces)].reshape(-1, 9)
    return corners[np.lexsort(corners.T)]


@pytest.mark.reads_back("glb")
def test_trimesh_reads_the_scene_as_it_is(package: Package, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    folder = _written(package, "glb", tmp_path)
    read = trimesh.load(folder / "scene.glb", force="scene", process=False)
    mesh = package.mesh("mesh")
    corners = []
    for name in read.graph.nodes_geometry:
        turn, geometry = read.graph[name]
        part = read.geometry[geometry]
        # y up in the file's world: back to z.
        world = trimesh.transform_points(part.vertices, turn)
        back = np.stack([world[:, 0], -world[:, 2], world[:, 1]], axis=1)
        corners.append(back[part.faces].reshape(-1, 9))
    found = np.concatenate(corners)
    expected = _faces(mesh.vertices, mesh.triangles)
    assert np.allclose(found[np.lexsort(found.round(5).T)].sum(0), expected.sum(0), atol=1e-3)
    assert len(found) == len(mesh.triangles)
    assert np.allclose(np.sort(found[:, 0]), np.sort(expected[:, 0]), atol=1e-6)


def test_the_skys_share_is_that_of_half_a_sky(package: Package, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    folder = _written(package, "glb", tmp_path)
    read = trimesh.load(folder / "scene.glb", force="scene", process=False)
    for part in read.geometry.values():
        share = part.vertex_attributes["_SKY"].ravel()
        # A normal n sees (1 + n·t) / 2 of the half space about t.
        seen = np.sum(np.asarray(part.vertex_normals) * lit_packages.tops(part.vertices), axis=1)
        assert np.abs(share - (1 + seen) / 2).max() < 0.02
    assert max(np.ptp(p.vertex_attributes["_SKY"]) for p in read.geometry.values()) > 0.5


def test_materials_and_textures_arrive(package: Package, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    folder = _written(package, "glb", tmp_path)
    read = trimesh.load(folder / "scene.glb", force="scene", process=False)
    materials = [part.visual.material for part in read.geometry.values()]
    (pot,) = (each for each in materials if each.baseColorTexture is not None)
    assert np.array_equal(np.asarray(pot.baseColorTexture), package.picture("map_000"))
    assert np.array_equal(np.asarray(pot.metallicRoughnessTexture), package.picture("map_001"))
    assert np.array_equal(np.asarray(pot.normalTexture), package.picture("map_002"))
    assert pot.metallicFactor == pytest.approx(0.5)
    assert pot.roughnessFactor == pytest.approx(0.6)
    (floor,) = (each for each in materials if each.baseColorTexture is None)
    assert floor.metallicFactor == 0
    assert floor.roughnessFactor == pytest.approx(0.3**0.5)


def test_texels_of_distances_decode_to_them(plain: Package, tmp_path: Path) -> None:
    folder = _written(plain, "glb", tmp_path)
    with np.load(folder / "distances.npz") as read:
        side, sources = int(read["side"]), read["sources"].astype(int)
        vectors, weights = read["vectors"].astype(np.float32), read["weights"]
    decoder = Decoder.of_file(plain.array("ssdf").tobytes())
    expected = decoder.distances(np.arange(len(sources)))
    for vertex in (0, 7, len(sources) - 1):
        start, width, first, _ = sources[vertex]
        table = vectors[start : start + width * side**2].reshape(side**2, 4 * width)
        found = table @ weights[first : first + width].ravel()
        assert np.abs(found - expected[vertex]).max() < 5e-3  # of halfs
    names = {path.name for path in (folder / "glsl").iterdir()}
    assert {"lit_distances.glsl", "octahedral.glsl", "sg_visibility.glsl"} <= names


def test_the_papers_form_is_decoded_too() -> None:
    packed = lit_packages.inputs(lit_packages.scene(), paper=True)
    package = read_package(lit_packages.package_bytes(packed))
    assert "ssdf" not in package.parts
    rows = np.arange(0, packed.scene_mesh.sizes["vertex"], 7)
    found = decoded_rows(decoder_tables(package), rows)
    expected = decoder_of(packed.ssdf_basis).distances(rows)
    assert np.abs(found - expected).max() < 0.02  # of halfs
    assert np.abs(found[1:] - expected[:-1]).max() > 0.1


@pytest.mark.reads_back("usd")
def test_usd_is_read_by_openusd(package: Package, tmp_path: Path) -> None:
    pxr = pytest.importorskip("pxr")
    from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade

    assert pxr
    folder = _written(package, "usd", tmp_path)
    stage = Usd.Stage.Open(str(folder / "scene.usda"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    mesh, given = UsdGeom.Mesh(stage.GetPrimAtPath("/Scene/Surfaces")), package.mesh("mesh")
    assert np.array_equal(np.array(mesh.GetPointsAttr().Get()), given.vertices)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get())
    assert np.array_equal(corners.reshape(-1, 3), given.triangles)
    assert np.array_equal(np.array(mesh.GetNormalsAttr().Get()), given.normals)
    subsets = UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets()
    assert sum(len(each.GetIndicesAttr().Get()) for each in subsets) == len(given.triangles)
    for subset in subsets:
        bound, _ = UsdShade.MaterialBindingAPI(subset).ComputeBoundMaterial()
        surface, *_ = bound.ComputeSurfaceSource()
        assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
    pot = UsdShade.Shader(stage.GetPrimAtPath("/Scene/Materials/Material0/Surface"))
    source = pot.GetInput("diffuseColor").GetConnectedSources()[0][0].source
    path = UsdShade.Shader(source.GetPrim()).GetInput("file").Get().resolvedPath
    assert np.array_equal(_png(path), package.picture("map_000"))
    dome = UsdLux.DomeLight(stage.GetPrimAtPath("/Scene/Environment"))
    turn = dome.ComputeLocalToWorldTransform(0)
    assert turn.TransformDir(Gf.Vec3d(0, 1, 0)) == Gf.Vec3d(0, 0, 1)  # the pole is up
    assert turn.TransformDir(Gf.Vec3d(0, 0, 1)) == Gf.Vec3d(1, 0, 0)  # the middle is azimuth 0
    assert turn.TransformDir(Gf.Vec3d(1, 0, 0)) == Gf.Vec3d(0, 1, 0)  # a quarter from the left: 90
    exr = dome.GetTextureFileAttr().Get().resolvedPath
    assert np.allclose(_exr(exr), package.array("environment"), rtol=1e-3)


@pytest.mark.parametrize("write", [write_glb, write_usd])
def test_a_package_of_before_is_refused(package: Package, tmp_path: Path, write: Any) -> None:
    """Schema 1 has no reflected light."""
    old = read_package(package.whole(), "old.tsuya")
    old.meta["schema"] = 1
    with pytest.raises(BadInput, match=r"old.tsuya: schema .* 1.*make the package again"):
        write(old, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def _png(path: str) -> Any:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(Path(path).read_bytes())).convert("RGB"))


def _exr(path: str) -> Any:
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    return np.array(mitsuba.Bitmap(path))
