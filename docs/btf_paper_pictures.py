"""Make the pictures of paper-size BTFs: ``python -m docs.btf_paper_pictures``.

Of what ``python -m benchmarks btf --scale paper`` made in the same data folder: four cloths, one of
them at four zooms and to the horizon, figure 8 with its crops; and what bytes buy, of what is
committed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from assets_defs.neural_btf.datasets import compressed_btf_of
from assets_defs.neural_btf.declaration import NONE
from assets_defs.neural_btf.graph import BTF
from assets_defs.workspace import Workspace
from benchmarks import btf_paper_training
from benchmarks.btf_cloth import REFERENCE, crops_sheet, tile_of
from benchmarks.btf_columns import (
    COLUMNS,
    FILE,
    committed_columns,
    draped_columns,
    measured_btf,
    stored_forms,
)
from benchmarks.btf_material import FLAT, NULLS
from benchmarks.btf_paper_scale import MATERIALS, RUNS, result_path
from docs.pictures import FOLDER
from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.plots import canvas_picture, new_figure
from pipelines.drawing.stage import Camera, orbit
from pipelines.light.directions import unit_vectors
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.draping.frames import CAMERA_AZIMUTH, daylight, whole_camera
from pipelines.neural_btf.draping.gathering import floor_shading, lighting_of
from pipelines.neural_btf.draping.rendering import View, render
from pipelines.neural_btf.draping.scene import draped_scene
from pipelines.neural_btf.importance import importance_table
from pipelines.neural_btf.material import Material, MeasuredBtf, surface_radiance
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
        np.hstack([_drawn(btf, camera, (480, 360))[0] for btf in btfs])
        for camera in (_camera(_DISTANCES[0]), whole_camera())
    ]
    return np.vstack(rows)


def draw_zooms(btf: CompressedBtf) -> NDArray[np.uint8]:
    """The cloth from a hand's breadth to six metres."""
    cameras = [_camera(distance) for distance in _DISTANCES]
    return np.hstack([_drawn(btf, camera, (400, 300))[0] for camera in cameras])


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


def draw_bytes(runs: dict[str, dict[str, Any]], columns: dict[str, Any]) -> NDArray[np.uint8]:
    """Bytes and error of every form and rival, of committed ``runs`` by material and seed ("knit
    0") and committed ``columns`` by material."""
    materials = [name.removesuffix(" 0") for name in runs if name.endswith(" 0")]
    figure, canvas = new_figure(3.6 * len(materials), 4.2)
    axes = figure.subplots(1, len(materials), squeeze=False)[0]
    for axis, material in zip(axes, materials, strict=True):
        first = runs[f"{material} 0"]
        rivals = {name: row for name, row in first["rivals"].items() if name not in NULLS}
        below = 0.0
        for name, row in sorted(rivals.items(), key=lambda rival: float(rival[1]["rmse"])):
            at = row["bytes"] / 1e3, row["rmse"]
            axis.plot(*at, "x", color="tab:red")
            up = 4 if row["rmse"] < 1.05 * below else -4
            axis.annotate(name.replace("_", " "), at, **_beside(6, up))
            below = row["rmse"]
        axis.axhline(first["rivals"][FLAT]["rmse"], color="black", lw=0.8, ls="--")
        for seed, mark in ((0, "o"), (1, "v")):
            forms = runs.get(f"{material} {seed}", {}).get("forms", {})
            for name, row in forms.items():
                at = row["bytes"] / 1e3, row["rmse"]
                axis.plot(*at, mark, color="tab:green", fillstyle="none")
                if seed == 0:
                    axis.annotate(name, at, ha="right", **_beside(-6))
        for name in COLUMNS if material in columns else ():
            at = columns[material]["bytes"][name] / 1e3, columns[material]["rmse"][name]
            axis.plot(*at, "s", color="tab:blue", fillstyle="none")
            axis.annotate(f"k={name}", at, **_beside(6))
        axis.set(title=material, xlabel="kB", xscale="log", xlim=(20, 1000))
        axis.set_xticks([25, 50, 100, 200, 400], ["25", "50", "100", "200", "400"], minor=False)
        axis.set_xticks([], minor=True)
        axis.set_ylim(0.0)
        axis.grid(alpha=0.3, which="both")
    axes[0].set_ylabel("RMSE over alpha; dashed: a colour a photograph")
    return canvas_picture(canvas)


def draw_training(done: dict[str, dict[str, Any]], fast: float) -> NDArray[np.uint8]:
    """Errors of the batches of the paper's longest training over processor seconds; ``fast`` is
    what fast training reaches."""
    longest = max(done.values(), key=lambda run: float(run["cpu_seconds"]))
    seconds, _, errors = np.array(longest["curve"]).T
    figure, canvas = new_figure(6.4, 3.2)
    axis = figure.subplots()
    axis.plot(seconds / 60, errors, color="tab:blue", label="training=paper, its batches")
    axis.plot(longest["cpu_seconds"] / 60, longest["rmse"], "o", label="all photographs")
    axis.axhline(
        longest["rmse_null"], color="black", lw=0.8, ls="--", label="a colour a photograph"
    )
    axis.axhline(fast, color="tab:green", lw=0.8, label="training=fast, after six minutes")
    axis.set(xlabel="processor minutes", ylabel="RMSE over alpha", ylim=(0.0, None))
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8)
    return canvas_picture(canvas)


