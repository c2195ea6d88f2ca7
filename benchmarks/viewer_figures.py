"""The viewer in headless Chromium: its pictures against the stage, waiting, speed, files."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.viewer_page import (
    ViewerPage,
    build_viewer,
    chromium_browser,
    psnr,
    served_packages,
)
from storage.packages import Package, read_package
from tsuya.exports import find_format
from tsuya.view_server import VIEWER

_FRAMES = 8
_WINDOW = (640, 400)


def viewer_figures(paths: Mapping[str, Path], folder: Path) -> dict[str, Any]:
    """Figures of one package a system; ``folder`` takes what is exported."""
    by_system = {}
    build_viewer()
    with chromium_browser() as browser:
        for system, path in paths.items():
            with served_packages(path) as address:
                by_system[system] = _shown(browser, address, read_package(path))
        from_disk = [_opens_from_disk(browser, path, folder) for path in paths.values()]
    figures: dict[str, Any] = {
        key: {system: each[key] for system, each in by_system.items()}
        for key in next(iter(by_system.values()))
    }
    renderers = set(figures.pop("renderer").values())
    return figures | {
        "renderer": sorted(renderers),
        "html_opens_from_disk": sum(from_disk),
        "bundle_kb": _bundle_bytes() / 1000,
    }


def _shown(browser: Any, address: str, package: Package) -> dict[str, Any]:
    """Figures of one package. Raises AssertionError where the page complains or asks elsewhere."""
    page = browser.new_page(viewport={"width": _WINDOW[0], "height": _WINDOW[1]})
    viewer = ViewerPage(page, address.split("/")[2])
    started = time.perf_counter()
    page.goto(address)
    viewer.ready()
    first_picture = time.perf_counter() - started
    views = package.meta["views"]
    found = [viewer.psnr(package, view) for view in views]
    # The null: each view's frame against that of another view.
    wrong = [
        psnr(package.picture(view["picture"]), package.picture(other["picture"]))
        for view, other in zip(views, [*views[1:], views[0]], strict=True)
        if (view["width"], view["height"]) == (other["width"], other["height"])
    ]
    still, moving = (_frame_seconds(viewer, views[0], moving) for moving in (False, True))
    figures = {
        "viewer_vs_stage_psnr_db": min(found),
        "viewer_vs_stage_null_db": max(wrong, default=None),
        "views_compared": len(found),
        "first_picture_s": first_picture,
        "fps": 1 / still,
        "fps_moving": 1 / moving,
        "renderer": viewer.evaluate("() => window.tsuya.renderer"),
        "live_figures": viewer.evaluate("() => window.tsuya.figures()"),
    }
    page.close()
    assert viewer.said == [], viewer.said
    assert viewer.hosts == set(), viewer.hosts
    return figures


def _frame_seconds(viewer: ViewerPage, view: dict[str, Any], moving: bool) -> float:
    """Seconds of a frame of 640 x 400, the least of some; drawn and read back.

    ``moving``: as while something moves, which some systems then draw with less care.
    """
    viewer.set_view(camera=view["camera"], state=view["state"])
    spent = []
    for _ in range(_FRAMES):
        started = time.perf_counter()
        asked = [*_WINDOW, 1, moving]
        viewer.evaluate("asked => window.tsuya.capture(...asked).then(() => 0)", asked)
        spent.append(time.perf_counter() - started)
    return min(spent)


def _opens_from_disk(browser: Any, path: Path, folder: Path) -> bool:
    """Whether the page that holds everything shows something when it is opened as a file."""
    package = read_package(path)
    target = folder / f"{package.system}.html"
    find_format("html", package.system).write(package, target)
    page = browser.new_page(viewport={"width": 320, "height": 200})
    viewer = ViewerPage(page, "")
    page.goto(target.as_uri())
    viewer.ready()
    frame = viewer.capture(160, 100)
    page.close()
    return bool(frame.std() > 1) and viewer.said == [] and viewer.hosts == set()


def _bundle_bytes() -> int:
    """Of the built page, all files."""
    return sum(path.stat().st_size for path in VIEWER.rglob("*") if path.is_file())
