"""What a partition's first asset is made from: a user's file or folder, or something built in."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from storage.slugs import slug


@dataclass(frozen=True)
class Source:
    """A user's file or folder, or a built-in item."""

    key: str
    path: Path | None

    @classmethod
    def of(cls, path: Path) -> Source:
        """A file or a folder; its ending is part of the key: `fur.png`, `fur.jpg` are two."""
        if path.is_dir():
            return cls(slug(f"{path.name}-folder"), path)
        return cls(slug(f"{path.stem}-{path.suffix[1:]}"), path)

    @property
    def name(self) -> str:
        """The name that people know it by."""
        return self.key if self.path is None else self.path.name

    @property
    def fingerprint(self) -> str:
        """Hash of the file's bytes, or of all files in the folder; of a built-in item, its key."""
        if self.path is None:
            return f"built-in:{self.key}"
        if self.path.is_dir():
            inside = sorted(path for path in self.path.rglob("*") if path.is_file())
            return json_hash(
                [[str(p.relative_to(self.path)), Source("", p).fingerprint] for p in inside]
            )
        with self.path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()


def json_hash(*parts: Any) -> str:
    """SHA-256 of what JSON can hold; keys of mappings in the order of their names."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
