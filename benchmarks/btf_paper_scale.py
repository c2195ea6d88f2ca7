"""Figures of paper-size BTFs: four materials, 6561 photographs of 100 x 100 texels, 16 rays each.

Every material's figures are written under ``benchmarks/results/`` as they come; a run that was
stopped goes on with the next one. The paper's tables of each material follow (`btf_columns`).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from assets_defs.launcher import Launcher, Request
from assets_defs.neural_btf.declaration import NONE
from assets_defs.neural_btf.graph import BTF
from assets_defs.workspace import Workspace
from benchmarks.btf_columns import columns_path, committed_columns, write_columns
from benchmarks.btf_launching import opened_launcher, timed
from benchmarks.btf_material import MaterialPlan, made, material_figures
from benchmarks.btf_training import data_of_matrix, trained_rmse
from pipelines.neural_btf.clusters import single_texel_clusters
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import train
from storage.versions import VersionedStore

RESULTS = Path(__file__).parent / "results"
RUNS = (("knit", 0), ("corduroy", 0), ("silk", 0), ("twill", 0), ("knit", 1))
"""Materials with seeds of the training."""
MATERIALS = tuple(material for material, seed in RUNS if seed == 0)
PLAN = MaterialPlan(
    preset="paper",
    given={"width": 320, "frames": 2, "cloth_samples": 8},  # pictures: they are no figures here
    small={"share": 0.097, "latents": 8, "student": False},  # 40 500 bytes, for archives
    rival_steps=16_000,
    cloth=(320, 128),
)
_FOUR_RAYS = {"samples": 4}
_STEPS = 16_000
HEADLINES = (
    "file_bytes",
    "file_rmse_ratio",
    "small_file_bytes",
    "small_file_rmse_ratio",
    "rival_rmse_ratio",
    "rival_by_texel_rmse_ratio",
    "rival_flip_ratio",
    "null_rmse_ratio",
    "null_flip_ratio",
    "none_rmse_gain",
    "student_macs_ratio",
    "student_rmse_ratio",
    "grazing_detail",
    "grazing_energy",
    "mip_error_ratio",
    "shader_vs_numpy_rmse",
)
"""Of each run; their mean over materials is told."""


def run_all() -> dict[str, Any]:
    """Make what is not committed yet, then tell all of it."""
    root = Workspace.from_environment().root / "benchmarks"
    with opened_launcher(root) as launcher:
        for material, seed in RUNS:
            if not result_path(material, seed).exists():
                _write(launcher, material, seed, root)
            if seed == 0 and not columns_path(material).exists():
                write_columns(launcher, material)  # before another seed is the current version
    return committed_figures()


def result_path(material: str, seed: int) -> Path:
    """Where a run's figures are committed."""
    return RESULTS / f"btf-file-{material}-{seed}.json"


def committed_figures() -> dict[str, Any]:
    """Means over the materials of seed 0, of what is committed, and what each run has."""
    paths = {run: result_path(*run) for run in RUNS}
    runs = {run: json.loads(path.read_text()) for run, path in paths.items() if path.exists()}
    found: dict[str, Any] = {"materials": [material for material, seed in runs if seed == 0]}
    for name in HEADLINES:
        values = {f"{m} {seed}": runs[m, seed].get(name) for m, seed in runs}
        first = [runs[run][name] for run in runs if run[1] == 0 and name in runs[run]]
        found[name] = float(np.mean(first)) if first else None
        found[f"{name}_each"] = values
    return found | {"columns": committed_columns(MATERIALS)}


def _write(launcher: Launcher, material: str, seed: int, root: Path) -> None:
    from benchmarks.__main__ import commit, machine

    with timed(f"{material}, seed {seed}"):
        run = made(launcher, material, PLAN, seed)
        figures = material_figures(run, PLAN)
    if seed == 0:
        figures |= _none_gain(material, root / "four_rays")
    keys = {"material": material, "clusters": NONE}
    store = launcher.workspace.store
    figures |= all_photographs(store, material)
    settings = {
        plan.name: store.record(BTF.slot(plan.name, {d: keys[d] for d in plan.by}))["settings"]
        for plan in BTF.plans.values()
    }
    about = {"settings": settings, "commit": commit(), "machine": machine()}
    result_path(material, seed).write_text(json.dumps(figures | about, indent=1) + "\n")


def all_photographs(store: VersionedStore, material: str) -> dict[str, Any]:
    """Figures of the file over all photographs, with their nulls, and ``grazing_energy``: gradient
    energy at views of 60 degrees and more, right or not."""
    slot = BTF.slot("restored_images", {"material": material, "clusters": NONE})
    errors = store.open(slot)
    found = {str(name): float(part) for name, part in errors.data_vars.items() if not part.dims}
    return {"grazing_energy": found["grazing_energy"], "all_photographs": found}


def _none_gain(material: str, root: Path) -> dict[str, float]:
    """``none_rmse_gain``: the float32 network's RMSE on the photographs of four rays a texel over
    that of the version before it looked latents up by the view, committed as ``btf-paper-…``."""
    before = json.loads((RESULTS / f"btf-paper-{material}-{NONE}.json").read_text())
    with opened_launcher(root) as launcher:
        launcher.launch(Request(BTF, [{"material": material}], "paper", _FOUR_RAYS))
        matrix = launcher.workspace.store.open(BTF.slot("abrdf_matrix", {"material": material}))
    matrix = matrix.load()
    if float(matrix["alpha"]) != before["alpha"]:
        raise ValueError(
            f"{material}: alpha is {float(matrix['alpha'])}; expected {before['alpha']}, as the "
            "committed photographs of four rays have: the virtual cloth is another one now."
        )
    plan = TrainingPlan(steps=_STEPS, parallax=True)
    groups = single_texel_clusters(matrix["scores"].values)
    data, read = data_of_matrix(matrix, groups, plan)
    with timed(f"{material}: the network on four rays"):
        rmse = trained_rmse(train(data, plan), matrix, groups, read)
    return {
        "none_rmse_four_rays": rmse,
        "none_rmse_four_rays_before": before["rmse"],
        "none_rmse_gain": rmse / before["rmse"],
    }
