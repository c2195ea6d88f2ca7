"""The hanging cloth in the browser: the stage's pictures, and what can be set."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_defs.neural_btf.graph import BTF
from storage.packages import read_package
from tests.assets_defs.conftest import house, make_house
from tests.viewer.made_packages import made_package, mean_difference

__all__ = ["house", "make_house"]
WITHOUT = {"material": "knit", "clusters": "none"}
CLUSTERED = WITHOUT | {"clusters": "20"}
LEAST_PSNR = 40.0
SMALL = (32, 24)


@pytest.fixture(scope="module")
def packages(house: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Built-in packages of preset `test` by their clusters."""
    folder = tmp_path_factory.mktemp("packages")
    return {
        keys["clusters"]: made_package(house, BTF, keys, folder / f"{keys['clusters']}.tsuya")
        for keys in (WITHOUT, CLUSTERED)
    }


@pytest.mark.parametrize("clusters", ["none", "20"])
def test_pictures_are_the_stages(
    clusters: str, packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    package = read_package(packages[clusters])
    viewer = open_viewer(packages[clusters], size=SMALL).ready()
    views = package.meta["views"]
    for view in views:
        assert viewer.psnr(package, view) >= LEAST_PSNR, view["name"]
    nulls: list[dict[str, Any]] = [{"light": [0.3, -0.9, 0.3]}, {"tiles": 4.05}, {"exposure": 0.4}]
    for null in nulls:
        assert viewer.psnr(package, views[0], **null) < LEAST_PSNR - 8, null


def test_what_is_set_changes_the_picture(
    packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(packages["20"], size=SMALL).ready()
    home = viewer.evaluate("() => window.tsuya.view().state")
    before = viewer.capture(*SMALL)
    assert np.array_equal(viewer.capture(*SMALL), before)
    changes: list[dict[str, Any]] = [
        {"light": [1.0, -0.3, 0.1]},
        {"tiles": 2.0},
        {"exposure": -1.0},
    ]
    for changed in changes:
        viewer.set_view(state=home | changed)
        found = viewer.evaluate("() => window.tsuya.view().state")
        for name, value in changed.items():
            direction = np.asarray(value) / (np.linalg.norm(value) if name == "light" else 1.0)
            np.testing.assert_allclose(found[name], direction, atol=1e-6)
        assert mean_difference(viewer.capture(*SMALL), before) > 1.0, changed
    viewer.set_view(state=home)
    assert np.array_equal(viewer.capture(*SMALL), before)


def test_a_drag_with_the_right_button_moves_the_light(
    packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(packages["none"], size=(240, 180)).ready()
    before = viewer.evaluate("() => window.tsuya.view()")
    mouse = viewer.page.mouse
    mouse.move(100, 60)
    mouse.down(button="right")
    mouse.move(130, 75, steps=3)
    mouse.up(button="right")
    after = viewer.evaluate("() => window.tsuya.view()")
    assert after["camera"] == before["camera"]
    assert np.linalg.norm(np.subtract(after["state"]["light"], before["state"]["light"])) > 0.1
    assert np.linalg.norm(after["state"]["light"]) == pytest.approx(1.0)
    mouse.move(100, 60)
    mouse.down()
    mouse.move(130, 75, steps=3)
    mouse.up()
    turned = viewer.evaluate("() => window.tsuya.view()")
    assert turned["state"] == after["state"]
    assert turned["camera"]["position"] != after["camera"]["position"]


def test_what_cannot_be_set_is_refused(
    packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(packages["20"], size=SMALL).ready()
    for state, said in (
        ({"tiles": 0}, "tiles is 0; expected a positive number"),
        ({"light": [0, 0, 0]}, r"light is [0,0,0]; expected [x, y, z]"),
        ({"colour": 1}, "state has colour; expected light, tiles, exposure"),
    ):
        message = viewer.evaluate(
            "state => { try { window.tsuya.setView({ state }); } catch (e) { return e.message; } }",
            state,
        )
        assert said in message
