"""The mesh with its shells: `shell_mesh`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, Self

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.photo_fur.datasets import shell_mesh_dataset
from assets_defs.photo_fur.declaration import FUR, SQUARE, Layers
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.system import NOTES, Result
from pipelines.photo_fur import figures
from storage.schemas import photo_fur as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    from pipelines.geometry.mended_meshes import MendedMesh


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
        "auto", description="The mesh's upward axis; auto: y for glTF, which says so, else z"
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


def _step_error(version: StoredVersion) -> float:
    dataset = version.dataset
    return figures.step_error(
        dataset["vertices"].values, dataset["normals"].values, float(dataset["thickness"])
    )


def _texture_stretch(version: StoredVersion) -> float:
    from pipelines.geometry.texture_coordinates import texture_stretch

    dataset = version.dataset.load()
    return texture_stretch(
        dataset["vertices"].values[-1], dataset["triangles"].values, dataset["uvs"].values
    )


def _outward_share(version: StoredVersion) -> float:
    dataset = version.dataset.load()
    return figures.outward_share(dataset["vertices"].values, dataset["triangles"].values)


def _read(source: Source, settings: MeshSettings) -> MendedMesh:
    """A mesh of the user's, upright and repaired, or a built-in one."""
    from pipelines.geometry import shapes
    from pipelines.geometry.eared_body import eared_body
    from pipelines.geometry.mended_meshes import MendedMesh, mend_mesh
    from pipelines.geometry.meshes import brought_near, y_up_to_z_up
    from storage.readers.gltf import SUFFIXES
    from storage.readers.meshes import read_mesh

    if source.path is not None:
        vertices, triangles, uvs, notes = read_mesh(source.path)
        if settings.up == "y" or (settings.up == "auto" and source.path.suffix.lower() in SUFFIXES):
            vertices = y_up_to_z_up(vertices)
        vertices, moved = brought_near(vertices)
        mended = mend_mesh(vertices, triangles, uvs)
        return mended._replace(notes=(*notes, *moved, *mended.notes))
    built_in = {
        SQUARE: lambda: shapes.square(32),
        "sphere": lambda: shapes.sphere(64),
        "teapot": lambda: shapes.teapot(8),
        "teapot-large": lambda: shapes.teapot(33),
        "animal": eared_body,
    }[source.key]()
    return MendedMesh(built_in, ())


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
            _texture_stretch,
            at_most=3.0,
            change=0.1,
        ),
        Check(
            "outward_share",
            "Share of the surface, as seen from all around, whose hair stands towards the viewer: "
            "half of a sheet, all of a body, nothing of one that is inside out.",
            _outward_share,
            at_least=0.1,
            change=0.02,
        ),
    ),
)
def shell_mesh(settings: MeshSettings, source: Source) -> Result:
    """Offset the mesh's vertices along the normals, one set a layer."""
    from pipelines.photo_fur.shells import make_shell_mesh

    mesh, notes = _read(source, settings)
    shells = make_shell_mesh(
        mesh, settings.layers, thickness=settings.thickness, repeats=settings.repeats
    )
    shown = {"vertices": len(mesh.vertices), "triangles": len(mesh.triangles), NOTES: notes}
    return shell_mesh_dataset(shells, source.name), shown
