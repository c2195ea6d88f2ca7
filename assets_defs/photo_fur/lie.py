"""How hair lies on the mesh, and the photograph laid along it: `lie_field`, `fur_patches`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field, field_validator

from assets_defs.checks import Check
from assets_defs.photo_fur.datasets import (
    fur_patches_dataset,
    laying_of,
    lie_field_dataset,
    opaque_of,
    shell_mesh_of,
)
from assets_defs.photo_fur.declaration import FUR
from assets_defs.settings import Settings
from assets_defs.system import Pictures, Result
from pipelines.photo_fur import figures
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.photo_fur.laying import Piece
    from pipelines.photo_fur.photograph_lie import PhotographLie
    from pipelines.photo_fur.shells import ShellMesh


# ---- lie_field -------------------------------------------------------------------------------


class LieSettings(Settings):
    """How the hair is to lie."""

    backwards: tuple[float, float, float] | None = Field(
        None,
        description="Direction from nose to tail; by default along the longer side of the mesh's "
        "box, away from its higher end",
    )
    gravity: float = Field(
        0.5, ge=0.0, le=100.0, description="How much hair hangs down, over lying backwards"
    )
    smoothness: float = Field(
        0.12, gt=0.0, le=10.0, description="Turns shorter than this are evened out, in mesh radii"
    )
    strokes: str = Field(
        "",
        description="Lines on the mesh along which hair lies, from root to tip: points x,y,z in "
        "mesh units, z up, with spaces between them and semicolons between lines",
    )
    stroke_reach: float = Field(
        0.15, gt=0.0, le=10.0, description="How far from a stroke hair follows it, in mesh radii"
    )
    even_length: bool = Field(
        False, description="Hair as long everywhere; else shorter where the body is thin"
    )

    @field_validator("strokes")
    @classmethod
    def _lines(cls, strokes: str) -> str:
        from pipelines.photo_fur.strokes import strokes_of

        strokes_of(strokes)
        return strokes


def _guide_error(version: StoredVersion) -> float:
    guides, tangents = (version.dataset[name].values for name in ("guides", "tangents"))
    return figures.guide_error(guides, tangents)


@FUR.asset(
    schemas.LIE_FIELD,
    by=("mesh",),
    settings=LieSettings,
    inputs=("shell_mesh",),
    checks=(
        Check(
            "guide_error",
            "Median angle between the hair and what was asked of it, by its strength, in degrees; "
            "90 of hair that lies anyhow.",
            _guide_error,
            at_most=60.0,
            change=2.0,
        ),
    ),
)
def lie_field(settings: LieSettings, shell_mesh: xr.Dataset) -> Result:
    """The smoothest field of directions that heeds nose, tail, gravity and strokes."""
    import numpy as np

    from pipelines.photo_fur import lie
    from pipelines.photo_fur.hair_length import hair_lengths
    from pipelines.photo_fur.shells import mesh_radius

    mesh = shell_mesh_of(shell_mesh)
    skin, radius = mesh.vertices[-1], mesh_radius(mesh.vertices[-1])
    given = settings.backwards
    backwards = lie.nose_to_tail(skin) if given is None else np.array(given)
    guides = _guides(settings, mesh, backwards)
    smoothness = settings.smoothness * radius
    field = lie.lie_field(skin, mesh.normals, mesh.triangles, guides, smoothness)
    even = settings.even_length
    lengths = np.ones(len(skin)) if even else hair_lengths(skin, mesh.normals, mesh.triangles)
    shown = {
        "nose to tail": ", ".join(f"{part:.3g}" for part in backwards),
        "crowns and saddles": len(field.indices),
        "shortest hair": float(lengths.min()),
    }
    return lie_field_dataset(field, lengths, guides, backwards, shell_mesh.attrs["name"]), shown


def _guides(
    settings: LieSettings, mesh: ShellMesh, backwards: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Wanted directions, by vertex."""
    from pipelines.photo_fur.lie import guides_backwards
    from pipelines.photo_fur.shells import mesh_radius
    from pipelines.photo_fur.strokes import guides_along, strokes_of

    skin = mesh.vertices[-1]
    others = guides_backwards(mesh.normals, backwards, settings.gravity)
    reach = settings.stroke_reach * mesh_radius(skin)
    return guides_along(strokes_of(settings.strokes), reach, skin, others)


