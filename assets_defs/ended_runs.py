"""Runs whose process died without a word: Dagster's history hears of it.

A killed process leaves its run "started" for ever, and the queue waits for it. So every run has a
tag that names its process: host, boot, id and start time (an id is used again, a start time is
not). Who launches in this process gives runs the tag; a run that the web UI launched gets it from
inside, with its first step. Looked at are runs of this host; a run without a tag that is known to
nobody is given a day.
"""

import json
import socket
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple, Self

import dagster as dg
from dagster._core.storage.dagster_run import RunRecord
from dagster._core.storage.tags import GRPC_INFO_TAG

PROCESS = "tsuya/process"
SERVER_GRACE = timedelta(minutes=1)
"""A run that has no tag yet is given so long to reach its first step."""
UNKNOWN_GRACE = timedelta(days=1)
"""So long a run may be under way of which nothing says who executes it."""
_UNDER_WAY = [
    dg.DagsterRunStatus.NOT_STARTED,
    dg.DagsterRunStatus.STARTING,
    dg.DagsterRunStatus.STARTED,
    dg.DagsterRunStatus.CANCELING,
]
_LOCAL = ("localhost", "127.0.0.1")


class _Process(NamedTuple):
    """A process that no other one is, and the run that it says to execute, `-` for any."""

    host: str
    boot: str
    pid: int
    started: str
    run: str

    @classmethod
    def own(cls, run: str = "-") -> Self:
        """This process."""
        pid = Path("/proc/self").readlink().name
        return cls(socket.gethostname(), _boot(), int(pid), _started(int(pid)) or "", run)

    @classmethod
    def of(cls, tag: str | None) -> Self | None:
        """What a tag names; None where it is none."""
        parts = (tag or "").split(" ")
        if len(parts) != 5 or not parts[2].isdecimal():
            return None
        return cls(parts[0], parts[1], int(parts[2]), parts[3], parts[4])

    @property
    def tag(self) -> str:
        """The tag's text."""
        return " ".join(str(part) for part in self)

    @property
    def is_gone(self) -> bool:
        """Whether it was a process of this host and is none any more."""
        if self.host != socket.gethostname():
            return False
        return self.boot != _boot() or self.started != _started(self.pid)


def process_tags(run: str = "-") -> dict[str, str]:
    """Tags for runs that this process executes; ``run``: the one that they are for, if one."""
    return {PROCESS: _Process.own(run).tag}


_tagged: set[str] = set()


def tag_run(instance: dg.DagsterInstance, run: dg.DagsterRun) -> None:
    """Say in a run's tags that this process executes it; called in each step, written once."""
    if run.run_id in _tagged:
        return
    _tagged.add(run.run_id)
    if run.tags.get(PROCESS) not in (process_tags()[PROCESS], process_tags(run.run_id)[PROCESS]):
        instance.add_run_tags(run.run_id, process_tags(run.run_id))


def end_dead_runs(instance: dg.DagsterInstance) -> list[str]:
    """End every run of this host whose process is gone, with a sentence in its log; their ids."""
    return list(_end(instance))


def _end(instance: dg.DagsterInstance) -> Iterator[str]:
    for record in instance.get_run_records(dg.RunsFilter(statuses=_UNDER_WAY)):
        why = _why_dead(record)
        # Read again: the process may have ended by itself, after the list and before the look.
        run = instance.get_run_by_id(record.dagster_run.run_id) if why else None
        if run is None or run.status not in _UNDER_WAY:
            continue
        sentence = f"{why}: it was killed, or the machine went down. What was made stays."
        if run.status == dg.DagsterRunStatus.CANCELING:
            instance.report_run_canceled(run, sentence)
        else:
            instance.report_run_failed(run, sentence)
        yield run.run_id


def _why_dead(record: RunRecord) -> str | None:
    """Why a run is known to be dead; None where it is not."""
    run = record.dagster_run
    process = _Process.of(run.tags.get(PROCESS))
    queued = run.remote_job_origin is not None
    if process is not None and queued and process.run != run.run_id:
        process = None  # The web UI copies the tags of a run that it executes again.
    if process is not None:
        is_gone = process.is_gone
        return f"Its process {process.pid} on {process.host} has ended" if is_gone else None
    age = datetime.now(UTC) - record.update_timestamp
    if run.status == dg.DagsterRunStatus.NOT_STARTED:
        return None  # It blocks nothing, and Dagster's own monitoring gives it a time.
    if age > SERVER_GRACE and _server_is_gone(run.tags.get(GRPC_INFO_TAG)):
        return "The code server that launched it has ended"
    return "Nothing has been heard of its process for a day" if age > UNKNOWN_GRACE else None


def _server_is_gone(info: str | None) -> bool:
    """Whether nobody answers where a run's code server was, on this host."""
    address = json.loads(info) if info else {}
    if address.get("host") not in _LOCAL:
        return False
    is_file = bool(address.get("socket"))
    with socket.socket(socket.AF_UNIX if is_file else socket.AF_INET) as caller:
        caller.settimeout(1.0)
        try:
            caller.connect(address["socket"] if is_file else (_LOCAL[1], address["port"]))
        except (FileNotFoundError, ConnectionRefusedError):
            return True
        except OSError:
            return False
    return False


def _boot() -> str:
    """What this boot of the machine is called."""
    return Path("/proc/sys/kernel/random/boot_id").read_text().strip()


def _started(pid: int) -> str | None:
    """When a process started, in ticks since the boot; None where there is none, or a dead one."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return None
    # The name, in brackets, may hold anything; after it come the state and, 19 further, the time.
    state, *others = stat.rpartition(")")[2].split()
    return None if state in "ZX" else others[18]


def ended_runs_sensor() -> dg.SensorDefinition:
    """The sensor that ends dead runs, twice a minute."""

    @dg.sensor(
        name="ended_runs",
        minimum_interval_seconds=30,
        default_status=dg.DefaultSensorStatus.RUNNING,
        description="Ends runs whose process was killed, so that nothing waits for them.",
    )
    def look(context: dg.SensorEvaluationContext) -> dg.SkipReason:
        ended = end_dead_runs(context.instance)
        return dg.SkipReason(f"Ended: {', '.join(ended)}." if ended else "No run is dead.")

    return look
