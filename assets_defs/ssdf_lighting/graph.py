"""The whole system: importing this declares its assets, in the order of the graph."""

from assets_defs.ssdf_lighting import meshes, visibility, clusters, basis, lights, frames, package  # noqa: I001, F401
from assets_defs.ssdf_lighting.declaration import SSDF

__all__ = ["SSDF"]
