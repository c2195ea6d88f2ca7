"""What is lit: `scene_mesh`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import Metadata
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.ssdf_lighting.light.microfacets import Materials
    from pipelines.ssdf_lighting.scene import Scene

    Result = tuple[xr.Dataset, Metadata]


class SceneSettings(Settings):
    """The scene's size."""

    segments: int = Field(
        20, ge=4, le=160, description="Built-in scenes: segments of a patch's edge"
    )
    floor: int = Field(64, ge=8, le=512, description="Built-in scenes: squares along the floor")
    up: Literal["auto", "y", "z"] = Field(
        "auto", description="Your mesh's upward axis; auto: y for GLB, as glTF has it, else z"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"segments": 6, "floor": 16},
    }


def _loaded(source: Source, settings: SceneSettings) -> Scene:
    import numpy as np

    from pipelines.geometry.shapes import turned_up
    from pipelines.ssdf_lighting.light.microfacets import Materials
    from pipelines.ssdf_lighting.scene import built_in_scene, make_scene
    from storage.readers.scenes import read_scene

    if source.path is None:
        return built_in_scene(source.key, settings.segments, settings.floor)
    read = read_scene(source.path)
    vertices = read.vertices
    if settings.up == "y" or (settings.up == "auto" and source.path.suffix.lower() == ".glb"):
        vertices = turned_up(vertices)
    materials = Materials(
        np.array([material.albedo for material in read.materials]),
        np.clip([material.specular for material in read.materials], 0.0, 0.99),
        np.clip([material.roughness for material in read.materials], 0.05, 1.0),
    )
    try:
        made = make_scene(vertices, read.triangles, read.part, materials)
    except ValueError as error:
        raise ValueError(f"{source.name}: {error}") from error
    return made._replace(notes=(*read.notes, *made.notes))


def counted(source: Source, settings: Settings) -> tuple[int, int]:
    """Vertices and triangles of a scene. Raises ValueError, BadInput for one that is none."""
    assert isinstance(settings, SceneSettings)
    scene = _loaded(source, settings)
    return len(scene.vertices), len(scene.triangles)


def check_size(name: str, vertices: int, settings: Settings) -> int:
    """The number of directions. Raises ValueError where the matrix needs more bytes than allowed,
    and for a number that is no octahedral map's."""
    from assets_defs.ssdf_lighting.visibility import VisibilitySettings
    from pipelines.ssdf_lighting.distances.octahedral import resolution_of

    assert isinstance(settings, VisibilitySettings)
    resolution_of(settings.directions)
    needed = vertices * settings.directions * 4
    if needed > settings.byte_budget:
        raise ValueError(
            f"{name}: the SSDFs of {vertices} vertices and {settings.directions} directions need "
            f"{needed} bytes; expected at most byte_budget, {settings.byte_budget}."
        )
    return settings.directions


def materials_of(scene_mesh: xr.Dataset) -> Materials:
    """The materials of a `scene_mesh` dataset."""
    from pipelines.ssdf_lighting.light.microfacets import Materials

    names = ("albedo", "specular", "roughness")
    return Materials(*(scene_mesh[name].values for name in names))


def scene_of(scene_mesh: xr.Dataset) -> Scene:
    """The scene that a `scene_mesh` dataset holds."""
    from pipelines.ssdf_lighting.scene import Scene

    return Scene(
        scene_mesh["vertices"].values,
        scene_mesh["triangles"].values,
        scene_mesh["normals"].values,
        scene_mesh["part"].values,
        materials_of(scene_mesh),
        scene_mesh["middle"].values,
        float(scene_mesh["scale"]),
        tuple(scene_mesh.attrs["notes"]),
    )


def _normal_error(checked: StoredVersion) -> float:
    """Share of the triangle corners whose normal looks to the other side of the triangle."""
    import numpy as np

    dataset = checked.dataset
    triangles = dataset["triangles"].values
    a, b, c = dataset["vertices"].values[triangles].transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    along = np.einsum("fc,fkc->fk", facing, dataset["normals"].values[triangles])
    return float((along < 0).mean())


def _area(checked: StoredVersion) -> float:
    import numpy as np

    dataset = checked.dataset
    a, b, c = dataset["vertices"].values[dataset["triangles"].values].transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


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
    ),
)
def scene_mesh(settings: SceneSettings, source: Source) -> Result:
    """Make the scene, or read, repair and centre a user's; what was repaired is in the metadata."""
    import xarray as xr

    scene = _loaded(source, settings)
    dataset = xr.Dataset(
        {
            "vertices": (("vertex", "axis"), scene.vertices),
            "normals": (("vertex", "axis"), scene.normals),
            "triangles": (("triangle", "corner"), scene.triangles),
            "part": (("triangle",), scene.part),
            "albedo": (("material", "channel"), scene.materials.albedo),
            "specular": (("material",), scene.materials.specular),
            "roughness": (("material",), scene.materials.roughness),
            "middle": (("axis",), scene.middle),
            "scale": ((), scene.scale),
        },
        attrs={"name": source.name, "notes": list(scene.notes)},
    )
    return dataset, {
        "vertices": len(scene.vertices),
        "triangles": len(scene.triangles),
        "repaired": " ".join(scene.notes) or "nothing",
    }
