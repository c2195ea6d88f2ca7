"""Fur from one photograph (docs/fur.md): the graph's assets and checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import Dimension, Metadata, System
from pipelines.photo_fur import figures
from pipelines.photo_fur.attenuation import MOST_LAYERS, Tails
from pipelines.photo_fur.drawing import Fill
from storage.readers.meshes import read_mesh
from storage.readers.photographs import BUILTIN_PHOTOGRAPHS, read_photograph
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.photo_fur.attenuation import Attenuation

PELT = "pelt"
SQUARE = "square"
Pictures = dict[str, "NDArray[np.uint8]"]
Result = tuple["xr.Dataset", Metadata]
Layers = Annotated[int, Field(ge=1, le=MOST_LAYERS, description="Layers of shells, N")]


def _check_photograph(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        read_photograph(source.path, settings.get("crop"))
    elif settings.get("crop") is not None:
        raise ValueError(f"crop is set for {source.name}; expected a photograph of yours.")


def _check_mesh(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        read_mesh(source.path)


FUR = System(
    name="photo_fur",
    title="Fur from one photograph",
    dimensions=(
        Dimension(
            "photo",
            builtin=(*BUILTIN_PHOTOGRAPHS, PELT),
            examples=("grass", "chelsea", PELT),
            default=PELT,
            suffixes=(".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr"),
            check=_check_photograph,
        ),
        Dimension(
            "mesh",
            builtin=(SQUARE, "sphere", "teapot", "teapot-large"),
            examples=(SQUARE, "teapot", "teapot-large"),
            default="teapot",
            suffixes=(".ply", ".obj", ".glb"),
            check=_check_mesh,
        ),
    ),
)


# ---- fur_photo -------------------------------------------------------------------------------


class PhotoSettings(Settings):
    """How the photograph is taken in."""

    crop: tuple[int, int, int, int] | None = Field(
        None, description="Left, top, width, height in pixels; the whole photograph by default"
    )
    largest_side: int = Field(
        1024, ge=64, le=8192, description="Longer side in pixels; larger photographs are averaged"
    )
    pelt_size: int = Field(512, ge=64, le=2048, description="Virtual pelt: pixels a side")
    pelt_hairs: int = Field(16_000, ge=100, le=100_000, description="Virtual pelt: hairs")
    pelt_samples: int = Field(24, ge=1, le=4096, description="Virtual pelt: light paths a pixel")
    pelt_seed: int = Field(0, ge=0, description="Virtual pelt: seed")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"largest_side": 128, "pelt_size": 64, "pelt_hairs": 280, "pelt_samples": 16},
        "paper": {"largest_side": 4096, "pelt_samples": 64},
    }


def _photo_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.drawing.colour import to_8bit

    return {"photograph": to_8bit(dataset["radiance"].values)}


def _contrast(checked: StoredVersion) -> float:
    return figures.contrast(checked.dataset["luminance"].values)


def _clipped_share(checked: StoredVersion) -> float:
    return figures.clipped_share(checked.dataset["radiance"].values)


@FUR.asset(
    schemas.FUR_PHOTO,
    by=("photo",),
    settings=PhotoSettings,
    from_source=True,
    pictures=_photo_pictures,
    checks=(
        Check(
            "contrast",
            "Michelson contrast of the 1 % and 99 % luminances: a flat photograph has no depth.",
            _contrast,
            at_least=0.1,
            change=0.02,
        ),
        Check(
            "clipped_share",
            "Share of the pixels that are pure white: their brightness tells no depth.",
            _clipped_share,
            at_most=0.05,
            change=0.005,
        ),
    ),
)
def fur_photo(settings: PhotoSettings, source: Source, progress: Callable[[float], None]) -> Result:
    """Read the photograph, or photograph the virtual pelt."""
    import xarray as xr

    from pipelines.drawing.colour import luminance
    from pipelines.photo_fur.photograph import expose, fit_size
    from pipelines.virtual.pelt.pelt import virtual_pelt
    from storage.readers.photographs import builtin_photograph, read_photograph

    pixels = ("y", "x")
    if source.path is None and source.key == PELT:
        pelt = virtual_pelt(
            settings.pelt_size,
            settings.pelt_hairs,
            settings.pelt_samples,
            settings.pelt_seed,
            progress=progress,
        )
        radiance, depth = pelt.radiance, {"depth": (pixels, pelt.depth)}
    else:
        depth = {}
        raw = (
            builtin_photograph(source.key)
            if source.path is None
            else read_photograph(source.path, settings.crop)
        )
        radiance = fit_size(expose(raw), settings.largest_side)
    dataset = xr.Dataset(
        {
            "radiance": ((*pixels, "channel"), radiance),
            "luminance": (pixels, luminance(radiance)),
            **depth,
        },
        attrs={"name": source.name},
    )
    return dataset, {"pixels": radiance.shape[0] * radiance.shape[1]}


# ---- attenuation -----------------------------------------------------------------------------


class AttenuationSettings(Settings):
    """How the histogram is read."""

    tail: float = Field(
        0.005,
        ge=0.0,
        lt=0.5,
        description="Share of the pixels cut off at each end of the histogram",
    )
    layers: Layers = 15


def medium(dataset: xr.Dataset) -> Attenuation:
    """The medium that an `attenuation` dataset describes."""
    from pipelines.photo_fur.attenuation import Attenuation

    return Attenuation(float(dataset["brightest"]), float(dataset["darkest"]))


def _attenuation_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.photo_fur.pictures import decay_picture

    return {
        "decay": decay_picture(
            dataset["histogram"].values,
            dataset["bin_edge"].values,
            medium(dataset),
            dataset["boundary_luminance"].values,
        )
    }


def _kept_share(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return float(dataset["pixels_per_layer"].sum() / dataset["histogram"].sum())


def _decay_error(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return figures.decay_error(
        dataset["boundary_luminance"].values,
        float(dataset["brightest"]),
        float(dataset["attenuation"]),
    )


def _depth_rank_correlation(checked: StoredVersion) -> float | None:
    dataset = checked.dataset
    if "depth_rank_correlation" not in dataset:
        return None
    return float(dataset["depth_rank_correlation"])


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
    ),
)
def attenuation(settings: AttenuationSettings, fur_photo: xr.Dataset) -> Result:
    """Imax, Imin, a and the layers' luminances from the photograph's histogram."""
    import numpy as np
    import xarray as xr

    from pipelines.photo_fur.attenuation import (
        depth_rank_correlation,
        fit_attenuation,
        layer_of,
        luminance_histogram,
    )

    luminance = fur_photo["luminance"].values
    fitted = fit_attenuation(luminance, tail=settings.tail)
    histogram = luminance_histogram(luminance)
    layer = layer_of(luminance, fitted, settings.layers, tails="dropped")
    pixels = np.bincount(layer.ravel(), minlength=settings.layers + 1)[1:]
    boundaries = fitted.boundaries(settings.layers)
    variables = {
        "histogram": ("bin", histogram.counts),
        "bin_edge": ("edge", histogram.edges),
        "brightest": ((), fitted.brightest),
        "darkest": ((), fitted.darkest),
        "attenuation": ((), fitted.coefficient),
        "boundary_luminance": ("boundary", boundaries),
        "pixels_per_layer": ("layer", pixels),
        "bright_tail": ((), np.int64(np.count_nonzero(luminance > fitted.brightest))),
        "dark_tail": ((), np.int64(np.count_nonzero(luminance < fitted.darkest))),
    }
    shown = {
        "Imax": fitted.brightest,
        "Imin": fitted.darkest,
        "attenuation a": fitted.coefficient,
    }
    if "depth" in fur_photo:
        correlation = depth_rank_correlation(luminance, fur_photo["depth"].values)
        variables["depth_rank_correlation"] = ((), correlation)
        shown["depth rank correlation"] = correlation
    rows = [
        {"layer": n + 1, "from I": float(above), "to I": float(below), "pixels": int(count)}
        for n, (above, below, count) in enumerate(
            zip(boundaries[:-1], boundaries[1:], pixels, strict=True)
        )
    ]
    return xr.Dataset(variables), {**shown, "layers": rows}


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


def _partition_error(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return figures.partition_error(dataset["layer"].values, dataset["mask"].values)


def _interval_error(checked: StoredVersion) -> float:
    settings = checked.record["settings"]
    return figures.interval_error(
        checked.dataset["layer"].values,
        checked.input("fur_photo")["luminance"].values,
        medium(checked.input("attenuation")).boundaries(settings["layers"]),
        settings["tails"],
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
            "Share of the pixels that are not in exactly one layer.",
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
    import xarray as xr

    from pipelines.photo_fur.attenuation import layer_masks, layer_of

    layer = layer_of(
        fur_photo["luminance"].values, medium(attenuation), settings.layers, tails=settings.tails
    )
    dataset = xr.Dataset(
        {
            "layer": (("y", "x"), layer),
            "mask": (("shell", "y", "x"), layer_masks(layer, settings.layers)),
        }
    )
    return dataset, {"dropped pixels": int((layer == 0).sum())}


# ---- shell_mesh ------------------------------------------------------------------------------


class MeshSettings(Settings):
    """The shells of a mesh."""

    layers: Layers = 15
    thickness: float | None = Field(
        None,
        gt=0.0,
        allow_inf_nan=False,
        description="Thickness of the fur in mesh units; by default 6 % of the mesh's radius",
    )
    up: Literal["auto", "y", "z"] = Field(
        "auto", description="The mesh's upward axis; auto: y for GLB, as glTF has it, else z"
    )
    repeats: float = Field(
        1.0,
        gt=0.0,
        le=1000.0,
        description="Times the photograph is repeated along its texture axes",
    )

    @classmethod
    def preset(cls, name: Preset, keys: Mapping[str, str]) -> Self:
        """The square has the paper's 8 layers (figure 3), everything else its 15 (table 1)."""
        return cls(layers=8 if keys["mesh"] == SQUARE else 15)


