"""The page, whatever system is shown: here one whose live view a test brings."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, quote

import cv2
import numpy as np
import pytest

from pipelines.drawing.colour import to_8bit
from storage.packages import read_package
from storage.packages.conformance import SMALL, good_packages, small_contents
from storage.packages.writing import Figure, PaperFigure, write_package
from tsuya.exports.pages import write_html, write_site

SYSTEM = """
globalThis.tsuyaViewers = [{
  name: "conformance",
  async make(pkg, context) {
    const state = { light: [0, 0, 1], red: 0.5, banded: true, shape: "round" };
    await pkg.mesh("mesh");
    await pkg.floats("float16");
    const take = async (file) => {
      if (file.size > 3) throw new Error(`${file.name}: file is too long; expected 3 bytes.`);
      state.red = 1;
      context.requestDraw();
    };
    return {
      get controls() {
        return [
          { kind: "direction", name: "light", label: "Light" },
          { kind: "slider", name: "red", label: "Red", min: 0, max: 1, step: 0.01 },
          { kind: "toggle", name: "banded", label: "Bands" },
          { kind: "choice", name: "shape", label: "Shape", options: [
            { value: "round", label: "Round" }, { value: "flat", label: "Flat" }] },
          ...(state.banded ? [{ kind: "drop", name: "own", label: "Yours", accept: ".txt", take }] : []),
        ];
      },
      navigation: "orbit",
      bounds: { centre: [0, 0, 0], radius: 1 },
      state: () => structuredClone(state),
      setState(given) {
        if (given.red > 1) throw new Error("red is above 1; expected at most 1.");
        Object.assign(state, given);
      },
      draw(renderer, camera, width, height) {
        const code = (value) => Math.round(255 * Math.min(1, Math.max(0, value)));
        const green = 0.5 + 0.5 * camera.position[0] / Math.hypot(...camera.position);
        const blue = 0.5 + 0.5 * state.light[2];
        renderer.setClearColor((code(state.red) << 16) | (code(green) << 8) | code(blue), 0);
        renderer.clear();
      },
      figures: () => ({ "tiles resident": 7 }),
      dispose() {},
    };
  },
}];
"""
CHECKS = {"seams": {"passed": True, "figure": 0.25}, "holes": {"passed": False, "figure": 3}}
LINEAGE = {"asset": "made", "partition": "one", "version": "v7", "content": "c", "checks": CHECKS}
FIGURES = (
    Figure("RMSE", 0.03, "1", PaperFigure(0.02, "table 2, knit")),
    Figure("size", 1234.0, "bytes"),
)
Open = Callable[..., Any]


@pytest.fixture(scope="module")
def content() -> bytes:
    """A package of the conformance suite, with figures and lineage."""
    contents = replace(small_contents(), figures=FIGURES, lineage=(LINEAGE,))
    return write_package(SMALL, contents)


@pytest.fixture
def small(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "small.tsuya"
    path.write_bytes(content)
    return path


def shown_colour(viewer: Any) -> tuple[int, int, int]:
    """The colour in the middle of the canvas, once it is still."""
    viewer.page.wait_for_timeout(400)
    box = viewer.page.locator("canvas.live").bounding_box()
    coded = np.frombuffer(viewer.page.screenshot(), np.uint8)
    picture = cv2.imdecode(coded, cv2.IMREAD_COLOR)[..., ::-1]
    middle = (int(box["y"] + box["height"] / 2), int(box["x"] + box["width"] / 3))
    red, green, blue = (int(code) for code in picture[middle])
    return red, green, blue


def with_file(content: bytes, name: str, change: Callable[[bytes], bytes]) -> bytes:
    """A package whose file of this name is changed, and nothing else."""
    changed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(changed, "w") as new:
        for entry in old.infolist():
            data = old.read(entry)
            new.writestr(entry, change(data) if entry.filename == name else data)
    return changed.getvalue()


def with_meta(content: bytes, change: Callable[[dict[str, Any]], None]) -> bytes:
    """A package whose `meta.json` is changed."""

    def changed(text: bytes) -> bytes:
        meta = json.loads(text)
        change(meta)
        return json.dumps(meta).encode()

    return with_file(content, "meta.json", changed)


# ---- frames ----------------------------------------------------------------------------------


def test_a_frame_is_the_radiance_encoded_as_srgb(small: Path, open_viewer: Open) -> None:
    viewer = open_viewer(small, script=SYSTEM).ready()
    viewer.set_view(state={"red": 0.2}, camera={"position": [0.0, 3.0, 0.0]})
    expected = to_8bit([51 / 255, 128 / 255, 1.0])
    frame = viewer.capture(8, 6, 2)
    assert frame.shape == (6, 8, 3)
    assert (frame == expected).all()
    assert shown_colour(viewer) == tuple(expected)
    assert viewer.evaluate("() => window.tsuya.frameTime") > 0
    assert viewer.evaluate("() => window.tsuya.firstPicture") > 0


def test_a_page_opens_from_disk(
    small: Path, content: bytes, tmp_path: Path, open_viewer: Open
) -> None:
    path = tmp_path / "page.html"
    assert write_html(read_package(content, "small.tsuya"), path) == ()
    viewer = open_viewer(address=path.as_uri(), script=SYSTEM).ready()
    assert viewer.page.title() == "Every kind of part · Tsuya"
    assert len([each for each in viewer.requests if each.url.startswith("file:")]) == 1
    viewer.set_view(state={"red": 0.2}, camera={"position": [0.0, 3.0, 0.0]})
    assert (viewer.capture(2, 2) == to_8bit([51 / 255, 128 / 255, 1.0])).all()


# ---- the address -----------------------------------------------------------------------------


@pytest.mark.slow
def test_the_address_holds_the_view(small: Path, open_viewer: Open) -> None:
    first = open_viewer(small, script=SYSTEM).ready()
    first.page.locator("input[name=red]").fill("0.75")
    first.page.locator("canvas.live").focus()
    first.page.keyboard.press("ArrowRight")
    first.wait_for("() => location.hash.includes('0.75')")
    fragment = first.evaluate("() => location.hash")
    assert parse_qs(fragment[1:])["package"] == ["small.tsuya"]
    again = open_viewer(small, script=SYSTEM, fragment=fragment).ready()
    old, new = (each.evaluate("() => window.tsuya.view()") for each in (first, again))
    assert new["state"] == old["state"]
    assert new["state"]["red"] == 0.75
    assert np.allclose(new["camera"]["position"], old["camera"]["position"], rtol=1e-4)
    other = open_viewer(small, script=SYSTEM).ready().evaluate("() => window.tsuya.view()")
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
    small: Path, open_viewer: Open, view: str, sentence: str
) -> None:
    viewer = open_viewer(small, script=SYSTEM, fragment=f"#package=small.tsuya&view={quote(view)}")
    viewer.page.wait_for_selector("[role=alert], .said")
    assert sentence in viewer.page.inner_text("body")


# ---- what can be set -------------------------------------------------------------------------


@pytest.mark.slow
def test_controls_change_the_picture(small: Path, open_viewer: Open) -> None:
    viewer = open_viewer(small, script=SYSTEM, size=(1000, 700)).ready()
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
def test_mouse_and_keys_move_the_camera(small: Path, open_viewer: Open) -> None:
    viewer = open_viewer(small, script=SYSTEM).ready()
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
def test_the_drawer_shows_figures_beside_the_papers(small: Path, open_viewer: Open) -> None:
    viewer = open_viewer(small, script=SYSTEM, size=(1000, 700)).ready()
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
def test_the_picture_can_be_saved(small: Path, open_viewer: Open) -> None:
    viewer = open_viewer(small, script=SYSTEM).ready()
    viewer.set_view(state={"red": 0.2}, camera={"position": [0.0, 3.0, 0.0]})
    with viewer.page.expect_download() as saving:
        viewer.page.click("[title^=Save]")
    picture = cv2.imread(str(saving.value.path()), cv2.IMREAD_UNCHANGED)
    assert picture.shape[:2] == (500, 800)
    assert (picture[..., 2::-1] == to_8bit([51 / 255, 128 / 255, 1.0])).all()


# ---- comparison and gallery ------------------------------------------------------------------


@pytest.mark.slow
def test_a_frame_of_the_stage_stands_to_the_right_of_the_line(
    small: Path, open_viewer: Open
) -> None:
    viewer = open_viewer(small, script=SYSTEM).ready()
    viewer.page.locator(".comparison").select_option(label="the stage's frame: front")
    box = viewer.page.locator(".frame").bounding_box()
    assert box["width"] / box["height"] == pytest.approx(1, abs=0.01)  # as the view's picture
    viewer.page.wait_for_timeout(500)
    coded = np.frombuffer(viewer.page.screenshot(), np.uint8)
    picture = cv2.imdecode(coded, cv2.IMREAD_COLOR)
    row = picture[int(box["y"] + box["height"] * 0.7)]
    right, left = (row[int(box["x"] + box["width"] * part)] for part in (0.9, 0.8 - 0.5))
    assert (right == 77).all()  # the reference's grey
    assert not (left == 77).all()
    line = viewer.page.locator(".line").bounding_box()
    viewer.page.mouse.move(line["x"] + 16, line["y"] + 60)
    viewer.page.mouse.down()
    viewer.page.mouse.move(box["x"] + box["width"] * 0.25, line["y"] + 60)
    viewer.page.mouse.up()
    assert viewer.page.locator(".line").get_attribute("aria-valuenow") == "25"
    viewer.page.locator("canvas.live").focus()
    viewer.page.keyboard.press("ArrowLeft")
    assert viewer.page.locator("canvas.reference").count() == 0  # another view is no reference's


@pytest.mark.slow
def test_two_packages_are_compared(small: Path, tmp_path: Path, open_viewer: Open) -> None:
    other = tmp_path / "other.tsuya"
    other.write_bytes(small.read_bytes())
    viewer = open_viewer(small, other, script=SYSTEM, fragment="#package=small.tsuya").ready()
    viewer.page.locator(".comparison").select_option("other.tsuya")
    viewer.page.wait_for_selector(".line")
    viewer.evaluate("() => window.tsuya.live.other.setState({ red: 0.9 })")
    viewer.evaluate("() => window.tsuya.live.change()")
    viewer.page.wait_for_timeout(500)
    coded = np.frombuffer(viewer.page.screenshot(), np.uint8)
    row = cv2.imdecode(coded, cv2.IMREAD_COLOR)[100]
    assert row[350, 2] > row[290, 2]
    viewer.page.locator(".comparison").select_option("")
    assert viewer.evaluate("() => window.tsuya.live.other") is None


@pytest.mark.slow
def test_the_gallery_joins_all_packages(small: Path, tmp_path: Path, open_viewer: Open) -> None:
    other, cut = tmp_path / "other.tsuya", tmp_path / "cut.tsuya"
    other.write_bytes(good_packages()["plain.tsuya"])
    cut.write_bytes(small.read_bytes()[:900])
    viewer = open_viewer(small, other, cut, script=SYSTEM, size=(1200, 900)).ready()
    page = viewer.page
    assert page.locator(".card").count() == 3
    assert page.locator(".card canvas").count() == 4  # posters and inputs
    broken = page.locator(".card .broken").inner_text()
    assert broken == "cut.tsuya: file is no whole zip; expected a .tsuya package, complete."
    assert "0.03" in page.locator(".card").first.inner_text()
    assert "table 2, knit" in page.inner_text(".all-figures")
    page.locator(".card[href]").first.click()
    viewer.wait_for("() => Boolean(window.tsuya.live)")
    viewer.ready()
    page.locator(".back").click()
    page.wait_for_selector(".gallery")
    assert viewer.evaluate("() => window.tsuya.live") is None


@pytest.mark.slow
def test_a_site_is_shown_by_a_host_without_ranges(
    content: bytes, tmp_path: Path, open_viewer: Open
) -> None:
    import functools
    import threading
    from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

    class Handler(SimpleHTTPRequestHandler):
        def log_message(self, format: str, *arguments: object) -> None:
            pass

    packages = [read_package(content, name) for name in ("one.tsuya", "two.tsuya")]
    write_site(packages, tmp_path / "site")
    handler = functools.partial(Handler, directory=str(tmp_path / "site"))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        viewer = open_viewer(address=address, script=SYSTEM).ready()
        assert viewer.page.locator(".card[href]").count() == 2
        viewer.page.goto(f"{address}#package=two")
        viewer.wait_for("() => Boolean(window.tsuya.live)")
        viewer.ready()
        assert viewer.capture(2, 2).shape == (2, 2, 3)
        server.shutdown()


# ---- files that are dropped ------------------------------------------------------------------

DROP = """([name, text]) => {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const transfer = new DataTransfer();
  transfer.items.add(new File([bytes], name));
  window.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, cancelable: true }));
}"""


def drop(viewer: Any, name: str, content: bytes) -> None:
    import base64

    viewer.evaluate(DROP, [name, base64.b64encode(content).decode()])


@pytest.mark.slow
def test_files_are_dropped_on_the_page(small: Path, open_viewer: Open) -> None:
    viewer = open_viewer(small, script=SYSTEM).ready()
    drop(viewer, "own.txt", b"abc")
    viewer.wait_for("() => window.tsuya.view().state.red === 1")
    drop(viewer, "own.txt", b"abcd")
    viewer.page.wait_for_selector(".said:has-text('own.txt: file is too long; expected 3 bytes.')")
    drop(viewer, "own.exe", b"abcd")
    viewer.page.wait_for_selector(".said:has-text('own.exe is of no kind that this page takes')")
    drop(viewer, "dropped.tsuya", good_packages()["plain.tsuya"])
    viewer.wait_for("() => window.tsuya.key === 'dropped.tsuya'")
    assert viewer.ready().evaluate("() => window.tsuya.view().state.red") == 0.5
    drop(viewer, "cut.tsuya", good_packages()["plain.tsuya"][:1000])
    viewer.page.wait_for_selector(".sentence:has-text('cut.tsuya: file is no whole zip')")


# ---- what cannot be shown --------------------------------------------------------------------


def _newer(meta: dict[str, Any]) -> None:
    meta["format"] = 99


def _outside(meta: dict[str, Any]) -> None:
    meta["parts"]["mesh"]["file"] = "../mesh.glb"


def _absurd(meta: dict[str, Any]) -> None:
    meta["parts"]["float16"]["shape"] = [1 << 30, 1 << 30]


def _unknown(meta: dict[str, Any]) -> None:
    meta["system"] = "velvet"


def _altered(mesh: bytes) -> bytes:
    return mesh[:-1] + bytes([mesh[-1] ^ 1])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("broken", "sentence"),
    [
        (lambda whole: whole[: len(whole) // 2], "file is no whole zip; expected"),
        (lambda whole: with_meta(whole, _newer), "format is 99; expected at most 1: update Tsuya"),
        (lambda whole: with_meta(whole, _outside), "a path inside the package"),
        (lambda whole: with_meta(whole, _absurd), "shape of float16 is [1073741824,1073741824]"),
        (lambda whole: with_meta(whole, _unknown), "system is velvet; expected one that has"),
        (
            lambda whole: with_file(whole, "mesh.glb", _altered),
            "part mesh is not what its hash says; expected the whole package",
        ),
    ],
    ids=["cut", "newer", "outside", "absurd", "unknown", "altered"],
)
def test_a_broken_package_is_said_in_one_sentence(
    content: bytes,
    tmp_path: Path,
    open_viewer: Open,
    broken: Callable[[bytes], bytes],
    sentence: str,
) -> None:
    path = tmp_path / "broken.tsuya"
    path.write_bytes(broken(content))
    viewer = open_viewer(path, script=SYSTEM)
    viewer.page.wait_for_selector("[role=alert]")
    said = viewer.page.inner_text("[role=alert]")
    assert said.startswith("broken.tsuya: ")
    assert sentence in said
    assert said.count("\n") == 0
    assert viewer.evaluate("() => window.tsuya.live") is None


@pytest.mark.slow
def test_a_browser_without_webgl2_is_told_so(small: Path, open_viewer: Open) -> None:
    without = """
      const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...others) {
        return kind.startsWith("webgl") ? null : get.call(this, kind, ...others);
      };
    """
    viewer = open_viewer(small, script=SYSTEM + without)
    viewer.page.wait_for_selector("[role=alert]")
    assert "This browser has no WebGL2" in viewer.page.inner_text("[role=alert]")


# ---- a phone ---------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_phone_has_the_picture_and_a_sheet_of_settings(small: Path, open_viewer: Open) -> None:
    viewer = open_viewer(small, script=SYSTEM, size=(390, 844), has_touch=True).ready()
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
