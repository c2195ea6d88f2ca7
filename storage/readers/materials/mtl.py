"""Material libraries of OBJ files (MTL): numbers, textures with their options, and what is said."""

from __future__ import annotations

import codecs
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.materials.description import Channel, Description, Map, Share, grey, held
from storage.readers.materials.material import DIELECTRIC, Colour
from storage.readers.materials.mtl_maps import read_map
from storage.readers.opening import number, whole_file
from storage.readers.pictures.srgb_curve import light_of_srgb

_LARGEST_LIBRARY = 16 << 20  # bytes
_BYTE_CODES = 2.0
"""Colours with a number above this are read as 0 to 255."""
_TO_SRGB = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
_UNUSED_MAPS = {
    "map_d": "how opaque it is",
    "map_ke": "light that it emits",
    "map_ka": "an ambient colour",
    "disp": "displacement",
    "map_disp": "displacement",
    "decal": "a decal",
    "refl": "a reflection",
    "map_refl": "a reflection",
    "map_ps": "sheen",
    "map_tr": "how transparent it is",
}
_UNUSED_NUMBERS = {
    "ke": "emits light",
    "ps": "has a sheen",
    "pc": "has a clear coat",
    "aniso": "is anisotropic",
}


def read_library(file: Path) -> tuple[dict[str, Description], dict[str, tuple[str, ...]]]:
    """The materials of an MTL file by name, and notes on each of them.

    ``Kd`` is the linear base colour, black where ``map_Kd`` has the colour counts as white; ``Ks``
    is F0, none where ``illum`` is 0 or 1, which have no highlights; the slope is ``Pr`` squared
    where there is one, else that of ``Ns``. ``Pm`` is glTF's metalness. Textures multiply these,
    but for ``map_Ns``, ``map_Pr`` and ``map_Pm`` where the number is missing. ``norm``, and a
    ``bump`` that is bluish, are normals.

    Raises BadInput, naming the line, for numbers that are missing, or no finite numbers.
    """
    data = whole_file(file, "a material library", _LARGEST_LIBRARY)
    is_wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = data.decode("utf-16" if is_wide else "utf-8-sig", "replace")
    materials: dict[str, _Statements] = {}
    current: _Statements | None = None
    for row, line in enumerate(_lines(text), start=1):
        keyword, _, rest = line.strip().partition(" ")
        keyword = keyword.lower()
        if keyword == "newmtl":
            name = " ".join(rest.split())
            current = materials[name] = _Statements(file, name)
        elif keyword in _KNOWN:
            try:
                if current is None:
                    raise ValueError("a line 'newmtl' before it")
                current.add(keyword, rest)
            except ValueError as error:
                shown = line.strip()[:60]
                raise BadInput(file, f"line {row}", f"'{shown}'", str(error)) from None
    described = {name: statements.description() for name, statements in materials.items()}
    return described, {name: tuple(made.notes) for name, made in materials.items()}


def _lines(text: str) -> Iterator[str]:
    for line in text.replace("\\\r\n", " ").replace("\\\n", " ").splitlines():
        yield line.replace("\t", " ")


