"""What goes wrong in the worst night: kills, flipped bits, bad files, Ctrl-C.

Everything happens in a workspace of its own that is thrown away. A kill loses something where a
slot that had a good version has none afterwards, or a damaged or an older one; the queue is blocked
where Dagster still waits for a run whose process is gone.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from assets_defs.workspace import CHECKOUT
from benchmarks.bad_inputs import run_bad_inputs
from benchmarks.fault_flips import run_bit_flips
from benchmarks.fault_interrupts import run_interrupts
from benchmarks.fault_kills import kill_commands, kill_daemon_runs, kill_writers

_SEED = 14
_PAIRS = 5
_SCALES = {
    "default": {
        "writers": 160,
        "commands": 40,
        "daemon": 5,
        "flips": 500,
        "again": 12,
        "bad": 20_000,
    },
    "paper": {
        "writers": 2000,
        "commands": 200,
        "daemon": 20,
        "flips": 5000,
        "again": 60,
        "bad": 200_000,
    },
}


def run(scale: str) -> dict[str, Any]:
    """All figures."""
    counts = _SCALES[scale]
    started = time.monotonic()
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        environment = _environment(Path(folder))
        os.environ.update(environment)
        kills = [
            kill_writers(counts["writers"], Path(folder) / "writers", _SEED),
            kill_commands(counts["commands"], environment, _SEED),
            kill_daemon_runs(counts["daemon"], environment, _SEED),
        ]
        for name in ("kills", "losses", "blocked_queues"):
            figures[name] = sum(found.get(name, 0) for found in kills)
        figures["kills_of"] = dict(
            zip(("writers", "commands", "daemon"), (k["kills"] for k in kills), strict=True)
        )
        figures |= _flips(counts["flips"], counts["again"])
        figures |= run_interrupts(environment)
        figures |= _checksum_overhead(Path(folder))
        figures |= run_bad_inputs(counts["bad"], _SEED)
    return figures | {"seed": _SEED, "seconds": round(time.monotonic() - started, 1)}


def _environment(folder: Path) -> dict[str, str]:
    """A Dagster home as set-up writes it, and a data folder."""
    home = folder / "dagster"
    home.mkdir()
    shutil.copy(CHECKOUT / ".dagster" / "dagster.yaml", home)
    return {"DAGSTER_HOME": str(home), "TSUYA_DATA": str(folder / "data")}


def _flips(count: int, again: int) -> dict[str, Any]:
    from tsuya.session import open_session

    with open_session() as session:
        return run_bit_flips(count, again, session, _SEED)


def _checksum_overhead(folder: Path) -> dict[str, float]:
    """Seconds to write (hashed, flushed, published) and read 500 MB over those without checksums.

    The medians of pairs: wall, and of the processor.
    """
    import xarray as xr

    from storage import zarr_files
    from storage.versions import Slot, VersionedStore

    noise = np.random.default_rng(_SEED).integers(0, 256, (500, 1000, 1000), np.uint8)
    dataset = xr.Dataset({"field": (("z", "y", "x"), noise)})
    record = {"settings": {}, "recipe": "r", "checks": []}

    def seconds() -> np.ndarray:
        place = folder / "overhead"
        shutil.rmtree(place, ignore_errors=True)
        os.sync()
        started = time.monotonic(), time.process_time()
        store, slot = VersionedStore(place), Slot("photo_fur", "fur_photo", "large")
        store.write(slot, dataset, record)
        store.open(slot).load()
        return np.subtract((time.monotonic(), time.process_time()), started)

    def without() -> np.ndarray:
        with (
            mock.patch.object(zarr_files, "_append_checksum", return_value=None),
            mock.patch.object(zarr_files, "_with_checksums", _as_it_is),
        ):
            return seconds()

    seconds()
    ratios = np.median([seconds() / without() for _ in range(_PAIRS)], axis=0)
    names = ("checksum_overhead_ratio", "checksum_overhead_cpu_ratio")
    return {name: round(float(ratio), 3) for name, ratio in zip(names, ratios, strict=True)}


def _as_it_is(metadata: dict[str, Any]) -> bytes:
    return json.dumps(metadata, indent=2).encode()
