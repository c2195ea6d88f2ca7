"""The system: what its assets are partitioned by, and what can be made at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.sources import Source
from assets_defs.system import Dimension, Pictures, System
from pipelines.virtual.cloth.weaves import MATERIALS
from storage.readers.btf import open_btf
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NONE = "none"
"""The column of the tables without clusters: every texel has its own latents."""


def _check_material(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        open_btf(source.path, settings.get("crop"), settings.get("exr_colours", "auto"))
    elif settings.get("crop") is not None:
        raise ValueError(f"crop is set for {source.name}; expected a BTF of yours.")


def _material_walls(store: VersionedStore, slots: Sequence[Slot]) -> Pictures:
    """The materials side by side under the moving light, one wall for each number of clusters."""
    from pipelines.neural_btf.pictures import material_wall

    found: dict[str, list[NDArray[np.uint8]]] = {}
    for slot in slots:
        if slot.system == BTF.name and slot.asset == "cloth_frames":
            clusters = slot.partition.partition(".")[0]
            found.setdefault(clusters, []).append(store.open(slot)["moving_light"].values)
    return {
        f"wall-{clusters}": material_wall(panels)
        for clusters, panels in found.items()
        if len(panels) > 1 and len({panel.shape for panel in panels}) == 1
    }


BTF = System(
    name="neural_btf",
    title="BTFs compressed by a neural network",
    dimensions=(
        Dimension(
            "material",
            builtin=tuple(MATERIALS),
            examples=("knit",),
            default="knit",
            suffixes=(".zip", ".btf"),
            folders=True,
            check=_check_material,
        ),
        Dimension(
            "clusters",
            builtin=(NONE, "100", "500", "1000", "2000"),
            examples=(NONE,),
            default=NONE,
            suffixes=(),
            numbers=True,
            check=lambda source, settings: None,
        ),
    ),
    overview=_material_walls,
)
