"""Tests of one system run in one process: what it compiles, it compiles once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from storage.schemas import systems

# How long an example takes says something of the machine and of what is compiled, not of the code.
hypothesis.settings.register_profile("tests", deadline=None)
hypothesis.settings.load_profile("tests")

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


# ---- a browser -------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def built_viewer() -> Path:
    """The folder of the built page, made again where a source is newer."""
    from benchmarks.viewer_page import build_viewer

    return build_viewer()


@pytest.fixture(scope="module")
def chromium(built_viewer: Path) -> Iterator[Any]:
    """Playwright's headless Chromium; for a module, as other tests want loops of their own."""
    from benchmarks.viewer_page import chromium_browser

    try:
        with chromium_browser() as browser:
            yield browser
    except FileNotFoundError as missing:
        pytest.skip(str(missing))
