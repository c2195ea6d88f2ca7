"""How a partition's keys are joined into one name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from storage.versions import WHOLE


def partition_folder(keys: Mapping[str, str]) -> str:
    """Folder name of a partition: keys in the order of their dimensions' names."""
    return ".".join(keys[name] for name in sorted(keys)) or WHOLE


def partition_key(keys: Mapping[str, str]) -> str:
    """Dagster's partition key: keys in the order of their dimensions' names."""
    return "|".join(keys[name] for name in sorted(keys))


def keys_of_partition(key: str, by: Sequence[str], *, separator: str = "|") -> dict[str, str]:
    """The keys by dimension that a partition key, or with ``.`` its folder's name, joins."""
    return dict(zip(sorted(by), key.split(separator), strict=True))
