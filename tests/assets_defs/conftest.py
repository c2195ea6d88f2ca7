"""A workspace, a Dagster instance and a launcher that belong to one test module."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dagster as dg
import pytest

from assets_defs.definitions import build_definitions
from assets_defs.launcher import Launcher
from assets_defs.workspace import Workspace

NO_LOGS = {
    "module": "dagster._core.storage.noop_compute_log_manager",
    "class": "NoOpComputeLogManager",
}
"""Capturing the output of a step starts four processes, and nothing here reads it."""


@dataclass
class House:
    """Everything that a test launches with."""

    workspace: Workspace
    instance: dg.DagsterInstance
    definitions: dg.Definitions
    launcher: Launcher
    heard: list[tuple[str, float]]


@pytest.fixture(scope="module")
def make_house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], House]]:
    """A function that makes a house with empty store and history."""
    opened: list[Any] = []

    def make() -> House:
        root = tmp_path_factory.mktemp("house")
        home = root / "dagster"
        home.mkdir()
        instance = dg.DagsterInstance.local_temp(
            str(home), overrides={"telemetry": {"enabled": False}, "compute_logs": NO_LOGS}
        )
        opened.append(instance)
        heard: list[tuple[str, float]] = []
        workspace = Workspace(Path(root) / "data")

        def progress(what: str, fraction: float) -> None:
            heard.append((what, fraction))

        definitions = build_definitions(workspace, {"progress": progress})
        job = definitions.get_repository_def().get_job
        return House(
            workspace, instance, definitions, Launcher(instance, workspace, job, progress), heard
        )

    yield make
    for instance in opened:
        instance.dispose()


@pytest.fixture(scope="module")
def house(make_house: Callable[[], House]) -> House:
    """The module's house."""
    return make_house()
