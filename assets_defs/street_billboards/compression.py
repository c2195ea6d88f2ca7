"""Textures made small, and packed: `eigen_textures`, `texture_atlases`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from assets_defs.sources import Source
from assets_defs.street_billboards.capture_datasets import viewers
from assets_defs.street_billboards.datasets import (
    atlases_dataset,
    compressed_dataset,
    compressed_of,
    pages_of,
    views_of,
)
from assets_defs.street_billboards.declaration import STREET
from assets_defs.street_billboards.poses import metres_of
from assets_defs.system import Pictures, Result
from pipelines.street_billboards import figures
from pipelines.street_billboards.billboards import HEADER_BYTES
from storage.schemas import street_billboards as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.street_billboards.textures.texture_tables import CompressedTextures, ViewTextures

_LEAST_BYTES = 136
"""A billboard has a mask, a mean colour and a direction at least."""
_LEAST_WIDTH = 5.0
"""Metres of a road."""
_NOISE = 8.0
"""Codes; of the paper's form, what its error is measured by."""


@STREET.before_work
def check_bytes(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Whether the atlases' budget could hold the street's textures. Raises ValueError.

    A road is five metres wide at least; how many billboards there are is not known before.
    """
    if "drive" not in sources or "texture_atlases" not in settings:
        return
    source = sources["drive"]
    voxel = settings["billboards"].model_dump()["voxel"]
    eigen, budget = settings["eigen_textures"].model_dump(), settings["texture_atlases"]
    each = _LEAST_BYTES
    if eigen["coding"] == "paper" and eigen["contribution"] is None:
        each = eigen["rank"] * (3 * 32 * 32 + 3 * 32) + 3 * 32
    metres = metres_of(source, settings["drive_poses"])
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


def _over_budget(version: StoredVersion) -> float:
    """Error over the error asked for; of the paper's form, over a grey level of 8 bit noise."""
    settings = version.record["settings"]
    asked = settings["error"] if settings["coding"] == "compact" else _NOISE
    return _decoded_rmse(version) / float(asked)


def _sampled_rmse(version: StoredVersion) -> float:
    return _decoded_rmse(version) / max(float(version.dataset["rmse"]), 1e-9)


def _decoded_rmse(version: StoredVersion) -> float:
    """Of some two hundred billboards, decoded anew."""
    from pipelines.street_billboards.textures.figures import decoded_rmse

    return decoded_rmse(views_of(version.input("view_textures")), compressed_of(version.dataset))


def _byte_share(version: StoredVersion) -> float:
    dataset = version.dataset
    return float(dataset["bytes"]) / (figures.RAW_BYTES * max(dataset.sizes["billboard"], 1))


def _excess_rank(version: StoredVersion) -> float:
    """The paper's form has as many for every billboard, whatever was observed."""
    if version.record["settings"]["coding"] == "paper":
        return 0.0
    first = version.input("view_textures")["first"].values
    return float(figures.excess_rank(version.dataset["ranks"].values, first))


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
    from pipelines.street_billboards.textures.eigen_textures import byte_counts, decode_error

    views, turns = views_of(view_textures), billboards["turns"].values
    made = _compressed(settings, views, turns)
    counts = byte_counts(made)
    rmse, psnr = decode_error(views, made)
    each = {part: size / max(len(turns), 1) for part, size in counts.items()}
    return compressed_dataset(made, counts["total"], rmse), {
        "bytes": [{"part": part, "bytes a billboard": size} for part, size in each.items()],
        "bytes a billboard": each["total"],
        "PSNR of textures, dB": psnr,
    }


def _compressed(
    settings: EigenSettings, views: ViewTextures, turns: NDArray[np.bool_]
) -> CompressedTextures:
    """In the form that the settings ask for."""
    from pipelines.street_billboards.textures import eigen_textures as coding

    if settings.coding == "compact":
        return coding.compress_views(views, turns, error=settings.error)
    rank = settings.rank if settings.contribution is None else None
    return coding.compress_views_as_paper(
        views, turns, rank=rank, contribution=settings.contribution
    )


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


def _unpacked_error(version: StoredVersion) -> float:
    """Largest difference of sampled billboards read from the pages and decoded, in codes."""
    from pipelines.street_billboards.textures.figures import unpacked_error

    stored = version.input("eigen_textures")
    return unpacked_error(pages_of(version.dataset), compressed_of(stored))


def _bytes_a_metre(version: StoredVersion) -> float:
    dataset = version.dataset
    header = HEADER_BYTES * dataset.sizes["billboard"]
    way = figures.path_length(viewers(version.input("drive_frames")))
    return (float(dataset["bytes"]) + header) / way


def _padding_share(version: StoredVersion) -> float:
    dataset = version.dataset
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
    from pipelines.street_billboards.textures.atlases import pack_pages

    textures = compressed_of(eigen_textures)
    made = pack_pages(textures, settings.most_texels, byte_budget=settings.byte_budget)
    used, count = sum(page.bytes for page in made), billboards.sizes["billboard"]
    way = figures.path_length(viewers(drive_frames))
    return atlases_dataset(made, textures), {
        "pages": len(made),
        "bytes a billboard": used / max(count, 1) + HEADER_BYTES,
        "bytes a metre of road": (used + HEADER_BYTES * count) / way,
    }
