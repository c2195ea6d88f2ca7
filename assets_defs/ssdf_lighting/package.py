"""The lit scene for programs that know nothing of the store: `lit_package`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from pydantic import Field

from assets_defs.packages import PackageSettings, package_dataset, read_back_check
from assets_defs.settings import Preset
from assets_defs.ssdf_lighting.datasets import (
    bounce_of,
    decoder_of,
    lights_of,
    packed_basis,
    scene_of,
)
from assets_defs.ssdf_lighting.declaration import ENVIRONMENTS, SCENES, SSDF
from assets_defs.system import Result
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.drawing.stage import Camera
    from pipelines.ssdf_lighting.drawing.live_parts import ReferenceView
    from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
    from storage.packages import Contents, Figure, Mesh, Source, View

_BUILT_IN = "Apache-2.0 (made by Tsuya)"
_PAPERS_BYTES = 66.4 * 2**20
_CODES = {"vectors": "float16", "weights": "float16"}
_PAPERS_FORM = ("vectors", "first", "row_vertex", "row_first", "weights")
_MAPS = {"map_of": "texture_of", "map_wrap": "texture_wrap", "map_mapping": "texture_mapping"}


class LitPackageSettings(PackageSettings):
    """The pictures that the package holds."""

    view_width: int = Field(320, ge=32, le=1024, description="Of its reference pictures, 4:3")
    poster_width: int = Field(960, ge=32, le=2048, description="Of its poster, 4:3")
    azimuth: float | None = Field(
        None, ge=-360.0, le=360.0, description="The camera's, degrees; as of `relit_frames`"
    )
    elevation: float | None = Field(None, ge=-89.0, le=89.0, description="The same")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"view_width": 96, "poster_width": 96},
    }


def _expected(version: StoredVersion) -> dict[str, Any]:
    """Parts as the datasets have them, by NumPy alone."""
    import numpy as np

    from pipelines.ssdf_lighting.light.sphere_maps import downsampled

    scene, clusters = version.input("scene_mesh"), version.input("triangle_clusters")
    lights = version.input("environment_lights")
    basis = packed_basis(version.input("ssdf_basis"), clusters)
    bounce = version.input("bounce_factors")
    rows = min(lights.sizes["row"], 64)
    radiance = downsampled(lights["radiance"].values, rows).astype(np.float32)
    radiance = np.minimum(radiance, 65504.0)
    form = ("file",) if "file" in basis else _PAPERS_FORM
    parts = {name: basis[name].values for name in form}
    if "file" in parts:
        expected: dict[str, Any] = {"ssdf": parts["file"]}
    else:
        expected = {k: v.astype(_CODES.get(k, np.int32)) for k, v in parts.items()}
    if "texels" in scene:
        ends = np.cumsum(scene["texture_size"].values.prod(axis=1))
        for number, texels in enumerate(np.split(scene["texels"].values, ends[:-1])):
            width, height = scene["texture_size"].values[number]
            expected[f"map_{number:03d}"] = texels.reshape(height, width, 3)
    for name in ("albedo", "specular", "roughness"):
        expected[name] = scene[name].values.astype(np.float32)
    for name, values in _lights(lights, basis)._asdict().items():
        expected[f"light_{name}"] = values.astype(np.float32)
    return {
        **expected,
        "triangle_cluster": clusters["cluster"].values.astype(np.uint16),
        "environment": radiance.astype(np.float16),
        **{f"bounce_{name}": bounce[name].values for name in bounce},
    }


@SSDF.asset(
    schemas.LIT_PACKAGE,
    by=("scene", "environment"),
    settings=LitPackageSettings,
    inputs=(
        "scene_mesh",
        "triangle_clusters",
        "ssdf_basis",
        "bounce_factors",
        "environment_lights",
        "relit_frames",
    ),
    kinds=frozenset({"zarr", "pyvista"}),
    checks=(read_back_check(_expected),),
)
def lit_package(
    settings: LitPackageSettings,
    keys: Mapping[str, str],
    lineage: Sequence[Mapping[str, Any]],
    *,
    scene_mesh: xr.Dataset,
    triangle_clusters: xr.Dataset,
    ssdf_basis: xr.Dataset,
    bounce_factors: xr.Dataset,
    environment_lights: xr.Dataset,
    relit_frames: xr.Dataset,
) -> Result:
    """Pack scene, distances and light, and draw the reference views."""
    from storage.packages import write_package
    from storage.packages.ssdf_lighting import PACKAGE

    inputs = _Inputs(
        scene_mesh,
        triangle_clusters,
        packed_basis(ssdf_basis, triangle_clusters),
        bounce_factors,
        environment_lights,
        float(relit_frames["exposure"]),
    )
    pictures = _pictures(settings, inputs)
    contents = _contents(settings, keys, lineage, inputs, pictures)
    content = write_package(PACKAGE, contents)
    return package_dataset(content), {"bytes": len(content), "views": len(pictures.views)}


class _Inputs(NamedTuple):
    """What is packed."""

    scene_mesh: xr.Dataset
    triangle_clusters: xr.Dataset
    ssdf_basis: xr.Dataset
    bounce_factors: xr.Dataset
    environment_lights: xr.Dataset
    exposure: float


class _Pictures(NamedTuple):
    """What the stage drew, and from where."""

    camera: Camera
    views: Sequence[ReferenceView]
    poster: NDArray[np.uint8]


def _pictures(settings: LitPackageSettings, inputs: _Inputs) -> _Pictures:
    from pipelines.ssdf_lighting.drawing import live_parts
    from pipelines.ssdf_lighting.drawing.viewpoints import scene_camera, viewpoint

    scene = scene_of(inputs.scene_mesh)
    lights = _lights(inputs.environment_lights, inputs.ssdf_basis)
    distances = decoder_of(inputs.ssdf_basis).distances_along
    size = (settings.view_width, settings.view_width * 3 // 4)
    view = viewpoint(scene, settings.azimuth, settings.elevation, size[0] / size[1])
    cluster = inputs.triangle_clusters["cluster"].values
    bounce = bounce_of(inputs.bounce_factors)
    return _Pictures(
        view.camera,
        live_parts.reference_views(
            scene, lights, distances, cluster, view.camera, size, inputs.exposure, bounce
        ),
        live_parts.poster(
            scene,
            lights,
            distances,
            lambda aspect: scene_camera(scene, view.azimuth, view.elevation, aspect),
            settings.poster_width,
            inputs.exposure,
            bounce,
        ),
    )


def _lights(environment_lights: xr.Dataset, ssdf_basis: xr.Dataset) -> Lights:
    """As sharp as the distances are exact."""
    from pipelines.ssdf_lighting.light.spherical_gaussians import softened

    return softened(lights_of(environment_lights), float(ssdf_basis["rmse"]))


def _contents(
    settings: LitPackageSettings,
    keys: Mapping[str, str],
    lineage: Sequence[Mapping[str, Any]],
    inputs: _Inputs,
    pictures: _Pictures,
) -> Contents:
    from pipelines.ssdf_lighting.drawing import live_parts
    from storage.packages import Contents

    radiance = inputs.environment_lights["radiance"].values
    values = _values(inputs)
    values |= {f"reference_{view.name}": view.frame for view in pictures.views}
    values |= {"poster": pictures.poster, "input": live_parts.environment_picture(radiance)}
    scene, light = (inputs.scene_mesh.attrs["name"], inputs.environment_lights.attrs["name"])
    return Contents(
        f"{scene} under {light}",
        _sources(settings, keys, {"scene": scene, "environment": light}),
        values,
        {
            "exposure": inputs.exposure,
            "background": live_parts.background(),
            "rmse": float(inputs.ssdf_basis["rmse"]),
            "irradiance_error": float(inputs.environment_lights["irradiance_error"]),
            "shadowed_error": float(inputs.environment_lights["shadowed_error"]),
        },
        _views(pictures),
        _figures(inputs, lineage),
        lineage,
    )


def _sources(
    settings: LitPackageSettings, keys: Mapping[str, str], names: Mapping[str, str]
) -> list[Source]:
    from storage.packages import Source

    built_in = {"scene": SCENES, "environment": (*ENVIRONMENTS, "uniform")}
    given = settings.licence or "not stated"
    return [
        Source(name, _BUILT_IN if keys[dimension] in built_in[dimension] else given)
        for dimension, name in names.items()
    ]


def _values(inputs: _Inputs) -> dict[str, Any]:
    import numpy as np

    from pipelines.ssdf_lighting.drawing import live_parts

    scene, radiance = scene_of(inputs.scene_mesh), inputs.environment_lights["radiance"].values
    lights = _lights(inputs.environment_lights, inputs.ssdf_basis)
    tint = scene.materials.tint
    of_materials = {
        "albedo": scene.materials.albedo,
        "specular": scene.materials.specular,
        "roughness": scene.materials.roughness,
        "tint": np.ones_like(scene.materials.albedo) if tint is None else tint,
    }
    return {
        "mesh": _mesh(live_parts.live_mesh(scene)),
        "triangle_cluster": inputs.triangle_clusters["cluster"].values.astype(np.uint16),
        **{name: values.astype(np.float32) for name, values in of_materials.items()},
        "gloss_lobes": live_parts.gloss_table(scene),
        **(_varying(inputs.scene_mesh) if "texels" in inputs.scene_mesh else {}),
        **_distances(inputs.ssdf_basis),
        **{f"light_{name}": values.astype(np.float32) for name, values in lights._asdict().items()},
        **{f"bounce_{name}": part.values for name, part in inputs.bounce_factors.items()},
        "environment": live_parts.shown_environment(radiance),
    }


def _mesh(made: Any) -> Mesh:
    from storage.packages import Mesh

    attributes = {"SOURCE": made.source, "MATERIAL": made.material, "LOBES": made.lobes}
    attributes |= {"UV1": made.uvs[:, 1], "PAINT": made.paint}
    return Mesh(made.vertices, made.triangles, made.normals, made.uvs[:, 0], attributes)


def _varying(scene_mesh: xr.Dataset) -> dict[str, Any]:
    """Maps and factors of materials that vary."""
    import numpy as np

    parts = {
        "varying": scene_mesh["varying"].values,
        "factors": scene_mesh["factors"].values.astype(np.float32),
        **{name: scene_mesh[stored].values for name, stored in _MAPS.items()},
    }
    first = 0
    for number, (width, height) in enumerate(scene_mesh["texture_size"].values):
        texels = scene_mesh["texels"][first : first + width * height].values
        parts[f"map_{number:03d}"] = texels.reshape(height, width, 3)
        first += width * height
    return parts


def _distances(ssdf_basis: xr.Dataset) -> dict[str, Any]:
    """The compressed SSDFs in either form."""
    import numpy as np

    from pipelines.ssdf_lighting.compression.compact_file import from_bytes
    from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

    if "file" not in ssdf_basis:
        return {
            name: ssdf_basis[name].values.astype(_CODES.get(name, np.int32))
            for name in _PAPERS_FORM
        }
    file = ssdf_basis["file"].values
    return {"ssdf": file, "root_weight": root_weights(from_bytes(file.tobytes()).resolution ** 2)}


def _views(pictures: _Pictures) -> list[View]:
    from dataclasses import asdict

    from pipelines.ssdf_lighting.drawing.live_parts import SUPERSAMPLING
    from storage.packages import View

    camera = asdict(pictures.camera)
    return [
        View(
            view.name,
            f"reference_{view.name}",
            view.frame.shape[1],
            view.frame.shape[0],
            SUPERSAMPLING,
            camera,
            {
                "turn": view.turn,
                "shadows": view.shadows,
                "clusters": view.clusters,
                "reflected": True,
                "behind": False,
                "exposure": 0.0,
            },
        )
        for view in pictures.views
    ]


def _figures(inputs: _Inputs, lineage: Sequence[Mapping[str, Any]]) -> list[Figure]:
    from storage.packages import Figure, PaperFigure

    basis, lights = inputs.ssdf_basis, inputs.environment_lights
    paper = PaperFigure(_PAPERS_BYTES, "table of sizes: 48 singular values a cluster")
    stated = [
        Figure("vertices with an SSDF", float(inputs.scene_mesh.sizes["vertex"])),
        Figure("raw SSDFs", float(basis["bytes_raw"]), "byte", None),
        Figure("compressed SSDFs, file", float(basis["bytes_file"]), "byte", paper),
        Figure(
            "compressed SSDFs, resident while drawn", float(basis["bytes_memory"]), "byte", paper
        ),
        Figure("error of the angle", float(basis["rmse"]), "rad"),
        Figure("share of the sky with wrong visibility", float(basis["wrong_visibility"])),
        Figure("relative error of irradiance", float(lights["irradiance_error"])),
        Figure("relative error of irradiance behind occluders", float(lights["shadowed_error"])),
    ]
    if "relative_error" in basis:
        cumulative = float(basis["relative_error"].sum())
        told = PaperFigure(0.312758, "table of sizes: 48 singular values a cluster")
        stated.append(Figure("cumulative error", cumulative, "1", told))
    checks = {name: one for each in lineage for name, one in each.get("checks", {}).items()}
    for name, meaning in (
        ("relit_psnr", "PSNR of the first frame against SSDFs not compressed"),
        ("probe_psnr", "PSNR of direct light against rays under the environment itself"),
    ):
        if name in checks:
            stated.append(Figure(meaning, float(checks[name]["figure"]), "dB"))
    return stated
