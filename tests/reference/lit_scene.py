"""Meshes under spherical Gaussians by Mitsuba: direct light, matt and glossy.

Mitsuba knows the lights as a map of their radiance, the matt part as its ``diffuse`` and the gloss
as its ``roughconductor`` with Beckmann's distribution, k = 0 and the eta of F0, which is Fresnel's
reflection at a dielectric. Direct light adds up, so the two are rendered one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera
from pipelines.light.environment_lookup import radiance_from_directions
from pipelines.ssdf_lighting.light.microfacets import Materials
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights, evaluate
from pipelines.ssdf_lighting.scene import Scene

Array = NDArray[np.float64]

MOST_SAMPLES = 1024
"""Of one rendering: Mitsuba adds in single precision."""
_MAP_HEIGHT = 512


class Part(NamedTuple):
    """A surface of one material: vertices, normals (V, 3), triangles (F, 3)."""

    vertices: Array
    triangles: NDArray[np.integer]
    normals: Array


def mitsuba() -> Any:
    """Mitsuba in its scalar variant."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)  # it would write between the figures
    return mitsuba


def light_map(lights: Lights) -> dict[str, Any]:
    """The lights as an environment."""
    image = evaluate(lights, map_ways(_MAP_HEIGHT)).astype(np.float32)
    return {"type": "envmap", "bitmap": mitsuba().Bitmap(image), "scale": 1.0}


def map_ways(rows: int) -> Array:
    """Directions (rows, 2 rows, 3) of the points of Mitsuba's map: its rows go from pole to pole,
    y is up, and a column's middle is half a column from its edge."""
    theta = np.pi * np.arange(rows) / (rows - 1)
    phi = 2 * np.pi * (np.arange(2 * rows) + 0.5) / (2 * rows)
    sine = np.sin(theta)[:, None]
    height = np.broadcast_to(np.cos(theta)[:, None], (rows, 2 * rows))
    return np.stack([sine * np.sin(phi), height, -sine * np.cos(phi)], axis=-1)


def pictures(
    folder: Path,
    parts: Sequence[Part],
    materials: Materials,
    lights: Lights,
    camera: Camera,
    size: tuple[int, int],
    samples: int,
    seed: int,
) -> Callable[[int], Array]:
    """A function of the number of a run: its radiance (H, W, 3), independent of other runs'."""
    black: dict[str, Any] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    matt: list[dict[str, Any]] = [
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo.tolist()}}
        for albedo in materials.albedo
    ]
    root = np.sqrt(materials.specular)
    glossy: list[dict[str, Any]] = [
        {
            "type": "roughconductor",
            "distribution": "beckmann",
            "alpha": float(roughness),
            "eta": float((1 + r) / (1 - r)),
            "k": 0.0,
        }
        if r > 0
        else black
        for r, roughness in zip(root, materials.roughness, strict=True)
    ]
    files = [_write_ply(part, folder / f"{number}.ply") for number, part in enumerate(parts)]
    looks = [matt, glossy] if (materials.specular > 0).any() else [matt]
    scenes = [_scene(files, look, lights, camera, size, samples) for look in looks]

    def rendered(run: int) -> Array:
        picture = np.zeros((size[1], size[0], 3))
        for number, scene in enumerate(scenes):
            of_run = (seed + run) * 2 + number
            picture += np.array(mitsuba().render(scene, spp=samples, seed=of_run), np.float64)
        return picture

    return rendered


def _scene(
    files: Sequence[str],
    materials: Sequence[dict[str, Any]],
    lights: Lights,
    camera: Camera,
    size: tuple[int, int],
    samples: int,
) -> Any:
    return _described(files, materials, light_map(lights), camera, size, samples)


