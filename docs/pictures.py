"""Make docs/pictures/: ``make docs``, or those of some systems:
``python -m docs.pictures glass_scratches``.

Launches what the pictures show, at the demo's sizes: more partitions than the demo has. Those of
BTFs are of paper size: `docs.btf_paper_pictures`."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from assets_defs.glass_scratches.graph import SCRATCHES
from assets_defs.launcher import Request
from assets_defs.photo_fur.graph import FUR
from assets_defs.ssdf_lighting.graph import SSDF
from assets_defs.street_billboards.datasets import billboards_of, pages_of, views_of
from assets_defs.street_billboards.graph import STREET
from assets_defs.street_billboards.textures import TextureSettings, view_textures
from assets_defs.system import System
from assets_defs.workspace import Workspace
from benchmarks.fur_oblique import oblique_pictures
from docs.fur_pictures import close_and_against_the_light, fur_scene, in_wind
from docs.thin_pictures import shadow_picture, thin_picture
from pipelines.drawing.colour import to_8bit
from pipelines.glass_scratches.drawing.frames import picture_exposure
from pipelines.glass_scratches.layers.coverage import coverage_maps
from pipelines.glass_scratches.photograph.photograph_layers import (
    layers_like,
    photograph_scratches,
)
from pipelines.glass_scratches.photograph.pictures import (
    found_picture,
    like_picture,
    photograph_picture,
)
from pipelines.light.room import room
from pipelines.ssdf_lighting.drawing.pictures import rate_distortion_picture
from pipelines.street_billboards import figures
from pipelines.street_billboards.drawing.street_stage import StreetStage
from pipelines.street_billboards.textures import eigen_textures
from pipelines.street_billboards.textures.atlases import pack_pages
from storage.versions import VersionedStore
from tests.pipelines.glass_scratches.photographs import SPEC, photograph

FOLDER = Path(__file__).parent / "pictures"
SHOWN: dict[System, dict[str, tuple[str, ...]]] = {
    FUR: {
        "photo": ("grass", "cat", "pelt"),
        "mesh": ("square", "animal"),
    },
    SCRATCHES: {
        "setting": SCRATCHES.dimension("setting").builtin,
        "object": SCRATCHES.dimension("object").builtin,
    },
    SSDF: {"scene": ("teapot", "court"), "environment": ("sky", "lamps", "room")},
    STREET: {"drive": ("city",)},
}
"""Keys by dimension of what the pictures show."""
GIVEN: dict[System, dict[str, int]] = {
    STREET: {"frames": 18},
    SCRATCHES: {"size": 320, "samples": 64},
}
"""Settings that differ from the demo's."""
_HEIGHT = 400
_GAP = 10


def make_pictures(store: VersionedStore, systems: Sequence[System]) -> None:
    """Write every picture of these systems that the pages show."""
    made = {FUR: _fur, SCRATCHES: _scratches, SSDF: _lighting, STREET: _street}
    for system in systems:
        made[system](store)


def _fur(store: VersionedStore) -> None:
    frames = {name: _frames(store, "animal", name) for name in ("grass", "cat", "pelt")}
    _row(
        "fur.jpg",
        _shown(store, FUR, "fur_photo", {"photo": "pelt"}),
        _shown(store, FUR, "shell_stack", {"photo": "pelt"}),
        frames["pelt"][0],
    )
    _row("fur-square.jpg", *_frames(store, "square", "pelt"))
    _row("fur-three.jpg", *(pictures[0] for pictures in frames.values()))
    _row("fur-animal.jpg", *frames["pelt"])
    _row("fur-decay.png", _shown(store, FUR, "attenuation", {"photo": "pelt"}))
    _row("fur-report.jpg", _shown(store, FUR, "fur_photo", {"photo": "cat"}))
    pelt = fur_scene(store, "pelt", "animal")
    _row("fur-close.jpg", *close_and_against_the_light(pelt))
    _moving("fur-wind.webp", in_wind(pelt), milliseconds=190)
    columns = [np.vstack(pictures) for pictures in oblique_pictures(7, 16)]
    Image.fromarray(np.hstack(columns)).save(FOLDER / "fur-oblique.jpg", quality=88)


