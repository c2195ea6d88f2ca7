"""Where a project's data lie: one folder with the store and the inbox."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from storage.versions import VersionedStore

CHECKOUT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Workspace:
    """The folder that ``TSUYA_DATA`` names, by default ``data/`` in the checkout."""

    root: Path

    @classmethod
    def from_environment(cls) -> Workspace:
        """The workspace of this process's environment."""
        return cls(Path(os.environ.get("TSUYA_DATA") or CHECKOUT / "data"))

    @classmethod
    def of_checkout(cls) -> Workspace:
        """The workspace that ``.env`` names where the environment does not: the command line's."""
        from dotenv import load_dotenv

        load_dotenv(CHECKOUT / ".env")
        return cls.from_environment()

    @property
    def store(self) -> VersionedStore:
        """All versions of all assets."""
        return VersionedStore(self.root / "store")

    @property
    def pictures(self) -> Path:
        """Where commands write pictures for people: beside the data, not among them."""
        return self.root.absolute().parent / "pictures"

    @property
    def exports(self) -> Path:
        """Where commands write what is for other programs."""
        return self.root.absolute().parent / "exports"

    def inbox(self, system: str) -> Path:
        """Where people drop a system's files; what lies here is registered."""
        return self.root / "inbox" / system
