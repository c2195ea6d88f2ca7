"""Fur laid in patches, on the stage: the full look, in one draw call.

The shells bend over along the lie. Where patches meet the higher hair wins, so that hairs stay
whole (of two that are mixed neither is left). Light falls on hairs, not on the surface: Kajiya and
Kay's fibre with Goldman's directionality, "Fake fur rendering" (1997), over its own value for light
from straight above, under which the photograph was taken. The photograph has its shadows from
light along the view; so has every picture under light along its view, whatever the angle: the hot
spot of Hapke, "Bidirectional reflectance spectroscopy 4" (1986). Light from aside finds more
shadows, the deeper in the fur and the lower the lamp.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import Wrap, surface, texture
from pipelines.photo_fur.attenuation import Attenuation, code_steps
from pipelines.photo_fur.laying import Laying
from pipelines.photo_fur.stage_view import FurLight, layers_with_hair

BEND = 0.5
"""How far tips lean along the lie, in thicknesses."""
HEIGHT_OF_WEIGHT = 0.6
"""By how much a patch's hairs are taller in its middle than at its rim, in thicknesses."""
GLOSS = 0.03
"""Radiance of a highlight under a lamp of radiance 1."""


SHADING = {
    "HOT_SPOT": 0.35,  # radians from the view within which a lamp lights all that is seen
    "SLANT": 0.1,  # lengths of attenuation that slanting light has more of than light from above
    "MOST_SLANT": 0.8,
    "BELOW": 0.5,  # how fast a hair darkens below its tip, of the medium's attenuation
    "DUSK": 0.35,  # cosine from which on, before and behind the horizon, a lamp fades
    "ASIDE": 0.85,  # of a lamp's light, what shadows of hair on hair leave
    "FIBRE": 0.5,  # power of the fibre's light
    "TILT": 2.0,  # of hair, tangent of the angle from upright
}
"""How light falls on hair, fitted to a traced pelt that no figure is of."""


class Hair(NamedTuple):
    """How hair lies on a mesh, and how long it is, by vertex."""

    tangents: NDArray[np.floating]
    """(V, 3): unit vectors along the surface, towards the tips."""
    lengths: NDArray[np.floating]
    """(V,): 1 for the fur's thickness."""


class LaidFur(NamedTuple):
    """A body with a photograph laid over it in patches.

    Vertices are those of the laying: skin, normals and tangents (N, 3) float32; thickness (N,) of
    the fur, in mesh units.
    """

    skin: NDArray[np.float32]
    normals: NDArray[np.floating]
    tangents: NDArray[np.floating]
    laying: Laying
    thickness: NDArray[np.floating]
    layers: int

    @property
    def reach(self) -> NDArray[np.float32]:
        """(2 N, 3): the skin, and where the tips may be at the most."""
        lifted = self.thickness[:, None] * (self.normals + BEND * self.tangents)
        return np.concatenate([self.skin, self.skin + lifted]).astype(np.float32)


def laid_surface(
    fur: LaidFur,
    image: NDArray[np.uint8],
    attenuation: Attenuation,
    light: FurLight,
    wrap: Wrap = "mirrored",
) -> Any:
    """All shells as one actor, which lights itself; image from ``fur_texture`` for its layers.

    wrap: what is beyond the photograph; of one that is a tile, "repeat".
    """
    layers, count = fur.layers, len(fur.skin)
    drawn = layers_with_hair(image, layers)
    laying, uvs = fur.laying, texture_coordinates(fur.laying.uvs, image.shape[:2])

    def each(values: NDArray[np.floating]) -> NDArray[np.floating]:
        return np.tile(values, (len(drawn), 1))

    offsets = count * np.arange(len(drawn))[:, None, None]
    return surface(
        each(fur.skin),
        (laying.triangles[None] + offsets).reshape(-1, 3),
        attributes={
            "layer": np.repeat(drawn, count),
            "thickness": np.tile(fur.thickness, len(drawn)),
            "outward": each(fur.normals),
            "along": each(fur.tangents),
            "uvs": each(uvs[:, :2].reshape(count, 4)),
            "uvThird": each(uvs[:, 2]),
            "weights": each(laying.weights),
        },
        textures={"photograph": texture(image, wrap=wrap, srgb=True)},
        shader=surface_shader(
            "fur_laid_vertex.glsl",
            "fur_laid_fragment.glsl",
            CODE_STEPS=float(code_steps(layers)),
            DECAY=attenuation.coefficient / layers,
            LAYERS=float(layers),
            BEND=BEND,
            HEIGHT_OF_WEIGHT=HEIGHT_OF_WEIGHT,
            GLOSS=GLOSS,
            **SHADING,
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