def _lighting(store: VersionedStore) -> None:
    assert SSDF.overview is not None
    overview = SSDF.overview(store, list(store.slots()))
    _moving(
        "ssdf-turning.webp",
        np.stack(
            [
                np.vstack(at)
                for at in zip(
                    overview["teapot-turning-light"], overview["court-turning-light"], strict=True
                )
            ]
        ),
    )
    keys = {"scene": "teapot", "environment": "sky"}
    _row(
        "ssdf-lit.jpg",
        _shown(store, SSDF, "relit_frames", keys | {"environment": "room"}, "lit"),
        _shown(store, SSDF, "relit_frames", keys | {"scene": "court"}, "lit"),
        _shown(store, SSDF, "relit_frames", keys, "clusters"),
    )
    for name, asset, picture in (
        ("ssdf-basis.png", "triangle_clusters", "shared-basis"),
        ("ssdf-visible.png", "visibility", "visible-share"),
    ):
        Image.fromarray(_shown(store, SSDF, asset, {"scene": "teapot"}, picture)).save(
            FOLDER / name, optimize=True
        )
    Image.fromarray(thin_picture()).save(FOLDER / "ssdf-thin.png", optimize=True)
    Image.fromarray(shadow_picture()).save(FOLDER / "ssdf-thin-shadows.png", optimize=True)
    result = json.loads((Path("benchmarks") / "results" / "ssdf.json").read_text())
    curve = Image.fromarray(rate_distortion_picture(result["curve"]))
    curve.save(FOLDER / "ssdf-curve.png", optimize=True)


def _street(store: VersionedStore) -> None:
    keys = {"drive": "city"}
    assert STREET.overview is not None
    overview = STREET.overview(store, list(store.slots()))
    _moving("street-flight.webp", overview["city-flight"][:, ::2, ::2])
    for name, asset, picture in (
        ("street-held-out.jpg", "street_frames", "held-out"),
        ("street-beside.jpg", "street_frames", "beside-the-path"),
        ("street-depth.jpg", "depth_maps", "depth"),
        ("street-views.png", "view_textures", "views"),
        ("street-plan.png", "billboards", "plan"),
    ):
        shown = Image.fromarray(_shown(store, STREET, asset, keys, picture))
        shown.thumbnail((1600, 1600))
        shown.save(FOLDER / name, quality=85, optimize=True)
    _row("street-pole.jpg", *_pole(store))


