"""What the columns of a profile's table are, and their units, by the words of many instruments."""

from __future__ import annotations

import re
from typing import Literal, NamedTuple

Role = Literal["v", "n", "y", "other"]


def set_of(words: str) -> frozenset[str]:
    """Words with spaces between them."""
    return frozenset(words.split())


_UNITS = {
    1e-4: "Å ångström angstrom angstroms ang",
    1e-6: "pm picometer picometre picometers picometres",
    1e-3: "nm nanometer nanometers nanometre nanometres nanomètre nanomètres nanometern",
    1.0: "um \u03bcm \u03bc micron microns micrometer micrometers micrometre micrometres mikrometer"
    " micromètre micromètres mikron mum ミクロン",
    1e3: "mm millimeter millimeters millimetre millimetres millimètre millimètres",
    1e4: "cm centimeter centimeters centimetre centimetres zentimeter",
    1e6: "m meter meters metre metres mètre mètres",
    0.0254: "microinch microinches uin \u03bcin \u03bc\u2033",
    25.4: "mil mils thou",
    25400.0: "in inch inches zoll",
}
_MICROMETRES = {word.casefold(): size for size, words in _UNITS.items() for word in words.split()}
# Said where another unit might be, and no unit: the column is what it is without them.
_REMARKS = set_of(
    "raw leveled levelled normalized normalised filtered corrected profile primary form removed x y"
    " z left right mean average abs rel relative absolute lateral height 1 2 3"
)
_NO_LENGTHS = set_of("v mv volt volts px pixel pixels counts deg rad hz")
# Casefolding turns the micro sign into the Greek letter mu.
_BRACKETED = re.compile(r"(.*?)[\s_/:,-]*[\[({<]\s*([^\])}>]*?)\s*[\])}>]\s*")
_TRAILING = re.compile(r"(.*?[^\W_])(?:\s+in\s+|[\s_/,:-]+)([^\W\d_]+)")

_AXES: dict[str, Role] = {"v": "v", "x": "v", "s": "v", "n": "n", "z": "n", "y": "y"}
# In this order: "x profile" is across, "height position" is height, "profile length" is across.
_WORDS: tuple[tuple[Role, frozenset[str]], ...] = (
    (
        "other",
        set_of("all both lengths values time zeit temps intensity intensität index counter error"),
    ),
    (
        "v",
        set_of(
            "distance distances dist lateral horizontal length abscissa path travel weg strecke"
            " abstand länge distanz distanza abscisse longueur 距離 距离 位置 横 長さ"
            " distancia traverse across"
        ),
    ),
    (
        "n",
        set_of(
            "height heights elevation altitude vertical amplitude topography depth höhe hoehe"
            " tiefe hauteur profondeur altezza altura 高さ 深さ 高度 深度 ordinate"
            " ordonnée quota deflection"
        ),
    ),
    ("v", set_of("position positions posición posizione pos scan 座標 coordinate")),
    ("n", set_of("profile profil raw level leveled levelled normalized data value")),
)
DEPTHS = set_of("depth tiefe profondeur 深さ 深度")
"""Names of heights that may count downwards."""


class Column(NamedTuple):
    """A column's name as it is written, what it holds, and its unit's name, where one is given."""

    name: str
    role: Role
    unit: str | None


def micrometres(unit: str) -> float | None:
    """A unit of length in micrometres; None for a word that is none.

    >>> micrometres("mm"), micrometres("V")
    (1000.0, None)
    """
    word = unit.strip().strip("[](){}<>").strip()
    if word == "A":  # of profilers; a small one would be anything
        return 1e-4
    return _MICROMETRES.get(word.casefold())


def column_of(cell: str) -> Column:
    """A header's cell: ``Distance (um)``, ``Z_nm``, ``Lateral um``, ``Total Profile Å`` …

    >>> column_of("Total Profile [nm]")
    Column(name='Total Profile [nm]', role='n', unit='nm')
    """
    name, unit = _split(cell.strip())
    return Column(cell.strip(), role_of(name), unit)


def role_of(name: str) -> Role:
    """What a name without its unit stands for."""
    words = re.findall(r"[^\W\d_]+", name.casefold())
    for word in words:
        if word in _AXES:
            return _AXES[word]
    for role, known in _WORDS:
        if known.intersection(words):
            return role
    compound = "".join(words)  # Profilhöhe, 測定距離
    for role, known in _WORDS:
        if any(word in compound for word in known if len(word) > 3 or not word.isascii()):
            return role
    return "other"


def _split(cell: str) -> tuple[str, str | None]:
    match = _BRACKETED.fullmatch(cell)
    if match:
        unit = match[2]
        is_remark = set(re.findall(r"\w+", unit.casefold())) <= _REMARKS and not micrometres(unit)
        return (match[1], unit) if not is_remark else (f"{match[1]} {unit}", None)
    match = _TRAILING.fullmatch(cell)
    if match and (micrometres(match[2]) is not None or match[2].casefold() in _NO_LENGTHS):
        return match[1], match[2]
    return cell, None
