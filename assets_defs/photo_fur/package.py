"""The fur for programs that know nothing of the store: `fur_package`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.packages import PackageSettings, package_dataset, package_of, read_back_check
from assets_defs.photo_fur.datasets import (
    hair_of,
    opaque_of,
    patches_of,
    photograph_of,
    shell_mesh_of,
)
from assets_defs.photo_fur.declaration import FUR, PELT, SQUARE
from assets_defs.settings import Preset
from assets_defs.system import Result
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.stage_view import Fill, Look
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.photo_fur.live_parts import FurScene, ReferenceView
    from pipelines.photo_fur.packed_fur import Laid, PackedFur
    from pipelines.photo_fur.shells import ShellMesh
    from storage.packages import Contents, Figure, Source, View

_MADE_HERE = "Apache-2.0 (made by Tsuya)"
_PHOTOGRAPH = "CC0-1.0 (scikit-image)"


class FurPackageSettings(PackageSettings):
    """How the fur is drawn at first, and the pictures that the package holds."""

    look: Look = Field("full", description="Look at first; the square's is always plain")
    tails: Tails = "end layers"
    fill: Fill = "columns"
    photograph_quality: int = Field(
        60, ge=0, le=100, description="Of the photograph in the package, an AVIF"
    )
    view_width: int = Field(320, ge=32, le=1024, description="Of its reference pictures, 4:3")
    poster_width: int = Field(960, ge=32, le=2048, description="Of its poster, 4:3")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"view_width": 96, "poster_width": 96},
    }


def _expected(version: StoredVersion) -> dict[str, Any]:
    """Parts as the datasets have them, by NumPy alone; the photograph has a check of its own."""
    import numpy as np

    from storage.packages import Mesh

    photo, shells = version.input("fur_photo"), version.input("shell_mesh")
    patches, opaque = version.input("fur_patches"), opaque_of(photo)
    skin = shells["vertices"].values[-1].astype(np.float64)
    mesh_key, _ = version.slot.partition.split(".")
    if mesh_key == SQUARE:
        skin[:, 0] *= photo.sizes["x"] / photo.sizes["y"]
    triangles = shells["triangles"].values.astype(np.uint32)
    normals = shells["normals"].values
    expected = {
        "mesh": Mesh(skin.astype(np.float32), triangles, normals, shells["uvs"].values),
        "lie": _expected_lie(version.input("lie_field"), normals),
        "patch_vertex": patches["middles"].values.astype(np.uint32),
        "patch_place": patches["places"].values,
        "patch_direction": patches["directions"].values,
    }
    if opaque is not None:
        expected["opaque"] = np.where(opaque, np.uint8(255), np.uint8(0))[..., None]
    return expected


def _expected_lie(lie_field: xr.Dataset, normals: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Angles as complex numbers, in the plane of each normal."""
    import numpy as np

    up, tangents = normals.astype(np.float64), lie_field["tangents"].values
    b = lie_field["backwards"].values
    least = np.zeros(3)
    least[np.argmin(np.abs(b))] = 1.0
    codes = np.empty((2, len(up)), np.uint8)
    for row, (n, t) in enumerate(zip(up, tangents, strict=True)):
        east = b - (b @ n) * n
        if np.sqrt(east @ east) < np.sqrt(b @ b) / 1000:
            east = least - (least @ n) * n
        turn = np.angle(complex(t @ east, t @ np.cross(n, east))) / (2 * np.pi)
        codes[0, row] = round(turn * 256) % 256
    codes[1] = np.round(lie_field["lengths"].values.astype(np.float64) * 255)
    return codes


def _photograph_gain(version: StoredVersion) -> float:
    from pipelines.photo_fur.packed_photograph import one_colour_psnr_db, photograph_psnr_db

    photo = version.input("fur_photo")
    radiance, opaque = photo["radiance"].values, opaque_of(photo)
    content = package_of(version).array("photograph").tobytes()
    return photograph_psnr_db(content, radiance, opaque) - one_colour_psnr_db(radiance, opaque)


@FUR.asset(
    schemas.FUR_PACKAGE,
    by=("photo", "mesh"),
    settings=FurPackageSettings,
    inputs=("fur_photo", "attenuation", "shell_mesh", "lie_field", "fur_patches"),
    kinds=frozenset({"zarr", "pyvista"}),
    checks=(
        read_back_check(_expected),
        Check(
            "photograph_gain_db",
            "PSNR of the package's photograph where there is fur, in 8-bit codes, over that of one "
            "colour; coloured noise gains 2, a photograph some 14.",
            _photograph_gain,
            at_least=0.5,
            change=1.0,
        ),
    ),
)
def fur_package(
    settings: FurPackageSettings,
    keys: Mapping[str, str],
    lineage: Sequence[Mapping[str, Any]],
    fur_photo: xr.Dataset,
    attenuation: xr.Dataset,
    shell_mesh: xr.Dataset,
    lie_field: xr.Dataset,
    fur_patches: xr.Dataset,
) -> Result:
    """Pack the photograph, the surface and how the one lies on the other; draw views of that."""
    from pipelines.photo_fur.packed_fur import packed_fur
    from storage.packages import write_package
    from storage.packages.photo_fur import PACKAGE

    mesh = _mesh(keys, fur_photo, shell_mesh)
    whole = photograph_of(fur_photo, attenuation)
    packed = packed_fur(whole, mesh, _laid(lie_field, fur_patches), settings.photograph_quality)
    names = {"photo": fur_photo.attrs["name"], "mesh": shell_mesh.attrs["name"]}
    sources = _sources(settings, keys, names)
    look = "plain" if keys["mesh"] == SQUARE else settings.look
    contents = package_contents(settings, packed, sources, lineage, look)
    content = write_package(PACKAGE, contents)
    return package_dataset(content), {"bytes": len(content), "views": len(contents.views)}


