"""What can go wrong with stored data, each said in one sentence."""

from __future__ import annotations

from pathlib import Path


class StoreError(Exception):
    """A version cannot be written, read or moved; nothing already stored was changed."""


class NoVersionError(StoreError):
    """The asset's partition has no version that has passed its checks."""


class DamagedError(StoreError):
    """What is stored is not what was written: a bit flipped, a file was lost or cut short."""

    def __init__(self, folder: Path, what: str) -> None:
        super().__init__(
            f"{folder}: {what}; expected what was written. `tsuya verify` puts the last good "
            "version in its place, and a run makes it again."
        )
        self.folder = folder
        """Folder of the damaged version, or of the slot."""
        self.what = what


class MissingChunkError(DamagedError):
    """A stored array lacks a chunk that its shape demands."""


class StoreFullError(StoreError):
    """The disk has no room for a new version."""


class SchemaError(StoreError):
    """A dataset is not what its schema declares."""
