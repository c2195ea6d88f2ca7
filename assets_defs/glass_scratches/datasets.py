"""Stored datasets of this system and the objects of `pipelines`, in both directions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.geometry.solids import Solid
    from pipelines.glass_scratches.drawing.frames import GlassFrames
    from pipelines.glass_scratches.layers.features import Layers
    from pipelines.glass_scratches.photograph.photograph_layers import PhotographScratches
    from pipelines.glass_scratches.scratched_glass import ScratchMaterial
    from pipelines.glass_scratches.tables.bsdf_table import BsdfTable
    from pipelines.glass_scratches.tables.fresnel import Fresnel
    from pipelines.glass_scratches.tables.lobe import Lobe
    from pipelines.glass_scratches.tables.table_2d import Table2D


def paper_table_dataset(table: Table2D, index: float) -> xr.Dataset:
    """`scratch_table_2d` of the paper's table, in glass of this index."""
    import numpy as np

    return _table_2d_dataset(
        "paper", [part[None] for part in table], np.zeros(1), index, keeps=False
    )


def glass_table_dataset(table: BsdfTable) -> xr.Dataset:
    """`scratch_table_2d` of walls of glass."""
    leans, index = table.leans, table.refractive_index
    return _table_2d_dataset("glass", table[:4], leans, index, keeps=table.keeps)


def _table_2d_dataset(
    walls: str,
    parts: Sequence[NDArray[Any]],
    leans: NDArray[np.float64],
    index: float,
    *,
    keeps: bool,
) -> xr.Dataset:
    import xarray as xr

    rho, error, absorbed, across = parts
    return xr.Dataset(
        {
            "rho": (("lean", "out", "in"), rho),
            "standard_error": (("lean", "out", "in"), error),
            "absorbed": (("lean", "in"), absorbed),
            "across": (("lean", "place", "out", "in"), across),
            "lean": ("lean", leans),
            "index": ((), index),
        },
        attrs={"walls": walls, "keeps_lean": keeps},
    )


def table_2d_of(dataset: xr.Dataset) -> Table2D | BsdfTable:
    """The table that a `scratch_table_2d` dataset holds: the paper's, or that of walls of glass."""
    from pipelines.glass_scratches.tables.bsdf_table import BsdfTable
    from pipelines.glass_scratches.tables.table_2d import Table2D

    names = ("rho", "standard_error", "absorbed", "across")
    rho, error, absorbed, across = (dataset[name].values for name in names)
    if dataset.attrs["walls"] == "paper":
        return Table2D(rho[0], error[0], absorbed[0], across[0])
    keeps, index = dataset.attrs["keeps_lean"], float(dataset["index"])
    return BsdfTable(rho, error, absorbed, across, dataset["lean"].values, keeps, index)


def bsdf_table_of(scratch_table_2d: xr.Dataset, fresnel: Fresnel) -> BsdfTable:
    """The table of both sides that a `scratch_table_2d` dataset leads to; ``fresnel``: how the
    paper's goes along the scratch."""
    from pipelines.glass_scratches.tables.bsdf_table import BsdfTable
    from pipelines.glass_scratches.tables.fresnel import fresnel_factors
    from pipelines.glass_scratches.tables.paper_table import paper_bsdf_table

    table = table_2d_of(scratch_table_2d)
    if isinstance(table, BsdfTable):
        return table
    index = float(scratch_table_2d["index"])
    return paper_bsdf_table(table, fresnel_factors(len(table.rho), index, fresnel), index)


def table_dataset(table: BsdfTable, lobe: Lobe, fresnel: str) -> xr.Dataset:
    """`scratch_table` of a table of both sides and what sampling needs."""
    import numpy as np
    import xarray as xr

    return xr.Dataset(
        {
            "rho": (("lean", "view", "light"), table.rho.astype(np.float32)),
            "lean": ("lean", table.leans),
            "cdf": (("lean", "place", "view", "border"), lobe.cdf),
            "share": (("lean", "place", "view"), lobe.share),
            "index": ((), table.refractive_index),
        },
        attrs={"keeps_lean": table.keeps, "fresnel": fresnel},
    )


def scratch_tables_of(
    scratch_table_2d: xr.Dataset, scratch_table: xr.Dataset
) -> tuple[BsdfTable, Lobe]:
    """The table of both sides and its sampler, of a `scratch_table` dataset and the one that it was
    made from."""
    import numpy as np

    from pipelines.glass_scratches.tables.lobe import lobe_from_sums

    made = bsdf_table_of(scratch_table_2d, scratch_table.attrs["fresnel"])
    table = made._replace(rho=scratch_table["rho"].values.astype(np.float64))
    return table, lobe_from_sums(table, scratch_table["cdf"].values, scratch_table["share"].values)


_SEGMENT_VARIABLES = ("centre", "direction", "length", "width", "contrast", "turn")
"""Names of the fields of `Segments` in a dataset: `angle` is the layers'."""


def photograph_dataset(
    luminance: NDArray[np.float32], scratches: PhotographScratches | None
) -> xr.Dataset:
    """`scratch_photo` of a photograph (y, x) and its scratches; None for none, and no pixels."""
    import numpy as np
    import xarray as xr

    if scratches is None:
        from pipelines.glass_scratches.photograph.segments import Segments

        nothing = np.zeros(0)
        segments = Segments(np.zeros((0, 2)), *([nothing] * 5))
        layer, angle, strength = nothing.astype(np.int32), nothing.astype(np.float32), nothing
        attrs = {}
    else:
        segments, layer, angle, strength = scratches[:4]
        attrs = {"full": scratches.full, "dark": scratches.dark, "noise": scratches.noise}
    columns = zip(_SEGMENT_VARIABLES, segments, strict=True)
    return xr.Dataset(
        {
            "luminance": (("row", "column"), luminance),
            **{
                name: (("segment", "axis") if name == "centre" else "segment", values)
                for name, values in columns
            },
            "strength": ("segment", strength),
            "segment_layer": ("segment", layer),
            "angle": ("layer", angle),
        },
        attrs=attrs,
    )


def photograph_scratches_of(scratch_photo: xr.Dataset) -> PhotographScratches | None:
    """The scratches of a `scratch_photo` dataset; None of one that is no photograph's."""
    from pipelines.glass_scratches.photograph.photograph_layers import PhotographScratches
    from pipelines.glass_scratches.photograph.segments import Segments

    if scratch_photo.sizes["layer"] == 0:
        return None
    return PhotographScratches(
        Segments(*(scratch_photo[name].values for name in _SEGMENT_VARIABLES)),
        scratch_photo["segment_layer"].values,
        scratch_photo["angle"].values,
        scratch_photo["strength"].values,
        scratch_photo.attrs["full"],
        scratch_photo.attrs["dark"],
        scratch_photo.attrs["noise"],
        (scratch_photo.sizes["row"], scratch_photo.sizes["column"]),
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
        *scratch_tables_of(scratch_table_2d, scratch_table),
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
    return scratch_tables_of(version.input("scratch_table_2d"), version.dataset)[1]


LOADERS: dict[str, Callable[[StoredVersion], object]] = {
    "scratch_profile": lambda version: version.dataset["points"].values,
    "scratch_table_2d": lambda version: table_2d_of(version.dataset),
    "scratch_table": _lobe,
    "scratch_photo": lambda version: photograph_scratches_of(version.dataset),
    "scratch_layers": lambda version: layers_of(version.dataset),
    "glass_object": lambda version: solid_of(version.dataset),
}
"""What `tsuya.load` gives of an asset: points (P, 2), Table2D or BsdfTable, Lobe,
PhotographScratches or None, Layers, Solid."""