# ---- fur_patches -----------------------------------------------------------------------------


class PatchSettings(Settings):
    """How the photograph is laid."""

    photograph_width: float = Field(
        0.8, gt=0.0, le=100.0, description="Width of the photograph on the mesh, in mesh radii"
    )
    patches_across: float | None = Field(
        None,
        ge=1.0,
        le=100.0,
        description="Patches that fit beside each other on a photograph; by default so many that "
        "a patch is half as wide as the fur in it, 5.5 of a square of fur",
    )
    patch_seed: int = Field(0, ge=0, description="Seed of the pieces that patches take")


def _patch_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.photo_fur.pictures import lie_picture

    return {"lie": lie_picture(dataset["direction"].values, dataset["coherence"].values)}


def _strand_scale_spread(version: StoredVersion) -> float:
    skin = version.input("shell_mesh")["vertices"].values[-1]
    laying = laying_of(version.dataset)
    return figures.strand_scale_spread(skin, laying)


def _lie_error(version: StoredVersion) -> float:
    skin = version.input("shell_mesh")["vertices"].values[-1]
    tangents = version.input("lie_field")["tangents"].values
    dataset = version.dataset
    return figures.laid_lie_error(
        skin, tangents, laying_of(dataset), dataset["direction"].values, dataset["coherence"].values
    )


@FUR.asset(
    schemas.FUR_PATCHES,
    by=("photo", "mesh"),
    settings=PatchSettings,
    inputs=("fur_photo", "shell_mesh", "lie_field"),
    pictures=_patch_pictures,
    checks=(
        Check(
            "strand_scale_spread",
            "Width of hairs at the 90th over that at the 10th percentile of the surface; a box of "
            "few triangles has some 6.",
            _strand_scale_spread,
            at_most=12.0,
            change=0.1,
        ),
        Check(
            "lie_error",
            "Median angle between the laid photograph's hair and the field, in degrees; 90 of "
            "patches turned anyhow; a photograph without lines has some 40.",
            _lie_error,
            at_most=70.0,
            change=2.0,
        ),
    ),
)
def fur_patches(
    settings: PatchSettings, fur_photo: xr.Dataset, shell_mesh: xr.Dataset, lie_field: xr.Dataset
) -> Result:
    """Lay the photograph over the mesh in patches, each turned along the lie."""
    from pipelines.photo_fur.laying import Body, choose_patches, lay
    from pipelines.photo_fur.photograph_lie import photograph_lie
    from pipelines.photo_fur.shells import mesh_radius

    mesh = shell_mesh_of(shell_mesh)
    width = settings.photograph_width * mesh_radius(mesh.vertices[-1])
    lie = photograph_lie(fur_photo["luminance"].values, opaque_of(fur_photo))
    spacing = _spacing(settings, fur_photo, mesh, width)
    body = Body(mesh.vertices[-1], mesh.triangles, lie_field["tangents"].values, mesh.normals)
    pieces = _pieces(fur_photo, lie, spacing / width)
    patches = choose_patches(body, pieces, spacing=spacing, seed=settings.patch_seed)
    laying = lay(body, patches, spacing=spacing, width=width)
    shown = {"patches": len(patches.middles), "sign's skewness": lie.slant}
    return fur_patches_dataset(patches, laying, lie, width=width, spacing=spacing), shown


def _spacing(
    settings: PatchSettings, fur_photo: xr.Dataset, mesh: ShellMesh, width: float
) -> float:
    """Between patches' middles on a mesh, in its units."""
    from pipelines.photo_fur.laying import REACH, least_spacing
    from pipelines.photo_fur.photograph_lie import disc_radius

    radius = disc_radius(fur_photo["luminance"].shape, opaque_of(fur_photo))
    across = settings.patches_across or REACH / radius
    return max(width / across, least_spacing(mesh.vertices[-1].astype("float64"), mesh.triangles))


def _pieces(fur_photo: xr.Dataset, lie: PhotographLie, spacing: float) -> Piece:
    """Where patches may be taken from; spacing in photograph widths."""
    from pipelines.photo_fur.laying import REACH
    from pipelines.photo_fur.photograph_lie import pieces_of

    return pieces_of(lie, REACH * spacing, opaque_of(fur_photo), fur_photo["radiance"].values)
