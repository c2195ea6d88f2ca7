"""Fur in the browser: the stage's pictures, and what can be set."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Error

from assets_defs.photo_fur.graph import FUR
from storage.packages import Package, read_package
from tests.assets_defs.conftest import house, make_house
from tests.viewer import photo_fur_codes, photo_fur_laying
from tests.viewer.made_packages import made_package, mean_difference

__all__ = ["house", "make_house"]
KEYS = {"photo": "chelsea", "mesh": "teapot"}
LEAST_PSNR = 40.0
SMALL = (64, 48)


@pytest.fixture(scope="module")
def package(house: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package of preset `test`."""
    path = tmp_path_factory.mktemp("package") / "fur.tsuya"
    return made_package(house, FUR, KEYS, path)


@pytest.fixture
def opened(package: Path) -> Package:
    return read_package(package)


def test_pictures_are_the_stages(
    package: Path, opened: Package, open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(package).ready()
    views = {view["name"]: view for view in opened.meta["views"]}
    assert list(views) == [
        *("front", "right", "back", "left", "close"),
        *("full", "wind", "far", "plain", "other_shells"),
    ]
    found = {name: viewer.psnr(opened, view) for name, view in views.items()}
    assert min(found.values()) >= LEAST_PSNR, found
    nulls: list[tuple[str, dict[str, Any]]] = [
        ("close", {"look": "plain"}),
        ("plain", {"layers": 3}),
        ("close", {"thickness": 0.5}),
        ("plain", {"fill": "bands"}),
        ("close", {"headlight": 0.8}),
        ("close", {"sky": 0.2}),
        ("close", {"light": [0.48, -0.6, 0.64]}),
        ("wind", {"wind": 0.0}),
        ("wind", {"moment": 2.8}),
        # Where all of the picture is fur another background changes nothing.
        ("front", {"background": "night"}),
    ]
    for name, null in nulls:
        assert viewer.psnr(opened, views[name], **null) < LEAST_PSNR - 6, null


def test_other_numbers_of_layers_have_the_stages_codes(
    package: Path, opened: Package, open_viewer: Callable[..., Any]
) -> None:
    """Of the plain look; codes are made in the page."""
    viewer = open_viewer(package).ready()
    view = next(view for view in opened.meta["views"] if view["name"] == "other_shells")
    assert viewer.psnr(opened, view) >= LEAST_PSNR
    viewer.set_view(state={"layers": opened.parameter("layers")})
    viewer.capture(*SMALL)
    assert viewer.psnr(opened, view) >= LEAST_PSNR


@pytest.mark.parametrize(
    "changed",
    [
        {"look": "plain"},
        {"look": "plain", "layers": 4},
        {"thickness": 2.5},
        {"headlight": 0.0},
        {"sky": 0.6},
        {"lamp": 0.0},
        {"light": [0.9, 0.3, 0.3]},
        {"background": "paper"},
    ],
    ids=lambda changed: list(changed)[-1],
)
def test_what_is_set_changes_the_picture(
    changed: dict[str, Any], package: Path, open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(package).ready()
    before = viewer.capture(*SMALL)
    assert np.array_equal(viewer.capture(*SMALL), before)
    viewer.set_view(state=changed)
    assert mean_difference(viewer.capture(*SMALL), before) > 0.3
    name = list(changed)[-1]
    found = viewer.evaluate("() => window.tsuya.view().state")[name]
    same = (
        found == changed[name]
        if isinstance(found, str)
        else np.allclose(found, changed[name], atol=0.01)
    )
    assert same


def test_dragging_walks_around(package: Path, open_viewer: Callable[..., Any]) -> None:
    viewer = open_viewer(package).ready()
    before = viewer.evaluate("() => window.tsuya.view().camera.position")
    mouse = viewer.page.mouse
    mouse.move(400, 250)
    mouse.down()
    mouse.move(520, 250, steps=4)
    mouse.up()
    viewer.wait_for(
        f"() => Math.abs(window.tsuya.view().camera.position[0] - ({before[0]})) > 0.01"
    )
    after = viewer.evaluate("() => window.tsuya.view().camera.position")
    assert np.isclose(after[2], before[2], atol=1e-6)


@pytest.mark.parametrize(
    ("state", "said"),
    [
        ({"layers": 0}, "layers is 0; expected a whole number of 1 to 250."),
        ({"fill": "waves"}, 'fill is "waves"; expected one of columns, bands.'),
        ({"light": [0, 0, 0]}, "light is [0,0,0]; expected [x, y, z]."),
        ({"thickness": -1}, "thickness is -1; expected 0 or more."),
    ],
    ids=["layers", "fill", "light", "thickness"],
)
def test_what_cannot_be_is_refused(
    state: dict[str, Any], said: str, package: Path, open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(package).ready()
    with pytest.raises(Error, match=re.escape(said)):
        viewer.set_view(state=state)


def test_values_for_the_viewers_own_tests_are_pythons() -> None:
    assert json.loads(photo_fur_codes.PATH.read_text()) == photo_fur_codes.values()


def test_laying_for_the_viewers_own_tests_is_pythons() -> None:
    """Digits that processors disagree about are left open."""
    stored, made = json.loads(photo_fur_laying.PATH.read_text()), photo_fur_laying.values()
    found, expected = (each.pop("expected") for each in (made, stored))
    assert found.pop("count") == expected.pop("count")
    for name, numbers in expected.items():
        np.testing.assert_allclose(found[name], numbers, atol=2e-5, err_msg=name)
    assert made["lie"] == stored["lie"]
