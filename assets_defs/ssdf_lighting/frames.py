"""What the lit scenes look like: `relit_frames`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.ssdf_lighting.compression import decoder_of_basis, distance_blocks
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.ssdf_lighting.lights import lights_of
from assets_defs.ssdf_lighting.meshes import scene_of
from assets_defs.system import Metadata
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_GAIN = 8.0
"""Of the pictures of differences."""


class FrameSettings(Settings):
    """The pictures."""

    width: int = Field(480, ge=32, le=4096, description="Pixels across, 4:3")
    frames: int = Field(12, ge=1, le=720, description="Pictures of the turning light")
    reference_samples: int = Field(
        16, ge=2, le=65_536, description="Rays a pixel of the traced picture"
    )
    azimuth: float = Field(-62.0, ge=-360.0, le=360.0, description="The camera's, degrees")
    elevation: float = Field(24.0, ge=-89.0, le=89.0, description="The camera's, degrees")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"width": 96, "frames": 2, "reference_samples": 8},
        "paper": {"width": 640, "frames": 36, "reference_samples": 128},
    }


def _frame_pictures(dataset: xr.Dataset) -> Pictures:
    import numpy as np

    from pipelines.drawing.contact_sheet import contact_sheet
    from pipelines.ssdf_lighting.drawing.pictures import error_map

    first, reference = dataset["frames"].values[0], dataset["reference"].values
    uncompressed = dataset["uncompressed"].values
    return {
        "lit": first,
        "turning-light": contact_sheet(dataset["frames"].values[:6]),
        "traced-beside-lit": np.hstack([reference, first]),
        "errors": np.hstack(
            [error_map(first, uncompressed, _GAIN), error_map(first, reference, _GAIN / 2)]
        ),
        "clusters": dataset["clusters"].values,
    }


def _psnr(checked: StoredVersion, reference: str) -> float:
    from pipelines.ssdf_lighting.drawing.frames import psnr

    dataset = checked.dataset
    return psnr(
        dataset["frames"].values[0], dataset[reference].values, dataset["covered"].values > 0.999
    )


def _relit_psnr(checked: StoredVersion) -> float:
    return _psnr(checked, "uncompressed")


def _reference_psnr(checked: StoredVersion) -> float:
    return _psnr(checked, "reference")


def _mean_brightness(checked: StoredVersion) -> float:
    dataset = checked.dataset
    shown = dataset["frames"].values[:, dataset["covered"].values > 0.999]
    return float(shown.astype("float64").mean() / 255.0)


def _coverage(checked: StoredVersion) -> float:
    return float(checked.dataset["covered"].values.mean())


@SSDF.asset(
    schemas.RELIT_FRAMES,
    by=("scene", "environment"),
    settings=FrameSettings,
    inputs=("scene_mesh", "ssdf_matrix", "triangle_clusters", "ssdf_basis", "environment_lights"),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_frame_pictures,
    checks=(
        Check(
            "relit_psnr",
            "PSNR of the first frame, 8 bit, scene pixels, against SSDFs not compressed, dB.",
            _relit_psnr,
            at_least=36.0,
            change=1.0,
        ),
        Check(
            "reference_psnr",
            "The same against the traced picture, dB.",
            _reference_psnr,
            at_least=16.0,
            change=0.5,
        ),
        Check(
            "coverage",
            "Share of the picture with the scene.",
            _coverage,
            at_least=0.05,
            change=0.01,
        ),
        Check(
            "mean_brightness",
            "Mean of the scene's 8-bit codes, in [0, 1].",
            _mean_brightness,
            at_least=0.02,
            at_most=0.98,
            change=0.01,
        ),
    ),
)
def relit_frames(
    settings: FrameSettings,
    progress: Callable[[float], None],
    scene_mesh: xr.Dataset,
    ssdf_matrix: xr.Dataset,
    triangle_clusters: xr.Dataset,
    ssdf_basis: xr.Dataset,
    environment_lights: xr.Dataset,
) -> Result:
    """Draw the scene under the turning light; the first frame also not compressed, and traced."""
    import numpy as np
    import xarray as xr

    from pipelines.ssdf_lighting.compression.decoding import distances_along, matrix_along
    from pipelines.ssdf_lighting.drawing import frames

    scene, lights = scene_of(scene_mesh), lights_of(environment_lights)
    size = (settings.width, settings.width * 3 // 4)
    camera = frames.scene_camera(scene, settings.azimuth, settings.elevation, size[0] / size[1])
    decoder = decoder_of_basis(ssdf_basis, len(scene.vertices))
    turns = [360.0 * number / settings.frames for number in range(settings.frames)]
    turn = frames.turning(
        scene,
        lights,
        lambda vertices, axes: distances_along(decoder, vertices, axes),
        camera,
        size,
        turns,
        lambda fraction: progress(0.3 * fraction),
    )
    exact = frames.turning(
        scene,
        lights,
        lambda vertices, axes: _along_stored(ssdf_matrix, vertices, axes, matrix_along),
        camera,
        size,
        turns[:1],
    )
    progress(0.4)
    reference = frames.traced(
        scene,
        lights,
        camera,
        size,
        settings.reference_samples,
        progress=lambda fraction: progress(0.4 + 0.6 * fraction),
    )
    scale = frames.scene_exposure(turn)
    pixels = ("y", "x", "channel")
    backdrop = turn.radiance[0] * (reference.radiance[..., 3:] == 0)
    dataset = xr.Dataset(
        {
            "frames": (("frame", *pixels), frames.exposed(turn.radiance, scale)),
            "turn": (("frame",), np.array(turns)),
            "exposure": ((), scale),
            "uncompressed": (pixels, frames.exposed(exact.radiance[0], scale)),
            "reference": (pixels, frames.exposed(reference.radiance[..., :3] + backdrop, scale)),
            "clusters": (
                pixels,
                frames.cluster_picture(scene, triangle_clusters["cluster"].values, camera, size),
            ),
            "covered": (("y", "x"), turn.covered),
        }
    )
    return dataset, {
        "frames a second": 1.0 / float(np.median(turn.seconds)),
        "renderer": turn.renderer,
        "sharpest λ": float(lights.sharpness.max()),
    }


def _along_stored(
    ssdf_matrix: xr.Dataset,
    vertices: NDArray[np.int64],
    axes: NDArray[np.float32],
    look_up: Callable[..., NDArray[np.float32]],
) -> NDArray[np.float32]:
    """Distances from the stored matrix, block by block; ``vertices`` are ascending."""
    import numpy as np

    found = np.empty(axes.shape[:2], np.float32)
    for rows, block in distance_blocks(ssdf_matrix):
        inside = np.flatnonzero((vertices >= rows[0]) & (vertices <= rows[-1]))
        found[inside] = look_up(block, vertices[inside] - rows[0], axes[inside])
    return found
