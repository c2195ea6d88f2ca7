"""Figures of drives that people have: formats, worlds, depth of one camera, poses of a film.

``python -m benchmarks drives`` measures the simulated city and forms written by others;
``--real FOLDER`` (KITTI's layout) that drive instead: with its poses, and from its film alone.
docs/street.md says what each figure means.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks import drives_depth, drives_film, drives_worlds
from benchmarks.written_drives import format_mismatches


def run(real: Path | None = None) -> dict[str, Any]:
    """All figures, or those of a real drive."""
    if real is not None:
        return drives_depth.real(real) | _real_film(real)
    figures: dict[str, Any] = {}
    for name, part in (
        ("formats", _formats),
        ("worlds", drives_worlds.run),
        ("depth", drives_depth.run),
        ("film", drives_film.film_figures),
    ):
        figures |= _timed(name, part)
    return figures


def _formats() -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        found = format_mismatches(Path(folder))
    wrong = {form: count for form, count in found.items() if count}
    return {
        "formats": len(found),
        "format_mismatches": sum(found.values()),
        "formats_wrong": wrong,
    }


def _real_film(folder: Path) -> dict[str, Any]:
    """The same drive from its pictures alone, beside the poses that it has."""
    drive = drives_depth.kitti_frames(folder)
    frames = [drive.load(frame) for frame in range(len(drive.poses))]
    pictures = (frame.photographs[0] for frame in frames)
    return drives_film.found_figures(
        pictures, drive.poses[:, 0], frames[0].intrinsics[0], "real_film"
    )


def _timed(name: str, part: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    start, used = time.perf_counter(), time.process_time()
    found = part()
    wall, spent = time.perf_counter() - start, time.process_time() - used
    print(f"{name}: {wall:.0f} s, {spent:.0f} s of a processor", file=sys.stderr, flush=True)
    return found
