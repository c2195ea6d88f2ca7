"""Fur for other programs: read back by trimesh and Pillow, and drawn by three.js in a browser."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from assets_defs.workspace import CHECKOUT
from pipelines.photo_fur.stage_view import Fill, Look
from storage.packages import Package
from tests.fur_packages import fur_package, tufts
from tsuya.exports import find_format

LAYERS = 6
THREE = CHECKOUT / "viewer" / "node_modules" / "three"
_LOOKS: tuple[tuple[Look, Fill], ...] = (
    ("full", "columns"),
    ("plain", "columns"),
    ("plain", "bands"),
)


@pytest.fixture(scope="module", params=_LOOKS, ids=" ".join)
def package(request: pytest.FixtureRequest) -> Package:
    look, fill = request.param
    return fur_package(look, fill, layers=LAYERS)


def _codes(package: Package) -> Any:
    """The photograph's colours (y, x, 3), decoded by Pillow."""
    with Image.open(io.BytesIO(package.array("photograph").tobytes())) as picture:
        return np.asarray(picture.convert("RGB")) / 255.0


def _layers_of_pixels(linear: Any) -> tuple[Any, Any]:
    """Layer of each pixel, 0 for none, by the closed form; and the medium's decay."""
    photograph = tufts()
    brightest, darkest = photograph.attenuation
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    decay = np.log(brightest / darkest)
    with np.errstate(divide="ignore"):
        depth = np.log(brightest / luminance) / decay
    layer = np.clip(np.floor(depth * LAYERS) + 1, 1, LAYERS)
    return np.where(photograph.opaque, layer, 0).astype(int), decay


# ---- glTF ------------------------------------------------------------------------------------


