"""One drive through the graph in a process of its own: time of each step, peak of memory.

``python -m benchmarks.street_drive FOLDER FRAMES``: the built-in drive of so many frames into the
store in FOLDER, after the smallest preset has compiled what has to be compiled. Prints one JSON
object.
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
from pathlib import Path
from typing import Any

import dagster as dg

from assets_defs.definitions import build_definitions
from assets_defs.launcher import Launcher, Request
from assets_defs.street_billboards.graph import STREET
from assets_defs.workspace import Workspace

KEYS = {"drive": "city"}


def drive(folder: Path, frames: int) -> dict[str, Any]:
    """Make everything of the drive."""
    with tempfile.TemporaryDirectory() as small:
        launch(Path(small), {}, "test")
    seconds = launch(folder, {"frames": frames, "flight_frames": 24}, "paper")
    return {
        "seconds": seconds,
        "peak_rss_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6,
    }


def launch(folder: Path, given: dict[str, Any], preset: str | None) -> dict[str, float]:
    """Seconds of each asset, its checks and what is written included."""

    def silent(what: str, fraction: float) -> None:
        """Nobody watches."""

    workspace = Workspace(folder)
    definitions = build_definitions(workspace, {"progress": silent})
    with dg.DagsterInstance.ephemeral() as instance:
        job = definitions.get_repository_def().get_job
        launcher = Launcher(instance, workspace, job, silent)
        outcomes = launcher.launch(Request(STREET, [KEYS], preset, given))
    return {outcome.slot.asset: round(outcome.seconds, 2) for outcome in outcomes}


if __name__ == "__main__":
    print(json.dumps(drive(Path(sys.argv[1]), int(sys.argv[2]))))
