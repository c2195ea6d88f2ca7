"""Textures made small, and packed: `eigen_textures`, `texture_atlases`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from assets_defs.sources import Source
from assets_defs.street_billboards.datasets import (
    compressed_of,
    compressed_variables,
    page_variables,
    pages_of,
    viewers,
    views_of,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.system import Metadata
from pipelines.street_billboards.figures import RAW_BYTES
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    Pictures = dict[str, NDArray[np.uint8]]
    Result = tuple[xr.Dataset, Metadata]

_LEAST_BYTES = 136
"""A billboard has a mask, a mean colour and a direction at least."""
_LEAST_WIDTH = 5.0
"""Metres of a road."""


@STREET.before_work
def check_bytes(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Whether the atlases' budget could hold the street's textures. Raises ValueError.

    A road is five metres wide at least; how many billboards there are is not known before.
    """
    if "drive" not in sources or "texture_atlases" not in settings:
        return
    from assets_defs.street_billboards.drive import metres_of

    source = sources["drive"]
    voxel = settings["billboards"].model_dump()["voxel"]
    eigen, budget = settings["eigen_textures"].model_dump(), settings["texture_atlases"]
    each = _LEAST_BYTES
    if eigen["coding"] == "paper" and eigen["contribution"] is None:
        each = eigen["rank"] * (3 * 32 * 32 + 3 * 32) + 3 * 32
    metres = metres_of(source, settings["drive_frames"])
    least = int(metres * _LEAST_WIDTH / voxel**2) * each
    allowed = int(budget.model_dump()["byte_budget"])
    if least > allowed:
        raise ValueError(
            f"{source.name}: the textures of {metres:.0f} m of road need {least} bytes at least; "
            f"expected no more than byte_budget, {allowed}."
        )


# ---- eigen_textures --------------------------------------------------------------------------


class EigenSettings(Settings):
    """How the textures are compressed."""

    coding: Literal["compact", "paper"] = Field(
        "compact",
        description="Eigen-images where they take off most error for their bytes, in luma and "
        "chroma; or, as in the paper, equally many of R, G and B for 32 views",
    )
    error: float = Field(
        4.4, gt=0, le=100, description="Compact: RMSE in codes over all texels that were seen"
    )
    rank: int = Field(16, ge=1, le=31, description="Paper: eigen-images, r")
    contribution: float | None = Field(
        None, gt=0, le=1, description="Paper: cumulative contribution instead of r"
    )


def _eigen_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.street_billboards.drawing.pictures import eigen_sheet

    return {"eigen-images": eigen_sheet(compressed_of(dataset))}


def _over_budget(checked: StoredVersion) -> float:
    """Error over the error asked for; of the paper's form, over a grey level of 8 bit noise."""
    settings = checked.record["settings"]
    asked = settings["error"] if settings["coding"] == "compact" else 8.0
    return _decoded_rmse(checked) / float(asked)


def _decoded_rmse(checked: StoredVersion) -> float:
    """Of some two hundred billboards, decoded anew."""
    from pipelines.street_billboards.textures.figures import decoded_rmse

    return decoded_rmse(views_of(checked.input("view_textures")), compressed_of(checked.dataset))


def _sampled_rmse(checked: StoredVersion) -> float:
    return _decoded_rmse(checked) / max(float(checked.dataset["rmse"]), 1e-9)


