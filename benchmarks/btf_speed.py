"""Speed of the reader, of the gonioreflectometer and of the transposition.

``python -m benchmarks.btf_speed FOLDER`` transposes photographs from a zip in a process of its own.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from assets_defs.launcher import Request
from assets_defs.neural_btf.graph import BTF
from assets_defs.workspace import CHECKOUT
from benchmarks.btf_launching import opened_launcher
from pipelines.light.directions import all_pairs, hemisphere_table
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.weaves import MATERIALS, make_cloth
from storage.readers.btf import open_btf


def reader_speed() -> dict[str, Any]:
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


def gonioreflectometer_speed() -> dict[str, Any]:
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


def transposition_speed() -> dict[str, Any]:
    """Photographs to ABRDFs, from a zip, in a process of its own: its peak memory and time."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "benchmarks.btf_speed", folder]
        done = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def transpose_in(folder: str) -> None:
    """Make `btf_images` and `abrdf_matrix` of a zip in a folder; prints figures as JSON."""
    root = Path(folder)
    path = root / "inbox" / BTF.name / "photographs.zip"
    path.parent.mkdir(parents=True)
    write_photographs(path, hemisphere_table(81), 256)
    started = time.perf_counter()
    with opened_launcher(root) as launcher:
        (key,) = BTF.sources("material", path.parent).keys() - set(MATERIALS)
        outcomes = launcher.launch(Request(BTF, [{"material": key}], "paper"))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    figures = {
        "transpose_peak_mb": peak / 1e6,
        "transpose_seconds": time.perf_counter() - started,
        "transpose_steps": {o.slot.asset: round(o.seconds, 1) for o in outcomes},
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    transpose_in(sys.argv[1])
