"""Tests of one system run in one process: what it compiles, it compiles once."""

from __future__ import annotations

import pytest

from storage.schemas import systems

_INSTRUMENTS = {
    "virtual/cloth": "neural_btf",
    "virtual/pelt": "photo_fur",
    "virtual/city": "street_billboards",
}
"""Which system's kernels a virtual instrument's tests compile, too."""


@pytest.hookimpl(tryfirst=True)  # xdist looks at the groups in this hook, too
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group a system's tests together, the others by their file (for ``--dist loadgroup``)."""
    owners = {system: system for system in systems()} | _INSTRUMENTS
    for item in items:
        path = str(item.path)
        place = path + item.name  # a case may name its system, too
        name = next((owner for part, owner in owners.items() if part in place), path)
        item.add_marker(pytest.mark.xdist_group(name))
