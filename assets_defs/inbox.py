"""The inbox: a file dropped into ``data/inbox/<system>/`` is registered and made.

What is already registered under its name and has not changed since is left alone: the command
line registers the files that it copies here and launches them itself.
"""

import json
import os
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import dagster as dg

from assets_defs.dagster_assets import dynamic_partitions
from assets_defs.rematerialisation import LaunchConfig
from assets_defs.sources import Source
from assets_defs.system import Dimension, System
from assets_defs.workspace import Workspace

SETTLED_SECONDS = 3.0
"""A file that changed more recently may still be on its way."""


def inbox_sensor(
    job: dg.JobDefinition, systems: Mapping[str, System], workspace: Workspace
) -> dg.SensorDefinition:
    """The one sensor: looks at names, sizes and times only, so a tick stays short."""

    @dg.sensor(
        name="inbox",
        job=job,
        minimum_interval_seconds=10,
        default_status=dg.DefaultSensorStatus.RUNNING,
        description="Registers files dropped into data/inbox/<system>/ and requests their runs.",
    )
    def look(context: dg.SensorEvaluationContext) -> dg.SensorResult:
        seen: dict[str, str] = json.loads(context.cursor or "{}")
        now: dict[str, str] = {}
        runs: list[dg.RunRequest] = []
        added: list[dg.AddDynamicPartitionsRequest] = []
        for system in systems.values():
            for dimension in system.dimensions:
                partitions = dynamic_partitions(system, dimension.name)
                registered = set(context.instance.get_dynamic_partitions(str(partitions.name)))
                new = set(dimension.builtin) - registered
                for path in system.files(dimension.name, workspace.inbox(system.name)):
                    name, key, stamp = (
                        f"{system.name}/{path.name}",
                        Source.of(path).key,
                        _stamp(path),
                    )
                    if stamp is None:
                        now |= {name: seen[name]} if name in seen else {}
                        continue
                    now[name] = stamp
                    if seen.get(name) == stamp or (name not in seen and key in registered):
                        continue
                    new |= {key} - registered
                    runs.append(_request(system, dimension, key, name, stamp))
                if new:
                    added.append(partitions.build_add_request(sorted(new)))
        return dg.SensorResult(
            run_requests=runs, dynamic_partitions_requests=added, cursor=json.dumps(now)
        )

    return look


def take_in(
    path: Path,
    system: System,
    dimension: Dimension,
    given: Mapping[str, Any],
    workspace: Workspace,
    instance: dg.DagsterInstance,
) -> str:
    """Read a file, copy it into the inbox and register it; returns its key.

    ``given`` are the settings that it is to be used with (a crop, say). A file of a name that is
    taken by other content gets digits of its hash. Raises ValueError for a file that cannot be
    used; then nothing is copied.
    """
    if path.suffix.lower() not in dimension.suffixes and not (dimension.folders and path.is_dir()):
        raise ValueError(
            f"{path.name}: ending is {path.suffix!r}; expected one of "
            f"{', '.join(dimension.suffixes)}."
        )
    dimension.check(Source.of(path), given)
    inbox = workspace.inbox(system.name)
    fingerprint = Source.of(path).fingerprint
    for name in (path.name, f"{path.stem}-{fingerprint[:8]}{path.suffix}"):
        target = inbox / name
        if not target.exists() or Source.of(target).fingerprint == fingerprint:
            break
    key = Source.of(target).key
    instance.add_dynamic_partitions(system.partitions_name(dimension.name), [key])
    if not target.exists():
        inbox.mkdir(parents=True, exist_ok=True)
        beside = target.with_name(f".{target.name}.part")
        if path.is_dir():
            shutil.rmtree(beside, ignore_errors=True)
            shutil.copytree(path, beside)
        else:
            shutil.copyfile(path, beside)
        os.replace(beside, target)
    return key


def _stamp(path: Path) -> str | None:
    """Size and time of a file, or of all in a folder; None while it may still be on its way."""
    inside = path.rglob("*") if path.is_dir() else ()
    statuses = [path.stat(), *(file.stat() for file in inside)]
    newest = max(status.st_mtime_ns for status in statuses)
    if time.time() - newest / 1e9 < SETTLED_SECONDS:
        return None
    return f"{sum(status.st_size for status in statuses)}:{newest}"


def _request(
    system: System, dimension: Dimension, key: str, name: str, stamp: str
) -> dg.RunRequest:
    """A launch of the new item with the other dimensions' defaults."""
    keys = {other.name: other.default for other in system.dimensions} | {dimension.name: key}
    config = LaunchConfig(system=system.name, partitions=[keys])
    return dg.RunRequest(
        run_key=f"{name}:{stamp}",
        run_config=dg.RunConfig(ops={"launch_graph": config}),
        tags={"tsuya/dropped": name[:60]},
    )
