"""Figures of the neural BTF: the paper's tables, and what else could have been done.

The default scale takes one small material through everything, and trains as the paper does against
the clock. ``--scale paper`` makes the tables: four materials, 6561 photographs of 100 x 100 texels,
four columns; every column's figures are written under ``benchmarks/results/`` as they come, and a
run that was stopped goes on with the next one.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import dagster as dg
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from rich.console import Console

from assets_defs.definitions import build_definitions
from assets_defs.launcher import Launcher, Request
from assets_defs.neural_btf.datasets import compressed, payload_bytes
from assets_defs.neural_btf.declaration import NONE, NetworkSettings
from assets_defs.neural_btf.graph import BTF
from assets_defs.neural_btf.network import packed, training_data, training_plan
from assets_defs.workspace import CHECKOUT, Workspace
from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.lowrank import principal_components
from pipelines.neural_btf.compressed import CompressedBtf, restoration_errors
from pipelines.neural_btf.network import Decoder, decoder_arrays, decoder_of
from pipelines.neural_btf.training import Plan, Trained, TrainingData, train
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.weaves import MATERIALS, make_cloth
from storage.readers.btf import open_btf
from storage.schemas import find_schema
from storage.versions import Slot, VersionedStore

RESULTS = Path(__file__).parent / "results"
COLUMNS = (NONE, "500", "1000", "2000")
PAPER_RMSE = {
    "fabric02": (0.0203, 0.0212, 0.0200, 0.0203),
    "WOOL": (0.0264, 0.0275, 0.0274, 0.0274),
    "CORDUROY": (0.0285, 0.0289, 0.0282, 0.0288),
    "PULLI": (0.0337, 0.0346, 0.0340, 0.0340),
}
"""Table 2 of the paper, in the order of the columns: other materials than ours."""
SMALL_MATERIAL = "knit"
SMALL_TEXELS = 40
PAPER_SECONDS = 300.0
PICTURES = {"width": 480, "frames": 6}
"""Smaller pictures than the preset's: they are no figures."""
_console = Console(stderr=True)


def run(scale: str) -> dict[str, Any]:
    """All figures of a scale, keyed as the documentation names them."""
    with _timed("bytes of stored versions"):
        figures = _bytes()
    figures |= _paper_scale() if scale == "paper" else _default_scale()
    return {"scale": scale, **figures}


@contextmanager
def _timed(what: str) -> Iterator[None]:
    started = time.perf_counter()
    yield
    _console.print(f"{what}: {time.perf_counter() - started:.0f} s", highlight=False)


@contextmanager
def _launcher(root: Path) -> Iterator[Launcher]:
    """A launcher on a store of its own; what is current there is skipped."""
    workspace = Workspace(root)

    def heard(what: str, fraction: float) -> None:
        if fraction == 0.0:
            _console.print(f"  {what}", markup=False, highlight=False)

    definitions = build_definitions(workspace, {"progress": heard})
    with dg.DagsterInstance.ephemeral() as instance:
        job = definitions.get_repository_def().get_job
        yield Launcher(instance, workspace, job, heard)


# ---- bytes -----------------------------------------------------------------------------------


def _bytes() -> dict[str, Any]:
    """Table 1: payloads read back from stored versions of the paper's shape, untrained."""
    images, side = 6561, 100
    texels = side * side
    figures: dict[str, Any] = {}
    sides = {}
    with tempfile.TemporaryDirectory() as folder:
        store = VersionedStore(Path(folder))
        for column in COLUMNS:
            clusters = texels if column == NONE else int(column)
            random = np.random.default_rng(clusters)
            network = xr.Dataset(
                {
                    name: (find_schema(BTF.name, "neural_btf").variables[name].dims, values)
                    for name, values in decoder_arrays(Decoder()).items()
                }
            )
            network["latents"] = (
                ("cluster", "latent"),
                random.standard_normal((clusters, 8), dtype=np.float32),
            )
            ids = random.integers(0, clusters, texels, dtype=np.int32)
            groups = xr.Dataset(
                {"ids": ("texel", ids), "sizes": ("cluster", np.ones(clusters, np.int64))}
            )
            matrix = xr.Dataset(
                {"alpha": 1.0, "height": np.int32(side), "width": np.int32(side)},
                coords={"image": np.arange(images)},
            )
            dataset, _ = packed(network, groups, matrix)
            slot = Slot(BTF.name, "compressed_btf", column)
            record = {"settings": {}, "recipe": "", "checks": []}
            store.write(slot, find_schema(BTF.name, "compressed_btf").conform(dataset), record)
            stored = store.open(slot).load()
            figures[f"bytes_{column}"] = payload_bytes(stored)
            chunks = store.folder(slot).rglob("c")
            payload = ("weight", "bias", "latents", "ids")
            in_chunks = sum(
                file.stat().st_size
                for chunk in chunks
                if chunk.parent.name.startswith(payload)
                for file in ([chunk] if chunk.is_file() else chunk.rglob("*"))
                if file.is_file()
            )
            everything = (p for p in store.folder(slot).rglob("*") if p.is_file())
            sides[column] = sum(path.stat().st_size for path in everything) - in_chunks
    figures["bytes_side"] = max(sides.values())
    figures["bytes_raw_float32"] = images * texels * 3 * 4
    figures["bytes_raw_8bit"] = images * texels * 3
    return figures