def _byte_share(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return float(dataset["bytes"]) / (RAW_BYTES * max(dataset.sizes["billboard"], 1))


def _excess_rank(checked: StoredVersion) -> float:
    """By how much a billboard has more eigen-images than observed views, at most."""
    import numpy as np

    dataset = checked.dataset
    observed = np.diff(checked.input("view_textures")["first"].values)
    excess = dataset["ranks"].values.astype(int).max(axis=1) - observed
    if checked.record["settings"]["coding"] == "paper":
        return 0.0
    return float(max(excess.max(), 0))


@STREET.asset(
    schemas.EIGEN_TEXTURES,
    by=("drive",),
    settings=EigenSettings,
    inputs=("billboards", "view_textures"),
    pictures=_eigen_pictures,
    checks=(
        Check(
            "over_budget",
            "Error of decoded textures over the error asked for (the paper's form: over 8 codes).",
            _over_budget,
            at_most=1.25,
        ),
        Check(
            "sampled_rmse",
            "Error of sampled billboards, decoded anew, over that of all when they were made.",
            _sampled_rmse,
            at_least=0.8,
            at_most=1.25,
        ),
        Check(
            "byte_share",
            "Bytes over 98 304 a billboard.",
            _byte_share,
            at_most=0.6,
            change=0.005,
        ),
        Check(
            "excess_rank",
            "Eigen-images beyond the views observed.",
            _excess_rank,
            at_most=0.0,
        ),
    ),
)
def eigen_textures(
    settings: EigenSettings, billboards: xr.Dataset, view_textures: xr.Dataset
) -> Result:
    """Compress the textures."""
    import numpy as np
    import xarray as xr

    from pipelines.street_billboards.textures import eigen_textures as coding

    views, turns = views_of(view_textures), billboards["turns"].values
    if settings.coding == "paper":
        made = coding.compressed_paper(
            views,
            turns,
            rank=settings.rank if settings.contribution is None else None,
            contribution=settings.contribution,
        )
    else:
        made = coding.compressed(views, turns, error=settings.error)
    counts = coding.byte_counts(made)
    rmse, psnr = coding.decode_error(views, made)
    dataset = xr.Dataset(
        {
            **compressed_variables(made),
            "bytes": ((), np.int64(counts["total"])),
            "rmse": ((), rmse),
        },
        attrs={"colour": made.colour},
    )
    count = max(len(turns), 1)
    return dataset, {
        "bytes": [{"part": part, "bytes a billboard": n / count} for part, n in counts.items()],
        "bytes a billboard": counts["total"] / count,
        "PSNR of textures, dB": psnr,
    }


# ---- texture_atlases -------------------------------------------------------------------------


class AtlasSettings(Settings):
    """The graphics card's limits."""

    most_texels: int = Field(8192, ge=64, le=32_768, description="Texels of a texture's side")
    byte_budget: int = Field(
        4_000_000_000, ge=1, description="Bytes that all pages may take together"
    )


def _atlas_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.street_billboards.drawing.pictures import atlas_picture

    return {"detail": atlas_picture(pages_of(dataset)[0])}


def _unpacked_error(checked: StoredVersion) -> float:
    """Largest difference of sampled billboards read from the pages and decoded, in codes."""
    from pipelines.street_billboards.textures.figures import unpacked_error

    stored = checked.input("eigen_textures")
    return unpacked_error(pages_of(checked.dataset), compressed_of(stored))


def _bytes_a_metre(checked: StoredVersion) -> float:
    import numpy as np

    from pipelines.street_billboards.billboards import HEADER_BYTES

    dataset = checked.dataset
    way = _metres(viewers(checked.input("drive_frames")))
    header = HEADER_BYTES * dataset.sizes["billboard"]
    return (float(np.asarray(dataset["bytes"])) + header) / way


def _metres(places: NDArray[np.float64]) -> float:
    import numpy as np

    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _padding_share(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return float(dataset["padding"]) / float(dataset["padding"] + dataset["bytes"])


@STREET.asset(
    schemas.TEXTURE_ATLASES,
    by=("drive",),
    settings=AtlasSettings,
    inputs=("drive_frames", "billboards", "eigen_textures"),
    pictures=_atlas_pictures,
    checks=(
        Check(
            "unpacked_error",
            "Largest difference, in codes, of sampled billboards decoded from the pages.",
            _unpacked_error,
            at_most=0.01,
        ),
        Check(
            "bytes_a_metre",
            "Bytes of the textures and of where they stand, for a metre of road.",
            _bytes_a_metre,
            at_most=5_000_000.0,
            change=10_000.0,
        ),
        Check(
            "padding_share",
            "Share of the pages' bytes that stand for nothing.",
            _padding_share,
            at_most=0.3,
        ),
    ),
)
def texture_atlases(
    settings: AtlasSettings,
    drive_frames: xr.Dataset,
    billboards: xr.Dataset,
    eigen_textures: xr.Dataset,
) -> Result:
    """Pack the textures into pages."""
    import numpy as np
    import xarray as xr

    from pipelines.street_billboards.billboards import HEADER_BYTES
    from pipelines.street_billboards.textures.atlases import pages

    textures = compressed_of(eigen_textures)
    made = pages(textures, settings.most_texels, byte_budget=settings.byte_budget)
    used = sum(page.bytes for page in made)
    dataset = xr.Dataset(
        {
            **page_variables(made, len(textures.first) - 1),
            "bytes": ((), np.int64(used)),
            "padding": ((), np.int64(sum(page.padding for page in made))),
        },
        attrs={"colour": textures.colour},
    )
    count = billboards.sizes["billboard"]
    way = _metres(viewers(drive_frames))
    return dataset, {
        "pages": len(made),
        "bytes a billboard": used / max(count, 1) + HEADER_BYTES,
        "bytes a metre of road": (used + HEADER_BYTES * count) / way,
    }
