"""Run one benchmark: ``python -m benchmarks fur``, ``python -m benchmarks btf --scale paper``.

``python -m benchmarks contents STORE STORE`` compares what two stores hold.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
import json
import platform
import subprocess
from pathlib import Path
from typing import Any

NAMES = (
    "btf",
    "btf_paper_training",
    "captures",
    "contents",
    "drives",
    "faults",
    "fur",
    "house",
    "packages",
    "scratches",
    "ssdf",
    "street",
)
SCALES = ("default", "paper")


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    import os

    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = lines[0].partition(":")[2].strip() if lines else model
    return {"cpu": model, "cores": os.cpu_count(), "python": platform.python_version()}


def commit() -> str:
    """The checkout's commit; ends in ``+`` where files differ from it."""
    here = Path(__file__).parent

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", *arguments], cwd=here, capture_output=True, text=True)
        return done.stdout.strip()

    changed = git("status", "--porcelain", "--", ":/", ":!/benchmarks/results")
    return git("rev-parse", "--short=12", "HEAD") + ("+" if changed else "")


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks")
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("stores", nargs="*", help="contents: two stores, or lists of hashes")
    parser.add_argument(
        "--scale", choices=SCALES, default="default", help="paper: an hour, where there is one"
    )
    parser.add_argument("--real", type=Path, help="drives: a folder in KITTI's layout")
    arguments = parser.parse_args()
    run = importlib.import_module(f"benchmarks.{arguments.name}").run
    wanted = inspect.signature(run).parameters
    if "scale" not in wanted and arguments.scale != "default":
        parser.error(f"{arguments.name} has no scale {arguments.scale!r}; expected 'default'.")
    if len(arguments.stores) != (2 if arguments.name == "contents" else 0):
        parser.error("two stores go with contents, and none with another name.")
    if arguments.real is not None and "real" not in wanted:
        parser.error("--real goes with drives.")
    if "real" in wanted:
        figures = run(arguments.real)
    else:
        figures = run(arguments.scale) if "scale" in wanted else run(*arguments.stores)
    print(json.dumps(figures | {"commit": commit(), "machine": machine()}))


if __name__ == "__main__":
    main()
