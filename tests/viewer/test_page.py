"""The page of a package, whatever system it is of: here one whose live view a test brings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, quote

import cv2
import numpy as np
import pytest

from pipelines.drawing.colour import to_8bit
from storage.packages import read_package
from tsuya.exports.pages import write_html

Open = Callable[..., Any]


def shown_colour(viewer: Any) -> tuple[int, int, int]:
    """The colour in the middle of the canvas, once it is still."""
    viewer.wait_for("() => window.tsuya.live.still")
    box = viewer.page.locator("canvas.live").bounding_box()
    coded = np.frombuffer(viewer.page.screenshot(), np.uint8)
    picture = cv2.imdecode(coded, cv2.IMREAD_COLOR)[..., ::-1]
    middle = (int(box["y"] + box["height"] / 2), int(box["x"] + box["width"] * 0.6))
    red, green, blue = (int(code) for code in picture[middle])
    return red, green, blue


# ---- frames ----------------------------------------------------------------------------------


def test_a_frame_is_the_radiance_encoded_as_srgb(small: Path, open_small: Open) -> None:
    viewer = open_small(small).ready()
    viewer.set_view(state={"red": 0.2}, camera={"position": [0.0, 3.0, 0.0]})
    expected = to_8bit([51 / 255, 128 / 255, 1.0])
    frame = viewer.capture(8, 6, 2)
    assert frame.shape == (6, 8, 3)
    assert (frame == expected).all()
    assert shown_colour(viewer) == tuple(expected)
    assert viewer.evaluate("() => window.tsuya.frameTime") > 0
    assert viewer.evaluate("() => window.tsuya.firstPicture") > 0


@pytest.mark.reads_back("html")
def test_a_page_opens_from_disk(
    small: Path, content: bytes, tmp_path: Path, open_small: Open
) -> None:
    path = tmp_path / "page.html"
    assert write_html(read_package(content, "small.tsuya"), path) == ()
    viewer = open_small(address=path.as_uri()).ready()
    assert viewer.page.title() == "Every kind of part · Tsuya"
    assert len([each for each in viewer.requests if each.url.startswith("file:")]) == 1
    viewer.set_view(state={"red": 0.2}, camera={"position": [0.0, 3.0, 0.0]})
    assert (viewer.capture(2, 2) == to_8bit([51 / 255, 128 / 255, 1.0])).all()


# ---- the address -----------------------------------------------------------------------------


@pytest.mark.slow
def test_the_address_holds_the_view(small: Path, open_small: Open) -> None:
    first = open_small(small).ready()
    first.page.locator("canvas.live").focus()
    first.page.keyboard.press("ArrowRight")
    first.page.locator("input[name=red]").fill("0.75")
    first.wait_for("() => location.hash.includes('0.75')")
    fragment = first.evaluate("() => location.hash")
    assert parse_qs(fragment[1:])["package"] == ["small.tsuya"]
    again = open_small(small, fragment=fragment).ready()
    old, new = (each.evaluate("() => window.tsuya.view()") for each in (first, again))
    assert new["state"] == old["state"]
    assert new["state"]["red"] == 0.75
    assert np.allclose(new["camera"]["position"], old["camera"]["position"], rtol=1e-4)
    other = open_small(small).ready().evaluate("() => window.tsuya.view()")
    assert not np.allclose(new["camera"]["position"], other["camera"]["position"], rtol=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("view", "sentence"),
    [
        ("{", "address: view is no JSON"),
        ('{"state":{"red":2}}', "red is above 1; expected at most 1."),
        ('{"camera":{"position":[1]}}', "camera of the view is not as the page makes it."),
    ],
)
def test_an_address_that_cannot_be_is_said(
    small: Path, open_small: Open, view: str, sentence: str
) -> None:
    viewer = open_small(small, fragment=f"#package=small.tsuya&view={quote(view)}")
    viewer.page.wait_for_selector("[role=alert], .said")
    assert sentence in viewer.page.inner_text("body")


# ---- what can be set -------------------------------------------------------------------------


@pytest.mark.slow
def test_controls_change_the_picture(small: Path, open_small: Open) -> None:
    viewer = open_small(small, size=(1000, 700)).ready()
    page = viewer.page
    before = shown_colour(viewer)
    page.locator("input[name=red]").fill("1")
    assert shown_colour(viewer)[0] == 255 > before[0]
    page.locator("select[name=shape]").select_option("flat")
    assert page.locator(".drop").count() == 1
    page.locator("input[name=banded]").uncheck()
    assert page.locator(".drop").count() == 0  # the controls follow the state
    state = viewer.evaluate("() => window.tsuya.view().state")
    assert (state["shape"], state["banded"]) == ("flat", False)
    pad = page.locator(".pad").bounding_box()
    page.mouse.click(pad["x"] + pad["width"] / 2, pad["y"] + pad["height"] / 2)
    view = viewer.evaluate("() => window.tsuya.view()")
    towards = np.array(view["camera"]["position"]) - view["camera"]["target"]
    assert view["state"]["light"] @ (towards / np.linalg.norm(towards)) == pytest.approx(
        1, abs=1e-3
    )


@pytest.mark.slow
def test_mouse_and_keys_move_the_camera(small: Path, open_small: Open) -> None:
    viewer = open_small(small).ready()
    page = viewer.page

    def view() -> Any:
        return viewer.evaluate("() => window.tsuya.view()")

    def drag(button: str) -> None:
        page.mouse.move(400, 200)
        page.mouse.down(button=button)
        page.mouse.move(460, 220, steps=3)
        page.mouse.up(button=button)

    first = view()
    drag("left")
    dragged = view()
    assert dragged["camera"]["position"] != first["camera"]["position"]
    assert dragged["state"] == first["state"]
    drag("right")
    lit = view()
    assert lit["camera"] == dragged["camera"]
    assert lit["state"]["light"] != dragged["state"]["light"]
    assert np.linalg.norm(lit["state"]["light"]) == pytest.approx(1)
    page.mouse.wheel(0, -300)
    page.wait_for_timeout(100)
    nearer = np.linalg.norm(view()["camera"]["position"])
    assert nearer < np.linalg.norm(lit["camera"]["position"])
    page.keyboard.press("0")
    assert view() == first


@pytest.mark.slow
def test_the_drawer_shows_figures_beside_the_papers(small: Path, open_small: Open) -> None:
    viewer = open_small(small, size=(1000, 700)).ready()
    assert not viewer.page.locator(".drawer").is_visible()
    viewer.page.keyboard.press("i")
    text = viewer.page.inner_text(".drawer")
    row = viewer.page.locator(".figures tbody tr").first.inner_text().split()
    assert row[:3] == ["RMSE", "0.03", "0.02"]
    assert "table 2, knit" in text
    assert "CC0-1.0" in text
    assert "made/one" in text
    assert viewer.page.locator(".passed").inner_text() == "seams0.25"
    assert viewer.page.locator(".failed").inner_text() == "holes3"
    assert "SwiftShader" in text
    assert "tiles resident" in text


@pytest.mark.slow
def test_the_picture_can_be_saved(small: Path, open_small: Open) -> None:
    viewer = open_small(small).ready()
    viewer.set_view(state={"red": 0.2}, camera={"position": [0.0, 3.0, 0.0]})
    with viewer.page.expect_download() as saving:
        viewer.page.click("[title^=Save]")
    picture = cv2.imread(str(saving.value.path()), cv2.IMREAD_UNCHANGED)
    assert picture.shape[:2] == (500, 800)
    assert (picture[..., 2::-1] == to_8bit([51 / 255, 128 / 255, 1.0])).all()


# ---- a phone ---------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_phone_has_the_picture_and_a_sheet_of_settings(small: Path, open_small: Open) -> None:
    viewer = open_small(small, size=(390, 844), has_touch=True).ready()
    page = viewer.page
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    picture = page.locator("canvas.live").bounding_box()
    assert (picture["width"], picture["height"] > 700) == (390, True)
    assert not page.locator(".pad").is_visible()
    page.tap(".panel summary")
    assert page.locator(".pad").is_visible()
    page.locator("input[name=red]").fill("1")
    assert shown_colour(viewer)[0] == 255
    for button in page.locator(".bar button").all():
        box = button.bounding_box()
        assert box["x"] + box["width"] <= 390
        assert min(box["width"], box["height"]) >= 38
    page.tap("[title^=Figures]")
    assert page.locator(".drawer").bounding_box()["width"] == 390
    page.tap("[title^=Figures]")
    assert not page.locator(".drawer").is_visible()


@pytest.mark.slow
def test_a_lost_graphics_card_is_told(small: Path, open_small: Open) -> None:
    viewer = open_small(small, allowed="Context Lost").ready()
    lose = "document.querySelector('canvas.live').getContext('webgl2')"
    viewer.evaluate(f"() => {lose}.getExtension('WEBGL_lose_context').loseContext()")
    viewer.page.wait_for_selector("[role=alert]")
    assert "has dropped this page; load it again." in viewer.page.inner_text("[role=alert]")
