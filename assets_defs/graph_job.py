"""Jobs that make a system's whole graph of some items, launched from the web UI.

"Materialize all" cannot: the graph's assets have different partitions. Such a job takes the items'
names and lets the launcher run grain by grain, inside one run of the queue; the grains' runs have
tags that lead back to it.
"""

# Dagster looks at the annotations of ops themselves: no postponed ones here.
from collections.abc import Mapping, Sequence
from typing import Any

import dagster as dg
import pydantic
from dagster._core.storage.tags import PARENT_RUN_ID_TAG, ROOT_RUN_ID_TAG

from assets_defs.ended_runs import process_tags, tag_run
from assets_defs.launcher import JobByName, Launcher, LaunchError, Request
from assets_defs.settings import DEFAULT_PRESET, PRESETS
from assets_defs.system import Dimension, System
from storage.errors import StoreError

LAUNCHED_BY = "tsuya/launched_by"


def launch_here(
    context: dg.OpExecutionContext, job: JobByName, requests: Sequence[Request]
) -> None:
    """Launch requests inside a run; one that fails ends none of the others.

    Raises dg.Failure with a sentence for each thing that went wrong. The op needs the resources
    ``workspace`` and ``progress``.
    """
    tag_run(context.instance, context.run)
    resources = context.resources
    launcher = Launcher(
        context.instance,
        resources.workspace,
        job,
        resources.progress,
        tags=_child_tags(context.run),
    )
    failures = []
    for request in requests:
        try:
            outcomes = launcher.launch(request)
        except LaunchError as error:
            failures.append(str(error))
            outcomes = list(error.outcomes)
        except (ValueError, StoreError) as error:
            failures.append(f"{request.system.name}: {error}")
            outcomes = []
        for outcome in outcomes:
            context.log.info(f"{outcome.slot}: {outcome.state}")
    if failures:
        raise dg.Failure("\n".join(failures), allow_retries=False)


def _child_tags(run: dg.DagsterRun) -> dict[str, str]:
    """Tags of the runs that a run launches: its page in the web UI lists them."""
    links = {PARENT_RUN_ID_TAG: run.run_id, ROOT_RUN_ID_TAG: run.root_run_id or run.run_id}
    return process_tags() | links | {LAUNCHED_BY: run.job_name}


def graph_job(system: System, job: JobByName) -> dg.JobDefinition:
    """The job ``<system>_graph``; its launchpad shows a config with the dimensions' defaults."""
    items = _config_class(system)
    name = f"{system.name}_graph"

    def launch(context, config):  # type: ignore[no-untyped-def]
        launch_here(context, job, [_request(system, config)])

    launch.__annotations__ = {"context": dg.OpExecutionContext, "config": items, "return": None}
    op = dg.op(name=f"{name}_launch", required_resource_keys={"workspace", "progress"})(launch)
    shown = {dimension.name: [dimension.default] for dimension in system.dimensions}

    @dg.job(
        name=name,
        description=f"{system.title}: the whole graph of the items that its config names.",
        config={"ops": {f"{name}_launch": {"config": shown | {"force": False}}}},
        executor_def=dg.in_process_executor,
    )
    def graph() -> None:
        op()

    return graph


def _config_class(system: System) -> type[dg.Config]:
    """One list of names a dimension, then how they are made."""
    fields: dict[str, Any] = {
        dimension.name: (
            list[str],
            pydantic.Field(default=[dimension.default], description=_what_may_be_named(dimension)),
        )
        for dimension in system.dimensions
    }
    fields["preset"] = (
        str | None,
        pydantic.Field(
            default=None,
            description=f"Sizes: {', '.join(PRESETS)}; left out: as before, at first "
            f"{DEFAULT_PRESET}",
        ),
    )
    fields["settings"] = (
        dict[str, Any],
        pydantic.Field(default={}, description="Settings, for every asset that has the field"),
    )
    fields["force"] = (bool, pydantic.Field(default=False, description="Also make what is current"))
    return pydantic.create_model(f"{system.name}_graph_config", __base__=dg.Config, **fields)


def _what_may_be_named(dimension: Dimension) -> str:
    parts = [f"Names of one or more: {', '.join(dimension.builtin)}"]
    if dimension.numbers:
        parts.append("a whole number")
    if dimension.suffixes or dimension.folders:
        parts.append("the partition of a file in the inbox")
    return "; ".join(parts)


def _request(system: System, config: dg.Config) -> Request:
    chosen: Mapping[str, Any] = config.model_dump()
    names = {dimension.name: chosen[dimension.name] for dimension in system.dimensions}
    return Request(
        system,
        system.cross_product(names),
        chosen["preset"],
        chosen["settings"],
        chosen["force"],
    )
