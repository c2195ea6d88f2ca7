"""What fast training gains: over other starts of the latents, and over the paper's training."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from assets_defs.neural_btf.datasets import abrdf_reader, pairs_of
from assets_defs.neural_btf.network import POOL_BYTES, NetworkSettings, training_plan
from pipelines.neural_btf.abrdf_pool import AbrdfPool, AbrdfReader
from pipelines.neural_btf.clusters import AbrdfClusters, single_texel_clusters
from pipelines.neural_btf.compressed import compressed_btf
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.network import decoder_arrays
from pipelines.neural_btf.quality import error_figures
from pipelines.neural_btf.quality_sums import compare
from pipelines.neural_btf.restoration import restored_abrdfs
from pipelines.neural_btf.training.data import AbrdfScale, TrainingData, training_data
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import TrainedNetwork, train


def data_of_matrix(
    matrix: xr.Dataset, groups: AbrdfClusters, plan: TrainingPlan
) -> tuple[TrainingData, AbrdfReader]:
    """What a plan is trained on, of a stored `abrdf_matrix`, and a reader of its ABRDFs."""
    texels, count, _ = matrix["abrdfs"].shape
    pool = AbrdfPool(
        abrdf_reader(matrix), texels, count, block=texels, budget=POOL_BYTES, seed=plan.seed
    )
    scale = AbrdfScale(matrix["mean"].values, matrix["deviation"].values, float(matrix["alpha"]))
    directions = direction_inputs(pairs_of(matrix))
    data = training_data(pool, groups, scale, directions, _size_of(matrix), plan)
    return data, lambda first, last: pool.part(0)[1][first:last]


def trained_rmse(
    trained: TrainedNetwork, matrix: xr.Dataset, groups: AbrdfClusters, read: AbrdfReader
) -> float:
    """RMSE over alpha of all photographs, in the paper's float32 form."""
    return trained_errors(trained, matrix, groups, read)["rmse"]


def trained_errors(
    trained: TrainedNetwork, matrix: xr.Dataset, groups: AbrdfClusters, read: AbrdfReader
) -> dict[str, float]:
    """``rmse`` as `trained_rmse`, and ``rmse_null``: of the mean ABRDF, a colour a photograph."""
    size, alpha, pairs = _size_of(matrix), float(matrix["alpha"]), pairs_of(matrix)
    decoder = decoder_arrays(trained.decoder)
    stored = compressed_btf(decoder, trained.latents, groups.ids, alpha, size, trained.parallax)
    held = replace(stored, least=0.0, largest=1.0)
    restore = restored_abrdfs(held, pairs)
    compared = compare(restore, read, pairs, size, judged=np.zeros(0, np.int64), block=400)
    found = error_figures(compared, alpha)
    return {name: found[name] for name in ("rmse", "rmse_null")}


def _size_of(matrix: xr.Dataset) -> tuple[int, int]:
    return int(matrix["height"]), int(matrix["width"])


def _fast_plan(**chosen: Any) -> TrainingPlan:
    return training_plan(NetworkSettings(encoder_steps=0, parallax=False, **chosen))


def warm_starts(matrix: xr.Dataset, steps: int = 600) -> dict[str, Any]:
    """Latents that start at random, at principal components, at the encoder; the encoder alone."""
    plans = {
        "random": _fast_plan(steps=steps, warm_start="random"),
        "pca": _fast_plan(steps=steps),
        "encoder": _fast_plan(steps=steps, warm_start="encoder", encoder_share=0.25),
        "encoder_alone": _fast_plan(steps=steps, warm_start="encoder", encoder_share=1.0),
    }
    return {"steps": steps} | {name: _trained(matrix, plan) for name, plan in plans.items()}


def training_speedup(matrix: xr.Dataset, wanted: float, seconds: float) -> dict[str, Any]:
    """Ever longer fast trainings until one has the RMSE that the paper's reached in ``seconds``;
    ``train_speedup`` is None where none did in that time."""
    steps = 25
    while True:
        found = _trained(matrix, _fast_plan(steps=steps))
        if found["rmse"] <= wanted or found["cpu_seconds"] > seconds:
            break
        steps *= 2
    faster = seconds / found["cpu_seconds"] if found["rmse"] <= wanted else None
    return {"train_speedup": faster, "fast_steps": steps, "fast": found}


def _trained(matrix: xr.Dataset, plan: TrainingPlan) -> dict[str, float]:
    groups = single_texel_clusters(matrix["scores"].values)
    data, read = data_of_matrix(matrix, groups, plan)
    started = time.process_time()
    trained = train(data, plan)
    spent = time.process_time() - started
    return {"rmse": trained_rmse(trained, matrix, groups, read), "cpu_seconds": round(spent, 1)}
