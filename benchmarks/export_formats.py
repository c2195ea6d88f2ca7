"""What packages are exported as, read back by other programs: the tests that do it, counted.

A test that reads an export with another program than the one that wrote it, and compares values, is
marked ``reads_back("FORMAT")``.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from assets_defs.workspace import CHECKOUT

_SECONDS = 400.0


class _Counts:
    """A plugin of pytest: which formats were read back, and where values differed."""

    def __init__(self) -> None:
        self.format_of: dict[str, str] = {}
        self.failed: list[str] = []
        self.passed: set[str] = set()
        self.figures: dict[str, dict[str, float]] = {}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Note which test reads which format."""
        for item in items:
            for mark in item.iter_markers("reads_back"):
                self.format_of[item.nodeid] = str(mark.args[0])

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note what became of a test."""
        name = self.format_of.get(report.nodeid)
        if name is None:
            return
        if report.failed:
            self.failed.append(report.nodeid)
        elif report.when == "call" and report.passed:
            self.passed.add(name)
            for key, value in report.user_properties:
                assert isinstance(value, dict)
                self.figures.setdefault(key, {}).update(value)


def format_figures() -> dict[str, Any]:
    """``formats``, how many were read back; ``mismatches``, tests that found other values; and the
    figures that the tests record."""
    done = subprocess.run(
        [sys.executable, "-m", __name__],
        cwd=CHECKOUT,
        stdout=subprocess.PIPE,
        timeout=_SECONDS,
        check=True,
        text=True,
    )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Run the tests in this process and print one JSON object as the last line."""
    counts = _Counts()
    pytest.main(["-q", "-n", "0", "-m", "reads_back", "tests"], plugins=[counts])
    read = sorted(counts.passed)
    figures = {"formats": len(read), "formats_read": read, "mismatches": len(counts.failed)}
    print("\n" + json.dumps(figures | {"mismatching": counts.failed} | counts.figures))


if __name__ == "__main__":
    main()
