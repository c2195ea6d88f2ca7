"""The page, whatever system is shown: here one whose live view a test brings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from storage.packages.conformance import SMALL, small_contents
from storage.packages.writing import write_package

SYSTEM = """
globalThis.tsuyaViewers = [{
  name: "conformance",
  async make(pkg, context) {
    const state = { light: [0, 0, 1], red: 0.5, banded: true };
    await pkg.mesh("mesh");
    return {
      controls: [
        { kind: "direction", name: "light", label: "Light" },
        { kind: "slider", name: "red", label: "Red", min: 0, max: 1, step: 0.01 },
        { kind: "toggle", name: "banded", label: "Bands" },
      ],
      navigation: "orbit",
      bounds: { centre: [0, 0, 0], radius: 1 },
      state: () => ({ ...state }),
      setState: (given) => Object.assign(state, given),
      draw(renderer, camera, width, height) {
        const code = (value) => Math.round(255 * Math.min(1, Math.max(0, value)));
        const green = 0.5 + 0.5 * camera.position[0] / Math.hypot(...camera.position);
        const blue = 0.5 + 0.5 * state.light[2];
        renderer.setClearColor((code(state.red) << 16) | (code(green) << 8) | code(blue), 0);
        renderer.clear();
      },
      dispose() {},
    };
  },
}];
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A package of the conformance suite."""
    path = tmp_path / "small.tsuya"
    path.write_bytes(write_package(SMALL, small_contents()))
    return path


def test_a_frame_is_the_radiance_encoded_as_srgb(
    small: Path, open_viewer: Callable[..., Any]
) -> None:
    from pipelines.drawing.colour import to_8bit

    viewer = open_viewer(small, script=SYSTEM).ready()
    viewer.set_view(state={"red": 0.2}, camera={"position": [0.0, 3.0, 0.0]})
    frame = viewer.capture(8, 6, 2)
    expected = to_8bit([51 / 255, 128 / 255, 1.0])
    assert frame.shape == (6, 8, 3)
    assert (frame == expected).all()