def _mesh(keys: Mapping[str, str], fur_photo: xr.Dataset, shell_mesh: xr.Dataset) -> ShellMesh:
    """The square has the photograph's proportions."""
    from pipelines.photo_fur.frames import stretched

    mesh = shell_mesh_of(shell_mesh)
    if keys["mesh"] == SQUARE:
        return stretched(mesh, fur_photo.sizes["x"] / fur_photo.sizes["y"])
    return mesh


def _laid(lie_field: xr.Dataset, fur_patches: xr.Dataset) -> Laid:
    from pipelines.photo_fur.packed_fur import Laid

    return Laid(
        hair_of(lie_field),
        lie_field["backwards"].values,
        patches_of(fur_patches),
        float(fur_patches["spacing"]),
        float(fur_patches["width"]),
    )


def package_contents(
    settings: FurPackageSettings,
    packed: PackedFur,
    sources: Sequence[Source],
    lineage: Sequence[Mapping[str, Any]],
    look: Look,
) -> Contents:
    """What is in the package; pictures are drawn of what it holds, not of what that was made of."""
    from pipelines.photo_fur.live_parts import FurScene, input_picture
    from storage.packages import Contents

    scene = FurScene(packed.photograph(), packed.mesh, packed.fur(), settings.tails)
    views = scene.reference_views(look, settings.fill, _picture_size(settings.view_width))
    values = _values(packed) | {f"reference_{view.name}": view.frame for view in views}
    values["poster"] = scene.poster(look, settings.fill, _picture_size(settings.poster_width))
    values["input"] = input_picture(scene.photograph)
    photo, mesh = sources
    return Contents(
        f"{photo.name} on {mesh.name}",
        sources,
        values,
        _parameters(settings, packed, scene, look),
        [_view(view) for view in views],
        _figures(packed, lineage),
        lineage,
    )


def _picture_size(width: int) -> tuple[int, int]:
    return width * 3 // 4, width


def _values(packed: PackedFur) -> dict[str, Any]:
    import numpy as np

    from storage.packages import Mesh

    mesh, patches = packed.mesh, packed.patches
    values = {
        "photograph": np.frombuffer(packed.file, np.uint8),
        "mesh": Mesh(
            mesh.vertices[-1],
            mesh.triangles.astype(np.uint32),
            mesh.normals.astype(np.float32),
            mesh.uvs.astype(np.float32),
        ),
        "lie": packed.lie,
        "patch_vertex": patches.middles.astype(np.uint32),
        "patch_place": patches.places,
        "patch_direction": patches.directions,
    }
    if packed.opaque is not None:
        values["opaque"] = np.where(packed.opaque, np.uint8(255), np.uint8(0))[..., None]
    return values


def _parameters(
    settings: FurPackageSettings, packed: PackedFur, scene: FurScene, look: Look
) -> dict[str, Any]:
    from pipelines.photo_fur.frames import BACKGROUND
    from pipelines.photo_fur.laid_fur import middle_depth, packed_constants
    from pipelines.photo_fur.stage_view import fur_texture

    medium, mesh = packed.attenuation, packed.mesh
    image = fur_texture(scene.photograph, mesh.layers, tails=settings.tails)
    return {
        "look": look,
        "layers": mesh.layers,
        "thickness": mesh.thickness,
        "brightest": medium.brightest,
        "darkest": medium.darkest,
        "attenuation": medium.coefficient,
        "middle": middle_depth(image, mesh.layers),
        "fill": settings.fill,
        "tails": settings.tails,
        "backwards": packed.backwards.tolist(),
        "patch_spacing": packed.spacing,
        "photograph_width": packed.width,
        "constants": packed_constants(),
        "background": list(BACKGROUND),
    }


def _view(view: ReferenceView) -> View:
    from storage.packages import View

    height, width, _ = view.frame.shape
    look = view.look
    state = {
        "look": look.look,
        "layers": look.layers,
        "thickness": look.thickness,
        "fill": look.fill,
        **asdict(look.light),
        "light": list(look.light.light),
        "wind": look.wind.strength,
        "moment": look.wind.moment,
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


def _figures(packed: PackedFur, lineage: Sequence[Mapping[str, Any]]) -> list[Figure]:
    """Figures of the fur, the paper's beside them."""
    from storage.packages import Figure, PaperFigure

    mesh = packed.mesh
    stated = [
        Figure("layers", mesh.layers, "1", PaperFigure(15, "table 1")),
        Figure("vertices of the surface", len(mesh.normals), "1", PaperFigure(34832, "Bunny")),
        Figure("bytes of the photograph", len(packed.file), "byte"),
        Figure("patches", len(packed.patches.middles)),
        Figure("attenuation a over the thickness", packed.attenuation.coefficient),
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