def _described(
    files: Sequence[str],
    materials: Sequence[dict[str, Any]],
    sky: dict[str, Any],
    camera: Camera,
    size: tuple[int, int],
    samples: int,
    sampler: str = "independent",
) -> Any:
    width, height = size
    shapes = {
        f"object {number}": {"type": "ply", "filename": file, "material": material}
        for number, (file, material) in enumerate(zip(files, materials, strict=True))
    }
    transform = (
        mitsuba()
        .ScalarTransform4f()
        .look_at(origin=list(camera.position), target=list(camera.target), up=list(camera.up))
    )
    return mitsuba().load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "sensor": {
                "type": "perspective",
                "fov": camera.view_angle,
                "fov_axis": "y",
                "near_clip": 1e-3,
                "to_world": transform,
                "film": {
                    "type": "hdrfilm",
                    "width": width,
                    "height": height,
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                    "component_format": "float32",
                },
                "sampler": {"type": sampler, "sample_count": min(samples, MOST_SAMPLES)},
            },
            "sky": sky,
            **shapes,
        },
        optimize=False,
    )


def parts_of(scene: Scene) -> list[Part]:
    """A scene's surfaces, one a material."""
    parts = []
    for part in range(len(scene.materials.albedo)):
        used, corners = np.unique(scene.triangles[scene.part == part], return_inverse=True)
        parts.append(Part(scene.vertices[used], corners.reshape(-1, 3), scene.normals[used]))
    return parts


def pictures_under_probe(
    folder: Path,
    parts: Sequence[Part],
    materials: Materials,
    radiance: NDArray[np.floating],
    camera: Camera,
    size: tuple[int, int],
    samples: int,
) -> Callable[[int, int], Array]:
    """A function of the paths' edges (2: direct light) and a seed: radiance (H, W, 3) under a map.

    ``radiance`` (rows, 2 rows, 3) is constant in its texels, as `environment_lookup` has it;
    Mitsuba interpolates between points, of which it gets four a texel.
    """
    files = [_write_ply(part, folder / f"{number}.ply") for number, part in enumerate(parts)]
    root = np.sqrt(materials.specular)
    looks = [
        _matt_and_glossy(albedo, float(r), float(roughness))
        for albedo, r, roughness in zip(materials.albedo, root, materials.roughness, strict=True)
    ]
    ways = map_ways(2 * len(radiance) + 1)
    texels = radiance_from_directions(radiance.astype(np.float32), ways.reshape(-1, 3))
    sky = {"type": "envmap", "bitmap": mitsuba().Bitmap(texels.reshape(ways.shape))}
    # Spread evenly over each pixel's choices of sun and sky: 7 dB less noise than independent ones.
    scene = _described(files, looks, sky, camera, size, samples, "multijitter")

    def rendered(edges: int, seed: int) -> Array:
        integrator = {"type": "path", "max_depth": edges, "rr_depth": 99, "hide_emitters": True}
        made = mitsuba().load_dict(integrator)
        return np.array(mitsuba().render(scene, integrator=made, spp=samples, seed=seed), float)

    return rendered


def _matt_and_glossy(albedo: Array, root: float, roughness: float) -> dict[str, Any]:
    """The sum of both, as a mixture of them made stronger."""
    part = 0.25 if root > 0 else 0.0
    colour = {"type": "rgb", "value": (albedo / (1 - part)).tolist()}
    matt = {"type": "diffuse", "reflectance": colour}
    if not part:
        return matt
    shine = {
        "type": "roughconductor",
        "distribution": "beckmann",
        "alpha": roughness,
        "eta": (1 + root) / (1 - root),
        "k": 0.0,
        "specular_reflectance": {"type": "uniform", "value": 1 / part},
    }
    return {"type": "blendbsdf", "weight": part, "matt": matt, "shine": shine}


def _write_ply(part: Part, path: Path) -> str:
    """Positions and normals in text: nothing is lost that float32 has."""
    rows = np.concatenate([part.vertices, part.normals], axis=1)
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n{properties}"
        f"element face {len(part.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
        + "".join(" ".join(f"{value:.9g}" for value in row) + "\n" for row in rows)
        + "".join(f"3 {a} {b} {c}\n" for a, b, c in part.triangles)
    )
    return str(path)