def _step_error(checked: StoredVersion) -> float:
    dataset = checked.dataset
    return figures.step_error(
        dataset["vertices"].values, dataset["normals"].values, float(dataset["thickness"])
    )


def _stretch(checked: StoredVersion) -> float:
    from pipelines.geometry.shapes import texture_stretch

    dataset = checked.dataset.load()
    return texture_stretch(
        dataset["vertices"].values[-1], dataset["triangles"].values, dataset["uvs"].values
    )


@FUR.asset(
    schemas.SHELL_MESH,
    by=("mesh",),
    settings=MeshSettings,
    from_source=True,
    checks=(
        Check(
            "step_error",
            "Largest distance of a vertex from equal steps along unit normals, per thickness.",
            _step_error,
            at_most=1e-4,
        ),
        Check(
            "texture_stretch",
            "Median ratio of the photograph's stretch along and across: hair drawn out of shape.",
            _stretch,
            at_most=3.0,
            change=0.1,
        ),
    ),
)
def shell_mesh(settings: MeshSettings, source: Source) -> Result:
    """Offset the mesh's vertices along the normals, one set a layer."""
    import numpy as np
    import xarray as xr

    from pipelines.geometry import shapes
    from pipelines.photo_fur.shells import shell_heights, shell_vertices
    from storage.readers.meshes import read_mesh

    if source.path is not None:
        vertices, triangles, uvs = read_mesh(source.path)
        if settings.up == "y" or (settings.up == "auto" and source.path.suffix.lower() == ".glb"):
            vertices = shapes.turned_up(vertices)
        mesh = shapes.make_mesh(vertices, triangles, uvs)
    else:
        mesh = {
            SQUARE: lambda: shapes.square(32),
            "sphere": lambda: shapes.sphere(64),
            "teapot": lambda: shapes.teapot(8),
            "teapot-large": lambda: shapes.teapot(33),
        }[source.key]()
    spread = mesh.vertices - (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    thickness = settings.thickness or 0.06 * float(np.linalg.norm(spread, axis=1).max())
    dataset = xr.Dataset(
        {
            "vertices": (
                ("shell", "vertex", "axis"),
                shell_vertices(mesh.vertices, mesh.normals, thickness, settings.layers),
            ),
            "normals": (("vertex", "axis"), mesh.normals.astype(np.float32)),
            "triangles": (("triangle", "corner"), mesh.triangles.astype(np.int32)),
            "uvs": (("vertex", "uv"), (mesh.uvs * settings.repeats).astype(np.float32)),
            "height": ("shell", shell_heights(thickness, settings.layers)),
            "thickness": ((), thickness),
        },
        attrs={"name": source.name},
    )
    return dataset, {"vertices": len(mesh.vertices), "triangles": len(mesh.triangles)}


# ---- fur_frames ------------------------------------------------------------------------------


class FrameSettings(Settings):
    """How the pictures are taken."""

    width: int = Field(
        640,
        ge=32,
        le=4096,
        description="Pixels across, 4:3; the square's pictures go by the photograph's size",
    )
    supersampling: int = Field(2, ge=1, le=8, description="Samples along each side of a pixel")
    tails: Tails = "end layers"
    fill: Fill = Field(
        "columns", description="Layers show whole hairs (columns) or, as in the paper, bands"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"width": 96, "supersampling": 1},
        "paper": {"width": 1280, "supersampling": 3},
    }


