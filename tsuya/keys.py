"""Keys as people type them: ``system/asset/partition``."""

from __future__ import annotations

from storage.schemas import schemas_of, systems
from storage.versions import Slot


def parse_key(key: str) -> Slot:
    """A slot from ``system/asset/partition``; keys of a partition are joined by ``.`` or ``|``.

    Raises ValueError, with the keys that there are, for one that names no asset.

    >>> str(parse_key("photo_fur/fur_frames/teapot|grass"))
    'photo_fur/fur_frames/teapot.grass'
    """
    parts = key.strip("/").split("/")
    known = [f"{system}/{schema.asset}" for system in systems() for schema in schemas_of(system)]
    if len(parts) != 3 or "/".join(parts[:2]) not in known:
        raise ValueError(
            f"key is {key!r}; expected system/asset/partition with one of {', '.join(known)}."
        )
    system, asset, partition = parts
    return Slot(system, asset, partition.replace("|", "."))