# ---- the factorisation that is compared with --------------------------------------------------


def _factorisation_rmse(
    abrdfs: NDArray[np.float16], alpha: float, budget: int
) -> tuple[float, int, int]:
    """RMSE over alpha, rank and bytes of a full-matrix factorisation of the log-ABRDFs in fp16.

    The largest rank whose mean, scores and loadings together are not above ``budget`` bytes.
    """
    texels, images, _ = abrdfs.shape
    columns = 3 * images
    rank = max(0, (budget - 2 * columns) // (2 * (texels + columns)))

    def blocks() -> Iterator[NDArray[np.float32]]:
        for first in range(0, images, 81):
            part = abrdfs[:, first : first + 81].astype(np.float32)
            yield np.log1p(part).reshape(texels, -1)

    mean = np.concatenate([block.mean(axis=0, dtype=np.float64) for block in blocks()])
    found = principal_components(blocks, max(1, rank))
    lengths = np.sqrt(found.singular_values)  # shared, so that both factors fit a half float
    scores = (found.scores / lengths).astype(np.float16)[:, :rank].astype(np.float32)
    loadings = (found.loadings * lengths).astype(np.float16)[:, :rank].astype(np.float32)
    mean = mean.astype(np.float16).astype(np.float32)
    total = 0.0
    for first in range(0, texels, 100):
        logs = scores[first : first + 100] @ loadings.T + mean
        wanted = abrdfs[first : first + 100].astype(np.float32).reshape(logs.shape)
        total += float(np.sum(((np.expm1(logs) - wanted) / alpha) ** 2, dtype=np.float64))
    used = 2 * (rank * (texels + columns) + columns)
    return float(np.sqrt(total / (texels * columns))), rank, used


def _halved(stored: CompressedBtf) -> CompressedBtf:
    """The same with weights and latents rounded to half floats."""
    arrays = {
        name: values.astype(np.float16) for name, values in decoder_arrays(stored.decoder).items()
    }
    latents = stored.latents.astype(np.float16).astype(np.float32)
    return replace(stored, decoder=decoder_of(arrays), latents=latents)


def _rmse(stored: CompressedBtf, abrdfs: NDArray[np.float16], pairs: Pairs) -> float:
    errors = restoration_errors(
        stored, lambda a, b: abrdfs[a:b], pairs, block=400, progress=lambda fraction: None
    )
    return errors.rmse


def _against_factorisation(
    stored: CompressedBtf, abrdfs: NDArray[np.float16], pairs: Pairs
) -> dict[str, Any]:
    budget = 2 * (
        sum(v.size for v in decoder_arrays(stored.decoder).values()) + stored.latents.size
    )
    ours = _rmse(_halved(stored), abrdfs, pairs)
    theirs, rank, used = _factorisation_rmse(abrdfs, stored.alpha, budget)
    return {
        "rmse_fp16": ours,
        "bytes_fp16": budget,
        "factorisation_rmse_fp16": theirs,
        "factorisation_rank": rank,
        "factorisation_bytes": used,
        "pca_rmse_ratio": ours / theirs,
    }


# ---- default scale ---------------------------------------------------------------------------


def _default_scale() -> dict[str, Any]:
    clusters = SMALL_TEXELS**2 // 20
    figures: dict[str, Any] = {"material": SMALL_MATERIAL, "texels": SMALL_TEXELS**2}
    with tempfile.TemporaryDirectory() as folder, _launcher(Path(folder)) as launcher:
        store = launcher.workspace.store
        with _timed("photographs to restored photographs"):
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
        stored = compressed(store.open(BTF.slot("compressed_btf", keys[0])))
    pairs = Pairs(matrix["light"].values, matrix["view"].values)
    abrdfs = matrix["abrdfs"].values
    with _timed("against a factorisation"):
        found = _against_factorisation(stored, abrdfs, pairs)
    figures |= {f"{name}_small": value for name, value in found.items()}
    data = training_data(NetworkSettings(), matrix, groups)
    with _timed("encoder against learnt latents"):
        figures |= _encoder_gain(data, stored, abrdfs, pairs)
    with _timed("training as the paper does"):
        figures |= _speedup(data, stored, abrdfs, pairs)
    with _timed("reader, gonioreflectometer"):
        figures |= _reader_speed() | _gonio_speed()
    return figures


def _with(stored: CompressedBtf, trained: Trained) -> CompressedBtf:
    return replace(stored, decoder=trained.decoder, latents=trained.latents)


def _fast_plan(**chosen: Any) -> Plan:
    return training_plan(NetworkSettings(encoder_steps=0, **chosen), 6561)


def _encoder_gain(
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
        rmse = _rmse(_with(stored, trained), abrdfs, pairs)
        found[name] = {"rmse": rmse, "seconds": round(seconds, 1)}
    return {"warm_start_small": found, "warm_start_steps": steps}


def _speedup(
    data: TrainingData, stored: CompressedBtf, abrdfs: NDArray[np.float16], pairs: Pairs
) -> dict[str, Any]:
    """The paper's training for 300 s; then ever longer fast ones until one is as good."""
    started = time.perf_counter()
    plan = training_plan(NetworkSettings(training="paper", paper_steps=10**9), len(pairs.light))
    trained = train(data, plan, stop=lambda _: time.perf_counter() - started > PAPER_SECONDS)
    wanted = _rmse(_with(stored, trained), abrdfs, pairs)
    steps = 50
    while True:
        started = time.perf_counter()
        trained = train(data, _fast_plan(steps=steps))
        seconds = time.perf_counter() - started
        reached = _rmse(_with(stored, trained), abrdfs, pairs)
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


def _reader_speed() -> dict[str, Any]:
    """MB of 8-bit RGB a second from a zip of JPEG photographs of 256 x 256."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "photographs.zip"
        write_photographs(path, hemisphere_table(15), 256)
        started = time.perf_counter()
        measured = open_btf(path)
        for first in range(0, measured.images, measured.lights_per_view):
            measured.read(first, first + measured.lights_per_view)
        seconds = time.perf_counter() - started
    return {"reader_mb_s": measured.images * 256 * 256 * 3 / 1e6 / seconds}


def write_photographs(path: Path, directions: NDArray[np.float64], side: int) -> None:
    """A zip in the layout of UBO2003: woven noise, dimmed with the cosine, as JPEGs."""
    import cv2

    from pipelines.drawing.colour import to_8bit

    random = np.random.default_rng(0)
    coarse = random.random((side // 4, side // 4, 3))
    cloth = coarse.repeat(4, axis=0).repeat(4, axis=1) * 0.5 + 0.2 * random.random((side, side, 3))
    pairs = all_pairs(directions, directions)
    degrees = np.rint(np.degrees(np.concatenate([pairs.light, pairs.view], axis=1))).astype(int)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for number, (light, phi, view, psi) in enumerate(degrees):
            shifted = np.roll(cloth, (number % 7, number % 5), axis=(0, 1))
            picture = to_8bit(shifted * np.cos(np.radians(light)))
            name = f"{number:05d} tl{light:03d} pl{phi:03d} tv{view:03d} pv{psi:03d}.jpg"
            jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
            archive.writestr(f"BTF/CLOTH/tv{view:03d}_pv{psi:03d}/{name}", jpeg)


def _gonio_speed() -> dict[str, Any]:
    """Million rays a second while photographing 3 views under 81 lights, and preparation."""
    directions = hemisphere_table(81)
    started = time.perf_counter()
    gonio = Gonioreflectometer(make_cloth("silk", 0), directions, (100, 100), 4, 0)
    prepared = time.perf_counter() - started
    gonio.photographs(directions[0])  # compiles, where nothing is compiled yet
    before, started = gonio.rays, time.perf_counter()
    for view in (10, 30, 60):
        gonio.photographs(directions[view])
    seconds = time.perf_counter() - started
    return {
        "gonio_mrays_s": (gonio.rays - before) / 1e6 / seconds,
        "gonio_prepare_s": prepared,
    }


# ---- paper scale -----------------------------------------------------------------------------


def _paper_scale() -> dict[str, Any]:
    figures: dict[str, Any] = {"columns": COLUMNS, "paper_table_2": PAPER_RMSE}
    root = Workspace.from_environment().root / "benchmarks"
    with _launcher(root) as launcher:
        for material in MATERIALS:
            for column in COLUMNS:
                figures |= _column(launcher, material, column)
    for column in COLUMNS:
        name = f"rmse_{column}"
        figures[name] = {m: figures[f"{m}_{column}"]["rmse"] for m in MATERIALS}
    ratios = {m: figures[f"{m}_{NONE}"]["pca_rmse_ratio"] for m in MATERIALS}
    figures["pca_rmse_ratio"] = float(np.mean(list(ratios.values())))
    figures["pca_rmse_ratio_each"] = ratios
    with _timed("transposition of 6561 photographs of 256 x 256"):
        figures |= _transposition()
    with _timed("reader, gonioreflectometer"):
        figures |= _reader_speed() | _gonio_speed()
    return figures


def _column(launcher: Launcher, material: str, column: str) -> dict[str, Any]:
    """One column of a material: launched, compared, and written beside the others."""
    from benchmarks.__main__ import commit, machine

    keys = {"material": material, "clusters": column}
    path = RESULTS / f"btf-paper-{material}-{column}.json"
    with _timed(f"{material}, {column}"):
        outcomes = launcher.launch(Request(BTF, [keys], "paper", PICTURES))
    store = launcher.workspace.store
    slot = BTF.slot("restored_images", keys)
    content = store.record(slot)["content"]
    if path.exists():
        known = json.loads(path.read_text())
        if known["content"] == content:
            return {f"{material}_{column}": known}
    errors = store.open(slot)
    dataset = store.open(BTF.slot("compressed_btf", keys))
    figures: dict[str, Any] = {
        "rmse": float(errors["rmse"]),
        "rmse_worst_image": float(errors["rmse_image"].max()),
        "rmse_worst_texel": float(errors["rmse_texel"].max()),
        "alpha": float(dataset["alpha"]),
        "payload_bytes": payload_bytes(dataset),
        "seconds": {o.slot.asset: round(o.seconds, 1) for o in outcomes if o.state == "made"},
    }
    if column == NONE:
        matrix = store.open(BTF.slot("abrdf_matrix", {"material": material}))
        pairs = Pairs(matrix["light"].values, matrix["view"].values)
        abrdfs = matrix["abrdfs"].values
        figures |= _against_factorisation(compressed(dataset), abrdfs, pairs)
    settings = {
        plan.name: store.record(BTF.slot(plan.name, {d: keys[d] for d in plan.by}))["settings"]
        for plan in BTF.plans.values()
    }
    figures |= {"content": content, "settings": settings, "commit": commit(), "machine": machine()}
    path.write_text(json.dumps(figures, indent=2) + "\n")
    return {f"{material}_{column}": figures}


def _transposition() -> dict[str, Any]:
    """Photographs to ABRDFs, from a zip, in a process of its own: its peak memory and time."""
    with tempfile.TemporaryDirectory() as folder:
        code = f"from benchmarks.btf import transpose_in; transpose_in({folder!r})"
        command = [sys.executable, "-c", code]
        done = subprocess.run(
            command, cwd=CHECKOUT, env=dict(os.environ), capture_output=True, text=True, check=True
        )
    found: Mapping[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return dict(found)


def transpose_in(folder: str) -> None:
    """Make `btf_images` and `abrdf_matrix` of a zip in a folder; prints figures as JSON."""
    root = Path(folder)
    path = root / "inbox" / BTF.name / "photographs.zip"
    path.parent.mkdir(parents=True)
    write_photographs(path, hemisphere_table(81), 256)
    started = time.perf_counter()
    with _launcher(root) as launcher:
        (key,) = BTF.sources("material", path.parent).keys() - set(MATERIALS)
        outcomes = launcher.launch(Request(BTF, [{"material": key}], "paper"))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    figures = {
        "transpose_peak_mb": peak / 1e6,
        "transpose_seconds": time.perf_counter() - started,
        "transpose_steps": {o.slot.asset: round(o.seconds, 1) for o in outcomes},
    }
    print(json.dumps(figures))
