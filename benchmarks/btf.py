"""Figures of the neural BTF: the file beside its rivals, the paper's tables, what else there is.

The default scale takes one small material through everything within ten minutes; its figures of the
file end in ``_small``, and the committed ones of paper size stand beside them. ``--scale paper``
makes these: four materials, 6561 photographs of 100 x 100 texels (`btf_paper_scale`).
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from assets_defs.neural_btf.graph import BTF
from benchmarks import btf_paper_scale, btf_paper_training
from benchmarks.btf_bytes import table_of_bytes
from benchmarks.btf_cloth import sampling_variance_ratio
from benchmarks.btf_errors import value_spread
from benchmarks.btf_launching import opened_launcher, timed
from benchmarks.btf_material import MaterialPlan, MaterialRun, made, material_figures
from benchmarks.btf_quality import encoder_promise, heldout_directions
from benchmarks.btf_speed import gonioreflectometer_speed, reader_speed, transposition_speed
from benchmarks.btf_training import data_of_matrix, trained_rmse
from pipelines.light.directions import all_pairs, hemisphere_table
from pipelines.neural_btf.clusters import single_texel_clusters
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import train
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.weaves import make_cloth

MATERIAL = "knit"
TEXELS, SAMPLES, STEPS = 48, 16, 2500
PLAN = MaterialPlan(
    preset="demo",
    given={
        "texels": TEXELS,
        "directions": 81,
        "samples": SAMPLES,
        "steps": STEPS,
        "latents": 16,
        "file_steps": 1500,
        "file_rate": 0.01,
        "share": 0.2,
        "width": 96,
        "frames": 1,
        "cloth_samples": 2,
    },
    small={"share": 0.15, "latents": 8, "student": False},
    rival_steps=1500,
    cloth=(160, 64),
)
_OF_PAPER_SIZE = (
    "file_bytes",
    "file_rmse_ratio",
    "small_file_bytes",
    "small_file_rmse_ratio",
)
"""Figures that only mean something at paper size: the run's own are called ``_small``."""
_PROMISE_TEXELS, _PROMISE_DIRECTIONS = 32, 41


def run(scale: str) -> dict[str, Any]:
    """All figures of a scale, keyed as the documentation names them."""
    with timed("bytes of stored versions"):
        figures: dict[str, Any] = {"scale": scale, **table_of_bytes()}
    if scale == "paper":
        figures |= btf_paper_scale.run_all()
        with timed("transposition of 6561 photographs of 256 x 256"):
            figures |= transposition_speed()
    else:
        committed = btf_paper_scale.committed_figures()
        figures |= {name: committed[name] for name in _OF_PAPER_SIZE}
        figures |= _default_scale()
        figures["paper_size"] = committed
    figures["paper_training"] = btf_paper_training.committed_figures()
    with timed("reader, gonioreflectometer"):
        figures |= reader_speed() | gonioreflectometer_speed()
    return figures


def _default_scale() -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder, opened_launcher(Path(folder)) as launcher:
        with timed("photographs to pictures"):
            made_run = made(launcher, MATERIAL, PLAN)
        found = material_figures(made_run, PLAN)
        matrix = launcher.workspace.store.open(BTF.slot("abrdf_matrix", {"material": MATERIAL}))
        found |= _without_parallax(matrix.load(), found["forms"]["float32"])
        found |= _directions_off_the_grid(made_run)
    for name in _OF_PAPER_SIZE:
        found[f"{name}_small"] = found.pop(name)
    with timed("importance sampling"):
        found["sampling_variance_ratio"] = sampling_variance_ratio(made_run.btf("file"))
    mean, deviation = value_spread(made_run.judge.abrdfs)
    about = {"material": MATERIAL, "texels": TEXELS**2, "mean": mean, "deviation": deviation}
    with timed("the encoder's promise"):
        return about | found | _promise()


def _without_parallax(matrix: Any, float32: dict[str, Any]) -> dict[str, float]:
    """``none_rmse_gain``: the float32 network over one that looks latents up at the texel itself,
    trained as long."""
    plan = TrainingPlan(steps=STEPS, parallax=False)
    groups = single_texel_clusters(matrix["scores"].values)
    data, read = data_of_matrix(matrix, groups, plan)
    with timed("a network without parallax"):
        rmse = trained_rmse(train(data, plan), matrix, groups, read)
    return {"none_rmse_without_parallax": rmse, "none_rmse_gain": float32["rmse"] / rmse}


def _directions_off_the_grid(made_run: MaterialRun) -> dict[str, float]:
    with timed("directions off the grid"):
        return heldout_directions(
            made_run.btf("file"),
            made_run.images["images"].values,
            hemisphere_table(81),
            MATERIAL,
            samples=SAMPLES,
        )


def _promise() -> dict[str, float]:
    table = hemisphere_table(_PROMISE_DIRECTIONS)
    size = (_PROMISE_TEXELS, _PROMISE_TEXELS)
    instrument = Gonioreflectometer(make_cloth(MATERIAL, 0), table, size, 4)
    images = [instrument.photographs(view) for view in table]
    plan = TrainingPlan(steps=1000, encoder_steps=300)
    return encoder_promise(np.concatenate(images), all_pairs(table, table), plan)
