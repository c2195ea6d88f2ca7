"""A launcher on a store of the benchmark's own, and how long things take."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import dagster as dg
from rich.console import Console

from assets_defs.definitions import build_definitions
from assets_defs.launcher import Launcher
from assets_defs.workspace import Workspace

_console = Console(stderr=True)


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Say how long a part of the benchmark took."""
    started = time.perf_counter()
    yield
    _console.print(f"{what}: {time.perf_counter() - started:.0f} s", highlight=False)


@contextmanager
def opened_launcher(root: Path) -> Iterator[Launcher]:
    """A launcher on a store of its own; what is current there is skipped."""
    workspace = Workspace(root)

    def heard(what: str, fraction: float) -> None:
        if fraction == 0.0:
            _console.print(f"  {what}", markup=False, highlight=False)

    definitions = build_definitions(workspace, {"progress": heard})
    with dg.DagsterInstance.ephemeral() as instance:
        job = definitions.get_repository_def().get_job
        yield Launcher(instance, workspace, job, heard)
