"""What fast training gains: over other starts of the latents, and over the paper's training."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from assets_defs.neural_btf.datasets import abrdf_reader, pairs_of
from assets_defs.neural_btf.network import POOL_BYTES, NetworkSettings, training_plan
from benchmarks.btf_errors import btf_rmse
from pipelines.light.directions import Pairs
from pipelines.neural_btf.abrdf_pool import AbrdfPool, AbrdfReader
from pipelines.neural_btf.clusters import AbrdfClusters
from pipelines.neural_btf.compressed import CompressedBtf, compressed_btf
from pipelines.neural_btf.decoder_arrays import direction_inputs
from pipelines.neural_btf.network import decoder_arrays
from pipelines.neural_btf.restoration import restoration_errors
from pipelines.neural_btf.training.data import AbrdfScale, TrainingData, training_data
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import TrainedNetwork, train

PAPER_SECONDS = 300.0


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
    stored = compressed_btf(
        decoder_arrays(trained.decoder),
        trained.latents,
        groups.ids,
        float(matrix["alpha"]),
        _size_of(matrix),
        trained.parallax,
    )
    held = replace(stored, least=0.0, largest=1.0)
    return restoration_errors(held, read, pairs_of(matrix), block=400).rmse


def _size_of(matrix: xr.Dataset) -> tuple[int, int]:
    return int(matrix["height"]), int(matrix["width"])


def _with(stored: CompressedBtf, trained: TrainedNetwork) -> CompressedBtf:
    return replace(stored, decoder=decoder_arrays(trained.decoder), latents=trained.latents)


def _fast_plan(**chosen: Any) -> TrainingPlan:
    return training_plan(NetworkSettings(encoder_steps=0, **chosen))


def encoder_gain(
    data: TrainingData, stored: CompressedBtf, abrdfs: NDArray[np.float16], pairs: Pairs
) -> dict[str, Any]:
    """Latents that start at random, at principal components, at the encoder; the encoder alone."""
    steps = 600
    plans = {
        "random": _fast_plan(steps=steps, warm_start="random"),
        "pca": _fast_plan(steps=steps),
        "encoder": _fast_plan(steps=steps, warm_start="encoder", encoder_share=0.25),
        "encoder_alone": _fast_plan(steps=steps, warm_start="encoder", encoder_share=1.0),
    }
    found: dict[str, Any] = {}
    for name, plan in plans.items():
        started = time.perf_counter()
        trained = train(data, plan)
        seconds = time.perf_counter() - started
        rmse = btf_rmse(_with(stored, trained), abrdfs, pairs)
        found[name] = {"rmse": rmse, "seconds": round(seconds, 1)}
    return {"warm_start_small": found, "warm_start_steps": steps}


def training_speedup(
    data: TrainingData, stored: CompressedBtf, abrdfs: NDArray[np.float16], pairs: Pairs
) -> dict[str, Any]:
    """The paper's training for 300 s; then ever longer fast ones until one is as good."""
    started = time.perf_counter()
    plan = training_plan(NetworkSettings(training="paper", paper_steps=10**9))
    trained = train(data, plan, stop=lambda _: time.perf_counter() - started > PAPER_SECONDS)
    wanted = btf_rmse(_with(stored, trained), abrdfs, pairs)
    steps = 50
    while True:
        started = time.perf_counter()
        trained = train(data, _fast_plan(steps=steps))
        seconds = time.perf_counter() - started
        reached = btf_rmse(_with(stored, trained), abrdfs, pairs)
        if reached <= wanted or seconds > PAPER_SECONDS:
            break
        steps *= 2
    return {
        "paper_rmse_300s": wanted,
        "fast_rmse": reached,
        "fast_steps": steps,
        "fast_seconds": seconds,
        "train_speedup": PAPER_SECONDS / seconds if reached <= wanted else None,
    }
