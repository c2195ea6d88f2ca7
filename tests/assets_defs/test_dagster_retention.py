"""What goes by itself, and what must stay."""

# Dagster looks at the asset's annotations itself: no postponed ones here.
import os
import time
from collections.abc import Iterator
from pathlib import Path

import dagster as dg
import pytest

from assets_defs.retention import collect_store, delete_old_runs, retention_sensor
from assets_defs.workspace import Workspace
from storage.versions import Slot, VersionedStore

KEY = dg.AssetKey(["s", "a"])
PARTS = dg.StaticPartitionsDefinition(["one", "two", "three"])


@dg.asset(key=KEY, partitions_def=PARTS)
def _asset(context: dg.AssetExecutionContext) -> dg.MaterializeResult:
    if context.run.tags.get("fails"):
        raise ValueError("fails")
    print("something")
    return dg.MaterializeResult(metadata={"number": 1})


@pytest.fixture
def instance(tmp_path: Path) -> Iterator[dg.DagsterInstance]:
    with dg.DagsterInstance.local_temp(str(tmp_path), {"telemetry": {"enabled": False}}) as made:
        yield made


def _make(instance: dg.DagsterInstance, part: str, **tags: str) -> str:
    done = dg.materialize(
        [_asset], instance=instance, partition_key=part, tags=tags, raise_on_error=False
    )
    return done.run_id


def _shown(instance: dg.DagsterInstance) -> dict[str, str]:
    """The run that the web UI shows for each partition."""
    found = {}
    for part in instance.get_materialized_partitions(KEY):
        event = instance.fetch_materializations(
            dg.AssetRecordsFilter(KEY, asset_partitions=[part]), limit=1
        )
        found[part] = event.records[0].run_id
    return found


def test_old_runs_go_and_each_partitions_last_stays(
    instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    first = [_make(instance, part) for part in ("one", "two")]
    failed = _make(instance, "two", fails="yes")
    last = _make(instance, "one")
    shown = _shown(instance)
    assert shown == {"one": last, "two": first[1]}
    assert delete_old_runs(instance, [KEY], days=1) == []
    files = {run_id: list(tmp_path.rglob(f"*{run_id}*")) for run_id in (first[0], failed)}
    assert all(files.values())
    assert set(delete_old_runs(instance, [KEY], days=0)) == {first[0], failed}
    assert {run.run_id for run in instance.get_runs()} == {last, first[1]}
    assert _shown(instance) == shown
    for run_id in files:
        assert list(tmp_path.rglob(f"*{run_id}*")) == []
    # The next one that makes a partition again frees the run before.
    newest = _make(instance, "two")
    assert delete_old_runs(instance, [KEY], days=0) == [first[1]]
    assert _shown(instance) == {"one": last, "two": newest}


def test_runs_under_way_stay_and_time_is_bounded(instance: dg.DagsterInstance) -> None:
    old = _make(instance, "three", fails="yes")
    instance.create_run_for_job(
        dg.Definitions(assets=[_asset]).resolve_implicit_global_asset_job_def(), tags={}
    )
    assert delete_old_runs(instance, [KEY], days=0, seconds=-1) == []
    assert delete_old_runs(instance, [KEY], days=0) == [old]
    assert instance.get_runs_count() == 1


def test_what_a_killed_writer_left_goes_after_a_day(tmp_path: Path) -> None:
    store = VersionedStore(tmp_path)
    for age, name in ((25 * 3600, "old"), (3600, "young")):
        staged = store.files(Slot("s", "a", "never-published")).staging / name
        staged.mkdir(parents=True)
        (staged / "chunk").write_bytes(b"x")
        past = time.time() - age
        os.utime(staged / "chunk", (past, past))
        os.utime(staged, (past, past))
    assert collect_store(store) == 1
    assert [path.parent.name for path in tmp_path.rglob("chunk")] == ["young"]


def test_the_sensor_does_it_once_a_day(instance: dg.DagsterInstance, tmp_path: Path) -> None:
    sensor = retention_sensor(Workspace(tmp_path / "data"), [KEY])
    assert sensor.default_status == dg.DefaultSensorStatus.RUNNING
    first = sensor.evaluate_tick(dg.build_sensor_context(instance=instance))
    assert "No run is old" in str(first.skip_message)
    again = sensor.evaluate_tick(dg.build_sensor_context(instance=instance, cursor=first.cursor))
    assert again.skip_message == "Done for today."
