"""Every figure of one material: its network, its file, a smaller file, the student, its rivals.

All forms and rivals are judged by the same photographs (`btf_judging`); a row's bytes, errors and
speed belong to one form.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from assets_defs.launcher import Launcher, Request
from assets_defs.neural_btf.compressed import FileSettings, quantised_network
from assets_defs.neural_btf.datasets import (
    btf_file_of,
    float_btf_file,
    pairs_of,
    quantised_btf_file,
    runtime_btf,
)
from assets_defs.neural_btf.declaration import NONE
from assets_defs.neural_btf.graph import BTF
from benchmarks.btf_cloth import RAW, REFERENCE, cloth_errors, draped_cloths, tile_of
from benchmarks.btf_judging import Judge, judge_of
from benchmarks.btf_launching import timed
from benchmarks.btf_quality import level_figures
from benchmarks.btf_rivals.all_rivals import rivals_at
from benchmarks.btf_rivals.rival import Rival
from benchmarks.btf_shader import shader_figures
from pipelines.light.directions import unit_vectors
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import DecoderArrays
from pipelines.neural_btf.figures import table_bytes
from pipelines.neural_btf.material import Material, MeasuredBtf, mean_colour
from storage.btf_file import BtfFile, write_btf_file
from storage.work_state import WorkState

_LOOKUPS = 200_000
_STEEPEST = 1.3
"""Radians from the normal."""
FLAT = "flat"
NULLS = (FLAT, "grey")
"""Rivals that know nothing."""


@dataclass(frozen=True)
class MaterialPlan:
    """One material's run."""

    preset: str
    given: dict[str, object]
    """Settings in place of the preset's."""
    small: dict[str, object]
    """Settings of the smaller file in place of the file's."""
    rival_steps: int
    """Of the rival that is trained."""
    cloth: tuple[int, int]
    """Width and samples of the draped cloth's pictures."""


@dataclass(frozen=True)
class MaterialRun:
    """What was made of one material, and what it is judged by."""

    material: str
    images: xr.Dataset
    judge: Judge
    forms: dict[str, BtfFile]
    """``float32``, ``file``, ``small``."""
    bytes: dict[str, int]
    seconds: dict[str, float]

    def btf(self, form: str) -> CompressedBtf:
        """A form as it runs; ``student`` decodes the file's latents by its student."""
        if form == "student":
            return runtime_btf(self.forms["file"]).by_student()
        return runtime_btf(self.forms[form])


def made(launcher: Launcher, material: str, plan: MaterialPlan, seed: int = 0) -> MaterialRun:
    """Launch a material without clusters, and train a smaller file of the same network."""
    keys = {"material": material, "clusters": NONE}
    seeds = {"network_seed": seed, "file_seed": seed}
    outcomes = launcher.launch(Request(BTF, [keys], plan.preset, plan.given | seeds))
    store = launcher.workspace.store
    names = ("abrdf_matrix", "abrdf_clusters", "neural_btf", "compressed_btf", "btf_images")
    slots = {n: BTF.slot(n, {d: keys[d] for d in BTF.plans[n].by}) for n in names}
    matrix, groups, network, file = (store.open(slots[name]).load() for name in names[:4])
    settings = FileSettings(**store.record(slots["compressed_btf"])["settings"] | plan.small)
    name = f"{material}-{seed}-{settings.latents}-{settings.share:g}"
    work = WorkState(Path(launcher.workspace.root) / "small_files", name)
    with timed(f"{material}: a smaller file"):
        small = quantised_network(settings, work, lambda _: None, matrix, groups, network)
    forms = {
        "float32": float_btf_file(network, groups, matrix),
        "file": btf_file_of(file),
        "small": quantised_btf_file(small, groups, matrix),
    }
    sizes = {"file": int(file.sizes["byte"]), "small": len(write_btf_file(forms["small"]))}
    sizes["float32"] = table_bytes(len(network["latents"]), len(network["latents"]))
    size = (int(matrix["height"]), int(matrix["width"]))
    judge = judge_of(matrix["abrdfs"].values, pairs_of(matrix), size, float(matrix["alpha"]))
    seconds = {str(o.slot.asset): round(o.seconds, 1) for o in outcomes if o.state == "made"}
    return MaterialRun(material, store.open(slots["btf_images"]), judge, forms, sizes, seconds)


# ---- rows ------------------------------------------------------------------------------------


def rows_of_forms(run: MaterialRun) -> dict[str, dict[str, Any]]:
    """Bytes, memory as it runs, errors and speed of each form."""
    rows = {}
    for form in ("float32", "file", "small", "student"):
        btf = run.btf(form)
        held = [*btf.decoder.values(), btf.latents, *btf.mips]
        with timed(f"{run.material}: errors of {form}"):
            rows[form] = {
                "bytes": run.bytes["file" if form == "student" else form],
                "memory_bytes": sum(part.size * 4 for part in held),
                "decode_mlookups_s": lookup_speed(btf),
                **run.judge.figures_of(btf),
            }
    return rows


