"""What a version was made of, and how its partition is called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.sources import Source, json_hash
from storage.versions import WHOLE

if TYPE_CHECKING:
    from assets_defs.settings import Settings
    from assets_defs.system import AssetPlan


def provenance(
    plan: AssetPlan,
    settings: Settings,
    source: str | None,
    inputs: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:
    """The part of a version's record that says what it was made of.

    ``recipe`` is the hash of code, settings, source and the inputs' content: the launcher skips
    what has it already. ``lineage`` leaves out code and content: versions of equal lineage were
    asked for in the same way, so their figures may be compared.
    """
    stored = settings.model_dump(mode="json")
    chosen = dict(stored)
    files = {name: Source("", path).fingerprint for name, path in settings.files().items()}
    if files:
        chosen |= {"files": files}
    contents = {name: record["content"] for name, record in inputs.items()}
    lineages = {name: record["lineage"] for name, record in inputs.items()}
    return {
        "asset": f"{plan.schema.system}/{plan.name}",
        "schema": plan.schema.number,
        "settings": stored,
        "source": source,
        "code": plan.code,
        "inputs": [
            {
                "asset": name,
                "partition": record["partition"],
                "version": record["version"],
                "content": record["content"],
            }
            for name, record in inputs.items()
        ],
        "recipe": json_hash(plan.schema.number, plan.code, chosen, source, contents),
        "lineage": json_hash(chosen, source, lineages),
    }


def partition_folder(keys: Mapping[str, str]) -> str:
    """Folder name of a partition: keys in the order of their dimensions' names."""
    return ".".join(keys[name] for name in sorted(keys)) or WHOLE


def partition_key(keys: Mapping[str, str]) -> str:
    """Dagster's partition key: keys in the order of their dimensions' names."""
    return "|".join(keys[name] for name in sorted(keys))


def keys_of_partition(key: str, by: Sequence[str], *, separator: str = "|") -> dict[str, str]:
    """The keys by dimension that a partition key, or with ``.`` its folder's name, joins."""
    return dict(zip(sorted(by), key.split(separator), strict=True))
