"""What the compressed BTF looks like: `restored_images`, `cloth_frames`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    compressed,
    pairs_of,
    reader,
)
from assets_defs.neural_btf.declaration import BTF, NONE
from assets_defs.settings import Preset, Settings
from assets_defs.system import Metadata
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion
from storage.versions import Slot

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

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


def _rmse(checked: StoredVersion) -> float:
    return float(checked.dataset["rmse"])


def _rmse_over_none(checked: StoredVersion) -> float | None:
    """Against the same material's version without clusters, if it was made alike."""
    from storage.errors import NoVersionError

    clusters, material = checked.slot.partition.split(".", 1)
    if clusters == NONE:
        return None
    store, names = checked.store, ("neural_btf", "restored_images")
    try:
        slots = {name: Slot(BTF.name, name, f"{NONE}.{material}") for name in names}
        other = store.record(slots["neural_btf"])
        without = float(store.open(slots["restored_images"])["rmse"])
        own_slot = Slot(BTF.name, "neural_btf", checked.slot.partition)
        own = store.record(own_slot)
    except NoVersionError:
        return None
    alike = [
        (
            record["settings"],
            next(i["content"] for i in record["inputs"] if i["asset"] == "abrdf_matrix"),
        )
        for record in (own, other)
    ]
    return float(checked.dataset["rmse"]) / without if alike[0] == alike[1] else None


def _worst(name: str) -> Callable[[StoredVersion], float]:
    def worst(checked: StoredVersion) -> float:
        return float(checked.dataset[name].max())

    return worst


_worst_image = _worst("rmse_image")
_worst_texel = _worst("rmse_texel")


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
    progress: Callable[[float], None],
    btf_images: xr.Dataset,
    abrdf_matrix: xr.Dataset,
    compressed_btf: xr.Dataset,
) -> Result:
    """Restore figure 7's photographs, and compare all of them with what was measured."""
    import numpy as np
    import xarray as xr

    from pipelines.light.directions import Pairs
    from pipelines.neural_btf.compressed import restoration_errors
    from pipelines.neural_btf.pictures import PAPER_PAIRS, nearest_images

    stored = compressed(compressed_btf)
    pairs = pairs_of(btf_images)
    chosen = nearest_images(pairs, PAPER_PAIRS)
    shown = Pairs(pairs.light[chosen], pairs.view[chosen])
    abrdfs = abrdf_matrix["abrdfs"]
    texels = max(1, _BLOCK_BYTES // (abrdfs.shape[1] * 3 * 4))
    errors = restoration_errors(stored, reader(abrdfs), pairs, block=texels, progress=progress)
    pixels = ("y", "x")
    dataset = xr.Dataset(
        {
            "original": (
                ("pair", *pixels, "channel"),
                btf_images["images"][chosen].values.astype(np.float32),
            ),
            "restored": (("pair", *pixels, "channel"), stored.photographs(shown)),
            "pair_light": (("pair", "angle"), shown.light),
            "pair_view": (("pair", "angle"), shown.view),
            "rmse": ((), errors.rmse),
            "rmse_image": ("image", errors.of_image),
            "rmse_texel": (pixels, errors.of_texel.reshape(stored.height, stored.width)),
            "light": btf_images["light"],
            "view": btf_images["view"],
        }
    )
    worst = int(errors.of_image.argmax())
    rows = [
        {
            "image": int(number),
            "view theta": float(np.degrees(pairs.view[number, 0])),
            "view phi": float(np.degrees(pairs.view[number, 1])),
            "light theta": float(np.degrees(pairs.light[number, 0])),
            "light phi": float(np.degrees(pairs.light[number, 1])),
            "RMSE": float(errors.of_image[number]),
        }
        for number in (*chosen, worst)
    ]
    return dataset, {"RMSE over alpha": errors.rmse, "pairs shown, and the worst": rows}


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


def _coverage(checked: StoredVersion) -> float:
    return float(checked.dataset["coverage"])


def _mean_brightness(checked: StoredVersion) -> float:
    return float(checked.dataset["frames"].values.mean() / 255.0)


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
def cloth_frames(
    settings: ClothSettings,
    progress: Callable[[float], None],
    compressed_btf: xr.Dataset,
) -> Result:
    """Draw a folded panel of the decoded material under a light that moves around it."""
    import xarray as xr

    from pipelines.neural_btf.panel import draw_frames, moving_lights

    lights = moving_lights(settings.frames)
    drawn = draw_frames(
        compressed(compressed_btf),
        lights,
        width=settings.width,
        tiles=settings.tiles,
        supersampling=settings.supersampling,
        progress=progress,
    )
    dataset = xr.Dataset(
        {
            "frames": (("frame", "y", "x", "channel"), drawn.pictures),
            "light_direction": (("frame", "angle"), lights),
            "coverage": ((), drawn.coverage),
        }
    )
    return dataset, {"frames": settings.frames}
