"""Make the pictures of paper-size BTFs: ``python -m docs.btf_paper_pictures``.

Of what ``python -m benchmarks btf --scale paper`` made in the same data folder: four cloths, one of
them at four zooms, and figure 8 with its crops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from assets_defs.neural_btf.datasets import compressed_btf_of
from assets_defs.neural_btf.declaration import NONE
from assets_defs.neural_btf.graph import BTF
from assets_defs.workspace import Workspace
from benchmarks.btf_cloth import crops_sheet, tile_of
from benchmarks.btf_columns import COLUMNS, draped_columns
from docs.pictures import FOLDER
from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.stage import Camera, orbit
from pipelines.light.directions import unit_vectors
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.draping.frames import CAMERA_AZIMUTH, daylight, whole_camera
from pipelines.neural_btf.draping.gathering import floor_shading, lighting_of
from pipelines.neural_btf.draping.rendering import View, render
from pipelines.neural_btf.draping.scene import draped_scene
from pipelines.neural_btf.importance import importance_table
from pipelines.neural_btf.material import surface_radiance
from storage.versions import VersionedStore

_FOCUS = (0.25, 0.40, 0.98)
_DISTANCES = (0.35, 0.9, 2.4, 6.0)
"""Metres, from a hand's breadth on."""
_SHEET_SIZE = (800, 240)
_EYE, _TILE, _HORIZON = 0.35, 0.1, 0.02
"""Metres above a sheet of cloth, metres of a tile, slope of the farthest ray."""
_SUN = (0.9, 2.6)
"""Its angle from the normal, its azimuth."""
_SAMPLES = 128


def draw_cloths(btfs: list[CompressedBtf]) -> NDArray[np.uint8]:
    """Each cloth from a hand's breadth, and whole below."""
    rows = [
        np.hstack([_drawn([btf], camera, (480, 360))[0] for btf in btfs])
        for camera in (_camera(_DISTANCES[0]), whole_camera())
    ]
    return np.vstack(rows)


def draw_zooms(btf: CompressedBtf) -> NDArray[np.uint8]:
    """The cloth from a hand's breadth to six metres."""
    cameras = [_camera(distance) for distance in _DISTANCES]
    return np.hstack([_drawn([btf], camera, (400, 300))[0] for camera in cameras])


def draw_levels(btf: CompressedBtf) -> NDArray[np.uint8]:
    """A sheet of cloth to the horizon under the sun, one lookup a pixel: with coarser levels above,
    from the finest alone below."""
    width, height = _SHEET_SIZE
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(_HORIZON, 0.9, height))
    rays = np.stack([x.ravel(), np.ones(x.size), -y.ravel()], axis=1)
    distance = _EYE / y.ravel()
    places = rays[:, :2] * distance[:, None] / _TILE
    pixel = distance * (2 / width) / _TILE
    footprint = pixel / np.sqrt(y.ravel())  # between across and along the view
    view = -rays / np.linalg.norm(rays, axis=1, keepdims=True)
    light = np.broadcast_to(unit_vectors(np.array([_SUN])), view.shape)
    pictures = [surface_radiance(btf, places, light, view, seen) for seen in (footprint, None)]
    exposure = auto_exposure(pictures[0])
    return np.vstack([to_8bit(p.reshape(height, width, 3) * exposure) for p in pictures])


def _camera(distance: float) -> Camera:
    return orbit(_FOCUS, distance, CAMERA_AZIMUTH - 4.0, 30.0, view_angle=24.0)


def _drawn(
    btfs: list[CompressedBtf], camera: Camera, size: tuple[int, int], samples: int = _SAMPLES
) -> list[NDArray[np.uint8]]:
    """Pictures of BTFs, exposed for the first one's cloth."""
    scene, lighting = draped_scene(), lighting_of(daylight())
    shading = floor_shading(scene, lighting, 96, 4 * samples)
    view = View(camera, size, samples, tile_of(btfs[0].height, btfs[0].width))
    taken = render(scene, lighting, shading, btfs, importance_table(btfs[0]), view)
    exposure = auto_exposure(taken.pictures[0][taken.cloth == 1.0])
    return [to_8bit(picture * exposure) for picture in taken.pictures]


def _file(store: VersionedStore, material: str) -> CompressedBtf:
    keys = {"material": material, "clusters": NONE}
    return compressed_btf_of(store.open(BTF.slot("compressed_btf", keys)).load())


def main(folder: Path = FOLDER) -> None:
    """Write all that the data folder has the versions of."""
    store = Workspace(Workspace.from_environment().root / "benchmarks").store
    known = {slot.partition for slot in store.slots() if slot.asset == "compressed_btf"}
    cloths = [m for m in BTF.dimension("material").builtin if f"{NONE}.{m}" in known]
    files = [_file(store, material) for material in cloths]
    Image.fromarray(draw_cloths(files)).save(folder / "btf-cloths.jpg", quality=90, optimize=True)
    levels = Image.fromarray(draw_levels(_file(store, "knit")))
    levels.save(folder / "btf-levels.png", optimize=True)
    zooms = Image.fromarray(draw_zooms(_file(store, "knit")))
    zooms.save(folder / "btf-zooms.jpg", quality=90, optimize=True)
    if all(f"{column}.knit" in known for column in COLUMNS):
        crops = Image.fromarray(crops_sheet(draped_columns(store, "knit")))
        crops.save(folder / "btf-crops.png", optimize=True)


if __name__ == "__main__":
    main()
