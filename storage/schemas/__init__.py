"""What every asset's dataset holds: one module a system, one truth for store, UI and docs."""

from __future__ import annotations

import importlib
import pkgutil

from storage.schemas.schema import Schema, Variable

__all__ = ["Schema", "Variable", "find_schema", "schemas_of", "systems"]


def systems() -> tuple[str, ...]:
    """Names of all systems, in the order of the alphabet.

    >>> systems()[:2]
    ('glass_scratches', 'neural_btf')
    """
    names = (module.name for module in pkgutil.iter_modules(__path__))
    return tuple(sorted(name for name in names if name != "schema"))


def schemas_of(system: str) -> tuple[Schema, ...]:
    """All schemas of a system, in the order of its graph."""
    found: tuple[Schema, ...] = importlib.import_module(f"storage.schemas.{system}").SCHEMAS
    return found


def find_schema(system: str, asset: str) -> Schema:
    """The schema of an asset. Raises KeyError where none is declared."""
    for schema in schemas_of(system):
        if schema.asset == asset:
            return schema
    raise KeyError(f"{system}/{asset}: no schema is declared in storage/schemas/{system}.py.")
