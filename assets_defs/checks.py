"""One kind of asset check: a figure, its bound, and its change since the last good version.

A check that fails, or that cannot be computed, rejects the version: the last good one is current
afterwards. One that passes counts towards the promotion of a new version.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import dagster as dg

from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Checked:
    """What a figure is computed from: a version and the inputs it was made of."""

    store: VersionedStore
    slot: Slot
    version: str

    @property
    def record(self) -> dict[str, Any]:
        """The version's record."""
        return self.store.record(self.slot, self.version)

    @property
    def dataset(self) -> "xr.Dataset":
        """The version, lazy."""
        return self.store.open(self.slot, self.version)

    def input(self, asset: str) -> "xr.Dataset":
        """The version of an upstream asset that this one was made from, lazy."""
        for entry in self.record["inputs"]:
            if entry["asset"] == asset:
                slot = Slot(self.slot.system, asset, entry["partition"])
                return self.store.open(slot, entry["version"])
        raise KeyError(f"{self.slot} was not made from {asset}.")


@dataclass(frozen=True)
class Check:
    """A figure with bounds. It may be None where it does not apply; then the check passes."""

    name: str
    description: str
    figure: Callable[[Checked], float | None]
    at_most: float | None = None
    at_least: float | None = None
    change: float | None = None
    """Largest step for the worse since the last good version of equal settings."""

    def bounds(self) -> str:
        """The bounds in words."""
        parts = [
            f"{words} {value:g}"
            for words, value in (
                ("at most", self.at_most),
                ("at least", self.at_least),
                ("step for the worse at most", self.change),
            )
            if value is not None
        ]
        return ", ".join(parts)

    def problem(self, figure: float, before: float | None) -> str | None:
        """Why a figure does not pass, in one sentence; None where it does."""
        if not math.isfinite(figure):
            return f"{self.name} is {figure}; expected a finite figure."
        if self.at_most is not None and figure > self.at_most:
            return f"{self.name} is {figure:.6g}; expected at most {self.at_most:g}."
        if self.at_least is not None and figure < self.at_least:
            return f"{self.name} is {figure:.6g}; expected at least {self.at_least:g}."
        if self.change is not None and before is not None:
            worse = 0.0
            if self.at_least is None or self.at_most is not None:
                worse = max(worse, figure - before)
            if self.at_most is None or self.at_least is not None:
                worse = max(worse, before - figure)
            if worse > self.change:
                return (
                    f"{self.name} is {figure:.6g} and was {before:.6g} in the last good version "
                    f"of equal settings; expected a step of at most {self.change:g}."
                )
        return None


def figure_before(checked: Checked, check: str) -> float | None:
    """The check's figure in the last good version of equal settings, if there is one."""
    pointer = checked.store.pointer(checked.slot)
    lineage = checked.record["lineage"]
    for version in (pointer.version, *pointer.earlier):
        if version in (None, checked.version):
            continue
        if checked.store.record(checked.slot, version)["lineage"] == lineage:
            verdict = checked.store.verdicts(checked.slot, version).get(check)
            if verdict and verdict["figure"] is not None:
                return float(verdict["figure"])
    return None


def build_check(
    check: Check,
    asset: dg.AssetsDefinition,
    slot_of: Callable[[Any], Slot],
) -> dg.AssetChecksDefinition:
    """The blocking Dagster check. It is told its partitions: else it would load all of them."""
    # Telling the partitions is a preview of Dagster's: its version is pinned.
    warnings.filterwarnings("ignore", category=dg.PreviewWarning)

    # Dagster looks at the annotations themselves: no postponed ones in this module.
    @dg.asset_check(
        asset=asset,
        name=check.name,
        description=check.description,
        blocking=True,
        partitions_def=asset.partitions_def,
        required_resource_keys={"workspace"},
    )
    def evaluate(context: dg.AssetCheckExecutionContext) -> dg.AssetCheckResult:
        store: VersionedStore = context.resources.workspace.store
        slot = slot_of(context)
        version = store.version_under_check(slot, context.run.run_id)
        checked = Checked(store, slot, version)
        metadata: dict[str, Any] = {"version": version}
        try:
            figure = check.figure(checked)
        except Exception as error:
            store.reject(slot, version, check.name, f"{type(error).__name__}: {error}")
            raise
        before = figure_before(checked, check.name)
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
            store.pass_version(slot, version, check.name, figure)
            description = "does not apply here" if figure is None else None
            return dg.AssetCheckResult(passed=True, metadata=metadata, description=description)
        restored = store.reject(slot, version, check.name, problem)
        metadata["current version now"] = restored or "none"
        return dg.AssetCheckResult(passed=False, metadata=metadata, description=problem)

    return evaluate
