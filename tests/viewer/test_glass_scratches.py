"""Scratched glass in the browser: the stage's pictures, and what can be set."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.glass_scratches.graph import SCRATCHES
from storage.packages import Package, read_package, write_package
from storage.packages.glass_scratches import PACKAGE
from tests.assets_defs.conftest import house, make_house
from tests.tsuya.exports.test_scratch_tables import glass_contents, glass_values
from tests.viewer.made_packages import made_package, mean_difference

__all__ = ["house", "make_house"]
KEYS = {"setting": "setting-2", "object": "plate"}
CLEAR = {"setting": "clear", "object": "plate"}
LEAST_PSNR = 46.0
SMALL = (64, 48)
CHANGES: dict[str, Any] = {
    "tilt": -25,
    "swing": -40,
    "turn": -60,
    "brightness": 0.4,
    "coverage": 3,
    "strength": 0.25,
    "tile": 0.5,
    "lamp": 0,
    "light": [-0.6, 0.0, 0.8],
    "environment": "sky",
    "layer_1": False,
}
"""What a person can set, otherwise than at first."""


@pytest.fixture(scope="module")
def package(house: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built-in package of preset `test`."""
    path = tmp_path_factory.mktemp("package") / "glass.tsuya"
    return made_package(house, SCRATCHES, KEYS, path)


