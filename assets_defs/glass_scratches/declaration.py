"""The system: settings of scratches, objects, and what can be made at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.settings import Settings
from assets_defs.system import Dimension, Source, System
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SETTINGS = ("setting-1", "setting-2", "mirror", "worn")
"""Table 1's two; the second with mirror-like walls; and scratches as years leave them."""
OBJECTS = ("plate", "teapot")
ENVIRONMENTS = ("lamps", "sky", "uniform")


def _check_profile(source: Source, settings: Mapping[str, Any]) -> None:
    from pipelines.glass_scratches.profiles import built_in_profile, cut_profile
    from storage.readers.profiles import read_profile

    if source.path is not None:
        cut_profile(read_profile(source.path), source.name)
    else:
        built_in_profile(settings["shape"], settings["profile_width"], settings["profile_depth"])


def _check_object(source: Source, settings: Mapping[str, Any]) -> None:
    from pipelines.solids import check_closed
    from storage.readers.meshes import read_mesh

    if source.path is not None:
        vertices, triangles, _ = read_mesh(source.path)
        try:
            check_closed(vertices, triangles)
        except ValueError as error:
            raise ValueError(f"{source.name}: {error}") from error


def _check_together(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Walls, layers, glass and environment, before anything is made of them."""
    from assets_defs.glass_scratches.frames import FrameSettings, environment
    from assets_defs.glass_scratches.layers import LayerSettings, layer_spec
    from assets_defs.glass_scratches.tables import TableSettings
    from pipelines.glass_scratches.bins import check_bins

    walls = settings.get("scratch_table_2d")
    if isinstance(walls, TableSettings):
        check_bins(walls.bins)
        if walls.method == "exact" and walls.roughness != 1.0:
            raise ValueError(
                f"roughness is {walls.roughness:g} with the method exact; expected 1, or the "
                "method paths."
            )
    scattered = settings.get("scratch_layers")
    if isinstance(scattered, LayerSettings):
        layer_spec(scattered).validate()
    shown = settings.get("glass_frames")
    if isinstance(shown, FrameSettings):
        environment(shown)


def _overview(store: VersionedStore, slots: Sequence[Slot]) -> Mapping[str, NDArray[np.uint8]]:
    """Settings side by side on one object: far and close, and under the moving light."""
    import numpy as np

    from pipelines.contact_sheet import contact_sheet

    pictures: dict[str, NDArray[np.uint8]] = {}
    for name in dict.fromkeys(slot.partition.split(".")[0] for slot in slots):
        shown = {
            slot.partition.split(".", 1)[1]: store.open(slot)
            for slot in slots
            if slot.asset == "glass_frames" and slot.partition.split(".")[0] == name
        }
        found = [shown[setting] for setting in (*SETTINGS, *shown) if setting in shown]
        found = list({id(dataset): dataset for dataset in found}.values())
        if len(found) > 1 and len({dataset["frames"].shape for dataset in found}) == 1:
            for view, words in enumerate(("far", "close")):
                sheet = np.stack([dataset["frames"].values[view] for dataset in found])
                pictures[f"{name}-{words}"] = contact_sheet(sheet)
        both = [shown[key] for key in ("setting-2", "mirror") if key in shown]
        if len(both) == 2 and len({dataset["frames"].shape for dataset in both}) == 1:
            pictures[f"{name}-diffuse-beside-specular"] = np.hstack(
                [np.vstack(list(dataset["frames"].values)) for dataset in both]
            )
        moving = [dataset["moving"].values for dataset in found]
        if len(moving) > 1 and len({frames.shape for frames in moving}) == 1:
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
            examples=SETTINGS,
            default="setting-2",
            suffixes=(".csv",),
            check=_check_profile,
        ),
        Dimension(
            "object",
            builtin=OBJECTS,
            examples=OBJECTS,
            default="plate",
            suffixes=(".ply", ".obj", ".glb"),
            check=_check_object,
        ),
    ),
    check=_check_together,
    overview=_overview,
)