def _frame_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.drawing.contact_sheet import contact_sheet

    return {"frames": contact_sheet(dataset["frames"].values)}


def _top_view_rmse(checked: StoredVersion) -> float | None:
    from pipelines.photo_fur.frames import top_view_error

    from_above = checked.dataset["elevation"].values == 90.0
    if not from_above.any():
        return None
    picture = checked.dataset["frames"].values[from_above][0]
    return top_view_error(picture, checked.input("fur_photo")["radiance"].values)


def _least_coverage(checked: StoredVersion) -> float:
    return float(checked.dataset["coverage"].min())


def _mean_brightness(checked: StoredVersion) -> float:
    return float(checked.dataset["frames"].astype("float64").mean() / 255.0)


@FUR.asset(
    schemas.FUR_FRAMES,
    by=("photo", "mesh"),
    settings=FrameSettings,
    inputs=("fur_photo", "attenuation", "shell_mesh"),
    kinds=frozenset({"zarr", "pyvista"}),
    pictures=_frame_pictures,
    checks=(
        Check(
            "top_view_rmse",
            "RMSE in [0, 1] between the square from straight above and the photograph.",
            _top_view_rmse,
            at_most=0.02,
            change=0.002,
        ),
        Check(
            "least_coverage",
            "Share of the picture with fur, in the view that has least: nothing drawn is 0.",
            _least_coverage,
            at_least=0.02,
            change=0.01,
        ),
        Check(
            "mean_brightness",
            "Mean of all pictures' 8-bit codes, in [0, 1].",
            _mean_brightness,
            at_least=0.02,
            at_most=0.98,
            change=0.01,
        ),
    ),
)
def fur_frames(
    settings: FrameSettings,
    keys: Mapping[str, str],
    progress: Callable[[float], None],
    fur_photo: xr.Dataset,
    attenuation: xr.Dataset,
    shell_mesh: xr.Dataset,
) -> Result:
    """Draw the fur on the mesh from every view."""
    import xarray as xr

    from pipelines.photo_fur.frames import (
        ROUND_VIEWS,
        SQUARE_VIEWS,
        draw_frames,
        size_from_above,
        square_of_photograph,
    )

    radiance = fur_photo["radiance"].values
    shells = shell_mesh["vertices"].values
    views, size = ROUND_VIEWS, (settings.width * 3 // 4, settings.width)
    if keys["mesh"] == SQUARE:
        views, size = SQUARE_VIEWS, size_from_above(radiance.shape[:2])
        shells = square_of_photograph(shells, radiance.shape[:2])
    drawn = draw_frames(
        radiance,
        fur_photo["luminance"].values,
        medium(attenuation),
        shells,
        shell_mesh["normals"].values,
        shell_mesh["triangles"].values,
        shell_mesh["uvs"].values,
        views,
        size=size,
        supersampling=settings.supersampling,
        tails=settings.tails,
        fill=settings.fill,
        progress=progress,
    )
    dataset = xr.Dataset(
        {
            "frames": (("view", "y", "x", "channel"), drawn.pictures),
            "azimuth": ("view", [view.azimuth for view in views]),
            "elevation": ("view", [view.elevation for view in views]),
            "coverage": ("view", drawn.coverage),
        }
    )
    return dataset, {"views": len(views)}
