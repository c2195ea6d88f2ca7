"""A draped cloth of the compressed BTF: `cloth_frames`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import cloth_frames_dataset, compressed_btf_of, pairs_of
from assets_defs.neural_btf.declaration import BTF
from assets_defs.settings import Preset, Settings
from assets_defs.system import Pictures, Progress, Result
from pipelines.neural_btf.draping.picture_errors import error_over_flat
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr


class ClothSettings(Settings):
    """The pictures of the draped cloth."""

    width: int = Field(256, ge=32, le=8192, description="Width, pixels")
    frames: int = Field(6, ge=1, le=720, description="Pictures of the orbit, and of the light")
    cloth_samples: int = Field(24, ge=2, le=4096, multiple_of=2, description="Samples a pixel")
    tiles: float = Field(20.0, gt=0.0, le=1000.0, description="Tiles along the cloth's 2 metres")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"width": 64, "frames": 2, "cloth_samples": 4},
        "paper": {"width": 640, "frames": 16, "cloth_samples": 128},
    }


def _cloth_pictures(dataset: xr.Dataset) -> Pictures:
    return {
        "draped": dataset["orbit"].values[0],
        "orbit": dataset["orbit"].values,
        "moving-light": dataset["moving_light"].values,
        "close-up": dataset["closeup"].values,
    }


def _closeup_over_flat(version: StoredVersion) -> float:
    return error_over_flat(version.dataset["compared"].values)


@BTF.asset(
    schemas.CLOTH_FRAMES,
    by=("material", "clusters"),
    settings=ClothSettings,
    inputs=("btf_images", "compressed_btf"),
    pictures=_cloth_pictures,
    checks=(
        Check(
            "closeup_over_flat",
            "RMSE of the close-up to the measured BTF's, over the mean colour's, which is 1.",
            _closeup_over_flat,
            at_most=0.85,
            change=0.05,
        ),
    ),
)
def cloth_frames(
    settings: ClothSettings, progress: Progress, btf_images: xr.Dataset, compressed_btf: xr.Dataset
) -> Result:
    """Draw a draped cloth of the decoded material under a sky: around it, and from close by."""
    from pipelines.neural_btf.draping.frames import Shots, draw_frames

    frames = draw_frames(
        compressed_btf_of(compressed_btf),
        btf_images["images"].values,
        pairs_of(btf_images),
        Shots(settings.width, settings.cloth_samples, settings.frames, settings.tiles),
        progress,
    )
    return cloth_frames_dataset(frames), {"frames": settings.frames}
