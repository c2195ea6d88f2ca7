"""A report of each run that failed: a page of Markdown, ``<data>/reports/<time>-<run>.md``.

It says in a person's words what failed, where and why, with what settings and from what, and where
the log is. A run that a person interrupted, or that failed because one that it launched did, has
none.
"""

# Dagster looks at the sensor's annotations itself: no postponed ones here.
import json
import os
import uuid
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import dagster as dg
from dagster._core.storage.tags import PARENT_RUN_ID_TAG

from assets_defs.partitions import keys_of_partition
from assets_defs.system import System
from assets_defs.workspace import Workspace
from storage.errors import StoreError
from storage.io_manager import INTERRUPTED

KEEP_REPORTS = 200
_LONGEST_TRACE = 8000
_LONGEST_SENTENCE = 2000


def failure_sensor(workspace: Workspace, systems: Mapping[str, System]) -> dg.SensorDefinition:
    """The sensor that writes a report of each failed run, whoever launched it."""

    @dg.run_failure_sensor(
        name="failure_reports",
        minimum_interval_seconds=30,
        default_status=dg.DefaultSensorStatus.RUNNING,
        # The command line's runs belong to no code location.
        monitor_all_code_locations=True,
        description="Writes data/reports/<time>-<run>.md for each run that fails.",
    )
    def report(context: dg.RunFailureSensorContext) -> None:
        said = str(context.failure_event.message)
        write_report(workspace, systems, context.instance, context.dagster_run, said)

    return report


def write_report(
    workspace: Workspace,
    systems: Mapping[str, System],
    instance: dg.DagsterInstance,
    run: dg.DagsterRun,
    said: str,
) -> Path | None:
    """Write a failed run's report; its path. None for a run that is to have none.

    ``said`` is what the history says where no step of the run does.
    """
    failures = _failures(instance, run)
    if any(sentence == INTERRUPTED for _, sentence, _ in failures):
        return None
    if _is_told_of(instance, run, failures):
        return None
    folder = workspace.root / "reports"
    folder.mkdir(parents=True, exist_ok=True)
    record = instance.get_run_record_by_id(run.run_id)
    ended = record.end_time if record and record.end_time else datetime.now(UTC).timestamp()
    when = datetime.fromtimestamp(ended, UTC)
    path = folder / f"{when:%Y%m%dT%H%M%S}-{run.run_id}.md"
    lines = [
        *_headline(run, when, failures or [("", said, "")]),
        *_settings(run),
        *_inputs(workspace, systems, run, failures),
        *_logs(workspace, instance, run),
        *_traces(failures),
    ]
    beside = folder / f".{uuid.uuid4().hex[:8]}.part"
    beside.write_text("\n".join(lines) + "\n", encoding="utf-8")
    os.replace(beside, path)
    for old in sorted(folder.glob("*.md"))[:-KEEP_REPORTS]:
        old.unlink(missing_ok=True)
    return path


_Failure = tuple[str, str, str]
"""A step's name, the sentence that says why, and the trace where one helps."""


def _failures(instance: dg.DagsterInstance, run: dg.DagsterRun) -> list[_Failure]:
    """What failed in a run, in order; failed checks by their own words."""
    kinds = {dg.DagsterEventType.STEP_FAILURE, dg.DagsterEventType.ASSET_CHECK_EVALUATION}
    found: list[_Failure] = []
    judged = set()
    for entry in instance.all_logs(run.run_id, of_type=kinds):
        event = entry.dagster_event
        if event is None:
            continue
        if event.event_type == dg.DagsterEventType.ASSET_CHECK_EVALUATION:
            evaluation = event.asset_check_evaluation_data
            if not evaluation.passed:
                judged.add(event.step_key)
                found.append((event.step_key or "", str(evaluation.description), ""))
        elif event.step_key not in judged:
            data = event.step_failure_data
            own = data.user_failure_data.description if data.user_failure_data else None
            error = data.error
            while error and error.cause:
                error = error.cause
            sentence = own or (error.message.strip() if error else "it failed.")
            trace = data.error.to_string() if data.error and not own else ""
            found.append((event.step_key or "", sentence, trace))
    return found


def _is_told_of(
    instance: dg.DagsterInstance, run: dg.DagsterRun, failures: Sequence[_Failure]
) -> bool:
    """Whether all that failed are runs that this one launched: each has its own report."""
    children = dg.RunsFilter(
        tags={PARENT_RUN_ID_TAG: run.run_id}, statuses=[dg.DagsterRunStatus.FAILURE]
    )
    said = sum(len(sentence.splitlines()) for _, sentence, _ in failures)
    return 0 < said <= instance.get_runs_count(children)


def _headline(run: dg.DagsterRun, when: datetime, failures: Sequence[_Failure]) -> Iterator[str]:
    steps = ", ".join(step.replace("__", "/") for step, _, _ in failures if step)
    partition = run.tags.get("dagster/partition")
    yield f"# {steps or run.job_name} failed"
    yield ""
    for _, sentence, _ in failures:
        yield sentence[:_LONGEST_SENTENCE]
        yield ""
    yield f"- job: `{run.job_name}`"
    if partition:
        yield f"- partition: `{partition}`"
    yield f"- run: `{run.run_id}`"
    yield f"- ended: {when:%Y-%m-%d %H:%M:%S} UTC"


def _settings(run: dg.DagsterRun) -> Iterator[str]:
    config: Any = run.run_config
    ops: Mapping[str, Any] = config.get("ops", {})
    if ops:
        yield from ("", "## Settings", "")
    for name, given in ops.items():
        fields = json.dumps(given.get("config", {}), sort_keys=True, ensure_ascii=False)
        yield f"- {name.replace('__', '/')}: `{fields}`"


def _inputs(
    workspace: Workspace,
    systems: Mapping[str, System],
    run: dg.DagsterRun,
    failures: Sequence[_Failure],
) -> Iterator[str]:
    """The versions that are current of what the failed assets are made from."""
    lines: dict[str, None] = {}  # in order, each once
    partition = run.tags.get("dagster/partition")
    for step, _, _ in failures:
        name, _, asset = step.partition("__")
        plan = systems[name].plans.get(asset) if name in systems else None
        if plan is None or partition is None:
            continue
        keys = keys_of_partition(partition, plan.by)
        for source in plan.inputs:
            by = systems[name].plans[source].by
            slot = systems[name].slot(source, {dimension: keys[dimension] for dimension in by})
            try:
                lines[f"- {slot}: `{workspace.store.current(slot)}`"] = None
            except StoreError:
                lines[f"- {slot}: none"] = None
    if lines:
        yield from ("", "## Made from, now", "")
    yield from lines


def _logs(workspace: Workspace, instance: dg.DagsterInstance, run: dg.DagsterRun) -> Iterator[str]:
    yield from ("", "## Log", "")
    try:
        address = (workspace.root / "ui.lock").read_text().strip()
    except OSError:
        address = ""
    yield f"- web UI (`tsuya ui`): {address or 'its address'}/runs/{run.run_id}"
    output = Path(instance.storage_directory()) / run.run_id / "compute_logs"
    if output.is_dir():
        yield f"- what it printed: `{output}`"


def _traces(failures: Sequence[_Failure]) -> Iterator[str]:
    for step, _, trace in failures:
        if trace:
            yield from ("", f"## Where {step.replace('__', '/')} failed", "", "```")
            yield trace[-_LONGEST_TRACE:].rstrip()
            yield "```"
