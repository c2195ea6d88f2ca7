"""A BTF as glTF and MaterialX, scratched glass as MaterialX: read back by other libraries."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from assets_defs.neural_btf.package import packed_numbers, packed_parameters
from pipelines.glass_scratches.tables.glass_table import glass_table
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.light.directions import all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.svbrdf_fit import svbrdf_errors
from storage.btf_file import BtfFile
from tests.tsuya.exports.test_mitsuba_btf import cloth
from tsuya.exports import materialx, svbrdf
from tsuya.exports.packaged_btf import packaged_btf
from tsuya.exports.svbrdf import svbrdf_of_pictures

SIDE = 5


class Stand:
    """As much of a package as these formats ask for."""

    name = "stand.tsuya"

    def __init__(self) -> None:
        btf, corner = cloth(), np.linspace(-1, 1, SIDE)
        self.meta = {
            "schema": 2,
            "title": "cloth <6 & 8>",
            "figures": [{"name": "RMSE over alpha", "value": 0.0123}],
        }
        file = BtfFile(btf.decoder, btf.latents, 6, 8, btf.alpha, parallax=btf.parallax)
        self.values = packed_numbers(file) | {"table": np.ones((1, 32, 32), np.float16)}
        self.parameters = packed_parameters(file) | {
            "tiles": 2.0, "refractive_index": 1.4,
        }  # fmt: skip
        x, y = (axis.ravel() for axis in np.meshgrid(corner, corner))
        flat = np.stack([x, y, 0.1 * x * y], axis=1).astype(np.float32)
        self.cloth = _grid(flat)

    @property
    def parts(self) -> tuple[str, ...]:
        """Names."""
        return tuple(self.values)

    def array(self, name: str) -> Any:
        """An array."""
        return self.values[name]

    def parameter(self, name: str) -> Any:
        """A parameter."""
        return self.parameters[name]

    def mesh(self, name: str) -> Any:
        """The cloth."""
        assert name == "cloth"
        return self.cloth

    def textures(self, name: str) -> Any:
        """Two layers."""
        assert name == "coverage"
        return (np.arange(2 * 4 * 4, dtype=np.uint8) * 7).reshape(2, 4, 4, 1)


def _grid(vertices: Any) -> Any:
    from storage.packages import Mesh

    corner = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.uint32)
    up = np.tile(np.float32([0, 0, 1]), (len(vertices), 1))
    along = np.tile(np.float32([1, 0, 0]), (len(vertices), 1))
    uvs = (vertices[:, :2] + 1) / 2
    return Mesh(vertices, triangles, up, uvs.astype(np.float32), {"TANGENT": along})


@functools.cache
def package() -> Any:
    return Stand()


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tuple[str, ...]]:
    folder = tmp_path_factory.mktemp("gltf") / "cloth"
    return folder, tuple(svbrdf.write_gltf(package(), folder))


@pytest.mark.reads_back("gltf")
def test_gltf_is_read_by_trimesh(written: tuple[Path, tuple[str, ...]]) -> None:
    import trimesh

    folder, _ = written
    scene = trimesh.load(folder / "cloth.glb")
    (shape,) = scene.geometry.values()
    ours = package().cloth
    assert np.allclose(shape.vertices, ours.vertices)
    assert np.array_equal(shape.faces, ours.triangles)
    # trimesh counts v from the bottom, as we do.
    assert np.allclose(shape.visual.uv, 2.0 * ours.uvs, atol=1e-6)
    found = shape.visual.material
    maps = [
        np.asarray(picture.convert("RGB"))
        for picture in (
            found.baseColorTexture, found.metallicRoughnessTexture, found.normalTexture,
        )
    ]  # fmt: skip
    for codes, name in zip(maps, ("base_colour", "surface", "normal"), strict=True):
        assert np.array_equal(codes, np.asarray(Image.open(folder / f"{name}.png")))
    upright = scene.to_geometry().vertices
    assert np.allclose(upright[:, 1], ours.vertices[:, 2], atol=1e-6)  # y up


def test_the_error_is_that_of_what_was_written(written: tuple[Path, tuple[str, ...]]) -> None:
    import trimesh

    folder, notes = written
    (shape,) = trimesh.load(folder / "cloth.glb").geometry.values()
    pictures = [
        np.asarray(Image.open(folder / f"{name}.png"))
        for name in ("base_colour", "surface", "normal")
    ]
    btf = packaged_btf(package())
    pairs = all_pairs(hemisphere_table(41), hemisphere_table(41))
    values = btf.abrdfs(0, btf.texels, direction_inputs(pairs)) * btf.alpha
    ways = unit_vectors(pairs.light), unit_vectors(pairs.view)
    found = svbrdf_errors(svbrdf_of_pictures(*pictures), values, *ways, btf.alpha)
    maps = svbrdf.svbrdf_maps(package())
    assert maps.errors.rmse == pytest.approx(found.rmse, rel=0.2)  # other pairs of directions
    assert maps.errors.rmse < 0.6 * maps.errors.flat_rmse
    text = (folder / "errors.txt").read_text()
    assert text.splitlines() == list(notes)
    for error in (maps.errors.rmse, maps.errors.flat_rmse, 0.0123):
        assert f"{error:.4f}" in text
    # Its null: texels dealt at random.
    order = np.random.default_rng(0).permutation(btf.texels)
    wrong = [codes.reshape(-1, 3)[order].reshape(codes.shape) for codes in pictures]
    assert svbrdf_errors(svbrdf_of_pictures(*wrong), values, *ways, btf.alpha).rmse > 1.3 * (
        found.rmse
    )
    assert shape.visual.material.name == "cloth <6 & 8>"


def read_materialx(path: Path) -> Any:
    """A document with the standard's libraries; fails where it is not valid."""
    mx = pytest.importorskip("MaterialX")
    library, document = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    mx.readFromXmlFile(document, str(path))
    document.setDataLibrary(library)
    is_valid, why = document.validate()
    assert is_valid, why
    assert document.getMaterialNodes()
    return document


