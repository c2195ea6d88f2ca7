"""`tsuya view`: what is served, and to whom."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import threading
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from assets_defs.workspace import CHECKOUT
from storage.packages.conformance import SMALL, small_contents
from storage.packages.writing import write_package
from storage.versions import Slot, VersionedStore
from tsuya import view_server
from tsuya.console import SetUpError
from tsuya.view_server import HOST, PAGE_FILES, Offered, offered_packages, view_app

BASE = f"http://{HOST}:1"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    path = tmp_path / "small.tsuya"
    path.write_bytes(write_package(SMALL, small_contents()))
    return path


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A built page."""
    folder = tmp_path / "dist"
    folder.mkdir()
    for name in PAGE_FILES:
        (folder / name).write_text(f"{name} of a test")
    (folder / "secret.txt").write_text("not for the page")
    monkeypatch.setattr(view_server, "VIEWER", folder)
    return folder


def client(tmp_path: Path, offered: list[Offered], base: str = BASE) -> Any:
    from starlette.testclient import TestClient

    store = VersionedStore(tmp_path / "store")
    return TestClient(view_app(store, offered, "token", tmp_path), base_url=base)


def test_page_list_and_package_lie_below_the_token(
    tmp_path: Path, page: Path, package: Path
) -> None:
    asked = client(tmp_path, [Offered("small.tsuya", package)])
    assert asked.get("/token/").text == "index.html of a test"
    assert asked.get("/token/viewer.js").headers["content-type"].startswith("text/javascript")
    listed = asked.get("/token/packages.json").json()["packages"]
    assert listed == [{"key": "small.tsuya", "file": "packages/0.tsuya"}]
    assert asked.get("/token/packages/0.tsuya").content == package.read_bytes()


def test_packages_are_read_by_ranges(tmp_path: Path, page: Path, package: Path) -> None:
    asked = client(tmp_path, [Offered("small.tsuya", package)])
    content = package.read_bytes()
    for wanted, expected in (("10-19", content[10:20]), ("-7", content[-7:])):
        got = asked.get("/token/packages/0.tsuya", headers={"Range": f"bytes={wanted}"})
        assert (got.status_code, got.content) == (206, expected)
        assert got.headers["content-range"].endswith(f"/{len(content)}")


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/other/",
        "/packages.json",
        "/token/secret.txt",
        "/token/../secret.txt",
        "/token/%2e%2e/store",
        "/token/packages/1.tsuya",
        "/token/packages/small.tsuya",
        "/token/packages/-1.tsuya",
    ],
)
def test_nothing_else_is_served(tmp_path: Path, page: Path, package: Path, path: str) -> None:
    asked = client(tmp_path, [Offered("small.tsuya", package)])
    assert asked.get(path).status_code == 404


def test_the_page_may_ask_no_other_host(tmp_path: Path, page: Path, package: Path) -> None:
    asked = client(tmp_path, [Offered("small.tsuya", package)])
    for path in ("", "viewer.js", "packages.json", "packages/0.tsuya"):
        headers = asked.get(f"/token/{path}").headers
        rule = headers["content-security-policy"]
        assert "default-src 'none'" in rule
        assert "http" not in rule
        assert "*" not in rule
        assert headers["x-content-type-options"] == "nosniff"


def test_a_page_elsewhere_with_a_name_that_points_here_gets_nothing(
    tmp_path: Path, page: Path, package: Path
) -> None:
    offered = [Offered("small.tsuya", package)]
    for base, expected in ((BASE, 200), ("http://localhost:1", 200), ("http://evil.test", 400)):
        assert client(tmp_path, offered, base).get("/token/").status_code == expected


def test_a_package_of_the_store_is_served_by_the_key_of_its_frames(
    tmp_path: Path, page: Path, package: Path
) -> None:
    store = VersionedStore(tmp_path / "store")
    slot = Slot("glass_scratches", "glass_package", "wine.ring")
    content = np.frombuffer(package.read_bytes(), np.uint8)
    record = {"settings": {}, "recipe": "of a test", "checks": []}
    store.write(slot, xr.Dataset({"file": ("byte", content)}), record)
    for keys in ([], [str(slot)], ["glass_scratches/glass_frames/wine.ring"]):
        offered = offered_packages(store, keys)
        assert offered == [Offered(str(slot), slot)]
    asked = client(tmp_path, offered)
    assert asked.get("/token/packages/0.tsuya").content == package.read_bytes()


def test_a_damaged_package_of_the_store_is_named_in_the_terminal(
    tmp_path: Path, page: Path, package: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = VersionedStore(tmp_path / "store")
    slot = Slot("glass_scratches", "glass_package", "wine.ring")
    content = np.frombuffer(package.read_bytes(), np.uint8)
    record = {"settings": {}, "recipe": "of a test", "checks": []}
    store.write(slot, xr.Dataset({"file": ("byte", content)}), record)
    chunks = [path for path in store.folder(slot).rglob("c/*") if path.is_file()]
    chunks[0].unlink()
    asked = client(tmp_path, [Offered(str(slot), slot)])
    assert asked.get("/token/packages/0.tsuya").status_code == 404
    assert "expected what was written" in capsys.readouterr().err


def test_what_cannot_be_shown_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = VersionedStore(tmp_path / "store")
    with pytest.raises(ValueError, match="holds no package; expected some"):
        offered_packages(store, [])
    with pytest.raises(ValueError, match=r"no\.tsuya is not there; expected"):
        offered_packages(store, ["no.tsuya"])
    monkeypatch.setattr(view_server, "VIEWER", tmp_path)
    with pytest.raises(SetUpError, match="run `make setup`"):
        view_app(store, [], "token", tmp_path)


@pytest.mark.slow
def test_the_command_serves_until_it_is_interrupted(package: Path) -> None:
    command = [sys.executable, "-m", "tsuya", "view", str(package)]
    with subprocess.Popen(command, cwd=CHECKOUT, stderr=subprocess.PIPE, text=True) as running:
        ending = threading.Timer(40, running.kill)
        ending.start()
        assert running.stderr is not None
        said = running.stderr.readline()
        found = re.search(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", said)
        assert found, said
        with urllib.request.urlopen(found[0] + "packages.json", timeout=20) as answer:
            assert b"small.tsuya" in answer.read()
        running.send_signal(signal.SIGINT)
        assert running.wait(8) == 0
        ending.cancel()
