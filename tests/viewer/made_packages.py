"""Packages of a house's graph as files, and how pictures of them differ."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from assets_defs.launcher import Request
from assets_defs.system import System
from tsuya.packages import package_asset


def made_package(house: Any, system: System, keys: dict[str, str], path: Path) -> Path:
    """Make a system's graph at preset `test` and write its package to a path, which is returned."""
    house.launcher.launch(Request(system, [keys], preset="test"))
    dataset = house.workspace.store.open(system.slot(package_asset(system.name), keys))
    path.write_bytes(dataset["file"].values.tobytes())
    return path


def mean_difference(one: Any, other: Any) -> float:
    """Of two pictures, in 8-bit codes."""
    return float(np.abs(one.astype(np.float64) - other).mean())
