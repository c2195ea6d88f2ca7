"""The whole system: importing this declares its assets, in the order of the graph."""

from assets_defs.ssdf_lighting import (  # noqa: I001, F401
    meshes,
    visibility,
    clusters,
    basis,
    bounce,
    lights,
    frames,
    package,
)
from assets_defs.ssdf_lighting.declaration import SSDF

__all__ = ["SSDF"]