@pytest.fixture(scope="module")
def clear(house: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One of scratches whose walls keep the lean."""
    path = tmp_path_factory.mktemp("package") / "clear.tsuya"
    return made_package(house, SCRATCHES, CLEAR, path)


@pytest.fixture
def opened(package: Path) -> Package:
    return read_package(package)


def test_pictures_are_the_stages(
    package: Path, opened: Package, open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(package).ready()
    for view in opened.meta["views"]:
        assert viewer.psnr(opened, view) >= LEAST_PSNR, view["name"]
    close = next(view for view in opened.meta["views"] if view["name"] == "close")
    nulls: list[dict[str, Any]] = [
        {"strength": 0.0},
        {"tile": 1.3},
        {"layer_1": False},
        {"environment": "sky"},
        {"lamp": 3.0, "light": [-0.8, 0.48, 0.36]},
    ]
    for null in nulls:
        assert viewer.psnr(opened, close, **null) < LEAST_PSNR - 2, null


def test_clear_walls_are_the_stages(clear: Path, open_viewer: Callable[..., Any]) -> None:
    viewer, opened = open_viewer(clear).ready(), read_package(clear)
    assert opened.parameter("keeps_lean") is True
    for view in opened.meta["views"]:
        assert viewer.psnr(opened, view) >= LEAST_PSNR, view["name"]
        for null in ({"strength": 0.0}, {"tile": 1.3}, {"layer_1": False}):
            assert viewer.psnr(opened, view, **null) < LEAST_PSNR - 8, (view["name"], null)


def test_a_package_of_another_schema_is_refused(
    open_viewer: Callable[..., Any], tmp_path: Path
) -> None:
    old = tmp_path / "old.tsuya"
    content = write_package(replace(PACKAGE, number=1), glass_contents(glass_values()))
    old.write_bytes(content)
    viewer = open_viewer(old, allowed="schema is 1")
    viewer.page.wait_for_selector("text=schema is 1; expected 2: make the package again")


def test_what_is_set_changes_the_picture(package: Path, open_viewer: Callable[..., Any]) -> None:
    viewer = open_viewer(package).ready()
    first = viewer.evaluate("() => window.tsuya.view().state")
    before = viewer.capture(*SMALL)
    assert np.array_equal(viewer.capture(*SMALL), before)
    for name, value in CHANGES.items():
        viewer.set_view(state=first | {name: value})
        assert mean_difference(viewer.capture(*SMALL), before) > 0.3, name
        assert viewer.evaluate("() => window.tsuya.view().state")[name] == value
    viewer.set_view(state=first)
    assert np.array_equal(viewer.capture(*SMALL), before)


def test_the_lamp_is_dragged_on_the_picture(package: Path, open_viewer: Callable[..., Any]) -> None:
    viewer = open_viewer(package, size=(320, 240)).ready()
    before = viewer.evaluate("() => window.tsuya.view().state")["light"]
    shown = viewer.capture(*SMALL)
    mouse = viewer.page.mouse
    mouse.move(240, 160)
    mouse.down(button="right")
    mouse.move(200, 190, steps=3)
    mouse.up(button="right")
    after = viewer.evaluate("() => window.tsuya.view().state")["light"]
    assert np.isclose(np.linalg.norm(after), 1.0)
    assert not np.allclose(after, before, atol=0.02)
    assert mean_difference(viewer.capture(*SMALL), shown) > 0.3


def _hdr(path: Path, light: NDArray[np.float32]) -> Path:
    assert cv2.imwrite(str(path), light[..., ::-1])
    return path


def test_an_environment_of_ones_own(
    package: Path, open_viewer: Callable[..., Any], tmp_path: Path
) -> None:
    """The same light in a file is the same picture; other light is another."""
    opened = read_package(package)
    room = opened.picture("environment_room").view(np.float16).astype(np.float32)
    viewer = open_viewer(package).ready()
    before = viewer.capture(*SMALL)
    drop = "input[name=file]"
    viewer.page.set_input_files(drop, str(_hdr(tmp_path / "same.hdr", 7 * room)))
    viewer.wait_for("() => window.tsuya.view().state.environment === 'yours'")
    assert mean_difference(viewer.capture(*SMALL), before) < 1.0  # RGBE has 8 bits of each number
    blue = np.zeros((32, 64, 3), np.uint8)
    blue[..., 0] = 255
    assert cv2.imwrite(str(tmp_path / "blue.png"), blue)
    viewer.page.set_input_files(drop, str(tmp_path / "blue.png"))
    viewer.page.wait_for_timeout(500)
    shown = viewer.capture(*SMALL).astype(int)
    assert shown[..., 2].mean() > shown[..., 0].mean() + 50


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("cut.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n\2\2", "no whole Radiance"),
        ("text.png", b"no picture", "no picture that this browser reads"),
        ("square.png", cv2.imencode(".png", np.full((8, 8, 3), 9, np.uint8))[1].tobytes(), "twice"),
        ("black.png", cv2.imencode(".png", np.zeros((8, 16, 3), np.uint8))[1].tobytes(), "black"),
    ],
)
def test_what_is_no_environment_is_refused_in_a_sentence(
    name: str,
    content: bytes,
    sentence: str,
    package: Path,
    open_viewer: Callable[..., Any],
    tmp_path: Path,
) -> None:
    viewer = open_viewer(package).ready()
    before = viewer.capture(*SMALL)
    (tmp_path / name).write_bytes(content)
    viewer.page.set_input_files("input[name=file]", str(tmp_path / name))
    viewer.page.wait_for_selector(f"text={sentence}")
    assert np.array_equal(viewer.capture(*SMALL), before)


def test_turning_all_together_changes_nothing(
    package: Path, open_viewer: Callable[..., Any]
) -> None:
    """Glass, environment, lamp and camera turned by a right angle about up."""
    viewer = open_viewer(package).ready()
    shown = viewer.evaluate("() => window.tsuya.view()")
    camera, state = shown["camera"], shown["state"]
    before = viewer.capture(*SMALL)
    (x, y, z), (u, v, w) = camera["position"], state["light"]
    viewer.set_view(
        camera=camera | {"position": [-y, x, z]},
        state={"swing": 90.0, "turn": state["turn"] + 90.0, "light": [-v, u, w]},
    )
    assert mean_difference(viewer.capture(*SMALL), before) < 0.5
    viewer.set_view(state={"swing": 0.0})
    assert mean_difference(viewer.capture(*SMALL), before) > 2.0
