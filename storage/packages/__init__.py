"""Runtime packages, `.tsuya`: what a system made, for programs that know nothing of the store.

A package is a zip of `meta.json` and one file a part. `schema` says what parts are; each system
declares its package in a module of its name. `writing` makes one, by `encoding`, `glb` and `ktx2`;
`reading` reads one and shares no code with them, so that the one checks the other. `conformance`
holds packages, good and bad, that any program's reader can be run against. The page of all parts,
`docs/packages.md`, is made of the declarations.
"""

from __future__ import annotations

from storage.packages.reading import Package, read_package
from storage.packages.schema import (
    ArrayPart,
    Mesh,
    MeshPart,
    PackageSchema,
    Parameter,
    PicturePart,
    TexturesPart,
)
from storage.packages.writing import Contents, Figure, PaperFigure, Source, View, write_package

__all__ = [
    "ArrayPart",
    "Contents",
    "Figure",
    "Mesh",
    "MeshPart",
    "Package",
    "PackageSchema",
    "PaperFigure",
    "Parameter",
    "PicturePart",
    "Source",
    "TexturesPart",
    "View",
    "package_schemas",
    "read_package",
    "write_package",
]


def package_schemas() -> tuple[PackageSchema, ...]:
    """What each system's package holds, systems in the order of the alphabet."""
    import importlib

    from storage.schemas import systems

    modules = (importlib.import_module(f"storage.packages.{system}") for system in systems())
    return tuple(module.PACKAGE for module in modules)
