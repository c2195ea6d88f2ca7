"""Everything that Dagster sees, built by one function."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import dagster as dg

from assets_defs.dagster_assets import dagster_assets, dagster_checks
from assets_defs.ended_runs import ended_runs_sensor
from assets_defs.failure_reports import failure_sensor
from assets_defs.graph_job import graph_job
from assets_defs.inbox import inbox_sensor
from assets_defs.launcher import JobByName
from assets_defs.rematerialisation import daily_schedule, launch_job
from assets_defs.retention import retention_sensor
from assets_defs.system import System
from assets_defs.systems import SYSTEMS
from assets_defs.workspace import Workspace
from storage.io_manager import ZarrIOManager


def build_definitions(
    workspace: Workspace | None = None, resources: Mapping[str, Any] | None = None
) -> dg.Definitions:
    """All systems' assets, checks, jobs, schedule and sensors.

    ``workspace`` is where data lie, by default the environment's; ``resources`` replace those of
    the same names.
    """
    place = workspace or Workspace.from_environment()
    provided: dict[str, Any] = {
        "workspace": place,
        "io_manager": ZarrIOManager(place.store),
        "progress": _silent,
        **(resources or {}),
    }
    systems = SYSTEMS.values()
    jobs = [_grain_job(system, by) for system in systems for by in system.grains()]
    # The sensor's own owners are a beta of Dagster's that nothing here uses.
    warnings.filterwarnings("ignore", category=dg.BetaWarning)
    find: JobByName = lambda name: definitions.get_repository_def().get_job(name)  # noqa: E731
    launch = launch_job(SYSTEMS, find)
    jobs += [graph_job(system, find) for system in systems]
    keys = [dg.AssetKey([system.name, name]) for system in systems for name in system.plans]
    definitions = dg.Definitions(
        assets=[asset for system in systems for asset in dagster_assets(system)],
        asset_checks=[check for system in systems for check in dagster_checks(system)],
        jobs=[*jobs, launch],
        schedules=[daily_schedule(launch)],
        sensors=[
            inbox_sensor(launch, SYSTEMS, place),
            ended_runs_sensor(),
            failure_sensor(place, SYSTEMS),
            retention_sensor(place, keys),
        ],
        resources=provided,
        executor=dg.in_process_executor,
    )
    return definitions


def _grain_job(system: System, by: tuple[str, ...]) -> Any:
    names = [plan.name for plan in system.plans.values() if plan.by == by]
    return dg.define_asset_job(
        system.job_name(by),
        selection=dg.AssetSelection.assets(*([system.name, name] for name in names)),
        description=f"{system.title}: {', '.join(names)} of one {' x '.join(by)}.",
    )


def _silent(what: str, fraction: float) -> None:
    """The web UI has its own display of a run's progress."""
