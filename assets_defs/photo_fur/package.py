"""The fur for programs that know nothing of the store: `fur_package`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from assets_defs.packages import PackageSettings, package_dataset, read_back_check
from assets_defs.photo_fur.datasets import attenuation_of, opaque_of, photograph_of, shell_mesh_of
from assets_defs.photo_fur.declaration import FUR, PELT, SQUARE
from assets_defs.settings import Preset
from assets_defs.system import Result
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.stage_view import Fill
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.photo_fur.live_parts import FurScene, ReferenceView
    from storage.packages import Contents, Figure, Source, View

_MADE_HERE = "Apache-2.0 (made by Tsuya)"
_PHOTOGRAPH = "CC0-1.0 (scikit-image)"


class FurPackageSettings(PackageSettings):
    """How the fur is drawn at first, and the pictures that the package holds."""

    tails: Tails = "end layers"
    fill: Fill = "columns"
    view_width: int = Field(320, ge=32, le=1024, description="Of its reference pictures, 4:3")
    poster_width: int = Field(960, ge=32, le=2048, description="Of its poster, 4:3")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"view_width": 96, "poster_width": 96},
    }


def _expected(version: StoredVersion) -> dict[str, Any]:
    """Parts as the datasets have them, by NumPy alone."""
    import numpy as np

    from storage.packages import Mesh

    photo, shells = version.input("fur_photo"), version.input("shell_mesh")
    luminance, opaque = photo["luminance"].values, opaque_of(photo)
    skin = shells["vertices"].values[-1].astype(np.float64)
    mesh_key, _ = version.slot.partition.split(".")
    if mesh_key == SQUARE:
        skin[:, 0] *= luminance.shape[1] / luminance.shape[0]
    triangles = shells["triangles"].values.astype(np.uint32)
    return {
        "photograph": _expected_photograph(version, shells.sizes["shell"]),
        "luminance": luminance if opaque is None else np.where(opaque, luminance, np.float32(-1)),
        "mesh": Mesh(
            skin.astype(np.float32), triangles, shells["normals"].values, shells["uvs"].values
        ),
    }


def _expected_photograph(version: StoredVersion, layers: int) -> NDArray[np.uint8]:
    """Colours and depth codes; a layer is the number of I(n) that a pixel is not brighter than."""
    import numpy as np
    from scipy.ndimage import distance_transform_edt

    photo, medium = version.input("fur_photo"), attenuation_of(version.input("attenuation"))
    # In double precision: beside a Python float NumPy would compare single ones.
    luminance, opaque = photo["luminance"].values.astype(np.float64), opaque_of(photo)
    ratio, steps = medium.darkest / medium.brightest, 255 // layers
    layer = np.ones(luminance.shape, np.int64)
    for n in range(1, layers):
        layer += luminance <= medium.brightest * ratio ** (n / layers)
    with np.errstate(divide="ignore"):
        depth = np.log(medium.brightest / luminance) / -np.log(ratio)
    within = np.clip(depth * layers - (layer - 1.0), 0.0, 1.0)
    code = (layer - 1) * steps + np.minimum((within * steps).astype(np.int64), steps - 1)
    if version.record["settings"]["tails"] == "dropped":
        code[(luminance > medium.brightest) | (luminance < medium.darkest)] = 255
    linear = np.clip(photo["radiance"].values.astype(np.float64), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    colours = np.rint(255.0 * encoded).astype(np.uint8)
    if opaque is not None:
        code[~opaque] = 255
        nearest = distance_transform_edt(~opaque, return_distances=False, return_indices=True)
        colours = colours[tuple(nearest)]
    return np.dstack([colours, code.astype(np.uint8)])


@FUR.asset(
    schemas.FUR_PACKAGE,
    by=("photo", "mesh"),
    settings=FurPackageSettings,
    inputs=("fur_photo", "attenuation", "shell_mesh"),
    kinds=frozenset({"zarr", "pyvista"}),
    checks=(read_back_check(_expected),),
)
def fur_package(
    settings: FurPackageSettings,
    keys: Mapping[str, str],
    lineage: Sequence[Mapping[str, Any]],
    fur_photo: xr.Dataset,
    attenuation: xr.Dataset,
    shell_mesh: xr.Dataset,
) -> Result:
    """Pack the photograph and the surface, and draw the reference views."""
    from storage.packages import write_package
    from storage.packages.photo_fur import PACKAGE

    scene = _scene(settings, keys, fur_photo, attenuation, shell_mesh)
    names = {"photo": fur_photo.attrs["name"], "mesh": shell_mesh.attrs["name"]}
    figures = _figures(scene, lineage)
    contents = _contents(settings, scene, _sources(settings, keys, names), figures, lineage)
    content = write_package(PACKAGE, contents)
    return package_dataset(content), {"bytes": len(content), "views": len(contents.views)}


def _scene(
    settings: FurPackageSettings,
    keys: Mapping[str, str],
    fur_photo: xr.Dataset,
    attenuation: xr.Dataset,
    shell_mesh: xr.Dataset,
) -> FurScene:
    from pipelines.photo_fur.frames import stretched_to_photograph
    from pipelines.photo_fur.live_parts import FurScene

    photograph, mesh = photograph_of(fur_photo, attenuation), shell_mesh_of(shell_mesh)
    if keys["mesh"] == SQUARE:
        mesh = stretched_to_photograph(mesh, photograph)
    return FurScene(photograph, mesh, settings.tails)


def _contents(
    settings: FurPackageSettings,
    scene: FurScene,
    sources: Sequence[Source],
    figures: Sequence[Figure],
    lineage: Sequence[Mapping[str, Any]],
) -> Contents:
    from storage.packages import Contents

    views = scene.reference_views(settings.fill, _picture_size(settings.view_width))
    values = _values(scene) | {f"reference_{view.name}": view.frame for view in views}
    values["poster"] = scene.poster(settings.fill, _picture_size(settings.poster_width))
    photo, mesh = sources
    return Contents(
        f"{photo.name} on {mesh.name}",
        sources,
        values,
        _parameters(settings, scene),
        [_view(view) for view in views],
        figures,
        lineage,
    )


def _picture_size(width: int) -> tuple[int, int]:
    return width * 3 // 4, width


def _values(scene: FurScene) -> dict[str, Any]:
    import numpy as np

    from pipelines.photo_fur.live_parts import input_picture, luminance_part
    from pipelines.photo_fur.stage_view import fur_texture
    from storage.packages import Mesh

    photograph, mesh = scene.photograph, scene.mesh
    return {
        "photograph": fur_texture(photograph, mesh.layers, tails=scene.tails),
        "luminance": luminance_part(photograph),
        "mesh": Mesh(
            mesh.vertices[-1],
            mesh.triangles.astype(np.uint32),
            mesh.normals.astype(np.float32),
            mesh.uvs.astype(np.float32),
        ),
        "input": input_picture(photograph),
    }


def _parameters(settings: FurPackageSettings, scene: FurScene) -> dict[str, Any]:
    from pipelines.photo_fur.attenuation import code_steps
    from pipelines.photo_fur.frames import BACKGROUND

    medium = scene.photograph.attenuation
    return {
        "layers": scene.mesh.layers,
        "thickness": scene.mesh.thickness,
        "brightest": medium.brightest,
        "darkest": medium.darkest,
        "attenuation": medium.coefficient,
        "code_steps": code_steps(scene.mesh.layers),
        "fill": settings.fill,
        "tails": settings.tails,
        "background": list(BACKGROUND),
    }


def _view(view: ReferenceView) -> View:
    from storage.packages import View

    height, width, _ = view.frame.shape
    look = view.look
    state = {
        "layers": look.layers,
        "thickness": look.thickness,
        "fill": look.fill,
        **asdict(look.light),
        "light": list(look.light.light),
        "background": "grey",
    }
    camera = asdict(view.camera)
    return View(
        view.name, f"reference_{view.name}", width, height, view.supersampling, camera, state
    )


def _sources(
    settings: FurPackageSettings, keys: Mapping[str, str], names: Mapping[str, str]
) -> list[Source]:
    """What it was made from, photograph and mesh."""
    from storage.packages import Source
    from storage.readers.photographs import BUILTIN_PHOTOGRAPHS

    known = {PELT: _MADE_HERE} | dict.fromkeys(BUILTIN_PHOTOGRAPHS, _PHOTOGRAPH)
    meshes = dict.fromkeys(_built_in_meshes(), _MADE_HERE)
    given = settings.licence or "not stated"
    return [
        Source(names["photo"], known.get(keys["photo"], given)),
        Source(names["mesh"], meshes.get(keys["mesh"], given)),
    ]


def _built_in_meshes() -> tuple[str, ...]:
    (found,) = (each.builtin for each in FUR.dimensions if each.name == "mesh")
    return found


def _figures(scene: FurScene, lineage: Sequence[Mapping[str, Any]]) -> list[Figure]:
    """Figures of the fur, the paper's beside them."""
    from storage.packages import Figure, PaperFigure

    mesh = scene.mesh
    stated = [
        Figure("layers", mesh.layers, "1", PaperFigure(15, "table 1")),
        Figure("vertices of the surface", len(mesh.normals), "1", PaperFigure(34832, "Bunny")),
        Figure("pixels of the photograph", scene.photograph.luminance.size),
        Figure("attenuation a over the thickness", scene.photograph.attenuation.coefficient),
    ]
    checks = {name: one for each in lineage for name, one in each.get("checks", {}).items()}
    for name, meaning in (
        ("kept_share", "share of the pixels between Imin and Imax"),
        ("depth_rank_correlation", "rank correlation of darkness with the true depth"),
        ("texture_stretch", "stretch of the photograph on the surface, median"),
    ):
        if name in checks and checks[name]["figure"] is not None:
            stated.append(Figure(meaning, float(checks[name]["figure"])))
    return stated
