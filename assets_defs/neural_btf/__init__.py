"""BTFs compressed by a neural network (docs/btf.md): the graph's assets and checks.

`declaration` says what the assets are partitioned by; the other modules declare them, in the order
of the graph.
"""

from assets_defs.neural_btf import photographs, abrdfs, network, restoration  # noqa: I001, F401
from assets_defs.neural_btf.declaration import BTF

__all__ = ["BTF"]
