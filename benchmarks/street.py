"""Figures of streets: bytes of textures, pictures that were held out, speed of drawing.

The built-in drive of 300 m goes through the graph once as it is and once with the paper's plain
sampling; docs/street.md says what each figure means.
"""

from __future__ import annotations

import functools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from assets_defs.street_billboards.capture_datasets import viewers
from assets_defs.street_billboards.datasets import (
    billboards_of,
    compressed_of,
    pages_of,
    views_of,
)
from assets_defs.street_billboards.graph import STREET
from assets_defs.workspace import CHECKOUT, Workspace
from benchmarks.street_codecs import blocks_coded
from benchmarks.street_drive import KEYS, launch
from benchmarks.street_points import drawn_points
from pipelines.drawing.picture_metrics import (
    ImageMetrics,
    image_metrics,
    psnr,
    psnr_of_squared_errors,
    squared_errors,
)
from pipelines.drawing.stage import Stage
from pipelines.street_billboards import figures
from pipelines.street_billboards.billboards import HEADER_BYTES, Billboards
from pipelines.street_billboards.capture.stereo import match_rectified_pair, opencv_disparities
from pipelines.street_billboards.capture.weighted_median import fill_disparity_holes
from pipelines.street_billboards.drawing.processor_street import ProcessorStreet
from pipelines.street_billboards.drawing.shader_street import ShaderStreet
from pipelines.street_billboards.drawing.stage_camera import stage_camera
from pipelines.street_billboards.textures import eigen_textures as coding
from pipelines.street_billboards.textures.texture_tables import SEEN, ViewTextures
from storage.readers.street_photographs import motorcycle

FRAMES = 100
PAGE = 4096
"""Billboards of the paper's page: its r = 16 is compared on so many."""
BLOCK_BILLBOARDS = 2048
"""That the block codecs, slow at their best, are compared on."""
POLE_PIXELS = 32
SPEED_FRAMES = 12
POINT_BYTES = 9
"""Three times 16 bits of place and three bytes of colour."""
SKY_BYTES_A_TEXEL = 3

Stored = Callable[[str], xr.Dataset]


def run() -> dict[str, Any]:
    """All figures."""
    figures_found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        figures_found |= _preprocessed(folder)
        store = Workspace(folder).store

        def stored(asset: str) -> xr.Dataset:
            return store.open(STREET.slot(asset, KEYS))

        for part in (_bytes, _paper_form, _blocks, _held_out, _speed, _stereo):
            _timed(figures_found, part.__name__, functools.partial(part, stored, figures_found))
        _timed(figures_found, "plain", lambda: _plain(folder, stored, figures_found))
    figures_found.pop("_pole", None)
    return figures_found


