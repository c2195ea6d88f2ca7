"""The whole system: importing this declares its assets, in the order of the graph."""

from assets_defs.photo_fur import photographs, layers, shells, lie, frames, package  # noqa: I001, F401
from assets_defs.photo_fur.declaration import FUR

__all__ = ["FUR"]
