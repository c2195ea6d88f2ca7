"""Whether two stores hold the same: the content hash of every current version.

``python -m benchmarks contents STORE STORE``; a JSON file of hashes may stand for a store.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from storage.versions import VersionedStore


def run(one: str, other: str) -> dict[str, Any]:
    """Keys that both have, that one of them has, and whose contents differ."""
    return compared(contents(Path(one)), contents(Path(other)))


def compared(one: dict[str, str], other: dict[str, str]) -> dict[str, Any]:
    """The comparison of two lists of content hashes by key."""
    both = one.keys() & other.keys()
    changed = sorted(key for key in both if one[key] != other[key])
    return {
        "contents_compared": len(both),
        "contents_only_in_one": sorted(one.keys() ^ other.keys()),
        "contents_changed": len(changed),
        "contents_that_changed": changed,
    }


def contents(place: Path) -> dict[str, str]:
    """Content hash by key of what is current in a store, or of what a JSON file says was."""
    if place.is_file():
        return dict(json.loads(place.read_text())["contents"])
    store = VersionedStore(place)
    return {
        str(slot): store.record(slot)["content"]
        for slot in store.slots()
        if store.pointer(slot).version is not None
    }
