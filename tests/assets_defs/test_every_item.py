"""Every built-in item, in every combination, passes its checks at preset test."""

from __future__ import annotations

from typing import Any

import pytest

from assets_defs.launcher import Request
from assets_defs.system import System
from assets_defs.systems import SYSTEMS

MORE_THAN_TEXELS = ("500", "1000", "2000")
"""Clusters: at preset test a BTF has 144 texels, and more clusters are refused before any work."""


@pytest.mark.slow
@pytest.mark.parametrize("system", SYSTEMS.values(), ids=lambda system: system.name)
def test_every_builtin_item_passes_at_preset_test(house: Any, system: System) -> None:
    items = {
        dimension.name: [key for key in dimension.builtin if key not in MORE_THAN_TEXELS]
        for dimension in system.dimensions
    }
    wanted = system.cross_product(items)
    outcomes = house.launcher.launch(Request(system, wanted, "test"))
    store = house.workspace.store
    made = {outcome.slot for outcome in outcomes}
    for plan in system.plans.values():
        for keys in wanted:
            slot = system.slot(plan.name, {name: keys[name] for name in plan.by})
            assert slot in made
            verdicts = store.verdicts(slot, store.current(slot))
            assert {check.name for check in plan.checks} <= set(verdicts)
