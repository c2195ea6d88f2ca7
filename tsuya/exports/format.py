"""One thing that a package can be written as."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from storage.packages import Package

ALL_SYSTEMS = (
    "glass_scratches",
    "neural_btf",
    "photo_fur",
    "ssdf_lighting",
    "street_billboards",
)
Notes = Sequence[str]
"""Sentences on what the format cannot hold, and on the error that it makes."""


@dataclass(frozen=True)
class Format:
    """A format of ``tsuya export``."""

    name: str
    """As ``--to`` has it."""
    systems: tuple[str, ...]
    """Whose packages can be written so."""
    ending: str
    """Of the file that is written, with its dot; empty for a folder."""
    meaning: str
    """One line; ends without a full stop."""
    write: Callable[[Package, Path], Notes]
    """Writes a package to a path, which is not there yet. Raises ValueError, BadInput."""
    together: Callable[[Sequence[Package], Path], Notes] | None = None
    """Writes several packages as one, where that is possible."""
