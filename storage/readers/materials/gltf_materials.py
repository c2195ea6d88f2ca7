"""glTF 2.0's materials, with those extensions that change what is read, and notes on the others."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.materials.description import Description, Map, Share
from storage.readers.materials.gltf_textures import Textures
from storage.readers.materials.gltf_values import Values
from storage.readers.materials.material import DIELECTRIC, Colour
from storage.readers.pictures.srgb_curve import light_of_srgb

_EMISSION = "KHR_materials_emissive_strength"
_GLOSSY = "KHR_materials_pbrSpecularGlossiness"
_UNLIT = "KHR_materials_unlit"
_READ = {_EMISSION, _GLOSSY, _UNLIT, "KHR_materials_ior", "KHR_materials_specular"}
_READ_OR_SAID = _READ | {
    "EXT_texture_avif", "EXT_texture_webp", "KHR_materials_variants", "KHR_texture_transform",
}  # fmt: skip


def _check_required(file: Path, document: dict[str, Any]) -> None:
    """Raise BadInput for a way to look that the file says it must not be shown without."""
    required = document.get("extensionsRequired")
    for name in required if isinstance(required, list) else ():
        if re.match(r"[A-Z]+[0-9]*_(material|texture)", name) and name not in _READ_OR_SAID:
            plain = "PNG, JPEG or WebP textures (gltf-transform, gltfpack write them)"
            other = "a file that can be shown without: export it with that extension optional"
            expected = plain if "_texture" in name else other
            raise BadInput(file, "required extension", name, expected)


class GltfMaterials:
    """The materials of a glTF's JSON; ``image`` gives the bytes of one of its images. Raises
    BadInput where it requires an extension of materials that is not read.

    notes: what of them is held within its range, or not used.
    """

    def __init__(self, file: Path, document: dict[str, Any], image: Callable[[int], bytes]) -> None:
        self.notes: list[str] = []
        self._file = file
        self._textures = Textures(file, document, image)
        _check_required(file, document)
        entries = document.get("materials")
        self._entries = entries if isinstance(entries, list) else []

    def check(self, entry: object) -> int | None:
        """The ``material`` of a primitive, a row of the table or None; raises BadInput else."""
        if entry is None:
            return None
        table = self._entries
        if type(entry) is int and 0 <= entry < len(table) and isinstance(table[entry], dict):
            return entry
        expected = f"one of the file's {len(table)} materials, counted from 0"
        raise BadInput(self._file, "material of a primitive", f"{entry}"[:60], expected)

    def description(self, row: int) -> Description:
        """A material by its row; raises BadInput for what is no number or no object."""
        entry: dict[str, Any] = self._entries[row]
        name = f"{entry.get('name') or f'material {row}'}"
        values = Values(self._file, name, self.notes)
        extensions = values.block(entry, "extensions")
        self._say_what_is_unused(values, entry, extensions)
        if _GLOSSY in extensions:
            made = self._specular_glossiness(values, values.block(extensions, _GLOSSY))
        else:
            made = self._metallic_roughness(values, entry, extensions)
        if _UNLIT in extensions:
            values.say("it is to be shown without light: it is lit, as if matt")
            made = made._replace(metal=0.0, specular=(0.0,) * 3, roughness=1.0, shares=())
        normal = values.block(entry, "normalTexture")
        found = self._textures.map(values, normal, "normalTexture")
        if found is not None:
            bend = values.number(normal, "scale", 1.0, least=-100.0, most=100.0)
            made = made._replace(normal=found._replace(bend=bend))
        return made

    def _metallic_roughness(
        self, values: Values, entry: dict[str, Any], extensions: dict[str, Any]
    ) -> Description:
        block = values.block(entry, "pbrMetallicRoughness")
        colour = values.colour(block, "baseColorFactor", 4)
        rough = self._textures.map(
            values, values.block(block, "metallicRoughnessTexture"), "metallicRoughnessTexture"
        )
        shares = [] if rough is None else [Share(rough, 1, _green), Share(rough, 2, _blue)]
        specular, weight = self._dielectric(values, extensions)
        if weight is not None:
            shares.append(Share(weight, 0, _alpha))
        return Description(
            values.name,
            colour,
            values.number(block, "metallicFactor", 1.0),
            specular,
            values.number(block, "roughnessFactor", 1.0),
            self._textures.map(values, values.block(block, "baseColorTexture"), "baseColorTexture"),
            tuple(shares),
        )

    def _dielectric(self, values: Values, extensions: dict[str, Any]) -> tuple[Colour, Map | None]:
        """F0 of what is no metal (KHR_materials_ior, _specular), and a texture of its share."""
        reflectance = DIELECTRIC
        if "KHR_materials_ior" in extensions:
            block = values.block(extensions, "KHR_materials_ior")
            index = values.number(block, "ior", 1.5, most=1000.0)
            reflectance = 1.0 if index == 0 else ((index - 1) / (index + 1)) ** 2
        block = values.block(extensions, "KHR_materials_specular")
        share = values.number(block, "specularFactor", 1.0)
        tint = values.colour(block, "specularColorFactor", 3, most=100.0)
        red, green, blue = (min(reflectance * value, 1.0) * share for value in tint)
        if "specularColorTexture" in block:
            values.say("its specularColorTexture is not used")
        weight = values.block(block, "specularTexture")
        return (red, green, blue), self._textures.map(values, weight, "specularTexture")

    def _specular_glossiness(self, values: Values, block: dict[str, Any]) -> Description:
        colour = values.colour(block, "diffuseFactor", 4)
        specular = values.colour(block, "specularFactor", 3)
        gloss = values.number(block, "glossinessFactor", 1.0)
        name = "specularGlossinessTexture"
        found = self._textures.map(values, values.block(block, name), name)
        shares: tuple[Share, ...] = ()
        if found is not None:
            shares = (Share(found, 0, _linear_mean), Share(found, 1, _roughness_of(gloss)))
        return Description(
            values.name,
            colour,
            0.0,
            specular,
            1.0 - gloss if found is None else 1.0,
            self._textures.map(values, values.block(block, "diffuseTexture"), "diffuseTexture"),
            shares,
        )

    def _say_what_is_unused(
        self, values: Values, entry: dict[str, Any], extensions: dict[str, Any]
    ) -> None:
        mode = entry.get("alphaMode", "OPAQUE")
        if mode in ("BLEND", "MASK"):
            holes = "has holes" if mode == "MASK" else "is transparent"
            values.say(f"it {holes} (alphaMode {mode}) and is drawn opaque")
        glow = values.colour(entry, "emissiveFactor", 3, missing=0.0, most=1000.0)
        if max(glow) > 0:
            values.say("it emits light, which is not used")
        if "occlusionTexture" in entry:
            values.say("its occlusionTexture is not used: occlusion is computed")
        unread = sorted(name for name in extensions if name not in _READ)
        if unread:
            names = ", ".join(shortened(name, 40) for name in unread[:5])
            values.say(f"{names} {'is' if len(unread) == 1 else 'are'} not used")


def _green(codes: NDArray[np.floating]) -> NDArray[np.floating]:
    return codes[..., 1]


def _blue(codes: NDArray[np.floating]) -> NDArray[np.floating]:
    return codes[..., 2]


def _alpha(codes: NDArray[np.floating]) -> NDArray[np.floating]:
    return codes[..., 3]


def _linear_mean(codes: NDArray[np.floating]) -> NDArray[np.floating]:
    mean: NDArray[np.floating] = light_of_srgb(codes[..., :3]).mean(axis=-1)
    return mean


def _roughness_of(gloss: float) -> Callable[[NDArray[np.floating]], NDArray[np.floating]]:
    return lambda codes: 1 - gloss * codes[..., 3]
