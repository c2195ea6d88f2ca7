"""Streets from eigen-textured billboards (docs/street.md): the graph's assets and checks.

`declaration` says what the assets are partitioned by; the other modules declare them, in the order
of the graph.
"""

from assets_defs.street_billboards import drive, depth, textures, compression, frames  # noqa: I001, F401
from assets_defs.street_billboards.declaration import STREET

__all__ = ["STREET"]