@pytest.mark.reads_back("glb")
def test_trimesh_and_pillow_read_the_shells(package: Package, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    target = tmp_path / "fur.glb"
    look, layers = find_format("glb", "photo_fur").write(package, target)
    assert "plain look" in look
    assert "6 layers" in layers
    read = trimesh.load(target, force="scene", process=False)
    shells = [read.geometry[read.graph[name][1]] for name in read.graph.nodes_geometry]
    shells.sort(key=lambda shell: int(shell.visual.material.name.removeprefix("layer ")))
    assert len(shells) == LAYERS
    mesh = package.mesh("mesh")
    turn = read.graph[read.graph.nodes_geometry[0]][0]
    # y is up in the file's world.
    assert np.allclose(turn[:3, :3] @ [0, 0, 1], [0, 1, 0], atol=1e-7)
    photograph = _codes(package)
    linear = np.where(
        photograph <= 0.04045, photograph / 12.92, ((photograph + 0.055) / 1.055) ** 2.4
    )
    own, decay = _layers_of_pixels(linear)
    for n, shell in enumerate(shells, start=1):
        expected = mesh.vertices + package.parameter("thickness") * (1 - n / LAYERS) * mesh.normals
        assert np.abs(shell.vertices - expected).max() < 1e-6
        assert np.array_equal(shell.faces, mesh.triangles)
        assert np.allclose(shell.visual.uv, mesh.uvs, atol=1e-6)
        material = shell.visual.material
        assert (material.alphaMode, material.alphaCutoff) == ("MASK", 0.5)
        assert (material.metallicFactor, material.roughnessFactor) == (0.0, 1.0)
        texels = np.asarray(material.baseColorTexture)
        columns = package.parameter("fill") == "columns"
        stands = (own > 0) & ((own <= n) if columns else (own == n))
        assert np.array_equal(texels[..., 3], np.where(stands, 255, 0))
        darker = linear * np.exp(-decay / LAYERS * np.maximum(n - own, 0))[..., None]
        codes = np.where(darker <= 0.0031308, 12.92 * darker, 1.055 * darker ** (1 / 2.4) - 0.055)
        shown = codes if columns else photograph
        assert np.abs(texels[..., :3] - 255 * shown)[stands].max() <= 0.51


def test_textures_are_repeated_mirrored_and_without_mipmaps(
    package: Package, tmp_path: Path
) -> None:
    target = tmp_path / "fur.glb"
    find_format("glb", "photo_fur").write(package, target)
    content = target.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    document = json.loads(content[20 : 20 + length])
    sampler = {"wrapS": 33648, "wrapT": 33648, "minFilter": 9729, "magFilter": 9729}
    assert document["samplers"] == [sampler]
    assert package.mesh("mesh").uvs.min() < 0  # so that it matters


# ---- three.js --------------------------------------------------------------------------------

_PAGE = """<!doctype html><script type="importmap">{"imports": {
  "three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>"""
_DRAW = """async ({view, background, glb}) => {
  const THREE = await import("three");
  const renderer = new THREE.WebGLRenderer();
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  const scene = new THREE.Scene();
  const turn = new THREE.Quaternion(-Math.SQRT1_2, 0, 0, Math.SQRT1_2);
  const turned = (vector) => new THREE.Vector3(...vector).applyQuaternion(turn);
  const {position, target, up, view_angle} = view.camera;
  const [width, height] = [view.supersampling * view.width, view.supersampling * view.height];
  const camera = new THREE.PerspectiveCamera(view_angle, width / height, 0.1, 50);
  camera.position.copy(turned(position));
  camera.up.copy(turned(up));
  camera.lookAt(turned(target));
  if (glb) {
    const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
    scene.add((await new GLTFLoader().loadAsync("/export/fur.glb")).scene);
    const lamp = new THREE.DirectionalLight(0xffffff, Math.PI * view.state.headlight);
    lamp.position.copy(camera.position).sub(turned(target));
    scene.add(lamp);
  } else {
    const { loadFur, setFur } = await import("/export/fur.js");
    const fur = await loadFur(new URL("/export/", location));
    setFur(fur, view.state.thickness === 1 ? {...view.state, thickness: undefined} : view.state);
    scene.add(fur);
  }
  const made = new THREE.WebGLRenderTarget(width, height, {type: THREE.FloatType});
  renderer.setRenderTarget(made);
  renderer.setClearColor(new THREE.Color(...background), 1);
  renderer.clear();
  renderer.render(scene, camera);
  const radiance = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(made, 0, 0, width, height, radiance);
  return Array.from(radiance);
}"""


@pytest.fixture
def page(chromium: Any, tmp_path: Path) -> Iterator[Any]:
    """A page that has three.js and the files of ``tmp_path``; it must say nothing."""
    folders = {"three": THREE, "export": tmp_path}
    kinds = {".js": "text/javascript", ".json": "application/json", ".png": "image/png"}

    def answer(route: Any) -> None:
        place = route.request.url.removeprefix("http://fur.test/")
        if not place:
            route.fulfill(body=_PAGE, content_type="text/html")
            return
        folder, _, name = place.partition("/")
        path = folders[folder] / name
        kind = kinds.get(path.suffix, "application/octet-stream")
        route.fulfill(body=path.read_bytes(), content_type=kind)

    page, said = chromium.new_page(), []
    page.on(
        "console",
        lambda each: said.append(each.text) if each.type in ("error", "warning") else None,
    )
    page.on("pageerror", lambda error: said.append(str(error)))
    page.route("**/*", answer)
    page.goto("http://fur.test/")
    yield page
    page.close()
    assert [text for text in said if "GPU stall" not in text] == []


def _psnr(page: Any, package: Package, view: dict[str, Any], *, glb: bool = False) -> float:
    background = package.parameter("background")
    asked = {"view": view, "background": background, "glb": glb}
    flat = page.evaluate(_DRAW, asked)
    samples = view["supersampling"]
    shape = (view["height"], samples, view["width"], samples, 4)
    radiance = np.array(flat).reshape(shape)[::-1, ::-1]
    linear = np.clip(radiance.mean(axis=(1, 3))[..., :3], 0, 1)
    codes = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    error = np.mean((255 * codes - package.picture(view["picture"])) ** 2)
    return float(10 * np.log10(255**2 / error))


def _views(package: Package) -> dict[str, dict[str, Any]]:
    return {view["name"]: view for view in package.meta["views"]}


@pytest.mark.reads_back("three")
def test_three_js_draws_what_the_stage_draws(package: Package, page: Any, tmp_path: Path) -> None:
    (tmp_path / "made").mkdir()
    target = tmp_path / "made" / "fur"
    find_format("three", "photo_fur").write(package, target)
    for path in target.iterdir():
        path.rename(tmp_path / path.name)
    views = _views(package)
    looks = ["full", "wind", "far"] if package.parameter("look") == "full" else ["plain"]
    found = {name: _psnr(page, package, views[name]) for name in ["front", "close", *looks]}
    assert min(found.values()) >= 40, found
    close = views["close"]
    mirrored = [-close["state"]["light"][0], *close["state"]["light"][1:]]
    null = close | {"state": close["state"] | {"light": mirrored}}
    assert _psnr(page, package, null) < 36
    if "wind" in looks:
        calm = views["wind"] | {"state": views["wind"]["state"] | {"wind": 0.0}}
        assert _psnr(page, package, calm) < 34


@pytest.mark.reads_back("glb")
def test_three_js_loads_the_shells_of_gltf(package: Package, page: Any, tmp_path: Path) -> None:
    """Its material is not Lambert's alone, and masks are filtered: it is like the stage's."""
    find_format("glb", "photo_fur").write(package, tmp_path / "fur.glb")
    view = _views(package)["plain"]
    like = _psnr(page, package, view, glb=True)
    assert like >= 22
    null = view | {"picture": _views(package)["close"]["picture"]}
    assert _psnr(page, package, null, glb=True) < like - 6
