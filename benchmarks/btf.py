"""Figures of the neural BTF: the paper's tables, and what else could have been done.

The default scale takes one small material through everything, and trains as the paper does against
the clock. ``--scale paper`` makes the tables: four materials, 6561 photographs of 100 x 100 texels,
four columns; every column's figures are written under ``benchmarks/results/`` as they come, and a
run that was stopped goes on with the next one.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from assets_defs.launcher import Launcher, Request
from assets_defs.neural_btf.datasets import compressed_btf_of, pairs_of
from assets_defs.neural_btf.declaration import NONE
from assets_defs.neural_btf.graph import BTF
from assets_defs.neural_btf.network import NetworkSettings, stored_training_data, training_plan
from assets_defs.workspace import Workspace
from benchmarks.btf_bytes import COLUMNS, table_of_bytes
from benchmarks.btf_errors import against_rivals, rmse_in_context
from benchmarks.btf_launching import opened_launcher, timed
from benchmarks.btf_speed import gonioreflectometer_speed, reader_speed, transposition_speed
from benchmarks.btf_training import encoder_gain, training_speedup
from pipelines.virtual.cloth.weaves import MATERIALS

RESULTS = Path(__file__).parent / "results"
PAPER_RMSE = {
    "fabric02": (0.0203, 0.0212, 0.0200, 0.0203),
    "WOOL": (0.0264, 0.0275, 0.0274, 0.0274),
    "CORDUROY": (0.0285, 0.0289, 0.0282, 0.0288),
    "PULLI": (0.0337, 0.0346, 0.0340, 0.0340),
}
"""Table 2 of the paper, in the order of the columns: other materials than ours."""
SMALL_MATERIAL = "knit"
SMALL_TEXELS = 40
RIVAL_STEPS = {"default": 3000, "paper": 16_000}
"""Steps of the rival that is trained: as many as ours has."""
_NEWEST = "rival_rmse"
"""A key that an older benchmark's files of "none" do not have: they are written again."""
PICTURES = {"width": 320, "frames": 2, "cloth_samples": 8}
"""Smaller pictures than the preset's: they are no figures."""


def run(scale: str) -> dict[str, Any]:
    """All figures of a scale, keyed as the documentation names them."""
    with timed("bytes of stored versions"):
        figures = table_of_bytes()
    figures |= _paper_scale() if scale == "paper" else _default_scale()
    return {"scale": scale, **figures}


# ---- default scale ---------------------------------------------------------------------------


def _default_scale() -> dict[str, Any]:
    clusters = SMALL_TEXELS**2 // 20
    figures: dict[str, Any] = {"material": SMALL_MATERIAL, "texels": SMALL_TEXELS**2}
    with tempfile.TemporaryDirectory() as folder, opened_launcher(Path(folder)) as launcher:
        store = launcher.workspace.store
        with timed("photographs to restored photographs"):
            keys = [{"material": SMALL_MATERIAL, "clusters": c} for c in (NONE, str(clusters))]
            given = {
                "texels": SMALL_TEXELS,
                "directions": 81,
                "steps": 3000,
                "width": 160,
                "frames": 2,
            }
            outcomes = launcher.launch(Request(BTF, keys, "demo", given))
        figures["seconds_small"] = {str(o.slot): round(o.seconds, 1) for o in outcomes}
        for name, column in (("none", NONE), ("clustered", str(clusters))):
            slot = BTF.slot("restored_images", {"material": SMALL_MATERIAL, "clusters": column})
            figures[f"rmse_{name}_small"] = float(store.open(slot)["rmse"])
        figures["clusters_small"] = clusters
        matrix = store.open(BTF.slot("abrdf_matrix", {"material": SMALL_MATERIAL})).load()
        groups = store.open(BTF.slot("abrdf_clusters", keys[0])).load()
        file = store.open(BTF.slot("compressed_btf", keys[0])).load()
        stored = compressed_btf_of(file)
    pairs = pairs_of(matrix)
    abrdfs = matrix["abrdfs"].values
    with timed("against its rivals"):
        found = against_rivals(
            stored, file.sizes["byte"], abrdfs, pairs, steps=RIVAL_STEPS["default"]
        )
    found |= rmse_in_context(figures["rmse_none_small"], stored.alpha, abrdfs)
    figures |= {f"{name}_small": value for name, value in found.items()}
    data = stored_training_data(training_plan(NetworkSettings()), matrix, groups)
    with timed("encoder against learnt latents"):
        figures |= encoder_gain(data, stored, abrdfs, pairs)
    with timed("training as the paper does"):
        figures |= training_speedup(data, stored, abrdfs, pairs)
    with timed("reader, gonioreflectometer"):
        figures |= reader_speed() | gonioreflectometer_speed()
    return figures


