"""The viewer's page in headless Chromium: for benchmarks, and for the tests."""

from __future__ import annotations

import base64
import fcntl
import shutil
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray

from assets_defs.workspace import CHECKOUT
from storage.packages import Package
from storage.versions import VersionedStore
from tsuya.view_server import HOST, offered_packages, view_app

FLAGS = ("--enable-unsafe-swiftshader", "--no-sandbox")
_TOKEN = "token"
_LOAD_SECONDS = 60.0
_START_SECONDS = 20.0


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

    def capture(
        self, width: int, height: int, supersampling: int = 1, *, moving: bool = False
    ) -> NDArray[np.uint8]:
        """A frame as the stage draws it, (height, width, 3); ``moving``: as while things move."""
        import cv2

        asked = [width, height, supersampling, moving]
        text = self.evaluate("asked => window.tsuya.capture(...asked)", asked)
        coded = np.frombuffer(base64.b64decode(text), np.uint8)
        bgra: Any = cv2.imdecode(coded, cv2.IMREAD_UNCHANGED)
        return np.ascontiguousarray(bgra[..., 2::-1])

    def psnr(self, package: Package, view: dict[str, Any], **state: Any) -> float:
        """The page's frame of a reference view against the stage's, in dB, in 8-bit display codes.

        state: what is set otherwise than in the view, for a null.
        """
        self.set_view(camera=view["camera"], state=view["state"] | state)
        drawn = self.capture(view["width"], view["height"], view["supersampling"])
        return psnr(drawn, package.picture(view["picture"])[..., :3])

    def screenshot(self, path: Path) -> None:
        """The page as a person sees it."""
        self.page.screenshot(path=str(path))


def psnr(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Of pictures of equal shape, in dB, in 8-bit display codes; 138 dB for equal ones."""
    error = float(np.mean((one.astype(np.float64) - other.astype(np.float64)) ** 2))
    return float(10 * np.log10(255.0**2 / max(error, 1e-9)))


def build_viewer() -> Path:
    """The folder of the built page, made again where a source is newer."""
    with (CHECKOUT / "viewer" / "node_modules.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        subprocess.run([CHECKOUT / "setup" / "build_viewer.sh"], check=True, timeout=300)
    return CHECKOUT / "viewer" / "dist"


@contextmanager
def chromium_browser() -> Iterator[Any]:
    """Playwright's headless Chromium: the system's. Raises FileNotFoundError without one."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    if program is None:
        raise FileNotFoundError("no browser: sudo apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()


@contextmanager
def served_packages(*paths: Path) -> Iterator[str]:
    """Serves packages of these paths as `tsuya view` does; the page's address."""
    import uvicorn

    with TemporaryDirectory() as folder:
        store = VersionedStore(Path(folder) / "no-store")
        offered = offered_packages(store, [str(path) for path in paths])
        app = view_app(store, offered, _TOKEN, Path(folder))
        config = uvicorn.Config(app, host=HOST, port=0, log_level="error", lifespan="off")
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, daemon=True)
        thread.start()
        end = time.monotonic() + _START_SECONDS
        while not server.started and time.monotonic() < end:
            time.sleep(0.01)
        yield f"http://{HOST}:{server.servers[0].sockets[0].getsockname()[1]}/{_TOKEN}/"
        server.should_exit = server.force_exit = True
        thread.join(10)
