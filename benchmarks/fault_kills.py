"""Processes killed at random moments: writers, whole commands, runs of the daemon."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import dagster as dg
import numpy as np

from assets_defs.ended_runs import end_dead_runs
from storage import zarr_files
from storage.errors import NoVersionError
from storage.versions import Slot, VersionedStore
from tsuya.history import open_history

_TSUYA = str(Path(sys.executable).with_name("tsuya"))
_SLOT = Slot("photo_fur", "fur_photo", "killed")
_RUNS = (
    ("photo_fur", "--photo", "grass", "--mesh", "square"),
    ("neural_btf", "--material", "silk", "--clusters", "none"),
    ("ssdf_lighting", "--scene", "teapot", "--environment", "sky"),
    ("glass_scratches", "--setting", "setting-2", "--object", "plate"),
)


def kill_writers(count: int, root: Path, seed: int) -> dict[str, int]:
    """Kill forked writers; a loss is a current version that is not whole, or an older one."""
    store = VersionedStore(root)
    chance = random.Random(seed)
    losses = 0
    newest = _write_next(store, 0)
    for _ in range(count):
        child = os.fork()
        if child == 0:
            number = newest
            while True:
                number = _write_next(store, number)
        time.sleep(chance.uniform(0.01, 0.25))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        found = _sound_number(store)
        losses += found is None or found < newest
        newest = max(newest, found or 0)
    losses += _write_next(store, newest) != newest + 1
    return {"kills": count, "losses": losses}


def _write_next(store: VersionedStore, number: int) -> int:
    import xarray as xr

    field = np.full((96, 96), float(number + 1))
    record = {"settings": {"number": number + 1}, "recipe": "r", "checks": ["sharp"]}
    written = store.write(_SLOT, xr.Dataset({"field": (("y", "x"), field)}), record)
    store.pass_version(_SLOT, written.version, "sharp", 0.0)
    return number + 1


def _sound_number(store: VersionedStore) -> int | None:
    """The number of the current version; None where it is not whole."""
    try:
        folder = store.folder(_SLOT)
        zarr_files.verify(folder)
        field = store.open(_SLOT)["field"].values
    except (zarr_files.StoreError, NoVersionError):
        return None
    number = int(store.record(_SLOT)["settings"]["number"])
    return number if (field == number).all() else None


def kill_commands(count: int, environment: dict[str, str], seed: int) -> dict[str, int]:
    """Kill whole ``tsuya run``s of several systems; a loss is a slot that had a good version.

    A blocked queue is a run that Dagster still takes for one at work after the next command has
    begun.
    """
    store = VersionedStore(Path(environment["TSUYA_DATA"]) / "store")
    chance = random.Random(seed)
    losses = blocked = 0
    for run in _RUNS:
        _finish([_TSUYA, "run", *run, "--preset", "test"], environment)
    for number in range(count):
        before = {slot: store.pointer(slot) for slot in store.slots()}
        command = [_TSUYA, "run", *_RUNS[number % len(_RUNS)], "--preset", "test", "--force"]
        process = _start(command, environment)
        time.sleep(chance.uniform(1.0, 6.0))
        process.kill()
        process.wait()
        losses += _lost(store, before)
        blocked += _at_work() > 0
    return {"kills": count, "losses": losses, "blocked_queues": blocked}


def kill_daemon_runs(count: int, environment: dict[str, str], seed: int) -> dict[str, int]:
    """Kill the processes of runs that Dagster's daemon launched, for photographs in the inbox.

    A blocked queue is a photograph whose run does not start although the one before is dead.
    """
    data = Path(environment["TSUYA_DATA"])
    store = VersionedStore(data / "store")
    chance = random.Random(seed)
    losses = blocked = 0
    known: list[str] = []
    ui = _start([_TSUYA, "ui"], environment)
    try:
        for number in range(count + 1):
            before = {slot: store.pointer(slot) for slot in store.slots()}
            _drop_photograph(data / "inbox" / "photo_fur", number)
            said = _finish([sys.executable, "-c", _WAIT, "120", *known], environment).split()
            if not said:
                blocked += 1
                break
            known.append(said[0])
            if number < count:
                time.sleep(chance.uniform(0.0, 2.0))
                os.kill(int(said[1]), signal.SIGKILL)
                losses += _lost(store, before)
    finally:
        _end_session(ui)
    return {"kills": len(known) - 1, "losses": losses, "blocked_queues": blocked}


def _end_session(process: subprocess.Popen[bytes]) -> None:
    """Ctrl-C, which a terminal sends to all processes of a session; then by force."""
    for number, seconds in ((signal.SIGINT, 30.0), (signal.SIGKILL, 10.0)):
        os.killpg(process.pid, number)
        try:
            process.wait(seconds)
            return
        except subprocess.TimeoutExpired:
            continue


def _drop_photograph(inbox: Path, number: int) -> None:
    from PIL import Image

    noise = np.random.default_rng(number).integers(0, 256, (600, 800, 3), dtype=np.uint8)
    inbox.mkdir(parents=True, exist_ok=True)
    Image.fromarray(noise).save(inbox / f"noise {number}.png")


def _lost(store: VersionedStore, before: dict[Slot, Any]) -> int:
    """How many slots that had a good version have none, or a damaged one."""
    lost = 0
    for slot, pointer in before.items():
        try:
            zarr_files.verify(store.folder(slot))
        except zarr_files.StoreError:
            lost += pointer.version is not None
    return lost


_WAIT = """
import sys, time
import dagster as dg
from assets_defs.ended_runs import PROCESS
from tsuya.history import open_history
known, last = set(sys.argv[2:]), time.monotonic() + float(sys.argv[1])
started = dg.RunsFilter(statuses=[dg.DagsterRunStatus.STARTED])
with open_history() as instance:
    while time.monotonic() < last:
        for record in instance.get_run_records(started):
            run = record.dagster_run
            if run.job_name == "launch" and run.run_id not in known and PROCESS in run.tags:
                print(run.run_id, run.tags[PROCESS].split(" ")[2])
                sys.exit(0)
        time.sleep(0.2)
"""


def _at_work() -> int:
    """Runs that Dagster takes for ones at work, after what every command does first."""
    at_work = [dg.DagsterRunStatus.STARTED, dg.DagsterRunStatus.STARTING]
    with open_history() as instance:
        end_dead_runs(instance)
        return instance.get_runs_count(dg.RunsFilter(statuses=at_work))


def _start(command: list[str], environment: dict[str, str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        command,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def _finish(command: list[str], environment: dict[str, str]) -> str:
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, check=True
    )
    return done.stdout
