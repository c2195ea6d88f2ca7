"""One kind of asset check: a figure, its bound, and its change since the last good version.

A check that fails, or that cannot be computed, rejects the version: the last good one is current
afterwards. One that passes counts towards the promotion of a new version.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from storage.stored_version import StoredVersion


@dataclass(frozen=True)
class Check:
    """A figure with bounds. It may be None where it does not apply; then the check passes."""

    name: str
    description: str
    figure: Callable[[StoredVersion], float | None]
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


def figure_before(version: StoredVersion, check: str) -> float | None:
    """The check's figure in the last good version of equal settings, if there is one."""
    store, slot = version.store, version.slot
    pointer = store.pointer(slot)
    lineage = version.record["lineage"]
    for name in (pointer.version, *pointer.earlier):
        if name in (None, version.version):
            continue
        if store.record(slot, name)["lineage"] == lineage:
            verdict = store.verdicts(slot, name).get(check)
            if verdict and verdict["figure"] is not None:
                return float(verdict["figure"])
    return None
