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
from assets_defs.system import NOTES, Pictures, Result
from storage.schemas import glass_scratches as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr


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
    """The walls, and how the table is made."""

    bins: int = Field(256, ge=8, le=2048, multiple_of=2, description="Bins of each angle, M")
    albedo: float = Field(
        1.0, ge=0.0, le=1.0, description="Part of the light that a wall gives back at a bounce"
    )
    roughness: float = Field(1.0, ge=0.0, le=1.0, description="1: diffuse walls, 0: mirrors")
    method: Literal["exact", "paths"] | None = Field(
        None, description="Linear system or Monte Carlo; by default exact where walls are diffuse"
    )
    facets: int = Field(128, ge=4, le=4096, description="Exact: facets of the profile")
    rays: int = Field(20_000, ge=1, description="Paths: rays from every bin, N")
    paths_per_ray: int = Field(1, ge=1, le=100_000, description="Paths: paths of every ray, Nr")
    table_seed: int = Field(0, ge=0, description="Paths: seed")

    @classmethod
    def preset(cls, name: Preset, keys: Mapping[str, str]) -> Self:
        """The exact table takes no time at any size; the mirror's paths do."""
        sizes: dict[str, int] = {
            "test": {"bins": 32, "facets": 64, "rays": 2_000},
            "demo": {"bins": 256 if keys["setting"] != "mirror" else 128},
            "paper": {"rays": 10_000, "paths_per_ray": 100},
        }[name]
        return cls(roughness=0.0 if keys["setting"] == "mirror" else 1.0, **sizes)


@SCRATCHES.before_work
def _method_suits_walls(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    from pipelines.glass_scratches.tables.scratch_table import table_method

    walls = settings.get("scratch_table_2d")
    if isinstance(walls, TableSettings):
        table_method(walls.method, walls.roughness)


def _table_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.glass_scratches.drawing.pictures import table_picture

    return {"table": table_picture(dataset["rho"].values)}


def _furnace_error(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import table_furnace_error

    return table_furnace_error(version.dataset["rho"].values, version.dataset["absorbed"].values)


def _reciprocity_error(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import reciprocity_error

    return reciprocity_error(
        version.dataset["rho"].values, version.dataset["standard_error"].values
    )


def _paths_z(version: StoredVersion) -> float:
    from pipelines.glass_scratches.figures import paths_z_rms

    settings = version.record["settings"]
    return paths_z_rms(
        version.input("scratch_profile")["points"].values,
        version.dataset["rho"].values,
        version.dataset["standard_error"].values,
        albedo=settings["albedo"],
        roughness=settings["roughness"],
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
            "furnace_error",
            "Largest part of a beam that neither leaves nor stays.",
            _furnace_error,
            at_most=1e-9,
        ),
        Check(
            "reciprocity_error",
            "Largest |rho(o, i) - rho(i, o)| beyond five standard errors, over the largest rho.",
            _reciprocity_error,
            at_most=1e-10,
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
def scratch_table_2d(settings: TableSettings, scratch_profile: xr.Dataset) -> Result:
    """Solve for the table, or shoot paths."""
    from assets_defs.glass_scratches.datasets import table_2d_dataset
    from pipelines.glass_scratches.tables.radiosity import leaving_share
    from pipelines.glass_scratches.tables.scratch_table import scratch_brdf_table, table_method

    method = table_method(settings.method, settings.roughness)
    table = scratch_brdf_table(
        scratch_profile["points"].values,
        bins=settings.bins,
        albedo=settings.albedo,
        roughness=settings.roughness,
        method=method,
        facets=settings.facets,
        rays=settings.rays,
        paths_per_ray=settings.paths_per_ray,
        seed=settings.table_seed,
    )
    dataset = table_2d_dataset(table, method, settings.roughness)
    return dataset, {"method": method, "least leaving": float(leaving_share(table.rho).min())}


# ---- scratch_table ---------------------------------------------------------------------------


class GlassSettings(Settings):
    """The glass, and how Fresnel's factor goes along the scratch."""

    refractive_index: float = Field(
        1.5, gt=0.0, le=10.0, description="Refractive index of the glass, n"
    )
    fresnel: Literal["paper", "physical"] = Field(
        "paper",
        description="Cosine of Fresnel's factor: cos theta as printed, or cos theta cos phi",
    )


def _spatial_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.glass_scratches.drawing.pictures import fresnel_picture

    return {"leans": fresnel_picture(dataset["factor"].values, dataset["gamma"].values)}


def _sampler_p(version: StoredVersion) -> float:
    from assets_defs.glass_scratches.datasets import lobe_of
    from pipelines.glass_scratches.figures import sampler_p_value

    return sampler_p_value(lobe_of(version.input("scratch_table_2d"), version.dataset))


def _interpolation_error(version: StoredVersion) -> float:
    from pipelines.glass_scratches.tables.fresnel import interpolation_error

    settings = version.record["settings"]
    bins = version.dataset.sizes["out"]
    return interpolation_error(bins, settings["refractive_index"], settings["fresnel"])["mean"]


def _largest_share(version: StoredVersion) -> float:
    dataset = version.dataset
    return float(dataset["share"].mean(dim="place").max())


@SCRATCHES.asset(
    schemas.SCRATCH_TABLE,
    by=("setting",),
    settings=GlassSettings,
    inputs=("scratch_table_2d",),
    pictures=_spatial_pictures,
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
def scratch_table(settings: GlassSettings, scratch_table_2d: xr.Dataset) -> Result:
    """Add Fresnel's factor along the scratch, and what sampling needs."""
    from assets_defs.glass_scratches.datasets import table_dataset
    from pipelines.glass_scratches.tables.fresnel import fresnel_factors
    from pipelines.glass_scratches.tables.lobe import make_lobe

    rho = scratch_table_2d["rho"].values
    fresnel = fresnel_factors(len(rho), settings.refractive_index, settings.fresnel)
    lobe = make_lobe(scratch_table_2d["across"].values, scratch_table_2d.attrs["roughness"])
    dataset = table_dataset(rho, fresnel, lobe, settings.refractive_index)
    return dataset, {"gamma, straight on": float(fresnel.gamma[len(rho) // 2])}
