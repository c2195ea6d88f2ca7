"""What cannot work is told in one sentence, once, and a failed run leaves a report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import dagster as dg
import pytest
from PIL import Image

from assets_defs import failure_reports
from assets_defs.failure_reports import failure_sensor, write_report
from assets_defs.launcher import LaunchError, Request
from assets_defs.photo_fur.graph import FUR
from assets_defs.systems import SYSTEMS
from pipelines.photo_fur import attenuation
from storage.io_manager import INTERRUPTED


def _run(house: Any, grain: tuple[str, ...], partition: str, **fields: Any) -> Any:
    job = house.definitions.get_repository_def().get_job(FUR.job_name(grain))
    asset = next(name for name, plan in FUR.plans.items() if plan.by == grain)
    config = {"ops": {f"photo_fur__{asset}": {"config": {"preset": "test", **fields}}}}
    return job.execute_in_process(
        run_config=config,
        instance=house.instance,
        partition_key=partition,
        raise_on_error=False,
        asset_selection=[dg.AssetKey(["photo_fur", asset])],
    )


def _failure(done: Any) -> Any:
    assert not done.success
    assert not [event for event in done.all_events if event.is_step_up_for_retry]
    (failed,) = [event for event in done.all_events if event.is_step_failure]
    return failed.step_failure_data


def _report(house: Any, run_id: str) -> str:
    path = write_report(
        house.workspace, SYSTEMS, house.instance, house.instance.get_run_by_id(run_id), "said"
    )
    assert path is not None
    assert path.parent == house.workspace.root / "reports"
    assert path.name.endswith(f"-{run_id}.md")
    return path.read_text()


@pytest.fixture(scope="module", autouse=True)
def partitions(house: Any) -> None:
    """Every item is registered; nothing is made."""
    for dimension in FUR.dimensions:
        name = FUR.partitions_name(dimension.name)
        house.instance.add_dynamic_partitions(name, [*dimension.builtin, "lost"])


def test_a_missing_input_is_said_in_one_sentence_and_tried_once(house: Any) -> None:
    done = _run(house, ("photo", "mesh"), "teapot|pelt")
    said = _failure(done).user_failure_data.description
    asset = said.partition("/pelt: ")[0]
    assert asset.removeprefix("photo_fur/") in FUR.plans["fur_patches"].inputs
    assert said == (
        f"{asset}/pelt: no version has passed its checks; expected one. Materialise {asset} first."
    )
    text = _report(house, done.run_id)
    assert text.startswith(f"# photo_fur/fur_patches failed\n\n{said}\n")
    assert "- partition: `teapot|pelt`" in text
    assert '- photo_fur/fur_patches: `{"preset": "test"}`' in text
    assert "- photo_fur/shell_mesh/teapot: none" in text
    assert f"/runs/{done.run_id}" in text


def test_a_bad_file_is_said_in_one_sentence_and_tried_once(house: Any) -> None:
    inbox = house.workspace.inbox("photo_fur")
    inbox.mkdir(parents=True)
    Image.new("RGB", (80, 80), "grey").save(inbox / "flat.png")
    (key,) = (k for k, s in FUR.sources("photo", inbox).items() if s.path)
    house.instance.add_dynamic_partitions("photo_fur_photo", [key])
    for partition, words in ((key, "flat.png"), ("lost", "photo 'lost' is not known")):
        failure = _failure(_run(house, ("photo",), partition))
        said = failure.user_failure_data.description
        assert words in said
        assert "\n" not in said
        assert failure.error.cause is None  # what the reader raised is in the log


def test_an_error_of_the_code_is_tried_once_and_its_trace_is_in_the_log(
    house: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: Any, **options: Any) -> Any:
        raise KeyError("no such thing")

    monkeypatch.setattr("assets_defs.system.System.source_of", broken)
    job = house.definitions.get_repository_def().get_job("photo_fur_photo")
    done = job.execute_in_process(
        instance=house.instance,
        partition_key="grass",
        raise_on_error=False,
        asset_selection=[dg.AssetKey(["photo_fur", "fur_photo"])],
    )
    assert _failure(done).user_failure_data.description == "KeyError: 'no such thing'"
    logged = [entry.user_message for entry in house.instance.all_logs(done.run_id)]
    assert any("Traceback" in message and "in broken" in message for message in logged)


def test_a_check_of_what_is_not_there_says_so(house: Any) -> None:
    key = dg.AssetKey(["photo_fur", "fur_photo"])
    check = next(iter(FUR.plans["fur_photo"].checks)).name
    job = dg.define_asset_job("only_checks", dg.AssetSelection.checks(dg.AssetCheckKey(key, check)))
    definitions = dg.Definitions.merge(house.definitions, dg.Definitions(jobs=[job]))
    done = definitions.resolve_job_def("only_checks").execute_in_process(
        instance=house.instance, tags={"dagster/partition": "pelt"}, raise_on_error=False
    )
    said = _failure(done).user_failure_data.description
    assert said.startswith("photo_fur/fur_photo/pelt: no version has passed its checks")


def test_a_failed_check_is_reported_in_its_own_words_and_an_interruption_not_at_all(
    house: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = attenuation.fit_attenuation

    def wrong(luminance: Any, **options: Any) -> Any:
        return right(luminance, **options) * 0.0

    monkeypatch.setattr(attenuation, "fit_attenuation", wrong)
    with pytest.raises(LaunchError) as failure:
        house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test", force=True))
    (run,) = house.instance.get_runs(limit=1)
    text = _report(house, run.run_id)
    sentence = str(failure.value).partition(": ")[2].partition(": ")[2]
    assert sentence
    assert sentence in text
    assert '"preset": "test"' in text

    def interrupted(luminance: Any, **options: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(attenuation, "fit_attenuation", interrupted)
    with pytest.raises(KeyboardInterrupt):
        house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test", force=True))
    (run,) = house.instance.get_runs(limit=1)
    events = [entry.dagster_event for entry in house.instance.all_logs(run.run_id)]
    assert any(INTERRUPTED in json.dumps(str(event)) for event in events)
    assert write_report(house.workspace, SYSTEMS, house.instance, run, "said") is None


def test_a_run_that_failed_with_those_that_it_launched_adds_no_report(
    house: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: Any, **options: Any) -> Any:
        raise ValueError("the photograph has a single luminance.")

    monkeypatch.setattr(attenuation, "fit_attenuation", broken)
    job = house.definitions.get_repository_def().get_job("launch")
    for photo, is_reported in (("lost", True), ("grass", False)):
        fields = {"system": "photo_fur", "partitions": [{"photo": photo}], "force": True}
        done = job.execute_in_process(
            run_config={"ops": {"launch_graph": {"config": fields}}},
            instance=house.instance,
            raise_on_error=False,
        )
        assert not done.success
        run = house.instance.get_run_by_id(done.run_id)
        written = write_report(house.workspace, SYSTEMS, house.instance, run, "said")
        assert (written is not None) == is_reported


def test_the_sensor_reports_whoever_launched_and_reports_are_bounded(
    house: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    sensor = failure_sensor(house.workspace, SYSTEMS)
    assert sensor.default_status == dg.DefaultSensorStatus.RUNNING
    repository = house.definitions.get_repository_def()

    def tick(cursor: str | None) -> Any:
        context = dg.build_sensor_context(
            instance=house.instance, cursor=cursor, repository_def=repository
        )
        return sensor.evaluate_tick(context)

    cursor = tick(None).cursor
    runs = [_run(house, ("photo",), "lost").run_id for _ in range(3)]
    monkeypatch.setattr(failure_reports, "KEEP_REPORTS", 2)
    for _ in range(3):
        cursor = tick(cursor).cursor
    reports = sorted(Path(house.workspace.root / "reports").iterdir())
    assert len(reports) == 2
    assert {path.stem.partition("-")[2] for path in reports} <= set(runs)
