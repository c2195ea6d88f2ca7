"""Make docs/pictures/viewer.jpg, of the demo's packages in headless Chromium: ``make docs``."""

from __future__ import annotations

import io
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from PIL import Image

from assets_defs.workspace import Workspace
from benchmarks.viewer_page import ViewerPage, build_viewer, chromium_browser, served_packages
from tsuya.packages import find_package

PICTURE = Path(__file__).parent / "pictures" / "viewer.jpg"
SHOWN = {
    "cloth": "neural_btf/btf_package/none.knit",
    "glass": "glass_scratches/glass_package/plate.worn",
    "fur": "photo_fur/fur_package/teapot.pelt",
    "scene": "ssdf_lighting/lit_package/sky.teapot",
    "street": "street_billboards/street_package/city",
}
_DESK = (960, 600)
_PHONE = (390, 844)
_GAP = 16
_BEHIND = (10, 11, 14)
_SETTLED_MS = 60_000
"""Until a software renderer has refined a still picture."""


def main() -> None:
    """Photograph the gallery and each live view, on a desk and on a phone, side by side."""
    store = Workspace.of_checkout().store
    build_viewer()
    with TemporaryDirectory() as folder, chromium_browser() as browser:
        paths = {name: Path(folder) / f"{name}.tsuya" for name in SHOWN}
        for name, key in SHOWN.items():
            paths[name].write_bytes(find_package(store, key).whole())
        desks = [_shot(browser, _DESK, *paths.values())]
        desks += [_shot(browser, _DESK, path) for path in paths.values()]
        phones = [_shot(browser, _PHONE, *paths.values())]
        phones += [_shot(browser, _PHONE, path) for path in paths.values()]
    _sheet(desks, phones).save(PICTURE, quality=85, optimize=True)
    print(PICTURE)


def _shot(browser: Any, size: tuple[int, int], *paths: Path) -> Image.Image:
    width, height = size
    phone = {"is_mobile": True, "has_touch": True} if size == _PHONE else {}
    with served_packages(*paths) as address:
        page = browser.new_page(viewport={"width": width, "height": height}, **phone)
        viewer = ViewerPage(page, address.split("/")[2])
        page.goto(address)
        viewer.ready()
        if len(paths) == 1:
            page.wait_for_timeout(_SETTLED_MS)
        shot = Image.open(io.BytesIO(page.screenshot()))
        page.close()
    return shot.convert("RGB")


def _sheet(desks: list[Image.Image], phones: list[Image.Image]) -> Image.Image:
    """Three rows of two desks, and a row of phones below, all of one width."""
    (width, height), columns = _DESK, 2
    rows = -(-len(desks) // columns)
    whole = columns * width + (columns - 1) * _GAP
    phone_width = (whole - (len(phones) - 1) * _GAP) // len(phones)
    phone_height = phone_width * _PHONE[1] // _PHONE[0]
    sheet = Image.new("RGB", (whole, rows * (height + _GAP) + phone_height), _BEHIND)
    for number, desk in enumerate(desks):
        row, column = divmod(number, columns)
        sheet.paste(desk, (column * (width + _GAP), row * (height + _GAP)))
    for number, phone in enumerate(phones):
        small = phone.resize((phone_width, phone_height), Image.Resampling.LANCZOS)
        sheet.paste(small, (number * (phone_width + _GAP), rows * (height + _GAP)))
    return sheet


if __name__ == "__main__":
    main()
