"""What the shader of a lit surface is told of its material: by rows of a table, or by textures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import Value
from pipelines.drawing.stage import texture
from pipelines.ssdf_lighting.light.gloss_grid import ROUGHNESSES, SPECULARS, gloss_grid
from pipelines.ssdf_lighting.light.gloss_lobes import COLUMNS as GLOSS_COLUMNS
from pipelines.ssdf_lighting.light.gloss_lobes import GlossLobes
from pipelines.ssdf_lighting.light.microfacets import LEAST_VIEW, Materials
from pipelines.ssdf_lighting.scene import LitMesh
from pipelines.ssdf_lighting.surface_textures import (
    LEAST_SLOPE,
    MOST_SPECULAR,
    SurfaceTextures,
    Texture,
    TexturedMaterial,
)

_ANISOTROPY = 8.0
_ANYWHERE = 1e30


class Finish(NamedTuple):
    """Triangles that share a shader, and what it needs besides lights.

    triangles: (T,) rows of the mesh's. attributes: (V, k) of all the mesh's vertices. textures:
    VTK's, by the samplers' names. values: what names in capitals stand for. uniforms: vectors of
    four by their names.
    """

    triangles: NDArray[np.int64]
    has_gloss: bool
    attributes: Mapping[str, NDArray[np.floating] | NDArray[np.integer]]
    textures: Mapping[str, Any]
    values: Mapping[str, Value]
    uniforms: Mapping[str, list[float]]


def finishes(mesh: LitMesh, gloss: GlossLobes) -> list[Finish]:
    """Of a mesh: what is glossy, what is not, and each material with textures. ``gloss`` has a row
    a material of the mesh."""
    of_triangle = np.asarray(mesh.object_of_vertex)[mesh.triangles[:, 0]]
    made = () if mesh.textures is None else mesh.textures.materials
    glossy = np.asarray(mesh.materials.specular)[of_triangle] > 0
    plain = ~np.isin(of_triangle, [material.row for material in made])
    found = [
        _plain(mesh, np.flatnonzero(plain & chosen), gloss, has_gloss=has_gloss)
        # First what is likely in front: less is painted over.
        for has_gloss, chosen in ((True, glossy), (False, ~glossy))
    ]
    if mesh.textures is not None:
        found += [
            _textured(mesh.textures, material, np.flatnonzero(of_triangle == material.row))
            for material in made
        ]
    return [finish for finish in found if len(finish.triangles)]


def fixed(rows: NDArray[np.float32], *, interpolate: bool = False) -> Any:
    """A texture whose row 0 is at t = 0, for texelFetch."""
    return texture(np.ascontiguousarray(rows[::-1]), wrap="clamp", interpolate=interpolate)


# ---- without textures --------------------------------------------------------------------------


def _plain(
    mesh: LitMesh, triangles: NDArray[np.int64], gloss: GlossLobes, *, has_gloss: bool
) -> Finish:
    textures = {"materials": fixed(_material_rows(mesh.materials))}
    values: dict[str, Value] = {"TEXTURED": False, "GLOSS": has_gloss}
    if has_gloss:
        textures["gloss"] = fixed(np.stack(gloss, axis=-1).astype(np.float32))
        values |= {"LEAST_VIEW": LEAST_VIEW, "GLOSS_COLUMNS": GLOSS_COLUMNS}
    objects = np.asarray(mesh.object_of_vertex)
    return Finish(triangles, has_gloss, {"object": objects}, textures, values, {})


def _material_rows(materials: Materials) -> NDArray[np.float32]:
    rows = np.zeros((2, len(materials.specular), 4), np.float32)
    rows[0, :, :3], rows[0, :, 3] = materials.albedo, materials.specular
    rows[1, :, 0] = materials.roughness
    rows[1, :, 1:] = 1.0 if materials.tint is None else materials.tint
    return _two_wide(rows)


def _two_wide(texels: NDArray[Any]) -> NDArray[Any]:
    """VTK lays a picture of one column on its side."""
    return texels.repeat(2, axis=1) if texels.shape[1] == 1 else texels


# ---- with textures -----------------------------------------------------------------------------


def _textured(
    textures: SurfaceTextures, material: TexturedMaterial, triangles: NDArray[np.int64]
) -> Finish:
    maps = {"colour": material.colour, "surface": material.surface, "normal": material.normal}
    samplers: dict[str, Any] = {}
    uniforms = {
        "factors": [*material.base, material.metal],
        "finish": [*material.specular, material.roughness],
    }
    values: dict[str, Value] = {
        "TEXTURED": True,
        "GLOSS": material.has_gloss,
        "LEAST_SLOPE": LEAST_SLOPE,
        "MOST_SPECULAR": MOST_SPECULAR,
    }
    for name, given in maps.items():
        values[f"{name.upper()}_MAP"] = given is not None
        if given is not None:
            sampler, place, limits = _map(given, srgb=name == "colour")
            place[3] = material.bend
            samplers[f"{name}Map"] = sampler
            uniforms |= {f"{name}Place": place, f"{name}Limits": limits}
    if material.has_gloss:
        samplers["gloss"] = fixed(_grid_rows(), interpolate=True)
        values |= {
            "LEAST_VIEW": LEAST_VIEW,
            "GLOSS_COLUMNS": GLOSS_COLUMNS,
            "GRID_START": [ROUGHNESSES[0], SPECULARS[0]],
            "GRID_END": [ROUGHNESSES[-1], SPECULARS[-1]],
            "GRID_STEPS": [len(ROUGHNESSES), len(SPECULARS)],
        }
    attributes = {"paint": textures.colours, "mappings": textures.uvs.reshape(-1, 4)}
    return Finish(triangles, material.has_gloss, attributes, samplers, values, uniforms)


def _grid_rows() -> NDArray[np.float32]:
    grid = gloss_grid()
    return np.stack([np.log(grid.sharpness), *grid[1:]], axis=-1).astype(np.float32)


def _map(given: Texture, *, srgb: bool) -> tuple[Any, list[float], list[float]]:
    """VTK's texture, and the shader's vectors ``place`` and ``limits``.

    VTK wraps both axes alike. Of two that differ the card repeats: what is mirrored is written out
    twice, and the shader clamps.
    """
    texels, scale = given.texels, [1.0, 1.0]
    low, high = [-_ANYWHERE] * 2, [_ANYWHERE] * 2
    across, along = given.wrap
    if across == along:
        wrap = "mirrored" if across == "mirror" else across
    else:
        wrap = "repeat"
        for axis, mode in enumerate(given.wrap):
            count = texels.shape[1 - axis]
            if mode == "clamp":
                low[axis], high[axis] = 0.5 / count, 1 - 0.5 / count
            elif mode == "mirror":
                # The copy on the right of the first, or above it: row 0 is the top.
                halves = [texels, np.flip(texels, 1 - axis)]
                texels = np.concatenate(halves[:: 1 if axis == 0 else -1], axis=1 - axis)
                scale[axis] = 0.5
    made = texture(_two_wide(texels), wrap=wrap, mipmap=True, srgb=srgb)
    made.SetMaximumAnisotropicFiltering(_ANISOTROPY)
    return made, [*scale, float(given.mapping), 0.0], [*low, *high]
