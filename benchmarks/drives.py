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

import numpy as np

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
    from pipelines.street_billboards.poses.found_poses import find_poses, guessed_pinhole

    drive = drives_depth.kitti_frames(folder)
    pictures = [drive.load(frame).photographs[0] for frame in range(len(drive.poses))]
    height, width = pictures[0].shape[:2]
    start = time.process_time()
    found = find_poses(pictures, guessed_pinhole(width, height))
    used = time.process_time() - start
    kept = found.registered
    truth = drive.poses[kept, 0, :3, 3]
    focal = float(drive.load(0).intrinsics[0, 0, 0])
    ahead = np.linspace(0.0, 1.0, int(kept.sum()))[:, None] * [1.0, 0.0, 0.0]
    return {
        "real_registered": float(kept.mean()),
        "real_ate_m": drives_film.trajectory_error(found.poses[kept, :3, 3], truth),
        "real_ate_m_null": drives_film.trajectory_error(ahead, truth),
        "real_focal_error": float(found.intrinsics[0, 0]) / focal - 1.0,
        "real_focal_deviation": found.focal_deviation / focal,
        "real_poses_s_per_frame": used / len(pictures),
    }


def _timed(name: str, part: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    start, used = time.perf_counter(), time.process_time()
    found = part()
    wall, spent = time.perf_counter() - start, time.process_time() - used
    print(f"{name}: {wall:.0f} s, {spent:.0f} s of a processor", file=sys.stderr, flush=True)
    return found
