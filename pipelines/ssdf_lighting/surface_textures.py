"""Materials that vary over a surface: textures, colours of vertices, and what both make of a place.

A place has a base colour, a metalness, a roughness and a reflectance of what is no metal, as files
of materials have them; each is a factor times a texture where there is one, and the base colour
times the colours of the vertices. `looks_at` turns them into the albedo and the gloss that the
lights are reflected by; the shader does the same (textured.glsl).
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.light.microfacets import Materials

FloatArray = NDArray[np.float64]
Wrap = Literal["repeat", "mirror", "clamp"]

LEAST_SLOPE = 0.05
"""Of the gloss: lights are Gaussians, and a mirror would need a light for each texel."""
MOST_SPECULAR = 0.99
_TINY = 1e-6
_NO_SPREAD = 0.98  # length of a normal of three bytes, at least


class Texture(NamedTuple):
    """``texels`` (H, W, 3) uint8, row 0 at the top (v = 1); ``wrap``, along u and v, says what is
    outside of [0, 1]; ``mapping``, 0 or 1, which of the texture coordinates place it."""

    texels: NDArray[np.uint8]
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    mapping: int = 0


class TexturedMaterial(NamedTuple):
    """What a part is made of that has textures or colours of vertices.

    row: of the scene's materials, where the same material is as it is on average.
    base: (3,) linear colour; specular: (3,) F0 of what is no metal; metal, roughness: in [0, 1];
        Beckmann's slope is the roughness squared.
    colour: sRGB codes; times ``base``.
    surface: red times ``specular``, green times ``roughness``, blue times ``metal``.
    normal: 2 t - 1 along u, along v and along the normal; the first two times ``bend``.
    """

    row: int
    base: tuple[float, float, float]
    metal: float
    specular: tuple[float, float, float]
    roughness: float
    colour: Texture | None = None
    surface: Texture | None = None
    normal: Texture | None = None
    bend: float = 1.0

    @property
    def has_gloss(self) -> bool:
        """Whether any place of it reflects like a mirror, however blurred."""
        return max(self.specular) > 0 or self.metal > 0


class SurfaceTextures(NamedTuple):
    """Textures on a mesh. ``uvs`` (..., 2, 2) float32: for each place two texture coordinates, v
    from the bottom; ``colours`` (..., 3) float32, linear. ``...``: (F, 3), a triangle's corners,
    or (V,), vertices. ``materials``: those that vary."""

    uvs: NDArray[np.float32]
    colours: NDArray[np.float32]
    materials: tuple[TexturedMaterial, ...]


class Looks(NamedTuple):
    """P places: ``albedo``, ``tint`` (P, 3); ``specular``, ``roughness`` (P,); as of
    `microfacets.Materials`. ``bumps`` (P, 3): normals along u, along v and along the surface's."""

    albedo: FloatArray
    specular: FloatArray
    roughness: FloatArray
    tint: FloatArray
    bumps: FloatArray


def plain_looks(materials: Materials, rows: NDArray[np.integer]) -> Looks:
    """What materials without textures are at places of these rows."""
    bumps = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (len(rows), 3))
    tint = np.ones((len(rows), 3)) if materials.tint is None else materials.tint[rows]
    return Looks(
        materials.albedo[rows], materials.specular[rows], materials.roughness[rows], tint, bumps
    )


class Sampler:
    """Reads a material's textures at places, as the graphics card does: mipmaps, linearly."""

    def __init__(self, material: TexturedMaterial) -> None:
        self.material = material
        self._colour = _pyramid(material.colour, srgb=True)
        self._surface = _pyramid(material.surface, srgb=False)
        self._normal = _pyramid(material.normal, srgb=False)

    def looks_at(
        self, uvs: NDArray[np.floating], colours: NDArray[np.floating], footprint: FloatArray
    ) -> Looks:
        """uvs (P, 2, 2), colours (P, 3); ``footprint`` (P, 2): how far apart along each of the two
        texture coordinates two samples are."""
        made = self.material
        count = len(uvs)
        base = np.array(made.base) * colours
        specular, roughness = np.ones(count), np.full(count, made.roughness)
        metal = np.full(count, made.metal)
        bumps, spread = np.tile([0.0, 0.0, 1.0], (count, 1)), np.zeros(count)
        if made.colour is not None:
            base = base * _sampled(made.colour, self._colour, uvs, footprint, _LINEAR)
        if made.surface is not None:
            red, green, blue = _sampled(made.surface, self._surface, uvs, footprint, _PLAIN).T
            specular, roughness, metal = red, roughness * green, metal * blue
        if made.normal is not None:
            bumps = 2 * _sampled(made.normal, self._normal, uvs, footprint, _PLAIN) - 1
            size = np.linalg.norm(bumps, axis=1)
            spread = made.bend**2 * np.maximum(_NO_SPREAD - size, 0) / np.maximum(size, 0.1)
            bumps = bumps * [made.bend, made.bend, 1.0]
        reflected = (specular * (1 - metal))[:, None] * made.specular + base * metal[:, None]
        mean = reflected.mean(axis=1)
        return Looks(
            np.clip(base * (1 - metal)[:, None], 0.0, 1.0),
            np.clip(mean, 0.0, MOST_SPECULAR),
            # Bumps that are too small to be seen make it rougher: their mean is shorter than 1.
            np.clip(np.sqrt(roughness**4 + 2 * spread), LEAST_SLOPE, 1.0),
            np.where(mean[:, None] > _TINY, reflected / np.maximum(mean, _TINY)[:, None], 1.0),
            bumps,
        )


