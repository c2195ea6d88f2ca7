"""What is written into packages, read by other libraries."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from storage.packages import Mesh, View, write_package
from storage.packages.conformance import SMALL, small_contents
from storage.readers.meshes import read_mesh


@pytest.fixture(scope="module")
def archive() -> zipfile.ZipFile:
    return zipfile.ZipFile(io.BytesIO(write_package(SMALL, small_contents())))


def test_the_same_contents_make_the_same_bytes() -> None:
    assert write_package(SMALL, small_contents()) == write_package(SMALL, small_contents())
    assert write_package(SMALL, small_contents()) != write_package(SMALL, small_contents(1))


def test_arrays_lie_in_little_endian_order(archive: zipfile.ZipFile) -> None:
    expected = small_contents().values["int16"]
    stored = archive.read("int16.bin")
    assert [
        int.from_bytes(stored[2 * i : 2 * i + 2], "little", signed=True) for i in range(35)
    ] == expected.reshape(-1).tolist()


@pytest.mark.reads_back("tsuya")
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_pictures_are_pngs_without_profile_or_gamma(
    archive: zipfile.ZipFile, channels: int
) -> None:
    picture = Image.open(io.BytesIO(archive.read(f"picture_{channels}.png")))
    codes = np.asarray(picture).reshape(9, 8, channels)
    assert np.array_equal(codes, small_contents().values[f"picture_{channels}"])
    assert not {"gamma", "srgb", "icc_profile"} & set(picture.info)


def test_a_mesh_stands_upright_in_another_program(archive: zipfile.ZipFile) -> None:
    mesh: Mesh = small_contents().values["mesh"]
    scene = trimesh.load(io.BytesIO(archive.read("mesh.glb")), file_type="glb")
    (found,) = scene.dump()
    x, y, z = mesh.vertices.T
    assert np.allclose(found.vertices, np.stack([x, z, -y], axis=1), atol=1e-6)
    assert np.array_equal(found.faces, mesh.triangles)
    assert np.allclose(found.vertex_attributes["_LAYER"].ravel(), mesh.attributes["LAYER"])


def test_texture_coordinates_are_those_of_a_reader_of_gltf(
    archive: zipfile.ZipFile, tmp_path: Path
) -> None:
    (tmp_path / "mesh.glb").write_bytes(archive.read("mesh.glb"))
    mesh: Mesh = small_contents().values["mesh"]
    uvs = read_mesh(tmp_path / "mesh.glb").uvs
    assert uvs is not None
    assert mesh.uvs is not None
    assert np.allclose(uvs, mesh.uvs, atol=1e-6)


def test_layers_of_texels_follow_the_specification(archive: zipfile.ZipFile) -> None:
    content = archive.read("halfs.ktx2")
    words = np.frombuffer(content[12:48], "<u4")
    # VK_FORMAT_R16G16_SFLOAT, size of a component, width, height, depth, layers, faces, levels
    assert words.tolist() == [83, 2, 6, 4, 0, 3, 1, 1, 0]
    start, length = np.frombuffer(content[80:96], "<u8").tolist()
    assert start % 4 == 0
    assert start + length == len(content)
    texels = np.frombuffer(content[start:], "<f2").reshape(3, 4, 6, 2)
    assert np.array_equal(texels, small_contents().values["halfs"])
    described = int.from_bytes(content[48:52], "little")
    model, primaries, transfer = content[described + 12 : described + 15]
    assert (model, primaries, transfer) == (1, 1, 1)


def test_what_shrinks_is_compressed_and_dates_are_not_of_today(archive: zipfile.ZipFile) -> None:
    kinds = {entry.filename: entry.compress_type for entry in archive.infolist()}
    assert kinds["meta.json"] == zipfile.ZIP_DEFLATED
    assert kinds["picture_3.png"] == zipfile.ZIP_STORED
    assert {entry.date_time[0] for entry in archive.infolist()} == {1980}


def test_meta_says_what_parts_mean(archive: zipfile.ZipFile) -> None:
    meta = json.loads(archive.read("meta.json"))
    assert meta["format"] == 1
    assert meta["parts"]["halfs"]["shape"] == [3, 4, 6, 2]
    assert meta["parts"]["mesh"]["attributes"] == {"_LAYER": "Number"}
    assert meta["parameters"]["name"] == {
        "value": "wool, naïve",
        "units": "1",
        "meaning": "A text",
    }
    assert meta["views"][0]["camera"]["position"] == [3.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"float32": np.zeros((5, 7))}, "part 'float32' is float64; expected float32."),
        ({"float32": np.full((5, 7), np.nan, np.float32)}, "not finite"),
        ({"float32": np.zeros(5, np.float32)}, "part 'float32' has shape"),
        ({"picture_3": np.zeros((9, 8, 4), np.uint8)}, "has 4 channels; expected 3"),
        ({"unknown": np.zeros(1)}, "part 'unknown' is not declared"),
    ],
)
def test_what_is_not_as_declared_is_refused(changes: dict[str, Any], says: str) -> None:
    contents = small_contents()
    changed = replace(contents, values={**contents.values, **changes})
    with pytest.raises((ValueError, KeyError), match=says):
        write_package(SMALL, changed)


def test_what_is_missing_is_refused() -> None:
    contents = small_contents()
    without = {name: value for name, value in contents.values.items() if name != "float16"}
    with pytest.raises(ValueError, match="parts float16 are missing"):
        write_package(SMALL, replace(contents, values=without))
    with pytest.raises(ValueError, match="parameters are"):
        write_package(SMALL, replace(contents, parameters={"alpha": 1.0}))
    view = View("side", "reference_side", 8, 8, 1, {})
    with pytest.raises(ValueError, match="'reference_side'; expected a picture part"):
        write_package(SMALL, replace(contents, views=(view,)))