class _Statements:
    """What one material's lines say."""

    def __init__(self, file: Path, name: str) -> None:
        self.notes: list[str] = []
        self._file, self._name = file, name
        self._numbers: dict[str, list[float]] = {}
        self._maps: dict[str, Map] = {}
        self._named: set[str] = set()  # maps, missing ones as well

    def add(self, keyword: str, rest: str) -> None:
        """One line; raises ValueError with what was expected."""
        if keyword in _MAPS:
            found, notes = read_map(self._file, rest)
            self.notes += [self._said(note) for note in notes]
            if found is not None:
                self._maps[_MAPS[keyword]] = found
            self._named.add(_MAPS[keyword])
            return
        words = rest.split("#", 1)[0].split()
        if keyword in ("kd", "ks", "ke"):
            self._add_colour(keyword, words)
        else:
            self._numbers[keyword] = _numbers(
                words, (1,), _EXPECTED.get(keyword, "a finite number")
            )

    def _add_colour(self, keyword: str, words: list[str]) -> None:
        if words[:1] == ["spectral"]:
            self.notes.append(self._said(f"its {keyword} is a spectrum in a file: not used"))
            return
        xyz = words[:1] == ["xyz"]
        values = _numbers(words[xyz:], (1, 3), "1 or 3 numbers from 0 to 1")
        values = values * 3 if len(values) == 1 else values
        if xyz:
            values = (_TO_SRGB @ values).tolist()
            self.notes.append(self._said(f"its {keyword} converted from CIE XYZ"))
        elif keyword != "ke" and _BYTE_CODES < max(values) <= 255:
            values = [value / 255 for value in values]
            self.notes.append(self._said(f"its {keyword} is read as 0 to 255"))
        self._numbers[keyword] = values

    def description(self) -> Description:
        """Of all lines; notes on what of them is not used are added."""
        plain, maps = grey(self._name), self._maps
        base = self._colour("kd", plain.base)
        if "map_kd" in self._named and (max(base) == 0 or "kd" not in self._numbers):
            base = (1.0, 1.0, 1.0) if "map_kd" in maps else plain.base
        metal = self._share("pm", 1.0 if "map_pm" in maps else 0.0)
        shiny = self._one("illum", 2.0) not in (0.0, 1.0)
        missing = (DIELECTRIC,) * 3 if metal > 0 else plain.specular
        specular = self._colour("ks", (1.0, 1.0, 1.0) if "map_ks" in maps else missing)
        if not shiny:
            specular = (0.0, 0.0, 0.0)
        self._say_what_is_unused()
        roughness, shares = self._roughness(plain.roughness)
        if "map_ks" in maps and shiny:
            shares.append(Share(maps["map_ks"], 0, _linear_mean))
        if "map_pm" in maps:
            shares.append(Share(maps["map_pm"], 2, _grey_of))
        normal = maps.get("norm", maps.get("bump"))
        return Description(
            self._name,
            base,
            metal,
            specular,
            roughness,
            maps.get("map_kd"),
            tuple(shares),
            normal,
            guessed_normal="norm" not in maps,
        )

    def _roughness(self, missing: float) -> tuple[float, list[Share]]:
        """glTF's: the root of the slope."""
        maps = self._maps
        if "map_pr" in maps:
            return self._share("pr", 1.0), [Share(maps["map_pr"], 1, _grey_of)]
        if "pr" in self._numbers:
            if "map_ns" in maps:
                self.notes.append(self._said("its map_Ns is not used: it has a Pr"))
            return self._share("pr", 1.0), []
        if "map_ns" in maps:
            return 1.0, [Share(maps["map_ns"], 1, _of_exponent(max(self._one("ns", 1000.0), 0.0)))]
        if "ns" not in self._numbers:
            return missing, []
        exponent = self._numbers["ns"][0]
        if exponent < 0:
            self.notes.append(self._said(f"its Ns is {exponent:g}: read as 0"))
        return (2 / (max(exponent, 0.0) + 2)) ** 0.25, []

    def _say_what_is_unused(self) -> None:
        maps, numbers = self._maps, self._numbers
        opaque = min(self._one("d", 1.0), 1 - self._one("tr", 0.0))
        # Some write Tr 1 for what is opaque: 3ds Max beside a d of 1, so that d is believed.
        if "d" in numbers:
            opaque = numbers["d"][0]
        if opaque < 1 - 1e-3:
            self.notes.append(self._said("it is transparent and drawn opaque"))
        if self._one("illum", 2.0) == 0.0:
            self.notes.append(self._said("it is to be shown without light (illum 0): it is lit"))
        for keyword, words in _UNUSED_NUMBERS.items():
            if max(numbers.get(keyword, [0.0])) > 0:
                self.notes.append(self._said(f"it {words}, which is not used"))
        for keyword, words in _UNUSED_MAPS.items():
            found = maps.get(keyword)
            same = found is not None and found.key == getattr(maps.get("map_kd"), "key", None)
            if found is not None and not (same and keyword == "map_ka"):
                shown = shortened(found.shown)
                self.notes.append(self._said(f"its texture of {words}, {shown}, is not used"))

    def _said(self, what: str) -> str:
        return f"Material '{shortened(self._name)}': {what}."

    def _one(self, keyword: str, missing: float) -> float:
        return self._numbers.get(keyword, [missing])[0]

    def _share(self, keyword: str, missing: float) -> float:
        what = f"{keyword.capitalize()} of material '{shortened(self._name)}'"
        return held([self._one(keyword, missing)], what, self.notes)[0]

    def _colour(self, keyword: str, missing: Colour) -> Colour:
        what = f"{keyword.capitalize()} of material '{shortened(self._name)}'"
        red, green, blue = held(self._numbers.get(keyword, list(missing)), what, self.notes)
        return red, green, blue


_EXPECTED = {"ns": "a finite number of at least 0", "pr": "a number from 0 to 1"}
_MAPS = {
    "map_kd": "map_kd",
    "map_ks": "map_ks",
    "map_ns": "map_ns",
    "map_pr": "map_pr",
    "map_pm": "map_pm",
    "norm": "norm",
    "map_kn": "norm",
    "bump": "bump",
    "map_bump": "bump",
    **{keyword: keyword for keyword in _UNUSED_MAPS},
}
_KNOWN = {"kd", "ks", "ns", "pr", "pm", "d", "tr", "illum", *_MAPS, *_UNUSED_NUMBERS}


def _numbers(words: list[str], counts: tuple[int, ...], expected: str) -> list[float]:
    try:
        numbers = [number(word) for word in words]
    except ValueError:
        try:
            numbers = [number(word.replace(",", ".")) for word in words]
        except ValueError:
            numbers = []
    if len(numbers) not in counts or not all(math.isfinite(value) for value in numbers):
        raise ValueError(expected)
    return numbers


def _grey_of(codes: NDArray[np.floating]) -> NDArray[np.floating]:
    return codes[..., :3].mean(axis=-1)


def _linear_mean(codes: NDArray[np.floating]) -> NDArray[np.floating]:
    mean: NDArray[Any] = light_of_srgb(codes[..., :3]).mean(axis=-1)
    return mean


def _of_exponent(most: float) -> Channel:
    """The roughness of Phong's exponents, shares of ``most``."""
    return lambda codes: (2 / (most * _grey_of(codes) + 2)) ** 0.25
