"""A compressed BTF of its bytes: whole, or one texel of it."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from storage.btf_file.contents import BtfFile


def read_btf_file(data: bytes, name: str = "file.tbtf") -> BtfFile:
    """What a `.tbtf` file holds; ``name`` is for errors.

    Raises BadInput for a file that is cut, altered, newer, or not one.
    """
    raise NotImplementedError


def read_texel(
    data: bytes, level: int, row: int, column: int, name: str = "file.tbtf"
) -> NDArray[Any]:
    """Latents (C,) of one texel: int32 symbols, or float32 values of the paper's form.

    Raises BadInput as `read_btf_file` does, IndexError for a texel that is not there.
    """
    raise NotImplementedError


def section_bytes(data: bytes, name: str = "file.tbtf") -> dict[str, int]:
    """Bytes of each section, by name; their sum is the file's size."""
    raise NotImplementedError
