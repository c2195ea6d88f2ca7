"""Ctrl-C during the long step of each system: how long it takes to end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

from tsuya.console import INTERRUPTED

_TSUYA = str(Path(sys.executable).with_name("tsuya"))
_SECONDS_IN = 1.5
"""How long a step has been at work when it is interrupted."""


class _LongStep(NamedTuple):
    asset: str
    arguments: tuple[str, ...]


_LONG_STEPS = (
    _LongStep("fur_photo", ("photo_fur", "--photo=pelt", "--set=pelt_samples=4000")),
    _LongStep(
        "neural_btf", ("neural_btf", "--material=silk", "--clusters=none", "--set=steps=10000000")
    ),
    _LongStep(
        "relit_frames",
        ("ssdf_lighting", "--scene=teapot", "--environment=sky", "--set=reference_samples=65536"),
    ),
    _LongStep(
        "scratch_table_2d",
        ("glass_scratches", "--setting=setting-2", "--object=plate", "--set=facets=4096"),
    ),
    _LongStep(
        "glass_frames",
        ("glass_scratches", "--setting=setting-2", "--object=plate", "--set=samples=65536"),
    ),
    _LongStep(
        "drive_frames",
        ("street_billboards", "--drive=city", "--set=frames=2000", "--set=width=1024"),
    ),
)


def run_interrupts(environment: dict[str, str]) -> dict[str, Any]:
    """Interrupt each long step once; seconds until the command has ended, the worst first."""
    seconds = {
        f"{step.arguments[0]}/{step.asset}": _interrupt(step, environment) for step in _LONG_STEPS
    }
    return {"interrupt_s": max(seconds.values()), "interrupt_s_of_steps": seconds}


def _interrupt(step: _LongStep, environment: dict[str, str]) -> float:
    """Seconds from SIGINT to the end, which must be one sentence and 130."""
    process = subprocess.Popen(
        [_TSUYA, "run", *step.arguments, "--preset=test"],
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    said = []
    for line in process.stderr:
        said.append(line)
        if line.startswith(f"{step.asset} ["):
            break
    time.sleep(_SECONDS_IN)
    started = time.monotonic()
    process.send_signal(signal.SIGINT)
    try:
        rest = process.communicate(timeout=60)[1]
    except subprocess.TimeoutExpired:
        process.kill()
        return 60.0
    seconds = time.monotonic() - started
    if process.returncode != 130 or rest.strip() != INTERRUPTED:
        raise RuntimeError(f"{step}: ended with {process.returncode}, saying {[*said, rest]}")
    return round(seconds, 2)
