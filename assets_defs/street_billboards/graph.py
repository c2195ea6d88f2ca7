"""The whole system: importing this declares its assets, in the order of the graph."""

from assets_defs.street_billboards import poses, drive, depth  # noqa: I001, F401
from assets_defs.street_billboards import textures, compression, frames, package  # noqa: F401
from assets_defs.street_billboards.declaration import STREET

__all__ = ["STREET"]
