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

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import Camera, Wrap, surface, texture
from pipelines.photo_fur.attenuation import Attenuation, code_steps
from pipelines.photo_fur.laying import Laying
from pipelines.photo_fur.shells import mesh_radius
from pipelines.photo_fur.stage_view import FurLight

BEND = 0.2
"""How far tips lean along the lie, in thicknesses."""
HEIGHT_OF_WEIGHT = 0.6
"""By how much a patch's hairs are taller in its middle than at its rim, in thicknesses."""
GLOSS = 0.03
"""Radiance of a highlight under a lamp of radiance 1."""
SPREAD = 2.2
"""How much further from their mean heights are drawn than Eq. 1 has them: the depths that miss the
true ones least are nearer to their mean, and of those an outline would be smooth."""
GUSTS = 4.0
"""Radians of a gust over a mesh radius."""
FEWEST_SHELLS, MOST_SHELLS, SHELLS_A_PIXEL = 5, 40, 1.25
"""Fewer a pixel are seen to be fewer (`lod_ssim`)."""
LAID_SHADERS = ("fur_laid_vertex.glsl", "fur_laid_fragment.glsl")
"""Of vertices and fragments of fur laid in patches."""


SHADING = {
    "HOT_SPOT": 0.35,  # radians from the view within which a lamp lights all that is seen
    "CONTRAST": 0.15,  # by how much more light from aside tells heights apart than light from above
    "SLANT": 0.34,  # the same, for each length of attenuation that slanting light has more of
    "MOST_SLANT": 1.7,
    "DIM": 0.35,  # of slanting light, how much of its mean shadows take
    "MOST_DIM": 1.7,
    "BELOW": 1.2,  # how fast a hair darkens below its tip, of the medium's attenuation
    "DUSK": 0.275,  # cosine from which on, before and behind the horizon, a lamp fades
    "ASIDE": 0.77,  # of a lamp's light, what shadows of hair on hair leave
    "FIBRE": 0.5,  # power of the fibre's light
    "TILT": 1.8,  # of hair, tangent of the angle from upright
    "STANDS": 0.225,  # how far down from its own depth a hair stands, thicknesses
    "EDGE": 0.3,  # what of that is left where the surface is seen from aside,
    "EDGE_TO": 0.3,  # below this cosine
}
"""How light falls on hair and how it stands, fitted to a traced pelt that no figure is of."""


class Hair(NamedTuple):
    """How hair lies on a mesh, and how long it is, by vertex."""

    tangents: NDArray[np.floating]
    """(V, 3): unit vectors along the surface, towards the tips."""
    lengths: NDArray[np.floating]
    """(V,): 1 for the fur's thickness."""


class Wind(NamedTuple):
    """Wind that blows level, in gusts."""

    strength: float = 0.0
    """How far tips are blown, in thicknesses."""
    moment: float = 0.0
    """Seconds since the gusts began."""


CALM = Wind()


class LaidFur(NamedTuple):
    """A body with a photograph laid over it in patches.

    Vertices are those of the laying: skin, normals and tangents (N, 3) float32; lengths (N,) of the
    hair, 1 for the fur's thickness.
    """

    skin: NDArray[np.float32]
    normals: NDArray[np.floating]
    tangents: NDArray[np.floating]
    laying: Laying
    lengths: NDArray[np.floating]
    thickness: float
    """Mesh units."""
    layers: int

    @property
    def reach(self) -> NDArray[np.float32]:
        """(2 N, 3): the skin, and where the tips may be at the most without wind."""
        lifted = self.normals + BEND * self.tangents
        tips = self.skin + self.thickness * self.lengths[:, None] * lifted
        return np.concatenate([self.skin, tips]).astype(np.float32)


def laid_fur(
    vertices: NDArray[np.floating],
    normals: NDArray[np.floating],
    hair: Hair,
    laying: Laying,
    thickness: float,
    layers: int,
) -> LaidFur:
    """The fur on a mesh, vertices and normals (V, 3), as it is drawn."""
    of = laying.vertex
    return LaidFur(
        vertices[of].astype(np.float32),
        normals[of],
        hair.tangents[of],
        laying,
        hair.lengths[of],
        thickness,
        layers,
    )


