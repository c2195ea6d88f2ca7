"""The decoder written from docs/ssdf_file.md alone, on the file of the default scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from pipelines.ssdf_lighting.compression.compact_file import from_bytes
from tests.reference import ssdf_page_decoder as page


def page_figures(stored: Callable[[str], xr.Dataset]) -> dict[str, Any]:
    """`spec_decoder_mismatches`, numbers that differ, and the same with one bit turned over."""
    file = stored("ssdf_basis")["file"].values.tobytes()
    codes = from_bytes(file)
    lists = {
        name: np.asarray(getattr(codes, name))
        for name in page.Numbers._fields
        if name not in ("step", "n")
    }
    altered = bytearray(file)
    altered[len(file) // 2] ^= 1
    found, null = page.numbers_of(file), page.numbers_of(bytes(altered))
    wrong = page.mismatches(found, lists) + int(found.step != codes.step)
    return {
        "spec_decoder_mismatches": wrong,
        "spec_decoder_numbers": sum(values.size for values in lists.values()),
        "spec_decoder_mismatches_altered": page.mismatches(null, lists),
    }
