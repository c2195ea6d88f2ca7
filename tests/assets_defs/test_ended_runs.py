"""Runs of processes that are no more: they are ended, and no others."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import dagster as dg
import pytest
import yaml
from dagster._core.storage.tags import GRPC_INFO_TAG
from dagster._core.test_utils import create_run_for_test
from dagster._core.utils import make_new_run_id

from assets_defs import ended_runs
from assets_defs.ended_runs import PROCESS, end_dead_runs, ended_runs_sensor, process_tags, tag_run

STARTED = dg.DagsterRunStatus.STARTED


@pytest.fixture(scope="module")
def instance(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dg.DagsterInstance]:
    home = str(tmp_path_factory.mktemp("dagster"))
    with dg.DagsterInstance.local_temp(home, {"telemetry": {"enabled": False}}) as instance:
        yield instance


def _run(instance: dg.DagsterInstance, status: dg.DagsterRunStatus, **tags: str) -> str:
    named = {PROCESS if name == "process" else name: value for name, value in tags.items()}
    return create_run_for_test(instance, job_name="j", status=status, tags=named).run_id


def _status(instance: dg.DagsterInstance, run_id: str) -> dg.DagsterRunStatus:
    run = instance.get_run_by_id(run_id)
    assert run is not None
    return run.status


@pytest.fixture(scope="module")
def dead() -> str:
    """The tag that a process gave itself before it was killed."""
    code = (
        "from assets_defs.ended_runs import *; import time;"
        "print(process_tags()[PROCESS], flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as born:
        assert born.stdout is not None
        tag = born.stdout.readline().strip("\n")
        assert tag.split(" ")[2] == str(born.pid)
        os.kill(born.pid, signal.SIGKILL)
    return tag


def test_a_killed_processes_runs_are_ended_and_say_why(
    instance: dg.DagsterInstance, dead: str
) -> None:
    own = process_tags()[PROCESS]
    ended = {
        _run(instance, STARTED, process=dead): dg.DagsterRunStatus.FAILURE,
        _run(instance, dg.DagsterRunStatus.STARTING, process=dead): dg.DagsterRunStatus.FAILURE,
        _run(instance, dg.DagsterRunStatus.NOT_STARTED, process=dead): dg.DagsterRunStatus.FAILURE,
        _run(instance, dg.DagsterRunStatus.CANCELING, process=dead): dg.DagsterRunStatus.CANCELED,
    }
    left = [
        (_run(instance, STARTED, process=own), STARTED),
        (_run(instance, STARTED), STARTED),
        (_run(instance, dg.DagsterRunStatus.SUCCESS, process=dead), dg.DagsterRunStatus.SUCCESS),
    ]
    assert set(end_dead_runs(instance)) == set(ended)
    assert {run_id: _status(instance, run_id) for run_id in ended} == ended
    assert [(run_id, _status(instance, run_id)) for run_id, _ in left] == left
    events = [entry.dagster_event for entry in instance.all_logs(next(iter(ended)))]
    said = [str(event.message) for event in events if event]
    assert any("has ended: it was killed" in message and "\n" not in message for message in said)
    assert end_dead_runs(instance) == []


@pytest.mark.parametrize(
    ("change", "is_dead"),
    [
        ({}, False),
        ({"started": "1"}, True),  # the id was given to another process
        ({"boot": "another"}, True),
        ({"host": "elsewhere", "started": "1"}, False),
    ],
)
def test_host_boot_and_start_tell_processes_apart(
    instance: dg.DagsterInstance, change: dict[str, str], is_dead: bool
) -> None:
    tag = ended_runs._Process.own()._replace(**change).tag
    run_id = _run(instance, STARTED, process=tag)
    assert (run_id in end_dead_runs(instance)) == is_dead


def test_a_zombie_is_dead() -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as child:
        os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
        assert ended_runs._started(child.pid) is None


def test_the_start_is_the_kernels(instance: dg.DagsterInstance) -> None:
    """Against `ps`, which names the seconds since."""
    ticks = float(ended_runs._Process.own().started) / os.sysconf("SC_CLK_TCK")
    up = float(Path("/proc/uptime").read_text().split()[0])
    shown = subprocess.check_output(["ps", "-o", "etimes=", "-p", str(os.getpid())], text=True)
    assert abs((up - ticks) - int(shown)) < 2.5


def test_a_run_without_a_tag_is_found_by_its_code_server(
    instance: dg.DagsterInstance, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    alive = str(tmp_path / "alive")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(alive)
        server.listen()
        runs = [
            _run(instance, STARTED, **{GRPC_INFO_TAG: json.dumps({"host": host, "socket": path})})
            for host, path in (
                ("localhost", alive),
                ("elsewhere", str(tmp_path / "gone")),
                ("localhost", str(tmp_path / "gone")),
            )
        ]
        assert end_dead_runs(instance) == []  # it may not have reached its first step yet
        monkeypatch.setattr(ended_runs, "SERVER_GRACE", timedelta(0))
        assert end_dead_runs(instance) == runs[2:]


def test_a_run_that_nobody_knows_is_given_a_day(
    instance: dg.DagsterInstance, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_id = _run(instance, STARTED)
    assert run_id not in end_dead_runs(instance)
    monkeypatch.setattr(ended_runs, "UNKNOWN_GRACE", timedelta(0))
    assert run_id in end_dead_runs(instance)


def test_the_process_that_executes_tags_its_run_once(
    instance: dg.DagsterInstance, dead: str
) -> None:
    """A run executed again in the web UI has the tags of the first one's dead process."""
    run_id = _run(instance, STARTED, process=dead)
    run = instance.get_run_by_id(run_id)
    assert run is not None
    tag_run(instance, run)
    tagged = instance.get_run_by_id(run_id)
    assert tagged is not None
    assert tagged.tags[PROCESS] == process_tags(run_id)[PROCESS]
    instance.add_run_tags(run_id, {PROCESS: "replaced"})
    tag_run(instance, run)
    after = instance.get_run_by_id(run_id)
    assert after is not None
    assert after.tags[PROCESS] == "replaced"


