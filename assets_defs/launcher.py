"""The launcher: runs a system's graph grain by grain and skips what is current.

One job cannot hold assets of different partitions, so a graph is several runs: one for every
partition of every grain, in the order of the graph. The command line, the demo, the schedule and
the inbox all launch here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import dagster as dg

from assets_defs.partitions import partition_key
from assets_defs.provenance import provenance
from assets_defs.settings import Settings, resolve
from assets_defs.sources import Source
from assets_defs.system import AssetPlan, System
from assets_defs.workspace import Workspace
from storage.errors import DamagedError
from storage.io_manager import DAMAGED, INTERRUPTED
from storage.versions import Slot

_QUIET = {"console": {"config": {"log_level": "CRITICAL"}}}
"""The instance keeps every event; a terminal shows the progress and the outcome."""

_MOST_DAMAGED = 20
"""So often a launch starts again because it met damaged versions."""

JobByName = Callable[[str], dg.JobDefinition]
LaunchProgress = Callable[[str, float], None]
"""Told what is being done, a system or an asset with its partition, and the fraction done."""


class LaunchError(Exception):
    """Runs failed; the text has one sentence for each that says where and why."""

    def __init__(self, failures: Sequence[str], outcomes: Sequence[Outcome]) -> None:
        super().__init__("\n".join(failures))
        self.outcomes = tuple(outcomes)
        """What was made all the same, and what was current."""


@dataclass(frozen=True)
class Request:
    """What is asked for: partitions of a system, and how they are made."""

    system: System
    partitions: Sequence[Mapping[str, str]]
    """Keys by dimension, ``{"photo": …, "mesh": …}``. All grains that lie within these
    dimensions are run; one that lacks a dimension leaves out the grains that need it."""
    preset: str | None = None
    given: Mapping[str, Any] = field(default_factory=dict)
    """Settings by field; each goes to every asset that has the field."""
    force: bool = False
    """Also run what is current."""


@dataclass(frozen=True)
class Outcome:
    """What became of one asset's partition."""

    slot: Slot
    state: Literal["made", "current"]
    seconds: float
    """Time of its steps: the asset's own and its checks'."""


class _RunError(Exception):
    """One run failed; the text says why."""


class _DamageMetError(Exception):
    """A run read damaged bytes. They are out of use now: what they were is to be made again."""