def _timed(found: dict[str, Any], name: str, part: Callable[[], dict[str, Any]]) -> None:
    start = time.perf_counter()
    found |= part()
    print(f"{name.strip('_')}: {time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)


def _preprocessed(folder: Path) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.street_drive", str(folder), str(FRAMES)]
    done = subprocess.run(command, cwd=CHECKOUT, check=True, stdout=subprocess.PIPE, text=True)
    made: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    seconds = made["seconds"]
    preparing = {n: s for n, s in seconds.items() if n not in ("drive_frames", "street_frames")}
    print(f"graph: {sum(seconds.values()):.0f} s", file=sys.stderr, flush=True)
    return {
        "frames": FRAMES,
        "steps_s": seconds,
        "preprocess_s_per_frame": sum(preparing.values()) / FRAMES,
        "peak_rss_mb": made["peak_rss_mb"],
    }


# ---- bytes -----------------------------------------------------------------------------------


def _bytes(stored: Stored, _: dict[str, Any]) -> dict[str, Any]:
    textures = compressed_of(stored("eigen_textures"))
    views = views_of(stored("view_textures"))
    count = len(textures.ranks)
    parts = coding.byte_counts(textures)
    rmse, psnr = coding.decode_error(views, textures)
    sky = stored("depth_maps")["sky"]
    behind = sky.size // 3 // 2 * SKY_BYTES_A_TEXEL  # its upper half, a byte a channel
    metres = figures.path_length(viewers(stored("drive_frames")))
    everything = parts["total"] + HEADER_BYTES * count + behind
    return {
        "billboards": count,
        "views": len(views.direction),
        "raw_bytes_per_billboard": figures.RAW_BYTES,
        "bytes_per_billboard": parts["total"] / count,
        "bytes_per_billboard_by_part": {name: value / count for name, value in parts.items()},
        "bytes_of_place_per_billboard": HEADER_BYTES,
        "bytes_ratio": figures.RAW_BYTES * count / parts["total"],
        "observed_bytes_ratio": views.colours.nbytes / parts["total"],
        "decode_rmse_codes": rmse,
        "decode_psnr": psnr,
        "metres": metres,
        "bytes_all": everything,
        "bytes_per_metre": everything / metres,
        "bytes_of_pages_with_padding": int(
            stored("texture_atlases")["bytes"] + stored("texture_atlases")["padding"]
        ),
    }


def _some(stored: Stored, count: int) -> tuple[ViewTextures, NDArray[np.bool_]]:
    """Views of so many billboards from all along the road, and which of them turn."""
    views, turns = views_of(stored("view_textures")), stored("billboards")["turns"].values
    shown = np.flatnonzero(np.diff(views.first) > 0)
    rows = shown[np.linspace(0, len(shown) - 1, min(count, len(shown))).astype(int)]
    chosen = np.concatenate([np.arange(views.first[r], views.first[r + 1]) for r in rows])
    first = np.concatenate([[0], np.cumsum(np.diff(views.first)[rows])])
    return ViewTextures(first, *(values[chosen] for values in views[1:])), turns[rows]


def _paper_form(stored: Stored, _: dict[str, Any]) -> dict[str, Any]:
    views, turns = _some(stored, PAGE)
    paper = coding.compress_views_as_paper(views, turns, rank=16)
    parts = coding.byte_counts(paper)
    count = len(turns)
    ours = coding.compress_views(views, turns, error=4.4)
    return {
        "bytes_r16": (parts["eigen"] + parts["weights"] + parts["means"]) / count,
        "bytes_r16_side": parts["scales"] / count,
        "decode_psnr_r16": coding.decode_error(views, paper)[1],
        "bytes_ours_same_billboards": coding.byte_counts(ours)["total"] / count,
        "decode_psnr_ours_same_billboards": coding.decode_error(views, ours)[1],
    }


def _blocks(stored: Stored, found: dict[str, Any]) -> dict[str, Any]:
    """Block codecs on the views of some billboards, ours on the same."""
    views, turns = _some(stored, BLOCK_BILLBOARDS)
    seen = views.states == SEEN
    rivals = {}
    for name in ("bc1", "bc7"):
        pictures, size = blocks_coded(name, views.colours, seen)
        apart = pictures[seen].astype(np.float64) - views.colours[seen]
        rivals[name] = (psnr_of_squared_errors(apart**2), size)
    curve = []
    for error in (3.0, 4.4, 5.0):
        ours = coding.compress_views(views, turns, error=error)
        parts = coding.byte_counts(ours)
        psnr = coding.decode_error(views, ours)[1]
        able = {name: size for name, (quality, size) in rivals.items() if quality >= psnr}
        point: dict[str, Any] = {"psnr": psnr, "bytes": parts["total"] / len(turns)}
        if able:
            cheapest = min(able, key=lambda name: able[name])
            # Alpha is the same masks on both sides.
            point |= {
                "rival": cheapest,
                "ratio": (able[cheapest] + parts["alpha"]) / parts["total"],
                "ratio_without_alpha": able[cheapest] / (parts["total"] - parts["alpha"]),
            }
        curve.append(point)
    default = curve[1]
    return {
        "bc_billboards": len(turns),
        "bc1_psnr": rivals["bc1"][0],
        "bc1_bytes_per_billboard": rivals["bc1"][1] / len(turns),
        "bc7_psnr": rivals["bc7"][0],
        "bc7_bytes_per_billboard": rivals["bc7"][1] / len(turns),
        "bc_ours_psnr": default["psnr"],
        "bc_ours_bytes_per_billboard": default["bytes"],
        "bc_rival": default.get("rival"),
        "bc_bytes_ratio": default.get("ratio"),
        "bc_curve": curve,
    }


# ---- pictures --------------------------------------------------------------------------------


def _judged(
    pictures: NDArray[np.uint8], truths: NDArray[np.uint8], where: NDArray[np.bool_]
) -> list[ImageMetrics]:
    evened = [figures.match_exposure(*one) for one in zip(pictures, truths, where, strict=True)]
    return [image_metrics(*one) for one in zip(evened, truths, where, strict=True)]


def _pole_squares(stored: Stored) -> list[NDArray[np.float64]]:
    """Squared errors near the poles' true silhouettes, frame by frame."""
    shown, drive = stored("street_frames"), stored("drive_frames")
    return [
        squared_errors(picture, truth, figures.dilated(pole, POLE_PIXELS) & np.isfinite(depth))
        for picture, truth, pole, depth in zip(
            shown["rendered"].values,
            shown["truth"].values,
            drive["truth_pole"].values,
            drive["truth_depth"].values,
            strict=True,
        )
    ]


def _held_out(stored: Stored, found: dict[str, Any]) -> dict[str, Any]:
    """Pictures against what was held out: where billboards are, unless a key says whole frame."""
    shown, drive = stored("street_frames"), stored("drive_frames")
    truth, covered = shown["truth"].values, shown["covered"].values
    solid = np.isfinite(drive["truth_depth"].values)
    offpath = {}
    for number, offset in enumerate(shown["offset"].values):
        where = shown["beside_covered"].values[:, number]
        judged = _judged(
            shown["beside"].values[:, number], shown["beside_truth"].values[:, number], where
        )
        offpath[f"{offset:g}"] = float(np.mean([one.psnr for one in judged]))
    points = stored("street_points")
    middle = drive.sizes["camera"] // 2
    drawn = drawn_points(
        points["positions"].values,
        points["colours"].values,
        int(found["bytes_all"] // POINT_BYTES),
        drive["intrinsics"].values[middle],
        drive["poses"].values[drive["held_out"].values, middle],
        (drive.sizes["x"], drive.sizes["y"]),
    )
    both = covered & drawn.covered
    rendered = shown["rendered"].values
    ours = [psnr(*one) for one in zip(rendered, truth, both, strict=True)]
    theirs = [one.psnr for one in _judged(drawn.pictures, truth, both)]
    return {
        "held_out_psnr": float(shown["psnr"].mean()),
        "held_out_psnr_least": float(shown["psnr"].min()),
        "held_out_psnr_whole_frame": figures.mean_psnr(rendered, truth, np.ones_like(covered)),
        "held_out_ssim": float(shown["ssim"].mean()),
        "held_out_flip": float(shown["flip"].mean()),
        "coverage": float(covered.mean()),
        "coverage_of_surfaces": float(covered[solid].mean()),
        "offpath_psnr_db": offpath,
        "points_gain_db": float(np.mean(ours) - np.mean(theirs)),
        "points_gain_db_least": float(np.min(np.array(ours) - theirs)),
        "points": drawn.number,
        "points_bytes_share": drawn.number * POINT_BYTES / found["bytes_all"],
        "points_coverage": float(drawn.covered.mean()),
        "_pole": _pole_squares(stored),
    }


def _plain(folder: Path, stored: Stored, found: dict[str, Any]) -> dict[str, Any]:
    """The same street with textures from the best photograph, whatever stands before it."""
    launch(folder, {"sampling": "plain"}, None)
    aware, plain = found["_pole"], _pole_squares(stored)
    plain_frames = stored("street_frames")
    gains = [
        psnr_of_squared_errors(mine) - psnr_of_squared_errors(theirs)
        for mine, theirs in zip(aware, plain, strict=True)
        if len(mine)
    ]
    return {
        "occlusion_gain_db": psnr_of_squared_errors(np.concatenate(aware))
        - psnr_of_squared_errors(np.concatenate(plain)),
        "occlusion_gain_db_by_frame": gains,
        "plain_held_out_psnr": float(plain_frames["psnr"].mean()),
        "plain_held_out_psnr_whole_frame": figures.mean_psnr(
            plain_frames["rendered"].values,
            plain_frames["truth"].values,
            np.ones(plain_frames["covered"].shape, bool),
        ),
    }


# ---- speed, stereo ---------------------------------------------------------------------------


def _speed(stored: Stored, _: dict[str, Any]) -> dict[str, Any]:
    """Frames a second along the drive, sending what is visible and drawing it."""
    drive = stored("drive_frames")
    made: Billboards = billboards_of(stored("billboards"))
    textures = compressed_of(stored("eigen_textures"))
    middle = drive.sizes["camera"] // 2
    lens, size = drive["intrinsics"].values[middle], (drive.sizes["x"], drive.sizes["y"])
    poses = drive["poses"].values[:, middle]
    poses = poses[np.linspace(0, len(poses) - 1, SPEED_FRAMES).astype(int)]
    seconds: dict[str, float] = {}
    visible: list[int] = []
    for name, street in (
        ("shader", ShaderStreet(made, pages_of(stored("texture_atlases")))),
        ("cpu", ProcessorStreet(made, textures)),
    ):
        with Stage(*size) as stage:
            stage.add(*street.actors)
            times = []
            for lap in range(2):  # the first compiles and uploads
                for pose in poses:
                    start = time.perf_counter()
                    count = street.look(lens, pose, *size)
                    stage.look(stage_camera(lens, pose, size[1]))
                    stage.draw()
                    if lap:
                        times.append(time.perf_counter() - start)
                        visible.append(count)
            seconds[name] = float(np.mean(times))
            renderer = stage.renderer_name
    pictures = stored("street_frames")
    apart = np.abs(pictures["shaded"].values.astype(int) - pictures["decoded"].values).max(axis=-1)
    return {
        "renderer": renderer,
        "fps": 1.0 / seconds["shader"],
        "cpu_fps": 1.0 / seconds["cpu"],
        "shader_vs_cpu_fps_ratio": seconds["cpu"] / seconds["shader"],
        "visible_billboards": float(np.mean(visible)),
        "shader_vs_cpu_within_a_code": float((apart <= 1).mean()),
    }


def _stereo(_: Stored, __: dict[str, Any]) -> dict[str, Any]:
    pair = motorcycle()
    found, _other = match_rectified_pair(pair.left, pair.right, pair.most)
    plain = opencv_disparities(pair.left, pair.right, pair.most)
    dense = fill_disparity_holes(found.disparity, pair.left)
    return {
        "stereo_bad05_percent": 100 * figures.bad_pixel_share(dense, pair.disparity),
        "stereo_bad05_percent_with_holes": 100
        * figures.bad_pixel_share(found.disparity, pair.disparity),
        "stereo_bad05_percent_opencv": 100 * figures.bad_pixel_share(plain, pair.disparity),
    }
