"""Numerics: arrays in, arrays out. Knows neither Dagster nor Zarr nor files."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path


def _set_up_numba() -> None:
    """Where numba keeps compiled kernels, and how its threads are made; before it is imported.

    Numba compiles a kernel again when its own file changes, not when one does that it calls into:
    an upgraded project would run old code. So compiled kernels belong to one state of all sources.
    OpenMP comes first: the TBB that Open3D brings along is too old for numba, which says so aloud.
    """
    here = Path(__file__).parent
    state = hashlib.sha256()
    for file in sorted(here.rglob("*.py")):
        status = file.stat()
        state.update(f"{file.relative_to(here)} {status.st_size} {status.st_mtime_ns}\n".encode())
    folder = here / "__pycache__" / f"numba-{state.hexdigest()[:16]}"
    os.environ.setdefault("NUMBA_CACHE_DIR", str(folder))
    os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp tbb workqueue")
    if "numba" in sys.modules:  # imported before, by someone else
        sys.modules["numba"].config.reload_config()


_set_up_numba()
