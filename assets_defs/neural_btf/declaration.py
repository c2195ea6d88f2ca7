"""The system: what its assets are partitioned by, and what can be made at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field

from assets_defs.settings import Preset, Settings
from assets_defs.system import Dimension, Source, System
from pipelines.neural_btf.virtual_cloth import MATERIALS
from storage.readers.btf import open_btf
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NONE = "none"
"""The column of the tables without clusters: every texel has its own latents."""


class ImageSettings(Settings):
    """How the BTF is taken in, or measured on the virtual gonioreflectometer."""

    crop: tuple[int, int, int, int] | None = Field(
        None, description="Left, top, width, height in pixels; whole photographs by default"
    )
    texels: int = Field(64, ge=4, le=1024, description="Virtual cloth: texels a side")
    directions: Literal[15, 41, 81, 151] = Field(
        41, description="Virtual cloth: directions of lights, and of views (15, 41, 81 or 151)"
    )
    samples: int = Field(2, ge=1, le=256, description="Virtual cloth: rays a texel")
    cloth_seed: int = Field(0, ge=0, description="Virtual cloth: seed")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"texels": 12, "directions": 15, "samples": 1},
        "paper": {"texels": 100, "directions": 81, "samples": 4},
    }


def _check_material(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        open_btf(source.path, settings.get("crop"))
    elif settings.get("crop") is not None:
        raise ValueError(f"crop is set for {source.name}; expected a BTF of yours.")


def _check_clusters(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Refuse more clusters than texels before anything is made."""
    if "clusters" not in sources or sources["clusters"].key == NONE:
        return
    taken_in = settings["btf_images"]
    assert isinstance(taken_in, ImageSettings)
    path = sources["material"].path
    if path is None:
        texels = taken_in.texels**2
    else:
        measured = open_btf(path, taken_in.crop)
        texels = measured.height * measured.width
    if int(sources["clusters"].key) > texels:
        raise ValueError(
            f"{sources['material'].name}: clusters is {sources['clusters'].key}; "
            f"expected at most {texels}, the number of texels."
        )


def _wall(store: VersionedStore, slots: Sequence[Slot]) -> Mapping[str, NDArray[np.uint8]]:
    """The materials side by side under the moving light, one wall for each number of clusters."""
    from pipelines.neural_btf.pictures import wall

    found: dict[str, list[NDArray[np.uint8]]] = {}
    for slot in slots:
        if slot.system == BTF.name and slot.asset == "cloth_frames":
            clusters = slot.partition.partition(".")[0]
            found.setdefault(clusters, []).append(store.open(slot)["frames"].values)
    return {
        f"wall-{clusters}": wall(panels)
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
            examples=tuple(MATERIALS),
            default="knit",
            suffixes=(".zip", ".btf"),
            folders=True,
            check=_check_material,
        ),
        Dimension(
            "clusters",
            builtin=(NONE, "100", "500", "1000", "2000"),
            examples=(NONE, "100"),
            default=NONE,
            suffixes=(),
            numbers=True,
            check=lambda source, settings: None,
        ),
    ),
    check=_check_clusters,
    overview=_wall,
)
