"""The paper's own training, against the clock: how far plain gradient descent comes.

SGD, five ABRDFs a batch with all their directions, rate 0.08, through the encoder (section 3.1).
One long run without clusters at the paper's size, and short ones of equal processor time for the
columns of table 2 and for what stands for a cluster, several seeds each: of fewer directions, as
within minutes the paper's 81 x 81 leave all of them at the error of a mean, which stands beside
each. Where ``targets`` are the representatives, these are what is trained. Runs that were stopped
go on; every run's figures are kept as they come.
"""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from assets_defs.launcher import Launcher, Request
from assets_defs.neural_btf.datasets import photograph_blocks
from assets_defs.neural_btf.graph import BTF
from assets_defs.workspace import Workspace
from benchmarks.btf_launching import opened_launcher, timed
from benchmarks.btf_training import data_of_matrix, trained_errors, training_speedup, warm_starts
from pipelines.neural_btf.clusters import AbrdfClusters, cluster_abrdfs, single_texel_clusters
from pipelines.neural_btf.representatives import Representative
from pipelines.neural_btf.training.plan import Targets, TrainingPlan
from pipelines.neural_btf.training.trainer import TrainedNetwork, Trainer

RESULTS = Path(__file__).parent / "results" / "btf_paper_training.json"
MATERIAL = "knit"
LONG_SECONDS, SHORT_SECONDS = 7200.0, 400.0
_DIRECTIONS, _FEWER_DIRECTIONS = 81, 41
SEEDS = (0, 1, 2)
_KEEP_SECONDS = 60.0
_CURVE_STEPS = 100
_ENDLESS = 10**9
_SMALL = {"texels": 32, "directions": 41, "samples": 2}


class Run(NamedTuple):
    """One training; ``clusters`` 0 is none."""

    clusters: int
    seed: int
    seconds: float
    targets: Targets = "texels"
    representative: Representative = "median"
    directions: int = _DIRECTIONS

    @property
    def name(self) -> str:
        """Of its state and figures."""
        column = str(self.clusters) if self.clusters else "none"
        fewer = f"-{self.directions}" if self.directions != _DIRECTIONS else ""
        return f"{column}-{self.targets}-{self.representative}-{self.seed}-{self.seconds:g}s{fewer}"


def planned_runs(scale: str) -> list[Run]:
    """The runs of a scale: a minute each by default, hours for the paper's."""
    if scale != "paper":
        return [Run(0, 0, 60.0), Run(500, 0, 60.0)]
    return [Run(0, 0, LONG_SECONDS), *short_runs()]


def short_runs() -> list[Run]:
    """Of table 2's columns, and of what stands for a cluster."""
    kinds: tuple[Representative, ...] = ("median", "mean", "medoid")
    trained: list[tuple[int, Targets, Representative]] = [
        *((k, "texels", "median") for k in (0, 500, 1000, 2000)),
        *((500, "representatives", kind) for kind in kinds),
    ]
    return [
        Run(k, seed, SHORT_SECONDS, targets, kind, _FEWER_DIRECTIONS)
        for seed in SEEDS
        for k, targets, kind in trained
    ]


def run(scale: str) -> dict[str, Any]:
    """RMSE of every run over all photographs, with processor seconds, and means over seeds."""
    more: dict[str, Any] = {}
    if scale == "paper":
        root = Workspace.from_environment().root / "benchmarks"
        done = [known_or_made(one, root) for one in planned_runs(scale)]
    else:
        with tempfile.TemporaryDirectory() as folder, opened_launcher(Path(folder)) as launcher:
            done = [_made(launcher, one, Path(folder), _SMALL) for one in planned_runs(scale)]
            matrix = launcher.workspace.store.open(BTF.slot("abrdf_matrix", {"material": MATERIAL}))
            more = training_speedup(matrix, done[0]["rmse"], done[0]["cpu_seconds"])
            more["warm_starts"] = warm_starts(matrix)
    return {"scale": scale, "material": MATERIAL, "runs": done} | _told(done) | more


def committed_figures() -> dict[str, Any]:
    """The committed runs: RMSE with intervals over seeds, processor hours of the long one."""
    done = list(json.loads(RESULTS.read_text()).values()) if RESULTS.exists() else []
    hours = {one["name"]: one["cpu_seconds"] / 3600 for one in done}
    return _told(done) | {"cpu_hours": hours}


def _told(done: list[dict[str, Any]]) -> dict[str, Any]:
    """RMSE and its null of each kind of run, over seeds."""
    return {name: _intervals(_by_group(done, name)) for name in ("rmse", "rmse_null")}


