"""What the street looks like: `street_frames`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.street_billboards.datasets import billboards_of, compressed_of, pages_of
from assets_defs.street_billboards.declaration import STREET
from assets_defs.street_billboards.drive import OFFSETS
from assets_defs.system import Metadata
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]


_UNSEEN = 2
"""Frames that the flight leaves out: nobody before them saw the ground that they look at."""


class FrameSettings(Settings):
    """The pictures."""

    flight_frames: int = Field(24, ge=2, le=2000, description="Pictures of the flight")
    supersampling: int = Field(2, ge=1, le=4, description="Samples along a pixel's side")
    swerve: float = Field(2.5, ge=0, le=20, description="Metres that the flight leaves the path")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"flight_frames": 2},
        "paper": {"flight_frames": 120},
    }


def _frame_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

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


def _mean(name: str) -> Callable[[StoredVersion], float]:
    return lambda checked: float(checked.dataset[name].mean())


def _psnr_anew(checked: StoredVersion) -> float:
    """From the stored pictures."""
    import numpy as np

    from pipelines.street_billboards.figures import psnr

    dataset = checked.dataset
    pictures = zip(
        dataset["rendered"].values, dataset["truth"].values, dataset["covered"].values, strict=True
    )
    return float(np.mean([psnr(*one) for one in pictures]))


def _coverage(checked: StoredVersion) -> float:
    return float(checked.dataset["covered"].mean())


def _shader_difference(checked: StoredVersion) -> float:
    """Share of the pixels in which shader and processor differ by more than a grey level."""
    import numpy as np

    dataset = checked.dataset
    apart = np.abs(dataset["shaded"].values.astype(int) - dataset["decoded"].values)
    return float((apart.max(axis=-1) > 1).mean())


@STREET.asset(
    schemas.STREET_FRAMES,
    by=("drive",),
    settings=FrameSettings,
    inputs=("drive_frames", "depth_maps", "billboards", "eigen_textures", "texture_atlases"),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_frame_pictures,
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
            _psnr_anew,
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
    progress: Callable[[float], None],
    drive_frames: xr.Dataset,
    depth_maps: xr.Dataset,
    billboards: xr.Dataset,
    eigen_textures: xr.Dataset,
    texture_atlases: xr.Dataset,
) -> Result:
    """Draw the street from the path, from beside it and from where frames were held out."""
    import numpy as np
    import xarray as xr

    from pipelines.drawing.colour import to_8bit
    from pipelines.geometry.cameras import moved_left
    from pipelines.street_billboards import figures
    from pipelines.street_billboards.drawing import frames

    made = billboards_of(billboards)
    sky = depth_maps["sky"].values
    middle = drive_frames.sizes["camera"] // 2
    intrinsics = drive_frames["intrinsics"].values[middle]
    poses = drive_frames["poses"].values[:, middle]
    kept = drive_frames["held_out"].values
    truth = drive_frames["photographs"].isel(frame=kept, camera=middle).values
    size = (drive_frames.sizes["x"], drive_frames.sizes["y"])
    held = poses[kept]
    beside = [moved_left(pose, offset) for pose in held for offset in OFFSETS]
    flight = frames.flight(poses[_UNSEEN:], settings.flight_frames, settings.swerve)
    with frames.StreetStage(
        made, pages_of(texture_atlases), sky, size, supersampling=settings.supersampling
    ) as stage:
        views = []
        for number, pose in enumerate([*held, *beside, *flight]):
            views.append(stage.view(intrinsics, pose))
            progress(0.8 * number / (len(held) + len(beside) + len(flight)))
    seen = [view.covered > 0.5 for view in views]
    shown = [to_8bit(view.with_sky) for view in views]
    rendered = [
        figures.match_exposure(picture, true, where)
        for picture, true, where in zip(shown, truth, seen, strict=False)
    ]
    likeness = [figures.image_metrics(*one) for one in zip(rendered, truth, seen, strict=False)]
    shaded, decoded = frames.compared(
        made, pages_of(texture_atlases), compressed_of(eigen_textures), intrinsics, held[0], size
    )
    first, last = len(held), len(held) + len(beside)
    by_offset = (len(held), len(OFFSETS), size[1], size[0])
    pixels = ("y", "x", "channel")
    dataset = xr.Dataset(
        {
            "flight": (("frame", *pixels), np.stack(shown[last:])),
            "rendered": (("held", *pixels), np.stack(rendered)),
            "truth": (("held", *pixels), truth),
            "alone": (("held", *pixels), np.stack([to_8bit(v.alone) for v in views[:first]])),
            "covered": (("held", "y", "x"), np.stack(seen[:first])),
            "beside": (
                ("held", "offset", *pixels),
                np.stack(shown[first:last]).reshape(*by_offset, 3),
            ),
            "beside_covered": (
                ("held", "offset", "y", "x"),
                np.stack(seen[first:last]).reshape(by_offset),
            ),
            "offset": (("offset",), np.array(OFFSETS)),
            "shaded": (pixels, shaded),
            "decoded": (pixels, decoded),
            **{
                name: (("held",), np.array([getattr(one, name) for one in likeness]))
                for name in ("psnr", "ssim", "flip")
            },
        }
    )
    if "beside" in drive_frames:
        dataset["beside_truth"] = (("held", "offset", *pixels), drive_frames["beside"].values)
    return dataset, {
        "renderer": stage.renderer_name,
        "billboards in view": views[0].billboards,
        "PSNR of held-out frames, dB": float(dataset["psnr"].mean()),
    }
