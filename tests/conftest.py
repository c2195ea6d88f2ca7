"""Tests of one system run in one process: what it compiles, it compiles once."""

from __future__ import annotations

from pathlib import Path

import pytest

from storage.schemas import systems


@pytest.hookimpl(tryfirst=True)  # xdist looks at the groups in this hook, too
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group a system's tests together, the others by their file (for ``--dist loadgroup``)."""
    for item in items:
        path = Path(item.path)
        name = next((system for system in systems() if system in str(path)), str(path))
        item.add_marker(pytest.mark.xdist_group(name))
