"""The viewer's page in headless Chromium.

``open_viewer(path, …)`` serves packages as `tsuya view` does and opens the page. When a test ends,
its page must have said nothing in the console, but for what the test allows, and asked no other
host.
"""

from __future__ import annotations

import base64
import fcntl
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.workspace import CHECKOUT
from storage.packages import Package
from storage.packages.conformance import SMALL, small_contents
from storage.packages.writing import Figure, PaperFigure, write_package
from storage.versions import VersionedStore
from tsuya.view_server import HOST, offered_packages, view_app

FLAGS = ["--enable-unsafe-swiftshader", "--no-sandbox"]
TOKEN = "token"
_LOAD_SECONDS = 60.0


class ViewerPage:
    """An open page of the viewer."""

    def __init__(self, page: Any, host: str) -> None:
        self.page = page
        """Playwright's."""
        self.said: list[str] = []
        """Warnings and errors of the console, errors of scripts."""
        self.hosts: set[str] = set()
        """Other hosts that were asked for anything."""
        self.requests: list[Any] = []
        page.set_default_timeout(1000 * _LOAD_SECONDS)
        page.on("console", self._note)
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", lambda request: self._asked(request, host))

    def _note(self, message: Any) -> None:
        # The GPU process's own notes on speed are about the software renderer.
        if message.type in ("warning", "error") and "GPU stall" not in message.text:
            self.said.append(message.text)

    def _asked(self, request: Any, host: str) -> None:
        self.requests.append(request)
        asked = urlsplit(request.url)
        if asked.scheme not in ("blob", "data", "file") and asked.netloc != host:
            self.hosts.add(asked.netloc)

    def ready(self) -> ViewerPage:
        """Wait for the first frame, or for the gallery; raises what stopped it."""
        self.wait_for("() => window.tsuya !== undefined")
        self.page.evaluate("() => window.tsuya.ready")
        return self

    def wait_for(self, script: str) -> None:
        """Wait until a function of JavaScript returns what is true.

        Playwright's own way runs text as a script in the page, which the page's rules forbid.
        """
        end = time.monotonic() + _LOAD_SECONDS
        while not self.page.evaluate(script):
            assert time.monotonic() < end, f"waited in vain for {script}"
            self.page.wait_for_timeout(30)

    def evaluate(self, script: str, argument: Any = None) -> Any:
        """What a function of JavaScript returns in the page."""
        return self.page.evaluate(script, argument)

    def set_view(self, **view: Any) -> None:
        """Set ``camera``, ``state``, or both, as a view of `meta.json` has them."""
        self.evaluate("view => window.tsuya.setView(view)", view)

    def capture(self, width: int, height: int, supersampling: int = 1) -> NDArray[np.uint8]:
        """A frame as the stage draws it, (height, width, 3)."""
        import cv2

        asked = [width, height, supersampling]
        text = self.evaluate("asked => window.tsuya.capture(...asked)", asked)
        coded = np.frombuffer(base64.b64decode(text), np.uint8)
        bgra = cv2.imdecode(coded, cv2.IMREAD_UNCHANGED)
        return np.ascontiguousarray(bgra[..., 2::-1])

    def psnr(self, package: Package, view: dict[str, Any], **state: Any) -> float:
        """The page's frame of a reference view against the stage's, in dB, in 8-bit display codes.

        state: what is set otherwise than in the view, for a null.
        """
        self.set_view(camera=view["camera"], state=view["state"] | state)
        drawn = self.capture(view["width"], view["height"], view["supersampling"])
        reference = package.picture(view["picture"])[..., :3].astype(np.float64)
        error = np.mean((drawn.astype(np.float64) - reference) ** 2)
        return float(10 * np.log10(255.0**2 / max(error, 1e-9)))

    def screenshot(self, path: Path) -> None:
        """The page as a person sees it."""
        self.page.screenshot(path=str(path))


