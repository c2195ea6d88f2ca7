"""The street in the browser: the stage's pictures, tiles that come and go, driving."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_defs.street_billboards.graph import STREET
from storage.packages import Package, read_package
from tests.assets_defs.conftest import house, make_house
from tests.pipelines.street_billboards.street_package import street_package
from tests.viewer.made_packages import made_package

__all__ = ["house", "make_house"]
LEAST_PSNR = 40.0
MOST_TILES = 8
SMALL = (64, 40)


@pytest.fixture(scope="module")
def package(house: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built-in drive's package of preset `test`."""
    path = tmp_path_factory.mktemp("package") / "city.tsuya"
    return made_package(house, STREET, {"drive": "city"}, path)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """60 m of random billboards in three tiles."""
    path = tmp_path_factory.mktemp("short") / "short.tsuya"
    path.write_bytes(street_package(60.0).content)
    return path


def _camera(x: float, **changes: Any) -> dict[str, Any]:
    looking = {"position": [x, 0.0, 1.9], "target": [x + 1.0, 0.0, 1.9], "up": [0.0, 0.0, 1.0]}
    return looking | {"view_angle": 50.0, "height": None} | changes


def _assert_pictures_are_the_stages(viewer: Any, package: Package) -> None:
    views = package.meta["views"]
    assert len(views) >= 4
    for view in views:
        assert viewer.psnr(package, view) >= LEAST_PSNR, view["name"]
        other = "street" if view["state"]["show"] == "billboards" else "billboards"
        assert viewer.psnr(package, view, show=other) < LEAST_PSNR - 10, view["name"]
    moved = views[0] | {"camera": views[1]["camera"]}
    assert viewer.psnr(package, moved) < LEAST_PSNR - 10


