"""How Dagster's assets and blocking checks are made of what systems declare."""

# Dagster looks at the annotations of assets and checks themselves: no postponed ones here.
import functools
import inspect
import math
import traceback
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import dagster as dg

from assets_defs.checks import Check, figure_before
from assets_defs.dagster_metadata import (
    dagster_metadata,
    live_view_metadata,
    picture_metadata,
)
from assets_defs.dagster_settings import config_class
from assets_defs.ended_runs import tag_run
from assets_defs.lineage import lineage
from assets_defs.memory import give_back_freed_memory
from assets_defs.partitions import keys_of_partition
from assets_defs.picture_links import PictureLinks
from assets_defs.provenance import provenance
from assets_defs.system import NOTES, AssetPlan, System
from assets_defs.viewer_files import live_view_address
from assets_defs.workspace import Workspace
from storage.errors import DamagedError, NoVersionError, StoreError
from storage.io_manager import INTERRUPTED, damage_failure
from storage.stored_version import StoredVersion
from storage.versions import VersionedStore
from storage.zarr_files import RECORD

if TYPE_CHECKING:
    import xarray as xr

RETRIES = dg.RetryPolicy(max_retries=2, delay=1)
OWNERS = ("team:tsuya",)
_WRONG_PATHS = (FileNotFoundError, PermissionError, IsADirectoryError, NotADirectoryError)
_StepContext = dg.AssetExecutionContext | dg.AssetCheckExecutionContext


def dynamic_partitions(system: System, dimension: str) -> dg.DynamicPartitionsDefinition:
    """Dagster's partitions of one dimension."""
    return dg.DynamicPartitionsDefinition(name=system.partitions_name(dimension))


@functools.cache
def dagster_assets(system: System) -> tuple[dg.AssetsDefinition, ...]:
    """All assets of a system, in the order of its graph."""
    return tuple(_dagster_asset(system, plan) for plan in system.plans.values())


@functools.cache
def dagster_checks(system: System) -> tuple[dg.AssetChecksDefinition, ...]:
    """All blocking checks of a system."""
    return tuple(
        _dagster_check(system, plan, check, asset)
        for plan, asset in zip(system.plans.values(), dagster_assets(system), strict=True)
        for check in plan.checks
    )


def _partitions(system: System, by: Sequence[str]) -> dg.PartitionsDefinition[str]:
    """Dagster's partitions of a grain."""
    if len(by) == 1:
        return dynamic_partitions(system, by[0])
    return dg.MultiPartitionsDefinition({name: dynamic_partitions(system, name) for name in by})


def _dagster_asset(system: System, plan: AssetPlan) -> dg.AssetsDefinition:
    def compute(context, config, **inputs):  # type: ignore[no-untyped-def]
        return _materialise(system, plan, context, config, inputs)

    compute.__annotations__ = {
        "context": dg.AssetExecutionContext,
        "config": config_class(plan.settings),
    }
    return dg.asset(
        compute,
        key=[system.name, plan.name],
        ins={name: dg.AssetIn(key=[system.name, name]) for name in plan.inputs},
        partitions_def=_partitions(system, plan.by),
        group_name=system.name,
        kinds=set(plan.kinds),
        owners=list(OWNERS),
        description=f"{plan.schema.meaning}\n\n{plan.schema.markdown()}",
        metadata={
            "dagster/column_schema": dg.TableSchema(
                columns=[
                    dg.TableColumn(name, variable.dtype, variable.meaning)
                    for name, variable in plan.schema.variables.items()
                ]
            ),
            "schema number": plan.schema.number,
        },
        code_version=plan.code,
        retry_policy=RETRIES,
        required_resource_keys={"workspace", "progress"},
        io_manager_key="io_manager",
    )


