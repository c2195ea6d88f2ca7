"""The hanging cloth in the browser: the stage's pictures, and what can be set."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_defs.neural_btf.datasets import runtime_btf
from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import Camera
from pipelines.neural_btf.live_parts import scenery_of
from pipelines.neural_btf.stage_view import Showing, draw_cloth
from storage.btf_file import BtfFile
from storage.packages import Package, read_package
from tests.btf_packages import btf_package, float_file, random_file
from tests.viewer.made_packages import mean_difference

LEAST_PSNR = 40.0
WIDTH = 32
SMALL = (WIDTH, 24)
FILES: dict[str, Callable[[], BtfFile]] = {
    "each": lambda: random_file(size=(12, 16), channels=22),
    "shared": lambda: random_file(shared=True),
    "paper": float_file,
}


@functools.cache
def package(name: str) -> Package:
    """Of random numbers, three tiles wide, so that far away coarser levels are seen."""
    return btf_package(FILES[name](), width=WIDTH, tiles=3.0)


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Their files."""
    folder = tmp_path_factory.mktemp("packages")
    for name in FILES:
        (folder / f"{name}.tsuya").write_bytes(package(name).whole())
    return {name: folder / f"{name}.tsuya" for name in FILES}


@pytest.mark.parametrize("name", FILES)
def test_pictures_are_the_stages(
    name: str, packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    opened = read_package(packages[name])
    viewer = open_viewer(packages[name], size=SMALL).ready()
    views = opened.meta["views"]
    for view in views:
        assert viewer.psnr(opened, view) >= LEAST_PSNR, view["name"]
    nulls: list[dict[str, Any]] = [{"light": [0.3, -0.9, 0.3]}, {"tiles": 3.05}, {"exposure": 0.4}]
    for null in nulls:
        assert viewer.psnr(opened, views[0], **null) < LEAST_PSNR - 8, null


def stage_picture(file: BtfFile, view: dict[str, Any], student: bool) -> Any:
    """What the stage draws of a reference view, 8-bit sRGB, four samples a pixel."""
    btf = runtime_btf(file)
    scenery = scenery_of(btf.by_student() if student else btf)
    state = view["state"]
    showing = Showing(state["light"], state["tiles"], package("each").parameter("exposure"))
    drawn = draw_cloth(
        scenery,
        showing,
        Camera(**view["camera"]),
        width=SMALL[0],
        height=SMALL[1],
        supersampling=2,
    )
    return to_8bit(drawn[..., :3])


def psnr(one: Any, other: Any) -> float:
    """In dB, of 8-bit codes."""
    error = np.mean((one.astype(float) - other) ** 2)
    return float(10 * np.log10(255**2 / max(error, 1e-9)))


def test_the_student_draws_while_something_moves(
    packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(packages["each"], size=SMALL).ready()
    (view, *_), file = package("each").meta["views"], FILES["each"]()
    viewer.set_view(camera=view["camera"], state=view["state"])
    by_student, by_all = (stage_picture(file, view, student) for student in (True, False))
    assert psnr(viewer.capture(*SMALL, 2, moving=True), by_student) >= LEAST_PSNR
    assert psnr(viewer.capture(*SMALL, 2), by_all) >= LEAST_PSNR
    assert psnr(by_student, by_all) < LEAST_PSNR - 8


def test_the_drawer_says_which_decoder_drew(
    packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    moving, still = "its student, 3 × 44 neurons", "the whole decoder, 3 × 106 neurons"
    viewer = open_viewer(packages["each"], size=SMALL).ready()
    decoder = "() => window.tsuya.figures()['decoded by']"
    seen = """() => new Promise((done) => {
      const { live } = window.tsuya, before = live.onFrame, names = [];
      live.onFrame = () => { before(); names.push(live.view.figures()["decoded by"]); };
      live.change();
      const look = () => live.still ? done(names) : setTimeout(look, 20);
      setTimeout(look, 20);
    })"""
    assert set(viewer.evaluate(seen)) == {moving, still}
    assert viewer.evaluate(decoder) == still
    alone = open_viewer(packages["paper"], size=SMALL).ready()
    assert set(alone.evaluate(seen)) == {still}


def test_numbers_that_do_not_belong_together_are_refused(
    tmp_path: Path, open_viewer: Callable[..., Any]
) -> None:
    file = random_file(shared=True)
    path = tmp_path / "felt.tsuya"
    path.write_bytes(btf_package(replace(file, height=5, width=5)).whole())
    viewer = open_viewer(path, size=(600, 400))
    viewer.wait_for("() => document.body.innerText.includes('expected 5 x 5')")
    assert "felt.tsuya: texels is 30; expected 5 x 5" in viewer.evaluate(
        "() => document.body.innerText"
    )


def test_what_is_set_changes_the_picture(
    packages: dict[str, Path], open_viewer: Callable[..., Any]
) -> None:
    viewer = open_viewer(packages["shared"], size=SMALL).ready()
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
    viewer = open_viewer(packages["each"], size=(240, 180)).ready()
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
    viewer = open_viewer(packages["shared"], size=SMALL).ready()
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
