"""What fast training gains: over other starts of the latents, and over the paper's training."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from assets_defs.neural_btf.network import NetworkSettings, training_plan
from benchmarks.btf_errors import btf_rmse
from pipelines.light.directions import Pairs
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.network import decoder_arrays
from pipelines.neural_btf.training.data import TrainingData
from pipelines.neural_btf.training.plan import TrainingPlan
from pipelines.neural_btf.training.trainer import TrainedNetwork, train

PAPER_SECONDS = 300.0


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
