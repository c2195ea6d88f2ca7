"""Materials and textures of a user's file, as the pipeline has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from storage.readers.scenes import SceneFile

if TYPE_CHECKING:
    from pipelines.ssdf_lighting.light.microfacets import Materials
    from pipelines.ssdf_lighting.surface_textures import SurfaceTextures, Texture
    from storage.readers.materials import material


def materials_of(read: SceneFile) -> Materials:
    """The file's materials, held within what lights that are Gaussians can show."""
    import numpy as np

    from pipelines.ssdf_lighting.light.microfacets import Materials
    from pipelines.ssdf_lighting.surface_textures import LEAST_SLOPE, MOST_SPECULAR

    tint = np.array([made.tint for made in read.materials])
    return Materials(
        np.array([made.albedo for made in read.materials]),
        np.clip([made.specular for made in read.materials], 0.0, MOST_SPECULAR),
        np.clip([made.roughness for made in read.materials], LEAST_SLOPE, 1.0),
        None if (tint == 1).all() else tint,
    )


def textures_of_file(read: SceneFile) -> SurfaceTextures | None:
    """What varies over the file's surfaces."""
    from pipelines.ssdf_lighting.surface_textures import SurfaceTextures, TexturedMaterial

    if read.uvs is None or read.colours is None:
        return None
    made = []
    for row, one in enumerate(read.materials):
        if one.varying is not None:
            base, metal, specular, roughness, *maps, bend = one.varying
            colour, surface, normal = (_texture(given) for given in maps)
            made.append(
                TexturedMaterial(
                    row, base, metal, specular, roughness, colour, surface, normal, bend
                )
            )
    return SurfaceTextures(read.uvs, read.colours, tuple(made))


def _texture(given: material.Texture | None) -> Texture | None:
    from pipelines.ssdf_lighting.surface_textures import Texture

    return None if given is None else Texture(*given)
