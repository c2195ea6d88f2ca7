"""Stored datasets of this system and the objects of `pipelines`, in both directions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from pipelines.drawing.colour import luminance
from pipelines.photo_fur.attenuation import Attenuation, LayerHistogram, ShellStack
from pipelines.photo_fur.figures import DepthFigures
from pipelines.photo_fur.laid_fur import Hair, LaidFur, laid_fur
from pipelines.photo_fur.laying import Laying, Patches
from pipelines.photo_fur.lie import LieField
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.photo_fur.photograph_lie import PhotographLie
from pipelines.photo_fur.shells import ShellMesh
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.photo_fur.frames import Frames, View

_PIXELS = ("y", "x")


def photograph_dataset(
    radiance: NDArray[np.float32],
    name: str,
    *,
    depth: NDArray[np.float32] | None = None,
    opaque: NDArray[np.bool_] | None = None,
    unevenness: float | None = None,
) -> xr.Dataset:
    """`fur_photo` of a photograph (y, x, 3); (y, x) the depth, where it is known, and where there
    is fur; and of one that was lit evenly the light's deviation before."""
    import numpy as np
    import xarray as xr

    variables: dict[str, tuple[tuple[str, ...], NDArray[Any]]] = {
        "radiance": ((*_PIXELS, "channel"), radiance),
        "luminance": (_PIXELS, luminance(radiance)),
    }
    if depth is not None:
        variables["depth"] = (_PIXELS, depth)
    if opaque is not None:
        variables["opaque"] = (_PIXELS, opaque)
    if unevenness is not None:
        variables["unevenness_before"] = ((), np.asarray(unevenness, np.float64))
    return xr.Dataset(variables, attrs={"name": name})


def photograph_of(fur_photo: xr.Dataset, attenuation: xr.Dataset) -> FurPhotograph:
    """The photograph with its medium, as it is drawn."""
    return FurPhotograph(
        fur_photo["radiance"].values,
        fur_photo["luminance"].values,
        attenuation_of(attenuation),
        opaque_of(fur_photo),
    )


def opaque_of(fur_photo: xr.Dataset) -> NDArray[np.bool_] | None:
    """(y, x): where a photograph is opaque; None for everywhere."""
    return fur_photo["opaque"].values if "opaque" in fur_photo else None


def seen_of(fur_photo: xr.Dataset, variable: str) -> NDArray[np.floating]:
    """A variable's values at the opaque pixels: (y, x, …), or (pixels, …) of a cut-out."""
    values, opaque = fur_photo[variable].values, opaque_of(fur_photo)
    return values if opaque is None else values[opaque]


def attenuation_dataset(found: LayerHistogram, known: DepthFigures | None = None) -> xr.Dataset:
    """`attenuation` of a histogram and, where the true depth is known, how near it comes."""
    import numpy as np
    import xarray as xr

    variables = {
        "histogram": ("bin", found.histogram.counts),
        "bin_edge": ("edge", found.histogram.edges),
        "brightest": ((), found.attenuation.brightest),
        "darkest": ((), found.attenuation.darkest),
        "attenuation": ((), found.attenuation.coefficient),
        "boundary_luminance": ("boundary", found.boundaries),
        "pixels_per_layer": ("layer", found.pixels_per_layer),
        "bright_tail": ((), np.int64(found.bright_tail)),
        "dark_tail": ((), np.int64(found.dark_tail)),
    }
    if known is not None:
        variables["depth_rank_correlation"] = ((), known.rank_correlation)
        variables["depth_rmse"] = ((), known.rmse)
        variables["depth_rmse_constant"] = ((), known.rmse_constant)
    return xr.Dataset(variables)


def attenuation_of(dataset: xr.Dataset) -> Attenuation:
    """The medium that an `attenuation` dataset describes."""
    return Attenuation(float(dataset["brightest"]), float(dataset["darkest"]))


def shell_stack_dataset(stack: ShellStack) -> xr.Dataset:
    """`shell_stack` of a photograph's layers."""
    import xarray as xr

    return xr.Dataset({"layer": (_PIXELS, stack.layer), "mask": (("shell", *_PIXELS), stack.masks)})


def shell_stack_of(dataset: xr.Dataset) -> ShellStack:
    """The layers that a `shell_stack` dataset holds."""
    return ShellStack(dataset["layer"].values, dataset["mask"].values)


