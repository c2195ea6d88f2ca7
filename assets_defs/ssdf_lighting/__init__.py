"""Image-based lighting by SSDFs (docs/ssdf.md): the graph's assets and checks.

`declaration` says what the assets are partitioned by; the other modules declare them, in the order
of the graph.
"""

from assets_defs.ssdf_lighting import meshes, visibility, compression, lights, frames  # noqa: I001, F401
from assets_defs.ssdf_lighting.declaration import SSDF

__all__ = ["SSDF"]
