"""The whole system: importing this declares its assets, in the order of the graph."""

from assets_defs.street_billboards import drive, depth, textures, compression, frames, package  # noqa: I001, F401
from assets_defs.street_billboards.declaration import STREET

__all__ = ["STREET"]
