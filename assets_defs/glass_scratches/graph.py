"""The whole system: importing this declares its assets, in the order of the graph."""

from assets_defs.glass_scratches import tables, photograph, layers, frames, package  # noqa: I001, F401
from assets_defs.glass_scratches.declaration import SCRATCHES

__all__ = ["SCRATCHES"]