def _by_group(done: list[dict[str, Any]], figure: str) -> dict[str, list[float]]:
    """A figure of the seeds of each kind of run."""
    groups: dict[str, list[float]] = {}
    for one in done:
        groups.setdefault(one["name"].replace(f"-{one['seed']}-", "-"), []).append(one[figure])
    return groups


def _intervals(groups: dict[str, list[float]]) -> dict[str, dict[str, float | None]]:
    """Mean and half the width of a 95 % interval (Student's t) over seeds."""
    from scipy.stats import t

    found: dict[str, dict[str, float | None]] = {}
    for name, values in groups.items():
        count = len(values)
        half = None
        if count > 1:
            half = float(t.ppf(0.975, count - 1) * np.std(values, ddof=1) / count**0.5)
        found[name] = {"mean": float(np.mean(values)), "half_interval": half, "seeds": count}
    return found


def known_or_made(one: Run, root: Path) -> dict[str, Any]:
    """A run's figures: known already, or made now and kept; photographs of fewer directions lie in
    a folder of their own."""
    known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    if one.name in known:
        return dict(known[one.name])
    if one.directions != _DIRECTIONS:
        root = root / f"directions_{one.directions}"
    with opened_launcher(root) as launcher:
        figures = _made(launcher, one, root, {"directions": one.directions})
    known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    RESULTS.write_text(json.dumps(known | {one.name: figures}, indent=1) + "\n")
    return figures


def _made(launcher: Launcher, one: Run, root: Path, size: dict[str, int]) -> dict[str, Any]:
    from benchmarks.__main__ import commit, machine

    keys = {"material": MATERIAL}
    launcher.launch(Request(BTF, [keys], "paper", size))
    store = launcher.workspace.store
    images, matrix = (store.open(BTF.slot(name, keys)) for name in ("btf_images", "abrdf_matrix"))
    with timed(one.name):
        figures = _trained(one, images, matrix, root / "btf_paper_training" / f"{one.name}.state")
    about = {"name": one.name, "seed": one.seed, "commit": commit(), "machine": machine()}
    return figures | about


def _trained(one: Run, images: xr.Dataset, matrix: xr.Dataset, state: Path) -> dict[str, Any]:
    plan = TrainingPlan("paper", _ENDLESS, 0.08, 5, targets=one.targets, seed=one.seed)
    groups = _clusters(one, images, matrix)
    data, read = data_of_matrix(matrix, groups, plan)
    trained, spent, steps, curve = _against_the_clock(Trainer(data, plan), one.seconds, state)
    return {
        **trained_errors(trained, matrix, groups, read),
        "cpu_seconds": round(spent),
        "steps": steps,
        "curve": curve,
    }


def _clusters(one: Run, images: xr.Dataset, matrix: xr.Dataset) -> AbrdfClusters:
    scores = matrix["scores"].values
    if not one.clusters:
        return single_texel_clusters(scores)
    clusters = min(one.clusters, len(scores) // 2)
    return cluster_abrdfs(
        photograph_blocks(images["images"]),
        scores,
        clusters,
        representative=one.representative,
        seed=one.seed,
    )


def _against_the_clock(
    trainer: Trainer, seconds: float, state: Path
) -> tuple[TrainedNetwork, float, int, list[list[float]]]:
    """Train for so many processor seconds, those of earlier processes counted.

    Returns the network, seconds, steps, and a curve of (seconds, steps, RMSE of the batches).
    """
    spent, curve = 0.0, []
    if state.exists():
        about, _, kept_state = state.read_bytes().partition(b"\n")
        spent, curve = json.loads(about)
        trainer.restore(kept_state)
    state.parent.mkdir(parents=True, exist_ok=True)
    began, kept = time.process_time() - spent, time.monotonic()
    losses: list[float] = []
    while (spent := time.process_time() - began) < seconds:
        losses.append(float(trainer.step()))
        if trainer.steps_done % _CURVE_STEPS == 0:
            curve.append([round(spent, 1), trainer.steps_done, float(np.mean(losses)) ** 0.5])
            losses = []
        if time.monotonic() - kept > _KEEP_SECONDS:
            unfinished = state.with_suffix(".new")
            unfinished.write_bytes(json.dumps([spent, curve]).encode() + b"\n" + trainer.state())
            unfinished.replace(state)
            kept = time.monotonic()
    return trainer.result(), spent, trainer.steps_done, _thinned(curve)


def _thinned(curve: list[list[float]], most: int = 200) -> list[list[float]]:
    return curve[:: max(1, len(curve) // most)]
