"""What the page does with packages: gallery, comparison, files that are dropped, broken ones."""

from __future__ import annotations

import base64
import functools
import io
import json
import socket
import threading
import zipfile
from collections.abc import Callable
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import xarray as xr

from assets_defs.picture_links import note_picture_port
from assets_defs.picture_server import PictureServer
from assets_defs.viewer_files import live_view_address
from assets_defs.workspace import Workspace
from storage.packages import read_package
from storage.packages.conformance import good_packages
from storage.versions import Slot
from tsuya.exports.pages import write_site

Open = Callable[..., Any]


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


# ---- comparison and gallery ------------------------------------------------------------------


@pytest.mark.slow
def test_a_frame_of_the_stage_stands_to_the_right_of_the_line(
    small: Path, open_small: Open
) -> None:
    viewer = open_small(small).ready()
    viewer.page.locator(".comparison").select_option(label="the stage's frame: front")
    box = viewer.page.locator(".frame").bounding_box()
    assert box["width"] / box["height"] == pytest.approx(1, abs=0.01)  # as the view's picture
    viewer.wait_for("() => window.tsuya.live.still")
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
def test_two_packages_are_compared(small: Path, tmp_path: Path, open_small: Open) -> None:
    other = tmp_path / "other.tsuya"
    other.write_bytes(small.read_bytes())
    viewer = open_small(small, other, fragment="#package=small.tsuya").ready()
    viewer.page.locator(".comparison").select_option("other.tsuya")
    viewer.page.wait_for_selector(".line")
    viewer.evaluate("() => window.tsuya.live.other.setState({ red: 0.9 })")
    viewer.evaluate("() => window.tsuya.live.change()")
    viewer.wait_for("() => window.tsuya.live.still")
    coded = np.frombuffer(viewer.page.screenshot(), np.uint8)
    row = cv2.imdecode(coded, cv2.IMREAD_COLOR)[100]
    assert row[450, 2] > row[350, 2]
    viewer.page.locator(".comparison").select_option("")
    assert viewer.evaluate("() => window.tsuya.live.other") is None


@pytest.mark.slow
def test_the_gallery_joins_all_packages(small: Path, tmp_path: Path, open_small: Open) -> None:
    other, cut = tmp_path / "other.tsuya", tmp_path / "cut.tsuya"
    other.write_bytes(good_packages()["plain.tsuya"])
    cut.write_bytes(small.read_bytes()[:900])
    viewer = open_small(small, other, cut, size=(1200, 900)).ready()
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


@pytest.mark.reads_back("site")
@pytest.mark.slow
def test_a_site_is_shown_by_a_host_without_ranges(
    content: bytes, tmp_path: Path, open_small: Open
) -> None:
    class Handler(SimpleHTTPRequestHandler):
        def log_message(self, format: str, *arguments: object) -> None:
            pass

    packages = [read_package(content, name) for name in ("one.tsuya", "two.tsuya")]
    write_site(packages, tmp_path / "site")
    handler = functools.partial(Handler, directory=str(tmp_path / "site"))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        viewer = open_small(address=address).ready()
        assert viewer.page.locator(".card[href]").count() == 2
        viewer.page.goto(f"{address}#package=two")
        viewer.wait_for("() => Boolean(window.tsuya.live)")
        viewer.ready()
        assert viewer.capture(2, 2).shape == (2, 2, 3)
        server.shutdown()


@pytest.mark.slow
def test_the_web_uis_server_of_pictures_shows_a_package(
    content: bytes, tmp_path: Path, open_small: Open
) -> None:
    workspace = Workspace(tmp_path / "data")
    slot = Slot("photo_fur", "fur_package", "teapot.grass")
    dataset = xr.Dataset({"file": ("byte", np.frombuffer(content, np.uint8))})
    workspace.store.write(slot, dataset, {"settings": {}, "recipe": "of a test", "checks": []})
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    note_picture_port(workspace, listener.getsockname()[1])
    with PictureServer(workspace.root / "full_size", listener) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        viewer = open_small(address=live_view_address(workspace, slot)).ready()
        assert viewer.capture(2, 2).shape == (2, 2, 3)
        assert viewer.page.inner_text("h1") == "Every kind of part"
        server.shutdown()


# ---- files that are dropped ------------------------------------------------------------------

DROP = """([name, text]) => {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const transfer = new DataTransfer();
  transfer.items.add(new File([bytes], name));
  window.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, cancelable: true }));
}"""


def drop(viewer: Any, name: str, content: bytes) -> None:
    viewer.evaluate(DROP, [name, base64.b64encode(content).decode()])


@pytest.mark.slow
def test_files_are_dropped_on_the_page(small: Path, open_small: Open) -> None:
    viewer = open_small(small).ready()
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
    open_small: Open,
    broken: Callable[[bytes], bytes],
    sentence: str,
) -> None:
    path = tmp_path / "broken.tsuya"
    path.write_bytes(broken(content))
    viewer = open_small(path)
    viewer.page.wait_for_selector("[role=alert]")
    said = viewer.page.inner_text("[role=alert]")
    assert said.startswith("broken.tsuya: ")
    assert sentence in said
    assert said.count("\n") == 0
    assert viewer.evaluate("() => window.tsuya.live") is None


@pytest.mark.slow
def test_a_browser_without_webgl2_is_told_so(small: Path, open_small: Open) -> None:
    without = """
      const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...others) {
        return kind.startsWith("webgl") ? null : get.call(this, kind, ...others);
      };
    """
    viewer = open_small(small, script=without)
    viewer.page.wait_for_selector("[role=alert]")
    assert "This browser has no WebGL2" in viewer.page.inner_text("[role=alert]")
