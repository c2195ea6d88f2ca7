"""Lit scenes live in a browser, against the stage's frames; the decoder's fixture."""

from __future__ import annotations

import base64
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_defs.ssdf_lighting import package as lit
from assets_defs.workspace import CHECKOUT
from storage.packages import Package, read_package
from tests import lit_packages
from tests.viewer import ssdf_fixture

PSNR = 40.0
SETTINGS = lit.LitPackageSettings(view_width=128, poster_width=64)


def _written(folder: Path, *, textured: bool) -> Path:
    packed = lit_packages.inputs(lit_packages.scene(textured=textured))
    path = folder / ("textured.tsuya" if textured else "plain.tsuya")
    path.write_bytes(lit_packages.package_bytes(packed, lit._pictures(SETTINGS, packed)))
    return path


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _written(tmp_path_factory.mktemp("plain"), textured=False)


def _views(package: Package) -> dict[str, dict[str, Any]]:
    return {view["name"]: view for view in package.meta["views"]}


def test_the_page_shows_what_the_stage_shows(plain: Path, open_viewer: Callable[..., Any]) -> None:
    package, viewer = read_package(plain), open_viewer(plain).ready()
    for name, view in _views(package).items():
        assert viewer.psnr(package, view) >= PSNR, name
    views = _views(package)
    # Nulls: another turn, no shadows, no clusters are far off.
    assert viewer.psnr(package, views["turn_0"], turn=40.0) < 30
    assert viewer.psnr(package, views["turn_120"], shadows=False) < 30
    assert viewer.psnr(package, views["clusters"], clusters=False) < 30


def test_textures_are_the_stages_too(tmp_path: Path, open_viewer: Callable[..., Any]) -> None:
    path = _written(tmp_path, textured=True)
    package, viewer = read_package(path), open_viewer(path).ready()
    views = _views(package)
    assert viewer.psnr(package, views["turn_0"]) >= PSNR
    assert viewer.psnr(package, views["turn_0"], turn=40.0) < 30


def test_settings_change_the_picture(plain: Path, open_viewer: Callable[..., Any]) -> None:
    viewer = open_viewer(plain).ready()
    # Up into the sky: below the horizon the environment is the same all around.
    viewer.set_view(camera={"position": [2.5, 0.0, 0.2], "target": [0.0, 0.0, 0.5]})

    def shown(**state: Any) -> Any:
        viewer.set_view(state={"behind": False, "exposure": 0.0, "turn": 0.0} | state)
        return viewer.capture(96, 64).astype(float)

    first = shown()
    assert shown(exposure=1.0).mean() > first.mean() + 5
    behind = shown(behind=True)
    assert np.abs(behind - first)[:8].mean() > 5
    assert np.abs(shown(behind=True, turn=90.0) - behind)[:8].mean() > 1
    assert np.array_equal(shown(), first)


def test_a_light_of_ones_own(plain: Path, tmp_path: Path, open_viewer: Callable[..., Any]) -> None:
    import cv2

    radiance = np.full((32, 64, 3), 0.05, np.float32)
    radiance[8:11, 40:44] = (2.0, 4.0, 40.0)  # BGR: a red lamp
    probe = tmp_path / "lamp.hdr"
    cv2.imwrite(str(probe), radiance)
    viewer = open_viewer(plain).ready()
    before = viewer.capture(96, 64).astype(float)
    viewer.page.set_input_files("input[type=file]", str(probe))
    end = time.monotonic() + 240
    while viewer.evaluate("() => window.tsuya.figures().light") != "lamp.hdr":
        assert time.monotonic() < end
        time.sleep(0.5)
    after = viewer.capture(96, 64).astype(float)
    assert after[..., 0].mean() / after[..., 2].mean() > 1.25 * (
        before[..., 0].mean() / before[..., 2].mean()
    )
    assert (
        viewer.evaluate("() => window.tsuya.figures()['relative error of their irradiance']") < 0.1
    )


def test_an_exr_is_refused_with_a_way_out(
    plain: Path, tmp_path: Path, open_viewer: Callable[..., Any]
) -> None:
    probe = tmp_path / "studio.exr"
    probe.write_bytes(b"\x76\x2f\x31\x01")
    viewer = open_viewer(plain).ready()
    viewer.page.set_input_files("input[type=file]", str(probe))
    viewer.page.get_by_text("studio.exr: file is an OpenEXR").first.wait_for()


def test_the_decoders_fixture_is_what_python_says() -> None:
    stored = json.loads((CHECKOUT / "viewer" / "tests" / ssdf_fixture.NAME).read_text())
    made = ssdf_fixture.values(base64.b64decode(stored["file"]))
    assert set(stored) == set(made)
    flat, known = dict(made), dict(stored)
    for name in ("suns", "bounce"):
        flat |= {f"{name}_{key}": value for key, value in flat.pop(name).items()}
        known |= {f"{name}_{key}": value for key, value in known.pop(name).items()}
    assert set(flat) == set(known)
    for name, value in flat.items():
        if isinstance(value, str):
            assert known[name] == value, name
        else:
            assert np.allclose(known[name], value, rtol=1e-5, atol=1e-6), name
