"""The viewer's page in headless Chromium.

``open_viewer(path, …)`` serves packages as `tsuya view` does and opens the page. When a test ends,
its page must have said nothing in the console, but for what the test allows, and asked no other
host.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from benchmarks.viewer_page import ViewerPage, served_packages
from storage.packages.conformance import SMALL, small_contents
from storage.packages.writing import Figure, PaperFigure, write_package


@pytest.fixture
def served(built_viewer: Path) -> Iterator[Callable[..., str]]:
    """Serves packages of these paths; returns the page's address."""
    with ExitStack() as opened:
        yield lambda *paths: opened.enter_context(served_packages(*paths))


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
