"""What was done to a light probe is in the metadata of what is made with it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from assets_defs.glass_scratches.frames import FrameSettings, environment
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.graph import SSDF
from assets_defs.ssdf_lighting.lights import LightSettings
from assets_defs.system import NOTES


@pytest.fixture
def probe(tmp_path: Path) -> Path:
    light = np.ones((16, 32, 3), np.float32)
    light[3, 5] = math.inf
    light[12, 0, 1] = -0.25
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": light}) as file:
        file.write(str(tmp_path / "sun.exr"))
    return tmp_path / "sun.exr"


SAID = (
    "3 infinite values became 65504, the half's largest.",
    "1 texel was negative (the least -0.25) and became 0.",
)


def test_lights(probe: Path) -> None:
    made, metadata = SSDF.plans["environment_lights"].function(
        settings=LightSettings(lights=1), source=Source.of(probe), progress=lambda done: None
    )
    assert metadata[NOTES] == SAID
    assert made["radiance"].values.max() == 65504


def test_frames(probe: Path) -> None:
    light = environment(FrameSettings(environment=str(probe)))
    assert light.notes == SAID
    assert environment(FrameSettings(environment="lamps")).notes == ()