def _materialise(
    system: System,
    plan: AssetPlan,
    context: dg.AssetExecutionContext,
    config: dg.Config,
    inputs: dict[str, "xr.Dataset"],
) -> "dg.Output[xr.Dataset]":
    tag_run(context.instance, context.run)
    keys = keys_of_partition(context.partition_key, plan.by)
    given = {name: value for name, value in config.model_dump().items() if value is not None}
    preset = given.pop("preset", None)
    try:
        workspace: Workspace = context.resources.workspace
        settings = system.resolve(plan.name, keys, workspace.store, preset=preset, given=given)
        source = system.source_of(plan, keys, workspace.inbox(system.name))
        what = f"{plan.name} [{', '.join(keys.values())}]"
        progress = functools.partial(context.resources.progress, what)
        progress(0.0)
        give_back_freed_memory()
        records = {name: data.attrs[RECORD] for name, data in inputs.items()}
        fingerprint = source.fingerprint if source else None
        made_of = provenance(plan, settings, fingerprint, records)
        offered: dict[str, Any] = {
            "settings": settings,
            "source": source,
            "keys": keys,
            "progress": progress,
            "work": workspace.store.work(system.slot(plan.name, keys), made_of["recipe"]),
            **inputs,
        }
        named = inspect.signature(plan.function).parameters
        if "lineage" in named:
            offered["lineage"] = lineage(workspace.store, system.name, records)
        dataset, metadata = plan.function(**{name: offered[name] for name in named})
        notes = list(metadata.get(NOTES, ()))
        pictures = plan.pictures(dataset) if plan.pictures else {}
        links = PictureLinks(workspace, system.slot(plan.name, keys))
        shown = picture_metadata(pictures, links.keep) | dagster_metadata(metadata)
        shown |= live_view_metadata(live_view_address(workspace, links.slot))
    except (KeyboardInterrupt, dg.DagsterExecutionInterruptedError) as stop:
        # Left to itself, Dagster would take the interruption for trouble and try again.
        raise dg.Failure(description=INTERRUPTED, allow_retries=False) from stop
    except DamagedError as error:
        raise damage_failure(workspace.store, error) from error
    except Exception as error:
        if _may_pass(error):
            raise
        raise _final(context, error) from None
    record = made_of | {
        "run": context.run.run_id,
        "checks": [check.name for check in plan.checks],
        NOTES: notes,
    }
    return dg.Output(dataset.assign_attrs({RECORD: record}), metadata=shown)


def _may_pass(error: Exception) -> bool:
    """Whether a second try may work: a drive was away, a disk was full for a moment."""
    return isinstance(error, OSError) and not isinstance(error, _WRONG_PATHS)


def _final(context: _StepContext, error: Exception) -> dg.Failure:
    """A failure that says what is wrong in one sentence; where it was raised is in the log.

    What was given cannot work, or the code is wrong: a second try would not help.
    """
    context.log.debug("".join(traceback.format_exception(error)))
    is_said = isinstance(error, ValueError | StoreError)
    sentence = str(error) if is_said else f"{type(error).__name__}: {error}"
    return dg.Failure(description=sentence, allow_retries=False)


def _dagster_check(
    system: System, plan: AssetPlan, check: Check, asset: dg.AssetsDefinition
) -> dg.AssetChecksDefinition:
    """The blocking check. It is told its partitions: else it would load all of them."""
    # Telling the partitions is a preview of Dagster's: its version is pinned.
    warnings.filterwarnings("ignore", category=dg.PreviewWarning)

    @dg.asset_check(
        asset=asset,
        name=check.name,
        description=check.description,
        blocking=True,
        partitions_def=asset.partitions_def,
        required_resource_keys={"workspace"},
    )
    def evaluate(context: dg.AssetCheckExecutionContext) -> dg.AssetCheckResult:
        tag_run(context.instance, context.run)
        store: VersionedStore = context.resources.workspace.store
        slot = system.slot(plan.name, keys_of_partition(context.partition_key, plan.by))
        try:
            under_check = store.version_under_check(slot, context.run.run_id)
        except NoVersionError as error:
            raise _final(context, error) from None
        return _evaluated(check, StoredVersion(store, slot, under_check))

    return evaluate


def _evaluated(check: Check, version: StoredVersion) -> dg.AssetCheckResult:
    """Compute the figure, note the verdict in the store, say it to Dagster."""
    store, slot = version.store, version.slot
    metadata: dict[str, Any] = {"partition": slot.partition, "version": version.version}
    try:
        figure = check.figure(version)
    except DamagedError as error:
        # No verdict on this version: what was read is not what was checked, or made from.
        raise damage_failure(store, error) from error
    except StoreError as error:
        raise dg.Failure(description=str(error), allow_retries=False) from error
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        store.reject(slot, version.version, check.name, reason)
        raise
    before = figure_before(version, check.name)
    problem = None if figure is None else check.problem(figure, before)
    for name, value in (
        ("figure", figure),
        ("before", before),
        ("at most", check.at_most),
        ("at least", check.at_least),
        ("largest step for the worse", check.change),
    ):
        if value is not None and math.isfinite(value):
            metadata[name] = float(value)
    if problem is None:
        store.pass_version(slot, version.version, check.name, figure)
        description = "does not apply here" if figure is None else None
        return dg.AssetCheckResult(passed=True, metadata=metadata, description=description)
    restored = store.reject(slot, version.version, check.name, problem)
    metadata["current version now"] = restored or "none"
    return dg.AssetCheckResult(passed=False, metadata=metadata, description=problem)
