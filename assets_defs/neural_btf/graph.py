"""The whole system: importing this declares its assets, in the order of the graph."""

from assets_defs.neural_btf import photographs, abrdfs, network, compressed  # noqa: I001, F401
from assets_defs.neural_btf import restoration, cloth, rate_distortion, package  # noqa: F401
from assets_defs.neural_btf.declaration import BTF

__all__ = ["BTF"]
