"""The versions that something was made of, with what their checks said: for packages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from storage.errors import StoreError
from storage.versions import Slot, VersionedStore


def lineage(
    store: VersionedStore, system: str, inputs: Mapping[str, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """All versions below some inputs, whose records are given by asset; each once, inputs first.

    Of a version that is not kept any more only its name and content are told.
    """
    waiting = [
        {"asset": asset} | {key: record[key] for key in ("partition", "version", "content")}
        for asset, record in inputs.items()
    ]
    told: dict[tuple[str, str], dict[str, Any]] = {}
    while waiting:
        entry = waiting.pop(0)
        slot = Slot(system, entry["asset"], entry["partition"])
        if (slot.asset, slot.partition) in told:
            continue
        told[slot.asset, slot.partition] = entry
        try:
            record = store.record(slot, entry["version"])
        except StoreError:
            continue
        verdicts = store.verdicts(slot, entry["version"])
        entry |= {
            "settings": record["settings"],
            "checks": {
                check: {"passed": verdict["passed"], "figure": verdict["figure"]}
                for check, verdict in sorted(verdicts.items())
            },
        }
        waiting += [dict(each) for each in record["inputs"]]
    return list(told.values())
