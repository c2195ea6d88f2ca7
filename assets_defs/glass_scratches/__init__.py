"""Scratches on glass (docs/scratches.md): the graph's assets and checks.

`declaration` says what the assets are partitioned by; the other modules declare them, in the order
of the graph.
"""

from assets_defs.glass_scratches import tables, layers, frames  # noqa: I001, F401
from assets_defs.glass_scratches.declaration import SCRATCHES

__all__ = ["SCRATCHES"]
