"""One scene through the graph in a process of its own: time of each step, peak of memory.

``python -m benchmarks.ssdf_precompute FOLDER FACTOR``: the default scene with FACTOR times its
vertices and clusters into the store in FOLDER; of the first, after the smallest preset has compiled
what has to be compiled. Prints one JSON object.
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
from pathlib import Path
from typing import Any

import dagster as dg

from assets_defs.definitions import build_definitions
from assets_defs.launcher import Launcher, Request
from assets_defs.ssdf_lighting.clusters import ClusterSettings
from assets_defs.ssdf_lighting.graph import SSDF
from assets_defs.ssdf_lighting.meshes import SceneSettings
from assets_defs.workspace import Workspace

SCENE = "teapot"


def precompute(folder: Path, factor: int) -> dict[str, Any]:
    """Make everything of the scene that does not depend on an environment."""
    scene, clusters = SceneSettings(), ClusterSettings()
    if factor == 1:  # the others find on disk what was compiled
        with tempfile.TemporaryDirectory() as small:
            _launch(Path(small), {}, "test")
    given = {
        "segments": round(scene.segments * factor**0.5),
        "floor": round(scene.floor * factor**0.5),
        "clusters": clusters.clusters * factor,
        "byte_budget": 1 << 40,
    }
    seconds = _launch(folder, given, "demo")
    store = Workspace(folder).store
    mesh = store.open(SSDF.slot("scene_mesh", {"scene": SCENE}))
    return {
        "vertices": mesh.sizes["vertex"],
        "clusters": given["clusters"],
        "seconds": seconds,
        "total_seconds": sum(seconds.values()),
        "peak_rss_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6,
    }


def _launch(folder: Path, given: dict[str, Any], preset: str) -> dict[str, float]:
    def silent(what: str, fraction: float) -> None:
        """Nobody watches."""

    workspace = Workspace(folder)
    definitions = build_definitions(workspace, {"progress": silent})
    with dg.DagsterInstance.ephemeral() as instance:
        job = definitions.get_repository_def().get_job
        launcher = Launcher(instance, workspace, job, silent)
        outcomes = launcher.launch(Request(SSDF, [{"scene": SCENE}], preset, given))
    return {outcome.slot.asset: round(outcome.seconds, 2) for outcome in outcomes}


if __name__ == "__main__":
    print(json.dumps(precompute(Path(sys.argv[1]), int(sys.argv[2]))))
