"""The system: settings of scratches, objects, and what can be made at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.glass_scratches.photograph_files import is_photograph
from assets_defs.sources import Source
from assets_defs.system import Dimension, System
from storage.readers.photographs import SUFFIXES
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

SETTINGS = ("setting-1", "setting-2", "ground", "clear", "worn")
"""Table 1's two; the second with ground and with clear walls; and scratches as years leave them."""
OBJECTS = ("plate", "teapot")
ENVIRONMENTS = ("room", "lamps", "sky", "uniform")


def _check_setting(source: Source, settings: Mapping[str, Any]) -> None:
    """Settings are those of `scratch_profile` or of `scratch_photo`: each asset's own file."""
    from assets_defs.glass_scratches.photograph_files import load_scratches
    from assets_defs.glass_scratches.profile_files import load_profile

    if is_photograph(source):
        if "shape" not in settings:
            load_scratches(source, settings)
    elif "photo_side" not in settings:
        load_profile(source, settings)


def _check_object(source: Source, settings: Mapping[str, Any]) -> None:
    from pipelines.geometry.solids import make_closed_mesh
    from storage.readers.meshes import read_mesh

    if source.path is not None:
        vertices, triangles, *_ = read_mesh(source.path)
        try:
            make_closed_mesh(vertices, triangles)
        except ValueError as error:
            raise ValueError(f"{source.name}: {error}.") from error


def _overview(store: VersionedStore, slots: Sequence[Slot]) -> Mapping[str, NDArray[np.uint8]]:
    """Settings side by side on one object: far and close, and under the moving light."""
    import numpy as np

    from pipelines.drawing.contact_sheet import contact_sheet

    made: dict[str, dict[str, xr.Dataset]] = {}
    for slot in slots:
        if slot.asset == "glass_frames":
            name, setting = slot.partition.split(".", 1)
            made.setdefault(name, {})[setting] = store.open(slot)
    pictures: dict[str, NDArray[np.uint8]] = {}
    for name, by_setting in made.items():
        order = [setting for setting in SETTINGS if setting in by_setting]
        shown = [by_setting[s] for s in dict.fromkeys([*order, *by_setting])]
        frames = [dataset["frames"].values for dataset in shown]
        if len(frames) < 2 or len({picture.shape for picture in frames}) > 1:
            continue
        for view, words in enumerate(("far", "close")):
            pictures[f"{name}-{words}"] = contact_sheet(np.stack([one[view] for one in frames]))
        if {"setting-2", "clear"} <= set(by_setting):
            walls = [s for s in ("setting-2", "ground", "clear") if s in by_setting]
            pictures[f"{name}-diffuse-to-clear"] = np.hstack(
                [np.vstack(list(by_setting[s]["frames"].values)) for s in walls]
            )
        moving = [dataset["moving"].values for dataset in shown]
        if len({turn.shape for turn in moving}) == 1:
            pictures[f"{name}-moving-light"] = np.stack(
                [contact_sheet(np.stack(at)) for at in zip(*moving, strict=True)]
            )
    return pictures


SCRATCHES = System(
    name="glass_scratches",
    title="Scratched glass",
    dimensions=(
        Dimension(
            "setting",
            builtin=SETTINGS,
            examples=("worn",),
            default="setting-2",
            suffixes=(
                *(".csv", ".txt", ".tsv", ".dat", ".asc", ".prf", ".smd", ".sdf"),
                *SUFFIXES,
            ),
            check=_check_setting,
        ),
        Dimension(
            "object",
            builtin=OBJECTS,
            examples=("plate",),
            default="plate",
            suffixes=(".ply", ".obj", ".stl", ".glb", ".gltf"),
            check=_check_object,
        ),
    ),
    overview=_overview,
)
