"""Descriptions of materials to materials: textures decoded, and placed on triangles' corners."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import shortened
from storage.readers.materials.description import Description, Map, Placing, Share
from storage.readers.materials.material import (
    LEAST_ROUGHNESS,
    Colour,
    Material,
    Texture,
    Varying,
)
from storage.readers.materials.pictures import Pictures, side_for
from storage.readers.pictures.srgb_curve import light_of_srgb

_MAPPINGS = 2
_FARTHEST = 1e6  # textures: single precision knows no place of a texel farther out
_DIGITS = 12  # a slope of 0.3 stays 0.3, though its root was taken
_CODES = np.arange(256) / 255
_LINEAR = light_of_srgb(_CODES)


class Finished(NamedTuple):
    """``materials``, and for each of them the placings of its mappings 0 and 1."""

    materials: tuple[Material, ...]
    placings: tuple[tuple[Placing, ...], ...]
    notes: tuple[str, ...]


def finished(
    descriptions: Sequence[Description], colours: Sequence[Colour | None], sets: set[int]
) -> Finished:
    """``colours``: of each material's corners the mean, None where they have none; ``sets``: the
    numbers of the texture coordinates that the mesh has."""
    maps = {given.key for description in descriptions for given in _maps(description)}
    pictures = Pictures(side_for(len(maps)))
    notes: list[str] = []
    materials, placings = [], []
    for description, mean in zip(descriptions, colours, strict=True):
        finish = _Finish(description, pictures, sets)
        materials.append(finish.material(mean))
        placings.append(tuple(finish.placings))
        notes += finish.notes
    return Finished(tuple(materials), tuple(placings), (*pictures.said(), *dict.fromkeys(notes)))


def _maps(description: Description) -> list[Map]:
    shares = [share.map for share in description.shares]
    return [given for given in (description.colour, *shares, description.normal) if given]


class _Finish:
    """One material's textures. ``placings``: of its mappings, as they were needed."""

    def __init__(self, description: Description, pictures: Pictures, sets: set[int]) -> None:
        self.description, self.placings = description, list[Placing]()
        self.notes: list[str] = []
        self._pictures, self._sets = pictures, sets

    def material(self, corners: Colour | None) -> Material:
        given = self.description
        colour = None if given.colour is None else self._colour(given.colour)
        surface = self._surface(given.shares) if given.shares else None
        normal = None if given.normal is None else self._normal(given.normal)
        factors = given.base, given.metal, given.specular, given.roughness
        bend = 1.0 if given.normal is None else given.normal.bend
        varying = Varying(*factors, colour, surface, normal, bend)
        made = on_average(given.name, varying, corners or (1.0, 1.0, 1.0))
        if corners is None and colour is surface is normal is None:
            return made._replace(varying=None)
        return made

    def _colour(self, given: Map) -> Texture | None:
        return self._texture(given, self._pictures.texels(given, srgb=True))

    def _normal(self, given: Map) -> Texture | None:
        texels = self._pictures.texels(given, srgb=False)
        if texels is not None and self.description.guessed_normal and not _are_normals(texels):
            name = shortened(given.shown)
            self.notes.append(f"Texture {name} holds heights: it is not used.")
            return None
        return self._texture(given, texels)

    def _texture(self, given: Map, texels: NDArray[np.uint8] | None) -> Texture | None:
        mapping = None if texels is None else self._mapping(given)
        if texels is None or mapping is None:
            return None
        codes = np.ascontiguousarray(texels[..., :3])
        if given.gain != (0.0, 1.0):
            first, times = given.gain
            table = np.clip(np.rint((first + times * _CODES) * 255), 0, 255).astype(np.uint8)
            codes = table[codes]
        return Texture(codes, given.wrap, mapping)

    def _mapping(self, given: Map) -> int | None:
        """0 or 1; None, with a note, where the mesh or two mappings cannot place it."""
        name = shortened(given.shown)
        if given.placing.set not in self._sets:
            which = f" of set {given.placing.set}" if given.placing.set else ""
            self.notes.append(
                f"Texture {name} is left out: the mesh has no texture coordinates{which}."
            )
            return None
        if given.placing not in self.placings:
            if len(self.placings) == _MAPPINGS:
                self.notes.append(
                    f"Texture {name} is left out: a material's textures may lie in "
                    f"{_MAPPINGS} ways, and this is a third."
                )
                return None
            self.placings.append(given.placing)
        return self.placings.index(given.placing)

    def _surface(self, shares: Sequence[Share]) -> Texture | None:
        """One texture of several; those that lie otherwise than the first are left out."""
        found: list[tuple[Share, NDArray[np.uint8]]] = []
        for share in shares:
            texels = self._pictures.texels(share.map, srgb=False)
            if texels is None:
                continue
            first = found[0][0].map if found else share.map
            if (share.map.placing, share.map.wrap) != (first.placing, first.wrap):
                name = shortened(share.map.shown)
                self.notes.append(
                    f"Texture {name} is left out: it lies otherwise than {shortened(first.shown)}."
                )
                continue
            found.append((share, texels))
        mapping = self._mapping(found[0][0].map) if found else None
        if mapping is None:
            return None
        height, width = (max(texels.shape[axis] for _, texels in found) for axis in (0, 1))
        codes = np.full((height, width, 3), 255, np.uint8)
        for share, texels in found:
            value = share.channel(_with_gain(texels, share.map.gain))
            codes[..., share.target] = _enlarged(np.rint(255 * value.clip(0, 1)), width, height)
        return Texture(codes, found[0][0].map.wrap, mapping)


