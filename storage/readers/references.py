"""Where the names that a file refers to lead."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import unquote


def file_beside(file: Path, name: str) -> Path | None:
    """Where a reference leads: from the file's folder, or to a file beside it."""
    relative = name.replace("\\", "/")
    for candidate in (relative, relative.rpartition("/")[2]):
        there = os.path.normpath(file.parent / candidate)
        if os.path.isfile(there):  # False, unlike Path's, for names too long to be one
            return Path(there)
    return None


def spellings(uri: str) -> list[str]:
    """A relative URI as the name of a file: without its percent signs, and as it stands."""
    return list(dict.fromkeys((unquote(uri), uri)))