def test_tags_that_were_copied_from_another_run_say_nothing() -> None:
    origin: Any = object()
    run_id = make_new_run_id()

    class Record:
        update_timestamp = ended_runs.datetime.now(ended_runs.UTC)

        class dagster_run:  # noqa: N801
            status = dg.DagsterRunStatus.STARTING
            remote_job_origin = origin
            tags = {PROCESS: ended_runs._Process("here", "b", 1, "1", "another run").tag}  # noqa: RUF012

    Record.dagster_run.run_id = run_id  # type: ignore[attr-defined]
    assert ended_runs._why_dead(Record) is None  # type: ignore[arg-type]
    own = ended_runs._Process.own(run_id)._replace(started="1").tag
    Record.dagster_run.tags = {PROCESS: own}
    assert ended_runs._why_dead(Record) is not None  # type: ignore[arg-type]


def test_the_sensor_runs_by_itself_and_ends_them(instance: dg.DagsterInstance, dead: str) -> None:
    sensor = ended_runs_sensor()
    assert sensor.default_status == dg.DefaultSensorStatus.RUNNING
    run_id = _run(instance, STARTED, process=dead)
    sensor.evaluate_tick(dg.build_sensor_context(instance=instance))
    assert _status(instance, run_id) == dg.DagsterRunStatus.FAILURE


def test_the_command_lines_runs_do_not_count_for_the_queue(tmp_path: Path) -> None:
    """By Dagster's own counter: one run of the queue at a time, and none of another's blocks it."""
    from dagster._utils.tags import TagConcurrencyLimitsCounter

    script = (Path(__file__).parents[2] / "setup" / "make_environment.sh").read_text()
    settings = yaml.safe_load(script.partition("<<'YAML'\n")[2].partition("\nYAML")[0])
    (tmp_path / "dagster.yaml").write_text(yaml.safe_dump(settings))
    with dg.DagsterInstance.from_config(str(tmp_path)) as instance:
        queue = instance.get_concurrency_config().run_queue_config
        assert queue is not None
        own = create_run_for_test(instance, tags=process_tags())
        queued = [
            create_run_for_test(instance, tags={"dagster/code_location": "tsuya"}) for _ in range(2)
        ]
        assert queue.max_concurrent_runs == -1
        counter = TagConcurrencyLimitsCounter(queue.tag_concurrency_limits, [own])
        assert not counter.is_blocked(queued[0])
        counter.update_counters_with_launched_item(queued[0])
        assert counter.is_blocked(queued[1])
