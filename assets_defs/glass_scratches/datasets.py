"""Stored datasets of this system and the objects of `pipelines`, in both directions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.geometry.solids import Solid
    from pipelines.glass_scratches.drawing.frames import GlassFrames
    from pipelines.glass_scratches.layers.features import Layers
    from pipelines.glass_scratches.scratched_glass import ScratchMaterial
    from pipelines.glass_scratches.tables.fresnel import FresnelFactors
    from pipelines.glass_scratches.tables.lobe import Lobe
    from pipelines.glass_scratches.tables.table_2d import Table2D


def table_2d_dataset(table: Table2D, method: str, roughness: float) -> xr.Dataset:
    """`scratch_table_2d` of a table, and how it was made."""
    import xarray as xr

    return xr.Dataset(
        {
            "rho": (("out", "in"), table.rho),
            "standard_error": (("out", "in"), table.standard_error),
            "absorbed": ("in", table.absorbed),
            "across": (("place", "out", "in"), table.across),
        },
        attrs={"method": method, "roughness": roughness},
    )


def table_2d_of(dataset: xr.Dataset) -> Table2D:
    """The table that a `scratch_table_2d` dataset holds."""
    from pipelines.glass_scratches.tables.table_2d import Table2D

    return Table2D(*(dataset[name].values for name in Table2D._fields))


def table_dataset(
    rho: NDArray[np.float64], fresnel: FresnelFactors, lobe: Lobe, refractive_index: float
) -> xr.Dataset:
    """`scratch_table` of a table (M, M) with F along the scratch and what sampling needs."""
    import numpy as np
    import xarray as xr

    from pipelines.glass_scratches.tables.fresnel import TABULATED_THETA

    leaning = (fresnel.factor[:, :, None] * rho).astype(np.float32)
    return xr.Dataset(
        {
            "rho_s": (("lean", "out", "in"), leaning),
            "lean": ("lean", np.array(TABULATED_THETA)),
            "factor": (("lean", "out"), fresnel.factor),
            "gamma": ("out", fresnel.gamma),
            "cdf": (("place", "out", "border"), lobe.cdf),
            "share": (("place", "out"), lobe.share),
            "index": ((), refractive_index),
        }
    )


def fresnel_of(scratch_table: xr.Dataset) -> FresnelFactors:
    """F as a `scratch_table` dataset holds it."""
    from pipelines.glass_scratches.tables.fresnel import FresnelFactors

    return FresnelFactors(scratch_table["factor"].values, scratch_table["gamma"].values)


def lobe_of(scratch_table_2d: xr.Dataset, scratch_table: xr.Dataset) -> Lobe:
    """What sampling needs, of a `scratch_table` dataset and the one that it was made from."""
    from pipelines.glass_scratches.tables.lobe import lobe_from_sums

    return lobe_from_sums(
        scratch_table_2d["across"].values,
        scratch_table["cdf"].values,
        scratch_table["share"].values,
        scratch_table_2d.attrs["roughness"],
    )


def layers_dataset(
    layers: Layers, coverage: NDArray[np.float32], stages: NDArray[np.uint8]
) -> xr.Dataset:
    """`scratch_layers`: the scratches, their maps (L, R, R), pictures of the stages of making."""
    import xarray as xr

    from pipelines.glass_scratches.layers.features import Features

    return xr.Dataset(
        {
            "angle": ("layer", layers.angle),
            **{
                _feature_variable(name): (
                    ("feature", "axis") if name == "centre" else "feature",
                    getattr(layers.features, name),
                )
                for name in Features._fields
            },
            "coverage": (("layer", "y", "x"), coverage),
            "stages": (("stage", "row", "column"), stages),
        },
        attrs={"fading": layers.fading, "breaks": layers.breaks},
    )


def layers_of(scratch_layers: xr.Dataset) -> Layers:
    """The scratches of a `scratch_layers` dataset, with their search grid."""
    from pipelines.glass_scratches.layers.features import Features, layers_of_features

    features = (scratch_layers[_feature_variable(name)].values for name in Features._fields)
    return layers_of_features(
        scratch_layers["angle"].values,
        Features(*features),
        fading=scratch_layers.attrs["fading"],
        breaks=scratch_layers.attrs["breaks"],
    )


def _feature_variable(name: str) -> str:
    """The dataset's name of a feature's field: `layer` is a dimension there."""
    return "feature_layer" if name == "layer" else name


def solid_dataset(solid: Solid, name: str) -> xr.Dataset:
    """`glass_object` of a solid that people know by this name."""
    import xarray as xr

    from pipelines.glass_scratches.figures import enclosed_volume

    return xr.Dataset(
        {
            "vertices": (("vertex", "axis"), solid.vertices),
            "triangles": (("triangle", "corner"), solid.triangles),
            "corner_normals": (("triangle", "corner", "axis"), solid.corner_normals),
            "volume": ((), enclosed_volume(solid.vertices, solid.triangles)),
        },
        attrs={"name": name},
    )


def solid_of(glass_object: xr.Dataset) -> Solid:
    """The solid that a `glass_object` dataset holds."""
    from pipelines.geometry.solids import Solid

    return Solid(*(glass_object[name].values for name in Solid._fields))


def material_of(
    scratch_table_2d: xr.Dataset, scratch_table: xr.Dataset, scratch_layers: xr.Dataset
) -> ScratchMaterial:
    """What lies on the glass, of the datasets of its table, of that along it, of its layers."""
    from pipelines.glass_scratches.scratched_glass import ScratchMaterial

    return ScratchMaterial(
        layers_of(scratch_layers),
        scratch_layers["coverage"].values,
        scratch_table_2d["rho"].values,
        lobe_of(scratch_table_2d, scratch_table),
        fresnel_of(scratch_table),
        scratch_table_2d.attrs["roughness"],
        float(scratch_table["index"]),
    )


def frames_dataset(frames: GlassFrames, environment: NDArray[np.floating]) -> xr.Dataset:
    """`glass_frames` of both views, the moving light and the furnace, in an environment."""
    import numpy as np
    import xarray as xr

    from pipelines.drawing.colour import to_8bit
    from pipelines.light.environment_maps import mean_radiance

    traced = (frames.far, frames.close)
    radiance = np.stack([picture.radiance for picture in traced])
    pixels, furnace_pixels = ("view", "y", "x"), ("furnace_row", "furnace_column")
    return xr.Dataset(
        {
            "radiance": ((*pixels, "channel"), radiance),
            "clean": ((*pixels, "channel"), frames.clean),
            "error": (pixels, np.sqrt(np.stack([picture.variance for picture in traced]))),
            "scratched": (pixels, np.stack([picture.scratched for picture in traced])),
            "frames": ((*pixels, "channel"), to_8bit(frames.clean * frames.exposure)),
            "stage": ((*pixels, "channel"), to_8bit(frames.stage * frames.exposure)),
            "moving": (("light", "row", "column", "channel"), frames.moving),
            "exposure": ((), frames.exposure),
            "surroundings": ("channel", mean_radiance(environment)),
            "furnace": (furnace_pixels, frames.furnace.radiance.mean(axis=2)),
            "furnace_error": (furnace_pixels, np.sqrt(frames.furnace.variance)),
        }
    )


def _lobe(version: StoredVersion) -> Lobe:
    return lobe_of(version.input("scratch_table_2d"), version.dataset)


LOADERS: dict[str, Callable[[StoredVersion], object]] = {
    "scratch_profile": lambda version: version.dataset["points"].values,
    "scratch_table_2d": lambda version: table_2d_of(version.dataset),
    "scratch_table": _lobe,
    "scratch_layers": lambda version: layers_of(version.dataset),
    "glass_object": lambda version: solid_of(version.dataset),
}
"""What `tsuya.load` gives of an asset: points (P, 2), Table2D, Lobe, Layers, Solid."""
