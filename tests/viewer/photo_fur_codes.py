"""Depth codes by Python, for the viewer's own tests: `viewer/tests/photo_fur_codes.json`.

python -m tests.viewer.photo_fur_codes
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from assets_defs.workspace import CHECKOUT
from pipelines.photo_fur.attenuation import Tails, depth_code, fit_attenuation

PATH = CHECKOUT / "viewer" / "tests" / "photo_fur_codes.json"
LAYERS = (1, 2, 7, 8, 15, 64, 100, 250)
_TAILS: tuple[Tails, ...] = ("end layers", "dropped")


def values() -> dict[str, Any]:
    """Luminances (float32, -1 where transparent), the medium, and codes by tails and layers."""
    random = np.random.default_rng(4)
    luminance = (random.random(400) ** 2).astype(np.float32)
    medium = fit_attenuation(luminance, tail=0.05)
    # Where layers of 7 meet, as near as floats come.
    luminance[:8] = medium.boundaries(7)
    luminance[8] = 0.0
    opaque = np.arange(400) < 390
    codes = {
        tails: {
            str(layers): depth_code(luminance, medium, layers, tails=tails, opaque=opaque).tolist()
            for layers in LAYERS
        }
        for tails in _TAILS
    }
    stored = np.where(opaque, luminance, -1).astype(np.float32)
    return {
        "brightest": medium.brightest,
        "darkest": medium.darkest,
        "luminance": stored.astype(np.float64).tolist(),
        "codes": codes,
    }


if __name__ == "__main__":
    PATH.write_text(json.dumps(values()) + "\n", encoding="ascii")