@dataclass(frozen=True)
class Launcher:
    """Launches requests on one Dagster instance and one store."""

    instance: dg.DagsterInstance
    workspace: Workspace
    job: JobByName
    progress: LaunchProgress
    tags: Mapping[str, str] = field(default_factory=dict)
    """Of every run: who executes it, what launched it."""

    def launch(
        self,
        request: Request,
        show: Callable[[Sequence[Outcome]], None] = lambda outcomes: None,
    ) -> list[Outcome]:
        """Run what is not current. Raises SettingsError, ValueError before any work; LaunchError.

        An interruption (Ctrl-C) ends the run at work and the launch: KeyboardInterrupt.
        Every source is read and every setting is checked before the first run starts. Where a run
        fails, what is made from it is left out, and the rest goes on. What turns out to be damaged
        in the store is made again. ``show`` is told what there is of each partition of a grain as
        soon as it is there.
        """
        for _ in range(_MOST_DAMAGED):
            try:
                return self._launch(request, show)
            except DamagedError as damage:
                self.workspace.store.discard(damage)
            except _DamageMetError:
                continue
        raise LaunchError(
            [
                f"{request.system.name}: {_MOST_DAMAGED} damaged versions were met; expected few. "
                "`tsuya verify` lists them: look at the disk."
            ],
            [],
        )

    def _launch(self, request: Request, show: Callable[[Sequence[Outcome]], None]) -> list[Outcome]:
        planned = self._plan(request)
        for dimension in request.system.dimensions:
            name = request.system.partitions_name(dimension.name)
            self.instance.add_dynamic_partitions(name, _keys(request, dimension.name))
        outcomes: list[Outcome] = []
        failures: list[str] = []
        failed: list[dict[str, str]] = []
        for done, (by, keys) in enumerate(planned):
            self.progress(request.system.name, done / len(planned))
            if any(broken.items() <= keys.items() for broken in failed):
                continue
            try:
                found = self._run_grain(request, by, keys)
            except _RunError as error:
                failures.append(f"{request.system.name} [{', '.join(keys.values())}]: {error}")
                failed.append(keys)
                continue
            outcomes += found
            show(found)
        self.progress(request.system.name, 1.0)
        if failures:
            raise LaunchError(failures, outcomes)
        return outcomes

    def _plan(self, request: Request) -> list[tuple[tuple[str, ...], dict[str, str]]]:
        system = request.system
        inbox = self.workspace.inbox(system.name)
        for dimension in system.dimensions:
            for key in _keys(request, dimension.name):
                system.source(dimension.name, key, inbox)
        check_settings(system, request.preset, request.given)
        planned = [
            (by, keys) for by in system.grains() for keys in _projections(request.partitions, by)
        ]
        for by, keys in planned:
            for plan in self._grain_plans(system, by):
                settings = self._settings(request, plan, keys)
                source = system.source_of(plan, keys, inbox)
                if source is not None:
                    system.dimension(*by).check(source, settings.model_dump())
        for asked in request.partitions:
            sources = {name: system.source(name, key, inbox) for name, key in asked.items()}
            chosen = {
                plan.name: self._settings(request, plan, {d: asked[d] for d in plan.by})
                for plan in system.plans.values()
                if set(plan.by) <= set(asked)
            }
            for ask in system.asked_before_work:
                ask(sources, chosen)
        return planned

    def _run_grain(
        self, request: Request, by: tuple[str, ...], keys: Mapping[str, str]
    ) -> list[Outcome]:
        system = request.system
        stale: dict[str, Settings] = {}
        outcomes = []
        for plan in self._grain_plans(system, by):
            settings = self._settings(request, plan, keys)
            if request.force or not self._is_current(system, plan, keys, settings, stale):
                stale[plan.name] = settings
            else:
                outcomes.append(Outcome(system.slot(plan.name, keys), "current", 0.0))
        if stale:
            seconds = self._run(request, by, keys, stale)
            outcomes += [
                Outcome(system.slot(name, keys), "made", seconds.get(name, 0.0)) for name in stale
            ]
        return outcomes

    def _run(
        self,
        request: Request,
        by: tuple[str, ...],
        keys: Mapping[str, str],
        stale: Mapping[str, Settings],
    ) -> dict[str, float]:
        """Execute one named job on one partition; seconds by asset."""
        system = request.system
        preset = {"preset": request.preset} if request.preset else {}
        ops = {
            f"{system.name}__{name}": {"config": preset | _given(settings)}
            for name, settings in stale.items()
        }
        result = self.job(system.job_name(by)).execute_in_process(
            run_config={"ops": ops, "loggers": _QUIET},
            instance=self.instance,
            partition_key=partition_key(keys),
            tags=dict(self.tags),
            raise_on_error=False,
            asset_selection=[dg.AssetKey([system.name, name]) for name in stale],
        )
        if not result.success:
            if _met_damage(result):
                raise _DamageMetError
            why = _why(result)
            if why == INTERRUPTED:
                raise KeyboardInterrupt
            raise _RunError(why)
        seconds: dict[str, float] = {}
        for event in result.all_events:
            if event.is_step_success:
                name = event.node_name.removeprefix(f"{system.name}__")
                asset = next(
                    a
                    for a in sorted(stale, key=len, reverse=True)
                    if name == a or name.startswith(f"{a}_")
                )
                spent = event.step_success_data.duration_ms / 1000
                seconds[asset] = seconds.get(asset, 0.0) + spent
        return seconds

    def _grain_plans(self, system: System, by: tuple[str, ...]) -> list[AssetPlan]:
        return [plan for plan in system.plans.values() if plan.by == by]

    def _settings(self, request: Request, plan: AssetPlan, keys: Mapping[str, str]) -> Settings:
        given = _for_plan(plan, request.given)
        return request.system.resolve(
            plan.name, keys, self.workspace.store, preset=request.preset, given=given
        )

    def _is_current(
        self,
        system: System,
        plan: AssetPlan,
        keys: Mapping[str, str],
        settings: Settings,
        stale: Mapping[str, Settings],
    ) -> bool:
        """Whether the current version has the recipe that a run now would have."""
        pointer = self.workspace.store.pointer(system.slot(plan.name, keys))
        if pointer.version is None or any(name in stale for name in plan.inputs):
            return False
        records = {}
        for name in plan.inputs:
            by = system.plans[name].by
            slot = system.slot(name, {dimension: keys[dimension] for dimension in by})
            if self.workspace.store.pointer(slot).version is None:
                return False
            records[name] = self.workspace.store.record(slot)
        source = system.source_of(plan, keys, self.workspace.inbox(system.name))
        now = provenance(plan, settings, source.fingerprint if source else None, records)
        return bool(now["recipe"] == pointer.recipe)


