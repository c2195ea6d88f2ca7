"""The scratch's cross-section and what it does to light: `scratch_profile`, `scratch_table_2d`,
`scratch_table`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, Self

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.glass_scratches.declaration import SCRATCHES
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import NOTES, Pictures, Progress, Result
from storage.schemas import glass_scratches as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray


# ---- scratch_profile -------------------------------------------------------------------------


class ProfileSettings(Settings):
    """The built-in cross-section; a file of yours has its own."""

    shape: Literal["v", "u", "trapezoid", "raised"] = Field(
        "v", description="Built-in profile; raised: with borders, cut at their crests"
    )
    profile_width: float = Field(
        10.0, gt=0.0, allow_inf_nan=False, description="Width at the surface, micrometres"
    )
    profile_depth: float = Field(
        4.0, gt=0.0, allow_inf_nan=False, description="Depth below the surface, micrometres"
    )
    step: float | None = Field(
        None,
        gt=0.0,
        allow_inf_nan=False,
        description="Your file of heights alone: distance of its points, micrometres",
    )
    level: bool = Field(
        False,
        description="Your scan: subtract the line through the land beside the scratch (its tilt)",
    )

    @classmethod
    def preset(cls, name: Preset, keys: Mapping[str, str]) -> Self:
        """Years leave raised borders; table 1 does not say what its profiles are."""
        return cls(shape="raised" if keys["setting"] == "worn" else "v")


def _profile_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.glass_scratches.drawing.pictures import profile_picture

    return {"profile": profile_picture(dataset["points"].values)}


def _aspect(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import profile_aspect

    return profile_aspect(version.dataset["points"].values)


def _opening_tilt(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import opening_tilt

    return opening_tilt(version.dataset["points"].values)


@SCRATCHES.asset(
    schemas.SCRATCH_PROFILE,
    by=("setting",),
    settings=ProfileSettings,
    from_source=True,
    pictures=_profile_pictures,
    checks=(
        Check(
            "aspect",
            "Depth over the opening's width.",
            _aspect,
            at_least=1e-3,
            at_most=20.0,
            change=0.01,
        ),
        Check(
            "opening_tilt",
            "How far the opening's ends, or anything between, lie off n = 0, micrometres.",
            _opening_tilt,
            at_most=0.0,
        ),
    ),
)
def scratch_profile(settings: ProfileSettings, source: Source) -> Result:
    """Read the cross-section, or take a built-in one, between its crests."""
    import xarray as xr

    from assets_defs.glass_scratches.profile_files import load_profile

    points, notes = load_profile(source, settings.model_dump())
    dataset = xr.Dataset({"points": (("point", "axis"), points)}, attrs={"name": source.name})
    width = float(points[-1, 0] - points[0, 0])
    return dataset, {
        "opening, µm": width,
        "deepest, µm": float(-points[:, 1].min()),
        NOTES: notes,
    }


# ---- scratch_table_2d ------------------------------------------------------------------------


class TableSettings(Settings):
    """The glass, its walls, and how the table is made."""

    walls: Literal["glass", "paper"] = Field(
        "glass",
        description="glass: walls reflect and let through at each bounce; paper: they reflect as "
        "the scratch paper has it, and what they do not reflect goes on evenly",
    )
    roughness: float = Field(
        1.0, ge=0.0, le=1.0, description="1: walls scatter evenly, 0: clear; between: ground"
    )
    refractive_index: float = Field(
        1.5, gt=1.0, le=10.0, description="Refractive index of the glass, n"
    )
    bins: int = Field(128, ge=8, le=2048, multiple_of=2, description="Bins of each angle, M")
    albedo: float = Field(
        1.0, ge=0.0, le=1.0, description="Part of the light that a wall does not keep at a bounce"
    )
    method: Literal["exact", "paths"] | None = Field(
        None, description="Linear system or Monte Carlo; by default exact where walls are diffuse"
    )
    facets: int = Field(128, ge=4, le=4096, description="Exact: facets of the profile")
    rays: int = Field(20_000, ge=1, description="Paths: rays from every bin, N")
    paths_per_ray: int = Field(
        1, ge=1, le=100_000, description="Paths of the paper's walls: paths of every ray, Nr"
    )
    table_seed: int = Field(0, ge=0, description="Paths: seed")

    @classmethod
    def preset(cls, name: Preset, keys: Mapping[str, str]) -> Self:
        """The exact table takes no time at any size; counted paths do."""
        roughness = {"ground": 0.5, "clear": 0.0, "worn": 0.3}.get(keys["setting"], 1.0)
        sizes: dict[str, int] = {
            "test": {"bins": 32, "facets": 64, "rays": 4_000},
            "demo": {},
            "paper": {"bins": 256, "rays": 100_000} if roughness == 1.0 else {"rays": 200_000},
        }[name]
        return cls(roughness=roughness, **sizes)


@SCRATCHES.before_work
def _method_suits_walls(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    from pipelines.glass_scratches.tables.walls import table_method

    table = settings.get("scratch_table_2d")
    if isinstance(table, TableSettings):
        table_method(table.method, table.roughness)
        if table.walls == "paper" and table.roughness != 1.0:
            raise ValueError(
                f"roughness is {table.roughness:g} with the paper's walls; expected 1, or walls of "
                "glass."
            )
        if table.walls == "glass" and "setting" in sources:
            _check_walls(sources["setting"], settings["scratch_profile"], table)


def _check_walls(source: Source, profile: Settings, table: TableSettings) -> None:
    """Raises ValueError for a cross-section that grooves of glass cannot have side by side."""
    from assets_defs.glass_scratches.profile_files import load_profile
    from pipelines.glass_scratches.tables.glass_table import table_walls

    points, _ = load_profile(source, profile.model_dump())
    try:
        table_walls(points, table.roughness, table.table_seed)
    except ValueError as error:
        raise ValueError(f"{source.name}: {error}") from error


def _table_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.glass_scratches.drawing.pictures import table_picture

    return {"table": table_picture(dataset["rho"].values[0], dataset.attrs["walls"] == "glass")}


def _energy_error(version: StoredVersion) -> float:
    from assets_defs.glass_scratches.datasets import table_2d_of
    from pipelines.glass_scratches.figures import energy_error

    return energy_error(table_2d_of(version.dataset))


def _reciprocity_error(version: StoredVersion) -> float:
    from assets_defs.glass_scratches.datasets import table_2d_of
    from pipelines.glass_scratches.figures import reciprocity_error

    return reciprocity_error(table_2d_of(version.dataset))


def _paths_z(version: StoredVersion) -> float:
    from assets_defs.glass_scratches.datasets import table_2d_of
    from pipelines.glass_scratches.figures import paths_z_rms

    settings = version.record["settings"]
    return paths_z_rms(
        version.input("scratch_profile")["points"].values,
        table_2d_of(version.dataset),
        albedo=settings["albedo"],
        roughness=settings["roughness"],
        seed=settings["table_seed"],
    )


def _across_error(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import across_error

    return across_error(version.dataset["across"].values, version.dataset["rho"].values)


@SCRATCHES.asset(
    schemas.SCRATCH_TABLE_2D,
    by=("setting",),
    settings=TableSettings,
    inputs=("scratch_profile",),
    pictures=_table_pictures,
    checks=(
        Check(
            "energy_error",
            "Largest part of a beam, from either side, that neither leaves nor stays.",
            _energy_error,
            at_most=1e-6,
        ),
        Check(
            "reciprocity_error",
            "Largest |rho(o, i) - rho(i, o)| over the largest rho, radiance over n squared; of the "
            "paper's counted paths beyond five standard errors.",
            _reciprocity_error,
            at_most=1e-9,
        ),
        Check(
            "paths_z_rms",
            "Against new Monte Carlo paths from a few incidences: RMS of the z-scores of blocks.",
            _paths_z,
            at_most=2.0,
        ),
        Check(
            "across_error",
            "Largest difference of the mean across the opening from rho(i, o), over the largest.",
            _across_error,
            at_most=1e-5,
        ),
    ),
)
def scratch_table_2d(
    settings: TableSettings, progress: Progress, scratch_profile: xr.Dataset
) -> Result:
    """Solve for the table, or shoot paths."""
    profile = scratch_profile["points"].values
    shown = {"method": settings.method or ("exact" if settings.roughness == 1.0 else "paths")}
    return _table(settings, profile, progress), shown


def _table(settings: TableSettings, profile: NDArray[np.float64], progress: Progress) -> xr.Dataset:
    from assets_defs.glass_scratches.datasets import glass_table_dataset, paper_table_dataset
    from pipelines.glass_scratches.tables.glass_table import glass_table
    from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table

    if settings.walls == "paper":
        table = scratch_brdf_table(
            profile,
            bins=settings.bins,
            albedo=settings.albedo,
            method=settings.method,
            facets=settings.facets,
            rays=settings.rays,
            paths_per_ray=settings.paths_per_ray,
            seed=settings.table_seed,
        )
        return paper_table_dataset(table, settings.refractive_index)
    made = glass_table(
        profile,
        bins=settings.bins,
        index=settings.refractive_index,
        roughness=settings.roughness,
        albedo=settings.albedo,
        method=settings.method,
        facets=settings.facets,
        rays=settings.rays,
        seed=settings.table_seed,
        progress=progress,
    )
    return glass_table_dataset(made)


# ---- scratch_table ---------------------------------------------------------------------------


class AlongSettings(Settings):
    """Along the scratch."""

    fresnel: Literal["paper", "physical"] = Field(
        "paper",
        description="The paper's walls: cosine of Fresnel's factor: cos theta as printed, or "
        "cos theta cos phi",
    )


def _along_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.glass_scratches.drawing.pictures import leans_picture

    return {"leans": leans_picture(dataset["rho"].values, dataset["lean"].values)}


def _sampler_p(version: StoredVersion) -> float:
    from assets_defs.glass_scratches.datasets import scratch_tables_of
    from pipelines.glass_scratches.figures import sampler_p_value

    return sampler_p_value(scratch_tables_of(version.input("scratch_table_2d"), version.dataset)[1])


def _interpolation_error(version: StoredVersion) -> float | None:
    """Of the paper's walls; None for walls of glass, in which Fresnel's equations are."""
    from pipelines.glass_scratches.tables.fresnel import interpolation_error

    table = version.input("scratch_table_2d")
    if table.attrs["walls"] != "paper":
        return None
    bins, index = table.sizes["out"], float(table["index"])
    return interpolation_error(bins, index, version.record["settings"]["fresnel"])["mean"]


def _largest_share(version: StoredVersion) -> float:
    dataset = version.dataset
    return float(dataset["share"].mean(dim="place").max())


@SCRATCHES.asset(
    schemas.SCRATCH_TABLE,
    by=("setting",),
    settings=AlongSettings,
    inputs=("scratch_table_2d",),
    pictures=_along_pictures,
    checks=(
        Check(
            "sampler_p",
            "p-value of a chi-square test of the sampler's directions against its density.",
            _sampler_p,
            at_least=1e-6,
        ),
        Check(
            "interpolation_error",
            "Mean relative error of the interpolation along the scratch against Eq. 2.",
            _interpolation_error,
            at_most=0.2,
            change=1e-6,
        ),
        Check(
            "largest_share",
            "Largest part of the light that the walls give back, over the views.",
            _largest_share,
            at_most=1.0 + 1e-5,
            change=0.01,
        ),
    ),
)
def scratch_table(settings: AlongSettings, scratch_table_2d: xr.Dataset) -> Result:
    """Put both sides together along the scratch, and add what sampling needs."""
    from assets_defs.glass_scratches.datasets import bsdf_table_of, table_dataset
    from pipelines.glass_scratches.tables.lobe import make_lobe

    table = bsdf_table_of(scratch_table_2d, settings.fresnel)
    dataset = table_dataset(table, make_lobe(table), settings.fresnel)
    return dataset, {"walls": scratch_table_2d.attrs["walls"]}
