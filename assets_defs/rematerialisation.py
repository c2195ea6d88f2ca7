"""The job that launches whole graphs, and the schedule that does so every day.

A tick cannot order grains, so it requests one run of the job `launch`, which calls the launcher;
the grain runs execute in that process, on the same instance.
"""

from collections.abc import Mapping

import dagster as dg
from pydantic import Field

from assets_defs.graph_job import launch_here
from assets_defs.launcher import JobByName, Request
from assets_defs.system import System


class LaunchConfig(dg.Config):
    """What to launch."""

    system: str = Field(description="Name of the system; empty: all of them")
    partitions: list[dict[str, str]] = Field(
        default=[], description="Keys by dimension; empty: everything that was ever made"
    )
    force: bool = Field(default=False, description="Also run what is current")


def launch_job(systems: Mapping[str, System], job: JobByName) -> dg.JobDefinition:
    """The job `launch`: one op that runs graphs grain by grain, by the jobs that ``job`` finds."""

    @dg.op(required_resource_keys={"workspace", "progress"})
    def launch_graph(context: dg.OpExecutionContext, config: LaunchConfig) -> None:
        workspace = context.resources.workspace
        chosen = [systems[config.system]] if config.system else list(systems.values())
        requests = [
            Request(
                system,
                config.partitions or system.stored_partitions(workspace),
                force=config.force,
            )
            for system in chosen
        ]
        launch_here(context, job, requests)

    @dg.job(
        name="launch",
        description="Runs a system's graph grain by grain; what is current is skipped.",
        executor_def=dg.in_process_executor,
    )
    def launch() -> None:
        launch_graph()

    return launch


def daily_schedule(job: dg.JobDefinition) -> dg.ScheduleDefinition:
    """Every night, everything that was ever made is made again with its own settings.

    Forced: it recomputes and re-runs the checks, so a regression shows in the morning.
    """
    return dg.ScheduleDefinition(
        name="daily_rematerialisation",
        job=job,
        cron_schedule="0 3 * * *",
        run_config=dg.RunConfig(ops={"launch_graph": LaunchConfig(system="", force=True)}),
        default_status=dg.DefaultScheduleStatus.RUNNING,
        description="Makes everything again that was ever made, and re-runs its checks.",
    )
