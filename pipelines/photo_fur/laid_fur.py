"""Fur laid in patches, on the stage: the full look, in one draw call.

The shells bend over along the lie. Where patches meet the higher hair wins, so that hairs stay
whole (of two that are mixed neither is left). Light falls on hairs, not on the surface: Kajiya and
Kay's fibre with Goldman's directionality, "Fake fur rendering" (1997), over its own value for light
from straight above, under which the photograph was taken; and with the shadow of the fur above,
exp(-a h (1 / cos t - 1)), likewise over that of light from above (Eq. 1 has darkened the photograph
once).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import surface, texture
from pipelines.photo_fur.attenuation import Attenuation, code_steps
from pipelines.photo_fur.laying import Laying
from pipelines.photo_fur.stage_view import FurLight

BEND = 0.8
"""How far tips lean along the lie, in thicknesses."""
HEIGHT_OF_WEIGHT = 0.6
"""By how much a patch's hairs are taller in its middle than at its rim, in thicknesses."""
GLOSS = 0.03
"""Radiance of a highlight under a lamp of radiance 1."""


class LaidFur(NamedTuple):
    """A body with a photograph laid over it in patches.

    Vertices are those of the laying: skin, normals and tangents (N, 3) float32, thickness in mesh
    units.
    """

    skin: NDArray[np.float32]
    normals: NDArray[np.floating]
    tangents: NDArray[np.floating]
    laying: Laying
    thickness: float
    layers: int

    @property
    def reach(self) -> NDArray[np.float32]:
        """(2 N, 3): the skin, and where the tips may be at the most."""
        lifted = self.thickness * (self.normals + BEND * self.tangents)
        return np.concatenate([self.skin, self.skin + lifted]).astype(np.float32)


def laid_surface(
    fur: LaidFur, image: NDArray[np.uint8], attenuation: Attenuation, light: FurLight
) -> Any:
    """All shells as one actor, which lights itself; image from ``fur_texture`` for its layers."""
    layers, count = fur.layers, len(fur.skin)
    laying, uvs = fur.laying, texture_coordinates(fur.laying.uvs, image.shape[:2])

    def each(values: NDArray[np.floating]) -> NDArray[np.floating]:
        return np.tile(values, (layers, 1))

    offsets = count * np.arange(layers)[:, None, None]
    return surface(
        each(fur.skin),
        (laying.triangles[None] + offsets).reshape(-1, 3),
        attributes={
            "layer": np.repeat(np.arange(1, layers + 1), count),
            "outward": each(fur.normals),
            "along": each(fur.tangents),
            "uvs": each(uvs[:, :2].reshape(count, 4)),
            "uvThird": each(uvs[:, 2]),
            "weights": each(laying.weights),
        },
        textures={"photograph": texture(image, wrap="mirrored", srgb=True)},
        shader=surface_shader(
            "fur_laid_vertex.glsl",
            "fur_laid_fragment.glsl",
            CODE_STEPS=float(code_steps(layers)),
            DECAY=attenuation.coefficient / layers,
            THICKNESS=float(fur.thickness),
            LAYERS=float(layers),
            BEND=BEND,
            HEIGHT_OF_WEIGHT=HEIGHT_OF_WEIGHT,
            GLOSS=GLOSS,
            SKY=float(light.sky),
            HEADLIGHT=float(light.headlight),
            LAMP=float(light.lamp),
            LAMP_TOWARDS=light.light,
        ),
        lit=False,
    )


def texture_coordinates(
    places: NDArray[np.floating], shape: tuple[int, ...]
) -> NDArray[np.floating]:
    """Places (…, 2) in a photograph of shape (height, width), which are in its widths, as textures
    have them: 1 is the whole side of either axis.

    >>> texture_coordinates(np.array([[0.5, 0.25]]), (50, 100)).tolist()
    [[0.5, 0.5]]
    """
    height, width = shape
    scaled: NDArray[np.floating] = places * np.array([1.0, width / height], places.dtype)
    return scaled
