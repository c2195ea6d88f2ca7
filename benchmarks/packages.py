"""Packages: their bytes, what they are exported as, and the viewer against the stage.

One built-in item of each system is made at preset `demo` in a store of its own, packed, exported
and shown in headless Chromium; so all figures of a system belong to one stored version.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from benchmarks.export_formats import format_figures
from benchmarks.viewer_figures import viewer_figures
from storage.packages import Package, read_package
from storage.stored_version import StoredVersion
from storage.versions import Slot, VersionedStore
from storage.zarr_files import stored_bytes
from tsuya.packages import package_slots

ITEMS: dict[str, tuple[str, ...]] = {
    "neural_btf": ("--material", "knit", "--clusters", "none"),
    "glass_scratches": ("--setting", "setting-2", "--object", "plate"),
    "photo_fur": ("--photo", "grass", "--mesh", "teapot"),
    "ssdf_lighting": ("--scene", "teapot", "--environment", "sky"),
    "street_billboards": ("--drive", "city"),
}
"""The built-in item of each system that is shown."""


class Packed(NamedTuple):
    """A system's package as a file, and what it was made from."""

    path: Path
    package: Package
    zarr_bytes: int
    """Of the versions that its asset reads, as they lie in the store."""
    seconds: float
    """From nothing to the package."""


def run() -> dict[str, Any]:
    """All figures, keyed as the documentation names them."""
    console = Console(stderr=True)
    with tempfile.TemporaryDirectory() as folder:
        packed = {}
        for system, item in ITEMS.items():
            packed[system] = _made(system, item, Path(folder))
            console.print(f"{system}: {packed[system].seconds:.0f} s", highlight=False)
        figures = _sizes(packed)
        paths = {system: each.path for system, each in packed.items()}
        steps: Sequence[tuple[str, Callable[[], dict[str, Any]]]] = (
            ("viewer", lambda: viewer_figures(paths, Path(folder))),
            ("formats", format_figures),
        )
        for name, measure in steps:
            started = time.perf_counter()
            figures |= measure()
            console.print(f"{name}: {time.perf_counter() - started:.0f} s", highlight=False)
    return figures


def _made(system: str, item: Sequence[str], folder: Path) -> Packed:
    """Run a system's graph in a process and a store of its own."""
    home, data = folder / system / "dagster", folder / system / "data"
    home.mkdir(parents=True)
    (home / "dagster.yaml").write_text("telemetry: {enabled: false}\n")
    command = [str(Path(sys.executable).parent / "tsuya"), "run", system, *item]
    started = time.perf_counter()
    subprocess.run(
        [*command, "--preset", "demo", "--json"],
        env=os.environ | {"DAGSTER_HOME": str(home), "TSUYA_DATA": str(data)},
        check=True,
        stdout=subprocess.DEVNULL,
    )
    seconds = time.perf_counter() - started
    store = VersionedStore(data / "store")
    (slot,) = package_slots(store)
    version = StoredVersion(store, slot, store.current(slot))
    path = folder / f"{system}.tsuya"
    path.write_bytes(version.dataset["file"].values.tobytes())
    inputs = version.record["inputs"]
    zarr_bytes = sum(
        stored_bytes(store.folder(Slot(system, each["asset"], each["partition"])))
        for each in inputs
    )
    return Packed(path, read_package(path), zarr_bytes, seconds)


def _sizes(packed: dict[str, Packed]) -> dict[str, Any]:
    """Bytes of packages beside those of the Zarr versions that they are made from.

    What is there for people, pictures and the stage's frames, is counted apart: ``package_bytes``
    has it, ``package_runtime_bytes`` has not.
    """
    figures: dict[str, Any] = {"made_s": {name: each.seconds for name, each in packed.items()}}
    figures["package_bytes"] = {name: each.path.stat().st_size for name, each in packed.items()}
    figures["zarr_bytes"] = {name: each.zarr_bytes for name, each in packed.items()}
    figures["package_runtime_bytes"] = {
        name: each.path.stat().st_size - _bytes_for_people(each.package)
        for name, each in packed.items()
    }
    return figures


def _bytes_for_people(package: Package) -> int:
    return sum(
        int(part["bytes"])
        for name, part in package.meta["parts"].items()
        if name in ("poster", "input") or name.startswith("reference_")
    )
