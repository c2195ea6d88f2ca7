"""What the tests of the store share: a store, records, and processes that write."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from storage.versions import Slot, VersionedStore
from storage.zarr_files import content_hash


@pytest.fixture
def store(tmp_path: Path) -> VersionedStore:
    """A store in an empty folder."""
    return VersionedStore(tmp_path / "store")


@pytest.fixture
def slot() -> Slot:
    """A place in the store."""
    return Slot("photo_fur", "fur_photo", "fox")


@pytest.fixture
def make_record() -> Callable[..., dict[str, Any]]:
    """``make_record(*checks, settings={…}, recipe="…")``: what a writer tells of a version."""

    def make(*checks: str, recipe: str = "recipe", **settings: Any) -> dict[str, Any]:
        return {"settings": settings, "recipe": recipe, "checks": list(checks)}

    return make


@pytest.fixture
def fingerprint() -> Callable[[Path], dict[str, str]]:
    """All files below a folder with the hashes of their bytes."""

    def hashes(folder: Path) -> dict[str, str]:
        return {
            str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in folder.rglob("*")
            if path.is_file()
        }

    return hashes


@pytest.fixture
def make_numbered() -> Callable[[int], xr.Dataset]:
    """Datasets as ``numbered`` in ``writer_process.py`` makes them, said in other words."""

    def make(number: int) -> xr.Dataset:
        y, x = np.indices((64, 64))
        field = number + 64 * y + x
        return xr.Dataset(
            {"eager": (("y", "x"), field), "lazy": (("y", "x"), -field), "number": number},
            coords={"y": number * y[:, 0]},
        )

    return make


@pytest.fixture
def number_of(make_numbered: Callable[[int], xr.Dataset]) -> Callable[[xr.Dataset], int]:
    """The number of a dataset of writer_process, having compared every value with it."""

    def number(dataset: xr.Dataset) -> int:
        loaded = dataset.load()
        found = int(loaded["number"])
        xr.testing.assert_equal(loaded, make_numbered(found))
        return found

    return number


@pytest.fixture
def intact_number(
    number_of: Callable[[xr.Dataset], int],
) -> Callable[[VersionedStore, Slot, str], int]:
    """The number of a stored version, having compared data, content hash and settings with it."""

    def number(store: VersionedStore, slot: Slot, version: str) -> int:
        found = number_of(store.open(slot, version))
        record = store.record(slot, version)
        assert record["settings"] == {"number": found}
        assert record["content"] == content_hash(store.folder(slot, version))
        return found

    return number


class Writers:
    """The script ``writer_process.py``, and the jobs it was given."""

    def __init__(self, folder: Path) -> None:
        script = Path(__file__).with_name("writer_process.py")
        root = script.parents[2]
        self._folder = folder
        self._jobs = 0
        # Another hash seed than this process: what depends on the order of a set would differ.
        seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
        self._process = subprocess.Popen(
            [sys.executable, str(script)],
            cwd=root,
            env={**os.environ, "PYTHONPATH": str(root), "PYTHONHASHSEED": seed},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._answer().keys() == {"ready"}

    def start(self, job: str, **arguments: Any) -> Writer:
        """Start a job in a process of its own."""
        self._jobs += 1
        report = self._folder / f"{self._jobs}.jsonl"
        request = {"start": job, "report": str(report), "arguments": arguments}
        return Writer(self, self.ask(request)["pid"], report)

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """The script's answer to one request."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        return dict(json.loads(self._process.stdout.readline()))

    def close(self) -> None:
        """End the script, and with it the jobs that still run."""
        self._process.communicate(timeout=30)


class Writer:
    """One job's process."""

    def __init__(self, writers: Writers, pid: int, report: Path) -> None:
        self._writers = writers
        self._pid = pid
        self._report = report
        self._status: int | None = None

    @property
    def ended(self) -> bool:
        """Whether the process is gone."""
        return self._ask(block=False) is not None

    def kill(self) -> None:
        """kill -9, and wait until the process is gone."""
        if not self.ended:
            # Not reaped yet, so that the number cannot be another process's.
            os.kill(self._pid, signal.SIGKILL)
        self._ask(block=True)

    def wait(self, seconds: float = 30.0) -> int:
        """Wait for the end; the exit status, or minus the signal that ended the process."""
        last = time.monotonic() + seconds
        while not self.ended:
            assert time.monotonic() < last, f"a writer runs for more than {seconds} s"
            time.sleep(0.002)
        assert self._status is not None
        return self._status

    def finish(self) -> list[dict[str, Any]]:
        """Wait for a good end; what the job reported."""
        status = self.wait()
        assert status == 0, f"a writer ended with {status}: {self.reported()[-1:]}"
        return self.reported()

    def reported(self) -> list[dict[str, Any]]:
        """What the job has reported until now."""
        lines = self._report.read_text().splitlines() if self._report.exists() else []
        return [json.loads(line) for line in lines]

    def _ask(self, *, block: bool) -> int | None:
        if self._status is None:
            self._status = self._writers.ask({"wait": self._pid, "block": block})["status"]
        return self._status


@pytest.fixture(scope="session")
def writers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Writers]:
    """Starts processes that write: ``writers.start("write_many", …).finish()``."""
    started = Writers(tmp_path_factory.mktemp("reports"))
    yield started
    started.close()