def check_settings(system: System, preset: str | None, given: Mapping[str, Any]) -> None:
    """Raise ValueError unless every field exists and every value may be, for the default items."""
    fields = {name for plan in system.plans.values() for name in plan.settings.model_fields}
    for name in given:
        if name not in fields:
            raise ValueError(
                f"setting {name!r} is not known; expected one of {', '.join(sorted(fields))}."
            )
    defaults = {dimension.name: dimension.default for dimension in system.dimensions}
    for plan in system.plans.values():
        chosen = _for_plan(plan, given)
        resolve(plan.settings, plan.name, defaults, preset=preset, given=chosen, current=None)


def ask_before_work(
    system: System, sources: Mapping[str, Source], preset: str | None, given: Mapping[str, Any]
) -> None:
    """Raise ValueError where items, by dimension, of which one is new cannot go together."""
    chosen = {
        plan.name: resolve(
            plan.settings,
            plan.name,
            {name: sources[name].key for name in plan.by},
            preset=preset,
            given=_for_plan(plan, given),
            current=None,
        )
        for plan in system.plans.values()
    }
    for ask in system.asked_before_work:
        ask(sources, chosen)


def _for_plan(plan: AssetPlan, given: Mapping[str, Any]) -> dict[str, Any]:
    """The settings that an asset has a field for."""
    return {name: value for name, value in given.items() if name in plan.settings.model_fields}


def _keys(request: Request, dimension: str) -> list[str]:
    """The different keys that a request has in one dimension."""
    return [keys[dimension] for keys in _projections(request.partitions, (dimension,))]


def _projections(
    partitions: Sequence[Mapping[str, str]], by: Sequence[str]
) -> list[dict[str, str]]:
    """The different partitions of a grain that the asked ones lie in."""
    found = [{name: keys[name] for name in by} for keys in partitions if set(by) <= set(keys)]
    return list({partition_key(keys): keys for keys in found}.values())


def _given(settings: Settings) -> dict[str, Any]:
    return {
        name: value for name, value in settings.model_dump(mode="json").items() if value is not None
    }


def _met_damage(result: dg.ExecuteInProcessResult) -> bool:
    """Whether a step failed because of damaged bytes in the store."""
    failures = (event.step_failure_data for event in result.all_events if event.is_step_failure)
    said = (failure.user_failure_data for failure in failures)
    return any(DAMAGED in data.metadata for data in said if data is not None)


def _why(result: dg.ExecuteInProcessResult) -> str:
    """The first failure's own sentence."""
    for event in result.all_events:
        if event.is_step_failure:
            data = event.step_failure_data
            if data.user_failure_data and data.user_failure_data.description:
                return str(data.user_failure_data.description)
    for evaluation in result.get_asset_check_evaluations():
        if not evaluation.passed:
            return f"{evaluation.asset_key.path[-1]}: {evaluation.description}"
    for event in result.all_events:
        if event.is_step_failure and event.step_failure_data.error:
            error = event.step_failure_data.error
            while error.cause is not None:
                error = error.cause
            _, _, sentence = error.message.strip().partition(f"{error.cls_name}: ")
            return sentence or error.message.strip()
    return "the run failed; its log in the web UI says why."
