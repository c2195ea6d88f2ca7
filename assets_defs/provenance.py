"""What a version was made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from assets_defs.settings import Settings
from assets_defs.sources import Source, json_hash
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