def _with_gain(texels: NDArray[np.uint8], gain: tuple[float, float]) -> NDArray[np.floating]:
    return np.clip(gain[0] + gain[1] * (texels / 255.0), 0, 1)


def _enlarged(values: NDArray[np.floating], width: int, height: int) -> NDArray[np.uint8]:
    import cv2

    large: NDArray[Any] = values
    if values.shape != (height, width):
        large = cv2.resize(values.astype(np.float32), (width, height)).reshape(height, width)
    return np.rint(large).astype(np.uint8)


def _are_normals(texels: NDArray[np.uint8]) -> bool:
    """Whether a picture is bluish, as normals that look outwards are; heights are grey."""
    red, green, blue = texels[..., :3].reshape(-1, 3).mean(axis=0)
    return bool(blue > 160 and abs(red - 128) < 40 and abs(green - 128) < 40 and blue > red + 20)


def on_average(name: str, varying: Varying, corners: Colour) -> Material:
    """What a material is on average; ``corners``: the mean of their colours."""
    base, metal = np.array(varying.base) * corners, varying.metal
    specular, roughness = np.array(varying.specular), varying.roughness
    if varying.colour is not None:
        base = base * _LINEAR[varying.colour.texels].mean(axis=(0, 1))
    if varying.surface is not None:
        red, green, blue = _CODES[varying.surface.texels].mean(axis=(0, 1))
        specular, roughness, metal = specular * red, roughness * green, metal * blue
    reflected = specular * (1 - metal) + base * metal
    mean = round(float(reflected.mean()), _DIGITS)
    tint = reflected / mean if mean > 0 else np.ones(3)
    return Material(
        name,
        colour_of(base * (1 - metal)),
        mean,
        max(round(float(roughness) ** 2, _DIGITS), LEAST_ROUGHNESS),
        (1.0, 1.0, 1.0) if np.ptp(tint) < 1e-9 else colour_of(tint),
        varying,
    )


def colour_of(values: NDArray[np.floating]) -> Colour:
    """Three numbers."""
    red, green, blue = (float(value) for value in values)
    return red, green, blue


# ---- texture coordinates -----------------------------------------------------------------------


def placed_uvs(
    uvs: dict[int, NDArray[np.float64]],
    material: NDArray[np.int32],
    placings: Sequence[tuple[Placing, ...]],
) -> NDArray[np.float32]:
    """(F, 3, 2, 2) of both mappings. uvs: by set, of the triangles' corners (F, 3, 2); material:
    (F,). 0 where a corner has none."""
    found = np.zeros((len(material), 3, _MAPPINGS, 2), np.float32)
    for row, its in enumerate(placings):
        triangles = np.flatnonzero(material == row)
        for mapping in range(_MAPPINGS if its else 0):
            placing = its[min(mapping, len(its) - 1)]
            u, v = np.moveaxis(np.nan_to_num(uvs[placing.set][triangles]), 2, 0)
            a, b, c, d, e, f = placing.matrix
            placed = np.stack([a * u + b * v + c, d * u + e * v + f], axis=2)
            found[triangles, :, mapping] = np.clip(np.nan_to_num(placed), -_FARTHEST, _FARTHEST)
    return found
