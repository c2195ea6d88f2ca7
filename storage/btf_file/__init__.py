"""A compressed BTF as one self-describing file, `.tbtf` (docs/btf_file.md). NumPy only.

``contents``: what a file holds (``BtfFile``). ``writing`` makes bytes of it (``write_btf_file``),
``reading`` reads all of them (``read_btf_file``) or one texel's latents (``read_texel``).
"""

from storage.btf_file.contents import BtfFile, Quantised, values_of
from storage.btf_file.reading import read_btf_file, read_texel, section_bytes
from storage.btf_file.writing import write_btf_file

__all__ = [
    "BtfFile",
    "Quantised",
    "read_btf_file",
    "read_texel",
    "section_bytes",
    "values_of",
    "write_btf_file",
]