@pytest.fixture(scope="session")
def built_viewer() -> Path:
    """The folder of the built page, made again where a source is newer."""
    with (CHECKOUT / "viewer" / "node_modules.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        subprocess.run([CHECKOUT / "setup" / "build_viewer.sh"], check=True, timeout=300)
    return CHECKOUT / "viewer" / "dist"


@pytest.fixture(scope="session")
def chromium(built_viewer: Path) -> Iterator[Any]:
    """Playwright's headless Chromium: the system's."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    if program is None:
        pytest.skip("no browser: sudo apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def served(tmp_path: Path, built_viewer: Path) -> Iterator[Callable[..., str]]:
    """Serves packages of these paths; returns the page's address."""
    import uvicorn

    started: list[tuple[uvicorn.Server, threading.Thread]] = []

    def serve(*paths: Path) -> str:
        store = VersionedStore(tmp_path / "no-store")
        offered = offered_packages(store, [str(path) for path in paths])
        app = view_app(store, offered, TOKEN, tmp_path)
        config = uvicorn.Config(app, host=HOST, port=0, log_level="error", lifespan="off")
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, daemon=True)
        thread.start()
        started.append((server, thread))
        end = time.monotonic() + 20
        while not server.started and time.monotonic() < end:
            time.sleep(0.01)
        return f"http://{HOST}:{server.servers[0].sockets[0].getsockname()[1]}/{TOKEN}/"

    yield serve
    for server, thread in started:
        server.should_exit = server.force_exit = True
        thread.join(10)


@pytest.fixture
def open_viewer(chromium: Any, served: Callable[..., str]) -> Iterator[Callable[..., ViewerPage]]:
    """Opens the viewer on packages of these paths, in a window of ``size``.

    ``script`` runs before the page's own; ``fragment`` is put behind the address. A test that lets
    the page complain sets ``allowed``, a part of what may be said.
    """
    opened: list[tuple[ViewerPage, str | None]] = []

    def open_page(
        *paths: Path,
        size: tuple[int, int] = (800, 500),
        script: str = "",
        fragment: str = "",
        allowed: str | None = None,
        address: str | None = None,
        **context: Any,
    ) -> ViewerPage:
        address = served(*paths) if address is None else address
        page = chromium.new_page(viewport={"width": size[0], "height": size[1]}, **context)
        viewer = ViewerPage(page, urlsplit(address).netloc)
        opened.append((viewer, allowed))
        if script:
            page.add_init_script(script)
        page.goto(address + fragment)
        return viewer

    yield open_page
    for viewer, allowed in opened:
        viewer.page.close()
        said = [text for text in viewer.said if allowed is None or allowed not in text]
        assert said == []
        assert viewer.hosts == set()


# ---- a package of no system ------------------------------------------------------------------

CHECKS = {"seams": {"passed": True, "figure": 0.25}, "holes": {"passed": False, "figure": 3}}
LINEAGE = {"asset": "made", "partition": "one", "version": "v7", "content": "c", "checks": CHECKS}
FIGURES = (
    Figure("RMSE", 0.03, "1", PaperFigure(0.02, "table 2, knit")),
    Figure("size", 1234.0, "bytes"),
)


@pytest.fixture(scope="session")
def content() -> bytes:
    """A package of the conformance suite, with figures and lineage."""
    contents = replace(small_contents(), figures=FIGURES, lineage=(LINEAGE,))
    return write_package(SMALL, contents)


@pytest.fixture
def small(tmp_path: Path, content: bytes) -> Path:
    """Its file."""
    path = tmp_path / "small.tsuya"
    path.write_bytes(content)
    return path


@pytest.fixture
def open_small(open_viewer: Callable[..., ViewerPage]) -> Callable[..., ViewerPage]:
    """``open_viewer`` with a live view of the conformance suite's packages."""
    view = Path(__file__).with_name("conformance_view.js").read_text()

    def open_page(*paths: Path, script: str = "", **options: Any) -> ViewerPage:
        return open_viewer(*paths, script=view + script, **options)

    return open_page