# ---- paper scale -----------------------------------------------------------------------------


def _paper_scale() -> dict[str, Any]:
    figures: dict[str, Any] = {"columns": COLUMNS, "paper_table_2": PAPER_RMSE}
    root = Workspace.from_environment().root / "benchmarks"
    with opened_launcher(root) as launcher:
        for material in MATERIALS:
            for column in COLUMNS:
                figures |= _column(launcher, material, column)
    for column in COLUMNS:
        name = f"rmse_{column}"
        figures[name] = {m: figures[f"{m}_{column}"]["rmse"] for m in MATERIALS}
    ratios = {m: figures[f"{m}_{NONE}"]["rival_rmse_ratio"] for m in MATERIALS}
    figures["rival_rmse_ratio"] = float(np.mean(list(ratios.values())))
    figures["rival_rmse_ratio_each"] = ratios
    with timed("transposition of 6561 photographs of 256 x 256"):
        figures |= transposition_speed()
    with timed("reader, gonioreflectometer"):
        figures |= reader_speed() | gonioreflectometer_speed()
    return figures


def _column(launcher: Launcher, material: str, column: str) -> dict[str, Any]:
    """One column of a material: launched, compared, and written beside the others."""
    from benchmarks.__main__ import commit, machine

    keys = {"material": material, "clusters": column}
    path = RESULTS / f"btf-paper-{material}-{column}.json"
    with timed(f"{material}, {column}"):
        outcomes = launcher.launch(Request(BTF, [keys], "paper", PICTURES))
    store = launcher.workspace.store
    slot = BTF.slot("restored_images", keys)
    content = store.record(slot)["content"]
    if path.exists():
        known = json.loads(path.read_text())
        if known["content"] == content and (column != NONE or _NEWEST in known):
            return {f"{material}_{column}": known}
    errors = store.open(slot)
    dataset = store.open(BTF.slot("compressed_btf", keys))
    figures: dict[str, Any] = {
        "rmse": float(errors["rmse"]),
        "rmse_worst_image": float(errors["rmse_image"].max()),
        "rmse_worst_texel": float(errors["rmse_texel"].max()),
        "alpha": float(dataset["alpha"]),
        "payload_bytes": compressed_btf_of(dataset).payload_bytes,
        "seconds": {o.slot.asset: round(o.seconds, 1) for o in outcomes if o.state == "made"},
    }
    matrix = store.open(BTF.slot("abrdf_matrix", {"material": material}))
    abrdfs = matrix["abrdfs"].values
    figures |= rmse_in_context(figures["rmse"], figures["alpha"], abrdfs)
    if column == NONE:
        pairs = pairs_of(matrix)
        stored = compressed_btf_of(dataset)
        figures |= against_rivals(
            stored, dataset.sizes["byte"], abrdfs, pairs, steps=RIVAL_STEPS["paper"]
        )
    settings = {
        plan.name: store.record(BTF.slot(plan.name, {d: keys[d] for d in plan.by}))["settings"]
        for plan in BTF.plans.values()
    }
    figures |= {"content": content, "settings": settings, "commit": commit(), "machine": machine()}
    path.write_text(json.dumps(figures, indent=2) + "\n")
    return {f"{material}_{column}": figures}
