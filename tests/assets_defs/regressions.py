"""Bugs put into the numerics: each must be found by its check and change nothing current."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import dagster as dg
import pytest

from assets_defs.launcher import LaunchError, Request
from assets_defs.system import System


class Regression(NamedTuple):
    """A bug, and the check that must find it."""

    check: str
    home: Any
    name: str
    wrong: Callable[..., Any]
    """Called with the right function and then its arguments."""
    keys: dict[str, str]


def assert_found(
    house: Any, system: System, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Plant the bug, launch, see that its check fails and the last good versions stay; clean up."""
    store = house.workspace.store
    before = {slot: store.pointer(slot) for slot in store.slots()}
    content = {slot: store.record(slot)["content"] for slot in before}
    versions = {slot: set(store.versions(slot)) for slot in before}
    right = getattr(regression.home, regression.name)
    monkeypatch.setattr(
        regression.home,
        regression.name,
        lambda *arguments, **options: regression.wrong(right, *arguments, **options),
    )
    with pytest.raises(LaunchError):
        house.launcher.launch(Request(system, [regression.keys], force=True))
    failed = {
        check
        for slot in before
        for version in set(store.versions(slot)) - versions[slot]
        for check, verdict in store.verdicts(slot, version).items()
        if not verdict["passed"]
    }
    assert regression.check in failed
    checked = {plan.name for plan in system.plans.values() for c in plan.checks if c.name in failed}
    for slot, pointer in before.items():
        store.open(slot).load()
        if slot.asset in checked:
            assert store.pointer(slot).version == pointer.version
            assert store.record(slot)["content"] == content[slot]
    monkeypatch.undo()
    # What lies before the failed asset passed its own checks, wrong as it was: make it again.
    force = any(store.current(slot) != pointer.version for slot, pointer in before.items())
    house.launcher.launch(Request(system, [regression.keys], force=force))


def materialise(
    house: Any, system: System, asset: str, keys: Mapping[str, str], **given: Any
) -> dg.ExecuteInProcessResult:
    """One asset's step and its checks, as the web UI's Materialize button runs them."""
    by = system.plans[asset].by
    return (
        house.definitions.get_repository_def()
        .get_job(system.job_name(by))
        .execute_in_process(
            run_config={
                "ops": {f"{system.name}__{asset}": {"config": given}},
                "loggers": {"console": {"config": {"log_level": "CRITICAL"}}},
            },
            instance=house.instance,
            partition_key="|".join(keys[name] for name in sorted(by)),
            raise_on_error=False,
            asset_selection=[dg.AssetKey([system.name, asset])],
        )
    )


def assert_check_finds(
    house: Any, system: System, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Plant the bug and run the one asset that has the check: what it is made from stays right.

    Its check must fail with its own words, and nothing current may change.
    """
    store = house.workspace.store
    plan = next(
        plan
        for plan in system.plans.values()
        if regression.check in {check.name for check in plan.checks}
    )
    slot = system.slot(plan.name, {name: regression.keys[name] for name in plan.by})
    before = {slot: store.pointer(slot) for slot in store.slots()}
    versions = set(store.versions(slot))
    right = getattr(regression.home, regression.name)
    monkeypatch.setattr(
        regression.home,
        regression.name,
        lambda *arguments, **options: regression.wrong(right, *arguments, **options),
    )
    done = materialise(house, system, plan.name, regression.keys)
    monkeypatch.undo()
    assert not done.success
    made = set(store.versions(slot)) - versions
    assert len(made) == 1, [
        event.step_failure_data.error for event in done.all_events if event.is_step_failure
    ]
    (rejected,) = made
    verdict = store.verdicts(slot, rejected)[regression.check]
    assert not verdict["passed"]
    assert regression.check in verdict["reason"]
    assert {slot: store.pointer(slot) for slot in store.slots()} == before
    store.open(slot).load()