def laid_surface(
    fur: LaidFur,
    image: NDArray[np.uint8],
    attenuation: Attenuation,
    light: FurLight,
    *,
    wind: Wind = CALM,
    shells: int | None = None,
    wrap: Wrap = "mirrored",
) -> Any:
    """All shells as one actor, which lights itself; image from ``fur_texture`` for its layers.

    shells: how many are drawn, by default as many as there are layers; wrap: what is beyond the
    photograph; of one that is a tile, "repeat".
    """
    shells = shells or fur.layers
    drawn = np.arange(1, shells + 1)
    count, laying = len(fur.skin), fur.laying
    uvs = texture_coordinates(laying.uvs, image.shape[:2])

    def each(values: NDArray[np.floating]) -> NDArray[np.floating]:
        return np.tile(values, (len(drawn), 1))

    offsets = count * np.arange(len(drawn))[:, None, None]
    return surface(
        each(fur.skin),
        (laying.triangles[None] + offsets).reshape(-1, 3),
        attributes={
            "layer": np.repeat(drawn, count),
            "hairLength": np.tile(fur.lengths, len(drawn)),
            "outward": each(fur.normals),
            "along": each(fur.tangents),
            "uvs": each(uvs[:, :2].reshape(count, 4)),
            "uvThird": each(uvs[:, 2]),
            "weights": each(laying.weights),
        },
        textures={"photograph": _photograph(image, wrap)},
        shader=surface_shader(
            *LAID_SHADERS,
            CODES=float(code_steps(fur.layers) * fur.layers),
            DECAY=attenuation.coefficient,
            MIDDLE=middle_depth(image, fur.layers),
            LAYERS=float(shells),
            THICKNESS=float(fur.thickness),
            WIND=float(wind.strength),
            MOMENT=float(wind.moment),
            GUST=GUSTS / mesh_radius(fur.skin),
            SKY=float(light.sky),
            HEADLIGHT=float(light.headlight),
            LAMP=float(light.lamp),
            LAMP_TOWARDS=light.light,
            **constants(),
        ),
        lit=False,
    )


def _photograph(image: NDArray[np.uint8], wrap: Wrap) -> Any:
    return texture(image, wrap=wrap, mipmap=True, anisotropic=False, srgb=True)


def constants() -> dict[str, Any]:
    """Names in capitals of the shader that are the same for every fur."""
    return {
        "BEND": BEND,
        "HEIGHT_OF_WEIGHT": HEIGHT_OF_WEIGHT,
        "GLOSS": GLOSS,
        "SPREAD": SPREAD,
        **SHADING,
    }


def packed_constants() -> dict[str, float]:
    """All numbers of the full look that readers of packages need, by name."""
    shells = {
        "FEWEST_SHELLS": FEWEST_SHELLS,
        "MOST_SHELLS": MOST_SHELLS,
        "SHELLS_A_PIXEL": SHELLS_A_PIXEL,
    }
    return constants() | shells | {"GUSTS": GUSTS}


def middle_depth(image: NDArray[np.uint8], layers: int) -> float:
    """Mean depth of the hair, thicknesses; image from ``fur_texture``.

    >>> image = np.full((2, 2, 4), 126, np.uint8)  # 63 codes a layer
    >>> middle_depth(image, 4)
    0.5
    """
    codes, most = image[..., 3].astype(np.float64), code_steps(layers) * layers
    hair = codes[codes < most]
    return float(hair.mean() / most) if len(hair) else 0.5


def shells_seen(rows: float) -> int:
    """How many shells fur needs that is so many rows of samples thick.

    >>> shells_seen(100.0), shells_seen(10.0), shells_seen(2.0)
    (40, 13, 5)
    """
    return min(MOST_SHELLS, max(FEWEST_SHELLS, math.ceil(SHELLS_A_PIXEL * rows)))


def rows_of_fur(
    camera: Camera, vertices: NDArray[np.floating], thickness: float, height: int
) -> float:
    """Rows of samples, of a picture with ``height`` of them, that fur so thick takes where a sphere
    about all vertices (V, 3) is nearest, though not nearer than a tenth of its radius."""
    if camera.height is not None:
        return thickness * height / camera.height
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    radius = mesh_radius(vertices)
    away = float(np.linalg.norm(np.asarray(camera.position) - middle))
    nearest = max(away - radius, 0.1 * radius)
    return thickness * height / (2 * math.tan(math.radians(camera.view_angle) / 2) * nearest)


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