def _pole(store: VersionedStore) -> list[NDArray[np.uint8]]:
    """Around the widest pole of a held-out frame: photograph, with occlusion, sampled plainly."""

    def stored(asset: str) -> Any:
        return store.open(STREET.slot(asset, {"drive": "city"}))

    drive, made = stored("drive_frames"), billboards_of(stored("billboards"))
    frame = int(drive["truth_pole"].values.sum(axis=(1, 2)).argmax())
    pole = drive["truth_pole"].values[frame]
    middle = int(pole.sum(axis=0).argmax())
    pose = drive["poses"].values[drive["held_out"].values, 1][frame]
    size = (drive.sizes["x"], drive.sizes["y"])
    inputs = [stored(name) for name in ("drive_frames", "depth_maps", "street_points")]
    plain, _ = view_textures(
        TextureSettings(sampling="plain"), lambda fraction: None, *inputs, stored("billboards")
    )
    textures = eigen_textures.compress_views(views_of(plain), made.turns, error=4.4)
    truth = stored("street_frames")["truth"].values[frame]
    pictures = [truth]
    for packed in (pages_of(stored("texture_atlases")), pack_pages(textures)):
        sky = stored("depth_maps")["sky"].values
        with StreetStage(made, packed, sky, size, supersampling=2) as stage:
            view = stage.view(drive["intrinsics"].values[1], pose)
        pictures.append(figures.match_exposure(to_8bit(view.with_sky), truth, view.covered > 0.5))
    left = min(max(middle - size[0] // 5, 0), size[0] - 2 * size[0] // 5)
    return [picture[:, left : left + 2 * size[0] // 5] for picture in pictures]


def _scratches(store: VersionedStore) -> None:
    assert SCRATCHES.overview is not None
    overview = SCRATCHES.overview(store, list(store.slots()))

    def shown(asset: str, name: str, setting: str) -> NDArray[np.uint8]:
        return _shown(store, SCRATCHES, asset, {"setting": setting}, name)

    _column(
        "scratches-tables.png",
        *(shown("scratch_table_2d", "table", setting) for setting in ("setting-2", "worn")),
    )
    _row("scratches-furnace.png", _furnace(store))
    _column(
        "scratches-layers.png",
        *(shown("scratch_layers", "stages", setting) for setting in ("setting-2", "worn")),
    )
    _row("scratches-frames.jpg", _far_above_close(store, "plate"), height=2 * _HEIGHT)
    _row("scratches-denoised.jpg", *_denoised(store))
    _row("scratches-photograph.png", *_photograph())
    _row("scratches-room.jpg", _room())
    _row("scratches-teapot.jpg", _far_above_close(store, "teapot"), height=2 * _HEIGHT)
    _row("scratches-stage.jpg", _beside_stage(store))
    _row("scratches-walls.jpg", overview["plate-diffuse-to-clear"])
    _moving("scratches-light.webp", overview["plate-moving-light"])


def _glass(store: VersionedStore, name: str, keys: dict[str, str]) -> NDArray[np.uint8]:
    return _shown(store, SCRATCHES, "glass_frames", keys, name)


def _far_above_close(store: VersionedStore, name: str) -> NDArray[np.uint8]:
    """An object in all settings, side by side."""
    settings = SHOWN[SCRATCHES]["setting"]
    both = (_glass(store, "frames", {"object": name, "setting": each}) for each in settings)
    return np.hstack([np.vstack(np.split(pair, 2, axis=1)) for pair in both])


def _furnace(store: VersionedStore) -> NDArray[np.uint8]:
    return _glass(store, "furnace", {"object": "plate", "setting": "setting-2"})


def _denoised(store: VersionedStore) -> list[NDArray[np.uint8]]:
    """Plate and teapot as they were traced, and denoised: far above close."""
    return [
        _glass(store, "noise-beside-clean", {"object": name, "setting": "setting-2"})
        for name in ("plate", "teapot")
    ]


def _photograph() -> list[NDArray[np.uint8]]:
    """A photograph made of known scratches, those found in it, and layers like them."""
    _, luminance = photograph(SPEC, 1, _HEIGHT)
    found = photograph_scratches(luminance)
    coverage = coverage_maps(layers_like(found, 0), 2 * _HEIGHT)
    again = like_picture(luminance, found, coverage)
    return [photograph_picture(luminance), found_picture(luminance, found), again]


def _room() -> NDArray[np.uint8]:
    radiance = room(2 * _HEIGHT)
    return to_8bit(radiance * picture_exposure(radiance))


def _beside_stage(store: VersionedStore) -> NDArray[np.uint8]:
    return _glass(store, "traced-beside-stage", {"object": "plate", "setting": "worn"})


def _frames(store: VersionedStore, mesh: str, photo: str) -> NDArray[np.uint8]:
    frames = store.open(FUR.slot("fur_frames", {"mesh": mesh, "photo": photo}))["frames"]
    return np.asarray(frames.values)


def _shown(
    store: VersionedStore, system: System, asset: str, keys: dict[str, str], name: str | None = None
) -> NDArray[np.uint8]:
    """An asset's picture; its only one where no name is given."""
    pictures = system.plans[asset].pictures
    assert pictures is not None
    made = pictures(store.open(system.slot(asset, keys)))
    if name is None:
        (name,) = made
    return made[name]


def _moving(name: str, frames: NDArray[np.uint8], milliseconds: int = 400) -> None:
    first, *others = (Image.fromarray(frame) for frame in frames)
    first.save(
        FOLDER / name,
        save_all=True,
        append_images=others,
        duration=milliseconds,
        loop=0,
        quality=75,
    )


def _column(name: str, *pictures: NDArray[np.uint8]) -> None:
    """Pictures of one width below each other."""
    Image.fromarray(np.vstack(pictures)).save(FOLDER / name, optimize=True)


def _row(name: str, *pictures: NDArray[np.uint8], height: int = _HEIGHT) -> None:
    """Pictures side by side, equally high, on white."""
    scaled = []
    for picture in pictures:
        image = Image.fromarray(picture)
        width = round(image.width * height / image.height)
        scaled.append(image.resize((width, height), Image.Resampling.LANCZOS))
    width = sum(image.width for image in scaled) + _GAP * (len(scaled) - 1)
    row = Image.new("RGB", (width, height), "white")
    left = 0
    for image in scaled:
        row.paste(image, (left, 0))
        left += image.width + _GAP
    FOLDER.mkdir(exist_ok=True)
    row.save(FOLDER / name, quality=88, optimize=True)


def make_assets(systems: Sequence[System]) -> None:
    """Launch what the pictures of these systems show; what is current is skipped. Raises SystemExit
    on failures."""
    from tsuya.session import launch_all, open_session, report

    with open_session() as session:
        requests = [
            Request(system, system.cross_product(keys), "demo", GIVEN.get(system, {}))
            for system, keys in SHOWN.items()
            if system in systems
        ]
        launched = launch_all(session, requests)
    report(session, launched, [], as_json=False)


if __name__ == "__main__":
    chosen = [system for system in SHOWN if not sys.argv[1:] or system.name in sys.argv[1:]]
    make_assets(chosen)
    make_pictures(Workspace.of_checkout().store, chosen)
