"""The medium read from the photograph, and its layers: `attenuation` and `shell_stack`."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

from pydantic import Field, field_validator

from assets_defs.checks import Check
from assets_defs.photo_fur.datasets import (
    attenuation_dataset,
    attenuation_of,
    opaque_of,
    seen_of,
    shell_stack_dataset,
)
from assets_defs.photo_fur.declaration import FUR, Layers
from assets_defs.settings import Settings
from assets_defs.system import Pictures, Result
from pipelines.photo_fur import figures
from pipelines.photo_fur.attenuation import CALIBRATED_ENDS, PAPER_ENDS, LayerHistogram, Tails
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr


_LEAST_DEPTH = 0.05
"""Between the ends of the histogram, in thicknesses."""

# ---- attenuation -----------------------------------------------------------------------------


class AttenuationSettings(Settings):
    """How the histogram is read."""

    tail: float = Field(
        0.005,
        ge=0.0,
        lt=0.5,
        description="Share of the pixels cut off at each end of the histogram",
    )
    ends: tuple[float, float] = Field(
        CALIBRATED_ENDS,
        description="Depths of the brightest and the darkest of these pixels; the paper has 0, 1",
    )
    layers: Layers = 15

    @field_validator("ends")
    @classmethod
    def _deeper(cls, ends: tuple[float, float]) -> tuple[float, float]:
        if not ends[1] - ends[0] >= _LEAST_DEPTH:
            raise ValueError(
                f"expected the darkest pixels at least {_LEAST_DEPTH:g} deeper than the brightest"
            )
        return ends


def _attenuation_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.photo_fur.pictures import decay_picture

    return {
        "decay": decay_picture(
            dataset["histogram"].values,
            dataset["bin_edge"].values,
            attenuation_of(dataset),
            dataset["boundary_luminance"].values,
        )
    }


def _kept_share(version: StoredVersion) -> float:
    dataset = version.dataset
    return figures.kept_share(dataset["pixels_per_layer"].values, dataset["histogram"].values)


def _decay_error(version: StoredVersion) -> float:
    dataset = version.dataset
    return figures.decay_error(
        dataset["boundary_luminance"].values,
        float(dataset["brightest"]),
        float(dataset["attenuation"]),
    )


def _depth_rank_correlation(version: StoredVersion) -> float | None:
    dataset = version.dataset
    if "depth_rank_correlation" not in dataset:
        return None
    return float(dataset["depth_rank_correlation"])


def _depth_rmse_ratio(version: StoredVersion) -> float | None:
    """None of the paper's own reading, too, which is worse than any constant depth."""
    dataset = version.dataset
    paper = tuple(version.record["settings"]["ends"]) == PAPER_ENDS
    if paper or "depth_rmse" not in dataset:
        return None
    return float(dataset["depth_rmse"] / dataset["depth_rmse_constant"])


def _rows(found: LayerHistogram) -> list[dict[str, Any]]:
    """What the web UI's table says of every layer."""
    return [
        {"layer": n + 1, "from I": float(above), "to I": float(below), "pixels": int(count)}
        for n, ((above, below), count) in enumerate(
            zip(pairwise(found.boundaries), found.pixels_per_layer, strict=True)
        )
    ]


@FUR.asset(
    schemas.ATTENUATION,
    by=("photo",),
    settings=AttenuationSettings,
    inputs=("fur_photo",),
    pictures=_attenuation_pictures,
    checks=(
        Check(
            "kept_share",
            "Share of the pixels between Imin and Imax.",
            _kept_share,
            at_least=0.8,
            change=0.02,
        ),
        Check(
            "decay_error",
            "Largest relative difference of the stored I(n) from I(h) = Imax exp(-a h).",
            _decay_error,
            at_most=1e-9,
        ),
        Check(
            "depth_rank_correlation",
            "Rank correlation of darkness with the true depth, on the virtual pelt.",
            _depth_rank_correlation,
            at_least=0.5,
            change=0.02,
        ),
        Check(
            "depth_rmse_ratio",
            "RMSE of the depth by Eq. 1 over that of the best constant depth, on the virtual pelt.",
            _depth_rmse_ratio,
            at_most=0.85,
            change=0.02,
        ),
    ),
)
def attenuation(settings: AttenuationSettings, fur_photo: xr.Dataset) -> Result:
    """Imax, Imin, a and the layers' luminances from the photograph's histogram."""
    from pipelines.photo_fur.attenuation import layer_histogram

    luminance = seen_of(fur_photo, "luminance")
    found = layer_histogram(
        luminance, tail=settings.tail, layers=settings.layers, ends=settings.ends
    )
    shown = {
        "Imax": found.attenuation.brightest,
        "Imin": found.attenuation.darkest,
        "attenuation a": found.attenuation.coefficient,
    }
    known = None
    if "depth" in fur_photo:
        known = figures.depth_figures(luminance, found.attenuation, fur_photo["depth"].values)
        shown |= {"depth rank correlation": known.rank_correlation, "depth RMSE": known.rmse}
    return attenuation_dataset(found, known), {**shown, "layers": _rows(found)}


# ---- shell_stack -----------------------------------------------------------------------------


class StackSettings(Settings):
    """How the photograph is cut into layers."""

    layers: Layers = 15
    tails: Tails = Field(
        "end layers", description="Pixels outside Imin … Imax: in the end layers, or dropped"
    )


def _stack_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.photo_fur.pictures import layer_picture

    return {"layers": layer_picture(dataset["layer"].values, dataset.sizes["shell"])}


def _partition_error(version: StoredVersion) -> float:
    dataset = version.dataset
    opaque = opaque_of(version.input("fur_photo"))
    return figures.partition_error(dataset["layer"].values, dataset["mask"].values, opaque)


def _interval_error(version: StoredVersion) -> float:
    settings = version.record["settings"]
    return figures.interval_error(
        version.dataset["layer"].values,
        version.input("fur_photo")["luminance"].values,
        attenuation_of(version.input("attenuation")).boundaries(settings["layers"]),
        settings["tails"],
        opaque_of(version.input("fur_photo")),
    )


@FUR.asset(
    schemas.SHELL_STACK,
    by=("photo",),
    settings=StackSettings,
    inputs=("fur_photo", "attenuation"),
    pictures=_stack_pictures,
    checks=(
        Check(
            "partition_error",
            "Share of the pixels that are not in exactly one layer, of transparent ones in none.",
            _partition_error,
            at_most=0.0,
        ),
        Check(
            "interval_error",
            "Share of the pixels whose luminance is not between I(n-1) and I(n) of their layer.",
            _interval_error,
            at_most=0.0,
        ),
    ),
)
def shell_stack(settings: StackSettings, fur_photo: xr.Dataset, attenuation: xr.Dataset) -> Result:
    """The layer of every pixel, and the layers' masks."""
    from pipelines.photo_fur.attenuation import make_shell_stack

    stack = make_shell_stack(
        fur_photo["luminance"].values,
        attenuation_of(attenuation),
        settings.layers,
        tails=settings.tails,
        opaque=opaque_of(fur_photo),
    )
    return shell_stack_dataset(stack), {"dropped pixels": int((stack.layer == 0).sum())}