@pytest.mark.reads_back("materialx")
def test_materialx_of_cloth_is_valid_and_names_its_maps(tmp_path: Path) -> None:
    notes = materialx.write_cloth(package(), tmp_path)
    assert "RMSE over alpha" in notes[0]
    document = read_materialx(tmp_path / "material.mtlx")
    for node, file in (
        ("base_colour", "base_colour.png"),
        ("surface_codes", "surface.png"),
        ("normal_codes", "normal.png"),
    ):
        value = document.getNode(node).getInputValue("file")
        assert value == file
        assert (tmp_path / value).is_file()
    surface = document.getNode("surface")
    assert surface.getConnectedNode("specular_roughness").getInputValue("index") == 1  # green
    assert surface.getConnectedNode("metalness").getInputValue("index") == 2  # blue
    assert surface.getConnectedNode("normal").getCategory() == "normalmap"
    broken = (tmp_path / "material.mtlx").read_text().replace("specular_roughness", "shininess")
    (tmp_path / "broken.mtlx").write_text(broken)
    with pytest.raises(AssertionError):
        read_materialx(tmp_path / "broken.mtlx")


@pytest.mark.reads_back("materialx")
def test_materialx_of_glass_is_rough_where_scratches_are(tmp_path: Path) -> None:
    materialx.write_glass(package(), tmp_path)
    document = read_materialx(tmp_path / "material.mtlx")
    surface = document.getNode("surface")
    assert surface.getInputValue("specular_IOR") == pytest.approx(1.4)
    assert surface.getInputValue("transmission") == 1.0
    rough = surface.getConnectedNode("specular_roughness")
    assert rough.getInputValue("in2") == pytest.approx(1.0)  # the stand-in's table is even
    codes = np.asarray(Image.open(tmp_path / "coverage.png"))
    one, two = package().textures("coverage")[..., 0] / 255
    assert np.abs(codes[::-1] / 255 - (1 - (1 - one) * (1 - two))).max() <= 0.5 / 255 + 1e-9


@pytest.mark.parametrize("depth", [1.0, 2.0])
def test_roughness_is_that_of_the_walls_slopes(depth: float) -> None:
    """Clear walls of a shallow groove: its slope is alpha, the roughness squared."""
    groove = built_in_profile("v", 10.0, depth)
    table = glass_table(groove, bins=64, index=1.5, roughness=0.0, rays=500)
    found = materialx.scratch_roughness(table.rho[0], 1.5)
    assert found == pytest.approx((depth / 5.0) ** 0.5, rel=0.04)
