"""Processes that write to a store, started in a moment and killed at will.

A script for the fixture ``writers`` in ``conftest.py``. Importing xarray, zarr and dask takes
seconds, a fork milliseconds: the script imports once, then forks one child a job. It stays
single-threaded (it never touches a store itself), which is what makes forking safe.

It says ``{"ready": …}``, then reads one JSON object a line from stdin and answers each on stdout:

    {"start": JOB, "report": FILE, "arguments": {...}}    -> {"pid": 123}
    {"wait": 123, "block": true}                          -> {"status": 0} or -9, or null: runs on

A job appends one JSON value a line to its report file; what went wrong is the last of them.
"""

from __future__ import annotations

import functools
import importlib
import json
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import dask
import dask.array as da
import numpy as np
import xarray as xr
import zarr.storage  # noqa: F401  (imported here so that children need not)

from storage import zarr_files
from storage.versions import Slot, VersionedStore

SIDE = 64
Report = Callable[[Any], None]


def numbered(number: int) -> xr.Dataset:
    """A dataset, eager and lazy in parts, every value of which tells its number."""
    field = number + np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    return xr.Dataset(
        {
            "eager": (("y", "x"), field),
            "lazy": (("y", "x"), da.from_array(-field, chunks=(8, SIDE))),
            "number": ((), number),
        },
        coords={"y": np.arange(SIDE) * number},
    )


def small_chunks() -> None:
    """Many chunk files in little data: many places to be killed at."""
    zarr_files.CHUNK_TARGET_BYTES = 4096
    zarr_files.CHUNK_LEAST_BYTES = 1024


def write_many(
    report: Report,
    *,
    root: str,
    slot: list[str],
    first: int,
    count: int,
    checks: list[str],
    store: dict[str, Any],
) -> None:
    """Write datasets ``first``, ``first + 1``, … and pass their checks."""
    small_chunks()
    versions = VersionedStore(root, **store)
    place = Slot(*slot)
    for number in range(first, first + count):
        report({"begin": number, "time": time.monotonic()})
        record = {"settings": {"number": number}, "recipe": f"r{number}", "checks": checks}
        written = versions.write(place, numbered(number), record)
        for check in checks:
            versions.pass_version(place, written.version, check, 1.0)
        report({"done": number, "version": written.version, "time": time.monotonic()})


def write_and_die(
    report: Report,
    *,
    root: str,
    target: str,
    holding: str,
    call: int,
    when: str,
    **arguments: Any,
) -> None:
    """Write (see write_many), but be killed in the ``call``-th call of a function.

    ``target`` is ``module:name``; only calls with ``holding`` in an argument count (the root's
    own path apart). ``when`` is ``enter``, ``leave``, or ``half``: having written half of what
    ``sealed_json.dump`` would write.
    """
    _die_in(root, target, holding, call, when)
    write_many(report, root=root, **arguments)


def reject_and_die(
    report: Report,
    *,
    target: str,
    holding: str,
    call: int,
    when: str,
    root: str,
    slot: list[str],
    version: str,
) -> None:
    """Reject a version, but be killed in a function (see write_and_die)."""
    _die_in(root, target, holding, call, when)
    VersionedStore(root).reject(Slot(*slot), version, "sharp", "seen to be blurred")


def stream(report: Report, *, root: str, slot: list[str], blocks: int, lazy: bool) -> None:
    """Write blocks of 4 MiB that never are in memory together (unless not lazy).

    Reports the bytes of the dataset and by how many the peak of resident memory rose.
    """
    block = (2**20 // SIDE, SIDE)

    def computed(block_id: tuple[int, int]) -> Any:
        rows = np.arange(block[0], dtype=np.float32) + block_id[0]
        return np.repeat(rows[:, None], block[1], axis=1)

    field = da.map_blocks(
        computed,
        chunks=((block[0],) * blocks, (block[1],)),
        dtype=np.float32,
        meta=np.empty((0, 0), np.float32),
    )
    dataset = xr.Dataset({"field": (("y", "x"), field)})
    record = {"settings": {}, "recipe": "r", "checks": []}
    versions = VersionedStore(root)
    # The first write also pays for threads and buffers; they are not the dataset's.
    with dask.config.set(num_workers=2):
        versions.write(Slot(*slot), dataset.isel(y=slice(0, 4 * block[0])), record)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        versions.write(Slot(*slot), dataset if lazy else dataset.load(), record)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    report({"dataset": dataset.nbytes, "rise": (after - before) * 1024})


def hash_of(report: Report, *, folder: str) -> None:
    """Write a dataset with many names and report its content hash."""
    names = [f"name_{number}" for number in range(12)]
    dataset = xr.Dataset(
        {"field": ("x", np.arange(4.0), dict.fromkeys(names, 1))},
        coords={name: ("x", np.arange(4)) for name in names},
        attrs=dict.fromkeys(names, "text"),
    )
    zarr_files.write_dataset(dataset, Path(folder), {})
    report({"hash": zarr_files.content_hash(Path(folder))})


JOBS: dict[str, Callable[..., None]] = {
    job.__name__: job for job in (write_many, write_and_die, reject_and_die, stream, hash_of)
}


def _die_in(root: str, target: str, holding: str, call: int, when: str) -> None:
    module, _, path = target.partition(":")
    owner: Any = importlib.import_module(module)
    *outer, name = path.split(".")
    for part in outer:
        owner = getattr(owner, part)
    function = getattr(owner, name)
    calls = 0

    @functools.wraps(function)
    def wrapped(*arguments: Any, **keywords: Any) -> Any:
        nonlocal calls
        calls += any(holding in str(argument).replace(root, "") for argument in arguments)
        if calls < call:
            return function(*arguments, **keywords)
        if when == "half":
            text = json.dumps(arguments[0])
            arguments[1].write(text[: len(text) // 2].encode())
            arguments[1].flush()
        if when == "leave":
            function(*arguments, **keywords)
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError("a killed process goes on")

    setattr(owner, name, wrapped)


def _run(job: str, report_file: str, arguments: dict[str, Any]) -> int:
    # O_APPEND and no buffer: a line is in the file, or it is not, whenever the process is killed.
    descriptor = os.open(report_file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def report(value: Any) -> None:
        os.write(descriptor, (json.dumps(value) + "\n").encode())

    try:
        JOBS[job](report, **arguments)
    except BaseException:
        report({"error": traceback.format_exc()})
        return 1
    return 0


def _serve() -> None:
    print(json.dumps({"ready": os.getpid()}), flush=True)
    running: set[int] = set()
    for line in iter(sys.stdin.readline, ""):
        request = json.loads(line)
        answer: dict[str, int | None]
        if "start" in request:
            pid = os.fork()
            if pid == 0:
                os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
                os.dup2(2, 1)
                os._exit(_run(request["start"], request["report"], request["arguments"]))
            running.add(pid)
            answer = {"pid": pid}
        else:
            pid, status = os.waitpid(request["wait"], 0 if request["block"] else os.WNOHANG)
            running.discard(pid)
            answer = {"status": os.waitstatus_to_exitcode(status) if pid else None}
        print(json.dumps(answer), flush=True)
    for pid in running:
        os.kill(pid, signal.SIGKILL)


if __name__ == "__main__":
    _serve()