def shell_mesh_dataset(mesh: ShellMesh, name: str) -> xr.Dataset:
    """`shell_mesh` of a mesh with its shells."""
    import numpy as np
    import xarray as xr

    return xr.Dataset(
        {
            "vertices": (("shell", "vertex", "axis"), mesh.vertices),
            "normals": (("vertex", "axis"), mesh.normals.astype(np.float32)),
            "triangles": (("triangle", "corner"), mesh.triangles.astype(np.int32)),
            "uvs": (("vertex", "uv"), mesh.uvs.astype(np.float32)),
            "height": ("shell", mesh.heights),
            "thickness": ((), mesh.thickness),
        },
        attrs={"name": name},
    )


def shell_mesh_of(dataset: xr.Dataset) -> ShellMesh:
    """The mesh with its shells that a `shell_mesh` dataset holds."""
    return ShellMesh(
        dataset["vertices"].values,
        dataset["normals"].values,
        dataset["triangles"].values,
        dataset["uvs"].values,
        float(dataset["thickness"]),
    )


def lie_field_dataset(
    field: LieField,
    lengths: NDArray[np.floating],
    guides: NDArray[np.floating],
    backwards: NDArray[np.floating],
    name: str,
) -> xr.Dataset:
    """`lie_field` of a mesh."""
    import numpy as np
    import xarray as xr

    return xr.Dataset(
        {
            "tangents": (("vertex", "axis"), field.tangents.astype(np.float32)),
            "lengths": ("vertex", lengths.astype(np.float32)),
            "guides": (("vertex", "axis"), guides.astype(np.float32)),
            "singular_triangle": ("singularity", field.singular_triangles),
            "index": ("singularity", field.indices),
            "backwards": ("axis", backwards),
        },
        attrs={"name": name},
    )


def fur_patches_dataset(
    patches: Patches, laying: Laying, lie: PhotographLie, *, width: float, spacing: float
) -> xr.Dataset:
    """`fur_patches` of a photograph on a mesh, as wide as ``width`` there, with patches' middles
    ``spacing`` apart."""
    import numpy as np
    import xarray as xr

    return xr.Dataset(
        {
            "vertex": ("corner_vertex", laying.vertex),
            "triangles": (("triangle", "corner"), laying.triangles),
            "uvs": (("corner_vertex", "slot", "uv"), laying.uvs),
            "weights": (("corner_vertex", "slot"), laying.weights),
            "patches": (("triangle", "slot"), laying.patches),
            "middles": ("patch", patches.middles),
            "places": (("patch", "uv"), patches.places.astype(np.float32)),
            "directions": ("patch", patches.directions.astype(np.float32)),
            "direction": (_PIXELS, lie.direction.astype(np.float32)),
            "coherence": (_PIXELS, lie.coherence.astype(np.float32)),
            "slant": ((), lie.slant),
            "width": ((), width),
            "spacing": ((), spacing),
        }
    )


def laying_of(fur_patches: xr.Dataset) -> Laying:
    """The photograph laid over a mesh, as a `fur_patches` dataset holds it."""
    return Laying(*(fur_patches[name].values for name in Laying._fields))


def patches_of(fur_patches: xr.Dataset) -> Patches:
    """Which patches a `fur_patches` dataset has laid."""
    return Patches(*(fur_patches[name].values for name in Patches._fields))


def hair_of(lie_field: xr.Dataset) -> Hair:
    """How hair lies on a mesh, and how long it is."""
    return Hair(lie_field["tangents"].values, lie_field["lengths"].values)


def laid_fur_of(shell_mesh: xr.Dataset, lie_field: xr.Dataset, fur_patches: xr.Dataset) -> LaidFur:
    """The fur laid over the mesh, as it is drawn."""
    mesh, laying, hair = shell_mesh_of(shell_mesh), laying_of(fur_patches), hair_of(lie_field)
    return laid_fur(mesh.vertices[-1], mesh.normals, hair, laying, mesh.thickness, mesh.layers)


def frames_dataset(frames: Frames, views: Sequence[View]) -> xr.Dataset:
    """`fur_frames` of the pictures from these views."""
    import xarray as xr

    return xr.Dataset(
        {
            "frames": (("view", *_PIXELS, "channel"), frames.pictures),
            "azimuth": ("view", [view.azimuth for view in views]),
            "elevation": ("view", [view.elevation for view in views]),
            "coverage": ("view", frames.coverage),
        }
    )


LOADERS: dict[str, Callable[[StoredVersion], object]] = {
    "attenuation": lambda version: photograph_of(version.input("fur_photo"), version.dataset),
    "shell_stack": lambda version: shell_stack_of(version.dataset),
    "shell_mesh": lambda version: shell_mesh_of(version.dataset),
    "lie_field": lambda version: hair_of(version.dataset),
    "fur_patches": lambda version: laying_of(version.dataset),
}
"""What ``tsuya.load`` gives, by asset: the photograph with its medium, its layers, the mesh, the
hair there, and the photograph laid along it."""