def test_pictures_of_the_built_in_drive_are_the_stages(
    package: Path, open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(package).ready()
    _assert_pictures_are_the_stages(viewer, read_package(package))
    assert viewer.evaluate("() => tsuya.figures()")["tiles resident"] == 4


@pytest.mark.parametrize("coding", [{}, {"colour": "rgb", "tint_side": 32}])
def test_pictures_of_any_coding_are_the_stages(
    coding: dict[str, Any], tmp_path: Path, open_viewer: Callable[..., Any]
) -> None:
    path = tmp_path / "street.tsuya"
    path.write_bytes(street_package(40.0, 6.0, tile_metres=10.0, **coding).content)
    _assert_pictures_are_the_stages(open_viewer(path).ready(), read_package(path))


def test_few_tiles_are_held_while_300_m_are_driven(
    tmp_path: Path, open_viewer: Callable[..., Any]
) -> None:
    path = tmp_path / "long.tsuya"
    made = street_package(312.0, 1.0, contrast=20.0)
    path.write_bytes(made.content)
    viewer = open_viewer(path).ready()
    counts = []
    for x in range(0, 301, 12):
        viewer.set_view(camera=_camera(float(x)))
        viewer.capture(16, 10)
        counts.append(viewer.evaluate("() => tsuya.figures()"))
    assert max(count["tiles resident"] for count in counts) <= MOST_TILES
    assert counts[-1]["tiles of the street"] == made.tiles == 13
    assert counts[-1]["tiles loaded so far"] == 13
    assert counts[-1]["tiles dropped so far"] == 13 - counts[-1]["tiles resident"] >= 5
    ranges = [each.headers.get("range") for each in viewer.requests if "range" in each.headers]
    assert len(ranges) == len(set(ranges))


def _with_broken(content: bytes, name: str) -> bytes:
    """The package with a byte of one entry altered."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entry = archive.getinfo(name)
    broken = bytearray(content)
    broken[entry.header_offset + 30 + len(name) + entry.compress_size // 2] ^= 0xFF
    return bytes(broken)


@pytest.mark.parametrize("tile", [0, 1])
def test_a_broken_tile_is_told_once_and_the_others_are_drawn(
    tile: int, short: Path, tmp_path: Path, open_viewer: Callable[..., Any]
) -> None:
    path = tmp_path / "broken.tsuya"
    path.write_bytes(_with_broken(short.read_bytes(), f"tile_00{tile}/views.ktx2"))
    viewer = open_viewer(path).ready()
    viewer.page.wait_for_selector(".said")
    said = viewer.page.inner_text("body")
    assert said.count(f"tile_00{tile}/views.ktx2") == 1
    figures = viewer.evaluate("() => tsuya.figures()")
    assert figures["tiles resident"] == 2
    viewer.set_view(camera=_camera(2.0))
    seen = viewer.capture(*SMALL)
    assert viewer.page.inner_text("body").count("views.ktx2") <= 1
    viewer.set_view(camera=_camera(2.0, target=[2.0, 0.0, 9.0], up=[1.0, 0.0, 0.0]))
    assert np.abs(seen.astype(int) - viewer.capture(*SMALL)).mean() > 5.0


def test_arrow_keys_drive_and_drags_look(short: Path, open_viewer: Callable[..., Any]) -> None:
    viewer = open_viewer(short).ready()

    def place() -> list[float]:
        return viewer.evaluate("() => tsuya.view().camera.position")

    def held(key: str) -> list[float]:
        before = np.array(place())
        viewer.page.keyboard.down(key)
        viewer.page.wait_for_timeout(700)
        viewer.page.keyboard.up(key)
        return (np.array(place()) - before).tolist()

    viewer.set_view(camera=_camera(20.0), state={"speed": 10.0})
    viewer.page.focus("canvas.live")
    assert held("ArrowUp")[0] > 1.0
    assert held("ArrowDown")[0] < -1.0
    aside = held("d")
    assert aside[1] < -0.5
    assert abs(aside[0]) < 0.1
    assert held("e")[2] > 0.2
    before = viewer.evaluate("() => tsuya.view().camera.target")
    viewer.page.mouse.move(300, 150)
    viewer.page.mouse.down()
    viewer.page.mouse.move(380, 150, steps=4)
    viewer.page.mouse.up()
    after = viewer.evaluate("() => tsuya.view().camera.target")
    assert abs(after[1] - before[1]) > 0.1
    viewer.set_view(camera=_camera(20.0, target=[21.0, 0.0, 2.4]), state={"camera": "free"})
    viewer.page.focus("canvas.live")
    assert held("ArrowUp")[2] > 0.3


def test_settings_change_the_picture(short: Path, open_viewer: Callable[..., Any]) -> None:
    viewer = open_viewer(short).ready()
    viewer.set_view(camera=_camera(10.0))
    plain = viewer.capture(*SMALL).astype(int)
    for state in ({"path": True}, {"show": "billboards"}):
        viewer.set_view(state={"path": False, "show": "street"} | state)
        assert np.abs(viewer.capture(*SMALL) - plain).max() > 40, state
    viewer.set_view(state={"path": False, "show": "street"})
    assert np.array_equal(viewer.capture(*SMALL), plain)


def test_pads_drive_on_a_phone(short: Path, open_viewer: Callable[..., Any]) -> None:
    viewer = open_viewer(short, size=(390, 700), has_touch=True, is_mobile=True).ready()
    viewer.set_view(camera=_camera(20.0), state={"speed": 10.0})
    for pad, axis, sign in (("ArrowUp", 0, 1), ("d", 1, -1), ("ArrowDown", 0, -1)):
        before = viewer.evaluate("() => tsuya.view().camera.position")
        box = viewer.page.locator(f".drive .{pad}").bounding_box()
        assert 0 <= box["x"] < box["x"] + box["width"] <= 390
        assert box["width"] >= 40
        viewer.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        viewer.page.mouse.down()
        viewer.page.wait_for_timeout(700)
        viewer.page.mouse.up()
        after = viewer.evaluate("() => tsuya.view().camera.position")
        assert sign * (after[axis] - before[axis]) > 0.5, pad
