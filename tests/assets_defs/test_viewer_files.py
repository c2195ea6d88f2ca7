"""Live views in the web UI: the page and one package, by the server of pictures."""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import dagster as dg
import numpy as np
import pytest
import xarray as xr

from assets_defs import viewer_files
from assets_defs.dagster_metadata import dagster_metadata, live_view_metadata
from assets_defs.picture_links import note_picture_port
from assets_defs.picture_server import PictureServer
from assets_defs.viewer_files import PAGE_FILES, live_view_address
from assets_defs.workspace import Workspace
from storage.versions import Slot

SLOT = Slot("photo_fur", "fur_package", "teapot.my-photo")
CONTENT = bytes(range(256))


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """A data folder with a package, and a built page."""
    page = tmp_path / "dist"
    page.mkdir()
    for name in PAGE_FILES:
        (page / name).write_text(f"{name} of a test")
    (page / "other.txt").write_text("not for the page")
    monkeypatch.setattr(viewer_files, "VIEWER", page)
    workspace = Workspace(tmp_path / "data")
    dataset = xr.Dataset({"file": ("byte", np.frombuffer(CONTENT, np.uint8))})
    record = {"settings": {}, "recipe": "of a test", "checks": []}
    workspace.store.write(SLOT, dataset, record)
    workspace.store.write(Slot("photo_fur", "fur_layers", "grass"), dataset, record)
    return workspace


@pytest.fixture
def port(workspace: Workspace) -> Iterator[int]:
    """Of a server of pictures."""
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    note_picture_port(workspace, listener.getsockname()[1])
    with PictureServer(workspace.root / "full_size", listener) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


def answer(port: int, path: str) -> tuple[int, bytes, str]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path)
    got = connection.getresponse()
    return got.status, got.read(), got.headers.get("Content-Security-Policy", "")


def test_the_link_leads_to_the_page_of_the_package(workspace: Workspace, port: int) -> None:
    address = live_view_address(workspace, SLOT)
    assert address is not None
    shown = live_view_metadata(address)["live view"]
    assert isinstance(shown, dg.UrlMetadataValue)
    found = urlsplit(shown.url)
    assert found.netloc == f"127.0.0.1:{port}"
    status, content, rule = answer(port, found.path)
    assert (status, content) == (200, b"index.html of a test")
    assert "default-src 'none'" in rule
    assert answer(port, f"{found.path}viewer.js")[1] == b"viewer.js of a test"
    (listed,) = json.loads(answer(port, f"{found.path}packages.json")[1])["packages"]
    assert listed["key"] == str(SLOT)
    assert answer(port, found.path + listed["file"])[:2] == (200, CONTENT)


@pytest.mark.parametrize(
    "path",
    [
        "/view/photo_fur/fur_package/teapot.my-photo",
        "/view/photo_fur/fur_package/teapot.my-photo/other.txt",
        "/view/photo_fur/fur_package/teapot.my-photo/../../x",
        "/view/photo_fur/fur_package/other/",
        "/view/photo_fur/fur_layers/grass/package.tsuya",
        "/view/../fur_package/teapot.my-photo/package.tsuya",
        "/views/photo_fur/fur_package/teapot.my-photo/",
        "/view/photo_fur/fur_package/%2e%2e/",
    ],
)
def test_nothing_else_is_served(port: int, path: str) -> None:
    assert answer(port, path)[0] == 404


def test_only_packages_have_a_live_view(workspace: Workspace) -> None:
    assert live_view_address(workspace, Slot("photo_fur", "fur_layers", "grass")) is None
    assert live_view_metadata(None) == {}
    with pytest.raises(ValueError, match="expected another name"):
        dagster_metadata({"live view": 6})
