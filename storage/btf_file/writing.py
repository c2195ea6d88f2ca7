"""Bytes of a compressed BTF."""

from __future__ import annotations

from storage.btf_file.contents import BtfFile


def write_btf_file(btf: BtfFile) -> bytes:
    """The bytes of a `.tbtf` file; equal contents make equal bytes.

    Raises ValueError, one sentence, for contents that no file can hold.
    """
    raise NotImplementedError