def bent_normals(
    normals: FloatArray, edges: FloatArray, uv_edges: FloatArray, bumps: FloatArray
) -> FloatArray:
    """Unit normals (P, 3) with the bumps (P, 3) of a texture.

    normals: (P, 3) unit, of the smooth surface. edges: (P, 2, 3) two of the triangle's; uv_edges:
    (P, 2, 2) the same in texture coordinates. u is taken along the triangle, turned into the plane
    of the smooth normal; where texture coordinates have no area the smooth normal stays.
    """
    (one, other), (u, v) = np.moveaxis(edges, 1, 0), np.moveaxis(uv_edges, 2, 0)
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    sign = np.sign(area)[:, None]
    along = sign * (one * v[:, 1:] - other * v[:, :1])
    across = sign * (other * u[:, :1] - one * u[:, 1:])
    along = along - np.sum(along * normals, axis=1, keepdims=True) * normals
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
    side = np.cross(normals, along)
    side = side * np.where(np.sum(side * across, axis=1, keepdims=True) < 0, -1.0, 1.0)
    bent = along * bumps[:, :1] + side * bumps[:, 1:2] + normals * bumps[:, 2:]
    length = np.linalg.norm(bent, axis=1, keepdims=True)
    known = (area[:, None] != 0) & (length > _TINY)
    found: FloatArray = np.where(known, bent / np.maximum(length, _TINY), normals)
    return found


# ---- texels ------------------------------------------------------------------------------------

_CODES = np.arange(256) / 255.0
_PLAIN: FloatArray = _CODES
_LINEAR: FloatArray = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4)


def _pyramid(texture: Texture | None, *, srgb: bool) -> list[NDArray[np.uint8]]:
    """The texels and their averages, each half as large, down to one."""
    import cv2

    if texture is None:
        return []
    levels = [texture.texels]
    light = (_LINEAR if srgb else _PLAIN)[texture.texels].astype(np.float32)
    while max(light.shape[:2]) > 1:
        height, width = (max(1, side // 2) for side in light.shape[:2])
        smaller = cv2.resize(light, (width, height), interpolation=cv2.INTER_AREA)
        light = np.asarray(smaller, np.float32).reshape(height, width, 3)
        codes = np.searchsorted(_LINEAR, light) if srgb else np.rint(light * 255)
        levels.append(np.clip(codes, 0, 255).astype(np.uint8))
    return levels


def _sampled(
    texture: Texture,
    levels: list[NDArray[np.uint8]],
    uvs: NDArray[np.floating],
    footprint: FloatArray,
    decoded: FloatArray,
) -> FloatArray:
    """(P, 3), between the two levels whose texels are as large as the footprint."""
    place = np.asarray(uvs[:, texture.mapping], np.float64)
    apart = footprint[:, texture.mapping] * max(texture.texels.shape[:2])
    level = np.clip(np.log2(np.maximum(apart, 1.0)), 0, len(levels) - 1)
    lower = level.astype(int)
    part = (level - lower)[:, None]
    found = np.empty((len(place), 3))
    for number in np.unique(lower):
        rows = lower == number
        finer = _bilinear(levels[number], texture.wrap, place[rows], decoded)
        if part[rows].any():
            coarser = _bilinear(levels[number + 1], texture.wrap, place[rows], decoded)
            finer = finer + part[rows] * (coarser - finer)
        found[rows] = finer
    return found


def _bilinear(
    texels: NDArray[np.uint8], wrap: tuple[Wrap, Wrap], place: FloatArray, decoded: FloatArray
) -> FloatArray:
    height, width = texels.shape[:2]
    x, y = place[:, 0] * width - 0.5, (1 - place[:, 1]) * height - 0.5
    left, top = np.floor(x), np.floor(y)
    columns = [_wrapped(left + step, width, wrap[0]) for step in (0, 1)]
    rows = [_wrapped(top + step, height, wrap[1]) for step in (0, 1)]
    across, down = (x - left)[:, None], (y - top)[:, None]
    upper, under = (
        (1 - across) * decoded[texels[row, columns[0]]] + across * decoded[texels[row, columns[1]]]
        for row in rows
    )
    mixed: FloatArray = (1 - down) * upper + down * under
    return mixed


def _wrapped(number: FloatArray, count: int, wrap: Wrap) -> NDArray[np.int64]:
    if wrap == "clamp":
        return np.clip(number, 0, count - 1).astype(np.int64)
    if wrap == "repeat":
        return np.mod(number, count).astype(np.int64)
    turned = np.mod(number, 2 * count)
    return np.where(turned < count, turned, 2 * count - 1 - turned).astype(np.int64)
