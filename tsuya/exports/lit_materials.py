"""Materials of a lit scene's package as glTF's, and the scene as a .glb."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from storage.packages import Package
from storage.packages.glb import Z_UP_TO_Y_UP, GlbFile

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_KINDS = ("colour", "surface", "normal")
_WRAPS = (10497, 33648, 33071)
"""glTF's numbers of repeated, mirrored, clamped."""
_METALLIC = 0.2
"""F0 above which a material without textures is taken for a metal."""
_USUAL = 0.04
"""F0 that glTF's materials have without extensions."""


class Map(NamedTuple):
    """A texture: its number among the package's, its wrap modes along u and v, its coordinates."""

    number: int
    wrap: tuple[int, int]
    mapping: int


class Material(NamedTuple):
    """As glTF and UsdPreviewSurface have it; colours linear. ``specular`` is the F0 of what is no
    metal, ``maps`` by kind: colour, surface, normal; ``bend`` of normals."""

    base: tuple[float, float, float]
    metallic: float
    roughness: float
    specular: float
    maps: dict[str, Map]
    bend: float = 1.0


def materials_of(package: Package) -> list[Material]:
    """One a row of the package's materials. Raises BadInput."""
    albedo, specular = package.array("albedo"), package.array("specular")
    slope, tint = package.array("roughness"), package.array("tint")
    found = []
    for row in range(len(specular)):
        is_metal = specular[row] > _METALLIC
        base = specular[row] * tint[row] if is_metal else albedo[row]
        colour = (float(base[0]), float(base[1]), float(base[2]))
        f0 = _USUAL if is_metal else float(specular[row])
        found.append(Material(colour, float(is_metal), math.sqrt(slope[row]), f0, {}))
    if "varying" in package.parts:
        for row, material in zip(package.array("varying"), _varying(package), strict=True):
            found[row] = material
    return found


def _varying(package: Package) -> list[Material]:
    of, wrap = package.array("map_of"), package.array("map_wrap")
    mapping = package.array("map_mapping")
    maps: dict[int, dict[str, Map]] = {}
    for number, (row, kind) in enumerate(of.tolist()):
        across, along = wrap[number].tolist()
        own = Map(number, (across, along), int(mapping[number]))
        maps.setdefault(row, {})[_KINDS[kind]] = own
    return [
        Material((f[0], f[1], f[2]), f[3], f[7], sum(f[4:7]) / 3, maps.get(row, {}), f[8])
        for row, f in enumerate(package.array("factors").tolist())
    ]


def map_files(package: Package) -> dict[str, NDArray[np.uint8]]:
    """The package's textures by the names of their files."""
    count = len(package.array("map_of")) if "map_of" in package.parts else 0
    return {f"map_{n:03d}.png": package.picture(f"map_{n:03d}") for n in range(count)}


def index_of_refraction(specular: float) -> float:
    """Of a dielectric with this reflectance along the normal, below 1."""
    root = math.sqrt(specular)
    return (1 + root) / (1 - root)


def scene_glb(package: Package, sky: NDArray[np.float32]) -> bytes:
    """The scene as a .glb with a primitive a material; ``sky`` (V,) of the mesh's vertices."""
    import numpy as np

    mesh, glb = package.mesh("mesh"), GlbFile()
    assert mesh.normals is not None
    assert mesh.uvs is not None
    attributes: dict[str, NDArray[Any]] = {
        "POSITION": mesh.vertices,
        "NORMAL": mesh.normals,
        "TEXCOORD_0": mesh.uvs * [1, -1] + [0, 1],
        "TEXCOORD_1": mesh.attributes["UV1"] * [1, -1] + [0, 1],
        "COLOR_0": mesh.attributes["PAINT"] * sky[:, None],
        "_SKY": sky,
        "_SSDF": mesh.attributes["SOURCE"],
    }
    of_triangle = mesh.attributes["MATERIAL"][mesh.triangles[:, 0]]
    primitives = []
    for row in np.unique(of_triangle).astype(int).tolist():
        own, corners = np.unique(mesh.triangles[of_triangle == row], return_inverse=True)
        primitives.append(
            {
                "attributes": {name: glb.values(each[own]) for name, each in attributes.items()},
                "indices": glb.indices(corners),
                "material": row,
            }
        )
    pictures = map_files(package)
    document: dict[str, Any] = {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": list(Z_UP_TO_Y_UP)}],
        "meshes": [{"primitives": primitives}],
        **_materials(package, glb, [glb.picture(each) for each in pictures.values()]),
    }
    return glb.whole(document)


def _materials(package: Package, glb: GlbFile, images: list[int]) -> dict[str, Any]:
    """glTF's materials, textures, samplers and images."""
    materials, textures, samplers = [], [], []
    for made in materials_of(package):
        placed: dict[str, Any] = {}
        for kind, own in made.maps.items():
            samplers.append({"wrapS": _WRAPS[own.wrap[0]], "wrapT": _WRAPS[own.wrap[1]]})
            textures.append({"source": own.number, "sampler": len(samplers) - 1})
            placed[kind] = {"index": len(textures) - 1, "texCoord": own.mapping}
        materials.append(_material(made, placed))
    found: dict[str, Any] = {
        "materials": materials,
        "extensionsUsed": ["KHR_materials_ior", "KHR_materials_specular"],
    }
    if textures:
        sources = [{"bufferView": view, "mimeType": "image/png"} for view in images]
        found |= {"textures": textures, "samplers": samplers, "images": sources}
    return found


def _material(made: Material, placed: dict[str, Any]) -> dict[str, Any]:
    surface: dict[str, Any] = {
        "baseColorFactor": [*made.base, 1.0],
        "metallicFactor": made.metallic,
        "roughnessFactor": made.roughness,
    }
    if "colour" in placed:
        surface["baseColorTexture"] = placed["colour"]
    if "surface" in placed:
        surface["metallicRoughnessTexture"] = placed["surface"]
    extensions: dict[str, Any] = {"KHR_materials_specular": {"specularFactor": 0.0}}
    if made.specular > 0:
        extensions = {"KHR_materials_ior": {"ior": index_of_refraction(made.specular)}}
    material = {"pbrMetallicRoughness": surface, "extensions": extensions, "doubleSided": True}
    if "normal" in placed:
        material["normalTexture"] = placed["normal"] | {"scale": made.bend}
    return material
