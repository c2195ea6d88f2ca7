"""What the compressed BTF looks like: `restored_images`, `cloth_frames`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    abrdf_reader,
    cloth_frames_dataset,
    compressed_btf_of,
    pairs_of,
    restored_images_dataset,
)
from assets_defs.neural_btf.declaration import BTF, NONE
from assets_defs.settings import Preset, Settings
from assets_defs.system import Pictures, Progress, Result
from pipelines.neural_btf import figures
from storage.errors import NoVersionError
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion
from storage.versions import Slot

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.light.directions import Pairs

_BLOCK_BYTES = 96 << 20


# ---- restored_images -------------------------------------------------------------------------


class RestoreSettings(Settings):
    """Nothing to choose: figure 7's pairs, and the errors of all photographs."""


def _restored_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.light.directions import Pairs
    from pipelines.neural_btf.pictures import error_picture, restored_picture

    shown = Pairs(dataset["pair_light"].values, dataset["pair_view"].values)
    return {
        "restored": restored_picture(dataset["original"].values, dataset["restored"].values, shown),
        "errors": error_picture(
            dataset["rmse_texel"].values,
            dataset["rmse_image"].values,
            Pairs(dataset["light"].values, dataset["view"].values),
        ),
    }


def _rmse(version: StoredVersion) -> float:
    return float(version.dataset["rmse"])


def _rmse_over_none(version: StoredVersion) -> float | None:
    """Against the same material's version without clusters, if it was made alike."""
    clusters, material = version.slot.partition.split(".", 1)
    if clusters == NONE:
        return None
    try:
        without = _made_of(version, f"{NONE}.{material}")
        slot = Slot(BTF.name, "restored_images", f"{NONE}.{material}")
        rmse_without = float(version.store.open(slot)["rmse"])
        own = _made_of(version, version.slot.partition)
    except NoVersionError:
        return None
    return float(version.dataset["rmse"]) / rmse_without if own == without else None


def _made_of(version: StoredVersion, partition: str) -> tuple[Any, str]:
    """Settings and ABRDFs (their content) that a partition's current network was trained with."""
    record = version.store.record(Slot(BTF.name, "neural_btf", partition))
    (content,) = (i["content"] for i in record["inputs"] if i["asset"] == "abrdf_matrix")
    return record["settings"], content


def _worst_image(version: StoredVersion) -> float:
    return float(version.dataset["rmse_image"].max())


def _worst_texel(version: StoredVersion) -> float:
    return float(version.dataset["rmse_texel"].max())


@BTF.asset(
    schemas.RESTORED_IMAGES,
    by=("material", "clusters"),
    settings=RestoreSettings,
    inputs=("btf_images", "abrdf_matrix", "compressed_btf"),
    pictures=_restored_pictures,
    checks=(
        Check(
            "rmse",
            "RMSE of all photographs, values over alpha.",
            _rmse,
            at_most=0.12,
            change=0.002,
        ),
        Check(
            "rmse_over_none",
            "RMSE over that of the same material without clusters.",
            _rmse_over_none,
            at_most=3.0,
            change=0.05,
        ),
        Check(
            "worst_image",
            "RMSE of the worst pair of directions.",
            _worst_image,
            at_most=0.5,
            change=0.05,
        ),
        Check(
            "worst_texel",
            "RMSE of the worst texel.",
            _worst_texel,
            at_most=0.5,
            change=0.05,
        ),
    ),
)
def restored_images(
    settings: RestoreSettings,
    progress: Progress,
    btf_images: xr.Dataset,
    abrdf_matrix: xr.Dataset,
    compressed_btf: xr.Dataset,
) -> Result:
    """Restore figure 7's photographs, and compare all of them with what was measured."""
    from pipelines.neural_btf.pictures import PAPER_PAIRS, nearest_images
    from pipelines.neural_btf.restoration import restoration_errors

    stored, pairs = compressed_btf_of(compressed_btf), pairs_of(btf_images)
    block = max(1, _BLOCK_BYTES // (len(pairs.light) * 3 * 4))
    errors = restoration_errors(
        stored, abrdf_reader(abrdf_matrix), pairs, block=block, progress=progress
    )
    shown = nearest_images(pairs, PAPER_PAIRS)
    rows = _error_rows(pairs, errors.of_image, [*shown, int(errors.of_image.argmax())])
    return restored_images_dataset(stored, errors, btf_images, shown), {
        "RMSE over alpha": errors.rmse,
        "pairs shown, and the worst": rows,
    }


def _error_rows(
    pairs: Pairs, of_image: NDArray[np.float64], numbers: Sequence[int]
) -> list[dict[str, Any]]:
    """What the web UI's table says of the photographs with these numbers."""
    import numpy as np

    return [
        {
            "image": int(number),
            "view theta": float(np.degrees(pairs.view[number, 0])),
            "view phi": float(np.degrees(pairs.view[number, 1])),
            "light theta": float(np.degrees(pairs.light[number, 0])),
            "light phi": float(np.degrees(pairs.light[number, 1])),
            "RMSE": float(of_image[number]),
        }
        for number in numbers
    ]


# ---- cloth_frames ----------------------------------------------------------------------------


class ClothSettings(Settings):
    """The panel and its pictures."""

    width: int = Field(320, ge=32, le=8192, description="Width of the pictures, pixels")
    frames: int = Field(6, ge=1, le=720, description="Lights around the panel")
    tiles: float = Field(4.0, gt=0.0, le=100.0, description="Tiles over the panel's width")
    supersampling: int = Field(2, ge=1, le=8, description="Samples a pixel along each axis")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"width": 64, "frames": 2, "supersampling": 1},
        "paper": {"width": 960, "frames": 24},
    }


def _cloth_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.drawing.contact_sheet import contact_sheet

    count = dataset.sizes["frame"]
    shown = sorted({round(i * count / 6) for i in range(6)} & set(range(count)))
    return {"frames": contact_sheet(dataset["frames"].values[shown])}


def _coverage(version: StoredVersion) -> float:
    return float(version.dataset["coverage"])


def _mean_brightness(version: StoredVersion) -> float:
    return figures.mean_brightness(version.dataset["frames"].values)


@BTF.asset(
    schemas.CLOTH_FRAMES,
    by=("material", "clusters"),
    settings=ClothSettings,
    inputs=("compressed_btf",),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_cloth_pictures,
    checks=(
        Check(
            "coverage",
            "Share of the picture with cloth: nothing drawn is 0.",
            _coverage,
            at_least=0.3,
            change=0.01,
        ),
        Check(
            "mean_brightness",
            "Mean of all pictures' 8-bit codes, in [0, 1].",
            _mean_brightness,
            at_least=0.02,
            at_most=0.95,
            change=0.01,
        ),
    ),
)
def cloth_frames(settings: ClothSettings, progress: Progress, compressed_btf: xr.Dataset) -> Result:
    """Draw a folded panel of the decoded material under a light that moves around it."""
    from pipelines.neural_btf.panel import draw_frames, moving_lights

    lights = moving_lights(settings.frames)
    frames = draw_frames(
        compressed_btf_of(compressed_btf),
        lights,
        width=settings.width,
        tiles=settings.tiles,
        supersampling=settings.supersampling,
        progress=progress,
    )
    return cloth_frames_dataset(frames, lights), {"frames": settings.frames}