def _camera(distance: float) -> Camera:
    return orbit(_FOCUS, distance, CAMERA_AZIMUTH - 4.0, 30.0, view_angle=24.0)


def draw_clusters(measured: MeasuredBtf, forms: dict[str, CompressedBtf]) -> NDArray[np.uint8]:
    """A cloth from a hand's breadth: measured, the network, its clusters, the file."""
    shown = [measured, *(forms[name] for name in (REFERENCE, COLUMNS[0], COLUMNS[-1], FILE))]
    return np.hstack(_drawn(forms[FILE], _camera(_DISTANCES[0]), (400, 400), shown))


def _drawn(
    btf: CompressedBtf,
    camera: Camera,
    size: tuple[int, int],
    materials: Sequence[Material] = (),
) -> list[NDArray[np.uint8]]:
    """Pictures of materials, of the BTF alone where there are none, from the BTF's directions and
    exposed for the first one's cloth."""
    scene, lighting = draped_scene(), lighting_of(daylight())
    shading = floor_shading(scene, lighting, 96, 4 * _SAMPLES)
    view = View(camera, size, _SAMPLES, tile_of(btf.height, btf.width))
    taken = render(scene, lighting, shading, materials or [btf], importance_table(btf), view)
    exposure = auto_exposure(taken.pictures[0][taken.cloth == 1.0])
    return [to_8bit(picture * exposure) for picture in taken.pictures]


def _file(store: VersionedStore, material: str) -> CompressedBtf:
    keys = {"material": material, "clusters": NONE}
    return compressed_btf_of(store.open(BTF.slot("compressed_btf", keys)).load())


def _beside(right: int, up: int = -3) -> dict[str, Any]:
    return {"xytext": (right, up), "textcoords": "offset points", "fontsize": 7}


def _committed_runs() -> dict[str, dict[str, Any]]:
    paths = {f"{material} {seed}": result_path(material, seed) for material, seed in RUNS}
    return {name: json.loads(path.read_text()) for name, path in paths.items() if path.exists()}


def _picture(store: VersionedStore, asset: str, keys: dict[str, str], name: str) -> Image.Image:
    pictures = BTF.plans[asset].pictures
    assert pictures is not None
    return Image.fromarray(pictures(store.open(BTF.slot(asset, keys)))[name])


def _write_stored(store: VersionedStore, cloths: list[str], folder: Path) -> None:
    """Write pictures that assets have themselves."""
    knit = {"material": "knit", "clusters": NONE}
    for name in ("restored", "errors"):
        picture = _picture(store, "restored_images", knit, name)
        picture.save(folder / f"btf-{name}.png", optimize=True)
    curve = _picture(store, "rate_distortion", knit, "rate-distortion")
    curve.save(folder / "btf-rate-distortion.png", optimize=True)
    rows = [_picture(store, "btf_images", {"material": m}, "photographs") for m in cloths]
    Image.fromarray(np.vstack(rows)).save(folder / "btf-photographs.png", optimize=True)


def main(folder: Path = FOLDER) -> None:
    """Write all that the data folder has the versions of."""
    store = Workspace(Workspace.from_environment().root / "benchmarks").store
    known = {slot.partition for slot in store.slots() if slot.asset == "compressed_btf"}
    cloths = [m for m in BTF.dimension("material").builtin if f"{NONE}.{m}" in known]
    _write_stored(store, cloths, folder)
    files = [_file(store, material) for material in cloths]
    Image.fromarray(draw_cloths(files)).save(folder / "btf-cloths.jpg", quality=90, optimize=True)
    levels = Image.fromarray(draw_levels(_file(store, "knit")))
    levels.save(folder / "btf-levels.jpg", quality=90, optimize=True)
    zooms = Image.fromarray(draw_zooms(_file(store, "knit")))
    zooms.save(folder / "btf-zooms.jpg", quality=90, optimize=True)
    curve = draw_bytes(_committed_runs(), committed_columns(MATERIALS))
    Image.fromarray(curve).save(folder / "btf-bytes.png", optimize=True)
    training = json.loads(btf_paper_training.RESULTS.read_text())
    fast = committed_columns(("knit",))["knit"]["rmse"][REFERENCE]
    curve = draw_training(training, fast)
    Image.fromarray(curve).save(folder / "btf-training.png", optimize=True)
    if all(f"{column}.knit" in known for column in COLUMNS):
        columns = measured_btf(store, "knit"), stored_forms(store, "knit")
        crops = Image.fromarray(crops_sheet(draped_columns(*columns)))
        crops.save(folder / "btf-crops.png", optimize=True)
        clusters = Image.fromarray(draw_clusters(*columns))
        clusters.save(folder / "btf-clusters.jpg", quality=90, optimize=True)


if __name__ == "__main__":
    main()