def lookup_speed(btf: CompressedBtf) -> float:
    """Million lookups a second by `CompressedBtf.radiance_at`, at places and directions drawn."""
    random = np.random.default_rng(0)
    places = random.random((_LOOKUPS, 2))
    angles = random.random((2, _LOOKUPS, 2)) * (_STEEPEST, 2 * np.pi)
    light, view = (unit_vectors(part) for part in angles)
    btf.radiance_at(places[:1000], light[:1000], view[:1000])
    started = time.perf_counter()
    btf.radiance_at(places, light, view)
    return _LOOKUPS / 1e6 / (time.perf_counter() - started)


def products_of(decoder: DecoderArrays) -> int:
    """Multiplications of a lookup."""
    return sum(part.size for name, part in decoder.items() if name.startswith("weight"))


def rows_of_rivals(run: MaterialRun, steps: int) -> dict[str, dict[str, Any]]:
    """Every rival at exactly the file's bytes, and the nulls."""
    judge = run.judge
    with timed(f"{run.material}: rivals"):
        rivals = rivals_at(
            judge.abrdfs, judge.size, judge.pairs, run.bytes["file"], steps=steps, seed=0
        )
        return {rival.name: _row_of(rival, judge) for rival in rivals}


def _row_of(rival: Rival, judge: Judge) -> dict[str, Any]:
    errors = judge.figures(lambda first, last: rival.restore(first, last)[:, judge.chosen])
    about = {"bytes": rival.bytes, "by_texel": rival.by_texel, "settings": rival.settings}
    return about | errors


# ---- figures ---------------------------------------------------------------------------------


def material_figures(run: MaterialRun, plan: MaterialPlan) -> dict[str, Any]:
    """All figures that one material has."""
    forms, rivals = rows_of_forms(run), rows_of_rivals(run, plan.rival_steps)
    file, float32 = forms["file"], forms["float32"]
    real = {name: row for name, row in rivals.items() if name not in NULLS}
    stored = run.btf("file")
    best = {what: min(row[what] for row in real.values()) for what in ("rmse", "flip")}
    by_texel = min(row["rmse"] for row in real.values() if row["by_texel"])
    return {
        "file_bytes": file["bytes"],
        "file_rmse_ratio": file["rmse"] / float32["rmse"],
        "small_file_bytes": forms["small"]["bytes"],
        "small_file_rmse_ratio": forms["small"]["rmse"] / float32["rmse"],
        "rival_rmse_ratio": file["rmse"] / best["rmse"],
        "rival_by_texel_rmse_ratio": file["rmse"] / by_texel,
        "rival_flip_ratio": file["flip"] / best["flip"],
        "null_rmse_ratio": rivals[FLAT]["rmse"] / file["rmse"],
        "null_flip_ratio": rivals[FLAT]["flip"] / file["flip"],
        "student_macs_ratio": products_of(run.btf("student").decoder) / products_of(stored.decoder),
        "student_rmse_ratio": forms["student"]["rmse"] / file["rmse"],
        "grazing_detail": file["grazing_detail"],
        "decode_mlookups_s": {form: row["decode_mlookups_s"] for form, row in forms.items()},
        **level_figures(stored, run.judge.pairs, lambda numbers: _photographs(run, numbers)),
        **shader_figures(stored),
        **cloth_figures(run, plan),
        "forms": forms,
        "rivals": rivals,
        "seconds": run.seconds,
    }


def _photographs(run: MaterialRun, numbers: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    chosen: np.ndarray[Any, Any] = run.images["images"][numbers].values
    return chosen


def cloth_materials(run: MaterialRun) -> dict[str, Material]:
    """What the cloth is draped in: the measured BTF, its forms, one flat colour."""
    images, pairs = run.images["images"].values, run.judge.pairs
    forms = {RAW: "", REFERENCE: "float32", "file": "file", "student": "student", "small": "small"}
    return {
        name: run.btf(form) if form else MeasuredBtf(images, pairs) for name, form in forms.items()
    } | {FLAT: mean_colour(images, pairs)}


def cloth_figures(run: MaterialRun, plan: MaterialPlan) -> dict[str, Any]:
    """RMSE of pictures of the draped cloth, and their seconds."""
    width, samples = plan.cloth
    with timed(f"{run.material}: draped cloth"):
        drawn = draped_cloths(
            cloth_materials(run), tile_of(*run.judge.size), width=width, samples=samples
        )
    return cloth_errors(drawn)
