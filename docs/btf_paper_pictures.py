"""Make the pictures of paper-size BTFs: ``python -m docs.btf_paper_pictures``.

Of what ``python -m benchmarks btf --scale paper`` made in the same data folder: figure 8 with its
crops, close-ups at four zooms, and the paper's training."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from assets_defs.neural_btf.datasets import compressed_btf_of, float_btf_file, pairs_of, runtime_btf
from assets_defs.neural_btf.declaration import NONE
from assets_defs.neural_btf.graph import BTF
from assets_defs.workspace import Workspace
from benchmarks.btf_cloth import RAW, REFERENCE, crops_sheet, draped_cloths, tile_of
from docs.pictures import FOLDER
from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import Camera, orbit
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.draping.frames import CAMERA_AZIMUTH, close_camera, daylight
from pipelines.neural_btf.draping.gathering import floor_shading, lighting_of
from pipelines.neural_btf.draping.rendering import View, render
from pipelines.neural_btf.draping.scene import draped_scene
from pipelines.neural_btf.importance import importance_table
from pipelines.neural_btf.material import Material, MeasuredBtf
from storage.versions import VersionedStore

MATERIAL = "knit"
_SIZE = (320, 240)
_SAMPLES = 96
_FOCUS = (0.25, 0.40, 0.98)
_DISTANCES = (0.35, 0.9, 2.4, 6.0)
"""Metres, from a hand's breadth on."""


def draw_zooms(btf: CompressedBtf, tile: tuple[float, float]) -> NDArray[np.uint8]:
    """The cloth from four distances, with coarser levels above, without below."""
    scene, lighting = draped_scene(), lighting_of(daylight())
    shading = floor_shading(scene, lighting, 64, 4 * _SAMPLES)
    table = importance_table(btf)
    columns = []
    for distance in _DISTANCES:
        taken = render(
            scene,
            lighting,
            shading,
            [btf, replace(btf, mips=())],
            table,
            View(_camera(distance), _SIZE, _SAMPLES, tile),
        )
        exposure = auto_exposure(taken.pictures[0][taken.cloth == 1.0])
        columns.append(np.vstack([to_8bit(picture * exposure) for picture in taken.pictures]))
    return np.hstack(columns)


def _camera(distance: float) -> Camera:
    if distance <= _DISTANCES[0]:
        return close_camera()
    return orbit(_FOCUS, distance, CAMERA_AZIMUTH - 4.0, 30.0, view_angle=24.0)


def draw_crops(store: VersionedStore, columns: tuple[str, ...]) -> NDArray[np.uint8]:
    """Figure 8: the measured BTF, networks with and without clusters, the file."""
    images = store.open(BTF.slot("btf_images", {"material": MATERIAL}))
    matrix = store.open(BTF.slot("abrdf_matrix", {"material": MATERIAL}))
    shown: dict[str, Material] = {RAW: MeasuredBtf(images["images"].values, pairs_of(images))}
    for column in (NONE, *columns):
        keys = {"material": MATERIAL, "clusters": column}
        network, groups = (store.open(BTF.slot(n, keys)) for n in ("neural_btf", "abrdf_clusters"))
        name = REFERENCE if column == NONE else column
        shown[name] = runtime_btf(float_btf_file(network.load(), groups.load(), matrix))
    shown["file"] = _file(store)
    size = int(matrix["height"]), int(matrix["width"])
    return crops_sheet(draped_cloths(shown, tile_of(*size), width=_SIZE[0], samples=128))


def _file(store: VersionedStore) -> CompressedBtf:
    keys = {"material": MATERIAL, "clusters": NONE}
    return compressed_btf_of(store.open(BTF.slot("compressed_btf", keys)).load())


def main() -> None:
    """Write all of them."""
    store = Workspace(Workspace.from_environment().root / "benchmarks").store
    known = {slot.partition for slot in store.slots() if slot.asset == "neural_btf"}
    columns = tuple(c for c in ("500", "1000", "2000") if f"{c}.{MATERIAL}" in known)
    file = _file(store)
    Image.fromarray(draw_crops(store, columns)).save(FOLDER / "btf-crops.png", optimize=True)
    zooms = Image.fromarray(draw_zooms(file, tile_of(file.height, file.width)))
    zooms.save(FOLDER / "btf-zooms.jpg", quality=90, optimize=True)


if __name__ == "__main__":
    main()
