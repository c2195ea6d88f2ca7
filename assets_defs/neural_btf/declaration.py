"""The system: what its assets are partitioned by, and what can be made at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field

from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import Dimension, System
from pipelines.virtual.cloth.weaves import MATERIALS
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
    texels: int = Field(48, ge=4, le=1024, description="Virtual cloth: texels a side")
    directions: Literal[15, 41, 81, 151] = Field(
        41, description="Virtual cloth: directions of lights, and of views (15, 41, 81 or 151)"
    )
    samples: int = Field(2, ge=1, le=256, description="Virtual cloth: rays a texel")
    cloth_seed: int = Field(0, ge=0, description="Virtual cloth: seed")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"texels": 12, "directions": 15, "samples": 1},
        "paper": {"texels": 100, "directions": 81, "samples": 4},
    }


class NetworkSettings(Settings):
    """How the network is trained."""

    training: Literal["fast", "paper"] = Field(
        "fast", description="paper: SGD on five ABRDFs through the encoder; fast: see docs/btf.md"
    )
    steps: int = Field(250, ge=1, description="Fast: steps of gradient descent")
    rate: float = Field(0.01, gt=0.0, le=1.0, description="Fast: largest learning rate")
    batch_texels: int = Field(64, ge=1, description="Fast: texels of a batch")
    batch_images: int = Field(128, ge=1, description="Fast: photographs of a batch")
    warm_start: Literal["pca", "encoder", "random"] = Field(
        "pca", description="Fast: where the latents start"
    )
    encoder_share: float = Field(
        0.25, ge=0.0, le=1.0, description="Warm start encoder: share of the steps through it"
    )
    encoder_steps: int = Field(
        25, ge=0, description="Fast: steps of fitting the encoder to the latents at the end"
    )
    paper_steps: int = Field(2000, ge=1, description="Paper: steps of gradient descent")
    paper_rate: float = Field(0.08, gt=0.0, le=1.0, description="Paper: learning rate")
    paper_batch: int = Field(
        5, ge=2, description="Paper: ABRDFs of a batch, each with all its directions (our reading)"
    )
    targets: Literal["texels", "representatives"] = Field(
        "texels", description="Paper: fit every texel, or its cluster's representative (unsaid)"
    )
    widths: list[int] = Field(
        [],
        max_length=9,
        description="Channels of the encoder's blocks (unsaid); empty: 8, 16, 16, …",
    )
    network_seed: int = Field(0, ge=0, description="Seed of the network and its batches")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"steps": 120, "batch_images": 64, "encoder_steps": 10, "paper_steps": 30},
        "paper": {"steps": 16_000, "encoder_steps": 300, "paper_steps": 200_000},
    }


def _check_material(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        open_btf(source.path, settings.get("crop"))
    elif settings.get("crop") is not None:
        raise ValueError(f"crop is set for {source.name}; expected a BTF of yours.")


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
    overview=_wall,
)


@BTF.before_work
def _check_sizes(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Refuse more clusters than texels, and too deep an encoder, before anything is made."""
    if "clusters" not in sources:
        return
    taken_in, network = settings["btf_images"], settings["neural_btf"]
    assert isinstance(taken_in, ImageSettings)
    assert isinstance(network, NetworkSettings)
    material, clusters = sources["material"], sources["clusters"].key
    if material.path is None:
        texels, images = taken_in.texels**2, taken_in.directions**2
    else:
        measured = open_btf(material.path, taken_in.crop)
        texels, images = measured.height * measured.width, measured.images
    if clusters != NONE and int(clusters) > texels:
        raise ValueError(
            f"{material.name}: clusters is {clusters}; expected at most {texels}, the number of "
            "texels."
        )
    if 3 ** len(network.widths) > images or any(width < 1 for width in network.widths):
        raise ValueError(
            f"{material.name}: widths is {network.widths}; expected fewer positive numbers, as "
            f"every block leaves a third of {images} photographs."
        )
