"""What goes by itself: Dagster's old runs, and what killed writers left in the store.

A run goes ``KEEP_DAYS`` after it ended, with its events, its log and its captured output; a run
that holds the last materialisation of an asset's partition stays, so the web UI never forgets what
is there. Ticks of schedule and sensors go by `dagster.yaml`; versions, reports and pictures are
bounded where they are written.
"""

import shutil
import time
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import dagster as dg
from dagster._core.storage.dagster_run import FINISHED_STATUSES
from dagster._core.storage.event_log import SqliteEventLogStorage

from assets_defs.picture_links import forget_pictures
from assets_defs.workspace import Workspace
from storage.versions import Slot, VersionedStore

KEEP_DAYS = 30
TICK_SECONDS = 20.0
"""So long a sensor's tick deletes runs; the next tick goes on."""


def delete_old_runs(
    instance: dg.DagsterInstance,
    assets: Iterable[dg.AssetKey],
    *,
    days: float = KEEP_DAYS,
    seconds: float = TICK_SECONDS,
) -> list[str]:
    """Delete runs that ended long ago and hold no partition's last materialisation; their ids."""
    until = time.monotonic() + seconds
    before = datetime.now(UTC) - timedelta(days=days)
    old = instance.get_run_ids(
        dg.RunsFilter(statuses=list(FINISHED_STATUSES), updated_before=before)
    )
    if not old:
        return []
    kept = _last_runs(instance, assets)
    deleted = []
    for run_id in reversed(old):
        if time.monotonic() > until:
            break
        if run_id not in kept:
            _delete(instance, run_id)
            deleted.append(run_id)
    return deleted


def _last_runs(instance: dg.DagsterInstance, assets: Iterable[dg.AssetKey]) -> set[str]:
    """The runs that made what is newest of each partition of each asset."""
    made = dg.DagsterEventType.ASSET_MATERIALIZATION
    runs = set()
    for asset in assets:
        newest = instance.event_log_storage.get_latest_storage_id_by_partition(asset, made)
        records = instance.event_log_storage.get_event_records(
            dg.EventRecordsFilter(made, asset_key=asset, storage_ids=list(newest.values()))
        )
        runs |= {record.run_id for record in records}
        last = instance.get_latest_materialization_event(asset)
        runs |= {last.run_id} if last else set()
    return runs


def _delete(instance: dg.DagsterInstance, run_id: str) -> None:
    """Delete a run with its files: Dagster itself leaves an empty database and the output."""
    instance.delete_run(run_id)
    events = instance.event_log_storage
    if isinstance(events, SqliteEventLogStorage):
        database = Path(events.path_for_shard(run_id))
        for suffix in ("", "-wal", "-shm"):
            database.with_name(database.name + suffix).unlink(missing_ok=True)
    shutil.rmtree(Path(instance.storage_directory()) / run_id, ignore_errors=True)


def collect_store(store: VersionedStore) -> int:
    """Let every slot delete what nobody needs; how many pieces went.

    A slot collects by itself when it is written; this is for those that are never written again.
    """
    slots = {path.parent for path in store.root.glob("*/*/*/staging")}
    return sum(len(store.collect(Slot(*slot.relative_to(store.root).parts))) for slot in slots)


def retention_sensor(workspace: Workspace, assets: Iterable[dg.AssetKey]) -> dg.SensorDefinition:
    """The sensor that deletes what is old, once a day."""
    keys = tuple(assets)

    @dg.sensor(
        name="retention",
        minimum_interval_seconds=600,
        default_status=dg.DefaultSensorStatus.RUNNING,
        description=f"Deletes runs {KEEP_DAYS} days after they ended, but for each partition's "
        "last, and what killed writers left in the store.",
    )
    def look(context: dg.SensorEvaluationContext) -> dg.SkipReason:
        today = f"{datetime.now(UTC):%Y-%m-%d}"
        if context.cursor == today:
            return dg.SkipReason("Done for today.")
        deleted = delete_old_runs(context.instance, keys)
        if deleted:
            return dg.SkipReason(f"{len(deleted)} old runs deleted.")
        collected = collect_store(workspace.store) + forget_pictures(workspace)
        context.update_cursor(today)
        return dg.SkipReason(f"No run is old; {collected} pieces of the data collected.")

    return look
