"""Textures of scenes as variables of `scene_mesh`, in both directions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.ssdf_lighting.light.microfacets import Materials
    from pipelines.ssdf_lighting.surface_textures import SurfaceTextures, Texture, Wrap

_KINDS = ("colour", "surface", "normal")
_WRAPS: tuple[Wrap, ...] = ("repeat", "mirror", "clamp")


def tint_variable(materials: Materials) -> Mapping[str, Any]:
    """Of materials whose gloss has a colour."""
    if materials.tint is None:
        return {}
    return {"tint": (("material", "channel"), materials.tint)}


def texture_variables(textures: SurfaceTextures) -> Mapping[str, Any]:
    """Variables of a `scene_mesh` dataset, of textures of the triangles' corners (F, 3)."""
    import numpy as np

    made = [
        (row, kind, getattr(material, name))
        for row, material in enumerate(textures.materials)
        for kind, name in enumerate(_KINDS)
        if getattr(material, name) is not None
    ]
    factors = [[*m.base, m.metal, *m.specular, m.roughness, m.bend] for m in textures.materials]
    texels = [texture.texels.reshape(-1, 3) for *_, texture in made]
    wraps = [[_WRAPS.index(wrap) for wrap in texture.wrap] for *_, texture in made]
    sizes = [texture.texels.shape[1::-1] for *_, texture in made]

    def table(rows: list[Any], columns: int) -> Any:
        return np.array(rows, np.int32).reshape(-1, columns)

    return {
        "uvs": (("triangle", "corner", "mapping", "coordinate"), textures.uvs),
        "colours": (("triangle", "corner", "channel"), textures.colours),
        "varying": (("varying",), np.array([m.row for m in textures.materials], np.int32)),
        "factors": (("varying", "factor"), np.array(factors, np.float64)),
        "texture_of": (("texture", "place"), table([part[:2] for part in made], 2)),
        "texture_size": (("texture", "coordinate"), table(sizes, 2)),
        "texture_wrap": (("texture", "coordinate"), table(wraps, 2)),
        "texture_mapping": (("texture",), table([part[2].mapping for part in made], 1)[:, 0]),
        "texels": (("texel", "channel"), np.concatenate([np.zeros((0, 3), np.uint8), *texels])),
    }


def textures_of(scene_mesh: xr.Dataset) -> SurfaceTextures:
    """The textures that a `scene_mesh` dataset holds."""
    from pipelines.ssdf_lighting.surface_textures import SurfaceTextures, TexturedMaterial

    found = _stored_textures(scene_mesh)
    materials = []
    for row, (number, factors) in enumerate(
        zip(scene_mesh["varying"].values, scene_mesh["factors"].values, strict=True)
    ):
        first, second, third, metal, red, green, blue, roughness, bend = factors.tolist()
        colour, surface, normal = (found.get((row, kind)) for kind in range(len(_KINDS)))
        look = (first, second, third), metal, (red, green, blue), roughness
        materials.append(TexturedMaterial(int(number), *look, colour, surface, normal, bend))
    return SurfaceTextures(scene_mesh["uvs"].values, scene_mesh["colours"].values, tuple(materials))


def _stored_textures(scene_mesh: xr.Dataset) -> dict[tuple[int, int], Texture]:
    from pipelines.ssdf_lighting.surface_textures import Texture

    texels, first, found = scene_mesh["texels"].values, 0, {}
    names = ("texture_of", "texture_size", "texture_wrap", "texture_mapping")
    rows = zip(*(scene_mesh[name].values.tolist() for name in names), strict=True)
    for (row, kind), (width, height), wraps, mapping in rows:
        end = first + width * height
        wrap = (_WRAPS[wraps[0]], _WRAPS[wraps[1]])
        found[row, kind] = Texture(texels[first:end].reshape(height, width, 3), wrap, mapping)
        first = end
    return found
