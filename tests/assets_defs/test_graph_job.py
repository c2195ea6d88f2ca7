"""A system's graph of some items as one job of the web UI, and what the web UI shows then."""

from __future__ import annotations

from typing import Any

import dagster as dg
import numpy as np
import pytest
from dagster._config import process_config
from dagster._core.remote_representation.external_data import active_presets_from_job_def
from PIL import Image

from assets_defs.dagster_metadata import FULL_SIZE, PICTURE
from assets_defs.ended_runs import PROCESS
from assets_defs.graph_job import LAUNCHED_BY
from assets_defs.partitions import keys_of_partition
from assets_defs.photo_fur.graph import FUR
from assets_defs.picture_links import picture_folder
from assets_defs.street_billboards.graph import STREET
from assets_defs.systems import SYSTEMS


def _job(house: Any, name: str) -> dg.JobDefinition:
    job: dg.JobDefinition = house.definitions.get_repository_def().get_job(name)
    return job


def _config(name: str, **fields: Any) -> dict[str, Any]:
    return {"ops": {f"{name}_launch": {"config": fields}}}


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS)
def test_the_launchpad_shows_the_defaults_and_takes_them(house: Any, system: Any) -> None:
    job = _job(house, f"{system.name}_graph")
    (preset,) = active_presets_from_job_def(job)
    shown = preset.run_config["ops"][f"{system.name}_graph_launch"]["config"]
    assert {name: shown[name] for name in shown if name != "force"} == {
        dimension.name: [dimension.default] for dimension in system.dimensions
    }
    assert process_config(job.run_config_schema.run_config_schema_type, preset.run_config).success
    fields = job.graph.node_defs[0].config_schema.config_type.fields  # type: ignore[attr-defined]
    for dimension in system.dimensions:
        assert dimension.default in fields[dimension.name].description


@pytest.fixture(scope="module")
def made(house: Any) -> str:
    """The run of the job that made two photographs' graphs."""
    job = _job(house, "photo_fur_graph")
    config = _config(job.name, photo=["grass", "pelt"], mesh=["square"], preset="test")
    done = job.execute_in_process(run_config=config, instance=house.instance)
    assert done.success
    return done.run_id


def test_all_grains_are_made_in_order_by_runs_that_lead_back(house: Any, made: str) -> None:
    children = house.instance.get_runs(dg.RunsFilter(tags={"dagster/parent_run_id": made}))
    jobs = [(run.job_name, run.tags["dagster/partition"]) for run in reversed(children)]
    assert jobs == [
        ("photo_fur_photo", "grass"),
        ("photo_fur_photo", "pelt"),
        ("photo_fur_mesh", "square"),
        ("photo_fur_photo_mesh", "square|grass"),
        ("photo_fur_photo_mesh", "square|pelt"),
    ]
    for run in children:
        assert run.tags["dagster/root_run_id"] == made
        assert run.tags[LAUNCHED_BY] == "photo_fur_graph"
        assert run.tags[PROCESS]
    group = {run.run_id for run in house.instance.get_run_group(made)[1]}
    assert group == {made, *(run.run_id for run in children)}
    slot = FUR.slot("fur_frames", {"photo": "grass", "mesh": "square"})
    settings = house.workspace.store.record(slot)["settings"]
    assert settings == FUR.plans["fur_frames"].settings.preset("test", {}).model_dump(mode="json")


def test_every_picture_of_every_asset_is_shown_and_linked(house: Any, made: str) -> None:
    with_pictures = 0
    for plan in FUR.plans.values():
        key = dg.AssetKey(["photo_fur", plan.name])
        (record,) = house.instance.fetch_materializations(key, limit=1).records
        slot = FUR.slot(plan.name, keys_of_partition(record.partition_key, plan.by))
        metadata = record.asset_materialization.metadata
        pictures = plan.pictures(house.workspace.store.open(slot)) if plan.pictures else {}
        for name, picture in pictures.items():
            assert metadata[PICTURE + name].value.startswith("![picture](data:image/jpeg;base64,")
            path = metadata[FULL_SIZE + name].value.removeprefix("http://").partition("/")[2]
            file = Image.open(picture_folder(house.workspace) / path)
            np.testing.assert_array_equal(np.asarray(file), picture)
            with_pictures += 1
    assert with_pictures >= 4


def test_checks_speak_of_their_own_partition_only(house: Any, made: str) -> None:
    """Figures of two photographs in one history: each evaluation names its partition."""
    store = house.workspace.store
    photos = [plan for plan in FUR.plans.values() if plan.by == ("photo",)]
    checks = [(plan, check) for plan in photos for check in plan.checks]
    assert len(checks) >= 4
    for plan, check in checks:
        key = dg.AssetCheckKey(dg.AssetKey(["photo_fur", plan.name]), check.name)
        history = house.instance.event_log_storage.get_asset_check_execution_history(key, 10)
        said = [record.event.dagster_event.asset_check_evaluation_data for record in history]
        assert {evaluation.partition for evaluation in said} == {"grass", "pelt"}
        for evaluation in said:
            shown = {name: value.value for name, value in evaluation.metadata.items()}
            slot = FUR.slot(plan.name, {"photo": evaluation.partition})
            version = store.current(slot)
            assert (shown["partition"], shown["version"]) == (evaluation.partition, version)
            assert shown.get("figure") == store.verdicts(slot, version)[check.name]["figure"]


def test_what_cannot_be_launched_is_said_in_a_sentence(house: Any) -> None:
    job = _job(house, "photo_fur_graph")
    for wrong, sentence in (
        ({"photo": ["nobody"]}, "photo 'nobody' is not known; expected one of"),
        ({"preset": "huge"}, "preset is 'huge'; expected one of"),
        ({"settings": {"layers": 0}}, "setting 'layers' is 0;"),
    ):
        done = job.execute_in_process(
            run_config=_config(job.name, **wrong), instance=house.instance, raise_on_error=False
        )
        (failed,) = [event for event in done.all_events if event.is_step_failure]
        said = failed.step_failure_data.user_failure_data
        assert said is not None
        assert sentence in str(said.description)
        assert "\n" not in str(said.description)


def test_numbers_and_inbox_items_are_named_where_they_may_be(house: Any) -> None:
    job = _job(house, f"{STREET.name}_graph")
    assert job.description
    assert job.description.startswith(STREET.title)
    fields = _job(house, "neural_btf_graph").graph.node_defs[0].config_schema.config_type.fields  # type: ignore[attr-defined]
    assert "a whole number" in fields["clusters"].description
    assert "inbox" in fields["material"].description
