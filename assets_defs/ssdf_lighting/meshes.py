"""What is lit: `scene_mesh`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.datasets import scene_dataset, scene_of
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.ssdf_lighting.file_materials import materials_of, textures_of_file
from assets_defs.system import NOTES, Result
from pipelines.ssdf_lighting import figures
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    from pipelines.ssdf_lighting.scene import Scene


class SceneSettings(Settings):
    """The scene's size."""

    segments: int = Field(
        20, ge=4, le=160, description="Built-in scenes: segments of a patch's edge"
    )
    floor: int = Field(64, ge=8, le=512, description="Built-in scenes: squares along the floor")
    edge: float = Field(
        0.05,
        ge=0.005,
        le=2.0,
        description="Your mesh: edges longer than this many scene radii are halved",
    )
    up: Literal["auto", "y", "z"] = Field(
        "auto", description="Your mesh's upward axis; auto: y for glTF, which says so, else z"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"segments": 6, "floor": 16, "edge": 0.2},
    }


def load_scene(source: Source, settings: SceneSettings) -> Scene:
    """A built-in scene, or a user's, repaired. Raises ValueError, BadInput for one that is none."""
    from pipelines.geometry.meshes import y_up_to_z_up
    from pipelines.ssdf_lighting.scene import built_in_scene, make_scene
    from storage.readers.scenes import read_scene

    if source.path is None:
        return built_in_scene(source.key, settings.segments, settings.floor)
    read = read_scene(source.path)
    vertices = read.vertices
    is_gltf = source.path.suffix.lower() in (".glb", ".gltf")
    if settings.up == "y" or (settings.up == "auto" and is_gltf):
        vertices = y_up_to_z_up(vertices)
    materials, textures = materials_of(read), textures_of_file(read)
    try:
        scene = make_scene(vertices, read.triangles, read.part, materials, textures, settings.edge)
    except ValueError as error:
        raise ValueError(f"{source.name}: {error}") from error
    return scene._replace(notes=(*read.notes, *scene.notes))


def _normal_error(version: StoredVersion) -> float:
    mesh = version.dataset
    return figures.turned_away(
        mesh["vertices"].values, mesh["triangles"].values, mesh["normals"].values
    )


def _area(version: StoredVersion) -> float:
    mesh = version.dataset
    return figures.surface_area(mesh["vertices"].values, mesh["triangles"].values)


def _reflectance(version: StoredVersion) -> float:
    return figures.reflectance(scene_of(version.dataset))


@SSDF.asset(
    schemas.SCENE_MESH,
    by=("scene",),
    settings=SceneSettings,
    from_source=True,
    checks=(
        Check(
            "normal_error",
            "Share of the triangles' corners whose normal looks away from the triangle's side.",
            _normal_error,
            at_most=0.02,
        ),
        Check("area", "Area in squared scene radii.", _area, at_least=1e-6, change=0.01),
        Check(
            "reflectance",
            "Share of white light that its surfaces reflect, by textures where they have them.",
            _reflectance,
            at_least=0.005,
            at_most=1.5,
            change=0.01,
        ),
    ),
)
def scene_mesh(settings: SceneSettings, source: Source) -> Result:
    """Make the scene, or read, repair and centre a user's; what was repaired is in the metadata."""
    scene = load_scene(source, settings)
    return scene_dataset(scene, source.name), {
        "vertices": len(scene.vertices),
        "triangles": len(scene.triangles),
        NOTES: scene.notes,
    }
