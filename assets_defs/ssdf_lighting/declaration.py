"""The system: scenes, environments, and what can be made at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.sources import Source
from assets_defs.system import Dimension, System
from storage.readers.environments import read_environment
from storage.readers.scenes import check_scene
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

SCENES = ("teapot", "court")
ENVIRONMENTS = ("sky", "lamps", "room")


def _check_scene(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        check_scene(source.path)


def _check_environment(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        read_environment(source.path)


def _overview(store: VersionedStore, slots: Sequence[Slot]) -> Mapping[str, NDArray[np.uint8]]:
    """Scenes under their environments side by side, the light going around."""
    import numpy as np

    from pipelines.drawing.contact_sheet import contact_sheet

    made: dict[str, list[xr.Dataset]] = {}
    for slot in slots:
        if slot.asset == "relit_frames":
            _, scene = slot.partition.split(".", 1)
            made.setdefault(scene, []).append(store.open(slot))
    pictures: dict[str, NDArray[np.uint8]] = {}
    for scene, datasets in made.items():
        turning = [dataset["frames"].values for dataset in datasets]
        if len(turning) > 1 and len({frames.shape for frames in turning}) == 1:
            pictures[f"{scene}-turning-light"] = np.stack(
                [contact_sheet(np.stack(at)) for at in zip(*turning, strict=True)]
            )
    return pictures


SSDF = System(
    name="ssdf_lighting",
    title="Image-based lighting by SSDFs",
    dimensions=(
        Dimension(
            "scene",
            builtin=SCENES,
            examples=("court",),
            default="teapot",
            suffixes=(".ply", ".obj", ".stl", ".glb", ".gltf"),
            check=_check_scene,
        ),
        Dimension(
            "environment",
            builtin=(*ENVIRONMENTS, "uniform"),
            examples=("sky",),
            default="sky",
            suffixes=(".hdr", ".exr"),
            check=_check_environment,
        ),
    ),
    overview=_overview,
)
