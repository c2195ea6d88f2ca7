"""What the street looks like: `street_frames`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.street_billboards.datasets import (
    frames_dataset,
    model_of,
    true_pictures,
    viewpoints_of,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.street_billboards.drive import OFFSETS
from assets_defs.system import Pictures, Progress, Result
from pipelines.street_billboards import figures
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr


class FrameSettings(Settings):
    """The pictures."""

    flight_frames: int = Field(24, ge=2, le=2000, description="Pictures of the flight")
    supersampling: int = Field(2, ge=1, le=4, description="Samples along a pixel's side")
    swerve: float = Field(2.5, ge=0, le=20, description="Metres that the flight leaves the path")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"flight_frames": 2},
        "paper": {"flight_frames": 120},
    }


def _pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.drawing.contact_sheet import contact_sheet

    truth, rendered = dataset["truth"].values, dataset["rendered"].values
    sheet = np.concatenate([truth[:2], rendered[:2], dataset["alone"].values[:2]])
    pictures = {
        "held-out": np.vstack(
            [np.hstack(list(sheet[number :: len(truth[:2])])) for number in range(len(truth[:2]))]
        ),
        "flight": contact_sheet(
            dataset["flight"].values[:: max(dataset.sizes["frame"] // 6, 1)][:6]
        ),
    }
    beside = np.hstack(list(dataset["beside"].values[0]))
    if "beside_truth" in dataset:
        beside = np.vstack([np.hstack(list(dataset["beside_truth"].values[0])), beside])
    pictures["beside-the-path"] = beside
    return pictures


def _coverage(version: StoredVersion) -> float:
    return float(version.dataset["covered"].mean())


def _held_out_psnr(version: StoredVersion) -> float:
    """Anew, from the stored pictures."""
    dataset = version.dataset
    return figures.mean_psnr(
        dataset["rendered"].values, dataset["truth"].values, dataset["covered"].values
    )


def _mean(name: str) -> Callable[[StoredVersion], float]:
    return lambda version: float(version.dataset[name].mean())


def _shader_difference(version: StoredVersion) -> float:
    dataset = version.dataset
    return figures.differing_share(dataset["shaded"].values, dataset["decoded"].values)


@STREET.asset(
    schemas.STREET_FRAMES,
    by=("drive",),
    settings=FrameSettings,
    inputs=("drive_frames", "depth_maps", "billboards", "eigen_textures", "texture_atlases"),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_pictures,
    checks=(
        Check(
            "coverage",
            "Share of the held-out frames' pixels that billboards cover.",
            _coverage,
            at_least=0.4,
            change=0.01,
        ),
        Check(
            "held_out_psnr",
            "PSNR of held-out frames where covered, 8 bit, at their exposure, dB.",
            _held_out_psnr,
            at_least=14.0,
            change=0.3,
        ),
        Check(
            "held_out_ssim",
            "SSIM, likewise.",
            _mean("ssim"),
            at_least=0.3,
            change=0.02,
        ),
        Check(
            "held_out_flip",
            "FLIP, likewise; 0 = alike.",
            _mean("flip"),
            at_most=0.4,
            change=0.01,
        ),
        Check(
            "shader_difference",
            "Share of the pixels in which the shader and the processor's decoder differ by more "
            "than one grey level.",
            _shader_difference,
            at_most=0.01,
        ),
    ),
)
def street_frames(
    settings: FrameSettings,
    progress: Progress,
    drive_frames: xr.Dataset,
    depth_maps: xr.Dataset,
    billboards: xr.Dataset,
    eigen_textures: xr.Dataset,
    texture_atlases: xr.Dataset,
) -> Result:
    """Draw the street from the path, from beside it and from where frames were held out."""
    from pipelines.street_billboards.frames import draw_frames

    truth = true_pictures(drive_frames)
    drawn = draw_frames(
        model_of(billboards, texture_atlases, eigen_textures, depth_maps),
        viewpoints_of(drive_frames, OFFSETS, settings.flight_frames, settings.swerve),
        truth,
        supersampling=settings.supersampling,
        progress=lambda fraction: progress(0.8 * fraction),
    )
    beside = drive_frames["beside"].values if "beside" in drive_frames else None
    dataset = frames_dataset(drawn, truth, OFFSETS, beside)
    return dataset, {
        "renderer": drawn.renderer,
        "billboards in view": drawn.visible_billboards,
        "PSNR of held-out frames, dB": float(dataset["psnr"].mean()),
    }
